"""Carrying: the root's trajectory as what bears the body carries it, smoothly and in balance.

It is a least-squares solution, found in a few rounds, for some of its rows depend on where the root is: legs that are
too short, parts that would be in the floor, weight that is beyond its support. Rows are those of
`motionmind.footing.root_rows`, `balance` and `flight`.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import Posed, pose
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import mass_of
from motionmind.footing.balance import balance_rows, falls_without, is_beyond, walks
from motionmind.footing.bearing import Bearing, Shape, find_bearing, find_staying, lowest, points_of_feet, shape_of
from motionmind.footing.corrections import Correction
from motionmind.footing.departures import clear_of_hip, departure, fade_at_ends
from motionmind.footing.feet import Foot, bend_legs, softness
from motionmind.footing.flight import HOVERS, SURELY, find_flights, flight_rows, flying_frames, leg_freedom
from motionmind.footing.knees import cover, smoothed
from motionmind.footing.least_squares import Rows, joined, solve
from motionmind.footing.root_rows import (
    hurry_rows,
    jerk_rows,
    knee_rows,
    legs_of,
    legs_to_places,
    prior_rows,
    reach_rows,
    smooth_rows,
    standing_rows,
    sunk_rows,
)
from motionmind.jit import jit

DETAIL = 0.2  # seconds within which the root smooths the fine detail that it carries; chosen on indian and cmu-05
TIPTOE = 0.12  # metres above the floor: a body that is no higher at both ends, above one spot, stands there on one foot
ROUNDS = 3, 2  # of placing feet, and of the root in each


class Ends(NamedTuple):
    """The facts that are known of a movement's ends.

    Attributes:
        aloft: share of the corpus's walks that are in the air in each frame [N], from 0 to 1.
        leaps: height of their lowest points above the floor there [N], metres.
        moving: whether the velocity is given in the first and in the last frame.
        passing: whether the body passes the first and the last frame, at whatever velocity.
        rates: vertical velocities of the root there, metres a second; None where unknown.
    """

    aloft: Floats
    leaps: Floats
    moving: tuple[bool, bool]
    passing: tuple[bool, bool]
    rates: tuple[float | None, float | None]


class Allowed(NamedTuple):
    """The changes and speeds that a body is allowed.

    Attributes:
        fixed: joints that must not change for the feet's sake [J].
        loose: joints without limits [J].
        fastest: speeds of the joints in the corpus [J], rad/s.
        travels: how fast the body travels at most, metres a second; infinite for any speed.
        pushes: how much its root is accelerated at most, metres a second squared; infinite for any.
    """

    fixed: Bools
    loose: Bools
    fastest: Floats
    travels: float
    pushes: float

    def scaled(self, by: float) -> Allowed:
        """Return the same of a body of another size."""
        return self._replace(travels=by * self.travels, pushes=by * self.pushes)


class Carried(NamedTuple):
    """A body carried.

    Attributes:
        root: positions of the root [N, 3], metres.
        off: displacements of the feet from where the rotations have them [N, feet, 3], metres.
        holds: how much each foot holds its place [N, feet], from 0 to 1.
        heights: of the feet's lowest points that these lead to [N, feet], metres.
        bound: how much the feet, and no flight, say how high it is [N], from 0 to 1.
        staying: a foot that stands throughout, or None.
    """

    root: Floats
    off: Floats
    holds: Floats
    heights: Floats
    bound: Floats
    staying: int | None


def carry(
    skeleton: Skeleton,
    moving: Posed,
    plain: Posed,
    root: Floats,
    floor: Floats,
    firm: Floats,
    feet: list[Foot],
    known: Ends,
    overhang: float,
    allowed: Allowed,
    gravity: float,
    fps: float,
    without: Collection[Correction],
) -> Carried:
    """Return the trajectory of a body's root, and displacements of its feet, in three frames or more.

    Args:
        skeleton: the body.
        moving: the movement about its root, of N frames.
        plain: the same without fine detail.
        root: positions of the root as feet have it by themselves [N, 3], metres; the first and the last do not change.
        floor: height of the floor [N], metres.
        firm: how firmly each limb, and last the trunk, stands where it is low [N, limbs + 1], from 0 to 1.
        feet: those that may be placed.
        known: what is known of its ends, and of its flights.
        overhang: how far beyond its support the centre of mass may be, metres.
        allowed: how fast it may be.
        gravity: metres a second squared.
        fps: frames a second.
        without: corrections to leave out.
    """
    count = len(root)
    shape = shape_of(skeleton, plain, feet)
    mass = own_mass = _mass(skeleton, plain)
    standing = floor - shape.lowest
    above = root[[0, -1], 1] - standing[[0, -1]]
    staying = find_staying(shape, root[:, [0, 2]]) if above.max() < TIPTOE else None
    hovering = [staying is None and known.aloft[end] > SURELY and above[end] > HOVERS for end in (0, -1)]
    flights = []
    if "flight" not in without and staying is None:
        flights = find_flights(
            known.aloft,
            known.leaps,
            standing + mass[:, 1],
            root[[0, -1], 1] + mass[[0, -1], 1],
            (hovering[0], hovering[1]),
            _rates_of_mass(known.rates, mass, fps),
            gravity,
            fps,
        )
    flying, freedom = flying_frames(flights, (hovering[0], hovering[1]), count), leg_freedom(flights, count, fps)
    planned = shape, root[:, [0, 2]], mass[:, [0, 2]], firm, flying, staying, known.moving, known.passing, feet, fps
    bearing = find_bearing(*planned)
    if "steps" in without:
        bearing = bearing._replace(targets=np.broadcast_to(root[:, None, [0, 2]], bearing.targets.shape).copy())
    fixed = np.zeros(count, dtype=np.bool_)
    fixed[[0, -1]] = True
    fixed[[1, -2]] |= known.moving
    bones = np.array([foot.bones(skeleton) for foot in feet]).reshape(-1, 2)
    legs, knees = legs_of(skeleton, plain.places, feet), [float(allowed.fastest[foot.leg[foot.knee]]) for foot in feet]
    start, off, bent = root, np.zeros((count, len(feet), 3)), plain.rotations
    touches, borne = bearing.touching(shape), _borne_rows(shape, bearing, root, floor, freedom, fps)
    holds = bearing.holds(fps)
    balances = "balance" not in without and bool(mass.any())
    stands = balances and staying is None and "steps" not in without and not walks(root, fps)
    for number_of_round in range(ROUNDS[0]):
        if number_of_round and stands:
            falls = _falls(shape, bearing, touches, start, mass, overhang)
            if falls is not None:
                bearing = find_bearing(*planned, falls)
                touches, borne = bearing.touching(shape), _borne_rows(shape, bearing, root, floor, freedom, fps)
                holds = bearing.holds(fps)
        mass = own_mass if bent is plain.rotations else _mass(skeleton, pose(skeleton, bent))
        smooth = smooth_rows(root, mass, fps, 1e-4 if "bounce" in without else 1.0)
        falling = flight_rows(flights, mass, standing, gravity, fps)
        for _ in range(ROUNDS[1]):
            rows = [
                *(smooth, borne, *falling),
                sunk_rows(shape, floor, start),
                hurry_rows(start, allowed.travels, freedom, fps),
                jerk_rows(start, allowed.pushes, freedom, fps),
            ]
            reaching = legs_to_places(legs, shape, bearing, floor, start)
            rows += [
                reach_rows(reaching, bearing, start, bones, fps),
                knee_rows(reaching, bearing, start, bones, freedom),
            ]
            if balances:
                points, centre, level = _points_on_floor(shape, bearing, start), start + mass, [0, 2]
                weight = centre[:, level], mass[:, level], centre[:, 1] - floor
                rows.append(balance_rows(points, touches, *weight, overhang, gravity, fps))
            start = solve(rows, start, fixed)
        off = _departures(skeleton, shape, legs, bearing, floor, start, feet, knees, known.moving, fps)
        if number_of_round < ROUNDS[0] - 1:
            bent = bend_legs(skeleton, plain, feet, off, softness(holds))
    detailed, falls = shape, np.zeros((count, 3))
    if moving is not plain:
        detailed, falls = shape_of(skeleton, moving, feet), own_mass - _mass(skeleton, moving)
    start, off, heights = _with_detail(shape, detailed, bearing, holds, falls, flying, start, off, floor, fps)
    return Carried(start, off, holds, heights, 1.0 - freedom, staying)


def _borne_rows(shape: Shape, bearing: Bearing, prior: Floats, floor: Floats, freedom: Floats, fps: float) -> Rows:
    """Return rows for what bears the body to bear it, and for the root to move as on its trajectory before [N, 3]."""
    return joined(prior_rows(prior, bearing, fps) + standing_rows(shape, bearing, floor, freedom))


def _departures(
    skeleton: Skeleton,
    shape: Shape,
    legs: Floats,
    bearing: Bearing,
    floor: Floats,
    root: Floats,
    feet: list[Foot],
    knees: list[float],
    moving: tuple[bool, bool],
    fps: float,
) -> Floats:
    """Return how far feet are to be from where rotations have them [N, feet, 3], metres, by the root's places.

    Legs [feet, N, 3] are as rotations have them, from hip to end. The corpus's knees bend by `knees` radians a second.
    """
    out = np.empty((len(root), len(feet), 3))
    for number, foot in enumerate(feet):
        height = shape.low[:, number] + root[:, 1] - floor
        tracks = shape.tracks[:, number] + root[:, [0, 2]]
        places = shape.tracks[:, number] + bearing.targets[:, number]
        stances, length = bearing.stances[number], foot.length(skeleton)
        off = departure(places, tracks, height, stances, length, knees[number], fps, moving)
        out[:, number] = clear_of_hip(off, legs[number], length, stances, fps)
    return out


def _with_detail(
    plain: Shape,
    detailed: Shape,
    bearing: Bearing,
    holds: Floats,
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
        holds: how much each foot holds its place [N, feet], from 0 to 1.
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
    kept = reached + np.maximum(loads, bearing.stands) * (heights - reached)
    if kept.size:
        sunk = np.maximum(floor[:, None] - kept, 0.0)
        lifted = np.stack([cover(foot, fps) for foot in sunk.T], axis=1) * fades[:, None]
        kept += np.where(bearing.stands, sunk, lifted)
    off = off.copy()
    off[..., 1] += kept - reached
    slips = plain.tracks - detailed.tracks - (moved - root)[:, None, [0, 2]]
    off[..., [0, 2]] += (holds * fades[:, None])[..., None] * slips
    return moved, off, kept


def foot_heights(skeleton: Skeleton, posed: Posed, feet: list[Foot]) -> Floats:
    """Return the height of each foot's lowest point [N, feet], metres."""
    return lowest(posed.places, points_of_feet(skeleton, posed.joints, feet))


