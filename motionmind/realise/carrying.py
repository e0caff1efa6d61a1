"""Carrying: the root's trajectory as what bears the body carries it, smoothly and in balance."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.contact import contact_points
from motionmind.body.limbs import limb_of_points, limbs_of
from motionmind.body.skeleton import Skeleton
from motionmind.realise.corrections import Correction
from motionmind.realise.feet import SETTLES, Foot, bend_legs, departure, foot_points, track_of
from motionmind.realise.footfalls import Stance, find_stances, standing_costs
from motionmind.realise.least_squares import Rows, difference_rows, position_rows, solve
from motionmind.realise.legs import SOFT
from motionmind.realise.support import nearest_in_support

GRAVITY = 9.81  # metres a second squared
UNDER = 0.02  # metres above the lowest limb at which a limb's share in bearing the body has fallen to 1/e
BEARS = 4  # a limb bears the body by this power of how much it stands: of two feet, mostly the one that stands firmer
TOUCHES = 0.03  # metres above a limb's lowest point below which another point of it touches the floor

# Standard deviations: what a metre is worth in a metre per second, and so on.
HEIGHT = 0.01  # metres that a foot's leg may have to give or take
RIGID = 0.004  # metres that a limb which is no leg may be off the floor
LEANS = 0.08  # metres that a leg leans more than the movement has it when it may not be straight
REACH = 0.002  # metres by which a leg may be too short
PLACE = 0.08  # metres that a standing leg may lean more than the movement has it
PRIOR = 0.3  # metres off the trajectory that the feet have it on by themselves
TRAVEL = 0.3, 0.03  # metres a second off that, where feet alone bear, and where other limbs do
PUSH = 2.0, 2.0  # metres a second squared: accelerations of the centre of mass, level and vertical
OVER = 0.03  # metres of the weight beyond its support
ROOM = 0.03  # metres that the weight may be beyond its support for nothing
OVERHANG = 0.08
NEAR = 0.06  # metres within which a foot is in one place
SWAYS = 0.5  # seconds in which a body that is given beyond its support comes back over it
LOADS = 0.12  # seconds in which a foot takes over the body's weight
ROUNDS = 2, 3  # of placing feet, and of the root in each


class Carried(NamedTuple):
    """A body carried: positions of the root [N, 3], displacements of the feet [N, feet, 3], and the heights of their
    lowest points that these lead to [N, feet], metres."""

    root: Floats
    off: Floats
    heights: Floats


class _Body(NamedTuple):
    """A movement's body relative to its root, and what bears it.

    Attributes:
        places: of the points that may touch the floor [N, P, 3], metres.
        feet: of these, those of each foot [feet, P].
        others: those of each other part: limbs without the feet, and the trunk [parts, P].
        low: height of each foot's lowest point [N, feet], metres.
        low_others: the same of the other parts [N, parts].
        tracks: of the feet [N, feet, 2], metres.
        outward: level unit vectors from the middle of the hips to each leg's [N, feet, 2].
    """

    places: Floats
    feet: Bools
    others: Bools
    low: Floats
    low_others: Floats
    tracks: Floats
    outward: Floats


def _body_of(skeleton: Skeleton, rotations: Floats, feet: list[Foot]) -> _Body:
    places, joints = contact_points(skeleton, rotations, np.zeros((len(rotations), 3)))
    limb = limb_of_points(skeleton)[joints]
    of_feet = np.zeros((len(feet), len(joints)), dtype=np.bool_)
    for number, foot in enumerate(feet):
        of_feet[number] = foot_points(foot, joints, len(skeleton))
    parts = np.arange(len(limbs_of(skeleton)) + 1)
    others = (limb == parts[:, None]) & ~of_feet.any(axis=0)
    hips = places[:, [foot.leg[0] for foot in feet]][..., [0, 2]]
    outward = hips - hips.mean(axis=1, keepdims=True)
    outward /= np.maximum(np.linalg.norm(outward, axis=-1, keepdims=True), 1e-9)
    return _Body(
        places,
        of_feet,
        others,
        _lowest(places, of_feet),
        _lowest(places, others),
        np.stack([track_of(foot, places[:, : 2 * len(skeleton)]) for foot in feet], axis=1)
        if feet
        else np.zeros((len(rotations), 0, 2)),
        outward,
    )


def _lowest(places: Floats, parts: Bools) -> Floats:
    """Return the height of each part's lowest point [N, parts], metres; infinite for a part without points."""
    heights = np.where(parts, places[:, None, :, 1], np.inf)
    return np.asarray(heights.min(axis=-1, initial=np.inf))


