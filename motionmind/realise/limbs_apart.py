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

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy import SIDES
from motionmind.body.capsules import ARM, LEG, Capsules, capsules_of, pair_depths
from motionmind.body.contact import limb_heights, lowest_height
from motionmind.body.legs import find_legs
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.footing.least_squares import solve_rows
from motionmind.footing.legs import reach
from motionmind.geometry import rotations as rot
from motionmind.jit import jit
from motionmind.realise.limb_turns import LEAST, Limbs, Placed, is_any_deeper, least_turns, planes_between, turn

ROUNDS = 18  # corrections, each of what those before it have left
GENTLE = 6  # of them in which limbs are to turn as far as they have to
FARTHER = 1.8  # times as far, in those after them: what smoothness takes from the turns keeps some from coming apart
TOUCHES = 0.005  # metres that any two limbs may be in each other
SPREADS = 0.12  # seconds in which a correction begins and ends
FIRMLY = 100.0  # weight of a correction where it is needed, that of none being 1
PLACE = 1000.0  # weight of a standing foot's place, and of that it does not slide
STEADY = 0.08  # metres a second at which a foot stands half as firmly as one at rest
LIFTS = 0.1  # seconds in which a foot begins and ends to be lifted off the floor
LOW = 0.04  # metres above the body's lowest point at which it stands half as firmly as one there


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
    ends = capsules.place(places)
    frames, fps = np.arange(len(rotations)), 1.0 / (times[1] - times[0])
    held = np.array(sorted({*np.floor(given + 1e-6).tolist(), *np.ceil(given - 1e-6).tolist()}), dtype=np.int64)
    before = np.clip(np.searchsorted(held, frames, side="right") - 1, 0, len(held) - 2)
    share = ((frames - held[before]) / np.diff(held)[before])[:, None]
    deep, _ = pair_depths(ends[held], capsules.radii, pairs)
    allowed = (1.0 - share) * deep[before] + share * deep[before + 1]
    allowed = np.maximum(allowed, np.maximum(usual, TOUCHES))
    if not is_any_deeper(ends, capsules.radii, pairs, allowed):
        return rotations
    depths, directions = pair_depths(ends, capsules.radii, pairs)
    # Beside a given posture, where nothing may turn, there is no time to part: there they do so little by little.
    near = 1.0 - _risen((np.abs(frames[:, None] - held).min(axis=1) - 1) / (SPREADS * fps))
    allowed += near[:, None] * np.maximum(depths - allowed, 0.0)
    limbs = _limbs_of(skeleton)
    still = np.zeros((len(rotations), 4))
    if root is not None:
        still[:, :2] = _standing(capsules, places + root[:, None], fps)
    frozen = np.zeros(len(rotations), dtype=np.bool_)
    frozen[np.clip(held + np.array([[-1], [0], [1]]), 0, len(rotations) - 1)] = True
    of_legs = np.isin(limbs.owner[pairs], (0, 1)).all(axis=1)
    crossed = np.any(depths[:, of_legs] > allowed[:, of_legs] + LEAST, axis=1)
    firmly, still = _give_way(_held(still, frozen), still, crossed)
    placed = Placed(ends, places[:, limbs.first], places[:, limbs.last], firmly)
    sides = planes_between(depths > allowed, directions, pairs, limbs.owner, placed.pivots)
    free = ~(fixed[limbs.first] | fixed[limbs.last])
    turned = best = np.tile(rot.IDENTITY, (len(rotations), 4, 1))
    least = np.inf
    for number in range(ROUNDS + 1):
        deep, steps = least_turns(placed, limbs, capsules.radii, pairs, allowed, sides)
        needed = (deep > 0.0) & free & ~frozen[:, None]
        # Limbs that are turned out of each other may meet others: the best of all rounds counts, not the last.
        left = float(np.where(needed, deep, 0.0).max(axis=0).sum())
        if left < least:
            best, least = turned, left
        if not needed.any() or number == ROUNDS:
            break
        turns, farther = np.zeros_like(steps), FARTHER if number >= GENTLE else 1.0
        for limb in np.flatnonzero(needed.any(axis=0)):
            axis = placed.anchors[:, limb] - placed.pivots[:, limb]
            axis /= np.maximum(rot.norm(axis), 1e-9)[:, None]
            own = farther * steps[:, limb], needed[:, limb], axis, still[:, limb], placed.held[:, limb]
            turns[:, limb] = _smooth(*own, frozen, SPREADS * fps)
        turn(placed, limbs, turns)
        turned = rot.mul(rot.exp(turns), turned)
    out = _with_turned(skeleton, rotations, limbs, best, ~frozen)
    if root is None:
        return out
    lowest = lowest_height(skeleton, rotations, root)
    floor = np.minimum(lowest, np.linspace(lowest[0], lowest[-1], len(lowest)))
    return _lift_feet(skeleton, out, root, floor, fixed, frozen, fps)


@remembered
def _limbs_of(skeleton: Skeleton) -> Limbs:
    """Return the limbs of a person."""
    capsules = capsules_of(skeleton)
    first = [skeleton.index(f"{side}_{joint}") for joint in ("hip", "shoulder") for side in SIDES]
    ankles = [skeleton.index(f"{side}_ankle") for side in SIDES]
    owner = np.full(len(capsules.names), -1)
    for number, (parts, side) in enumerate((parts, side) for parts in (LEG, ARM) for side in SIDES):
        owner[[capsules.names.index(f"{side}_{part}") for part in parts]] = number
    carried = np.array([name.endswith(("foot", "toes")) for name in capsules.names])
    return Limbs(np.array(first), np.array(ankles + first[2:]), owner, carried)


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


def _with_turned(skeleton: Skeleton, rotations: Floats, limbs: Limbs, turned: Floats, changes: Bools) -> Floats:
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
    if sunk.max(initial=0.0) <= LEAST:
        return out
    world, places = skeleton.global_rotations(rotations), skeleton.positions(rotations, root)
    for (leg, bends), depth in zip(legs, sunk.T, strict=True):
        if depth.max() <= LEAST or fixed[leg].any():
            continue
        lift = _eased(depth, frozen, max(1, round(LIFTS * fps)))
        hip, knee, ankle = leg[bends - 1 : bends + 2]
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
    eased = np.convolve(around, window / window.sum(), "valid") * _risen(far / rise)
    return np.where(frozen, 0.0, np.maximum(eased, need))


def _risen(share: Floats) -> Floats:
    """Return a smooth step: 0 where a share [N] is 0, or less, 1 from where it is 1."""
    share = np.clip(share, 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


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
