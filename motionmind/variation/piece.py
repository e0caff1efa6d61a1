"""A piece of movement as postures that can follow one another in any order, and the movement of such an order.

Postures that follow one another as in the piece form a *chunk*, which stays one movement: a chunk is placed whole,
moved over the floor and, if the piece may face anywhere, turned about the vertical. So each step keeps its displacement
in the body's heading, and nothing teleports: a chunk begins where the one before it ended.
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
from motionmind.body.rates import FASTEST, check_size
from motionmind.corpus.corpus import Facing
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.variation.arguments import check_number

_ROUNDING = 1e-9  # seconds
ALONE = 1.0  # seconds that the only posture of a piece lasts
_VERTICAL = np.array([0.0, 1.0, 0.0])
_FLOOR = np.array([1.0, 0.0, 1.0])

_LEAD = 0.2  # seconds of the piece's movement on either side of a transition
# Seconds between frames beyond which they do not show how fast the piece passes one of them. Nearer keyframes do: the
# piece goes in a straight line from one to the next, so that is its velocity. Of a second between two positions nobody
# knows how it is spent, often mostly at rest.
_FARTHEST = 0.5 + 1e-6


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
        """Local rotations [..., J, 4], the root's turned."""
        turned = rotations.copy()
        turned[..., 0, :] = rot.mul(rot.about_vertical(self.angle), rotations[..., 0, :])
        return turned

    def move(self, root: Floats) -> Floats:
        """Positions [..., 3] of the root, turned and moved, metres."""
        return np.asarray(rot.mul_vec(rot.about_vertical(self.angle), root) + self.shift)


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of movement, cut into postures.

    Attributes:
        motion: the piece, all its frames, from its first posture to its last.
        frames: the frame of each posture [N], increasing from 0.
        facing: "free" if the piece may face anywhere: a chunk then continues in the heading in which the last one
            ended. "stage" if each posture keeps its own orientation.
        composed: whether nobody ever went from one of its postures to the next: each is a chunk by itself.

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

        The rest after the last posture, less than a step, is not part of the piece.

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
        if not 0.0 < check_number("rate", rate) <= FASTEST:
            raise MotionMindError(
                f"a rate must be a number of postures a second above 0, at most {FASTEST:g}, not {rate}"
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
        return np.append(steps, steps[-1:] if len(steps) else ALONE)

    def is_seam(self, i: int, k: int) -> bool:
        """Tell whether going from posture i to posture k is neither the piece's own step nor a stay."""
        return k != i and (self.composed or k != i + 1)

    def chunks(self, order: Ints) -> tuple[Ints, Ints]:
        """Return where the chunks of an order of postures [L] start [C], and where they stop [C]."""
        leaps = np.flatnonzero((np.diff(order) != 1) | self.composed) + 1
        return np.concatenate([[0], leaps]), np.concatenate([leaps, [len(order)]])

    def ends(self, i: int, k: int) -> tuple[Posture, Posture]:
        """Return postures i and k for a movement from one to the other: both above the origin and, if the facing is
        free, both facing +Z."""
        return self._at_origin(i), self._at_origin(k)

    def around(self, i: int, k: int) -> tuple[Motion | None, Motion | None]:
        """Return how the piece moves up to posture i and from posture k on, each placed as in `ends`.

        Each lasts a fifth of a second, or until the next frame if that is later; None where the piece has no frame, or
        none within half a second, and for composed postures.
        """
        if self.composed:
            return None, None
        times, begin, end = self.motion.times, int(self.frames[i]), int(self.frames[k])
        first = min(int(np.searchsorted(times, times[begin] - _LEAD - _ROUNDING)), begin - 1)
        last = max(int(np.searchsorted(times, times[end] + _LEAD + _ROUNDING)), end + 2) - 1
        leads = first >= 0 and times[begin] - times[begin - 1] <= _FARTHEST
        follows = last < len(times) and times[end + 1] - times[end] <= _FARTHEST
        return (
            self._stretch_at_origin(first, begin + 1, i) if leads else None,
            self._stretch_at_origin(end, last + 1, k) if follows else None,
        )

    def _stretch_at_origin(self, first: int, stop: int, posture: int) -> Motion:
        """Return the frames from `first` to before `stop`, placed as `_at_origin` places a posture among them."""
        own, place = self.motion.slice(first, stop), Placement(-self._headings[posture], np.zeros(3))
        root = place.move(own.root - self.motion.root[self.frames[posture]] * _FLOOR)
        return replace(own, rotations=rot.normalise(place.turn(own.rotations)), root=root)

    def _at_origin(self, posture: int) -> Posture:
        own = self.motion.posture(int(self.frames[posture]))
        rotations = Placement(-self._headings[posture], np.zeros(3)).turn(own.rotations)
        return replace(own, rotations=rot.normalise(rotations), root=own.root * _VERTICAL)

    @cached_property
    def _headings(self) -> Floats:
        """Heading of each posture [N], radians; 0 if postures keep their orientation: nothing is turned."""
        if self.facing == "stage":
            return np.zeros(len(self))
        return rot.heading(self.motion.rotations[self.frames, 0])

    def _insertions_within(self, frames: slice) -> Iterator[Insertion]:
        """The piece's own insertions that lie wholly within a slice of its frames."""
        times = self.motion.times[frames]
        for mark in self.motion.insertions:
            if times[0] - _ROUNDING <= mark.times[0] and mark.times[-1] <= times[-1] + _ROUNDING:
                yield mark

    def arrange(self, order: Ints, insertions: Mapping[int, Motion]) -> Arrangement:
        """Put the piece's postures in another order.

        The piece's own insertions stay marked where a chunk holds the whole of them.

        Args:
            order: numbers of postures [L], any number of them.
            insertions: the movement from the n-th posture of the order to the next, by n, from and to `ends`. Where the
                order leaves the piece's and there is no insertion, the next posture follows at once.
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
            end, heading = parts.root[-1][-1] * _FLOOR, place.angle + self._headings[last]
            now, inserted = float(parts.times[-1][-1]), insertions.get(int(stop - 1))
            if inserted is None:
                now += float(self.durations[last])
            else:
                inner = slice(1, -1)  # the ends are the postures themselves
                rotations, root, times = inserted.rotations[inner], inserted.root[inner], inserted.times[inner]
                parts.add(rotations, root, times, inserted.insertions, Placement(heading, end), now)
                now += float(inserted.times[-1])
            place, clock = self._continue(order[stop], end, heading, now)
        return parts.join(motion)

    def _continue(self, posture: int, end: Floats, heading: float, now: float) -> tuple[Placement, float]:
        """The placement and the clock of a chunk that begins with a posture at `end` [3], at the time `now`."""
        angle = heading - self._headings[posture]
        begins = self.frames[posture]
        turned = rot.mul_vec(rot.about_vertical(angle), self.motion.root[begins] * _FLOOR)
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
        """All of them as one movement."""
        arranged = replace(
            motion,
            rotations=np.concatenate(self.rotations),
            root=np.concatenate(self.root),
            times=np.concatenate(self.times),
            insertions=tuple(self.insertions),
            keyframed=motion.keyframed and not self.insertions,
        )
        return Arrangement(arranged, np.concatenate(self.frames))