def carry(
    skeleton: Skeleton,
    rotations: Floats,
    root: Floats,
    floor: Floats,
    clear: Floats,
    firm: Floats,
    feet: list[Foot],
    fps: float,
    moving: tuple[bool, bool],
    without: Collection[Correction],
) -> Carried:
    """Return the root's trajectory and the feet's displacements for three frames or more, of which the ends stay."""
    body = _body_of(skeleton, rotations, feet)
    count = len(rotations)
    above = np.concatenate([body.low, body.low_others], axis=1)
    above = above - above.min(axis=1, keepdims=True)
    flying = clear > 0.0
    bearing = np.where(
        np.isfinite(above[:, len(feet) :]),
        np.maximum(firm, 1e-3) ** BEARS * np.exp(-np.minimum(above[:, len(feet) :], 1.0) / UNDER),
        0.0,
    )
    bearing[flying] = 0.0
    level = root[:, [0, 2]]
    stances = _stances(body, level, above, firm, bearing, flying, feet, fps)
    anatomy = anatomy_of(skeleton)
    fixed = np.zeros(count, dtype=np.bool_)
    fixed[[0, -1]] = True
    if moving[0]:
        fixed[1] = True
    if moving[1]:
        fixed[-2] = True
    bones = np.linalg.norm(skeleton.offsets, axis=-1)
    lengths = [float(bones[foot.leg[1 : foot.knee + 2]].sum()) for foot in feet]
    start, off, posed = root, np.zeros((count, len(feet), 3)), rotations
    for _ in range(ROUNDS[0]):
        mass = anatomy.centre_of_mass(posed, np.zeros((count, 3))) if anatomy is not None else None
        for _ in range(ROUNDS[1]):
            rows = _rows(skeleton, rotations, body, stances, bearing, floor, clear, root, start, mass, feet, fps, without)
            start = solve(rows, start, fixed)
        for number in range(len(feet)):
            track = body.tracks[:, number] + start[:, [0, 2]]
            height = body.low[:, number] + start[:, 1] - floor
            off[:, number] = departure(track, height, stances[number], lengths[number], fps, moving, "steps" not in without)
        posed = bend_legs(skeleton, rotations, start, feet, off)
    return Carried(start, off, body.low + start[:, 1:2] + off[..., 1])


def foot_heights(skeleton: Skeleton, rotations: Floats, root: Floats, feet: list[Foot]) -> Floats:
    """Return the height of each foot's lowest point [N, feet], metres."""
    places, joints = contact_points(skeleton, rotations, root)
    return _lowest(places, np.stack([foot_points(foot, joints, len(skeleton)) for foot in feet]))


def _stances(
    body: _Body,
    level: Floats,
    above: Floats,
    firm: Floats,
    bearing: Floats,
    flying: Bools,
    feet: list[Foot],
    fps: float,
) -> list[list[Stance]]:
    """Return the stances of all feet; each foot steps where others bear."""
    costs = [standing_costs(above[:, k], firm[:, foot.limb]) for k, foot in enumerate(feet)]
    rigid = bearing.max(axis=1, initial=0.0) > 0.3
    stands = [stand <= swing for stand, swing in costs]
    for k in range(len(feet)):
        # The only foot that bears at both ends, in one place, stays there.
        far = np.linalg.norm(body.tracks[-1, k] + level[-1] - body.tracks[0, k] - level[0])
        alone = all(stands[k][end] and not rigid[end] for end in (0, -1))
        alone = alone and not any(stands[other][end] for other in range(len(feet)) if other != k for end in (0, -1))
        if alone and far < NEAR and not flying.any():
            costs[k] = np.zeros(len(level)), np.full(len(level), 1e3)
            stands[k] = np.ones(len(level), dtype=np.bool_)
    out: list[list[Stance]] = [[] for _ in feet]
    for _ in range(2):
        for k in range(len(feet)):
            others = np.any([stands[other] for other in range(len(feet)) if other != k] + [rigid], axis=0)
            out[k] = find_stances(body.tracks[:, k] + level, np.ascontiguousarray(body.outward[:, k]), *costs[k], others, flying, fps)
            stands[k] = np.zeros(len(level), dtype=np.bool_)
            for stance in out[k]:
                stands[k][stance.start : stance.end + 1] = True
    return out


