"""Spikes: single frames in which a joint is elsewhere, and in the next frame back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.geometry import rotations as rot

# A frame farther from the middle of its neighbours is a spike, if the joint goes there faster than this. Arms that
# animators swing at 30 frames a second reach 32 degrees.
SPIKE_RAD, SPIKE_RADPS = np.radians(25.0), np.radians(1500.0)
RETURN_SHARE = 0.5  # of that distance, at most, between the neighbours
MIN_SPIKE_FPS = 23.0  # of a recording that shows spikes


class Despiked(NamedTuple):
    """Rotations [T, J, 4] without spikes, and the spikes [T, J]."""

    rotations: Floats
    spikes: Bools


def repair_spikes(rotations: Floats, fps: float) -> Despiked:
    """Put joints in the middle between the frames before and after a spike.

    Args:
        rotations: local rotations [T, J, 4].
        fps: frames a second.
    """
    spikes = np.zeros(rotations.shape[:2], dtype=np.bool_)
    if len(rotations) < 3 or fps < MIN_SPIKE_FPS:
        return Despiked(rotations, spikes)
    before, after = rotations[:-2], rotations[2:]
    middle = rot.normalise(rot.slerp(before, after, 0.5))
    off = rot.angle(rotations[1:-1], middle)
    spikes[1:-1] = (off > max(SPIKE_RAD, SPIKE_RADPS / fps)) & (rot.angle(before, after) < RETURN_SHARE * off)
    out = rotations.copy()
    out[1:-1][spikes[1:-1]] = middle[spikes[1:-1]]
    return Despiked(out, spikes)
