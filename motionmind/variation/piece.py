"""A piece of movement as postures that can follow one another in any order, and the movement that comes of an order.

What follows in the order as it does in the piece is a *chunk* and stays one movement: a chunk is set down whole, moved
over the floor and, where the piece may face anywhere, turned about the vertical. So each step's displacement stays what
it was in the body's heading, and nothing teleports: a chunk begins where the one before it ended.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.motion import FASTEST, Insertion, Motion, Posture
from motionmind.corpus.corpus import Facing
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.variation.arguments import number

_ROUNDING = 1e-9  # seconds
ALONE = 1.0  # seconds that a posture lasts where the piece has no other


class Arranged(NamedTuple):
    """A piece's postures in another order.

    Attributes:
        motion: the movement.
        frames: the frame of it that each posture of the order is [L].
    """

    motion: Motion
    frames: Ints


class _Place(NamedTuple):
    """Where a chunk is set down: turned by `angle` radians about the vertical, then moved by `shift` [3] metres."""

    angle: float
    shift: Floats

    def turn(self, rotations: Floats) -> Floats:
        """Local rotations [..., J, 4] with the root's turned."""
        turned = rotations.copy()
        turned[..., 0, :] = rot.mul(rot.about_vertical(self.angle), rotations[..., 0, :])
        return turned

    def move(self, root: Floats) -> Floats:
        """Positions [..., 3] of the root there."""
        return np.asarray(rot.mul_vec(rot.about_vertical(self.angle), root) + self.shift)


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of movement, cut into postures.

    Attributes:
        motion: the piece, all its frames, from its first posture to its last.
        frames: the frame that each posture is [N], from 0 on, increasing.
        facing: "free" where the piece may face anywhere, so that a chunk goes on in the heading in which the last one
            ended; "stage" where each posture keeps the orientation that it has.
    """

    motion: Motion
    frames: Ints
    facing: Facing = "free"

    def __post_init__(self) -> None:
        frames = np.array(self.frames, dtype=np.int64)
        last = len(self.motion) - 1
        if frames.ndim != 1 or len(frames) == 0 or (frames[0], frames[-1]) != (0, last) or (np.diff(frames) <= 0).any():
            raise MotionMindError(f"a piece's postures must be frames that increase from 0 to its last, {last}")
        if self.facing not in ("free", "stage"):
            raise MotionMindError(f"facing must be 'free' or 'stage', not {self.facing!r}")
        frames.setflags(write=False)
        object.__setattr__(self, "frames", frames)

    @classmethod
    def of(cls, motion: Motion, rate: float | None = None, facing: Facing = "free") -> Piece:
        """A motion as a piece with `rate` postures a second, each the frame nearest to its time, or with every frame.

        What is left after the last posture, less than a step, is not part of the piece.
        """
        if rate is None:
            return cls(motion, np.arange(len(motion)), facing)
        if not 0.0 < number("rate", rate) <= FASTEST:
            raise MotionMindError(
                f"a rate must be a number of postures a second above 0, at most {FASTEST:g}, not {rate}"
            )
        own = motion.times
        last = int((own[-1] - own[0]) * rate + 1e-3)  # the clock may jitter, as in Motion.resample
        wanted = own[0] + np.arange(last + 1) / rate
        after = np.searchsorted(own[:-1], wanted)  # the last frame comes after all that are earlier
        before = np.maximum(after - 1, 0)
        frames = np.unique(np.where(wanted - own[before] <= own[after] - wanted, before, after))
        return cls(motion.slice(0, int(frames[-1]) + 1), frames, facing)

    def __len__(self) -> int:
        return len(self.frames)

    @cached_property
    def lasting(self) -> Floats:
        """Seconds from each posture to the next one [N]; the last lasts as long as the one before it."""
        steps = np.diff(self.motion.times[self.frames])
        return np.append(steps, steps[-1:] if len(steps) else ALONE)

    def ends(self, i: int, k: int) -> tuple[Posture, Posture]:
        """Postures i and k as they stand where k follows on i: both over the origin, and, where the facing is free,
        both facing +Z."""
        return self._at_origin(i), self._at_origin(k)

    def _at_origin(self, posture: int) -> Posture:
        found = self.motion.posture(int(self.frames[posture]))
        rotations = _Place(-self._headings[posture], np.zeros(3)).turn(found.rotations)
        return replace(found, rotations=rot.normalise(rotations), root=found.root * np.array([0.0, 1.0, 0.0]))

    @cached_property
    def _headings(self) -> Floats:
        """Where each posture faces, radians [N]: 0 where it keeps its orientation, for then nothing is turned."""
        if self.facing == "stage":
            return np.zeros(len(self))
        return rot.heading(self.motion.rotations[self.frames, 0])

    def _marks(self, frames: slice) -> Iterator[Insertion]:
        """The piece's own insertions that lie wholly within some of its frames."""
        times = self.motion.times[frames]
        for mark in self.motion.insertions:
            if times[0] - _ROUNDING <= mark.times[0] and mark.times[-1] <= times[-1] + _ROUNDING:
                yield mark

    def arranged(self, order: Ints, insertions: Mapping[int, Motion]) -> Arranged:
        """The piece's postures in another order.

        Args:
            order: postures [L], any number of them.
            insertions: what leads from the n-th posture of the order to the next one, by n, from and to `ends`; where
                there is nothing, and the order leaves the piece's, the one posture just follows on the other.

        What the engine had put into the piece is marked where the whole of it comes.
        """
        leaps = np.flatnonzero(np.diff(order) != 1) + 1
        starts, stops = np.concatenate([[0], leaps]), np.concatenate([leaps, [len(order)]])
        rotations, root, times, frames, marks = [], [], [], [], []
        count, motion = 0, self.motion
        place, clock = _Place(0.0, np.zeros(3)), float(motion.times[0] - motion.times[self.frames[order[0]]])
        for start, stop in zip(starts, stops, strict=True):
            first, last = order[start], order[stop - 1]
            here = slice(int(self.frames[first]), int(self.frames[last]) + 1)
            rotations.append(place.turn(motion.rotations[here]))
            root.append(place.move(motion.root[here]))
            times.append(motion.times[here] + clock)
            marks += [replace(mark, times=mark.times + clock) for mark in self._marks(here)]
            frames.append(self.frames[order[start:stop]] - here.start + count)
            count += here.stop - here.start
            if stop == len(order):
                break
            end, heading = root[-1][-1] * np.array([1.0, 0.0, 1.0]), place.angle + self._headings[last]
            now, inserted = float(times[-1][-1]), insertions.get(int(stop - 1))
            if inserted is None:
                now += float(self.lasting[last])
            else:
                there, inner = _Place(heading, end), slice(1, -1)
                rotations.append(there.turn(inserted.rotations[inner]))
                root.append(there.move(inserted.root[inner]))
                times.append(inserted.times[inner] + now)
                count += len(inserted) - 2
                marks += [replace(mark, times=mark.times + now) for mark in inserted.insertions]
                now += float(inserted.times[-1])
            angle = heading - self._headings[order[stop]]
            begins = self.frames[order[stop]]
            turned = rot.mul_vec(rot.about_vertical(angle), motion.root[begins] * np.array([1.0, 0.0, 1.0]))
            place, clock = _Place(float(angle), end - turned), now - float(motion.times[begins])
        found = replace(
            motion,
            rotations=np.concatenate(rotations),
            root=np.concatenate(root),
            times=np.concatenate(times),
            insertions=tuple(marks),
        )
        return Arranged(found, np.concatenate(frames))
