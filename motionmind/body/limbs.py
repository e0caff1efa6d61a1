"""Limbs: which joints a leg, an arm or the trunk are made of, told from the skeleton's tree."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Ints
from motionmind.body.mirror import MIDDLE, sides_of
from motionmind.body.skeleton import Skeleton


def stem_of(skeleton: Skeleton) -> list[int]:
    """The joints from the root to the first fork, where a rig's own root or two may lie above the pelvis."""
    out = [0]
    while len(children := skeleton.children(out[-1])) == 1:
        out += children
    return out


def limbs_of(skeleton: Skeleton) -> list[list[int]]:
    """The joints of each limb, outward: a leaf and what leads to it from the last fork, as a leg, an arm, neck and
    head."""
    chains = []
    for end in (joint for joint in range(1, len(skeleton)) if not skeleton.children(joint)):
        chain = [end]
        while (above := skeleton.parents[chain[0]]) > 0 and len(skeleton.children(above)) == 1:
            chain.insert(0, above)
        chains.append(chain)
    return chains


def limb_of_points(skeleton: Skeleton) -> Ints:
    """To which of `limbs_of` each joint belongs, then each tip [2 J]; to one more, the trunk, what belongs to none."""
    sided_parts = limbs_of(skeleton)
    out = np.full(len(skeleton), len(sided_parts), dtype=np.int64)
    for number, limb in enumerate(sided_parts):
        out[limb] = number
    return np.concatenate([out, out])


def parts_of(skeleton: Skeleton) -> tuple[Ints, ...]:
    """The joints of parts of a body, each joint in one of each size: the whole; what carries it, and what is carried
    (if anything is); the trunk, which is what is left, and the limbs.

    What carries the body is its root, down to the first fork, and the limbs that hang there: pelvis and legs.
    """
    chains, above = limbs_of(skeleton), stem_of(skeleton)
    every = list(range(len(skeleton)))
    carrying = [*above, *(joint for chain in chains if skeleton.parents[chain[0]] == above[-1] for joint in chain)]
    carried = [joint for joint in every if joint not in carrying]
    trunk = [joint for joint in every if not any(joint in chain for chain in chains)]
    found = (every, carrying, carried, trunk, *chains)
    return tuple(np.array(part, dtype=np.int64) for part in found if part)


TRUNK = "trunk"


def sided_parts(skeleton: Skeleton) -> dict[str, Ints]:
    """The body's parts: the joints of each limb, under the name of its first joint, and of the trunk.

    A limb is a branch of joints of the left or the right side, as it hangs from the middle: two arms and two legs on a
    person, from the clavicles and the hips, six legs and two feelers on an insect.
    """
    sides = sides_of(skeleton)
    parts: dict[str, list[int]] = {TRUNK: []}
    part_of: list[str] = []
    for joint, (name, parent) in enumerate(zip(skeleton.names, skeleton.parents, strict=True)):
        if sides[joint] == MIDDLE:
            part = TRUNK
        elif parent >= 0 and sides[parent] == sides[joint]:
            part = part_of[parent]
        else:
            part = name
        part_of.append(part)
        parts.setdefault(part, []).append(joint)
    return {part: np.array(joints, dtype=np.int64) for part, joints in parts.items()}
