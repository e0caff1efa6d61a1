"""Find the ends of a tween by name, such as "clip.bvh@240~": the posture, and the movement beside it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from motionmind.errors import MotionMindError
from motionmind.formats import read_motion
from motionmind.names.finding import find_motion, find_posture, select_frame
from motionmind.names.spelling import PostureName, parse_posture

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture

_AROUND = 0.2  # seconds of a clip before or after a moving posture; velocity uses the nearest frames
_ROUNDING = 1e-6  # seconds


def find_end(
    name: PostureName | str,
    side: Literal["before", "after"],
    home: Path | None = None,
    *,
    read: Callable[[Path], Motion] = read_motion,
) -> tuple[Posture, Motion | None]:
    """Find a posture by name and, if the name ends in ~, the movement on one side of it.

    Args:
        name: the name, or its spelling.
        side: the side of the movement: before A, after B.
        home: the folder of the user's corpora; None for the default folder.
        read: reads a file.

    Raises:
        MotionMindError: there is no such posture, or no movement on the side that ~ asks for.

    >>> posture, before = find_end("ballet/adagio@23~", "before")
    >>> before is not None and len(before) > 1
    True
    """
    named = parse_posture(name, home) if isinstance(name, str) else name
    if not named.is_moving:
        return find_posture(named, home, read=read), None
    word = named.source.word
    motion = find_motion(named.source, home, read=read)
    if len(motion) == 1:
        raise MotionMindError(f"{named.word}: {word} holds one posture, no movement around it; leave out ~")
    if named.moment is None:
        raise MotionMindError(f"{named.word}: say which frame, from 0 to {len(motion) - 1}, as {word}@0~")
    frame, times = select_frame(word, motion, named.moment), motion.times
    near = np.flatnonzero(np.abs(times - times[frame]) <= _AROUND + _ROUNDING)
    first, last = (min(near[0], frame - 1), frame) if side == "before" else (frame, max(near[-1], frame + 1))
    if not (first >= 0 and last < len(motion)):
        raise MotionMindError(f"{named.word}: nothing comes {side} frame {frame} of {word}; leave out ~")
    return motion.posture(frame), motion.slice(int(first), int(last) + 1)
