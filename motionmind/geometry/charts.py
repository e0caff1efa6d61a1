"""Charts of the rotations, compiled: splines of the rotation vectors from each key of a curve to the keys near it."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.geometry.compiled import Vector, exp, inv_mul, log, mul, norm
from motionmind.geometry.curves import second_derivatives
from motionmind.jit import jit

N_CHART_KEYS = 18  # keys of a chart on either side: a key's influence falls to about a quarter with each further one


def curve_of_rotations(times: Floats, keys: Floats, at: Floats) -> Floats:
    """Return the curve through keys [K, m, 4], two or more, at some times [N]: [N, m, 4] (`splines.rotation_spline`).

    Args:
        times: times of the keys, increasing [K].
        keys: unit quaternions.
        at: times to evaluate at.
    """
    pieces = np.searchsorted(times, at, side="right").clip(1, len(times) - 1) - 1  # by the key that each begins with
    out = np.take(keys, pieces, axis=0)
    between = np.flatnonzero(at != times[pieces])
    # Values and second derivatives of each chart at its centre and its neighbours.
    charts = np.zeros((2, len(keys), 3, keys.shape[1], 3))
    centres = np.zeros(len(keys), dtype=np.bool_)
    centres[pieces[between]] = centres[pieces[between] + 1] = True
    _write_charts(times, keys, np.flatnonzero(centres), charts)
    _write_curve(times, keys, charts, at, pieces, between, out)
    return out


@jit
def _write_curve(
    times: Floats, keys: Floats, charts: Floats, at: Floats, pieces: Ints, between: Ints, out: Floats
) -> None:
    """Write the curve at times between keys; arguments are variables of `curve_of_rotations`."""
    ends, vector = np.empty((2, 4)), np.empty(3)
    for t in between:
        key = pieces[t]
        after, before = times[key + 1] - at[t], at[t] - times[key]
        step = after + before
        a, b, s = after**3 / step - step * after, before**3 / step - step * before, before / step
        share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        for joint in range(keys.shape[1]):
            for end in range(2):
                # The piece begins at the centre (1) of its first key's chart, and ends at that of its last key's.
                v, m, first = charts[0, key + end], charts[1, key + end], 1 - end
                for k in range(3):
                    line = (v[first, joint, k] * after + v[first + 1, joint, k] * before) / step
                    vector[k] = line + (m[first, joint, k] * a + m[first + 1, joint, k] * b) / 6.0
                _write(mul(keys[key + end, joint], exp(vector)), ends[end])
            x, y, z = log(inv_mul(ends[0], ends[1]))
            _write(mul(ends[0], exp((x * share, y * share, z * share))), out[t, joint])


@jit
def _write_charts(times: Floats, keys: Floats, centres: Ints, out: Floats) -> None:
    """Write the natural splines of rotation vectors around some keys [2, K, 3, m, 3].

    They are given by values and second derivatives at each key and at its neighbours, where there are some.
    """
    for centre in centres:
        first, last = max(centre - N_CHART_KEYS, 0), min(centre + N_CHART_KEYS, len(keys) - 1)
        vectors = _vectors_around(keys, centre, first, last)
        bends = second_derivatives(times[first : last + 1], vectors)
        for key in range(max(centre - 1, 0), min(centre + 2, len(keys))):
            for joint in range(keys.shape[1]):
                for k in range(3):
                    out[0, centre, key - centre + 1, joint, k] = vectors[key - first, 3 * joint + k]
                    out[1, centre, key - centre + 1, joint, k] = bends[key - first, 3 * joint + k]


@jit
def _vectors_around(keys: Floats, centre: int, first: int, last: int) -> Floats:
    """Return rotation vectors [n, 3 m], radians, from the centre key to the keys from first to last.

    They are unrolled: each has whole turns added so that it is nearest to that of the neighbouring key towards the
    centre.
    """
    joints = keys.shape[1]
    out = np.zeros((last - first + 1, 3 * joints))
    for side in (1, -1):
        key = centre + side
        while first <= key <= last:
            own, toward = out[key - first], out[key - side - first]
            for joint in range(joints):
                vector = log(inv_mul(keys[centre, joint], keys[key, joint]))
                _write(_unrolled(vector, toward[3 * joint : 3 * joint + 3]), own[3 * joint : 3 * joint + 3])
            key += side
    return out


@jit
def _unrolled(v: Vector, toward: Floats) -> Vector:
    """Return a rotation vector with whole turns added so that it is nearest to another."""
    angle = norm(v)
    # A zero vector may be a whole turn about any axis: take its neighbour's, if that is not zero too.
    x, y, z = (v[0], v[1], v[2]) if angle > 1e-9 else (toward[0], toward[1], toward[2])
    length = max(norm((x, y, z)), 1e-9)
    across = (x * toward[0] + y * toward[1] + z * toward[2]) / length
    turns = 2.0 * np.pi * np.round((across - angle) / (2.0 * np.pi)) / length
    return v[0] + turns * x, v[1] + turns * y, v[2] + turns * z


@jit
def _write(values: tuple[float, ...], out: Floats) -> None:
    """Write a tuple into an array."""
    for k in range(len(out)):
        out[k] = values[k]
