"""Place a piece in time and on the floor: when each part begins, where it stands and which way it faces.

A part is a stretch of a movement: a block, or the insertion at a seam. Each part begins at the floor position and
heading where the previous one ends; a block that continues a recording keeps the recording's placement. If the
corpus's dancers face the audience (facing "stage"), a part is turned only as far as an insertion's request turned those
before it. The page plays the parts with this placement, and `performance` joins them into one movement.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import cos, sin
from typing import NamedTuple

import msgspec
import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.motion import Motion
from motionmind.corpus.corpus import Facing
from motionmind.credits.credit import add_up
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.studio.edits import Block
from motionmind.studio.neighbours import Seam, key_of
from motionmind.studio.piece import State
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
        seconds: its duration; its frames are spread over it in proportion to their own times, a single one is held.
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
        if (known := self._lengths.get(key)) is None:
            try:
                known = len(self._movement(key))
            except MotionMindError:
                known = 0
            self._lengths[key] = known
        return known

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
        parts: all of them, in order of time.
        blocks: one for each block, in order: its first, if it repeats.
        ends: when each block ends, with its repeats, seconds.
        insertions: one for each seam, in order, the first of a block that repeats; None if nothing is inserted.
        gaps: when each seam begins and ends, seconds; likewise.
        seconds: duration of the piece.
    """

    parts: tuple[Part, ...]
    blocks: tuple[Part, ...]
    ends: tuple[float, ...]
    insertions: tuple[Part | None, ...]
    gaps: tuple[tuple[float, float], ...]
    seconds: float


def lay_out(state: State, insertion: Callable[[Seam], str | None], marks: Marks) -> Layout:
    """Place a piece's parts.

    Args:
        state: the piece.
        insertion: returns the key of the movement to insert at a seam; None for none.
        marks: marks of the movements.
    """
    turns = bool(state.blocks) and marks.facing(state.corpus) == "free"
    parts: list[Part] = []
    blocks: list[Part] = []
    ends: list[float] = []
    insertions: list[Part | None] = []
    gaps: list[tuple[float, float]] = []
    for place, block in enumerate(state.blocks):
        for number in range(block.repeats):
            if not parts:
                parts.append(Part(key_of(block), block.first, block.last, 0.0, _seconds(marks, block), (0.0, 0.0), 0.0))
            else:
                left = block if number else state.blocks[place - 1]
                seam = state.seam(left.id, block.id)
                joined = _joined(marks, parts[-1], seam, insertion(seam), turns)
                if number < 2:  # all repeats have the same seam
                    insertions.append(joined[0] if len(joined) > 1 else None)
                    gaps.append((parts[-1].at + parts[-1].seconds, joined[-1].at))
                parts += joined
            if number == 0:
                blocks.append(parts[-1])
        ends.append(parts[-1].at + parts[-1].seconds)
    return Layout(tuple(parts), tuple(blocks), tuple(ends), tuple(insertions), tuple(gaps), ends[-1] if ends else 0.0)


def _seconds(marks: Marks, block: Block) -> float:
    """Return how long a block plays once."""
    key = key_of(block)
    return (marks.at(key, block.last).time - marks.at(key, block.first).time) / block.pace + block.hold


def _joined(marks: Marks, before: Part, seam: Seam, key: str | None, turns: bool) -> list[Part]:
    """Return the parts that follow another one: the insertion at a seam, if `key` names its movement, and the block."""
    block, seconds = seam.right, _seconds(marks, seam.right)
    end = before.at + before.seconds
    step = marks.step(before.key, before.last) / (seam.ends[0].pace or 1.0)
    if seam.goes_on:
        at = end + (step if block.first > before.last else 0.0)
        return [Part(before.key, block.first, block.last, at, seconds, before.place, before.turn)]
    if key is None:
        return [_following(marks, before, key_of(block), (block.first, block.last), end + step, seconds, turns)]
    frames = 0, marks.length(key) - 1
    length = marks.at(key, frames[1]).time - marks.at(key, 0).time
    found = msgspec.structs.replace(_following(marks, before, key, frames, end, length, turns), inserted=True)
    travel = seam.verdict.ask.travel
    turns = turns or (travel is not None and travel.facing is not None)
    after = _following(marks, found, key_of(block), (block.first, block.last), end + length, seconds, turns)
    return [found, after]


def _following(
    marks: Marks, before: Part, key: str, frames: tuple[int, int], at: float, seconds: float, turns: bool
) -> Part:
    """Place a part where another one ends, turned to its heading if `turns`, or else as far as that one is turned."""
    end, begin = marks.at(before.key, before.last), marks.at(key, frames[0])
    turn = before.turn + (end.heading - begin.heading if turns else 0.0)
    x, z = _turned(end.x, end.z, before.turn)
    own_x, own_z = _turned(begin.x, begin.z, turn)
    place = before.place[0] + x - own_x, before.place[1] + z - own_z
    return Part(key, *frames, at, seconds, place, turn)


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
        frames, times = _played(part, motion)
        first, last = motion.times[part.first], motion.times[part.last]
        marks = [
            replace(one, times=np.interp(one.times, motion.times[frames], times))
            for one in motion.insertions
            if first <= one.times[0] and one.times[-1] <= last
        ]
        shown = slice(None)
        if part.inserted:
            shown = slice(1, -1)  # its end frames repeat the neighbours' postures
        elif place and _repeats(parts[place - 1], part):
            shown = slice(1, None)
        where = Placement(part.turn, np.array([part.place[0], 0.0, part.place[1]]))
        frames = frames[shown]
        joined.frames.append(np.arange(0))
        joined.add(motion.rotations[frames], motion.root[frames], times[shown], marks, where, 0.0)
    return joined.join(whole).motion


def _played(part: Part, motion: Motion) -> tuple[Ints, Floats]:
    """Return the frames of a part [T], a held one twice, and when they come, seconds [T]."""
    frames = np.arange(part.first, part.last + 1)
    own = motion.times[frames] - motion.times[part.first]
    if len(frames) > 1:
        return frames, part.at + part.seconds * (own / own[-1])
    if part.seconds > 0.0:
        return np.repeat(frames, 2), part.at + np.array([0.0, part.seconds])
    return frames, part.at + own


def _repeats(before: Part, part: Part) -> bool:
    """Return whether a part begins with the frame that the previous one ended with."""
    return not before.inserted and before.key == part.key and before.last == part.first
