"""The frame rate of a film, and the times of its frames."""

from __future__ import annotations

import logging

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.errors import MotionMindError

HOLD_S = 0.8  # how long a film shows its last frame before it starts again
MIN_FPS = 0.01  # of a film
N_USUAL_FRAMES = 1_000  # at most at the default rate: 40 s of a GIF, and 12 MB of one of a person
SAME_TIME_S = 1e-6  # times no farther apart count as equal

_log = logging.getLogger(__name__)


def frame_rate(motion: Motion) -> float:
    """Return the default frames a second of a film: the motion's own, or 25 if it has fewer than 12."""
    return motion.fps if motion.fps >= 12.0 else 25.0


def film_rate(motion: Motion, usual: float, fps: float | None, frames: int = N_USUAL_FRAMES) -> float:
    """Return a film's frames a second: the given rate, or the usual one, lowered for long motions.

    A log entry reports a lowered rate (logger "motionmind.render.timing", level INFO).

    Args:
        motion: the motion.
        usual: the default rate, frames a second.
        fps: the rate that the caller chose; None for the default.
        frames: number of frames at the default rate, at most; a chosen rate may give four times as many.

    Raises:
        MotionMindError: there would be too many frames.
    """
    seconds = float(motion.times[-1] - motion.times[0])
    rate = fps
    if rate is None:
        rate = usual if seconds * usual <= frames else max((frames - 1) / seconds, MIN_FPS)
    name, count = motion.name or "motion", seconds * rate + 1.0
    if count > 4 * frames:
        raise MotionMindError(
            f"{name}: {count:.0f} frames are more than a film of it may have, {4 * frames} (a lower rate or a "
            "shorter part makes fewer)"
        )
    if fps is None and rate < usual:
        _log.info("%s: %.3g frames a second, %.0f in all (--fps, or fps=, for others)", displayed(name), rate, count)
    return rate


def frame_times(motion: Motion, rate: float) -> Floats:
    """Return the times of a film's frames: even, and the first and the last posture included.

    Args:
        motion: the motion.
        rate: frames a second; the actual rate is a little lower if the last posture falls between two frames.

    Returns:
        Times [T], seconds, increasing.
    """
    if len(motion) == 1:
        return motion.times
    steps = max(int((motion.times[-1] - motion.times[0]) * rate + 1e-3), 1)
    return np.linspace(motion.times[0], motion.times[-1], steps + 1)
