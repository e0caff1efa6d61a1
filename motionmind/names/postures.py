"""Find postures by name, such as "ballet/arabesque" or "clip.bvh@240~"."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from motionmind.arguments import check_function, check_path, check_type
from motionmind.body.motion import Motion, Posture
from motionmind.errors import MotionMindError
from motionmind.formats import read_motion
from motionmind.names.finding import find_motion, frame_of, select_frame
from motionmind.names.spelling import PostureName, parse_posture
from motionmind.retarget.retarget import own_skeleton


class FoundPosture(NamedTuple):
    """A posture found by name, with the movement around it if the name ends in ~.

    Attributes:
        posture: the posture.
        before: the movement that leads up to it, at least one frame and up to 0.2 s, for `Engine.tween`'s `before`;
            None without ~, or if nothing comes before the posture.
        after: the movement that follows it, in the same form, for `Engine.tween`'s `after`.

    >>> from motionmind import find_posture
    >>> found = find_posture("ballet/adagio@23~")
    >>> len(found.before), len(found.after), find_posture("ballet/adagio@23").before
    (2, 2, None)
    """

    posture: Posture
    before: Motion | None = None
    after: Motion | None = None


def read_own(path: Path | str) -> Motion:
    """Read the movement in a file, on human23 if its joints map to it."""
    return own_skeleton(read_motion(path))


def find_posture(
    name: PostureName | str, home: Path | None = None, *, read: Callable[[Path | str], Motion] = read_own
) -> FoundPosture:
    """Find a posture by name.

    A file's movement is retargeted as a whole: it reveals the up axis and the orientation of a rig's joints better than
    one posture does.

    Args:
        name: "ballet/arabesque" (a posture of a corpus), "ballet/adagio@23" (a frame of a clip), "clip.bvh@240",
            "clip.bvh@2.0s", "hero.glb#Dance@24" (a frame of a clip of a glTF file) or "posture.json"; a ~ at the end
            asks for the movement around the frame, too.
        home: the folder of the user's corpora; None for the default folder.
        read: reads a file, or the clip in it that its path names; by default on human23 if its joints map to it.

    Raises:
        MotionMindError: there is no such posture (the message suggests a similar name or lists all), or no movement
            around it for a ~.
        WrongTypeError: an argument has the wrong type.

    >>> from motionmind import Engine, find_posture
    >>> engine = Engine.load("ballet")
    >>> engine.tween(find_posture("ballet/arabesque").posture, find_posture("ballet/fifth").posture).moves
    7
    """
    check_type("name", name, str, PostureName)
    check_path("home", home, or_none=True)
    check_function("read", read)
    named = parse_posture(name, home) if isinstance(name, str) else name
    motion = find_motion(named.source, home, as_clip=named.is_moving or named.moment is not None, read=read)
    if not named.is_moving:
        return FoundPosture(motion.posture(frame_of(named, motion)))
    word = named.source.word
    if len(motion) == 1:
        raise MotionMindError(f"{named.word}: {word} holds one posture, no movement around it; leave out ~")
    if named.moment is None:
        raise MotionMindError(f"{named.word}: say which frame, from 0 to {len(motion) - 1}, as {word}@0~")
    frame = select_frame(word, motion, named.moment)
    # Velocity uses the nearest frames; 1e-6 s is for rounding.
    near = np.flatnonzero(np.abs(motion.times - motion.times[frame]) <= 0.2 + 1e-6)
    first, last = min(int(near[0]), frame - 1), max(int(near[-1]), frame + 1)
    before = motion.slice(first, frame + 1) if frame > 0 else None
    after = motion.slice(frame, last + 1) if last < len(motion) else None
    return FoundPosture(motion.posture(frame), before, after)
