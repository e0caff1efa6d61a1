"""Distances between line segments, for compiled loops."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.jit import jit

POINT_M2 = 1e-12  # square of the length up to which a segment counts as a point


@jit
def nearest_points(first: Floats, second: Floats) -> tuple[float, float, float]:
    """Return the distance between two segments, and the positions of the nearest points along each, 0 to 1.

    Source: Ericson, "Real-time collision detection" (2005), section 5.1.9.

    Args:
        first: ends of a segment [2, 3].
        second: ends of the other.
    """
    along_first = along_second = across = to_first = to_second = 0.0
    for k in range(3):
        u, v, w = first[1, k] - first[0, k], second[1, k] - second[0, k], first[0, k] - second[0, k]
        along_first += u * u
        along_second += v * v
        across += u * v
        to_first += u * w
        to_second += v * w
    s = 0.0
    square = along_first * along_second - across * across
    if square > POINT_M2 * along_second:  # not parallel
        s = min(max((across * to_second - to_first * along_second) / square, 0.0), 1.0)
    t = (across * s + to_second) / along_second if along_second > POINT_M2 else 0.0
    if along_second <= POINT_M2 or t < 0.0 or t > 1.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((across * t - to_first) / along_first, 0.0), 1.0) if along_first > POINT_M2 else 0.0
    total = 0.0
    for k in range(3):
        gap = first[0, k] + s * (first[1, k] - first[0, k]) - second[0, k] - t * (second[1, k] - second[0, k])
        total += gap * gap
    return np.sqrt(total), s, t
