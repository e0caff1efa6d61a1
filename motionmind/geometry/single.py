"""Single vectors and rotations as tuples, compiled, for calls from compiled code: the arithmetic of `rotations`."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.jit import jit

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]


@jit
def vector(v: Floats) -> Vector:
    """Return a vector [3] as a tuple."""
    return v[0], v[1], v[2]


@jit
def rotation(q: Floats) -> Rotation:
    """Return a rotation [4] as a tuple."""
    return q[0], q[1], q[2], q[3]


@jit
def minus(a: Vector, b: Vector) -> Vector:
    """Return the difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@jit
def plus(a: Vector, b: Vector, times: float) -> Vector:
    """Return a vector plus so many times another."""
    return a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]


@jit
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def length(a: Vector) -> float:
    """Return the length of a vector."""
    return float(np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]))


@jit
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@jit
def unit(a: Vector) -> Vector:
    """Return a vector of length 1 in the direction of another."""
    size = length(a)
    return a[0] / size, a[1] / size, a[2] / size


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
def inverse(q: Rotation) -> Rotation:
    """Return the inverse of a rotation."""
    return -q[0], -q[1], -q[2], q[3]


@jit
def turned(q: Rotation, v: Vector) -> Vector:
    """Return a vector turned by a rotation."""
    u = q[0], q[1], q[2]
    t = cross(u, v)
    t = 2.0 * t[0], 2.0 * t[1], 2.0 * t[2]
    w = cross(u, t)
    return v[0] + q[3] * t[0] + w[0], v[1] + q[3] * t[1] + w[1], v[2] + q[3] * t[2] + w[2]


@jit
def about(axis: Vector, angle: float) -> Rotation:
    """Return the rotation by an angle, radians, about a unit vector."""
    sine = np.sin(0.5 * angle)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, np.cos(0.5 * angle)


@jit
def between(a: Vector, b: Vector) -> Rotation:
    """Return the smallest rotation from the direction `a` to the direction `b` (`rotations.between`)."""
    a, b = unit(a), unit(b)
    cosine = dot(a, b)
    if cosine < -1.0 + 1e-12:  # about an axis at right angles to both
        x, y, z = abs(a[0]), abs(a[1]), abs(a[2])
        axis = cross(a, (1.0, 0.0, 0.0) if x <= y and x <= z else (0.0, 1.0, 0.0) if y <= z else (0.0, 0.0, 1.0))
        w = 0.0
    else:
        axis, w = cross(a, b), 1.0 + cosine
    size = np.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2] + w * w)
    return axis[0] / size, axis[1] / size, axis[2] / size, w / size
