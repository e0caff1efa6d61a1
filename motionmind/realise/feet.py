"""Planted feet: keep feet where they stand, by their legs, which one root cannot do for two feet.

Each foot is given a *track* near its original one, on which it hardly moves while it is near the floor; where it has to
get elsewhere in so short a time that it would slide, it is lifted in a step (`motionmind.realise.tracks`). The root
moves along as far as the legs would otherwise have to bend or stretch, and the legs follow by inverse kinematics of
their two long bones (`motionmind.realise.legs`); the feet keep their orientations. The constants were chosen on other
recordings than those that experiments/inbetween reports.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import limb_heights
from motionmind.body.limits import within_limits
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.realise.legs import find_legs, reach
from motionmind.realise.root import BEARS, stand
from motionmind.realise.tracks import departure, fade_at_ends

UNDER = 0.02  # metres above the lowest limb at which a limb's share in bearing the body has fallen to 1/e
STANDS = 0.055  # metres above the floor below which another foot stands, so that this one may step
STAY = 0.3  # weight of the root's staying on its trajectory, that of a leg's keeping its length being 1


def plant_feet(
    skeleton: Skeleton,
    rotations: Floats,
    root: Floats,
    heights: Floats,
    clearance: Floats,
    stands: Floats,
    loose: Bools,
    fixed: Bools,
    fps: float,
    given: Floats,
) -> tuple[Floats, Floats]:
    """Return the same movement with feet that stay where they stand.

    Only the root and the legs change. A leg is a limb of two bones or more that hangs from the root, or from the first
    fork below it. Its joints are finally brought within their limits, which may take its foot a little off its track,
    but not into the floor. The body rests on the limbs that stand: where a foot that does not stand is lower, its leg
    bends, and the body is not lifted onto it.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres, of any height.
        heights: height that the body's lowest point is to have at each frame [N], metres.
        clearance: the same above the floor [N], metres.
        stands: how firmly each limb, and last the trunk, is to stand where it is low, between frames
            [N - 1, limbs + 1], from 0 to 1.
        loose: joints without limits [J].
        fixed: joints that must not change [J]; nor do the others of their leg, whose foot then stands as it may.
        fps: frames a second.
        given: times of postures that must not change, in frames, whole or not, from the first frame to the last [G].
            The frames next to them do not change either.

    Returns:
        Local rotations [N, J, 4], positions of the root [N, 3], metres.
    """
    numbers, legs = find_legs(skeleton)
    if not legs:
        return rotations, stand(skeleton, rotations, root, heights)
    rotations, root, floor = rotations.copy(), root.copy(), heights - clearance
    low = limb_heights(skeleton, rotations, root)
    lift = heights - low.min(axis=1)
    root[:, 1] += lift
    low += lift[:, None]
    free = [not fixed[leg].any() for leg, _ in legs]
    sunk = _sink_depth(low, stands)
    for start, end in pairwise(given):
        # Rounded: a posture that falls on a frame but for rounding errors keeps that frame.
        part = slice(int(np.ceil(start - 1e-6)), int(end + 1e-6) + 1)
        if part.stop - part.start > 2:
            sink = np.maximum(sunk[part] - np.linspace(sunk[part][0], sunk[part][-1], len(sunk[part])), 0.0)
            sink *= fade_at_ends(len(sink), fps)
            root[part, 1] -= sink
            under = np.maximum(heights[part, None] - (low[part][:, numbers] - sink[:, None]), 0.0)
            stretch = rotations[part], root[part], floor[part], under, stands[part.start : part.stop - 1, numbers]
            rotations[part], root[part] = _plant_stretch(skeleton, legs, *stretch, loose, free, fps)
    return rotations, stand(skeleton, rotations, root, heights)


def _plant_stretch(
    skeleton: Skeleton,
    legs: list[tuple[list[int], int]],
    rotations: Floats,
    root: Floats,
    floor: Floats,
    under: Floats,
    stands: Floats,
    loose: Bools,
    free: Sequence[bool],
    fps: float,
) -> tuple[Floats, Floats]:
    """Return rotations and root of three frames or more with planted feet; the first and the last do not change.

    Arguments are those of `plant_feet`, of the legs alone, of which those that are `free` may bend; each leg is also
    lifted by as much as it is `under` the height at which the body stands [N, legs], metres.
    """
    turned = skeleton.global_rotations(rotations)
    places = skeleton.positions_and_tips(rotations, root)
    # Both ends of each foot's last bone: one that turns on its ball or on its tip stands.
    ends = [places[:, [leg[-1], leg[-1] + len(skeleton)]] for leg, _ in legs]
    heights = [end[..., 1] - floor[:, None] + lifted[:, None] for end, lifted in zip(ends, under.T, strict=True)]
    off = np.zeros((len(rotations), len(legs), 3))
    feet = [foot for foot, bends in enumerate(free) if bends]
    for foot in feet:
        others = [height.min(axis=1) for other, height in enumerate(heights) if other != foot]
        others_stand = np.min(others, axis=0) < STANDS if others else np.zeros(len(rotations), dtype=np.bool_)
        off[:, foot] = departure(ends[foot], heights[foot], stands[:, foot], others_stand, fps)
        heights[foot] = heights[foot] + off[:, foot, 1:2]
        off[:, foot, 1] += under[:, foot]
    # Hip, knee, and the point that they bring to its place: the next joint, or the tip.
    chains = np.array([[*leg, leg[-1] + len(skeleton)][knee - 1 : knee + 2] for leg, knee in legs])
    # A step only bends the knee; the root moves along with level departures.
    moved = _follow_legs(places[:, chains[:, 2]] - places[:, chains[:, 0]], off * np.array([1.0, 0.0, 1.0]))
    planted = rotations.copy()
    for foot, (hip, knee, end) in enumerate(chains):
        thigh, shank = reach(turned[:, hip], places[:, chains[foot]], places[:, end] + off[:, foot] - moved)
        thigh, shank = rot.mul(thigh, turned[:, hip]), rot.mul(shank, turned[:, knee])
        planted[:, hip] = rot.inv_mul(turned[:, skeleton.parents[hip]], thigh)
        planted[:, knee] = rot.inv_mul(thigh, shank)
        if end < len(skeleton):
            planted[:, end] = rot.inv_mul(shank, turned[:, end])
    joints = [joint for foot in feet for joint in legs[foot][0]]
    out = rotations.copy()
    out[1:-1, joints] = within_limits(skeleton, planted, rotations[[0, -1]], loose)[1:-1, joints]
    return out, root + moved


def _sink_depth(low: Floats, stands: Floats) -> Floats:
    """Return how far the body must sink [N], metres, from resting on its lowest point to resting on limbs that stand.

    This is the mean of the heights h of the limbs' lowest points above the lowest of all, weighted by how firmly the
    limbs stand to the power of BEARS, and by exp(-h / UNDER).

    Args:
        low: height of each limb's lowest point [N, limbs + 1], metres.
        stands: how firmly each limb stands between frames [N - 1, limbs + 1], from 0 to 1.
    """
    still = np.concatenate([stands[:1], 0.5 * (stands[1:] + stands[:-1]), stands[-1:]])
    above = low - low.min(axis=1, keepdims=True)
    weights = np.maximum(still, 1e-3) ** BEARS * np.exp(-above / UNDER)
    return np.asarray(np.sum(weights * np.where(weights > 0.0, above, 0.0), axis=1) / weights.sum(axis=1))


def _follow_legs(legs: Floats, off: Floats) -> Floats:
    """Return the root's displacement [N, 3], metres, by which legs hardly change their lengths.

    It is the r for which sum_l (u_l . (off_l - r))^2 + STAY |r|^2 is least, with u_l the direction of leg l: 0 where
    no foot departs from its place.

    Args:
        legs: vectors from the hip to the end of each leg [N, L, 3], metres.
        off: displacement of that end [N, L, 3], metres.
    """
    along = legs / np.maximum(np.linalg.norm(legs, axis=-1, keepdims=True), 1e-9)
    system = np.einsum("nli,nlj->nij", along, along) + STAY * np.eye(3)
    pull = np.einsum("nli,nlj,nlj->ni", along, along, off)
    return np.asarray(np.linalg.solve(system, pull[..., None])[..., 0])
