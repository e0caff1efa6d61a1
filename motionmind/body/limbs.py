"""Partitions of a body's joints, each with its own purpose.

- `limbs_of`: limbs by the skeleton's tree alone, from the last fork to each leaf. Physics uses them: which limb stands,
  which is a leg. If an arm forks into thumb and fingers, these are the limbs, and the arm belongs to the trunk.
- `limb_of_points`: the same, as an index for each joint and tip; points of no limb belong to the trunk.
- `parts_of`: overlapping parts in three sizes, for the mean of corpus walks (`motionmind.walks.mean_walk`): the whole
  body, its lower and upper half, and trunk and limbs. The limbs are those of `limbs_of`.
- `sided_parts`: limbs by side, from the names of joints: a whole arm, from the clavicle to all its fingers, is one
  part. These are the limbs that a viewer sees, for shuffling limbs against each other and for phrases of a limb.

The first three follow from the tree and work on any body. The last needs the sides, and differs wherever a limb
branches or joints of one side hang from a common stem; neither can stand in for the other.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache

import numpy as np

from motionmind._typing import Ints
from motionmind.body.mirror import MIDDLE, sides_of
from motionmind.body.skeleton import Skeleton, remembered

TRUNK = "trunk"


def stem_of(skeleton: Skeleton) -> list[int]:
    """Return the joints from the root to the first fork; a rig may have roots of its own above the pelvis."""
    out = [0]
    while len(children := skeleton.children(out[-1])) == 1:
        out += children
    return out


def limbs_of(skeleton: Skeleton) -> list[list[int]]:
    """Return the joints of each limb, outward: a leaf and the joints that lead to it from the last fork.

    On a person these are the legs, the arms, and neck with head.
    """
    return [[*limb] for limb in _limbs_of(skeleton.parents)]


@lru_cache(maxsize=64)
def _limbs_of(parents: tuple[int, ...]) -> tuple[tuple[int, ...], ...]:
    """Return the joints of each limb of a tree of joints, given the index of each joint's parent."""
    limbs, children = [], Counter(parents)
    for leaf in (joint for joint in range(1, len(parents)) if joint not in children):
        limb = [leaf]
        while (above := parents[limb[0]]) > 0 and children[above] == 1:
            limb.insert(0, above)
        limbs.append(tuple(limb))
    return tuple(limbs)


@remembered
def limb_of_points(skeleton: Skeleton) -> Ints:
    """Return the index in `limbs_of` of the limb of each joint, then of each tip [2 J].

    Points of no limb belong to the trunk; its index is the number of limbs.
    """
    limbs = limbs_of(skeleton)
    out = np.full(len(skeleton), len(limbs), dtype=np.int64)
    for number, limb in enumerate(limbs):
        out[limb] = number
    out = np.concatenate([out, out])
    out.setflags(write=False)
    return out


def parts_of(skeleton: Skeleton) -> tuple[Ints, ...]:
    """Return the joints of parts of a body in three sizes; each joint is in one part of each size.

    In this order: the whole; the carrying part, and the carried part (if any); the trunk, with the joints of no limb,
    and the limbs. The carrying part is the root, down to the first fork, and the limbs that start there: pelvis and
    legs.
    """
    limbs, stem = limbs_of(skeleton), stem_of(skeleton)
    every = list(range(len(skeleton)))
    carrying = [*stem, *(joint for limb in limbs if skeleton.parents[limb[0]] == stem[-1] for joint in limb)]
    carried = [joint for joint in every if joint not in carrying]
    trunk = [joint for joint in every if not any(joint in limb for limb in limbs)]
    parts = (every, carrying, carried, trunk, *limbs)
    return tuple(np.array(part, dtype=np.int64) for part in parts if part)


def sided_parts(skeleton: Skeleton) -> dict[str, Ints]:
    """Return the joints of each sided limb, by the name of its first joint, and of the trunk (`TRUNK`).

    A sided limb is a branch of left or right joints, from the middle of the body outward. A person has two arms and two
    legs, from the clavicles and the hips; an insect has six legs and two feelers.
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
