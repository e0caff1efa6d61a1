"""Charts of the rotations, compiled: rotation vectors from one key of a curve to those near it, and curves by them.

Here the coefficients of rotations lie one row after another, [4, m], so that several are reckoned at once.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.geometry.curves import bends_of
from motionmind.jit import jit

_MARGIN = 18  # keys on either side that a chart knows: a key's influence falls to about a quarter with each further one
_NEAR = 3.1  # radians: less than half a turn


def curve_of_rotations(times: Floats, keys: Floats, at: Floats) -> Floats:
    """Return the curve through keys [K, m, 4], two or more, at some times [N]: [N, m, 4] (`splines.rotation_spline`).

    Args:
        times: of the keys, increasing [K].
        keys: unit quaternions.
        at: times to evaluate at.
    """
    pieces = np.searchsorted(times, at, side="right").clip(1, len(times) - 1) - 1  # by the key that each begins with
    rows, out = np.ascontiguousarray(keys.transpose(0, 2, 1)), np.take(keys, pieces, axis=0)
    between = np.flatnonzero(at != times[pieces])
    # In each chart only the centre and its neighbours count: values, and second derivatives.
    charts = np.zeros((2, len(keys), 3, 3, keys.shape[1]))
    centres = np.zeros(len(keys), dtype=np.bool_)
    centres[pieces[between]] = centres[pieces[between] + 1] = True
    _write_charts(times, rows, np.flatnonzero(centres), charts)
    _write_curve(times, rows, charts, at, pieces, between, out)
    return out


@jit
def _write_curve(
    times: Floats, rows: Floats, charts: Floats, at: Floats, pieces: Ints, between: Ints, out: Floats
) -> None:
    """Write the curve at those times that are between keys; arguments are variables of `curve_of_rotations`."""
    joints = rows.shape[2]
    one, other, turned = np.empty((4, joints)), np.empty((4, joints)), np.empty((4, joints))
    vectors, room = np.empty((3, joints)), np.empty((2, joints))
    for t in between:
        key = pieces[t]
        after, before = times[key + 1] - at[t], at[t] - times[key]
        step = after + before
        step = after + before
        a, b, s = after**3 / step - step * after, before**3 / step - step * before, before / step
        share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        for end, rotations in ((0, one), (1, other)):
            # The chart of the piece's first key has that in the middle, and that of its last one the last.
            v, m, first = charts[0, key + end], charts[1, key + end], 1 - end
            for k in range(3):
                for joint in range(joints):
                    line = (v[first, k, joint] * after + v[first + 1, k, joint] * before) / step
                    vectors[k, joint] = line + (m[first, k, joint] * a + m[first + 1, k, joint] * b) / 6.0
            _write_turned(rows[key + end], vectors, room, rotations)
        _write_logs(one, other, vectors, room)
        for k in range(3):
            for joint in range(joints):
                vectors[k, joint] *= share
        _write_turned(one, vectors, room, turned)
        for joint in range(joints):
            for k in range(4):
                out[t, joint, k] = turned[k, joint]


@jit
def _write_charts(times: Floats, keys: Floats, centres: Ints, out: Floats) -> None:
    """Write the natural splines of rotation vectors around some keys: values and second derivatives [2, K, 3, 3, m]
    there and at their neighbours, where there are some."""
    for centre in centres:
        first, last = max(centre - _MARGIN, 0), min(centre + _MARGIN, len(keys) - 1)
        vectors = _vectors_around(keys, centre, first, last)
        bends = bends_of(times[first : last + 1], vectors)
        for key in range(max(centre - 1, 0), min(centre + 2, len(keys))):
            for k in range(3):
                for joint in range(keys.shape[2]):
                    out[0, centre, key - centre + 1, k, joint] = vectors[key - first, k * keys.shape[2] + joint]
                    out[1, centre, key - centre + 1, k, joint] = bends[key - first, k * keys.shape[2] + joint]


@jit
def _vectors_around(keys: Floats, centre: int, first: int, last: int) -> Floats:
    """Return rotation vectors [n, 3 m], radians, from the key that is the centre to the keys from first to last.

    They are unrolled: each has whole turns added so that it is nearest to that of the neighbouring key towards the
    centre.
    """
    joints = keys.shape[2]
    out = np.zeros((last - first + 1, 3 * joints))
    own, room = np.empty((3, joints)), np.empty((2, joints))
    for side in (1, -1):
        turned = np.zeros(joints)
        key = centre + side
        while first <= key <= last:
            _write_logs(keys[centre], keys[key], own, room)
            for joint in range(joints):
                # No turn could bring it nearer: neither is half a turn away. Of zeros the sign would be lost.
                angle, is_flat = room[0, joint], own[0, joint] * own[1, joint] * own[2, joint] == 0.0
                if angle + turned[joint] > _NEAR or angle < 1e-8 or is_flat:
                    _unroll(own, joint, out[key - side - first])
                    angle = np.sqrt(own[0, joint] ** 2 + own[1, joint] ** 2 + own[2, joint] ** 2)
                turned[joint] = angle
                for k in range(3):
                    out[key - first, k * joints + joint] = own[k, joint]
            key += side
    return out


@jit
def _unroll(own: Floats, joint: int, toward: Floats) -> None:
    """Add whole turns to a joint's rotation vector [3, m], in place, so that it is nearest to another [3 m]."""
    x, y, z, joints = own[0, joint], own[1, joint], own[2, joint], own.shape[1]
    to_x, to_y, to_z = toward[joint], toward[joints + joint], toward[2 * joints + joint]
    angle = np.sqrt(x**2 + y**2 + z**2)
    # A zero vector may be a whole turn about any axis: take its neighbour's, if that is not zero too.
    ax, ay, az = (x, y, z) if angle > 1e-9 else (to_x, to_y, to_z)
    length = max(np.sqrt(ax**2 + ay**2 + az**2), 1e-9)
    across = (ax * to_x + ay * to_y + az * to_z) / length
    turns = 2.0 * np.pi * np.round((across - angle) / (2.0 * np.pi)) / length
    own[0, joint], own[1, joint], own[2, joint] = x + turns * ax, y + turns * ay, z + turns * az


