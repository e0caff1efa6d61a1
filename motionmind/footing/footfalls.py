"""Footfalls: times and places of each foot's stances.

A foot stands or swings. In stance it keeps one place on the floor: that of posture A until its first step, and that of
posture B after its last. Dynamic programming over all divisions of the time into stance and swing finds the steps: long
distances take as many steps as time allows, and feet step when the movement lifts them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.jit import jit

SHORTEST_STEP_S = 0.33


class StepCosts(NamedTuple):
    """Costs of standing and swinging, in nats per second unless noted.

    Attributes:
        lifted: heights above the lowest limb, metres: a foot hardly stands from the first, not at all from the second.
        stand_lifted: standing with a foot at the second height; proportional to the height above the first.
        stand_moving: standing with a foot that the corpus moves.
        against_request: standing with a foot that a request lifts, and swinging another foot at the same time.
        drift: distance of a standing foot from its track that costs 1, metres.
        crossing: factor on that cost if the foot is off the track towards the other feet.
        slip: distance that a foot may slip without a step at the cost of `drift`, metres.
        own_side: share of a sideways course during a stance that a foot spends on its own side of its track.
        swing_firm: swinging a foot that stands firmly.
        swing_unsupported: swinging while nothing else supports the body.
        swing_early: swinging before the weight has shifted.
        swing_loaded: swinging a foot that bears the whole weight of a body at rest.
        swing_falling: swinging a foot without which the body falls; chosen on ballet and karate.
        step: each step, nats.
        quick: mean speed of a step that costs as much as standing `drift` off the track, m/s.
    """

    lifted: tuple[float, float] = (0.02, 0.08)
    stand_lifted: float = 8.0
    stand_moving: float = 3.0
    against_request: float = 1e4
    drift: float = 0.08
    crossing: float = 4.0
    slip: float = 0.02
    own_side: float = 0.8
    swing_firm: float = 1.0
    swing_unsupported: float = 40.0
    swing_early: float = 12.0
    swing_loaded: float = 6.0
    swing_falling: float = 30.0
    step: float = 0.5
    quick: float = 1.2


COSTS = StepCosts()


class Stance(NamedTuple):
    """An interval in which a foot stands.

    Attributes:
        start: first frame.
        end: last frame.
        place: level place of the foot [2], metres.
        slip: displacement of a foot that stands throughout, from its first given place to its last [2], metres.
    """

    start: int
    end: int
    place: Floats
    slip: Floats


def standing_costs(above: Floats, firm: Floats) -> tuple[Floats, Floats]:
    """Return the costs per second of standing and of swinging a foot [N].

    Args:
        above: height of its lowest point above that of the lowest limb [N], metres.
        firm: firmness of the foot in the corpus [N], 0 to 1.
    """
    low, high = COSTS.lifted
    stand = COSTS.stand_lifted * np.maximum((above - low) / (high - low), 0.0) + COSTS.stand_moving * (1.0 - firm) ** 2
    swing = COSTS.swing_firm * firm * np.clip(1.0 - above / high, 0.0, 1.0)
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

    Standing costs `stand` and the squared distance to the track in units of `COSTS.drift`. Swinging costs `swing`, the
    squared speed in units of `COSTS.quick`, and more while nothing else supports the body. A step costs `COSTS.step`.

    Args:
        track: level positions of the foot in the movement [N, 2], metres.
        outward: unit vectors to the leg's side of the body [N, 2].
        stand: cost of standing [N], per second.
        swing: cost of swinging [N], per second.
        others: whether another limb supports the body [N].
        flying: whether the body is in the air [N].
        fps: frames a second.
        passing: whether the body passes through the first and the last frame; if not, a foot in the air takes its time.
    """
    track, outward = np.ascontiguousarray(track), np.ascontiguousarray(outward)
    shortest = max(2, round(SHORTEST_STEP_S * fps))
    stand, swing = _costs(stand, swing, others, flying, round(0.08 * fps), fps)  # s to shift the weight
    # A foot given in the air lands within half a step; if the body passes through or flies, it lands as it falls.
    first, last = (0 if goes or flies else shortest // 2 for goes, flies in zip(passing, flying[[0, -1]], strict=True))
    intervals = _divide(
        track - track[0], outward, _crossing(track, outward), stand, swing, shortest, (first, last), fps
    )
    places, slips = _places(track, outward, intervals, shortest)
    return [
        Stance(start, end, place, slip)
        for (start, end), place, slip in zip(intervals.tolist(), places, slips, strict=True)
    ]


@jit
def _costs(
    stand: Floats, swing: Floats, others: Bools, flying: Bools, around: int, fps: float
) -> tuple[Floats, Floats]:
    """Return the costs of standing and of swinging a foot in each frame [N], given the other support of the body.

    The weight has shifted to other limbs once they support the body in all frames within `around`.
    """
    stands, swings = np.full(len(stand), 1e3), np.zeros(len(stand))
    for t in range(len(stand)):
        if not flying[t]:
            stands[t], swings[t] = stand[t], swing[t]
            if not others[t]:
                swings[t] += COSTS.swing_unsupported
            elif t < around or t + around >= len(stand) or not others[t - around : t + around + 1].all():
                swings[t] += COSTS.swing_early
    return stands / fps, swings / fps


@jit
def _places(track: Floats, outward: Floats, intervals: Ints, shortest: int) -> tuple[Floats, Floats]:
    """Return the places [K, 2] and the slips [K, 2] of a foot in its stances, the `intervals` of frames [K, 2]."""
    places, slips, last = np.empty((len(intervals), 2)), np.zeros((len(intervals), 2)), len(track) - 1
    for k in range(len(intervals)):
        start, end = intervals[k]
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
        place += COSTS.own_side * beyond * side
        # A foot that comes from the air has no time to move elsewhere.
        place = track[start] + min(start / shortest, 1.0) * (place - track[start])
        places[k] = track[end] + min((last - end) / shortest, 1.0) * (place - track[end])
        if start == 0:
            places[k] = track[0]
            if end == last:
                slips[k] = track[last] - track[0]
        elif end == last:
            places[k] = track[last]
    return places, slips


@jit
def _divide(  # noqa: PLR0915 - one table, filled in one go
    track: Floats,
    outward: Floats,
    crosses: Floats,
    stand: Floats,
    swing: Floats,
    shortest: int,
    ends: tuple[int, int],
    fps: float,
) -> Ints:
    """Return the intervals [K, 2] in which a foot stands, in order (see `find_stances`).

    A step takes at least `shortest` frames; a swing from the first frame or to the last takes at least `ends`.
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
                spread = off - (x * x + y * y) / n + n * (max(far - COSTS.slip, 0.0) / COSTS.slip) ** 2 * COSTS.drift**2
            elif s == 0 or t == last:
                px, py = (track[0, 0], track[0, 1]) if s == 0 else (track[last, 0], track[last, 1])
                spread = off - 2.0 * (px * x + py * y) + n * (px * px + py * py)
                side = 0 if s == 0 else 1
                spread += crosses[side, t + 1] - crosses[side, s]
            else:
                spread = off - (x * x + y * y) / n
                moved_x, moved_y = track[t, 0] - track[s, 0], track[t, 1] - track[s, 1]
                across = (
                    0.5 * COSTS.own_side * (moved_x * outward[(s + t) // 2, 0] + moved_y * outward[(s + t) // 2, 1])
                )
                spread += n * across * across
            cost = least + max(spread, 0.0) / (COSTS.drift**2 * fps)
            if cost < best[0, t]:
                best[0, t], came[0, t] = cost, s
        for s in range(t + 1):  # swinging from s to t
            n = t - s + 1
            if (s == 0 and stand[0] * fps < COSTS.swing_firm) or (t == last and stand[last] * fps < COSTS.swing_firm):
                continue  # it stands in the given posture
            steps = s > 0 and t < last
            if n < (shortest if steps else ends[0] if s == 0 else ends[1]):
                continue
            before = 0.0 if s == 0 else best[0, s - 1]
            least = before + swing_sum[t + 1] - swing_sum[s]
            if not least < best[1, t]:
                continue
            stood, stands = max(s - 1, 0), min(t + 1, last)
            x, y = track[stands, 0] - track[stood, 0], track[stands, 1] - track[stood, 1]
            cost = least + (x * x + y * y) / ((n + 1) / fps * COSTS.quick**2)
            if steps:
                cost += COSTS.step
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
    """Return the cumulative cost of crossed legs [2, N + 1]: the body overtakes a foot in stance from A on, or to B."""
    off = track - track[[0, -1], None]
    inward = np.maximum(np.sum(off * outward, axis=2), 0.0)
    return np.concatenate([np.zeros((2, 1)), np.cumsum(COSTS.crossing * inward**2, axis=1)], axis=1)
