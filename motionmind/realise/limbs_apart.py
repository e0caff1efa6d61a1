"""Limbs kept apart: where a movement would carry limbs through each other, they pass each other instead.

Limbs are capsules (`motionmind.body.capsules`). While two are in each other they are kept on either side of a plane.
It lies between them as they meet and as they part; where these are opposite sides, as of a leg that goes from in front
of the other to behind it, the plane turns on the way by the line from one hip (or shoulder) to the other, so that the
limbs open. Each limb turns as a whole about its hip or shoulder, as little as will do, and smoothly in time; feet keep
their orientations. A foot that stands does not slide: it stands elsewhere from the step that leads there on or, where a
given posture has it, its leg turns about the line from hip to ankle alone; of two such legs that are in each other the
one whose foot steps sooner gives way. A foot that would sink into the floor is lifted by its knee. The given postures
do not change; what they have in each other, or the corpus usually has, stays.

Constants were chosen on random pairs of `cmu-05` and ballet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.anatomy import SIDES
from motionmind.body.capsules import ARM, LEG, Capsules, capsules_of, pair_depths, radius_at
from motionmind.body.contact import limb_heights, lowest_height
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.geometry.segments import nearest_points
from motionmind.jit import jit
from motionmind.realise.least_squares import solve_rows
from motionmind.realise.legs import find_legs, reach

ROUNDS = 12  # corrections, each of what those before it have left
TOUCHES = 0.005  # metres that any two limbs may be in each other
LEAST = 1e-3  # metres that are not corrected
SPREADS = 0.12  # seconds in which a correction begins and ends
FIRMLY = 100.0  # weight of a correction where it is needed, that of none being 1
PLACE = 1000.0  # weight of a standing foot's place, and of that it does not slide
LEVER = 0.1  # metres: touched so near to its joint, a limb turns half as far as it would have to
MOST = 0.3  # radians that a limb turns in one correction
STEADY = 0.08  # metres a second at which a foot stands half as firmly as one at rest
LIFTS = 0.1  # seconds in which a foot begins and ends to be lifted off the floor
LOW = 0.04  # metres above the body's lowest point at which it stands half as firmly as one there


class _Limbs(NamedTuple):
    """The limbs of a person that turn about their first joints: left and right leg, left and right arm.

    Attributes:
        first: the joint that each turns about [4].
        last: the joint that keeps its orientation, a leg's ankle; an arm has its first joint here [4].
        owner: the limb that each capsule belongs to, -1 for trunk and head [C].
        carried: whether it belongs to what keeps its orientation: foot and toes [C].
    """

    first: Ints
    last: Ints
    owner: Ints
    carried: Bools


class _Placed(NamedTuple):
    """A movement's limbs in the world, the root being in the origin; metres.

    Attributes:
        ends: of the capsules' axes [N, C, 2, 3].
        pivots: places of the limbs' first joints [N, 4, 3].
        anchors: places of their last [N, 4, 3].
        held: how firmly each limb stands where a given posture has it [N, 4], from 0 to 1.
    """

    ends: Floats
    pivots: Floats
    anchors: Floats
    held: Floats


def keep_limbs_apart(
    skeleton: Skeleton,
    rotations: Floats,
    root: Floats | None,
    times: Floats,
    given: Floats,
    fixed: Bools,
    usual: Floats,
) -> Floats:
    """Return local rotations [N, J, 4] in which limbs do not pass through each other.

    Args:
        skeleton: the body; if it has no capsules, nothing changes.
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres; None where they are not known yet, and no foot stands anywhere.
        times: of the frames [N], seconds, evenly spaced.
        given: times of postures that must not change, in frames, whole or not, from the first to the last [G]. The
            frames next to them do not change either.
        fixed: joints that must not change [J]; nor do their limbs.
        usual: how deep the corpus has each pair of `Capsules.pairs` in each other [P], metres.
    """
    capsules = capsules_of(skeleton)
    pairs = capsules.pairs()
    if not len(pairs):
        return rotations
    places = skeleton.positions_and_tips(rotations, np.zeros(3))
    ends = np.ascontiguousarray(capsules.place(places))
    depths, directions = pair_depths(ends, capsules.radii, pairs)
    frames, fps = np.arange(len(rotations)), 1.0 / (times[1] - times[0])
    held = np.unique(np.concatenate([np.floor(given + 1e-6), np.ceil(given - 1e-6)])).astype(np.int64)
    before = np.clip(np.searchsorted(held, frames, side="right") - 1, 0, len(held) - 2)
    share = ((frames - held[before]) / np.diff(held)[before])[:, None]
    allowed = (1.0 - share) * depths[held[before]] + share * depths[held[before + 1]]
    allowed = np.maximum(allowed, np.maximum(usual, TOUCHES))
    if not np.any(depths > allowed + LEAST):
        return rotations
    limbs = _limbs_of(skeleton, capsules)
    still = np.zeros((len(rotations), 4))
    if root is not None:
        still[:, :2] = _standing(capsules, places + root[:, None], fps)
    frozen = np.isin(frames, held + np.array([[-1], [0], [1]]))
    of_legs = np.isin(limbs.owner[pairs], (0, 1)).all(axis=1)
    crossed = np.any(depths[:, of_legs] > allowed[:, of_legs] + LEAST, axis=1)
    firmly, still = _give_way(_held(still, frozen), still, crossed)
    placed = _Placed(ends, places[:, limbs.first], places[:, limbs.last], firmly)
    sides = _sides(depths > allowed, directions, pairs, limbs.owner, placed.pivots)
    free = ~(fixed[limbs.first] | fixed[limbs.last])
    turned = best = np.tile(rot.IDENTITY, (len(rotations), 4, 1))
    least = np.inf
    for number in range(ROUNDS + 1):
        deep, steps = _steps(placed, limbs, capsules.radii, pairs, allowed, sides)
        needed = (deep > 0.0) & free & ~frozen[:, None]
        # Limbs that are turned out of each other may meet others: the best of all rounds counts, not the last.
        left = float(np.where(needed, deep, 0.0).max(axis=0).sum())
        if left < least:
            best, least = turned, left
        if not needed.any() or number == ROUNDS:
            break
        turns = np.zeros_like(steps)
        for limb in np.flatnonzero(needed.any(axis=0)):
            axis = placed.anchors[:, limb] - placed.pivots[:, limb]
            axis /= np.maximum(rot.norm(axis), 1e-9)[:, None]
            own = steps[:, limb], needed[:, limb], axis, still[:, limb], placed.held[:, limb]
            turns[:, limb] = _smooth(*own, frozen, SPREADS * fps)
        _turn(placed, limbs, turns)
        turned = rot.mul(rot.exp(turns), turned)
    out = _with_turned(skeleton, rotations, limbs, best, ~frozen)
    if root is None:
        return out
    lowest = lowest_height(skeleton, rotations, root)
    floor = np.minimum(lowest, np.linspace(lowest[0], lowest[-1], len(lowest)))
    return _lift_feet(skeleton, out, root, floor, fixed, frozen, fps)


def _limbs_of(skeleton: Skeleton, capsules: Capsules) -> _Limbs:
    """Return the limbs of a person."""
    first = [skeleton.index(f"{side}_{joint}") for joint in ("hip", "shoulder") for side in SIDES]
    ankles = [skeleton.index(f"{side}_ankle") for side in SIDES]
    owner = np.full(len(capsules.names), -1)
    for number, (parts, side) in enumerate((parts, side) for parts in (LEG, ARM) for side in SIDES):
        owner[[capsules.names.index(f"{side}_{part}") for part in parts]] = number
    carried = np.array([name.endswith(("foot", "toes")) for name in capsules.names])
    return _Limbs(np.array(first), np.array(ankles + first[2:]), owner, carried)


def _standing(capsules: Capsules, places: Floats, fps: float) -> Floats:
    """Return how firmly each foot of a person stands [N, 2], from 0 to 1.

    It is 1 / (1 + (h / LOW)^4) / (1 + (v / STEADY)^4), of the end of the last bone that stands more firmly, with h its
    height above the body's lowest point and v its level speed.

    Args:
        capsules: of the person.
        places: of the joints and tips [N, 2 J, 3], metres.
        fps: frames a second.
    """
    lowest = places[..., 1].min(axis=1, keepdims=True)
    tips = [capsules.points[capsules.names.index(f"{side}_toes"), 1] for side in SIDES]
    ends = places[:, [[tip - places.shape[1] // 2, tip] for tip in tips]]
    speed = fps * np.linalg.norm(np.gradient(ends[..., [0, 2]], axis=0), axis=-1)
    low = (ends[..., 1] - lowest[..., None]) / LOW
    return np.asarray((1.0 / (1.0 + low**4) / (1.0 + (speed / STEADY) ** 4)).max(axis=2))


def _with_turned(skeleton: Skeleton, rotations: Floats, limbs: _Limbs, turned: Floats, changes: Bools) -> Floats:
    """Return local rotations [N, J, 4] with limbs turned in the world by `turned` [N, 4, 4] where a frame `changes`."""
    world, out = skeleton.global_rotations(rotations), rotations.copy()
    for limb, (first, last) in enumerate(zip(limbs.first, limbs.last, strict=True)):
        if np.all(turned[:, limb] == rot.IDENTITY):
            continue
        turn = turned[changes, limb]
        above = world[changes, skeleton.parents[first]]
        out[changes, first] = rot.inv_mul(above, rot.mul(turn, world[changes, first]))
        if last != first:
            above = rot.mul(turn, world[changes, skeleton.parents[last]])
            out[changes, last] = rot.inv_mul(above, world[changes, last])
    return out


def _lift_feet(
    skeleton: Skeleton, rotations: Floats, root: Floats, floor: Floats, fixed: Bools, frozen: Bools, fps: float
) -> Floats:
    """Return local rotations [N, J, 4] with knees bent so that no foot is below the floor [N], metres.

    Legs with fixed joints [J] do not change, nor do frozen frames [N].
    """
    numbers, legs = find_legs(skeleton)
    sunk = np.maximum(floor[:, None] - limb_heights(skeleton, rotations, root)[:, numbers], 0.0)
    sunk[frozen] = 0.0
    out = rotations.copy()
    for (leg, bends), depth in zip(legs, sunk.T, strict=True):
        if depth.max() <= LEAST or fixed[leg].any():
            continue
        lift = _eased(depth, frozen, max(1, round(LIFTS * fps)))
        hip, knee, ankle = leg[bends - 1 : bends + 2]
        world, places = skeleton.global_rotations(rotations), skeleton.positions(rotations, root)
        target = places[:, ankle] + lift[:, None] * np.array([0.0, 1.0, 0.0])
        thigh, shank = reach(world[:, hip], places[:, [hip, knee, ankle]], target)
        thigh, shank = rot.mul(thigh, world[:, hip]), rot.mul(shank, world[:, knee])
        bent = np.stack(
            [
                rot.inv_mul(world[:, skeleton.parents[hip]], thigh),
                rot.inv_mul(thigh, shank),
                rot.inv_mul(shank, world[:, ankle]),
            ],
            axis=1,
        )
        out[:, [hip, knee, ankle]] = np.where((lift > 0.0)[:, None, None], bent, out[:, [hip, knee, ankle]])
    return out


def _eased(need: Floats, frozen: Bools, rise: int) -> Floats:
    """Return a curve [N] that is at least `need` [N] and rises and falls within `rise` frames; 0 where frozen."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(need, 2 * rise), 2 * rise + 1).max(axis=1)
    window = np.hanning(2 * rise + 3)[1:-1]
    frames = np.arange(len(need))
    far = np.abs(frames[:, None] - frames[frozen]).min(axis=1)
    share = np.minimum(far / rise, 1.0)
    eased = np.convolve(around, window / window.sum(), "valid") * share * share * (3.0 - 2.0 * share)
    return np.where(frozen, 0.0, np.maximum(eased, need))


