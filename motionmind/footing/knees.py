"""Knees that bend no faster than they can: how far a foot is from its hip, smoothly in time.

Near its full length a leg bends its knee by 28 degrees for 3 % of its length, so that a foot which moves smoothly asks
of the knee what no knee does. Its speed is limited here, and what it does beside the movement's own fine detail is
smooth. What gives way is the foot that swings, or the body above one that stands, and by millimetres the place of a
foot: that a leg which is all but straight kept it exactly would be seen in its knee.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.footing.least_squares import bending_diagonals, solve_diagonals
from motionmind.jit import either, jit

_Lengths = TypeVar("_Lengths", Floats, float)

SHIFTS = 0.008  # metres that a foot may be off so that its knee keeps the fine detail of a movement
STIRS = 2.0, 0.3  # rad/s^2 by which it may accelerate otherwise, and share of its own acceleration
AROUND = 0.4  # seconds in which a knee's acceleration is seen: longer than detail; these were chosen on cmu-05
LIFTS = 0.3  # seconds before and after a part would be too low, in which it is lifted
EASES = 0.05  # seconds over which a knee that is too fast changes its speed


@either
def bend_of(distances: _Lengths, thigh: float, shank: float) -> _Lengths:
    """Return the bends [N] of a knee, radians from straight, by how far the leg's ends are from each other [N]."""
    cosines = (distances**2 - thigh**2 - shank**2) / (2.0 * thigh * shank)
    bends: _Lengths = np.arccos(np.minimum(np.maximum(cosines, -1.0), 1.0))
    return bends


def distance_of(bends: Floats, thigh: float, shank: float) -> Floats:
    """Return how far the ends of a leg are from each other [N], by the bends of its knee [N], radians from straight."""
    return np.asarray(np.sqrt(thigh**2 + shank**2 + 2.0 * thigh * shank * np.cos(bends)))


def slow_down(bends: Floats, stands: Bools, fixed: Bools, fastest: float, fps: float) -> Floats:
    """Return bends [N], radians, that change by at most `fastest` radians a second, near the given ones.

    What is fixed is kept, and what stands changes least: it goes midway between the nearest curve above it and the
    nearest below that are slow enough. A leg that swings bends more rather than less, so that its foot stays lifted.

    Args:
        bends: of a knee [N], radians.
        stands: where its foot stands [N].
        fixed: frames in which it must not change [N]; they are slow enough.
        fastest: radians a second.
        fps: frames a second.
    """
    most = fastest / fps
    if np.abs(np.diff(bends)).max(initial=0.0) <= most:
        return bends
    planted, every = stands | fixed, np.ones(len(bends), dtype=np.bool_)
    middle = 0.5 * (_below(bends, planted, most) + _above(bends, planted, most))
    out = np.where(planted & ~fixed, _towards(middle, bends, fixed, most), bends)
    out = np.where(planted, out, _towards(_above(out, every, most), out, planted, most))
    # Valleys are smoothed, peaks stay: a foot that comes nearer to the floor than it was to would be in it.
    return np.where(fixed, bends, np.maximum(smoothed(out, EASES, fps), out))


def keep_detail(bends: Floats, own: Floats, fixed: Bools, thigh: float, shank: float, fps: float) -> Floats:
    """Return bends [N] of a knee, radians, near the given ones, with the fine detail of its own [N].

    The departure d from its own minimises sum_t (l (d - w) / SHIFTS)^2 + ((d'' - mean w'') / a)^2, with w the wanted
    one, the mean of its acceleration taken AROUND, l how far a leg's end goes for its knee's bend, metres a radian, and
    a what the acceleration may differ by: STIRS.

    Args:
        bends: wanted [N], radians.
        own: those that the movement has [N].
        fixed: frames in which bends must not change [N].
        thigh: length of the bone above, metres.
        shank: length of the bone below.
        fps: frames a second.
    """
    widest = np.clip(np.maximum(bends, own), 0.0, 0.5 * np.pi)
    lever = thigh * shank * np.sin(widest) / distance_of(bends, thigh, shank)
    quick = fps**2 * np.sqrt(_around(np.diff(own, 2) ** 2, fps).clip(0.0))
    weights = (fps**2 / (STIRS[0] + STIRS[1] * quick)) ** 2
    wanted = bends - own
    turns = weights * _around(np.diff(wanted, 2), fps)
    diagonals = bending_diagonals(weights)
    # A leg that is straight has no lever: how it bends is then told by the frames around.
    firm = np.where(fixed, 1e12, (lever / SHIFTS) ** 2 + 1e-3)
    diagonals[0] += firm
    right = firm * wanted
    for first, share in enumerate((1.0, -2.0, 1.0)):
        right[first : first + len(turns)] += share * turns
    departure = solve_diagonals(diagonals, right)
    return np.where(fixed, bends, np.clip(own + departure, 0.0, np.pi))


