"""Carrying: the root's trajectory as what bears the body carries it, smoothly and in balance.

It is a least-squares solution, found in a few rounds, for some of its rows depend on where the root is: legs that are
too short, parts that would be in the floor, weight that is beyond its support. Standard deviations say what is worth
what; they were chosen on cmu-05 and ballet.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import contact_points
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import centre_of_mass
from motionmind.geometry import rotations as rot
from motionmind.realise.balance import balance_rows, falls_without, is_beyond, walks
from motionmind.realise.bearing import Bearing, Shape, find_bearing, find_staying, lowest, points_of_feet, shape_of
from motionmind.realise.corrections import Correction
from motionmind.realise.feet import SETTLES, Foot, bend_legs, departure, fade_at_ends, pose, softness
from motionmind.realise.flight import HOVERS, SURELY, find_flights, flight_rows, flying_frames, leg_freedom
from motionmind.realise.knees import bend_of, cover, smoothed
from motionmind.realise.least_squares import Rows, difference_rows, position_rows, solve
from motionmind.realise.legs import SOFT

HEIGHT = 0.01, 0.2  # metres that a standing leg gives or takes, and where it may bend for a jump
RIGID = 0.004  # metres that a part which is no foot is off the floor
DETAIL = 0.2  # seconds within which the root smooths the fine detail that it carries; chosen on indian and cmu-05
REACH = 0.002  # metres by which a leg is too short
LEANS = 0.08  # metres that a leg leans more than the movement has it when it may not be straight
PLACE = 0.08  # metres that a standing leg leans more than the movement has it
KNEE = 0.15  # radians that a standing leg's knee bends more or less than the movement has it; chosen on cmu-05
STRAIGHT = 0.15  # radians: a knee that is straighter counts as bent so far, for it turns a leg's length into any bend
PRIOR = 0.3  # metres off the trajectory that feet have the root on by themselves
TRAVEL = 0.3, 0.03  # metres a second off that, where feet alone bear, and where other parts do
PUSH = 2.0  # metres a second squared: accelerations of the centre of mass
HURRY = 0.02  # metres a second by which a body travels faster than it may; chosen on cmu-05
NEARLY = 0.9  # of that speed: from here on it is held to it
TIPTOE = 0.12  # metres above the floor: a body that is no higher at both ends, above one spot, stands there on one foot
ROUNDS = 3, 2  # of placing feet, and of the root in each


class Ends(NamedTuple):
    """The facts that are known of a movement's ends.

    Attributes:
        aloft: share of the corpus's walks that are in the air in each frame [N], from 0 to 1.
        leaps: height of their lowest points above the floor there [N], metres.
        moving: whether the velocity is given in the first and in the last frame.
        rates: vertical velocities of the root there, metres a second; None where unknown.
    """

    aloft: Floats
    leaps: Floats
    moving: tuple[bool, bool]
    rates: tuple[float | None, float | None]


class Carried(NamedTuple):
    """A body carried.

    Attributes:
        root: positions of the root [N, 3], metres.
        off: displacements of the feet from where the rotations have them [N, feet, 3], metres.
        holds: how much each foot holds its place [N, feet], from 0 to 1.
        heights: of the feet's lowest points that these lead to [N, feet], metres.
        bound: how much the feet, and no flight, say how high it is [N], from 0 to 1.
    """

    root: Floats
    off: Floats
    holds: Floats
    heights: Floats
    bound: Floats


def carry(
    skeleton: Skeleton,
    rotations: Floats,
    plain: Floats,
    root: Floats,
    floor: Floats,
    firm: Floats,
    feet: list[Foot],
    known: Ends,
    overhang: float,
    travels: float,
    gravity: float,
    fps: float,
    without: Collection[Correction],
) -> Carried:
    """Return the trajectory of a body's root, and displacements of its feet, in three frames or more.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        plain: the same without fine detail.
        root: positions of the root as feet have it by themselves [N, 3], metres; the first and the last do not change.
        floor: height of the floor [N], metres.
        firm: how firmly each limb, and last the trunk, stands where it is low [N, limbs + 1], from 0 to 1.
        feet: those that may be placed.
        known: what is known of its ends, and of its flights.
        overhang: how far beyond its support the centre of mass may be, metres.
        travels: how fast the body travels at most, metres a second; infinite for any speed.
        gravity: metres a second squared.
        fps: frames a second.
        without: corrections to leave out.
    """
    count = len(rotations)
    shape = shape_of(skeleton, plain, feet)
    mass = _mass(skeleton, plain)
    standing = floor - shape.lowest
    above = root[[0, -1], 1] - standing[[0, -1]]
    staying = find_staying(shape, root[:, [0, 2]]) if above.max() < TIPTOE else None
    hovering = [staying is None and known.aloft[end] > SURELY and above[end] > HOVERS for end in (0, -1)]
    flights = []
    if "flight" not in without and staying is None:
        masses = root[[0, -1], 1] + mass[[0, -1], 1]
        up = standing + mass[:, 1]
        flights = find_flights(
            known.aloft, known.leaps, up, masses, (hovering[0], hovering[1]), known.rates, gravity, fps
        )
    flying, freedom = flying_frames(flights, (hovering[0], hovering[1]), count), leg_freedom(flights, count, fps)
    planned = shape, root[:, [0, 2]], mass[:, [0, 2]], firm, flying, staying, known.moving, feet, fps
    bearing = find_bearing(*planned)
    if "steps" in without:
        bearing = bearing._replace(targets=np.broadcast_to(root[:, None, [0, 2]], bearing.targets.shape))
    fixed = np.zeros(count, dtype=np.bool_)
    fixed[[0, -1]] = True
    fixed[[1, -2]] |= known.moving
    own = pose(skeleton, plain)
    start, off, posed = root, np.zeros((count, len(feet), 3)), plain
    balances = "balance" not in without and bool(mass.any())
    stands = balances and staying is None and "steps" not in without and not walks(root, fps)
    for number_of_round in range(ROUNDS[0]):
        if number_of_round and stands:
            falls = _falls(shape, bearing, start, mass, overhang)
            if falls is not None:
                bearing = find_bearing(*planned, falls)
        mass = _mass(skeleton, posed)
        steady = _smooth_rows(root, mass, fps, 1e-4 if "bounce" in without else 1.0)
        steady += _prior_rows(root, bearing, fps)
        steady += _standing_rows(shape, bearing, floor, freedom)
        steady += flight_rows(flights, mass, standing, gravity, fps)
        for _ in range(ROUNDS[1]):
            rows = [*steady, _sunk_rows(shape, floor, start), _hurry_rows(start, travels, fps)]
            legs = _legs(skeleton, own.places, shape, bearing, floor, start, feet)
            rows += _reach_rows(skeleton, legs, bearing, start, feet, fps)
            rows += _knee_rows(skeleton, legs, bearing, start, feet, freedom)
            if balances:
                points, touches = _points_on_floor(shape, bearing, start), bearing.touching(shape)
                centre, level, height = start + mass, [0, 2], (start + mass)[:, 1] - floor
                rows += balance_rows(points, touches, centre[:, level], mass[:, level], height, overhang, gravity, fps)
            start = solve(rows, start, fixed)
        off = _departures(skeleton, shape, bearing, floor, start, feet, known.moving, fps)
        posed = bend_legs(skeleton, own, feet, off, softness(bearing.holds(fps)))
    detailed = shape if np.array_equal(plain, rotations) else shape_of(skeleton, rotations, feet)
    falls = _mass(skeleton, plain) - _mass(skeleton, rotations)
    start, off, heights = _with_detail(shape, detailed, bearing, falls, flying, start, off, floor, fps)
    return Carried(start, off, bearing.holds(fps), heights, 1.0 - freedom)


def _departures(
    skeleton: Skeleton,
    shape: Shape,
    bearing: Bearing,
    floor: Floats,
    root: Floats,
    feet: list[Foot],
    moving: tuple[bool, bool],
    fps: float,
) -> Floats:
    """Return how far feet are to be from where rotations have them [N, feet, 3], metres, by the root's places."""
    out = np.empty((len(root), len(feet), 3))
    for number, foot in enumerate(feet):
        height = shape.low[:, number] + root[:, 1] - floor
        tracks = shape.tracks[:, number] + root[:, [0, 2]]
        places = shape.tracks[:, number] + bearing.targets[:, number]
        stances, leg = bearing.stances[number], foot.length(skeleton)
        out[:, number] = departure(places, tracks, height, stances, leg, fps, moving)
    return out


