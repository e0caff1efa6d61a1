"""Accents: moments of greatest or least speed at given times, by a clock that runs faster or slower around them.

A movement's speed is the mean angular speed of its joints, smoothed over SPEED_S. Beside each accent the clock's rate
has a symmetric and an antisymmetric bump: one makes a peak or a rest, the other brings one from nearby. Their sizes are
the smallest that put the accent on its frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Insertion, Motion
from motionmind.footing.smoothing import smoothed, smoothstep
from motionmind.geometry import rotations as rot
from motionmind.synthesis.accent_times import Accents

SPEED_S = 0.1  # on either side of a frame, over which speed is smoothed
ACCENT_S = 0.15  # on either side of an accent, in which nothing is faster, or stiller
BUMP_S = 0.4, 0.8  # half widths of the bumps that make an accent, and that bring one from nearby
MAX_LOG_RATE, MIN_LOG_RATE = 0.7, -1.6  # of a clock that makes an accent: twice as fast, a fifth as fast
MADE, BROUGHT = (
    (0.0, 0.15, 0.3, 0.5, 0.8, 1.2),
    (0.0, 0.1, -0.1, 0.2, -0.2, 0.35, -0.35, 0.5, -0.5),
)  # sizes tried, of log rates
FROM_END_S = 0.3  # from an end with a given velocity, in which the clock gets free
ON_COUNT_FRAMES = 1.0 + 1e-6  # from its count, up to which an accent is on it


def speeds_of(motion: Motion) -> Floats:
    """Return the mean angular speed of the joints in each frame of an evenly timed motion [N], smoothed, rad/s."""
    fps = (len(motion) - 1) / float(motion.times[-1] - motion.times[0])
    steps = fps * rot.angle(motion.rotations[:-1], motion.rotations[1:]).mean(axis=1)
    frames = np.concatenate([steps[:1], 0.5 * (steps[1:] + steps[:-1]), steps[-1:]])
    return smoothed(frames, SPEED_S, fps) if len(frames) > 2 else np.asarray(frames)


def frames_off(speeds: Floats, fps: float, accents: Accents) -> Floats:
    """Return how far the nearest peak, or rest, is from each accent [K], frames; infinite if there is none.

    Args:
        speeds: of the frames [N], from `speeds_of`.
        fps: frames a second.
        accents: the accents.
    """
    values, reach = speeds if accents.kind == "fast" else -speeds, max(1, round(ACCENT_S * fps))
    padded = np.pad(values, reach, constant_values=-np.inf)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    least = np.where(np.isfinite(windows), windows, np.inf).min(axis=1)
    peaks = np.flatnonzero((values >= windows.max(axis=1)) & (values > least))
    at = fps * np.array(accents.seconds)
    return np.asarray(np.abs(at[:, None] - peaks).min(axis=1, initial=np.inf))


def n_on_count(accents: Accents, motion: Motion) -> int:
    """Return how many accents a motion has within a frame of their times."""
    return int((frames_off(speeds_of(motion), motion.fps, accents) <= ON_COUNT_FRAMES).sum())


def accented_clock(
    motion: Motion, accents: Accents, fastest: Floats | None, moving: tuple[bool, bool], kept: Iterable[float]
) -> Floats | None:
    """Return the time in a movement to show in each of its frames [N], so that accents come at their times.

    Args:
        motion: the movement, evenly timed from 0.
        accents: the accents.
        fastest: greatest speeds of the joints [J], rad/s, that a faster clock keeps to; None for no bound.
        moving: whether the velocity at the first and at the last frame is given.
        kept: times between the first and the last that stay, increasing.

    Returns:
        The times; None if the accents are on their frames already, or no clock brings them nearer.
    """
    times = motion.times - motion.times[0]
    fps, speeds = (len(times) - 1) / float(times[-1]), speeds_of(motion)
    most = np.full(len(times), MAX_LOG_RATE)
    if fastest is not None:  # where the movement is as fast as the corpus, the clock runs no faster
        turned = fps * rot.angle(motion.rotations[:-1], motion.rotations[1:])
        ratio = (turned / np.maximum(fastest, 1e-9)).max(axis=1)
        frames = np.maximum(np.append(ratio, ratio[-1]), np.append(ratio[0], ratio))
        most = np.clip(-np.log(np.maximum(frames, 1e-9)), 0.0, MAX_LOG_RATE)
    free = np.ones(len(times))
    for is_moving, since in zip(moving, (times, times[-1] - times), strict=True):
        if is_moving:
            free *= smoothstep(since / FROM_END_S)
    stops = [0.0, *kept, float(times[-1])]

    def shown(sizes: Floats) -> Floats:
        return _clock(times, _bumps(times, accents.seconds, sizes, free), most, stops)

    def cost(sizes: Floats) -> tuple[int, float, float]:
        at = shown(sizes)
        rates = np.gradient(at, times)
        off = frames_off(np.interp(at, times, speeds) * rates, fps, accents)
        beyond = np.maximum(np.minimum(off, fps) - 0.5 * ON_COUNT_FRAMES, 0.0)
        return int((off > ON_COUNT_FRAMES).sum()), float(beyond.sum()), float(np.abs(sizes).sum())

    best = np.zeros((len(accents.seconds), 2))
    least = start = cost(best)
    sign = 1.0 if accents.kind == "fast" else -1.0
    for _ in range(2):
        for k in range(len(best)):
            for made in MADE:
                for brought in BROUGHT:
                    tried = best.copy()
                    tried[k] = sign * made, brought
                    if (found := cost(tried)) < least:
                        best, least = tried, found
    return shown(best) if least[:2] < start[:2] else None


def _bumps(times: Floats, accents: Sequence[float], sizes: Floats, free: Floats) -> Floats:
    """Return the logarithm of a clock's rate [N], from the sizes of the bumps at each accent [K, 2]."""
    out = np.zeros(len(times))
    for at, (made, brought) in zip(accents, sizes, strict=True):
        near = [np.clip((times - at) / width, -1.0, 1.0) for width in BUMP_S]
        out += made * 0.5 * (1.0 + np.cos(np.pi * near[0])) + brought * np.sin(np.pi * near[1])
    return free * out


def _clock(times: Floats, rates: Floats, most: Floats, stops: Sequence[float]) -> Floats:
    """Return the time to show in each frame [N]: the integral of exp(rates), scaled to keep the `stops`."""
    steps = np.exp(np.clip(rates, MIN_LOG_RATE, most))
    steps = 0.5 * (steps[1:] + steps[:-1]) * np.diff(times)
    shown = np.concatenate([[0.0], np.cumsum(steps)])
    out = np.empty_like(times)
    for begin, end in pairwise(stops):
        first, last = np.interp([begin, end], times, shown)
        here = (times >= begin - 1e-9) & (times <= end + 1e-9)
        out[here] = begin + (shown[here] - first) * (end - begin) / (last - first)
    return np.clip(out, 0.0, times[-1])


def retimed(motion: Motion, shown: Floats) -> Motion:
    """Return a movement that shows its own times [N] in its frames; its ends stay exact."""
    found = motion.at(motion.times[0] + shown)
    rotations, root = found.rotations.copy(), found.root.copy()
    rotations[[0, -1]], root[[0, -1]] = motion.rotations[[0, -1]], motion.root[[0, -1]]
    marks = tuple(
        Insertion(np.interp(one.times - motion.times[0], shown, motion.times), one.bridged, one.credits)
        for one in motion.insertions
    )
    return replace(motion, rotations=rotations, root=root, insertions=marks)
