"""Place a piece in time and on the floor: when each part begins, where it stands and which way it faces.

A part is a stretch of a movement: a block, or the insertion at a seam. Each part begins at the floor position and
heading where the previous one ends; a block that continues a recording keeps the recording's placement. If the
corpus's dancers face the audience (facing "stage"), no part is turned. The page plays the parts with this placement,
and `performance` joins them into one movement.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import cos, sin
from typing import NamedTuple

import msgspec
import numpy as np

from motionmind.body.motion import Motion
from motionmind.corpus.corpus import Facing
from motionmind.credits.credit import add_up
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.studio.piece import Seam, State, key_of
from motionmind.variation.piece import LONE_POSTURE_S, Parts, Placement

Movements = Callable[[str], Motion]  # returns a movement by key; raises MotionMindError if there is none


def check_body(key: str, motion: Motion, other_key: str, other: Motion) -> None:
    """Check that two movements share a body; the keys are for the message.

    Raises:
        SkeletonError: their skeletons differ.
    """
    difference = motion.skeleton.difference(other.skeleton)
    if difference is None and motion.skeleton.names != other.skeleton.names:
        difference = "their joints are in different order"
    if difference is not None:
        raise SkeletonError(f"{other_key} and {key} have different bodies: {difference}")


class Part(msgspec.Struct, frozen=True):
    """A stretch of a movement, placed.

    Attributes:
        key: key of the movement.
        first: its first frame.
        last: its last frame, inclusive.
        at: when it begins in the piece, seconds.
        seconds: its duration.
        place: x and z of the shift after the turn, metres.
        turn: rotation about the vertical, radians.
        inserted: whether it is an insertion.
    """

    key: str
    first: int
    last: int
    at: float
    seconds: float
    place: tuple[float, float]
    turn: float
    inserted: bool = False


class Mark(NamedTuple):
    """A body at a frame of a movement: its floor position, metres, its heading, radians, and the time, seconds."""

    x: float
    z: float
    heading: float
    time: float


class Marks:
    """Cached marks of movements' frames: a piece needs the same ones after every edit.

    A missing movement or frame stands still at the origin, with 30 frames a second.

    Attributes:
        facing: returns which way a corpus's dancers may face, by its name.
    """

    def __init__(self, movement: Movements, facing: Callable[[str], Facing] = lambda _: "free") -> None:
        """Begin with an empty cache.

        Args:
            movement: returns movements by key.
            facing: returns which way a corpus's dancers may face, by its name.
        """
        self.facing = facing
        self._movement = movement
        self._marks: dict[tuple[str, int], Mark] = {}
        self._lengths: dict[str, int] = {}

    def forget(self) -> None:
        """Empty the cache, after movements have changed or appeared."""
        self._marks.clear()
        self._lengths.clear()

    def has(self, key: str, frame: int) -> bool:
        """Return whether a movement and its frame exist."""
        return frame < self._count(key)

    def at(self, key: str, frame: int) -> Mark:
        """Return the mark of a frame."""
        if (known := self._marks.get((key, frame))) is None:
            if not self.has(key, frame):
                return Mark(0.0, 0.0, 0.0, frame / 30.0)
            motion = self._movement(key)
            x, _, z = motion.root[frame].tolist()
            known = Mark(x, z, float(rot.heading(motion.rotations[frame, 0])), float(motion.times[frame]))
            self._marks[key, frame] = known
        return known

    def length(self, key: str) -> int:
        """Return the number of frames of a movement; raise MotionMindError if there is none."""
        return self._count(key) or len(self._movement(key))

    def _count(self, key: str) -> int:
        """Return the number of frames of a movement; 0 if there is none."""
        if key not in self._lengths:
            try:
                self._lengths[key] = len(self._movement(key))
            except MotionMindError:
                self._lengths[key] = 0
        return self._lengths[key]

    def step(self, key: str, frame: int) -> float:
        """Return the seconds from a frame to the next one; the last frame lasts as long as the one before it."""
        count = self._count(key)
        if count <= 1:
            return LONE_POSTURE_S
        begin = min(frame, count - 2)
        return self.at(key, begin + 1).time - self.at(key, begin).time


class Layout(NamedTuple):
    """A piece's parts.

    Attributes:
        blocks: one for each block, in order.
        insertions: one for each seam, in order; None if nothing is inserted.
        seconds: duration of the piece.
    """

    blocks: tuple[Part, ...]
    insertions: tuple[Part | None, ...]
    seconds: float

    @property
    def parts(self) -> Iterator[Part]:
        """All parts in order of time."""
        for place, block in enumerate(self.blocks):
            yield block
            if place < len(self.insertions) and (insertion := self.insertions[place]) is not None:
                yield insertion


def lay_out(state: State, insertion: Callable[[Seam], str | None], marks: Marks) -> Layout:
    """Place a piece's parts.

    Args:
        state: the piece.
        insertion: returns the key of the movement to insert at a seam; None for none.
        marks: marks of the movements.
    """
    turns = bool(state.blocks) and marks.facing(state.corpus) == "free"
    blocks: list[Part] = []
    insertions: list[Part | None] = []
    for place, block in enumerate(state.blocks):
        if place == 0:
            blocks.append(_part(marks, key_of(block), block.first, block.last, 0.0, (0.0, 0.0), 0.0))
            continue
        seam, before = state.seams[place - 1], blocks[-1]
        end = before.at + before.seconds
        if seam.goes_on:
            at = end + (marks.step(before.key, before.last) if block.first > before.last else 0.0)
            insertions.append(None)
            blocks.append(_part(marks, before.key, block.first, block.last, at, before.place, before.turn))
            continue
        key = insertion(seam)
        if key is None:
            insertions.append(None)
            end += marks.step(before.key, before.last)
        else:
            before = _following(marks, before, key, (0, marks.length(key) - 1), end, turns, inserted=True)
            insertions.append(before)
            end += before.seconds
        blocks.append(_following(marks, before, key_of(block), (block.first, block.last), end, turns))
    length = blocks[-1].at + blocks[-1].seconds if blocks else 0.0
    return Layout(tuple(blocks), tuple(insertions), length)


def _part(marks: Marks, key: str, first: int, last: int, at: float, place: tuple[float, float], turn: float) -> Part:
    seconds = marks.at(key, last).time - marks.at(key, first).time
    return Part(key, first, last, at, seconds, place, turn)


def _following(
    marks: Marks, before: Part, key: str, frames: tuple[int, int], at: float, turns: bool, *, inserted: bool = False
) -> Part:
    """Place a part where another one ends, turned to its heading if `turns`."""
    first, last = frames
    end, begin = marks.at(before.key, before.last), marks.at(key, first)
    turn = before.turn + end.heading - begin.heading if turns else 0.0
    x, z = _turned(end.x, end.z, before.turn)
    own_x, own_z = _turned(begin.x, begin.z, turn)
    place = before.place[0] + x - own_x, before.place[1] + z - own_z
    part = _part(marks, key, first, last, at, place, turn)
    return msgspec.structs.replace(part, inserted=True) if inserted else part


def _turned(x: float, z: float, angle: float) -> tuple[float, float]:
    """Rotate a floor position about the vertical."""
    return x * cos(angle) + z * sin(angle), z * cos(angle) - x * sin(angle)


def performance(parts: Sequence[Part], movement: Movements) -> Motion:
    """Join a piece's parts into one movement, with insertions marked and credits weighted by the parts' durations.

    Args:
        parts: the parts, in order, at least one.
        movement: returns movements by key.

    Raises:
        MotionMindError: there are no parts, or a movement or a frame is missing.
        SkeletonError: the parts have different skeletons.
    """
    if not parts:
        raise MotionMindError("the piece is empty: add a posture or a clip first")
    joined = Parts()
    whole = movement(parts[0].key)
    own = [
        replace(credit, share=credit.share * max(part.seconds, 1e-9))  # a single posture is credited too
        for part in parts
        if not part.inserted
        for credit in movement(part.key).own_credits
    ]
    keyframed = all(movement(part.key).keyframed for part in parts)
    whole = replace(whole, keyframed=keyframed, recorded=add_up(own))
    for place, part in enumerate(parts):
        motion = movement(part.key)
        if part.last >= len(motion):
            raise MotionMindError(f"{part.key} has no frame {part.last}: its frames are 0 to {len(motion) - 1}")
        check_body(parts[0].key, whole, part.key, motion)
        begin, stop = part.first, part.last + 1
        if part.inserted:
            begin, stop = begin + 1, stop - 1  # its end frames repeat the neighbours' postures
        elif place and _repeats(parts[place - 1], part):
            begin += 1
        clock = part.at - float(motion.times[part.first])
        shift = np.array([part.place[0], 0.0, part.place[1]])
        frames = slice(begin, stop)
        times = motion.times[part.first], motion.times[part.last]
        marks = [one for one in motion.insertions if times[0] <= one.times[0] and one.times[-1] <= times[1]]
        where = Placement(part.turn, shift)
        joined.frames.append(np.arange(0))
        joined.add(motion.rotations[frames], motion.root[frames], motion.times[frames], marks, where, clock)
    return joined.join(whole).motion


def _repeats(before: Part, part: Part) -> bool:
    """Return whether a part begins with the frame that the previous one ended with."""
    return not before.inserted and before.key == part.key and before.last == part.first
