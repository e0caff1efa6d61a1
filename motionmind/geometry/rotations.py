"""Rotations as arrays of unit quaternions [..., 4] in the order x, y, z, w.

`q` and `-q` are the same rotation. `mul(a, b)` turns by `b` first, then by `a`, as matrices do, so a joint's
global rotation is `mul(parent_global, local)`. Angles are in radians; leading dimensions broadcast. Formulas come from
Shoemake, "Animating rotation with quaternion curves", SIGGRAPH (1985), unless a function names another source. Compiled
loops call the functions of the same names in `compiled`.

>>> quarter = from_axis_angle([0.0, 1.0, 0.0], np.pi / 2)  # about the vertical, from +Z to +X
>>> mul_vec(quarter, np.array([0.0, 0.0, 1.0])).round(6).tolist()
[1.0, 0.0, 0.0]
"""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from motionmind._typing import Floats

IDENTITY: Floats = np.array([0.0, 0.0, 0.0, 1.0])
IDENTITY.setflags(write=False)


def mul(a: Floats, b: Floats) -> Floats:
    """Return the product [..., 4]: the rotation `b` followed by the rotation `a`."""
    ax, ay, az, aw = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bx, by, bz, bw = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    x = aw * bx + ax * bw + ay * bz - az * by
    out = np.empty((*x.shape, 4))
    out[..., 0] = x
    out[..., 1] = aw * by - ax * bz + ay * bw + az * bx
    out[..., 2] = aw * bz + ax * by - ay * bx + az * bw
    out[..., 3] = aw * bw - ax * bx - ay * by - az * bz
    return out


def inv(q: Floats) -> Floats:
    """Return the inverse rotation [..., 4] of a unit quaternion [..., 4]."""
    return np.asarray(q * np.array([-1.0, -1.0, -1.0, 1.0]))


def inv_mul(a: Floats, b: Floats) -> Floats:
    """Return `inv(a) * b` [..., 4]: the rotation from `a` to `b`, in the frame of `a`."""
    return mul(inv(a), b)


def mul_inv(a: Floats, b: Floats) -> Floats:
    """Return `a * inv(b)` [..., 4]: the rotation from `b` to `a`, in the outer frame."""
    return mul(a, inv(b))


def mul_vec(q: Floats, v: Floats) -> Floats:
    """Return the vectors `v` [..., 3] turned by `q` [..., 4]."""
    # v + w t + u x t with t = 2 (u x v) and u the vector part: cheaper than two products of quaternions.
    u, w = q[..., :3], q[..., 3:]
    t = 2.0 * cross(u, v)
    return np.asarray(v + w * t + cross(u, t))


def norm(v: Floats) -> Floats:
    """Return the lengths [...] of vectors [..., n]; np.linalg.norm takes several times as long on short vectors."""
    squares = v[..., 0] ** 2
    for i in range(1, v.shape[-1]):
        squares = squares + v[..., i] ** 2
    return np.asarray(np.sqrt(squares))


