"""Detect a wrong frame rate in a recording from the speed of falls and steps.

Converters copy the frame rate from other files. At k times the true speed, accelerations are k squared times as large.
Three signs do not depend on style:

- Only gravity pulls a mass down: movement that falls faster for longer than noise lasts plays too fast.
- In the air a mass falls with exactly gravity's acceleration, so flights show a slow clock, too.
- A person who takes long, even steps in quick succession runs, with flights in between: a walk at that cadence plays
  too fast.

A slow dance shows none of them at any speed. The bounds come from 49 recordings of two people (CMU's subjects 05, and
16 with odd numbers). None of these, nor of 51 others (16 with even numbers, karate, Indian dance, Bandai-Namco's), is
questioned at its own speed; 56 of the 100 are at twice the speed, and 19 at half the speed.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import floor_height, lowest_height
from motionmind.body.human import SHORTEST_PERSON_M, TALLEST_PERSON_M, human23
from motionmind.body.motion import Motion
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.support import centre_of_mass

# CMU's subjects 05 and 16: recordings fall at 17 m/s2 at most (with hips that were recorded badly); walks take 0.45 to
# 0.66 steps in the time sqrt(leg / gravity), runs 0.73 to 1.14.
MAX_FALL_MPS2 = 19.5
RUN_CADENCE_RATIO, WALK_CADENCE_RATIO = 0.92, 0.52
N_EVEN_STEPS = 4


def question_tempo(motion: Motion) -> str:
    """Describe how a person's movement contradicts its frame rate; "" if it does not, or shows nothing.

    Args:
        motion: movement on human23. Other bodies, keyframes with lines between them, and movement in which the engine
            made frames pass without question.

    Returns:
        A phrase such as "about 2 times too fast: it falls at 39 m/s2, gravity is 9.8".
    """
    if human23().difference(motion.skeleton) is not None or motion.fps < 20.0:  # too slow to show accelerations
        return ""
    if motion.keyframed or motion.insertions:
        return ""
    if not SHORTEST_PERSON_M <= motion.skeleton.height <= TALLEST_PERSON_M:  # the unit is wrong, not the frame rate
        return ""
    if np.ptp(np.diff(motion.times)) > 0.01 / motion.fps:  # each frame has a time of its own
        return ""
    if motion.fps > 60.0:
        motion = motion.resample(60.0)
    begin = int(0.25 * motion.fps)  # a T-pose may have been added in the first 0.25 s
    if len(motion) < begin + 0.5 * motion.fps:
        return ""
    part = motion.slice(begin, len(motion))
    mass = centre_of_mass(part.skeleton, part.rotations, part.root)
    return "" if mass is None or _is_drawn(part) else _question(part, mass[:, 1])


def _question(motion: Motion, heights: Floats) -> str:
    """Describe how movement contradicts its frame rate, given the heights of its mass [T]; "" if it does not."""
    flights = _flights(motion, heights)
    gravities = float(np.median(flights)) / GRAVITY_MPS2 if flights else 1.0
    if not 0.6 < gravities < 1.6:
        return _phrase(
            np.sqrt(gravities), f"in the air it falls at {gravities * GRAVITY_MPS2:.2g} m/s2, gravity is 9.8"
        )
    falls = float(np.percentile(_falls(heights, motion.fps), 99.0))
    if falls > MAX_FALL_MPS2:
        return _phrase(np.sqrt(falls / GRAVITY_MPS2), f"it falls at {falls:.2g} m/s2, gravity is 9.8")
    cadence, leg = _cadence(motion)
    # A runner at this cadence falls faster than 0.8 g for a hundredth of the time.
    if cadence > RUN_CADENCE_RATIO and falls < 0.8 * GRAVITY_MPS2:
        rate = cadence / np.sqrt(leg / GRAVITY_MPS2)
        return _phrase(cadence / WALK_CADENCE_RATIO, f"it walks with {rate:.2g} steps a second, and never runs")
    return ""


def _is_drawn(motion: Motion) -> bool:
    """Return whether the root moves in straight lines between keyframes: turns occur in fewer than half the frames."""
    steps = np.diff(motion.root, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    least = 1e-4 * lengths.max()
    turns = np.linalg.norm(np.diff(steps, axis=0), axis=1)[lengths[1:] > least]
    return len(turns) > 0 and bool(np.mean(turns <= least) > 0.5)


def _phrase(speed: float, evidence: str) -> str:
    """Return the message for movement that plays `speed` times too fast; "" if no clock is so wrong."""
    if not 1.0 / 5.0 < speed < 5.0:
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
    leg = float(sum(np.linalg.norm(body.offsets[body.index(f"left_{joint}")]) for joint in ("knee", "ankle")))
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