@jit
def _write_logs(a: Floats, b: Floats, out: Floats, room: Floats) -> None:
    """Write the rotation vectors [3, m] from rotations `a` to `b` [4, m], in the frames of `a`: as `rotations.log`.

    Their lengths, radians, are then in the first row of the `room` for intermediate results [2, m].
    """
    # Loops of one line each, which the compiler turns into instructions on several numbers at once.
    count, lengths, scales = a.shape[1], room[0], room[1]
    for j in range(count):
        out[0, j] = a[3, j] * b[0, j] - a[0, j] * b[3, j] - a[1, j] * b[2, j] + a[2, j] * b[1, j]
    for j in range(count):
        out[1, j] = a[3, j] * b[1, j] + a[0, j] * b[2, j] - a[1, j] * b[3, j] - a[2, j] * b[0, j]
    for j in range(count):
        out[2, j] = a[3, j] * b[2, j] - a[0, j] * b[1, j] + a[1, j] * b[0, j] - a[2, j] * b[3, j]
    for j in range(count):
        lengths[j] = a[3, j] * b[3, j] + a[0, j] * b[0, j] + a[1, j] * b[1, j] + a[2, j] * b[2, j]
    for j in range(count):
        scales[j] = np.sqrt(out[0, j] * out[0, j] + out[1, j] * out[1, j] + out[2, j] * out[2, j])
    for j in range(count):
        cosine, sine = lengths[j], scales[j]
        lengths[j] = 2.0 * np.arctan2(sine, abs(cosine))
        scale = lengths[j] / sine if sine > 1e-8 else 2.0
        scales[j] = -scale if cosine < 0.0 else scale
    for k in range(3):
        for j in range(count):
            out[k, j] *= scales[j]


@jit
def _write_turned(keys: Floats, vectors: Floats, room: Floats, out: Floats) -> None:
    """Write keys [4, m] turned by rotation vectors [3, m] in their own frames: as `rotations.exp`, and the product.

    There is `room` for intermediate results [2, m].
    """
    count, shares, cosines = keys.shape[1], room[0], room[1]
    for j in range(count):
        shares[j] = np.sqrt(vectors[0, j] ** 2 + vectors[1, j] ** 2 + vectors[2, j] ** 2)
    for j in range(count):
        angle = shares[j]
        shares[j] = np.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
        cosines[j] = np.cos(0.5 * angle)
    for j in range(count):
        x, y, z, w = shares[j] * vectors[0, j], shares[j] * vectors[1, j], shares[j] * vectors[2, j], cosines[j]
        out[0, j] = keys[3, j] * x + keys[0, j] * w + keys[1, j] * z - keys[2, j] * y
        out[1, j] = keys[3, j] * y - keys[0, j] * z + keys[1, j] * w + keys[2, j] * x
        out[2, j] = keys[3, j] * z + keys[0, j] * y - keys[1, j] * x + keys[2, j] * w
        out[3, j] = keys[3, j] * w - keys[0, j] * x - keys[1, j] * y - keys[2, j] * z
