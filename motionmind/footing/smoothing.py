"""Smoothing: running means and maxima of values over time."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import numpy as np

from motionmind._typing import Bools, Floats

_Values = TypeVar("_Values", Bools, Floats)


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


def sliding_max(values: _Values, reach: int) -> _Values:
    """Return the greatest of the values [N] within so many of each; beyond the ends they are as there."""
    padded = np.pad(values, reach, mode="edge")
    greatest: _Values = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    return greatest
