"""Detect a wrong frame rate in a recording from the speed of falls and steps.

Converters copy the frame rate from other files, or write their program's own. At k times the true speed, accelerations
are k squared times as large. Four signs do not depend on style:

- Only gravity pulls a mass down: movement that falls faster for longer than noise lasts plays too fast.
- In the air a mass falls with exactly gravity's acceleration, so flights show a slow clock, too.
- On one foot a body is an inverted pendulum: where its mass is beyond the foot, it accelerates away from it by at least
  gravity times the overhang over its height. Steps of walks and dances show slow and fast clocks.
- A person who takes long, even steps in quick succession runs, with flights in between: a walk at that cadence plays
  too fast.

Movement that stays over its feet shows none of them at any speed. The bounds come from 49 recordings of two people
(CMU's subjects 05, and 16 with odd numbers), widened until none of 114 recordings was questioned at its own rate;
`experiments/clock` reports how many are at wrong rates, and false alarms of bounds chosen on other people.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy import SIDES
from motionmind.body.contact import floor_height, lowest_height, pose
from motionmind.body.human import SHORTEST_PERSON_M, TALLEST_PERSON_M, human23
from motionmind.body.motion import Motion
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import SUPPORT_HEIGHT_M, centre_of_mass, overhang
from motionmind.geometry import rotations as rot

# CMU's subjects 05 and 16: recordings fall at 17 m/s2 at most (with hips that were recorded badly); walks take 0.45 to
# 0.66 steps in the time sqrt(leg / gravity), runs 0.73 to 1.14.
MAX_FALL_MPS2 = 19.5
RUN_CADENCE_RATIO, WALK_CADENCE_RATIO = 0.92, 0.52
N_EVEN_STEPS = 4
# Gravity that steps show, in g: the edge of the foot seldom bears the body alone. The bounds leave room for recordings
# whose feet are marked inexactly: the middle half of the steps of `bandai`'s walk shows 2.1 to 2.4.
MIN_PULL_RATIO, USUAL_PULL_RATIO, MAX_PULL_RATIO = 0.5, 1.2, 3.5
N_TIPPING_STEPS, N_STEP_FRAMES = 4, 5
TIPPING_M = 0.05
_EVEN_S = 0.3  # a body on one foot accelerates evenly for as long
_MAX_SPEED_RATIO = 15.0  # 240 frames a second labelled 24 play 10 times too slow


class Bounds(NamedTuple):
    """Bounds on the signs of a right clock; the defaults are those of `question_tempo`.

    Attributes:
        flight: least and greatest gravity in flights, g.
        fall: greatest downward acceleration, m/s2.
        cadence: greatest cadence of even steps in walks.
        pull: least and greatest gravity that steps show, g.
    """

    flight: tuple[float, float] = (0.4, 1.6)  # one flight of a recording falls at 0.46 g
    fall: float = MAX_FALL_MPS2
    cadence: float = RUN_CADENCE_RATIO
    pull: tuple[float, float] = (MIN_PULL_RATIO, MAX_PULL_RATIO)


class Signs(NamedTuple):
    """The signs of a clock in movement; NaN where it shows none.

    Attributes:
        flight: median gravity of its flights, g.
        fall: 99th percentile of its downward accelerations, m/s2.
        cadence: fastest rate of even steps in a row per sqrt(leg / gravity), of movement that falls as no runner does.
        pulls: quartiles of the gravities that its steps show, g.
        pull: gravity by these steps, g.
        leg: length of a leg, metres.
    """

    flight: float
    fall: float
    cadence: float
    pulls: tuple[float, float]
    pull: float
    leg: float


def question_tempo(motion: Motion) -> str:
    """Describe how a person's movement contradicts its frame rate; "" if it does not, or shows nothing.

    Args:
        motion: movement on human23. Other bodies, keyframes with lines between them, and movement in which the engine
            made frames pass without question.

    Returns:
        A phrase such as "about 2 times too fast: it falls at 39 m/s2, gravity is 9.8".
    """
    signs = find_signs(motion)
    return "" if signs is None else question_signs(signs)


def find_signs(motion: Motion) -> Signs | None:
    """Return the signs of a movement's clock; None where `question_tempo` does not look for any."""
    if human23().difference(motion.skeleton) is not None or motion.fps < 20.0:  # too slow to show accelerations
        return None
    is_person = SHORTEST_PERSON_M <= motion.skeleton.height <= TALLEST_PERSON_M  # else the unit is wrong
    if motion.keyframed or motion.insertions or not is_person:
        return None
    if np.ptp(np.diff(motion.times)) > 0.01 / motion.fps:  # each frame has a time of its own
        return None
    begin = int(0.25 * motion.fps)  # a T-pose may have been added in the first 0.25 s
    if len(motion) < begin + 0.25 * motion.fps:
        return None
    part = motion.slice(begin, len(motion))
    even = part.resample(60.0) if part.fps > 60.0 else part
    mass = centre_of_mass(even.skeleton, even.rotations, even.root)
    if mass is None or _is_drawn(even):
        return None
    flights = _flights(even, mass[:, 1])
    fall = float(np.percentile(_falls(mass[:, 1], even.fps), 99.0))
    cadence, leg = _cadence(even)
    # A runner at this cadence falls faster than 0.8 g for a hundredth of the time.
    walks = cadence > 0.0 and fall < 0.8 * GRAVITY_MPS2
    # Movement that plays too fast has few frames a second: its steps need them all.
    pulls, pull = _pulls(part.resample(120.0) if part.fps > 120.0 else part)
    return Signs(
        float(np.median(flights)) / GRAVITY_MPS2 if flights else np.nan,
        fall,
        cadence if walks else np.nan,
        pulls,
        pull,
        leg,
    )


