"""Read the postures that commands name, and the movement that leads up to them or follows them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from motionmind.cli.sources import select_frames
from motionmind.cli.words import NamedFrames, NamedPosture
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture

_AROUND = 0.2  # seconds of a clip before or after a moving posture; a velocity takes the nearest of them
_ROUNDING = 1e-6  # seconds


def read_still(named: NamedPosture) -> Posture:
    """Read a posture.

    Raises:
        MotionMindError: the file cannot be read or has no such frame, or it has several and none is named.
    """
    from motionmind.formats import read_motion, read_posture

    if named.frame is None:
        return read_posture(named.file)
    motion = read_motion(named.file)
    return motion.posture(_find_frame(named, motion))


def read_end(
    named: NamedPosture, given: NamedFrames | None, side: Literal["before", "after"]
) -> tuple[Posture, Motion | None]:
    """Read the posture at one end of a tween, and the movement on its other side.

    Args:
        named: the posture.
        given: the frames before or after it, if they are named.
        side: the side of the posture on which movement is taken: before A, after B.

    Raises:
        MotionMindError: as `read_still`; or it is to be moving and there is no movement on that side.
    """
    from motionmind.formats import read_motion

    if not named.is_moving:
        return read_still(named), given and _read_frames(given)
    if given:
        raise MotionMindError(f"{named.word}: ~ takes the movement around the frame, and so does --{side}; give one")
    motion = read_motion(named.file)
    if len(motion) == 1:
        raise MotionMindError(f"{named.word}: {named.file} holds one posture, no movement around it; leave out ~")
    if named.frame is None:
        raise MotionMindError(f"{named.word}: say which frame, from 0 to {len(motion) - 1}, as {named.file}@0~")
    frame, times = _find_frame(named, motion), motion.times
    near = np.flatnonzero(np.abs(times - times[frame]) <= _AROUND + _ROUNDING)
    first, last = (min(near[0], frame - 1), frame) if side == "before" else (frame, max(near[-1], frame + 1))
    if not (first >= 0 and last < len(motion)):
        raise MotionMindError(f"{named.word}: nothing comes {side} frame {frame} of {named.file}; leave out ~")
    return motion.posture(frame), motion.slice(int(first), int(last) + 1)


def _find_frame(named: NamedPosture, motion: Motion) -> int:
    frame = named.frame or 0
    return select_frames(named.file, len(motion), frame, frame)[0]


def _read_frames(named: NamedFrames) -> Motion:
    from motionmind.formats import read_motion

    motion = read_motion(named.file)
    frames = select_frames(named.file, len(motion), named.first, named.last)
    return motion.slice(frames.start, frames.stop)