@jit
def _smooth(
    steps: Floats, needed: Bools, axis: Floats, still: Floats, held: Floats, frozen: Bools, spread: float
) -> Floats:
    """Return rotation vectors d [N, 3] that are near `steps` [N, 3] where needed, and smooth in time.

    They minimise sum_t n |d - step|^2 + |d|^2 + PLACE (held |e|^2 + still |e'|^2) + spread^4 |d''|^2, with n FIRMLY
    where needed and 0 elsewhere, e the part of d across the axis, differences for derivatives, and d = 0 where frozen.

    Args:
        steps: wanted rotation vectors [N, 3], radians.
        needed: where they are wanted [N].
        axis: unit vectors about which a limb that stands may turn [N, 3].
        still: how firmly it stands [N].
        held: how firmly it stands where a frozen frame has it [N].
        frozen: frames that must not change [N].
        spread: frames in which a correction begins and ends.
    """
    count = len(steps)
    # Unknowns frame by frame, three each: an equation reaches six unknowns back. matrix[i, k] is that of i and i - k.
    matrix, out = np.zeros((3 * count, 7)), np.zeros(3 * count)
    for t in range(count):
        pull = FIRMLY if needed[t] else 0.0
        for row in range(3):
            matrix[3 * t + row, 0] += 1.0 + pull
            out[3 * t + row] = pull * steps[t, row]
            for column in range(3):
                across = PLACE * ((1.0 if row == column else 0.0) - axis[t, row] * axis[t, column])
                slide = across * min(still[t], still[t - 1]) if t > 0 else 0.0
                if column <= row:
                    matrix[3 * t + row, row - column] += held[t] * across + slide
                    if t > 0:
                        matrix[3 * t - 3 + row, row - column] += slide
                if t > 0:
                    matrix[3 * t + row, 3 + row - column] -= slide
            if t > 1:
                for one, weight in enumerate((1.0, -2.0, 1.0)):
                    for other, factor in enumerate((1.0, -2.0, 1.0)):
                        if other <= one:
                            i = 3 * (t - 2 + one) + row
                            matrix[i, 3 * (one - other)] += spread**4 * weight * factor
    for i in range(3 * count):  # frozen frames stand apart
        if frozen[i // 3]:
            out[i] = 0.0
        for k in range(min(i, 6) + 1):
            if frozen[i // 3] or frozen[(i - k) // 3]:
                matrix[i, k] = 1.0 if k == 0 else 0.0
    solve_rows(matrix, out)
    return out.reshape(count, 3)


@jit
def _held(still: Floats, frozen: Bools) -> Floats:
    """Return how firmly limbs stand where a frozen frame has them [N, 4]: the least of `still` [N, 4] from it on."""
    out = np.zeros_like(still)
    count = len(still)
    for limb in range(still.shape[1]):
        for backward in (False, True):
            least = 0.0
            for step in range(count):
                t = count - 1 - step if backward else step
                least = still[t, limb] if frozen[t] else min(least, still[t, limb])
                out[t, limb] = max(out[t, limb], least)
    return out


def _give_way(held: Floats, still: Floats, crossed: Bools) -> tuple[Floats, Floats]:
    """Return how firmly limbs stand where given postures have them [N, 4], and at all [N, 4], less where legs cross.

    Two legs that both stand where a given posture has them cannot part. The one whose step is nearer in time does not
    stand from there to its step.

    Args:
        held: how firmly limbs stand where given postures have them [N, 4], from 0 to 1.
        still: how firmly they stand [N, 4].
        crossed: whether the legs are too deep in each other [N].
    """
    held, still = held.copy(), still.copy()
    both = crossed & (held[:, :2] > 0.5).all(axis=1)
    edges = np.flatnonzero(np.diff(both, prepend=False, append=False))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        ways = []
        for leg in range(2):
            swings = np.flatnonzero(held[:, leg] <= 0.5)
            ways += [(begin - frame, leg, slice(frame, end)) for frame in swings[swings < begin][-1:]]
            ways += [(frame + 1 - end, leg, slice(begin, frame)) for frame in swings[swings >= end][:1]]
        if ways:
            _, leg, frames = min(ways, key=lambda way: way[:2])
            held[frames, leg] = still[frames, leg] = 0.0
    return held, still


@jit
def _sides(inside: Bools, directions: Floats, pairs: Ints, owner: Ints, pivots: Floats) -> Floats:
    """Return normals of the planes that keep pairs apart, towards the first [N, P, 3]; 0 where no plane is needed.

    Args:
        inside: whether the pair is too deep in each other [N, P].
        directions: of the first from the second [N, P, 3].
        pairs: numbers of capsules [P, 2].
        owner: the limb that each capsule belongs to, or -1 [C].
        pivots: of the limbs [N, 4, 3], metres.
    """
    sides = np.zeros_like(directions)
    for p in range(len(pairs)):
        one, other = owner[pairs[p, 0]], owner[pairs[p, 1]]
        end = 0
        for begin in range(len(inside)):
            if begin < end or not inside[begin, p]:
                continue
            end = begin
            while end < len(inside) and inside[end, p]:
                end += 1
            before, after = max(begin - 1, 0), min(end, len(inside) - 1)
            meet, part = directions[before, p], directions[after, p]
            opposite = 1.0 - np.sum(meet * part)  # 0 where they meet and part on the same side, 2 on opposite ones
            for t in range(begin, end):
                share = (t - before) / max(after - before, 1)
                side = (1.0 - share) * meet + share * part
                if other >= 0:
                    across = pivots[t, one] - pivots[t, other]
                    side += 2.0 * share * (1.0 - share) * opposite * across / np.sqrt(np.sum(across**2))
                sides[t, p] = side / max(np.sqrt(np.sum(side**2)), 1e-9)
    return sides


@jit
def _steps(
    placed: _Placed, limbs: _Limbs, radii: Floats, pairs: Ints, allowed: Floats, sides: Floats
) -> tuple[Floats, Floats]:
    """Return how deep limbs are that have to turn [N, 4], metres, and the least rotation vectors for it [N, 4, 3].

    Of several pairs that a limb is in, the deepest counts. Where a pair has a plane, its ends are to be on either side
    of it; elsewhere its nearest points are to move apart. Pairs that are apart stay as they are.

    Args:
        placed: the limbs as they are.
        limbs: which limbs there are.
        radii: of the capsules [C, 2], metres.
        pairs: numbers of capsules [P, 2].
        allowed: how deep each pair may be in each other [N, P], metres.
        sides: normals of planes, 0 where there is none [N, P, 3].
    """
    count = len(placed.ends)
    deep, steps = np.zeros((count, 4)), np.zeros((count, 4, 3))
    points, levers, gives = np.empty((2, 3)), np.empty((2, 3)), np.empty(2, np.bool_)
    for t in range(count):
        worst = np.zeros(4)
        for p in range(len(pairs)):
            one, other = placed.ends[t, pairs[p, 0]], placed.ends[t, pairs[p, 1]]
            gap, s, u = nearest_points(one, other)
            reach = radius_at(radii[pairs[p, 0]], s) + radius_at(radii[pairs[p, 1]], u)
            depth = reach - gap - allowed[t, p]
            if depth <= LEAST:
                continue
            side = sides[t, p]
            points[0] = one[0] + s * (one[1] - one[0])
            points[1] = other[0] + u * (other[1] - other[0])
            if side[0] != 0.0 or side[1] != 0.0 or side[2] != 0.0:
                ahead, behind = _along(one, side), _along(other, side)
                points[0], points[1] = one[ahead.argmin()], other[behind.argmax()]
                gap = ahead.min() - behind.max()
            else:
                side = (points[0] - points[1]) / max(gap, 1e-9)
            excess = reach - gap - allowed[t, p]
            size = LEVER**2
            for k in range(2):
                limb, against = limbs.owner[pairs[p, k]], limbs.owner[pairs[p, 1 - k]]
                gives[k] = limb > 1 or (limb >= 0 and against < 2)  # a leg does not give way to an arm
                if not gives[k]:
                    continue
                touched = placed.anchors[t, limb] if limbs.carried[pairs[p, k]] else points[k]
                lever = np.cross(touched - placed.pivots[t, limb], side) * (1.0 - 2.0 * k)
                axis = placed.anchors[t, limb] - placed.pivots[t, limb]
                along = np.sum(lever * axis) / max(np.sum(axis**2), 1e-9) * axis
                held = placed.held[t, limb]
                levers[k] = (1.0 - held) * lever + held * along
                size += np.sum(lever * levers[k])
            for k in range(2):
                limb = limbs.owner[pairs[p, k]]
                if not gives[k]:
                    continue
                deep[t, limb] = max(deep[t, limb], depth)
                if excess > worst[limb]:
                    worst[limb] = excess
                    step = levers[k] * excess / size
                    steps[t, limb] = step * min(1.0, MOST / max(np.sqrt(np.sum(step**2)), 1e-9))
    return deep, steps


@jit
def _along(ends: Floats, direction: Floats) -> Floats:
    """Return how far two points [2, 3] lie along a direction [3]: [2]."""
    out = np.zeros(2)
    for end in range(2):
        for k in range(3):
            out[end] += ends[end, k] * direction[k]
    return out


@jit
def _turn(placed: _Placed, limbs: _Limbs, turns: Floats) -> None:
    """Turn limbs about their first joints by rotation vectors [N, 4, 3]; what is carried moves along."""
    for t in range(len(turns)):
        for limb in range(4):
            vector, pivot, anchor = turns[t, limb], placed.pivots[t, limb], placed.anchors[t, limb]
            angle = np.sqrt(np.sum(vector**2))
            if angle < 1e-12:
                continue
            moved = -anchor
            _turn_point(anchor, pivot, vector, angle)
            moved += anchor
            for capsule in range(len(limbs.owner)):
                if limbs.owner[capsule] != limb:
                    continue
                for end in range(2):
                    point = placed.ends[t, capsule, end]
                    if limbs.carried[capsule]:
                        point += moved
                    else:
                        _turn_point(point, pivot, vector, angle)


@jit
def _turn_point(point: Floats, pivot: Floats, vector: Floats, angle: float) -> None:
    """Turn a point [3] about a pivot [3] by a rotation vector [3] of some length, by Rodrigues' formula, in place."""
    ax, ay, az = point[0] - pivot[0], point[1] - pivot[1], point[2] - pivot[2]
    vx, vy, vz = vector[0], vector[1], vector[2]
    sine, versine = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2
    bx, by, bz = vy * az - vz * ay, vz * ax - vx * az, vx * ay - vy * ax
    point[0] = pivot[0] + (ax + sine * bx + versine * (vy * bz - vz * by))
    point[1] = pivot[1] + (ay + sine * by + versine * (vz * bx - vx * bz))
    point[2] = pivot[2] + (az + sine * bz + versine * (vx * by - vy * bx))
