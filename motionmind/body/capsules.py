"""A body's limbs as capsules, and their penetration depths.

A capsule is a segment with a radius at each end. A body with the joints of human23, and any joints between and beyond
them, has capsules. The thickness of other bodies is unknown: they have no capsules, and never penetrate themselves.

The radii are about two thirds of a limb's, as flesh is soft and recordings are inexact. They were chosen on `cmu-05`
and `cmu-16`, where one leg is more than 3 cm inside the other in only 0.6 and 0 % of one-second windows. In `cmu-135`,
which had no part in the choice, it is 0.5 %. Capsules of thighs begin below the hips, where thighs touch anyway.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.anatomy import SIDES
from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.geometry.segments import nearest_points
from motionmind.jit import jit

LEG = ("thigh", "shank", "foot", "toes")
ARM = ("upper_arm", "forearm", "hand")


class _Shape(NamedTuple):
    """A capsule between two joints of human23.

    Attributes:
        start, end: the joints, without a side; an `end` with "_tip" is the far end of the chain that begins there.
        begins, ends: its range between them, as shares of their distance.
        radii: its radii at both ends, metres, for a person 1.70 m tall.
    """

    start: str
    end: str
    begins: float
    ends: float
    radii: tuple[float, float]


_SIDED = {
    "thigh": _Shape("hip", "knee", 0.4, 1.0, (0.055, 0.042)),
    "shank": _Shape("knee", "ankle", 0.0, 1.0, (0.042, 0.030)),
    "foot": _Shape("ankle", "toes", 0.0, 1.0, (0.030, 0.022)),
    "toes": _Shape("toes", "toes_tip", 0.0, 1.0, (0.022, 0.015)),
    "upper_arm": _Shape("shoulder", "elbow", 0.0, 1.0, (0.040, 0.032)),
    "forearm": _Shape("elbow", "wrist", 0.0, 1.0, (0.032, 0.022)),
    "hand": _Shape("wrist", "fingers_tip", 0.0, 1.0, (0.022, 0.010)),
}
_MIDDLE = {
    "trunk": _Shape("pelvis", "cervical", 0.0, 0.85, (0.090, 0.090)),
    "head": _Shape("atlantal", "atlantal_tip", 0.3, 0.6, (0.075, 0.075)),
}


class Capsules(NamedTuple):
    """The capsules of a body.

    Attributes:
        names: names of the capsules, such as "left_thigh" [C].
        points: indices in `Skeleton.positions_and_tips` of the two points that each lies between [C, 2].
        shares: positions of its ends between these points, 0 to 1 [C, 2].
        radii: radii at both ends [C, 2], metres.
    """

    names: tuple[str, ...]
    points: Ints
    shares: Floats
    radii: Floats

    def place(self, positions: Floats) -> Floats:
        """Return the ends [..., C, 2, 3], metres, given the `positions_and_tips` [..., 2 J, 3] of the skeleton."""
        first, second = (np.take(positions, self.points[:, end : end + 1], axis=-2) for end in range(2))
        return np.asarray(first + self.shares[..., None] * (second - first))

    def pairs(self) -> Ints:
        """Return the pairs of capsules that could pass through each other [P, 2].

        They are one leg with the other, one arm with the other, and forearms and hands with trunk, head and legs.
        """
        return _pairs(self.names).copy()


@lru_cache(maxsize=4)
def _pairs(names: tuple[str, ...]) -> Ints:
    """Return the pairs of `Capsules.pairs`, by the capsules' names."""
    legs, arms = (
        [[number for number, name in enumerate(names) if name in _sided(side, parts)] for side in SIDES]
        for parts in (LEG, ARM)
    )
    lower = [number for number, name in enumerate(names) if name.endswith(("forearm", "hand"))]
    rest = [number for number, name in enumerate(names) if name in _MIDDLE or name.endswith(LEG)]
    chosen = [(one, other) for limbs in (legs, arms) for one in limbs[0] for other in limbs[1]]
    chosen += [(one, other) for one in lower for other in rest]
    return np.array(chosen, dtype=np.int64).reshape(-1, 2)


