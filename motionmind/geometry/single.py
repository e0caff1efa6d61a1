"""Single vectors and rotations as tuples, compiled, for calls from compiled code: the arithmetic of `rotations`."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.jit import jit

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]


@jit
def rotation(q: Floats) -> Rotation:
    """Return a rotation [4] as a tuple."""
    return q[0], q[1], q[2], q[3]


@jit
def length(a: Vector) -> float:
    """Return the length of a vector."""
    return float(np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]))


@jit
def product(a: Rotation, b: Rotation) -> Rotation:
    """Return the rotation `b` followed by the rotation `a`."""
    return (
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    )


@jit
def about(axis: Vector, angle: float) -> Rotation:
    """Return the rotation by an angle, radians, about a unit vector."""
    sine = np.sin(0.5 * angle)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, np.cos(0.5 * angle)
