"""The times at which the frames of a film are drawn."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.rates import check_size

HOLD = 0.8  # seconds that a film shows its last frame before it starts again
SLOWEST = 0.01  # frames a second, the least of a film
_LEAST_RATE, _RATE = 12.0, 25.0  # frames a second: motions with fewer than the first are drawn at the second


def frame_rate(motion: Motion) -> float:
    """Return the default frames a second of a film: the motion's own, or 25 if it has fewer than 12."""
    return motion.fps if motion.fps >= _LEAST_RATE else _RATE


def frame_times(motion: Motion, rate: float) -> Floats:
    """Choose when to draw a motion, at even times from its first posture to its last, both included.

    Args:
        motion: the motion.
        rate: frames a second, at most; a little less if the last posture is off that beat.

    Returns:
        Times [T], seconds, increasing.

    Raises:
        MotionMindError: there would be too many frames (`check_size`).
    """
    if len(motion) == 1:
        return motion.times
    steps = max(int((motion.times[-1] - motion.times[0]) * rate + 1e-3), 1)
    check_size(steps + 1, len(motion.skeleton), motion.name)
    return np.linspace(motion.times[0], motion.times[-1], steps + 1)