def _loads(stances: list[Stance], count: int, fps: float) -> Floats:
    """Return how much of the weight a foot may bear at each frame [N]: 1 well within a stance, less at its ends."""
    out = np.zeros(count)
    for stance in stances:
        frames = np.arange(stance.start, stance.end + 1)
        since = frames - stance.start + 1 if stance.start > 0 else np.full(len(frames), np.inf)
        until = stance.end - frames + 1 if stance.end < count - 1 else np.full(len(frames), np.inf)
        s = np.minimum(np.minimum(since, until) / (LOADS * fps), 1.0)
        out[frames] = s * s * (3.0 - 2.0 * s)
    return out


def _rows(
    skeleton: Skeleton,
    rotations: Floats,
    body: _Body,
    stances: list[list[Stance]],
    bearing: Floats,
    floor: Floats,
    clear: Floats,
    prior: Floats,
    root: Floats,
    mass: Floats | None,
    feet: list[Foot],
    fps: float,
    without: Collection[Correction],
) -> list[Rows]:
    """Return the rows of the root's least squares around a trajectory `root` [N, 3]."""
    count = len(root)
    every = np.arange(count)
    x, y, z = np.eye(3)
    flying = clear > 0.0
    centre = np.zeros((count, 3)) if mass is None else mass
    rows = []

    # The trajectory that feet have it on by themselves.
    rigid = np.minimum(bearing.max(axis=1, initial=0.0), 1.0)
    for axis in (0, 2):
        rows.append(position_rows(every, np.eye(3)[[axis] * count], prior[:, axis], np.full(count, PRIOR**-2.0)))
        share = 0.5 * (rigid[1:-1] + rigid[:-2])
        rows.append(
            difference_rows(
                axis,
                (-fps, fps, 0.0),
                fps * np.diff(prior[:, axis])[:-1],
                (1.0 - share) * TRAVEL[0] ** -2.0 + share * TRAVEL[1] ** -2.0,
            )
        )

    # Smoothness of the centre of mass.
    for axis, spread in zip(range(3), (PUSH[0], PUSH[1], PUSH[0]), strict=True):
        weights = np.full(count - 2, spread**-2.0)
        if axis == 1 and "bounce" in without:
            weights *= 1e-4
        accelerates = -(fps**2) * np.diff(centre[:, axis], 2)
        rows.append(difference_rows(axis, (fps**2, -2.0 * fps**2, fps**2), accelerates, weights))
        # It leaves the ends as the trajectory does that feet have it on by themselves.
        for first in (0, count - 3):
            shares = (-(fps**2), fps**2, 0.0) if first == 0 else (0.0, -(fps**2), fps**2)
            leaves = np.diff(prior[first : first + 3, axis]) @ (fps**2 * (np.array(shares)[[1, 2]] > 0.0))
            row = difference_rows(axis, shares, np.array([leaves]), weights[:1])
            rows.append(row._replace(first=np.array([first])))

    # Heights of what bears.
    borne = np.zeros(count)
    places = np.zeros((count, len(feet), 2))
    loads = np.zeros((count, len(feet)))
    for number in range(len(feet)):
        load = _loads(stances[number], count, fps)
        loads[:, number] = load
        borne += load
        settle = np.zeros(count)
        for stance in stances[number]:
            here = slice(stance.start, stance.end + 1)
            share = np.linspace(0.0, 1.0, stance.end + 1 - stance.start)[:, None]
            places[here, number] = stance.place + share * stance.slip
            if "steps" in without:
                places[here, number] = body.tracks[here, number] + prior[here][:, [0, 2]]
        height = floor + settle - body.low[:, number]
        rows.append(position_rows(every, np.tile(y, (count, 1)), height, load * HEIGHT**-2.0))
        for axis in (0, 1):
            target = places[:, number, axis] - body.tracks[:, number, axis]
            rows.append(position_rows(every, np.eye(3)[[2 * axis] * count], target, load * PLACE**-2.0))
    for part in range(body.low_others.shape[1]):
        if not np.isfinite(body.low_others[0, part]):
            continue
        height = floor - body.low_others[:, part]
        sunk = (root[:, 1] < height) & ~flying
        weights = np.where(sunk, 1.0, bearing[:, part]) * RIGID**-2.0
        borne += bearing[:, part]
        rows.append(position_rows(every, np.tile(y, (count, 1)), height, weights))
    low = np.minimum(body.low.min(axis=1, initial=np.inf), body.low_others.min(axis=1, initial=np.inf))
    rows.append(
        position_rows(every, np.tile(y, (count, 1)), floor + clear - low, np.where(flying, RIGID**-2.0, 0.01 * HEIGHT**-2.0))
    )

    # Legs that are too short for where the foot should be.
    if feet:
        joints = skeleton.positions_and_tips(rotations, np.zeros((count, 3)))
        for number, foot in enumerate(feet):
            chain = [*foot.leg, foot.leg[-1] + len(skeleton)][foot.knee - 1 : foot.knee + 2]
            hip, knee, end = (joints[:, joint] for joint in chain)
            longest = np.linalg.norm(knee - hip, axis=-1) + np.linalg.norm(end - knee, axis=-1)
            now = np.linalg.norm(end - hip, axis=-1)
            moved = np.zeros((count, 3))
            moved[:, [0, 2]] = places[:, number] - body.tracks[:, number]
            moved[:, 1] = floor - body.low[:, number]
            # A leg may be as long as the movement has it, but leaning elsewhere not quite straight.
            leans = np.hypot(moved[:, 0] - root[:, 0], moved[:, 2] - root[:, 2]) / LEANS
            limit = np.maximum(1.0 - SOFT, np.minimum(now / longest, 1.0 - SOFT * np.minimum(leans**2, 1.0))) * longest
            aim = end + moved - hip  # from the hip, less the root
            leg = aim - root
            length = np.linalg.norm(leg, axis=-1)
            unit = leg / np.maximum(length, 1e-9)[:, None]
            short = (length > limit - 1e-3) & (loads[:, number] > 0.0)
            target = np.sum(unit * aim, axis=-1) - limit
            near = np.minimum(np.minimum(every, every[::-1]) / (SETTLES * fps), 1.0)
            firmly = np.where(short, near**2 * REACH**-2.0, 0.0)
            rows.append(position_rows(every, unit, target, firmly))

    # Balance.
    if mass is not None and "balance" not in without:
        rows += _balance_rows(body, places, loads, bearing, floor, flying, root, mass, fps)
    return rows


