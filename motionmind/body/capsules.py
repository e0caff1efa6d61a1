"""A body's limbs as capsules, and how deep they are in each other.

A capsule is a segment with a radius at each end. People have them: bodies with the joints of human23, whatever joints
lie between and beyond. Of other bodies it is not known how thick they are: they have no capsules, and nothing of them
is ever inside anything else.

The radii are about two thirds of a limb's own, for flesh gives way and recordings err. They were chosen so that the
dancers of `cmu-05` and `cmu-16` have hardly ever a leg more than 3 cm inside the other (0.6 and 0 % of windows of a
second; of `cmu-135`, on which nothing was chosen, 0.5 %). Thighs begin below the hips, where they touch anyhow.
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
        begins, ends: where between them it lies, as shares of the way.
        radii: its radii at both ends, metres, of a person 1.70 m tall.
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
        names: of the capsules [C], as "left_thigh".
        points: the points between which each lies, as `Skeleton.positions_and_tips` counts them [C, 2].
        shares: how far its ends are from the first of them to the second [C, 2].
        radii: at both ends [C, 2], metres.
    """

    names: tuple[str, ...]
    points: Ints
    shares: Floats
    radii: Floats

    def place(self, positions: Floats) -> Floats:
        """Return the ends [..., C, 2, 3], metres, from the `positions_and_tips` [..., 2 J, 3] of the skeleton."""
        first, second = (np.take(positions, self.points[:, end : end + 1], axis=-2) for end in range(2))
        return np.asarray(first + self.shares[..., None] * (second - first))

    def pairs(self) -> Ints:
        """Return the pairs of capsules that could pass through each other [P, 2].

        They are a leg and the other; an arm and the other; forearms and hands with trunk, head and legs.
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
    """Return the capsules of a body; none if it is no person."""
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
    """Return how deep limbs are in each other [...], metres, by pairs of them; 0 where they are apart.

    A pair's depth is by how much the sum of the radii exceeds the distance where the capsules' axes are nearest.

    Args:
        skeleton: the body.
        rotations: local rotations [..., J, 4].

    Returns:
        Depths by the names of both limbs, as ("left_shank", "right_shank"); nothing for a body without capsules.
    """
    capsules = capsules_of(skeleton)
    pairs = capsules.pairs()
    depths = _depths(skeleton, rotations, capsules, pairs)
    return {(capsules.names[one], capsules.names[other]): depths[..., k] for k, (one, other) in enumerate(pairs)}


def legs_depth(skeleton: Skeleton, rotations: Floats) -> Floats:
    """Return how deep a body's two legs are in each other [...], metres; 0 where they are apart.

    Args:
        skeleton: the body; one without capsules has its legs always apart.
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
    """Return how deep pairs of capsules are in each other [T, P], metres, in which direction the first lies, and where.

    Depths are negative where the pair is apart; directions are unit vectors from the nearest point of the second's
    axis to the first's [T, P, 3], or 0 where they meet. Last come the shares of the way along both axes at which these
    points are [T, P, 2].

    Args:
        ends: of the capsules' axes [T, C, 2, 3], metres.
        radii: at both ends [C, 2], metres.
        pairs: numbers of capsules [P, 2].
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
    """Return a capsule's radius, metres, at a share of the way between its ends, from its radii there [2]."""
    return float(radii[0] + share * (radii[1] - radii[0]))
