"""Smoothing: running means and maxima of values over time, and smooth steps."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import numpy as np

from motionmind._typing import Bools, Floats

_Values = TypeVar("_Values", Bools, Floats)


def smoothed(values: Floats, seconds: float, fps: float) -> Floats:
    """Return the weighted mean around each value [N], within `seconds`; the first and the last value stay."""
    width = min(max(round(seconds * fps), 1), len(values) - 1)
    # Point reflection at both ends keeps them in place.
    before, after = 2.0 * values[0] - values[width:0:-1], 2.0 * values[-1] - values[-2 : -width - 2 : -1]
    around = np.concatenate([before, values, after])
    return np.asarray(np.convolve(around, bell(width), "valid"))


@lru_cache(maxsize=64)
def bell(width: int) -> Floats:
    """Return the weights of a Hann window [2 width + 1], which add up to 1."""
    weights = np.hanning(2 * width + 3)[1:-1]
    out: Floats = weights / weights.sum()
    out.setflags(write=False)
    return out


def smoothstep(share: Floats) -> Floats:
    """Return the cubic step 3 s^2 - 2 s^3 of a share s, clipped to 0 and 1."""
    share = np.clip(share, 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def sliding_max(values: _Values, reach: int) -> _Values:
    """Return the maximum within `reach` of each value [N], with the end values repeated."""
    padded = np.pad(values, reach, mode="edge")
    greatest: _Values = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    return greatest
