"""Charts of the rotations, compiled: rotation vectors from one key of a curve to all others."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit


@jit
def vectors_around(keys: Floats, centres: Ints) -> Floats:
    """Return rotation vectors [C, K, m, 3], radians, from the keys that are `centres` [C] to all keys [K, m, 4].

    They are unrolled: each has whole turns added so that it is nearest to that of the neighbouring key towards the
    centre.
    """
    out = np.zeros((len(centres), *keys.shape[:2], 3))
    own = np.empty(3)
    for chart in range(len(centres)):
        centre = centres[chart]
        for joint in range(keys.shape[1]):
            for side in (1, -1):
                key = centre + side
                while 0 <= key < len(keys):
                    _log_between(keys[centre, joint], keys[key, joint], own)
                    toward = out[chart, key - side, joint]
                    angle = np.sqrt(own[0] ** 2 + own[1] ** 2 + own[2] ** 2)
                    # A zero vector may be a whole turn about any axis: take its neighbour's, if that is not zero too.
                    along = own if angle > 1e-9 else toward
                    length = max(np.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2), 1e-9)
                    across = (along[0] * toward[0] + along[1] * toward[1] + along[2] * toward[2]) / length
                    turns = 2.0 * np.pi * np.round((across - angle) / (2.0 * np.pi)) / length
                    for i in range(3):
                        out[chart, key, joint, i] = own[i] + turns * along[i]
                    key += side
    return out


@jit
def _log_between(a: Floats, b: Floats, out: Floats) -> None:
    """Write the rotation vector [3] from rotation `a` to `b` [4], in the frame of `a`: as `rotations.log`."""
    x = a[3] * b[0] - a[0] * b[3] - a[1] * b[2] + a[2] * b[1]
    y = a[3] * b[1] + a[0] * b[2] - a[1] * b[3] - a[2] * b[0]
    z = a[3] * b[2] - a[0] * b[1] + a[1] * b[0] - a[2] * b[3]
    w = a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    sine = np.sqrt(x * x + y * y + z * z)
    scale = 2.0 * np.arctan2(sine, abs(w)) / sine if sine > 1e-8 else 2.0
    if w < 0.0:
        scale = -scale
    out[0], out[1], out[2] = scale * x, scale * y, scale * z
