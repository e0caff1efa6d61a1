"""Charts of the rotations, compiled: rotation vectors from one key of a curve to those near it, and curves by them."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry.curves import bends_of, piece_of
from motionmind.jit import jit

_MARGIN = 18  # keys on either side that a chart knows: a key's influence falls to about a quarter with each further one
_NEAR = 3.1  # radians: less than half a turn


@jit
def curve_of_rotations(times: Floats, keys: Floats, at: Floats) -> Floats:
    """Return the curve through keys [K, m, 4], two or more, at some times [N]: [N, m, 4] (`splines.rotation_spline`).

    Args:
        times: of the keys, increasing [K].
        keys: unit quaternions.
        at: times to evaluate at.
    """
    count, joints = keys.shape[:2]
    out, pieces, wanted = np.empty((len(at), joints, 4)), np.empty(len(at), np.int64), np.zeros(count, np.bool_)
    for t in range(len(at)):
        pieces[t] = piece_of(times, at[t])
        if at[t] != times[pieces[t]]:
            wanted[pieces[t]] = wanted[pieces[t] + 1] = True
    # In each chart only the centre and its neighbours count: values, and second derivatives.
    values, bends = np.zeros((count, 3, joints, 3)), np.zeros((count, 3, joints, 3))
    for centre in range(count):
        if wanted[centre]:
            _write_chart(times, keys, centre, values[centre], bends[centre])
    one, other, vector = np.empty(4), np.empty(4), np.empty(3)
    for t in range(len(at)):
        key = pieces[t]
        after, before = times[key + 1] - at[t], at[t] - times[key]
        if before == 0.0:
            out[t] = keys[key]
            continue
        step = after + before
        a, b, s = after**3 / step - step * after, before**3 / step - step * before, before / step
        share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        for joint in range(joints):
            for end, rotation in ((0, one), (1, other)):
                # The chart of the piece's first key has that in the middle, and that of its last one the last.
                v, m, first = values[key + end], bends[key + end], 1 - end
                for k in range(3):
                    line = (v[first, joint, k] * after + v[first + 1, joint, k] * before) / step
                    vector[k] = line + (m[first, joint, k] * a + m[first + 1, joint, k] * b) / 6.0
                _write_turned(keys[key + end, joint], vector, rotation)
            _write_log(one, other, vector)
            for k in range(3):
                vector[k] *= share
            _write_turned(one, vector, out[t, joint])
    return out


@jit
def _write_chart(times: Floats, keys: Floats, centre: int, values: Floats, bends: Floats) -> None:
    """Write the natural spline of rotation vectors around a key: values and second derivatives [3, m, 3] there and at
    its neighbours, where there are some."""
    first, last = max(centre - _MARGIN, 0), min(centre + _MARGIN, len(keys) - 1)
    vectors = _vectors_around(keys, centre, first, last)
    bent = bends_of(times[first : last + 1], vectors.reshape(len(vectors), -1)).reshape(vectors.shape)
    for row in range(3):
        key = centre + row - 1
        if 0 <= key < len(keys):
            values[row], bends[row] = vectors[key - first], bent[key - first]


@jit
def _vectors_around(keys: Floats, centre: int, first: int, last: int) -> Floats:
    """Return rotation vectors [n, m, 3], radians, from the key that is the centre to the keys from first to last.

    They are unrolled: each has whole turns added so that it is nearest to that of the neighbouring key towards the
    centre.
    """
    out = np.empty((last - first + 1, keys.shape[1], 3))
    turned = np.empty(keys.shape[1])
    out[centre - first] = 0.0
    for side in (1, -1):
        turned[:] = 0.0
        key = centre + side
        while first <= key <= last:
            for joint in range(keys.shape[1]):
                own = out[key - first, joint]
                angle = _write_log(keys[centre, joint], keys[key, joint], own)
                # No turn could bring it nearer: neither is half a turn away. Of zeros the sign would be lost.
                if angle + turned[joint] > _NEAR or angle < 1e-8 or own[0] * own[1] * own[2] == 0.0:
                    _unroll(own, out[key - side - first, joint])
                    angle = np.sqrt(own[0] ** 2 + own[1] ** 2 + own[2] ** 2)
                turned[joint] = angle
            key += side
    return out


@jit
def _unroll(own: Floats, toward: Floats) -> None:
    """Add whole turns to a rotation vector [3], in place, so that it is nearest to another."""
    x, y, z = own[0], own[1], own[2]
    angle = np.sqrt(x**2 + y**2 + z**2)
    # A zero vector may be a whole turn about any axis: take its neighbour's, if that is not zero too.
    ax, ay, az = (x, y, z) if angle > 1e-9 else (toward[0], toward[1], toward[2])
    length = max(np.sqrt(ax**2 + ay**2 + az**2), 1e-9)
    across = (ax * toward[0] + ay * toward[1] + az * toward[2]) / length
    turns = 2.0 * np.pi * np.round((across - angle) / (2.0 * np.pi)) / length
    own[0], own[1], own[2] = x + turns * ax, y + turns * ay, z + turns * az


@jit
def _write_log(a: Floats, b: Floats, out: Floats) -> float:
    """Write the rotation vector [3] from rotation `a` to `b` [4], in the frame of `a`: as `rotations.log`. Return its
    length, radians."""
    x = a[3] * b[0] - a[0] * b[3] - a[1] * b[2] + a[2] * b[1]
    y = a[3] * b[1] + a[0] * b[2] - a[1] * b[3] - a[2] * b[0]
    z = a[3] * b[2] - a[0] * b[1] + a[1] * b[0] - a[2] * b[3]
    w = a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    sine = np.sqrt(x * x + y * y + z * z)
    angle = 2.0 * np.arctan2(sine, abs(w))
    scale = angle / sine if sine > 1e-8 else 2.0
    if w < 0.0:
        scale = -scale
    out[0], out[1], out[2] = scale * x, scale * y, scale * z
    return float(angle)


@jit
def _write_turned(key: Floats, vector: Floats, out: Floats) -> None:
    """Write a key [4] turned by a rotation vector [3] in its own frame: as `rotations.exp`, and the product."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    share = np.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    x, y, z, w = share * vector[0], share * vector[1], share * vector[2], np.cos(0.5 * angle)
    out[0] = key[3] * x + key[0] * w + key[1] * z - key[2] * y
    out[1] = key[3] * y - key[0] * z + key[1] * w + key[2] * x
    out[2] = key[3] * z + key[0] * y - key[1] * x + key[2] * w
    out[3] = key[3] * w - key[0] * x - key[1] * y - key[2] * z
