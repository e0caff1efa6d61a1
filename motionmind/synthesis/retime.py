"""Retiming: slow a movement down where it is faster than usual in the corpus; time leaps by gravity (`jump_in_time`).

Before the path is known, the distance between the two postures sets the duration, but a joint may go there and back on
the way. Where that would be faster than 99 % of the corpus's samples, the clock of the whole body slows down smoothly
over a few half steps, so that its joints stay together.

The synthesis then adds movement of the feet and for balance, some of it quick. So the clock slows down again where the
result exceeds the peaks of corpus movement of that length (`motionmind.learned.pace.Pace.peaks`). The same holds where
a joint is much faster than in nearly all samples, and where a foot near the floor is faster than usual. It
keeps its speed in free fall, but not where a body dips as fast with its feet on the floor.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import TALL_BODY_M, Posed, lowest_height, pose, slides_between
from motionmind.body.motion import Motion
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import centre_of_mass, size_of
from motionmind.corpus.corpus import Corpus
from motionmind.footing.flight import SHORTEST_PUSH_OFF_S, find_falls
from motionmind.footing.smoothing import bell, sliding_max
from motionmind.geometry import rotations as rot
from motionmind.learned.pace import moved_in, steps_of, ways
from motionmind.learned.peaks import accelerations
from motionmind.walks.expectation import Expectation

SPEED_HEADROOM_RATIO = 0.9  # of the fastest speeds; passages and the synthesis add to speeds later
JOINT_SPEED_RATIO = 1.13  # largest speed of a joint, relative to the 99th percentile in the corpus; chosen on ballet
LEAP_JOINT_SPEED_RATIO = 2.5  # the same in a leap
SLOWDOWN_AROUND_S = 1.0 / 6.0  # around an excess, in which the clock slows down
SLOWDOWN_FROM_END_S = 0.3  # from an end with a given velocity, in which the clock may begin to slow down
MIN_CLOCK_CHANGE_RATIO = 1e-3
LEFT_FLOOR_M = 0.1  # for a person: walks no higher than this have not left the floor
TAKEOFF_LOWER_M = 0.1  # for a person: do not hurry a take-off that is at most this much lower than possible


def keep_pace(
    walk: Expectation,
    frames: Floats,
    corpus: Corpus,
    fastest: Floats,
    travel: Floats,
    moving: tuple[bool, bool],
) -> Floats:
    """Return the factor by which to stretch each half step of a walk [2 T], at least 1.

    Args:
        walk: the movement at its half steps.
        frames: times between which to measure the speeds, increasing, seconds.
        corpus: the corpus of the walk.
        fastest: speeds of the joints, rad/s, of the body's turning, and of its travel, heights/s [J + 2].
        travel: level displacement of the root in each half step [2 T, 3], metres, on the corpus's skeleton.
        moving: whether the first and the last posture have a given velocity, which must not change.
    """
    times = walk.half_steps
    root = np.concatenate([np.zeros((1, 3)), np.cumsum(travel, axis=0)])
    at = np.stack([np.interp(frames, times, axis) for axis in root.T], axis=1)
    rotations = rot.normalise(corpus.from_chains(walk.chains(corpus, frames)))
    way = ways(corpus.skeleton, (rotations[:-1], rotations[1:]), (at[:-1], at[1:]))
    speeds = way.parts / np.diff(frames)[:, None]
    slower = np.ones(len(travel))
    step = np.searchsorted(times, 0.5 * (frames[1:] + frames[:-1])) - 1
    np.maximum.at(slower, step.clip(0, len(slower) - 1), (speeds / (SPEED_HEADROOM_RATIO * fastest)).max(axis=1))
    # A maximum of five before the mean of five: each half step slows down at least as much as it needs.
    slower = _mean_around(sliding_max(slower, 2), np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0)
    middle = 0.5 * (times[1:] + times[:-1])
    for is_moving, since in zip(moving, (middle - times[0], times[-1] - middle), strict=True):
        if is_moving:
            slower = 1.0 + (slower - 1.0) * np.clip(since / SLOWDOWN_FROM_END_S, 0.0, 1.0)
    return np.asarray(slower)


def jump_in_time(
    skeleton: Skeleton,
    rotations: Floats,
    seconds: Floats,
    heights: Floats,
    low: Floats,
    in_air: Bools,
    reach: tuple[int, int],
    fastest: Floats,
) -> Floats:
    """Return the factor by which to stretch each half step [2 T], at most 1, so that jumps start from stretched legs.

    If the first or the last posture is in the air, gravity sets the time between it and the floor. A slower walk would
    take off in a lower posture, such as a split. Speed the legs up instead, so that the body takes off in the posture
    in which it stands highest.

    Args:
        skeleton: the body.
        rotations: local rotations at the half steps [2 T + 1, J, 4].
        seconds: durations of the half steps [2 T].
        heights: heights of the corpus's lowest points above the floor at the half steps [2 T + 1], metres.
        low: height of the lowest point above the floor in the first and in the last posture [2], metres.
        in_air: whether each is in the air with no velocity given [2].
        reach: half steps from each to the next given posture.
        fastest: speeds of the joints, rad/s [J]; a hurried step stays below LEAP_JOINT_SPEED_RATIO times these.
    """
    out, still = np.ones(len(seconds)), np.zeros((len(rotations), 3))
    mass = centre_of_mass(skeleton, rotations, still) if in_air.any() else None
    if mass is None:
        return out
    standing, size = mass[:, 1] - lowest_height(skeleton, rotations, still), size_of(skeleton)
    for end, onward in ((0, slice(None)), (-1, slice(None, None, -1))):
        if not in_air[end]:
            continue
        # Onwards from the first posture, or back from the last.
        high, takes, best, highest, hurries, quicker = standing[onward], 0.0, np.inf, 0.0, 0.0, (0, 1.0)
        for step in range(1, reach[end] + 1):
            if heights[onward][step] < LEFT_FLOOR_M * size:
                break
            turned = rot.angle(rotations[onward][step - 1], rotations[onward][step])
            hurries = max(hurries, float((turned / fastest).max()) / seconds[onward][step - 1])
            takes += seconds[onward][step - 1]
            highest = max(highest, high[step])
            rise = high[0] + low[end] - high[step]
            share = np.sqrt(2.0 * rise / GRAVITY_MPS2) / takes if rise > 0.0 else np.inf
            if share >= 1.0:
                continue
            if np.isinf(best):  # before this step it would leave the floor
                best = min(high[step - 1], high[step]) + TAKEOFF_LOWER_M * size
            if high[step] > best and hurries <= LEAP_JOINT_SPEED_RATIO * share:
                best, quicker = high[step] + 0.02 * size, (step, share)  # a longer fall must gain 0.02 m
        if high[quicker[0]] > highest - TAKEOFF_LOWER_M * size:  # halfway down, legs would still be apart
            out[onward][: quicker[0]] = quicker[1]
    return out


def land_between(seconds: Floats, heights: Floats, size: float, moving: tuple[bool, bool]) -> Floats:
    """Return the factor by which to stretch each half step [2 T], at least 1, so that a body in the air at both ends
    lands in between, unless one low leap joins the two.

    Args:
        seconds: durations of the half steps [2 T].
        heights: heights of the lowest points above the floor at both ends [2], metres.
        size: size of the body (`motionmind.body.support.size_of`).
        moving: whether the velocity at the first and at the last posture is given.
    """
    takes = float(seconds.sum())
    rate = (heights[1] - heights[0]) / takes + 0.5 * GRAVITY_MPS2 * takes
    top = heights[0] + 0.5 * rate**2 / GRAVITY_MPS2 if 0.0 < rate < GRAVITY_MPS2 * takes else heights.max()
    needs = np.sqrt(2.0 * heights / GRAVITY_MPS2).sum() + 3.0 * SHORTEST_PUSH_OFF_S
    if top <= heights.max() + LEFT_FLOOR_M * size or takes >= needs:
        return np.ones(len(seconds))
    middles = np.cumsum(seconds) - 0.5 * seconds
    free = _freedom(middles, [at for at, given in zip((0.0, takes), moving, strict=True) if given], np.inf)
    return np.asarray(1.0 + free * (needs - takes) / max(float(free @ seconds), 1e-9))


def slower_steps(
    motion: Motion, most: Floats, moving: tuple[bool, bool], slides: float = np.inf, kept: Sequence[float] = ()
) -> Floats:
    """Return the factor by which to stretch each step of a movement [N - 1] to respect the speed limits.

    Args:
        motion: the movement.
        most: limits on the speeds of the joints and of the body's turning, rad/s, of its travel and rise, heights/s,
            and on the root's acceleration, heights/s^2 [J + 4].
        moving: whether the first and the last posture have a given velocity, which must not change.
        slides: limit on the speed of a foot near the floor, heights/s; only for bodies at least as tall as people.
        kept: times that stay, increasing up to the last frame's, or none: slower steps between them then take time from
            steps with slack.
    """
    posed = pose(motion.skeleton, motion.rotations, motion.root)
    slower, slack = _factors(motion, posed, most, slides, moving)
    seconds = np.diff(motion.times)
    frames = np.rint(np.interp([motion.times[0], *kept], motion.times, np.arange(len(motion)))).astype(int)
    for begin, end in pairwise(frames.tolist()):
        part = slice(begin, end)
        slower[part] = _keep_duration(slower[part], slack[part], seconds[part])
    return slower


def _factors(
    motion: Motion, posed: Posed, most: Floats, slides: float, moving: tuple[bool, bool]
) -> tuple[Floats, Floats]:
    """Return the factor by which to stretch each step of a movement [N - 1], at least 1, and the share of its time that
    it can spare [N - 1].

    Args:
        motion: the movement.
        posed: the same, in the world.
        most: limits, as in `slower_steps`.
        slides: speed of a foot near the floor, heights/s.
        moving: whether the velocity at the first and at the last posture is given.
    """
    times, body = motion.times, motion.skeleton
    middles, fps = 0.5 * (times[1:] + times[:-1]), 1.0 / float(times[1] - times[0])
    ends = [time for fixed, time in zip(moving, times[[0, -1]], strict=True) if fixed]
    free = np.minimum(
        _freedom(middles, ends, fps), _freedom(middles, times[_falling(body, posed, fps)], fps, SHORTEST_PUSH_OFF_S)
    )
    moved = moved_in(motion)
    shown = (fps * steps_of(motion) / most[:-1]).max(axis=1)
    # At half the speed a movement has a quarter of its accelerations, each between two steps.
    changes = np.sqrt(accelerations(moved, fps) / most[-1])
    changes[_braking(moved, moving, fps)] = 1.0  # a slower clock would brake harder from a given velocity
    shown[1:], shown[:-1] = np.maximum(shown[1:], changes), np.maximum(shown[:-1], changes)
    if np.isfinite(slides) and body.height >= TALL_BODY_M:
        slid = slides_between(body, posed.places, _floor(times, posed.lowest, times))
        shown = np.maximum(shown, fps * slid.max(axis=1, initial=0.0) / (slides * body.height))
    shown[free < MIN_CLOCK_CHANGE_RATIO] = 1.0
    reach = max(1, round(SLOWDOWN_AROUND_S * fps))

    def around(values: Floats) -> Floats:
        return _mean_around(sliding_max(values, reach), bell(reach))

    slower = 1.0 + free * (around(np.maximum(shown, 1.0)) - 1.0)
    return slower, free * (1.0 - around(np.minimum(shown, 1.0)))


def _mean_around(values: Floats, weights: Floats) -> Floats:
    """Return the weighted means [N] around each value, with weights [2 n + 1] and the end values repeated."""
    reach = len(weights) // 2
    return np.convolve(values[np.arange(-reach, len(values) + reach).clip(0, len(values) - 1)], weights, "valid")


def _braking(moved: Floats, moving: tuple[bool, bool], fps: float) -> Bools:
    """Return whether a body brakes from a given velocity, or speeds up to one, between steps [N - 2].

    Args:
        moved: displacements of the root in each step [N - 1, 3].
        moving: whether the first and the last frame have a given velocity.
        fps: frames a second.
    """
    faster, out = np.diff(np.linalg.norm(moved, axis=1)), np.zeros(len(moved) - 1, dtype=np.bool_)
    near = round(SLOWDOWN_FROM_END_S * fps)
    if moving[0]:
        out[:near] |= faster[:near] < 0.0
    if moving[1]:
        out[-near:] |= faster[-near:] > 0.0
    return out


def _keep_duration(slower: Floats, slack: Floats, seconds: Floats) -> Floats:
    """Return the factor by which to stretch each step [N - 1] so that the total duration stays the same.

    Args:
        slower: factor by which each step should stretch [N - 1].
        slack: share of its time that each can spare [N - 1]; steps that need more than 0.3 of the total do not change.
        seconds: durations of the steps [N - 1].
    """
    more, spare = float((slower - 1.0) @ seconds), float(slack @ seconds)
    if more > 0.3 * spare:
        return np.ones(len(slower))
    return np.asarray(slower - slack * (more / max(spare, 1e-9)))


def _floor(times: Floats, low: Floats, at: Floats) -> Floats:
    """Return the height of the floor at some times [M], metres: 0, or lower under ends whose lowest points are lower.

    Args:
        times: of the movement [N], seconds.
        low: heights of its lowest points [N], metres.
        at: the times [M].
    """
    return np.interp(at, times[[0, -1]], np.minimum(low[[0, -1]], 0.0))


def _freedom(middles: Floats, times: Iterable[float], fps: float, beside: float = 0.0) -> Floats:
    """Return the freedom of steps to slow down [N], from the times of their middles [N].

    It is 0 within `beside` seconds of any of the `times`, and rises to 1 over the next SLOWDOWN_FROM_END_S seconds.
    """
    since = np.full(len(middles), np.inf)
    for time in times:
        since = np.minimum(since, np.abs(middles - time))
    return np.clip((since - 0.5 / fps - beside) / SLOWDOWN_FROM_END_S, 0.0, 1.0)


def _falling(skeleton: Skeleton, posed: Posed, fps: float) -> Bools:
    """Return whether the centre of mass is in free fall in each frame [N]."""
    ends, out = np.zeros(len(posed.places), dtype=np.bool_), np.zeros(len(posed.places), dtype=np.bool_)
    ends[[0, -1]] = True
    for start, stop in find_falls(skeleton, posed, ends, fps)[1]:
        out[start:stop] = True
    return out