def cross(a: Floats, b: Floats) -> Floats:
    """Return the vector product [..., 3]; np.cross takes several times as long on small arrays."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    x = ay * bz - az * by
    out = np.empty((*x.shape, 3))
    out[..., 0] = x
    out[..., 1] = az * bx - ax * bz
    out[..., 2] = ax * by - ay * bx
    return out


def normalise(q: ArrayLike) -> Floats:
    """Return unit quaternions [..., 4] of the same direction.

    Raises:
        ValueError: a quaternion is zero.
    """
    q = np.asarray(q, dtype=np.float64)
    length = norm(q)
    if not np.all(length > 1e-12):
        raise ValueError("a quaternion of length zero is no rotation")
    return np.asarray(q / length[..., None])


def canonical(q: Floats) -> Floats:
    """Return `q` or `-q` [..., 4], whichever has its last nonzero coefficient of (x, y, z, w) positive."""
    sign = np.sign(q[..., 3])
    for i in (2, 1, 0):
        sign = np.where(sign == 0.0, np.sign(q[..., i]), sign)
    return np.asarray(q * np.where(sign < 0.0, -1.0, 1.0)[..., None], dtype=np.float64)


def continuous(q: Floats) -> Floats:
    """Return the same rotations [T, ..., 4], each quaternion in the hemisphere of the one before."""
    flips = np.sum(q[1:] * q[:-1], axis=-1, keepdims=True) < 0.0
    return np.concatenate([q[:1], q[1:] * np.cumprod(np.where(flips, -1.0, 1.0), axis=0)])


def angle(a: Floats, b: Floats) -> Floats:
    """Return the angle [...] in [0, pi], radians, between rotations [..., 4]; accurate near 0 and near pi.

    >>> round(float(angle(about_vertical(0.2), about_vertical(0.5))), 6)
    0.3
    """
    # atan2 of the relative rotation's vector and scalar parts; acos of the dot product would lose half the digits.
    q = inv_mul(a, b)
    return np.asarray(2.0 * np.arctan2(norm(q[..., :3]), np.abs(q[..., 3])))


def exp(v: Floats) -> Floats:
    """Return the quaternion [..., 4] of the rotation vector `v` [..., 3]: axis times angle, radians."""
    theta = norm(v)
    # sin(theta/2)/theta, by numpy's sin(pi x)/(pi x) with x = theta / 2 pi: exact at 0.
    share, cosine = np.sinc(theta / (2.0 * np.pi)), np.cos(0.5 * theta)
    return np.concatenate([v * 0.5 * share[..., None], cosine[..., None]], axis=-1)


def log(q: Floats) -> Floats:
    """Return the rotation vector [..., 3] of `q` [..., 4], radians, of length at most pi: the inverse of `exp`."""
    s = norm(q[..., :3])
    theta = 2.0 * np.arctan2(s, np.abs(q[..., 3]))
    # theta / s tends to 2 as s does to 0: theta = 2 asin(s) = 2 s + s^3/3 + ...
    scale = np.where(s > 1e-8, theta / np.where(s > 1e-8, s, 1.0), 2.0)
    return np.asarray(q[..., :3] * np.where(q[..., 3] < 0.0, -scale, scale)[..., None])


def from_axis_angle(axis: ArrayLike, theta: ArrayLike) -> Floats:
    """Return the rotation [..., 4] by `theta` [...] radians about the unit vectors `axis` [..., 3]."""
    half = 0.5 * np.asarray(theta, dtype=np.float64)
    vector = np.asarray(axis, dtype=np.float64) * np.sin(half)[..., None]
    out = np.empty((*vector.shape[:-1], 4))
    out[..., :3], out[..., 3] = vector, np.cos(half)
    return out


def from_euler(order: str, angles: Floats) -> Floats:
    """Return the rotation [..., 4] of intrinsic turns about the axes in `order`.

    "ZXY" turns about z, then about the new x, then about the newest y: the product Rz Rx Ry, as BVH's channels do.

    Args:
        order: any number of letters x, y and z, in either case.
        angles: angles of the turns [..., len(order)], radians.

    >>> from_euler("ZY", np.array([0.0, np.pi])).round(6).tolist()
    [0.0, 1.0, 0.0, 0.0]
    """
    axes = np.array([np.eye(3)["xyz".index(letter)] for letter in order.lower()])
    turns = [from_axis_angle(axis, angles[..., i]) for i, axis in enumerate(axes)]
    return reduce(mul, turns) if turns else np.tile(IDENTITY, (*angles.shape[:-1], 1))


def to_euler(order: str, q: Floats) -> Floats:
    """Return angles [..., 3], radians, with `from_euler(order, angles)` the same rotations as `q` [..., 4].

    At gimbal lock (middle angle within 1e-9 of a right angle) the last angle is set to 0. Source: Shuster, "A survey
    of attitude representations", J. Astronaut. Sci. 41:4 (1993), the asymmetric sequences.

    Raises:
        ValueError: `order` does not name x, y and z once each.
    """
    i, j, k = ("xyz".index(letter) for letter in order.lower())
    if len({i, j, k}) != 3:
        raise ValueError(f"rotation order must name x, y and z once each, not {order!r}")
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    m = to_matrix(q)
    cosine = np.hypot(m[..., i, i], m[..., i, j])
    middle = np.arctan2(sign * m[..., i, k], cosine)  # arcsin would lose half the digits near a right angle
    locked = cosine < 1e-9
    first = np.where(
        locked,
        np.arctan2(sign * m[..., k, j], m[..., j, j]),
        np.arctan2(-sign * m[..., j, k], m[..., k, k]),
    )
    # Undo the first turn before taking the last, which then compensates for an ill-determined first near the lock.
    undone = np.cos(first)[..., None] * m[..., j, :] + sign * np.sin(first)[..., None] * m[..., k, :]
    last = np.where(locked, 0.0, np.arctan2(sign * undone[..., i], undone[..., j]))
    return np.stack([first, middle, last], axis=-1)


def to_matrix(q: Floats) -> Floats:
    """Return rotation matrices [..., 3, 3] of `q` [..., 4]; their columns are the images of x, y and z."""
    return np.stack([mul_vec(q, e) for e in np.eye(3)], axis=-1)


def from_matrix(m: Floats) -> Floats:
    """Return the quaternions [..., 4] of rotation matrices [..., 3, 3].

    Of four equivalent formulas, use the one with the largest divisor. Source: Shepperd, "Quaternion from rotation
    matrix", J. Guidance and Control 1:223 (1978).
    """
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    # Four times the products q_i q_j, as a symmetric matrix [..., 4, 4]; its largest row is along q.
    k = np.empty((*m.shape[:-2], 4, 4))
    k[..., 0, 0], k[..., 1, 1], k[..., 2, 2] = 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz
    k[..., 3, 3] = 1 + xx + yy + zz
    for a, b in ((0, 1), (0, 2), (1, 2)):
        k[..., a, b] = k[..., b, a] = m[..., a, b] + m[..., b, a]
    for a, b, c in ((0, 2, 1), (1, 0, 2), (2, 1, 0)):
        k[..., a, 3] = k[..., 3, a] = m[..., b, c] - m[..., c, b]
    best = np.argmax(np.diagonal(k, axis1=-2, axis2=-1), axis=-1)
    return normalise(np.take_along_axis(k, best[..., None, None], axis=-2)[..., 0, :])


def between(a: Floats, b: Floats) -> Floats:
    """Return the smallest rotation [..., 4] from the direction `a` [..., 3] to the direction `b` [..., 3].

    For opposite directions, the axis is one at right angles to `a`.
    """
    a, b = (v / norm(v)[..., None] for v in (a, b))
    cosine = np.sum(a * b, axis=-1, keepdims=True)
    least = np.eye(3)[np.argmin(np.abs(a), axis=-1)]
    opposite = np.concatenate([cross(a, least), np.zeros_like(cosine)], axis=-1)
    q = np.concatenate([cross(a, b), 1.0 + cosine], axis=-1)
    return normalise(np.where(cosine < -1.0 + 1e-12, opposite, q))


def slerp(a: Floats, b: Floats, t: ArrayLike) -> Floats:
    """Return the rotation [..., 4] at a share `t` [...] of the shortest arc from `a` to `b` [..., 4].

    >>> round(float(heading(slerp(about_vertical(0.2), about_vertical(0.6), 0.25))), 6)
    0.3
    """
    return mul(a, exp(np.asarray(t, dtype=np.float64)[..., None] * log(inv_mul(a, b))))


def heading(q: Floats) -> Floats:
    """Return the twist [...] of `q` [..., 4] about the vertical (y), radians.

    `q = mul(about_vertical(heading), swing)`, and the swing's axis is level. Return 0 where `q` turns y upside down,
    which leaves the twist undefined. Source: Dobrowolski, "Swing-twist decomposition in Clifford algebra",
    arXiv:1506.05481 (2015).
    """
    # The twist is the normalised projection of q on (y, w), whether it is applied before or after the swing.
    y, w = q[..., 1], q[..., 3]
    turn = 2.0 * np.arctan2(y, w)
    turn = np.where(np.hypot(y, w) < 1e-9, 0.0, turn)
    return np.asarray(turn - 2.0 * np.pi * np.round(turn / (2.0 * np.pi)))


def about_vertical(theta: ArrayLike) -> Floats:
    """Return the rotation [..., 4] by `theta` [...] radians about the vertical (y)."""
    return from_axis_angle([0.0, 1.0, 0.0], theta)


def mirror(q: Floats, axis: int = 0) -> Floats:
    """Mirror `q` [..., 4] along an axis: left and right (x, axis 0) by default."""
    sign = np.array([-1.0, -1.0, -1.0, 1.0])
    sign[axis] = 1.0
    return np.asarray(q * sign)
