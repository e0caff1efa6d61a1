"""The times at which the frames of a film are drawn."""

from __future__ import annotations

import logging

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError

HOLD = 0.8  # seconds that a film shows its last frame before it starts again
SLOWEST = 0.01  # frames a second, the least of a film
USUAL_FRAMES = 1_000  # of a film whose rate nobody chose: 40 s of a GIF, and 12 MB of one of a person
_TIMES = 4  # as many may be asked for
_LEAST_RATE, _RATE = 12.0, 25.0  # frames a second: motions with fewer than the first are drawn at the second


def frame_rate(motion: Motion) -> float:
    """Return the default frames a second of a film: the motion's own, or 25 if it has fewer than 12."""
    return motion.fps if motion.fps >= _LEAST_RATE else _RATE


_log = logging.getLogger(__name__)


def film_rate(motion: Motion, usual: float, fps: float | None, frames: int = USUAL_FRAMES) -> float:
    """Return a film's frames a second; where it would have very many, those of a rate that nobody chose are fewer.

    A log entry says so (logger "motionmind.render.timing", level INFO).

    Args:
        motion: the motion.
        usual: frames a second, unless they are too many or others are asked for.
        fps: those asked for.
        frames: how many there may be at the usual rate, about; four times as many may be asked for.

    Raises:
        MotionMindError: there would be too many frames.
    """
    seconds = float(motion.times[-1] - motion.times[0])
    rate = fps
    if rate is None:
        rate = usual if seconds * usual <= frames else max((frames - 1) / seconds, SLOWEST)
    name, count = motion.name or "motion", seconds * rate + 1.0
    if count > _TIMES * frames:
        raise MotionMindError(
            f"{name}: {count:.0f} frames are more than a film of it may have, {_TIMES * frames} (a lower rate or a "
            "shorter part makes fewer)"
        )
    if fps is None and rate < usual:
        _log.info("%s: %.3g frames a second, %.0f in all (--fps, or fps=, for others)", name, rate, count)
    return rate


def frame_times(motion: Motion, rate: float) -> Floats:
    """Choose when to draw a motion, at even times from its first posture to its last, both included.

    Args:
        motion: the motion.
        rate: frames a second, at most; a little less if the last posture is off that beat.

    Returns:
        Times [T], seconds, increasing.
    """
    if len(motion) == 1:
        return motion.times
    steps = max(int((motion.times[-1] - motion.times[0]) * rate + 1e-3), 1)
    return np.linspace(motion.times[0], motion.times[-1], steps + 1)