def _with_detail(
    plain: Shape,
    detailed: Shape,
    bearing: Bearing,
    falls: Floats,
    flying: Bools,
    root: Floats,
    off: Floats,
    floor: Floats,
    fps: float,
) -> tuple[Floats, Floats, Floats]:
    """Return the root [N, 3], displacements of feet [N, feet, 3] and their heights [N, feet] with fine detail, metres.

    If legs reached for their places from a smooth root, their knees would move for the detail of all other joints: so
    the root moves with it, and in flight so that the centre of mass does not. Feet that stand keep their places, and
    those that bear their height; one that would swing into the floor is lifted, and not the body with it.

    Args:
        plain: the body without detail.
        detailed: the body with it.
        bearing: what bears it.
        falls: how far detail takes the root from the centre of mass [N, 3], metres.
        flying: where nothing bears the body [N].
        root: positions of the root without detail [N, 3], metres.
        off: displacements of feet without detail [N, feet, 3], metres.
        floor: height of the floor [N], metres.
        fps: frames a second.
    """
    loads = bearing.loads
    fades = fade_at_ends(len(loads), (True, True), fps)
    share = loads / np.maximum(loads.sum(axis=1, keepdims=True), 1.0)
    moves = np.zeros(root.shape)
    moves[:, [0, 2]] = np.einsum("nf,nfk->nk", share, plain.tracks - detailed.tracks)
    moves[:, 1] = np.sum(share * (plain.low - detailed.low), axis=1)
    moves = np.stack([smoothed(axis, DETAIL, fps) for axis in moves.T], axis=1)
    flies = cover(flying.astype(np.float64), fps)[:, None]
    moved = root + (1.0 - flies) * fades[:, None] * moves + flies * falls
    heights, reached = (shape.low + at[:, 1:2] + off[..., 1] for shape, at in ((plain, root), (detailed, moved)))
    kept = reached + loads * (heights - reached)
    if kept.size:
        sunk = np.maximum(floor[:, None] - kept, 0.0)
        kept += np.stack([cover(foot, fps) for foot in sunk.T], axis=1) * fades[:, None]
    off = off.copy()
    off[..., 1] += kept - reached
    slips = plain.tracks - detailed.tracks - (moved - root)[:, None, [0, 2]]
    off[..., [0, 2]] += (bearing.holds(fps) * fades[:, None])[..., None] * slips
    return moved, off, kept