def _balance_rows(
    body: _Body,
    places: Floats,
    loads: Floats,
    bearing: Floats,
    floor: Floats,
    flying: Bools,
    root: Floats,
    mass: Floats,
    fps: float,
) -> list[Rows]:
    """Return rows that keep the zero-moment point over the support."""
    level = np.ascontiguousarray(body.places[:, :, [0, 2]] + root[:, None, [0, 2]])
    touches = np.zeros(level.shape[:2], dtype=np.bool_)
    for number in range(loads.shape[1]):
        points = body.feet[number]
        level[:, points] += (places[:, number] - body.tracks[:, number] - root[:, [0, 2]])[:, None]
        near = body.places[:, points, 1] < body.low[:, number, None] + TOUCHES
        touches[:, points] = near & (loads[:, number] > 0.0)[:, None]
    for part in range(bearing.shape[1]):
        points = body.others[part]
        near = body.places[:, points, 1] < body.low_others[:, part, None] + TOUCHES
        touches[:, points] = near & (bearing[:, part] > 0.3)[:, None]
    height = np.maximum(root[:, 1] + mass[:, 1] - floor, 0.1)[1:-1] / GRAVITY * fps**2
    centre = (root + mass)[:, [0, 2]]
    pressure = centre.copy()
    pressure[1:-1] -= height[:, None] * np.diff(centre, 2, axis=0)
    rows = []
    for point, lever, room in ((pressure, height, ROOM), (centre, 0.0 * height, OVERHANG)):
        nearest = nearest_in_support(level, touches, point)
        beyond = point - nearest
        far = np.linalg.norm(beyond, axis=1, keepdims=True)
        # Ends may be beyond it; the body comes back from there, and goes there, within a while.
        since = np.minimum(np.arange(len(far)) / (SWAYS * fps), 1.0)[:, None]
        fades = 1.0 - since * since * (3.0 - 2.0 * since)
        allowed = np.maximum(np.maximum(far[0] * fades, far[-1] * fades[::-1]), room)
        target = nearest + beyond * np.minimum(allowed / np.maximum(far, 1e-9), 1.0)
        weights = np.where((far > allowed)[:, 0] & ~flying & touches.any(axis=1), OVER**-2.0, 0.0)[1:-1]
        for k, axis in enumerate((0, 2)):
            own = mass[1:-1, axis] - lever * np.diff(mass[:, axis], 2)
            coefficients = np.zeros((len(weights), 9))
            coefficients[:, axis] = -lever
            coefficients[:, 3 + axis] = 1.0 + 2.0 * lever
            coefficients[:, 6 + axis] = -lever
            rows.append(Rows(np.arange(len(weights)), coefficients, target[1:-1, k] - own, weights))
    return rows