def question_signs(signs: Signs, bounds: Bounds = Bounds()) -> str:  # noqa: B008 - it is immutable
    """Describe the first sign beyond its bounds, as `question_tempo` does; "" if none is."""
    return next(filter(None, (_phrase(speed, evidence) for speed, evidence in _contradictions(signs, bounds))), "")


def _contradictions(signs: Signs, bounds: Bounds) -> Iterator[tuple[float, str]]:
    """Yield how many times too fast movement plays by each sign beyond its bounds, and the evidence."""
    if signs.flight < bounds.flight[0] or signs.flight > bounds.flight[1]:
        gravity = signs.flight * GRAVITY_MPS2
        yield np.sqrt(signs.flight), f"in the air it falls at {gravity:.2g} m/s2, gravity is 9.8"
    if signs.fall > bounds.fall:
        yield np.sqrt(signs.fall / GRAVITY_MPS2), f"it falls at {signs.fall:.2g} m/s2, gravity is 9.8"
    if signs.cadence > bounds.cadence:
        rate = signs.cadence / np.sqrt(signs.leg / GRAVITY_MPS2)
        yield signs.cadence / WALK_CADENCE_RATIO, f"it walks with {rate:.2g} steps a second, and never runs"
    if signs.pulls[0] > bounds.pull[1] or signs.pulls[1] < bounds.pull[0]:
        gravity = signs.pull * GRAVITY_MPS2
        yield np.sqrt(signs.pull), f"it tips over one foot as if gravity were {gravity:.2g} m/s2, not 9.8"


def _pulls(motion: Motion) -> tuple[tuple[float, float], float]:
    """Return the quartiles of the gravities that steps show, and the gravity by them, g; NaN with too few steps."""
    steps, speed = _steps(motion), 1.0
    for _ in range(4):  # the speed decides how long a body accelerates evenly
        shown = [step.gravities(motion.fps, _EVEN_S / speed) for step in steps]
        if sum(map(bool, shown)) < N_TIPPING_STEPS:
            return (np.nan, np.nan), np.nan
        found = np.concatenate(shown) / GRAVITY_MPS2
        pull = float(np.median(found)) / USUAL_PULL_RATIO
        speed = float(np.clip(np.sqrt(pull), 1.0 / _MAX_SPEED_RATIO, _MAX_SPEED_RATIO))
    low, high = np.percentile(found, [25.0, 75.0])
    return (float(low), float(high)), pull


