"""The frame step of formats that record a single step, not times."""

from __future__ import annotations

import numpy as np

from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_FPS
from motionmind.errors import MotionMindError


def even_step(motion: Motion, form: str) -> float:
    """Return the seconds from frame to frame; of a single frame those of its `rate`, or a thirtieth.

    Args:
        motion: the movement to write.
        form: the format's name, for the message.

    Raises:
        MotionMindError: the times depart from an even step by more than a thousandth of it.
    """
    if len(motion) == 1:
        return 1.0 / (motion.rate if 0.0 < motion.rate <= MAX_FPS else 30.0)
    step = float(motion.times[-1] - motion.times[0]) / (len(motion) - 1)
    late = np.abs(motion.times - motion.times[0] - step * np.arange(len(motion)))
    if np.max(late) > 1e-3 * step:
        frame = int(np.argmax(late))
        raise MotionMindError(
            f"{motion.name or 'motion'}: {form} needs frames evenly spaced in time; frame {frame} is "
            f"{late[frame]:.3g} s off a step of {step:.6g} s (resample the motion first, as convert --fps does)"
        )
    return step
