"""Distances between postures, compiled for calls from compiled code."""

from __future__ import annotations

from motionmind._typing import Floats, Singles
from motionmind.jit import jit


@jit
def squared_distance(a: Floats | Singles, b: Floats | Singles) -> float:
    """Return the sum over joints of 4 sin^2(angle / 2) between rotations `a` and `b` [m, 4].

    For small angles this is the sum of their squares, radians squared.
    """
    total = 0.0
    for j in range(len(a)):
        total += squared_turn(a[j], b[j])
    return total


@jit
def squared_turn(a: Floats | Singles, b: Floats | Singles) -> float:
    """Return 4 sin^2(angle / 2) between two rotations [4]: for a small angle its square, radians squared."""
    cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    return float(4.0 * max(1.0 - cosine * cosine, 0.0))