class _Step(NamedTuple):
    """A person on one foot in T frames.

    Attributes:
        mass: centre of mass [T, 3], metres.
        height: its height above the foot [T], metres.
        overhang: its distance from the foot, seen from above [T], metres for a body as tall as human23.
    """

    mass: Floats
    height: Floats
    overhang: Floats

    def gravities(self, fps: float, seconds: float) -> list[float]:
        """Return the gravity in each piece of at most `seconds` that overhangs the foot for a third of it."""
        count = max(min(-(-len(self.mass) // max(round(seconds * fps), 1)), len(self.mass) // N_STEP_FRAMES), 1)
        pieces = [_Step(*each) for each in zip(*(np.array_split(one, count) for one in self), strict=True)]
        return [piece.gravity(fps) for piece in pieces if np.mean(piece.overhang > TIPPING_M) > 1.0 / 3.0]

    def gravity(self, fps: float) -> float:
        """Return the gravity that makes the body tip as it does, if the foot's edge bears it, m/s2.

        The zero-moment point, c - (h / g) c'' for a centre of mass c at height h, stays within the foot: Kajita et al.,
        "Biped walking pattern generation by using preview control of zero-moment point", ICRA (2003).
        """
        times = (np.arange(len(self.mass)) - 0.5 * (len(self.mass) - 1)) / fps
        powers = np.stack([np.ones_like(times), times, times**2 / 2.0, times**3 / 6.0], axis=1)
        curve = np.linalg.lstsq(powers, self.mass, rcond=None)[0]
        tips = self.overhang > TIPPING_M
        x, y, z = (curve[2] + curve[3] * times[tips, None]).T
        weight = np.maximum(1.0 + y / GRAVITY_MPS2, 0.1)  # bodies press harder on the foot while they rise
        return float(np.sum(np.hypot(x, z) * self.height[tips]) / np.sum(weight * self.overhang[tips]))


def _steps(motion: Motion) -> list[_Step]:
    """Return the steps of an upright person whose body travels over one foot.

    Speeds are compared with one another only: the same frames are steps at any frame rate.
    """
    body, size = motion.skeleton, _leg(motion.skeleton) / _leg(human23())
    posed = pose(body, motion.rotations, motion.root)
    mass = centre_of_mass(body, motion.rotations, motion.root)
    assert mass is not None
    heights = posed.places[..., 1] - posed.lowest[:, None]
    travel = _strides(mass)
    feet = [np.isin(posed.joints, [body.index(f"{side}_{joint}") for joint in ("ankle", "toes")]) for side in SIDES]
    strides = [np.median(_strides(posed.places[:, foot]), axis=1) for foot in feet]
    # People who sit, kneel or crawl lean on more than their feet.
    is_upright = heights[:, 0] > 0.8 * _leg(body)
    is_upright &= heights[:, ~(feet[0] | feet[1])].min(axis=1) > 0.1 * size
    steps = []
    for one, other in ((0, 1), (1, 0)):
        stands = (heights[:, feet[one]].min(axis=1) < SUPPORT_HEIGHT_M * size) & (strides[one] < 0.25 * travel)
        swings = (strides[other] > travel) | (heights[:, feet[other]].min(axis=1) > 0.1 * size)
        points = posed.places[:, feet[one]][..., [0, 2]]
        over = overhang(points, np.ones(points.shape[:2], dtype=bool), mass[:, [0, 2]])
        for begin, end in runs_of(is_upright & stands & swings):
            part = slice(begin, end)
            if end - begin >= N_STEP_FRAMES and np.linalg.norm(mass[end - 1, [0, 2]] - mass[begin, [0, 2]]) > TIPPING_M:
                steps.append(_Step(mass[part], (mass[:, 1] - posed.lowest)[part], over[part]))
    return steps


def _strides(places: Floats) -> Floats:
    """Return the mean horizontal displacements per frame [T, ...] of points [T, ..., 3], metres."""
    return rot.norm(np.gradient(places[..., [0, 2]], axis=0))


def _leg(body: Skeleton) -> float:
    """Return the length of a person's left leg, metres."""
    return float(sum(np.linalg.norm(body.offsets[body.index(f"left_{joint}")]) for joint in ("knee", "ankle")))


def _is_drawn(motion: Motion) -> bool:
    """Return whether the root moves in straight lines between keyframes: turns occur in fewer than half the frames."""
    steps = np.diff(motion.root, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    least = 1e-4 * lengths.max()
    turns = np.linalg.norm(np.diff(steps, axis=0), axis=1)[lengths[1:] > least]
    return len(turns) > 0 and bool(np.mean(turns <= least) > 0.5)


def _phrase(speed: float, evidence: str) -> str:
    """Return the message for movement that plays `speed` times too fast; "" if no clock is so wrong."""
    if not 1.0 / _MAX_SPEED_RATIO < speed < _MAX_SPEED_RATIO:
        return ""
    how = f"{speed:.2g} times too fast" if speed > 1.0 else f"{1.0 / speed:.2g} times too slow"
    return f"about {how}: {evidence}"


def _falls(heights: Floats, fps: float) -> Floats:
    """Return downward accelerations of heights [T], metres per second squared, by a parabola through 0.15 s."""
    frames = max(round(0.15 * fps) | 1, 5)
    times = (np.arange(frames) - frames // 2) / fps
    curvature = 2.0 * np.linalg.pinv(np.stack([np.ones(frames), times, times**2], axis=1))[2]
    return -np.convolve(heights, curvature[::-1], "valid")


def _flights(motion: Motion, heights: Floats) -> list[float]:
    """Return downward accelerations of clear flights, metres per second squared, given heights of the mass [T]."""
    lowest = lowest_height(motion.skeleton, motion.rotations, motion.root)
    lift = lowest - floor_height(lowest)
    found = []
    for begin, end in runs_of(lift > 0.04):
        times = np.arange(end - begin) / motion.fps
        if begin == 0 or end == len(lift) or times[-1] < 0.12 or lift[begin:end].max() < 0.1:
            continue
        curve = np.polynomial.Polynomial.fit(times, heights[begin:end], 2)
        fall = -float(curve.deriv(2)(0.0))
        rise = fall * times[-1] ** 2 / 8.0
        if rise > 0.05 and np.abs(curve(times) - heights[begin:end]).max() < 0.1 * rise:
            found.append(fall)
    return found


def runs_of(flags: Bools) -> list[tuple[int, int]]:
    """Return the first index of each run of true flags, and the index after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _cadence(motion: Motion) -> tuple[float, float]:
    """Return the fastest rate of even steps in a row, per sqrt(leg / gravity), 0 for none; and the leg length, metres.

    A step lasts from one passing of the ankles, along the direction of travel, to the next.
    """
    body = motion.skeleton
    leg = _leg(body)
    places = motion.skeleton.positions(motion.rotations, motion.root)[..., [0, 2]]
    root = places[:, 0]
    apart = places[:, body.index("left_ankle")] - places[:, body.index("right_ankle")]
    frames = 2 * max(round(0.1 * motion.fps), 1) + 1
    way = np.gradient(root, axis=0)
    way = np.stack([np.convolve(way[:, axis], np.ones(frames) / frames, "same") for axis in (0, 1)], axis=1)
    ahead = np.sum(apart * way, axis=1) / np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    passes = np.flatnonzero(np.diff(ahead >= 0.0))
    times = np.diff(passes) / motion.fps
    lengths = np.linalg.norm(np.diff(root[passes], axis=0), axis=1) / leg
    spread = np.array([np.abs(ahead[a : b + 1]).max() for a, b in pairwise(passes.tolist())]) / leg
    quickest = 0.0
    for i in range(len(times) - N_EVEN_STEPS + 1):
        some, long = times[i : i + N_EVEN_STEPS], lengths[i : i + N_EVEN_STEPS]
        if (  # lengths relative to the legs
            long.min() > 0.45
            and spread[i : i + N_EVEN_STEPS].min() > 0.25
            and some.max() < 1.4 * some.min()
            and long.max() < 1.5 * long.min()
        ):
            quickest = max(quickest, float(np.sqrt(leg / GRAVITY_MPS2) / some.mean()))
    return quickest, leg