def _around(values: Floats, fps: float) -> Floats:
    """Return means [N] of values around each, within AROUND."""
    return smoothed(values, AROUND, fps) if len(values) > 1 else values


def smoothed(values: Floats, seconds: float, fps: float) -> Floats:
    """Return means [N] of values around each, within so many seconds; the first and the last value stay."""
    width = min(max(round(seconds * fps), 1), len(values) - 1)
    # Mirrored through its ends, so that these stay.
    before, after = 2.0 * values[0] - values[width:0:-1], 2.0 * values[-1] - values[-2 : -width - 2 : -1]
    around = np.concatenate([before, values, after])
    return np.asarray(np.convolve(around, bell(width), "valid"))


@lru_cache(maxsize=64)
def bell(width: int) -> Floats:
    """Return smooth weights [2 width + 1], greatest in the middle, that add up to 1."""
    weights = np.hanning(2 * width + 3)[1:-1]
    out: Floats = weights / weights.sum()
    out.setflags(write=False)
    return out


def cover(need: Floats, fps: float) -> Floats:
    """Return a smooth curve [N] that is nowhere less than `need` [N], and 0 more than LIFTS seconds from any."""
    if not need.any():
        return need
    width = max(1, round(0.5 * LIFTS * fps))
    # The mean over a window of each frame's greatest need within a window: none of those is less than the need here.
    return np.convolve(greatest_around(need, width, width), bell(width), "valid")


@jit
def greatest_around(values: Floats, reach: int, beyond: int) -> Floats:
    """Return the greatest of the values [N] within so many frames of each, and of so many frames beyond the ends:
    [N + 2 beyond]. Beyond them values are as at the ends."""
    last = len(values) - 1
    out = np.empty(len(values) + 2 * beyond)
    for t in range(len(out)):
        first, stop = min(max(t - beyond - reach, 0), last), min(max(t - beyond + reach, 0), last) + 1
        out[t] = values[first]
        for k in range(first + 1, stop):
            out[t] = max(out[t], values[k])
    return out


def _towards(wanted: Floats, values: Floats, where: Bools, most: float) -> Floats:
    """Return a curve [N] near a wanted one that changes by at most `most` a frame from the values [N] `where`."""
    lowest, highest = _above(values, where, most), _below(values, where, most)
    return np.asarray(np.clip(wanted, np.minimum(lowest, highest), np.maximum(lowest, highest)))


@jit
def _below(values: Floats, where: Bools, most: float) -> Floats:
    """Return the highest curve [N] that changes by at most `most` a frame and is not above the values [N] `where`."""
    out, last = np.empty(len(values)), len(values) - 1
    least = np.inf
    for t in range(last + 1):
        least = min(least, values[t] - most * t if where[t] else np.inf)
        out[t] = least + most * t
    least = np.inf
    for t in range(last, -1, -1):
        least = min(least, values[t] + most * t if where[t] else np.inf)
        out[t] = min(out[t], least - most * t)
    return out


def _above(values: Floats, where: Bools, most: float) -> Floats:
    """Return the lowest curve [N] that changes by at most `most` a frame and is not below the values [N] `where`."""
    return -_below(-values, where, most)
