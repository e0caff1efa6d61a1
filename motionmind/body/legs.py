"""Legs of two long bones: find them in a body, and the axes about which their knees bend."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.limbs import limbs_of, stem_of
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.geometry import rotations as rot


@remembered
def find_legs(skeleton: Skeleton) -> tuple[list[int], list[tuple[list[int], int]]]:
    """Find the legs of a body: limbs of at least two bones at the root, or at the first fork below it.

    Args:
        skeleton: the body.

    Returns:
        The legs' indices in `limbs_of`; and for each leg its joints, outward, and the index among them of its knee, the
        joint between its two longest neighbouring bones.
    """
    numbers, out, above = [], [], stem_of(skeleton)[-1]
    lengths, ends = rot.norm(skeleton.offsets), rot.norm(skeleton.tips)
    for number, limb in enumerate(limbs_of(skeleton)):
        if skeleton.parents[limb[0]] != above or len(limb) < 2:
            continue
        bones = [*lengths[limb[1:]].tolist(), float(ends[limb[-1]])]
        pairs = [min(pair) for pair in pairwise(bones)]
        if max(pairs) > 0.0:
            numbers.append(number)
            out.append((limb, pairs.index(max(pairs)) + 1))
    return numbers, out


def find_hinge(skeleton: Skeleton, knee: int) -> Floats | None:
    """Return the axis [3] about which a knee bends, in its own frame; None without an anatomy.

    It is the axis of the angle with the greatest range, in the sense of the larger limit.
    """
    anatomy = anatomy_of(skeleton)
    if anatomy is None:
        return None
    name = skeleton.names[knee]
    joint, described = anatomy.anatomy(name)
    angle = max(described.angles.values(), key=lambda one: one.range[1] - one.range[0])
    axis = np.eye(3)[angle.axis] * angle.sign * np.sign(sum(angle.range))
    # Mirroring a rotation mirrors its axis and reverses its sense.
    mirrored = anatomy.paired(joint) and name.startswith("right_")
    return np.asarray(axis * np.array([1.0, -1.0, -1.0]) if mirrored else axis)
