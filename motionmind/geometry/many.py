"""Many rotations at once, compiled: the arithmetic of `rotations`, to the bit.

Sines and their like are numpy's, there as here. Arrays have an item a row; rows that are fewer than those of the result
begin again.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.jit import jit


@jit
def multiply(a: Floats, b: Floats, of_a: float, of_b: float, out: Floats) -> None:
    """Write the products [N, 4] of `a` [A, 4] and `b` [B, 4], whose vector parts are of these signs: -1 inverts."""
    i, j = 0, 0
    for n in range(len(out)):
        ax, ay, az, aw = of_a * a[i, 0], of_a * a[i, 1], of_a * a[i, 2], a[i, 3]
        bx, by, bz, bw = of_b * b[j, 0], of_b * b[j, 1], of_b * b[j, 2], b[j, 3]
        out[n, 0] = aw * bx + ax * bw + ay * bz - az * by
        out[n, 1] = aw * by - ax * bz + ay * bw + az * bx
        out[n, 2] = aw * bz + ax * by - ay * bx + az * bw
        out[n, 3] = aw * bw - ax * bx - ay * by - az * bz
        i = i + 1 if i + 1 < len(a) else 0
        j = j + 1 if j + 1 < len(b) else 0


@jit
def turn(q: Floats, v: Floats, out: Floats) -> None:
    """Write the vectors `v` [V, 3] turned by `q` [Q, 4]: [N, 3]."""
    i, j = 0, 0
    for n in range(len(out)):
        x, y, z, w = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
        vx, vy, vz = v[j, 0], v[j, 1], v[j, 2]
        tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
        out[n, 0] = vx + w * tx + (y * tz - z * ty)
        out[n, 1] = vy + w * ty + (z * tx - x * tz)
        out[n, 2] = vz + w * tz + (x * ty - y * tx)
        i = i + 1 if i + 1 < len(q) else 0
        j = j + 1 if j + 1 < len(v) else 0


@jit
def measure(v: Floats, out: Floats) -> None:
    """Write the lengths [N] of vectors [N, n]."""
    for n in range(len(v)):
        squares = v[n, 0] * v[n, 0]
        for k in range(1, v.shape[1]):
            squares += v[n, k] * v[n, k]
        out[n] = np.sqrt(squares)


@jit
def divide(v: Floats, lengths: Floats, least: float) -> bool:
    """Divide vectors [N, n] by their lengths [N], in place; return False if one is not longer than `least`."""
    for n in range(len(v)):
        if not lengths[n] > least:
            return False
        for k in range(v.shape[1]):
            v[n, k] = v[n, k] / lengths[n]
    return True


@jit
def sides(q: Floats, sines: Floats, cosines: Floats) -> None:
    """Write the sine and the cosine [N] of half the angle of each rotation [N, 4], both at least 0."""
    for n in range(len(q)):
        sines[n] = np.sqrt(q[n, 0] * q[n, 0] + q[n, 1] * q[n, 1] + q[n, 2] * q[n, 2])
        cosines[n] = abs(q[n, 3])


@jit
def vectors(q: Floats, sines: Floats, thetas: Floats, out: Floats) -> None:
    """Write the rotation vectors [N, 3] of `q` [N, 4], of these sines of half their angles, and of these angles [N]."""
    for n in range(len(q)):
        scale = thetas[n] / sines[n] if sines[n] > 1e-8 else 2.0
        if q[n, 3] < 0.0:
            scale = -scale
        for k in range(3):
            out[n, k] = q[n, k] * scale


@jit
def quaternions(v: Floats, shares: Floats, cosines: Floats, out: Floats) -> None:
    """Write the rotations [N, 4] of rotation vectors [N, 3].

    Args:
        v: the vectors.
        shares: sine over half the angle of each [N].
        cosines: of half the angle of each [N].
        out: the rotations.
    """
    for n in range(len(v)):
        for k in range(3):
            out[n, k] = v[n, k] * 0.5 * shares[n]
        out[n, 3] = cosines[n]


@jit
def turns(sines: Floats, cosines: Floats, axes: Floats, out: Floats) -> None:
    """Write the products [N, 4] of turns about axes [k, 3], of these sines and cosines of half their angles [N, k]."""
    for n in range(len(out)):
        s, aw = sines[n, 0], cosines[n, 0]
        ax, ay, az = axes[0, 0] * s, axes[0, 1] * s, axes[0, 2] * s
        for k in range(1, len(axes)):
            s, bw = sines[n, k], cosines[n, k]
            bx, by, bz = axes[k, 0] * s, axes[k, 1] * s, axes[k, 2] * s
            x = aw * bx + ax * bw + ay * bz - az * by
            y = aw * by - ax * bz + ay * bw + az * bx
            z = aw * bz + ax * by - ay * bx + az * bw
            aw = aw * bw - ax * bx - ay * by - az * bz
            ax, ay, az = x, y, z
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = ax, ay, az, aw


@jit
def matrices(q: Floats, out: Floats) -> None:
    """Write the rotation matrices [N, 3, 3] of `q` [N, 4]."""
    axes = np.eye(3)
    for n in range(len(q)):
        x, y, z, w = q[n, 0], q[n, 1], q[n, 2], q[n, 3]
        for k in range(3):
            vx, vy, vz = axes[k, 0], axes[k, 1], axes[k, 2]
            tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
            out[n, 0, k] = vx + w * tx + (y * tz - z * ty)
            out[n, 1, k] = vy + w * ty + (z * tx - x * tz)
            out[n, 2, k] = vz + w * tz + (x * ty - y * tx)
