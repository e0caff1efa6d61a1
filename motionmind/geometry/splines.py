"""Natural cubic splines through numbers and through rotations.

>>> natural_spline(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0]), np.array([0.5, 1.0])).tolist()
[0.6875, 1.0]
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.geometry import rotations as rot

_LONG = 64  # knots; a longer curve is computed in pieces, each with a margin of knots on either side
_PIECE, _MARGIN = 32, 14  # a knot's influence falls to about a quarter with each further knot: 1e-8 of it is lost
_MANY = 512  # values from which compiled code does the same arithmetic


def natural_spline(times: Floats, values: Floats, at: Floats) -> Floats:
    """Evaluate the natural cubic spline through values.

    It is twice continuously differentiable, its second derivative 0 at both ends. Two knots give a straight line, one a
    constant.

    Args:
        times: of the knots, increasing [K].
        values: at the knots [K, ...].
        at: times to evaluate at [N].

    Returns:
        Values [N, ...].
    """
    if len(times) == 1:
        return np.broadcast_to(values[0], (len(at), *values.shape[1:])).copy()
    if len(times) > _LONG:
        return _by_pieces(natural_spline, times, values, at)
    piece = _pieces(times, at)
    return _cubic(times, piece, at, values, _bends(times, values), piece)


def rotation_spline(times: Floats, keys: Floats, at: Floats) -> Floats:
    """Evaluate a twice continuously differentiable curve of rotations through keys.

    Around each key, take the natural spline of the rotation vectors from it to all keys (the chart of SO(3) centred
    there), unrolled so that neighbouring keys lie within half a turn of each other. Between two keys the curve blends
    from the one's spline to the other's, by a weight whose first two derivatives are 0 at both. It is exact at the
    keys; for keys that turn about one axis all charts agree, and it is the spline of their angle. A single chart would
    not do: it ends a whole turn from its centre, where vectors in all directions are the same rotation.

    Args:
        times: of the keys, increasing [K].
        keys: unit quaternions [K, ..., 4].
        at: times to evaluate at [N].

    Returns:
        Unit quaternions [N, ..., 4].
    """
    if len(times) == 1:
        return np.broadcast_to(keys[0], (len(at), *keys.shape[1:])).copy()
    knots = np.minimum(np.searchsorted(times, at), len(times) - 1)
    if np.array_equal(times[knots], at):
        return keys[knots]
    if len(times) > _LONG:
        return _by_pieces(rotation_spline, times, keys, at)
    from motionmind.geometry.charts import vectors_around  # numba is slow to import

    piece = _pieces(times, at)
    centres = np.union1d(piece, piece + 1)
    vectors = vectors_around(np.array(keys, dtype=np.float64).reshape(len(keys), -1, 4), centres)
    # In each chart only the centre and its neighbours count: values and bends [C, 3, ..., 3].
    charts, near = np.arange(len(centres))[:, None], np.clip(centres[:, None] + [-1, 0, 1], 0, len(keys) - 1)
    shape = (3 * len(centres), *keys.shape[1:-1], 3)
    values = vectors[charts, near].reshape(shape)
    bends = (_bends(times, np.eye(len(keys)))[near] @ vectors.reshape(len(centres), len(keys), -1)).reshape(shape)

    def around(key: Ints) -> Floats:
        first = 3 * np.searchsorted(centres, key) + piece - key + 1
        return rot.mul(keys[key], rot.exp(_cubic(times, piece, at, values, bends, first)))

    s = ((at - times[piece]) / np.diff(times)[piece]).reshape(-1, *(1,) * (keys.ndim - 2))
    return rot.slerp(around(piece), around(piece + 1), s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def _by_pieces(spline: Callable[[Floats, Floats, Floats], Floats], times: Floats, knots: Floats, at: Floats) -> Floats:
    """Evaluate `spline` through many knots [K, ...] piece by piece, each from the knots near it alone: [N, ...]."""
    out = np.empty((len(at), *knots.shape[1:]))
    piece = _pieces(times, at) // _PIECE
    for number in range(piece.min(initial=0), piece.max(initial=-1) + 1):
        near = slice(max(number * _PIECE - _MARGIN, 0), (number + 1) * _PIECE + _MARGIN + 1)
        here = piece == number
        out[here] = spline(times[near], knots[near], at[here])
    return out


def _pieces(times: Floats, at: Floats) -> Ints:
    """Return the index [N] of the knot that begins the piece which each of `at` [N] lies in."""
    return np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)


def _bends(times: Floats, values: Floats) -> Floats:
    """Return the second derivatives [K, ...] of the natural spline at its knots.

    They solve the tridiagonal system h[i-1] M[i-1] + 2 (h[i-1] + h[i]) M[i] + h[i] M[i+1] = 6 (d[i] - d[i-1]), with
    steps h and slopes d; source: de Boor, "A Practical Guide to Splines" (1978), chapter IV.
    """
    h = np.diff(times)
    bends = np.zeros_like(values, dtype=np.float64)
    if len(h) > 1:
        slopes = np.diff(values, axis=0) / h.reshape(-1, *(1,) * (values.ndim - 1))
        system = np.diag(2.0 * (h[:-1] + h[1:])) + np.diag(h[1:-1], 1) + np.diag(h[1:-1], -1)
        right = 6.0 * np.diff(slopes, axis=0)
        bends[1:-1] = np.linalg.solve(system, right.reshape(len(right), -1)).reshape(right.shape)
    return bends


def _cubic(times: Floats, piece: Ints, at: Floats, values: Floats, bends: Floats, first: Ints) -> Floats:
    """Return values [N, ...] of cubic pieces.

    Args:
        times: of the knots [K].
        piece: the knot that begins each moment's piece [N].
        at: the moments [N].
        values: at the ends of pieces [R, ...].
        bends: second derivatives there [R, ...].
        first: the row of them that begins each moment's piece [N]; the next one ends it.
    """
    after, before = times[piece + 1] - at, at - times[piece]
    step = after + before
    # On each piece: the straight line, plus the contribution of both bends, which is 0 at its knots.
    weights = after, before, step, after**3 / step - step * after, before**3 / step - step * before
    if values[:1].size * len(at) >= _MANY:
        from motionmind.geometry import many  # numba is slow to import

        out = np.empty((len(at), *values.shape[1:]))
        ends, bent = (np.array(own, dtype=np.float64).reshape(len(own), -1) for own in (values, bends))
        many.cubics(ends, bent, first, np.stack(weights, axis=-1), out.reshape(len(at), -1))
        return out
    a, b, c, d, e = (weight.reshape(-1, *(1,) * (values.ndim - 1)) for weight in weights)
    line = (values[first] * a + values[first + 1] * b) / c
    return np.asarray(line + (bends[first] * d + bends[first + 1] * e) / 6.0)
