"""A piece of movement, cut into postures, and its arrangement in another order.

A *chunk* is a run of postures in the piece's own order. An arrangement moves each chunk as a whole over the floor and,
if the piece may face anywhere, turns it about the vertical, so that it begins where the chunk before it ended. Each
step keeps its displacement relative to the body's heading.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from motionmind._cells import html_of
from motionmind._typing import Floats, Ints
from motionmind.arguments import as_integers, check_flag, check_text, check_type
from motionmind.body.motion import Insertion, Motion, Posture
from motionmind.body.rates import MAX_FPS, check_size
from motionmind.corpus.corpus import Facing
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.variation.arguments import check_number

_CLOCK_TOLERANCE_S = 1e-9
LONE_POSTURE_S = 1.0  # duration of the only posture of a piece
_HORIZONTAL = np.array([1.0, 0.0, 1.0])
_SAME_FACING_RAD = 1e-6  # rounding errors of postures that face the same way are smaller
_LEAD_S = 0.2  # of the piece's movement on either side of a transition
# Frames farther apart do not show how fast the piece passes them: a second between two positions may be spent mostly at
# rest. Between nearer keyframes the piece moves in a straight line, which gives its velocity.
_MAX_FRAME_GAP_S = 0.5 + 1e-6


class Arrangement(NamedTuple):
    """A piece's postures in another order.

    Attributes:
        motion: the movement.
        frames: the frame of the movement at which each posture of the order is [L].
    """

    motion: Motion
    frames: Ints


class Placement(NamedTuple):
    """A turn by `angle` radians about the vertical, then a move by `shift` [3] metres."""

    angle: float
    shift: Floats

    def turn(self, rotations: Floats) -> Floats:
        """Return local rotations [..., J, 4] with the root turned."""
        turned = rotations.copy()
        turned[..., 0, :] = rot.mul(rot.about_vertical(self.angle), rotations[..., 0, :])
        return turned

    def move(self, root: Floats) -> Floats:
        """Return root positions [..., 3], turned and moved, metres."""
        return np.asarray(rot.mul_vec(rot.about_vertical(self.angle), root) + self.shift)


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of movement, cut into postures.

    Attributes:
        motion: the piece, all its frames, from its first posture to its last.
        frames: the frame of each posture [N], increasing from 0.
        facing: "free" if the piece may face anywhere: each chunk continues in the heading of the one before it; "stage"
            if each posture keeps its orientation.
        composed: whether its postures were composed of several, so that each is a chunk by itself.

    >>> from motionmind import Engine, Piece
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> len(Piece.of(motion, rate=1.0))
    33
    """

    motion: Motion
    frames: Ints
    facing: Facing = "free"
    composed: bool = False

    def __post_init__(self) -> None:
        check_type("motion", self.motion, Motion)
        check_text("facing", self.facing)
        check_flag("composed", self.composed)
        frames = as_integers("frames", self.frames)
        last = len(self.motion) - 1
        if frames.ndim != 1 or len(frames) == 0 or (frames[0], frames[-1]) != (0, last) or (np.diff(frames) <= 0).any():
            raise MotionMindError(f"a piece's postures must be frames that increase from 0 to its last, {last}")
        if self.facing not in ("free", "stage"):
            raise MotionMindError(f"facing must be 'free' or 'stage', not {self.facing!r}")
        frames.setflags(write=False)
        object.__setattr__(self, "frames", frames)

    @classmethod
    def of(cls, motion: Motion, rate: float | None = None, facing: Facing = "free") -> Piece:
        """Cut a motion into postures.

        The piece ends at the last posture; a remainder of less than a step is dropped.

        Args:
            motion: the movement.
            rate: postures a second, each the frame nearest to its time; None for every frame.
            facing: see the class.

        Raises:
            MotionMindError: the rate or the facing is out of its range.
        """
        check_type("motion", motion, Motion)
        if rate is None:
            return cls(motion, np.arange(len(motion)), facing)
        if not 0.0 < check_number("rate", rate) <= MAX_FPS:
            raise MotionMindError(
                f"a rate must be a number of postures a second above 0, at most {MAX_FPS:g}, not {rate}"
            )
        own = motion.times
        last = np.floor((own[-1] - own[0]) * rate + 1e-3)  # the clock may jitter, as in Motion.resample
        check_size(last + 1.0, len(motion.skeleton), motion.name)
        wanted = own[0] + np.arange(last + 1) / rate
        after = np.searchsorted(own[:-1], wanted)  # the last frame comes after all that are earlier
        before = np.maximum(after - 1, 0)
        frames = np.unique(np.where(wanted - own[before] <= own[after] - wanted, before, after))
        return cls(motion.slice(0, int(frames[-1]) + 1), frames, facing)

    def __len__(self) -> int:
        return len(self.frames)

    def __repr__(self) -> str:
        return f"<Piece of {len(self)} postures, facing {self.facing}: {self.motion!r}>"

    def _repr_html_(self) -> str:
        return html_of(self)

    @cached_property
    def durations(self) -> Floats:
        """Seconds from each posture to the next one [N]; the last lasts as long as the one before it."""
        steps = np.diff(self.motion.times[self.frames])
        return np.append(steps, steps[-1:] if len(steps) else LONE_POSTURE_S)

    def is_seam(self, i: int, k: int) -> bool:
        """Return whether a step from posture i to posture k is a seam: neither the piece's own step nor a stay."""
        return k != i and (self.composed or k != i + 1)

    def chunks(self, order: Ints) -> tuple[Ints, Ints]:
        """Return the starts [C] and stops [C] of the chunks of an order of postures [L]."""
        leaps = np.flatnonzero((np.diff(order) != 1) | self.composed) + 1
        return np.concatenate([[0], leaps]), np.concatenate([leaps, [len(order)]])

    def ends(self, i: int, k: int) -> tuple[Posture, Posture]:
        """Return postures i and k above the origin and, if the facing is free, facing +Z."""
        return self._at_origin(i), self._at_origin(k)

    def around(self, i: int, k: int) -> tuple[Motion | None, Motion | None]:
        """Return the piece's movement up to posture i and from posture k, each placed as in `ends`.

        Each lasts 0.2 s, or to the next frame if that is farther; None if the next frame is missing or more than 0.5 s
        away, and for composed postures.
        """
        if self.composed:
            return None, None
        times, begin, end = self.motion.times, int(self.frames[i]), int(self.frames[k])
        first = min(int(np.searchsorted(times, times[begin] - _LEAD_S - _CLOCK_TOLERANCE_S)), begin - 1)
        last = max(int(np.searchsorted(times, times[end] + _LEAD_S + _CLOCK_TOLERANCE_S)), end + 2) - 1
        leads = first >= 0 and times[begin] - times[begin - 1] <= _MAX_FRAME_GAP_S
        follows = last < len(times) and times[end + 1] - times[end] <= _MAX_FRAME_GAP_S
        return (
            self._stretch_at_origin(first, begin + 1, i) if leads else None,
            self._stretch_at_origin(end, last + 1, k) if follows else None,
        )

    def _stretch_at_origin(self, first: int, stop: int, posture: int) -> Motion:
        """Return frames `first` to `stop` - 1, placed so that a posture among them is `_at_origin`."""
        own, place = self.motion.slice(first, stop), Placement(-self._headings[posture], np.zeros(3))
        root = place.move(own.root - self.motion.root[self.frames[posture]] * _HORIZONTAL)
        return replace(own, rotations=rot.normalise(place.turn(own.rotations)), root=root)

    def _at_origin(self, posture: int) -> Posture:
        own = self.motion.posture(int(self.frames[posture]))
        rotations = Placement(-self._headings[posture], np.zeros(3)).turn(own.rotations)
        return replace(own, rotations=rot.normalise(rotations), root=own.root * (0.0, 1.0, 0.0))

    @cached_property
    def _headings(self) -> Floats:
        """Heading of each posture [N], radians; 0 if postures keep their orientation."""
        if self.facing == "stage":
            return np.zeros(len(self))
        return rot.heading(self.motion.rotations[self.frames, 0])

    def _insertions_within(self, frames: slice) -> Iterator[Insertion]:
        """Yield the piece's own insertions that lie within a slice of its frames."""
        times = self.motion.times[frames]
        for mark in self.motion.insertions:
            if times[0] - _CLOCK_TOLERANCE_S <= mark.times[0] and mark.times[-1] <= times[-1] + _CLOCK_TOLERANCE_S:
                yield mark

    def arrange(self, order: Ints, insertions: Mapping[int, Motion]) -> Arrangement:
        """Put the piece's postures in another order.

        Where an insertion travels or turns from A to B, all that follows does so with it. The piece's own insertions
        stay marked if a chunk contains them whole.

        Args:
            order: numbers of postures [L].
            insertions: movement from the n-th posture of the order to the next, between their `ends`, by n; B may stand
                elsewhere. At a seam without an insertion, the next posture follows at once.
        """
        starts, stops = self.chunks(order)
        motion, parts = self.motion, Parts()
        place, clock = Placement(0.0, np.zeros(3)), float(motion.times[0] - motion.times[self.frames[order[0]]])
        for start, stop in zip(starts, stops, strict=True):
            first, last = order[start], order[stop - 1]
            chunk = slice(int(self.frames[first]), int(self.frames[last]) + 1)
            parts.frames.append(self.frames[order[start:stop]] - chunk.start + parts.count)
            marks = self._insertions_within(chunk)
            parts.add(motion.rotations[chunk], motion.root[chunk], motion.times[chunk], marks, place, clock)
            if stop == len(order):
                break
            end, heading = parts.root[-1][-1] * _HORIZONTAL, place.angle + self._headings[last]
            now, inserted = float(parts.times[-1][-1]), insertions.get(int(stop - 1))
            if inserted is None:
                now += float(self.durations[last])
            else:
                inner = slice(1, -1)  # the ends are the postures themselves
                rotations, root, times = inserted.rotations[inner], inserted.root[inner], inserted.times[inner]
                parts.add(rotations, root, times, inserted.insertions, Placement(heading, end), now)
                now += float(inserted.times[-1])
                end = end + rot.mul_vec(rot.about_vertical(np.asarray(heading)), inserted.root[-1] * _HORIZONTAL)
                heading += self._turn_in(inserted)
            place, clock = self._continue(order[stop], end, heading, now)
        return parts.join(motion)

    def _turn_in(self, inserted: Motion) -> float:
        """Return how far an insertion turns a piece of free facing, radians."""
        turn = float(rot.heading(inserted.rotations[-1, 0])) if self.facing == "free" else 0.0
        return turn if abs(turn) > _SAME_FACING_RAD else 0.0

    def _continue(self, posture: int, end: Floats, heading: float, now: float) -> tuple[Placement, float]:
        """Return the placement and clock offset of a chunk that begins with a posture at `end` [3] and time `now`."""
        angle = heading - self._headings[posture]
        begins = self.frames[posture]
        turned = rot.mul_vec(rot.about_vertical(angle), self.motion.root[begins] * _HORIZONTAL)
        return Placement(float(angle), end - turned), now - float(self.motion.times[begins])


