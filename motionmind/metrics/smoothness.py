"""How smooth movement is: angular jerk, and the spectral arc length of its speed."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

_PADDING = 4  # the spectrum is taken of 2^4 times as many samples, zeros added
_HIGHEST = 10.0  # Hz; above it is no movement of a person
_LEAST = 0.05  # of the greatest amplitude; beyond the last that is as large is noise


def angular_speed(rotations: Floats, fps: float) -> Floats:
    """Speed of turning [..., T - 1, J], rad/s, of rotations [..., T, J, 4] that follow one another at `fps`."""
    return rot.angle(rotations[..., :-1, :, :], rotations[..., 1:, :, :]) * fps


def angular_jerk(rotations: Floats, fps: float) -> Floats:
    """Size of the angular jerk [..., T - 3, J], rad/s^3, of rotations [..., T, J, 4] that follow one another at `fps`.

    The angular velocity from each frame to the next is log(inv(q) * q') * fps, as the turning joint itself sees it;
    jerk is its second derivative, by the second difference. Flash and Hogan, "The coordination of arm movements",
    J. Neuroscience 5:1688 (1985), took jerk as the measure of smoothness, of places; this is the same of turns. For a
    turn about one axis it is the third difference of the angle, which is exact where the angle is a cubic of time.
    """
    velocity = rot.log(rot.inv_mul(rotations[..., :-1, :, :], rotations[..., 1:, :, :])) * fps
    return np.asarray(np.linalg.norm(np.diff(velocity, n=2, axis=-3), axis=-1) * fps**2)


def sparc(speed: Floats, fps: float) -> float:
    """Spectral arc length of a speed [T] sampled at `fps`: at most -1, the closer to 0 the smoother; NaN at rest.

    Balasubramanian, Melendez-Calderon, Roby-Brami and Burdet, "On the analysis of movement smoothness", J.
    NeuroEngineering and Rehabilitation 12:112 (2015), with the constants of its section on discrete movements (and of
    the code released with it): minus the length of the curve of the speed's amplitude spectrum, from 0 Hz up to the
    last frequency of at most 10 Hz whose amplitude is 5 % of the greatest or more, where both the amplitudes and that
    range of frequencies are scaled to 1. It does not depend on the size of the movement.
    """
    count = 1 << (int(np.ceil(np.log2(len(speed)))) + _PADDING)
    amplitude = np.abs(np.fft.fft(speed, count))
    if not amplitude.max() > 0.0:
        return float("nan")
    frequency = np.arange(count) * fps / count
    amplitude = amplitude[frequency <= _HIGHEST] / amplitude.max()
    kept = np.flatnonzero(amplitude >= _LEAST)
    curve = amplitude[kept[0] : kept[-1] + 1]
    return float(-np.hypot(1.0 / (len(curve) - 1), np.diff(curve)).sum())