def foot_heights(skeleton: Skeleton, rotations: Floats, root: Floats, feet: list[Foot]) -> Floats:
    """Return the height of each foot's lowest point [N, feet], metres."""
    places, joints = contact_points(skeleton, rotations, root)
    return lowest(places, points_of_feet(skeleton, joints, feet))


def _mass(skeleton: Skeleton, rotations: Floats) -> Floats:
    """Return the centre of mass relative to the root [N, 3], metres; the root itself where masses are not known."""
    still = np.zeros((len(rotations), 3))
    mass = centre_of_mass(skeleton, rotations, still)
    return still if mass is None else mass


def _falls(shape: Shape, bearing: Bearing, root: Floats, mass: Floats, overhang: float) -> Floats | None:
    """Return how far a body would fall without each foot [N, feet], from 0 to 1; None where it is in balance.

    Args:
        shape: the body.
        bearing: what bears it.
        root: positions of the root [N, 3], metres.
        mass: centre of mass relative to it [N, 3], metres.
        overhang: how far beyond its support that may be, metres.
    """
    points, centre = _points_on_floor(shape, bearing, root), (root + mass)[:, [0, 2]]
    if not is_beyond(points, bearing.touching(shape), centre, overhang)[1:-1].any():
        return None
    return falls_without(points, bearing.all_standing().touching(shape), shape.feet, centre, overhang)


def _points_on_floor(shape: Shape, bearing: Bearing, root: Floats) -> Floats:
    """Return the level places of a body's points [N, P, 2], metres: those of feet where the feet are to be."""
    points = shape.places[..., [0, 2]] + root[:, None, [0, 2]]
    for number, foot_points in enumerate(shape.feet):
        points[:, foot_points] += (bearing.targets[:, number] - root[:, [0, 2]])[:, None]
    return np.asarray(points)