def _mass(skeleton: Skeleton, posed: Posed) -> Floats:
    """Return the centre of mass relative to the root [N, 3], metres, of a body posed about that; the root itself where
    masses are not known."""
    mass = mass_of(skeleton, posed)
    return np.zeros((len(posed.places), 3)) if mass is None else mass


def _rates_of_mass(
    rates: tuple[float | None, float | None], mass: Floats, fps: float
) -> tuple[float | None, float | None]:
    """Return vertical velocities of the centre of mass, from those of the root in the first and in the last frame, and
    where it is relative to that [N, 3]; None where they are unknown."""
    first, last = (
        None if rate is None else rate + float(step)
        for rate, step in zip(rates, fps * np.diff(mass[:, 1])[[0, -1]], strict=True)
    )
    return first, last


def _falls(
    shape: Shape, bearing: Bearing, touches: Bools, root: Floats, mass: Floats, overhang: float
) -> Floats | None:
    """Return how far a body would fall without each foot [N, feet], from 0 to 1; None where it is in balance.

    Args:
        shape: the body.
        bearing: what bears it.
        touches: which of its points bear it on the floor [N, P].
        root: positions of the root [N, 3], metres.
        mass: centre of mass relative to it [N, 3], metres.
        overhang: how far beyond its support that may be, metres.
    """
    points, centre = _points_on_floor(shape, bearing, root), (root + mass)[:, [0, 2]]
    if not is_beyond(points, touches, centre, overhang)[1:-1].any():
        return None
    return falls_without(points, bearing.all_standing().touching(shape), shape.feet, centre, overhang)


def _points_on_floor(shape: Shape, bearing: Bearing, root: Floats) -> Floats:
    """Return the level places of a body's points [N, P, 2], metres: those of feet where the feet are to be."""
    return _moved_points(shape.places, shape.feet, bearing.targets, root)


@jit
def _moved_points(places: Floats, feet: Bools, targets: Floats, root: Floats) -> Floats:
    """Return level places of points [N, P, 2], from `places` relative to the root [N, P, 3] and of which feet [F, P]
    they are, for which the root would have to be at `targets` [N, F, 2]."""
    out = np.empty((*places.shape[:2], 2))
    for t in range(len(places)):
        for point in range(places.shape[1]):
            for k in range(2):
                out[t, point, k] = places[t, point, 2 * k] + root[t, 2 * k]
                for foot in range(len(feet)):
                    if feet[foot, point]:
                        out[t, point, k] += targets[t, foot, k] - root[t, 2 * k]
    return out
