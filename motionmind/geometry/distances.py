"""Distances between postures, compiled for calls from compiled code."""

from __future__ import annotations

from motionmind._typing import Floats
from motionmind.jit import jit


@jit
def squared_distance(a: Floats, b: Floats) -> float:
    """Return the sum over joints of 4 sin^2(angle / 2) between rotations `a` and `b` [m, 4].

    For small angles this is the sum of their squares, radians squared.
    """
    total = 0.0
    for j in range(len(a)):
        cosine = a[j, 0] * b[j, 0] + a[j, 1] * b[j, 1] + a[j, 2] * b[j, 2] + a[j, 3] * b[j, 3]
        total += 4.0 * max(1.0 - cosine * cosine, 0.0)
    return total
