"""Products and turns of many rotations at once, compiled: the arithmetic of `rotations`, to the bit.

Arrays have an item a row; rows that are fewer than those of the result begin again.
"""

from __future__ import annotations

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
