"""Smoothness of movement: angular jerk, and the spectral arc length of its speed."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot


def angular_speed(rotations: Floats, fps: float) -> Floats:
    """Return the angular speed between consecutive frames [..., T - 1, J], rad/s.

    Args:
        rotations: [..., T, J, 4], evenly spaced in time.
        fps: frames a second.
    """
    return rot.angle(rotations[..., :-1, :, :], rotations[..., 1:, :, :]) * fps


def angular_jerk(rotations: Floats, fps: float) -> Floats:
    """Return the magnitude of the angular jerk [..., T - 3, J], rad/s^3.

    The angular velocity between consecutive frames is log(inv(q) * q') * fps, in the joint's own frame; jerk is its
    second derivative, by second differences. Flash and Hogan, "The coordination of arm movements", J. Neuroscience
    5:1688 (1985), introduced jerk, of positions, as a measure of smoothness; this is its analogue for rotations. For a
    turn about one axis it is the third difference of the angle, which is exact if the angle is a cubic of time.

    Args:
        rotations: [..., T, J, 4], evenly spaced in time.
        fps: frames a second.
    """
    velocity = rot.log(rot.inv_mul(rotations[..., :-1, :, :], rotations[..., 1:, :, :])) * fps
    return np.asarray(np.linalg.norm(np.diff(velocity, n=2, axis=-3), axis=-1) * fps**2)


def sparc(speed: Floats, fps: float) -> float:
    """Return the spectral arc length of a speed: at most -1, the closer to 0 the smoother; NaN at rest.

    Defined by Balasubramanian, Melendez-Calderon, Roby-Brami and Burdet, "On the analysis of movement smoothness", J.
    NeuroEngineering and Rehabilitation 12:112 (2015); the constants are those of its section on discrete movements and
    of the code released with it. It is minus the length of the curve of the speed's amplitude spectrum. The curve runs
    from 0 Hz to the last frequency, at most 10 Hz, whose amplitude is at least 5 % of the greatest. Amplitudes and that
    range of frequencies are scaled to 1, so the value does not depend on the size of the movement.

    Args:
        speed: [T], in any unit, evenly spaced in time.
        fps: samples a second.
    """
    count = 1 << (int(np.ceil(np.log2(len(speed)))) + 4)  # zeros pad the samples to 16 times as many, and a power of 2
    amplitude = np.abs(np.fft.fft(speed, count))
    if not amplitude.max() > 0.0:
        return float("nan")
    frequency = np.arange(count) * fps / count
    amplitude = amplitude[frequency <= 10.0] / amplitude.max()
    kept = np.flatnonzero(amplitude >= 0.05)
    curve = amplitude[kept[0] : kept[-1] + 1]
    return float(-np.hypot(1.0 / (len(curve) - 1), np.diff(curve)).sum())
