"""Questions the clock of a recording: whether a person can move so fast, or fall so slowly, as it says.

Files state their frames a second, and converters copy the line from other files. Three things of movement do not depend
on style, and give a wrong clock away: at k times its speed all accelerations are k squared times theirs.

- Nothing pulls a mass down but gravity: what falls faster for longer than noise lasts plays too fast.
- In the air a mass falls with gravity's acceleration, no more and no less, so flights show a slow clock, too.
- Who takes long, even steps in quick succession runs, and flies in between: to walk so is to play too fast.

A slow dance shows none of them, at whatever speed. The bounds are from 49 recordings of two people (CMU's subjects 05,
and 16 with odd numbers). None of these, nor of 51 others (16 with even numbers, karate, Indian dance, Bandai-Namco's),
is questioned at its own speed; at twice the speed 56 of the 100 are, at half the speed 19.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import floor_height, lowest_height
from motionmind.body.human import SHORTEST, TALLEST, human23
from motionmind.body.motion import Motion
from motionmind.body.plausibility import GRAVITY
from motionmind.body.support import centre_of_mass

_RATE = 60.0  # frames a second that are looked at, at most
_UNEVEN = 0.01  # of a frame: a clock that states frames a second is even
_SLOWEST = 20.0  # frames a second below which accelerations are not seen
_BEGINS = 0.25  # seconds that are left out: a T-pose may have been added there
_LONG = 0.5  # seconds, at least, that are looked at
_WINDOW, _FRAMES = 0.15, 5  # seconds, and frames at least, over which an acceleration is taken
_SHARE = 99.0  # percentile of the accelerations downwards
_FALLS = 19.5  # metres a second squared: in the recordings 17 at most, with hips that were recorded badly

_STRAIGHT = 1e-4  # of the longest step: the least turn in a frame
_DRAWN = 0.5  # share of moving frames without a turn, from which movement was drawn

_LIFTED, _SHORTEST = 0.04, 0.12  # metres off the floor, and seconds: a flight
_CLEAR, _HIGH = 0.1, 0.05  # metres that feet come off the floor, and the mass above its chord, in one that counts
_PARABOLA = 0.1  # share of that height by which it may be off a parabola
_FLOATS, _DROPS = 0.6, 1.6  # times gravity, the slowest and fastest fall
_NONSENSE = 5.0  # times the speed: no clock is so wrong, and what moves so is no body

_STEPS = 4  # in a row
_LONG_STEP, _WIDE = 0.45, 0.25  # of the legs' length: travel in a step, and feet apart
_EVEN_TIME, _EVEN_LENGTH = 1.4, 1.5  # the longest step by the shortest
_CADENCE = 0.92  # steps in the time sqrt(leg / gravity): walks have 0.45 to 0.66, runs 0.73 to 1.14
_WALKS = 0.8  # times gravity: who runs at such a cadence falls faster for a hundredth of the time
_STRIDES = 0.52  # the cadence of walks


def question_tempo(motion: Motion) -> str:
    """Say how a person's movement contradicts its clock; "" if it does not, or nothing can be told.

    Args:
        motion: movement on human23; other bodies are not questioned, nor are keyframes and lines between them, nor
            movement in which the engine made frames: its clock is right.

    Returns:
        A phrase such as "about 2 times too fast: it falls at 39 m/s2, gravity is 9.8".
    """
    if human23().difference(motion.skeleton) is not None or motion.fps < _SLOWEST:
        return ""
    if motion.keyframed or motion.insertions:
        return ""
    if not SHORTEST <= motion.skeleton.height <= TALLEST:  # it is not the clock that is wrong
        return ""
    if np.ptp(np.diff(motion.times)) > _UNEVEN / motion.fps:  # each frame has a time of its own
        return ""
    if motion.fps > _RATE:
        motion = motion.resample(_RATE)
    begin = int(_BEGINS * motion.fps)
    if len(motion) < begin + _LONG * motion.fps:
        return ""
    part = motion.slice(begin, len(motion))
    mass = centre_of_mass(part.skeleton, part.rotations, part.root)
    return "" if mass is None or _is_drawn(part) else _question(part, mass[:, 1])


def _question(motion: Motion, heights: Floats) -> str:
    """Say how movement contradicts its clock, given the heights of its mass [T]; "" if it does not."""
    flights = _flights(motion, heights)
    gravities = float(np.median(flights)) / GRAVITY if flights else 1.0
    if not _FLOATS < gravities < _DROPS:
        return _phrase(np.sqrt(gravities), f"in the air it falls at {gravities * GRAVITY:.2g} m/s2, gravity is 9.8")
    falls = float(np.percentile(_falls(heights, motion.fps), _SHARE))
    if falls > _FALLS:
        return _phrase(np.sqrt(falls / GRAVITY), f"it falls at {falls:.2g} m/s2, gravity is 9.8")
    cadence, leg = _cadence(motion)
    if cadence > _CADENCE and falls < _WALKS * GRAVITY:
        rate = cadence / np.sqrt(leg / GRAVITY)
        return _phrase(cadence / _STRIDES, f"it walks with {rate:.2g} steps a second, and never runs")
    return ""


def _is_drawn(motion: Motion) -> bool:
    """Return whether the root goes in straight lines from keyframe to keyframe, at whose corners no mass could turn."""
    steps = np.diff(motion.root, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    least = _STRAIGHT * lengths.max()
    turns = np.linalg.norm(np.diff(steps, axis=0), axis=1)[lengths[1:] > least]
    return len(turns) > 0 and bool(np.mean(turns <= least) > _DRAWN)


def _phrase(speed: float, evidence: str) -> str:
    """Return the fault, if movement plays `speed` times too fast; "" if that is beyond all clocks."""
    if not 1.0 / _NONSENSE < speed < _NONSENSE:
        return ""
    how = f"{speed:.2g} times too fast" if speed > 1.0 else f"{1.0 / speed:.2g} times too slow"
    return f"about {how}: {evidence}"


def _falls(heights: Floats, fps: float) -> Floats:
    """Return the accelerations downwards of heights [T], metres a second squared: of the parabola through a window."""
    frames = max(round(_WINDOW * fps) | 1, _FRAMES)
    times = (np.arange(frames) - frames // 2) / fps
    curvature = 2.0 * np.linalg.pinv(np.stack([np.ones(frames), times, times**2], axis=1))[2]
    return -np.convolve(heights, curvature[::-1], "valid")


def _flights(motion: Motion, heights: Floats) -> list[float]:
    """Return the accelerations downwards of clear flights, metres a second squared; `heights` [T] are the mass's."""
    lowest = lowest_height(motion.skeleton, motion.rotations, motion.root)
    lift = lowest - floor_height(lowest)
    found = []
    for begin, end in runs_of(lift > _LIFTED):
        times = np.arange(end - begin) / motion.fps
        if begin == 0 or end == len(lift) or times[-1] < _SHORTEST or lift[begin:end].max() < _CLEAR:
            continue
        curve = np.polynomial.Polynomial.fit(times, heights[begin:end], 2)
        fall = -float(curve.deriv(2)(0.0))
        rise = fall * times[-1] ** 2 / 8.0
        if rise > _HIGH and np.abs(curve(times) - heights[begin:end]).max() < _PARABOLA * rise:
            found.append(fall)
    return found


def runs_of(flags: Bools) -> list[tuple[int, int]]:
    """Return the first index of each run of true flags, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _cadence(motion: Motion) -> tuple[float, float]:
    """Return the quickest even steps in a row, per time sqrt(leg / gravity), 0 for none; and the legs' length, metres.

    A step lasts from one moment when the ankles pass each other, along the body's way, to the next.
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
    for i in range(len(times) - _STEPS + 1):
        some, long = times[i : i + _STEPS], lengths[i : i + _STEPS]
        if (
            long.min() > _LONG_STEP
            and spread[i : i + _STEPS].min() > _WIDE
            and some.max() < _EVEN_TIME * some.min()
            and long.max() < _EVEN_LENGTH * long.min()
        ):
            quickest = max(quickest, float(np.sqrt(leg / GRAVITY) / some.mean()))
    return quickest, leg