@remembered
def capsules_of(skeleton: Skeleton) -> Capsules:
    """Return the capsules of a body; none unless it has the joints of human23."""
    names, parents = skeleton.names, skeleton.parents
    if not set(human23().names) <= set(names):
        return Capsules((), np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2)), np.zeros((0, 2)))
    shapes = {f"{side}_{part}": (f"{side}_", shape) for side in SIDES for part, shape in _SIDED.items()}
    shapes |= {part: ("", shape) for part, shape in _MIDDLE.items()}
    points, size = [], skeleton.height / human23().height
    for prefix, shape in shapes.values():
        start, end = names.index(prefix + shape.start), names.index(prefix + shape.end.removesuffix("_tip"))
        if shape.end.endswith("_tip"):
            while parents.count(end) == 1:
                end = parents.index(end)
            end += len(names)
        points.append([start, end])
    return Capsules(
        tuple(shapes),
        np.array(points, dtype=np.int64),
        np.array([[shape.begins, shape.ends] for _, shape in shapes.values()]),
        size * np.array([shape.radii for _, shape in shapes.values()]),
    )


def penetration(skeleton: Skeleton, rotations: Floats) -> dict[tuple[str, str], Floats]:
    """Return the penetration depth [...] of each pair of limbs, metres; 0 where they are apart.

    The depth is the excess of the sum of the radii over the distance, where the capsules' axes are nearest.

    Args:
        skeleton: the body.
        rotations: local rotations [..., J, 4].

    Returns:
        Depths by the names of both limbs, such as ("left_shank", "right_shank"); empty for a body without capsules.
    """
    capsules = capsules_of(skeleton)
    pairs = capsules.pairs()
    depths = _depths(skeleton, rotations, capsules, pairs)
    return {(capsules.names[one], capsules.names[other]): depths[..., k] for k, (one, other) in enumerate(pairs)}


def legs_depth(skeleton: Skeleton, rotations: Floats) -> Floats:
    """Return the greatest penetration depth of a body's two legs [...], metres; 0 where they are apart.

    Args:
        skeleton: the body; without capsules, its legs are always apart.
        rotations: local rotations [..., J, 4].
    """
    capsules = capsules_of(skeleton)
    legs = [number for number, name in enumerate(capsules.names) if name.endswith(LEG)]
    pairs = capsules.pairs()
    pairs = pairs[np.isin(pairs, legs).all(axis=1)]
    return np.asarray(_depths(skeleton, rotations, capsules, pairs).max(axis=-1, initial=0.0))


def _depths(skeleton: Skeleton, rotations: Floats, capsules: Capsules, pairs: Ints) -> Floats:
    """Return the depths of pairs of capsules [..., P], metres."""
    placed = capsules.place(skeleton.positions_and_tips(rotations, np.zeros(3)))
    count = int(np.prod(shape := rotations.shape[:-2], dtype=np.int64))
    depths, _, _ = pair_depths(placed.reshape(count, len(capsules.names), 2, 3), capsules.radii, pairs)
    return np.maximum(depths, 0.0).reshape(*shape, len(pairs))


def _sided(side: str, parts: Collection[str]) -> set[str]:
    return {f"{side}_{part}" for part in parts}


@jit
def pair_depths(ends: Floats, radii: Floats, pairs: Ints) -> tuple[Floats, Floats, Floats]:
    """Return the depths, directions and nearest points of pairs of capsules.

    Depths [T, P], metres, are negative where a pair is apart. Directions [T, P, 3] are unit vectors from the nearest
    point of the second capsule's axis to the nearest point of the first's, or 0 where the axes meet. Nearest points are
    given as shares of the length of both axes [T, P, 2].

    Args:
        ends: ends of the capsules' axes [T, C, 2, 3], metres.
        radii: radii at both ends [C, 2], metres.
        pairs: indices of capsules [P, 2].
    """
    depths, directions = np.empty((len(ends), len(pairs))), np.zeros((len(ends), len(pairs), 3))
    shares = np.empty((len(ends), len(pairs), 2))
    for t in range(len(ends)):
        for p in range(len(pairs)):
            i, j = pairs[p]
            far, s, u = nearest_points(ends[t, i], ends[t, j])
            depths[t, p] = radius_at(radii[i], s) + radius_at(radii[j], u) - far
            shares[t, p, 0], shares[t, p, 1] = s, u
            for k in range(3 if far > 0.0 else 0):
                one = ends[t, i, 0, k] + s * (ends[t, i, 1, k] - ends[t, i, 0, k])
                directions[t, p, k] = (one - ends[t, j, 0, k] - u * (ends[t, j, 1, k] - ends[t, j, 0, k])) / far
    return depths, directions, shares


@jit
def radius_at(radii: Floats, share: float) -> float:
    """Return a capsule's radius, metres, at a share of its length, given the radii at its ends [2]."""
    return float(radii[0] + share * (radii[1] - radii[0]))
