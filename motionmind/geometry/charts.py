"""Charts of the rotations, compiled: rotation vectors from one key of a curve to all others."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit

_NEAR = 3.1  # radians: less than half a turn


@jit
def vectors_around(keys: Floats, centres: Ints) -> Floats:
    """Return rotation vectors [C, K, m, 3], radians, from the keys that are `centres` [C] to all keys [K, m, 4].

    They are unrolled: each has whole turns added so that it is nearest to that of the neighbouring key towards the
    centre.
    """
    out = np.empty((len(centres), *keys.shape[:2], 3))
    turned = np.empty(keys.shape[1])
    for chart in range(len(centres)):
        centre = centres[chart]
        out[chart, centre] = 0.0
        for side in (1, -1):
            turned[:] = 0.0
            key = centre + side
            while 0 <= key < len(keys):
                for joint in range(keys.shape[1]):
                    own = out[chart, key, joint]
                    angle = _write_log(keys[centre, joint], keys[key, joint], own)
                    # No turn could bring it nearer: neither is half a turn away. Of zeros the sign would be lost.
                    if angle + turned[joint] > _NEAR or angle < 1e-8 or own[0] * own[1] * own[2] == 0.0:
                        _unroll(own, out[chart, key - side, joint])
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
