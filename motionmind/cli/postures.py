"""Read the ends of a tween: the postures that the command names, and the movement around them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from motionmind.errors import MotionMindError
from motionmind.formats import read_motion
from motionmind.names.finding import find_motion, select_frame, select_frames
from motionmind.names.postures import find_posture
from motionmind.names.spelling import FramesName, PostureName

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture


def read_end(
    named: PostureName,
    given: FramesName | None,
    side: Literal["before", "after"],
    home: Path | None = None,
    read: Callable[[Path], Motion] = read_motion,
) -> tuple[Posture, Motion | None]:
    """Read the posture at one end of a tween, and the movement on its other side.

    Args:
        named: the posture.
        given: the frames before or after it, if the command names them.
        side: the side of the posture: before A, after B.
        home: the folder of the user's corpora; None for the default folder.
        read: reads a motion file.

    Raises:
        MotionMindError: there is no such posture, or no movement on the side that a ~ asks for.
    """
    if given and named.is_moving:
        raise MotionMindError(f"{named.word}: ~ takes the movement around the frame, and so does --{side}; give one")
    found = find_posture(named, home, read=read)
    around = found.before if side == "before" else found.after
    if named.is_moving and around is None:
        raise MotionMindError(f"{named.word}: nothing comes {side} this frame; leave out ~")
    return found.posture, _read_frames(given, home, read) if given else around


def _read_frames(named: FramesName, home: Path | None, read: Callable[[Path], Motion]) -> Motion:
    word = named.source.word
    motion = find_motion(named.source, home, read=read)
    first, last = (select_frame(word, motion, moment) for moment in (named.first, named.last))
    frames = select_frames(word, len(motion), first, last)
    return motion.slice(frames.start, frames.stop)
