"""Rotations for compiled loops: the functions of `rotations` on one rotation (x, y, z, w) or vector (x, y, z).

Arguments are tuples or rows of arrays; results are tuples.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.jit import jit

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]


@jit
def mul(a: Rotation | Floats, b: Rotation | Floats) -> Rotation:
    """Return the product: the rotation `b` followed by the rotation `a`."""
    return (
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    )


@jit
def inv_mul(a: Rotation | Floats, b: Rotation | Floats) -> Rotation:
    """Return `inv(a) * b`: the rotation from `a` to `b`, in the frame of `a`."""
    return mul((-a[0], -a[1], -a[2], a[3]), b)


@jit
def mul_vec(q: Rotation | Floats, v: Vector | Floats) -> Vector:
    """Return the vector `v` turned by `q`."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    tx, ty, tz = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + (y * tz - z * ty),
        v[1] + w * ty + (z * tx - x * tz),
        v[2] + w * tz + (x * ty - y * tx),
    )


@jit
def norm(v: Vector | Rotation | Floats) -> float:
    """Return the length of a vector, or of the vector part of a rotation."""
    return float(np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))


@jit
def exp(v: Vector | Floats) -> Rotation:
    """Return the rotation of a rotation vector: axis times angle, radians."""
    angle = norm(v)
    scale = np.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    return scale * v[0], scale * v[1], scale * v[2], np.cos(0.5 * angle)


@jit
def log(q: Rotation | Floats) -> Vector:
    """Return the rotation vector of `q`, radians, of length at most pi: the inverse of `exp`."""
    sine = norm(q)
    scale = 2.0 * np.arctan2(sine, abs(q[3])) / sine if sine > 1e-8 else 2.0
    if q[3] < 0.0:
        scale = -scale
    return q[0] * scale, q[1] * scale, q[2] * scale


@jit
def from_axis_angle(axis: Vector, theta: float) -> Rotation:
    """Return the rotation by `theta` radians about a unit vector."""
    sine = np.sin(0.5 * theta)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, np.cos(0.5 * theta)