def _prior_rows(prior: Floats, bearing: Bearing, fps: float) -> list[Rows]:
    """Return rows for being, and moving, as on the trajectory that feet have the root on by themselves [N, 3]."""
    count = len(prior)
    rests = np.minimum(bearing.others.max(axis=1, initial=0.0), 1.0)
    share = 0.5 * (rests[1:-1] + rests[:-2])
    travel = (1.0 - share) * TRAVEL[0] ** -2.0 + share * TRAVEL[1] ** -2.0
    rows = []
    for axis in (0, 2):
        rows.append(_axis_rows(axis, prior[:, axis], np.full(count, PRIOR**-2.0)))
        rows.append(difference_rows(axis, (-fps, fps, 0.0), fps * np.diff(prior[:-1, axis]), travel))
    return rows


def _hurry_rows(root: Floats, travels: float, fps: float) -> Rows:
    """Return rows that slow a root [N, 3] down where it is about to travel faster than it may, metres a second."""
    moved = fps * np.diff(root, axis=0) * np.array([1.0, 0.0, 1.0])
    speed = np.linalg.norm(moved, axis=1)
    along = moved / np.maximum(speed, 1e-9)[:, None]
    # Rows look at three frames: each at its first two, and the last one at its last two.
    first = np.minimum(np.arange(len(along)), len(root) - 3)
    coefficients = np.zeros((len(along), 9))
    coefficients[:, :6] = fps * np.concatenate([-along, along], axis=1)
    coefficients[-1] = np.roll(coefficients[-1], 3)
    weights = np.where(speed > NEARLY * travels, HURRY**-2.0, 0.0)
    return Rows(first, coefficients, np.full(len(along), min(travels, 1e3)), weights)


def _smooth_rows(prior: Floats, mass: Floats, fps: float, vertical: float) -> list[Rows]:
    """Return rows for the accelerations of the centre of mass, `mass` [N, 3] relative to the root.

    At the ends the root is to move as on the trajectory that feet have it on by themselves [N, 3].
    """
    rows, last = [], len(prior) - 3
    for axis, share in enumerate((1.0, vertical, 1.0)):
        weights = np.full(last + 1, share * PUSH**-2.0)
        bends = -(fps**2) * np.diff(mass[:, axis], 2)
        rows.append(difference_rows(axis, (fps**2, -2.0 * fps**2, fps**2), bends, weights))
        for first, shares in ((0, (-(fps**2), fps**2, 0.0)), (last, (0.0, -(fps**2), fps**2))):
            leaves = prior[first : first + 3, axis] @ np.array(shares)
            row = difference_rows(axis, shares, np.array([leaves]), weights[:1])
            rows.append(row._replace(first=np.array([first])))
    return rows