@dataclass
class Parts:
    """The chunks and insertions of an arrangement, one after another; `count` frames so far."""

    count: int = 0
    rotations: list[Floats] = field(default_factory=list)
    root: list[Floats] = field(default_factory=list)
    times: list[Floats] = field(default_factory=list)
    insertions: list[Insertion] = field(default_factory=list)
    frames: list[Ints] = field(default_factory=list)

    def add(
        self,
        rotations: Floats,
        root: Floats,
        times: Floats,
        insertions: Iterable[Insertion],
        place: Placement,
        clock: float,
    ) -> None:
        """Add frames [F], placed on the floor and `clock` seconds later."""
        self.count += len(times)
        self.rotations.append(place.turn(rotations))
        self.root.append(place.move(root))
        self.times.append(times + clock)
        self.insertions.extend(replace(one, times=one.times + clock) for one in insertions)

    def join(self, motion: Motion) -> Arrangement:
        """Concatenate the parts into one movement."""
        arranged = replace(
            motion,
            rotations=np.concatenate(self.rotations),
            root=np.concatenate(self.root),
            times=np.concatenate(self.times),
            insertions=tuple(self.insertions),
            keyframed=motion.keyframed and not self.insertions,
        )
        return Arrangement(arranged, np.concatenate(self.frames))
