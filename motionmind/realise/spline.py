"""Natural cubic splines, for numbers and for rotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot

Floats = NDArray[np.float64]


def natural_spline(times: Floats, values: Floats, at: Floats) -> Floats:
    """The natural cubic spline through `values` [K, ...] at `times` [K], evaluated at `at` [N]: [N, ...].

    Twice continuously differentiable, its second derivative 0 at both ends. The second derivatives M at the knots
    solve the tridiagonal system h[i-1] M[i-1] + 2 (h[i-1] + h[i]) M[i] + h[i] M[i+1] = 6 (d[i] - d[i-1]), with steps h
    and slopes d; source: de Boor, "A Practical Guide to Splines" (1978), chapter IV. Two knots give a straight line.
    """
    h = np.diff(times)
    if len(h) == 0:
        return np.broadcast_to(values[0], (len(at), *values.shape[1:])).copy()
    column = (-1,) + (1,) * (values.ndim - 1)
    slope = np.diff(values, axis=0) / h.reshape(column)
    bend = np.zeros_like(values, dtype=np.float64)
    if len(h) > 1:
        system = np.diag(2.0 * (h[:-1] + h[1:])) + np.diag(h[1:-1], 1) + np.diag(h[1:-1], -1)
        right = 6.0 * np.diff(slope, axis=0)
        bend[1:-1] = np.linalg.solve(system, right.reshape(len(right), -1)).reshape(right.shape)
    i = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(h) - 1)
    after, before = (times[i + 1] - at).reshape(column), (at - times[i]).reshape(column)
    step = h[i].reshape(column)
    # On each piece: the straight line, plus what both bends add, which is 0 at its knots.
    line = (values[i] * after + values[i + 1] * before) / step
    bent = bend[i] * (after**3 / step - step * after) + bend[i + 1] * (before**3 / step - step * before)
    return np.asarray(line + bent / 6.0)


def rotation_spline(times: Floats, keys: Floats, at: Floats) -> Floats:
    """A twice continuously differentiable curve of rotations through `keys` [K, ..., 4] at `times` [K]: [N, ..., 4].

    A natural cubic spline of the rotation vectors that lead to the keys from a middle one (the chart of SO(3) centred
    there), unrolled so that neighbouring keys lie within half a turn of each other. As the exponential is smooth, so is
    the curve; it is exact at the keys, and for keys that turn about one axis it is the spline of their angle.
    """
    if len(keys) < 2:
        return np.broadcast_to(keys[0], (len(at), *keys.shape[1:])).copy()
    centre = keys[len(keys) // 2]
    vectors = _unroll(rot.log(rot.inv_mul(centre[None], keys)), len(keys) // 2)
    return rot.mul(centre[None], rot.exp(natural_spline(times, vectors, at)))


def _unroll(vectors: Floats, middle: int) -> Floats:
    """Rotation vectors [K, ..., 3], whole turns added so that each is nearest to its neighbour towards `middle`."""
    out = vectors.copy()
    for k in [*range(middle - 1, -1, -1), *range(middle + 1, len(out))]:
        toward = out[k + 1] if k < middle else out[k - 1]
        angle = np.linalg.norm(out[k], axis=-1, keepdims=True)
        axis = out[k] / np.where(angle > 1e-9, angle, 1.0)
        along = np.sum(axis * toward, axis=-1, keepdims=True)
        turns = np.where(angle > 1e-9, np.round((along - angle) / (2.0 * np.pi)), 0.0)
        out[k] += 2.0 * np.pi * turns * axis
    return out