def _standing_rows(shape: Shape, bearing: Bearing, floor: Floats, freedom: Floats) -> list[Rows]:
    """Return rows for what bears to be on the floor, and for standing legs not to lean elsewhere."""
    rows = []
    height = (HEIGHT[0] ** (1.0 - freedom) * HEIGHT[1] ** freedom) ** -2.0
    for number in range(shape.low.shape[1]):
        load = bearing.loads[:, number]
        rows.append(_axis_rows(1, floor - shape.low[:, number], load * height))
        rows += [_axis_rows(axis, bearing.targets[:, number, axis // 2], load * PLACE**-2.0) for axis in (0, 2)]
    for part in np.flatnonzero(np.isfinite(shape.low_others[0])):
        rows.append(_axis_rows(1, floor - shape.low_others[:, part], bearing.others[:, part] * RIGID**-2.0))
    # Where nothing bears, or hardly, the lowest point is near the floor.
    rows.append(_axis_rows(1, floor - shape.lowest, np.full(len(floor), 0.01) * height))
    return rows


def _sunk_rows(shape: Shape, floor: Floats, root: Floats) -> Rows:
    """Return rows that lift parts other than feet out of the floor, where the root [N, 3] has them in it."""
    height = floor - shape.low_others.min(axis=1, initial=np.inf)
    sunk = root[:, 1] < height
    return _axis_rows(1, np.where(sunk, height, 0.0), np.where(sunk, RIGID**-2.0, 0.0))


def _reach_rows(
    skeleton: Skeleton,
    legs: list[tuple[Floats, Floats]],
    bearing: Bearing,
    root: Floats,
    feet: list[Foot],
    fps: float,
) -> list[Rows]:
    """Return rows that bring the root [N, 3] near enough to feet that stand farther than their legs reach.

    A leg may be as long as the movement has it; leaning elsewhere, not quite straight.

    Args:
        skeleton: the body.
        legs: each leg in the movement, and as long as it must be, as `_legs` returns them.
        bearing: what bears it.
        root: positions of the root [N, 3], metres.
        feet: its feet.
        fps: frames a second.
    """
    rows, every = [], np.arange(len(root))
    within = np.minimum(np.minimum(every, every[::-1]) / (SETTLES * fps), 1.0)
    for number, foot in enumerate(feet):
        own, leg = legs[number]
        leans = rot.norm(bearing.targets[:, number] - root[:, [0, 2]]) / LEANS
        length = foot.length(skeleton)
        straight = rot.norm(own) / length
        longest = length * np.maximum(np.minimum(straight, 1.0 - SOFT * np.minimum(leans**2, 1.0)), 1.0 - SOFT)
        far = rot.norm(leg)
        along = leg / np.maximum(far, 1e-9)[:, None]
        short = (far > longest + 1e-6) & bearing.stands[:, number]
        target = np.sum(along * root, axis=-1) + far - longest
        rows.append(position_rows(every, along, target, np.where(short, (within / REACH) ** 2, 0.0)))
    return rows


def _knee_rows(
    skeleton: Skeleton,
    legs: list[tuple[Floats, Floats]],
    bearing: Bearing,
    root: Floats,
    feet: list[Foot],
    freedom: Floats,
) -> list[Rows]:
    """Return rows that let the knees of standing legs bend as the movement has them: arguments as for `_reach_rows`.

    A leg that is all but straight bends its knee by much for a little of its length; the root goes along with it
    then, as a body goes over a leg that it stands on. Where the legs are free, for a flight, they bend for that.
    """
    rows, every = [], np.arange(len(root))
    for number, foot in enumerate(feet):
        own, leg = legs[number]
        thigh, shank = foot.bones(skeleton)
        was, far = rot.norm(own), rot.norm(leg)
        bends = np.maximum(0.5 * (bend_of(was, thigh, shank) + bend_of(far, thigh, shank)), STRAIGHT)
        lever = far / (thigh * shank * np.sin(bends))  # radians that the knee bends a metre of the leg's length
        along = lever[:, None] * leg / np.maximum(far, 1e-9)[:, None]
        target = np.sum(along * root, axis=-1) + lever * (far - was)
        rows.append(position_rows(every, along, target, bearing.loads[:, number] * (1.0 - freedom) * KNEE**-2.0))
    return rows


def _legs(
    skeleton: Skeleton,
    places: Floats,
    shape: Shape,
    bearing: Bearing,
    floor: Floats,
    root: Floats,
    feet: list[Foot],
) -> list[tuple[Floats, Floats]]:
    """Return each leg from its hip to its end [N, 3], metres, in the movement, and where its foot has its place.

    Args:
        skeleton: the body.
        places: of joints and tips relative to the root [N, 2 J, 3], metres.
        shape: the body.
        bearing: what bears it.
        floor: height of the floor [N], metres.
        root: positions of the root [N, 3], metres.
        feet: its feet.
    """
    out = []
    for number, foot in enumerate(feet):
        hip, end = (places[:, joint] for joint in foot.chain(skeleton)[::2])
        own = end - hip
        leg = own - root
        leg[:, [0, 2]] += bearing.targets[:, number]
        leg[:, 1] += floor - shape.low[:, number]
        out.append((own, leg))
    return out


def _axis_rows(axis: int, targets: Floats, weights: Floats) -> Rows:
    """Return rows for one coordinate of a trajectory in all its frames: targets [N], weights [N]."""
    return position_rows(np.arange(len(targets)), np.eye(3)[axis], targets, weights)
