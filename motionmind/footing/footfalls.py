"""Footfalls: times and places of each foot's stances.

A foot stands or swings. In stance it keeps one place on the floor: its first place is A's until it steps, and its last
is B's. Dynamic programming over all divisions of the time into stance and swing finds the steps, so that long
distances take as many steps as time allows, and feet step when the movement lifts them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.jit import jit

LIFTED_FOOT_M = 0.02, 0.08  # metres above the lowest limb: from here on a foot hardly stands, from there on not at all
STAND_LIFTED_NATS_PER_S = 8.0  # per second: cost of standing with a foot lifted to the upper height; proportional above
STAND_MOVING_NATS_PER_S = 3.0  # per second: cost of standing with a foot that the corpus moves
SWING_FIRM_NATS_PER_S = 1.0  # per second: cost of swinging a foot that stands firmly
STANCE_DRIFT_M = 0.08  # metres off its track at which a standing foot costs 1 per second
STEP_COST_NATS = 0.5  # cost of each step
QUICK_STEP_MPS = 1.2  # m/s: mean speed of a step that costs as much as standing STANCE_DRIFT_M off the track
SHORTEST_STEP_S = 0.33  # seconds: shortest step
SWING_UNSUPPORTED_NATS_PER_S = 40.0  # per second: cost of swinging while nothing else bears the body
OWN_SIDE_SHARE = 0.8  # share of a sideways course during a stance that a foot spends on its own side of its track
CROSSING_COST_RATIO = 4.0  # cost factor for being off the track towards the other feet
WEIGHT_SHIFT_S = 0.08  # seconds to shift the weight from one foot to another
SWING_EARLY_NATS_PER_S = 12.0  # per second: cost of swinging before the weight has shifted
STANCE_SLIP_M = 0.02  # metres that a foot may slip without a step


class Stance(NamedTuple):
    """An interval in which a foot stands, its first and last frame included, and the foot's level place [2], metres.

    A foot with given places at both ends slips by their difference, `slip` [2], metres.
    """

    start: int
    end: int
    place: Floats
    slip: Floats


def standing_costs(above: Floats, firm: Floats) -> tuple[Floats, Floats]:
    """Return the costs per second of standing and of swinging a foot [N].

    Args:
        above: height of its lowest point above that of the lowest limb [N], metres.
        firm: firmness of the corpus's feet [N], 0 to 1.
    """
    low, high = LIFTED_FOOT_M
    stand = (
        STAND_LIFTED_NATS_PER_S * np.maximum((above - low) / (high - low), 0.0)
        + STAND_MOVING_NATS_PER_S * (1.0 - firm) ** 2
    )
    swing = SWING_FIRM_NATS_PER_S * firm * np.clip(1.0 - above / high, 0.0, 1.0)
    return stand, swing


def find_stances(
    track: Floats,
    outward: Floats,
    stand: Floats,
    swing: Floats,
    others: Bools,
    flying: Bools,
    fps: float,
    passing: tuple[bool, bool] = (False, False),
) -> list[Stance]:
    """Return the stances of a foot that minimise the cost of standing and swinging.

    Standing costs `stand`, and the square of the distance to the track in units of STRAYS. Swinging costs `swing`,
    STEP_COST, the square of the speed in units of QUICK, and ALONE while nothing else bears the body.

    Args:
        track: level positions of the foot in the movement [N, 2], metres.
        outward: unit vectors to the leg's side of the body [N, 2].
        stand: cost of standing [N], per second.
        swing: cost of swinging [N], per second.
        others: whether another limb bears the body [N].
        flying: whether the body is in the air [N].
        fps: frames a second.
        passing: whether the body passes through the first and the last frame; if not, a foot in the air takes its time.
    """
    track, outward = np.ascontiguousarray(track), np.ascontiguousarray(outward)
    brief = max(2, round(SHORTEST_STEP_S * fps))
    stand, swing = _costs(stand, swing, others, flying, round(WEIGHT_SHIFT_S * fps), fps)
    # A foot given in the air lands within half a step; if the body passes through or flies, it lands as it falls.
    first, last = (0 if goes or flies else brief // 2 for goes, flies in zip(passing, flying[[0, -1]], strict=True))
    parted = _part(track - track[0], outward, _crossing(track, outward), stand, swing, brief, (first, last), fps)
    places, slips = _places(track, outward, parted, brief)
    return [
        Stance(start, end, place, slip)
        for (start, end), place, slip in zip(parted.tolist(), places, slips, strict=True)
    ]


@jit
def _costs(
    stand: Floats, swing: Floats, others: Bools, flying: Bools, around: int, fps: float
) -> tuple[Floats, Floats]:
    """Return the costs of standing and of swinging a foot in each frame [N], given the other support of the body.

    Another limb surely bears the body where it does so in all frames within `around`.
    """
    stands, swings = np.full(len(stand), 1e3), np.zeros(len(stand))
    for t in range(len(stand)):
        if not flying[t]:
            stands[t], swings[t] = stand[t], swing[t]
            if not others[t]:
                swings[t] += SWING_UNSUPPORTED_NATS_PER_S
            elif t < around or t + around >= len(stand) or not others[t - around : t + around + 1].all():
                swings[t] += SWING_EARLY_NATS_PER_S
    return stands / fps, swings / fps


@jit
def _places(track: Floats, outward: Floats, parted: Ints, brief: int) -> tuple[Floats, Floats]:
    """Return the places [K, 2] and the slips [K, 2] of a foot in its stances, intervals of frames [K, 2]."""
    places, slips, last = np.empty((len(parted), 2)), np.zeros((len(parted), 2)), len(track) - 1
    for k in range(len(parted)):
        start, end = parted[k]
        place, side = np.zeros(2), np.zeros(2)
        for t in range(start, end + 1):
            place += track[t]
            side += outward[t]
        place /= end + 1 - start
        side /= end + 1 - start
        # Place the foot on its own side of its track, so that feet that travel sideways do not cross.
        beyond = 0.0
        for t in range(start, end + 1):
            beyond = max(beyond, (track[t, 0] - place[0]) * side[0] + (track[t, 1] - place[1]) * side[1])
        place += OWN_SIDE_SHARE * beyond * side
        # A foot that comes from the air has no time to move elsewhere.
        place = track[start] + min(start / brief, 1.0) * (place - track[start])
        places[k] = track[end] + min((last - end) / brief, 1.0) * (place - track[end])
        if start == 0:
            places[k] = track[0]
            if end == last:
                slips[k] = track[last] - track[0]
        elif end == last:
            places[k] = track[last]
    return places, slips


@jit
def _part(  # noqa: PLR0915 - one table, filled in one go
    track: Floats,
    outward: Floats,
    crosses: Floats,
    stand: Floats,
    swing: Floats,
    brief: int,
    half: tuple[int, int],
    fps: float,
) -> Ints:
    """Return the intervals [K, 2] in which a foot stands, in order (see `find_stances`).

    A step takes at least `brief` frames; from the first frame or to the last, at least `half`.
    """
    count = len(track)
    stand_sum, swing_sum = np.zeros(count + 1), np.zeros(count + 1)
    sums, squares = np.zeros((count + 1, 2)), np.zeros(count + 1)
    for t in range(count):
        stand_sum[t + 1], swing_sum[t + 1] = stand_sum[t] + stand[t], swing_sum[t] + swing[t]
        sums[t + 1] = sums[t] + track[t]
        squares[t + 1] = squares[t] + track[t, 0] ** 2 + track[t, 1] ** 2
    last = count - 1
    # best[0, t]: standing up to frame t, and swinging from t + 1 on; best[1, t]: swinging, and standing from t + 1 on.
    best = np.full((2, count), np.inf)
    came = np.full((2, count), -1)
    for t in range(count):
        for s in range(t + 1):  # standing from s to t
            before = 0.0 if s == 0 else best[1, s - 1]
            least = before + stand_sum[t + 1] - stand_sum[s]
            if not least < best[0, t]:  # what is to be added costs at least 0
                continue
            n = t - s + 1
            x, y = sums[t + 1, 0] - sums[s, 0], sums[t + 1, 1] - sums[s, 1]
            off = squares[t + 1] - squares[s]
            if s == 0 and t == last:
                far = np.sqrt((track[last, 0] - track[0, 0]) ** 2 + (track[last, 1] - track[0, 1]) ** 2)
                spread = (
                    off
                    - (x * x + y * y) / n
                    + n * (max(far - STANCE_SLIP_M, 0.0) / STANCE_SLIP_M) ** 2 * STANCE_DRIFT_M**2
                )
            elif s == 0 or t == last:
                px, py = (track[0, 0], track[0, 1]) if s == 0 else (track[last, 0], track[last, 1])
                spread = off - 2.0 * (px * x + py * y) + n * (px * px + py * py)
                side = 0 if s == 0 else 1
                spread += crosses[side, t + 1] - crosses[side, s]
            else:
                spread = off - (x * x + y * y) / n
                moved_x, moved_y = track[t, 0] - track[s, 0], track[t, 1] - track[s, 1]
                across = (
                    0.5 * OWN_SIDE_SHARE * (moved_x * outward[(s + t) // 2, 0] + moved_y * outward[(s + t) // 2, 1])
                )
                spread += n * across * across
            cost = least + max(spread, 0.0) / (STANCE_DRIFT_M**2 * fps)
            if cost < best[0, t]:
                best[0, t], came[0, t] = cost, s
        for s in range(t + 1):  # swinging from s to t
            n = t - s + 1
            if (s == 0 and stand[0] * fps < SWING_FIRM_NATS_PER_S) or (
                t == last and stand[last] * fps < SWING_FIRM_NATS_PER_S
            ):
                continue  # it stands where it is given
            steps = s > 0 and t < last
            if n < (brief if steps else half[0] if s == 0 else half[1]):
                continue
            before = 0.0 if s == 0 else best[0, s - 1]
            least = before + swing_sum[t + 1] - swing_sum[s]
            if not least < best[1, t]:
                continue
            stood, stands = max(s - 1, 0), min(t + 1, last)
            x, y = track[stands, 0] - track[stood, 0], track[stands, 1] - track[stood, 1]
            cost = least + (x * x + y * y) / ((n + 1) / fps * QUICK_STEP_MPS**2)
            if steps:
                cost += STEP_COST_NATS
            if cost < best[1, t]:
                best[1, t], came[1, t] = cost, s
    out = np.empty((count, 2), np.int64)
    found = 0
    kind, t = (0 if best[0, last] <= best[1, last] else 1), last
    while t >= 0:
        s = came[kind, t]
        if kind == 0:
            out[found, 0], out[found, 1] = s, t
            found += 1
        kind, t = 1 - kind, s - 1
    return out[:found][::-1].copy()


def _crossing(track: Floats, outward: Floats) -> Floats:
    """Return the cumulative cost of a stance foot that the body overtakes, from A and to B [2, N + 1]: legs cross."""
    off = track - track[[0, -1], None]
    inward = np.maximum(np.sum(off * outward, axis=2), 0.0)
    return np.concatenate([np.zeros((2, 1)), np.cumsum(CROSSING_COST_RATIO * inward**2, axis=1)], axis=1)
