"""Read the ends of a tween: the postures that the command names, and the movement around them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from motionmind.errors import MotionMindError
from motionmind.formats import read_motion
from motionmind.names.postures import find_posture
from motionmind.names.spelling import PostureName

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture


def read_end(
    named: PostureName,
    side: Literal["before", "after"],
    home: Path | None = None,
    read: Callable[[Path | str], Motion] = read_motion,
) -> tuple[Posture, Motion | None]:
    """Read the posture at one end of a tween, and the movement on its other side if a ~ asks for it.

    Args:
        named: the posture.
        side: the side of the posture: before A, after B.
        home: the folder of the user's corpora; None for the default folder.
        read: reads a motion file.

    Raises:
        MotionMindError: there is no such posture, or no movement on the side that a ~ asks for.
    """
    found = find_posture(named, home, read=read)
    around = found.before if side == "before" else found.after
    if named.is_moving and around is None:
        raise MotionMindError(f"{named.word}: nothing comes {side} this frame; leave out ~")
    return found.posture, around
