"""A corpus in memory: clips of postures on one skeleton, one after another, with where they come from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.errors import CorpusError
from motionmind.skeleton import Skeleton

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Facing = Literal["free", "stage"]

FACING = "facing"  # the lane of the body's turn about the vertical


@dataclass(frozen=True)
class Clip:
    """One unbroken stretch of movement: postures `start` to `stop - 1` of the corpus."""

    name: str
    start: int
    stop: int
    about: str = ""


@dataclass(frozen=True)
class Fault:
    """A joint that turns by `degrees` from one frame of a recording to the next, faster than a body can."""

    clip: str
    joint: str
    frame: int
    degrees: float


@dataclass(frozen=True, eq=False)
class Corpus:
    """Movement to learn from.

    Attributes:
        name: what the corpus is called.
        skeleton: the body; of several performers, the first one's proportions.
        clips: where each clip lies.
        rotations: local rotations of all postures [N, J, 4].
        root: positions of the root joint [N, 3], metres.
        times: seconds in the clip's own recording [N], increasing within a clip.
        facing: "stage" where the root's full orientation is its state, "free" where its turn about the vertical is
            taken out of it and is a lane of its own.
        rate: postures a second, None where they are keyframes with their own times.
        title: a line on what it is.
        author: who made it.
        source: where it comes from.
        licence: under which it may be used.
        faults: of the recordings.
    """

    name: str
    skeleton: Skeleton
    clips: tuple[Clip, ...]
    rotations: Floats
    root: Floats
    times: Floats
    facing: Facing
    rate: float | None = None
    title: str = ""
    author: str = ""
    source: str = ""
    licence: str = ""
    faults: tuple[Fault, ...] = ()

    def __post_init__(self) -> None:
        if len(self.rotations) == 0:
            raise CorpusError(f"corpus {self.name!r} has no postures")
        count = len(self.rotations)
        if (self.rotations.shape, self.root.shape, self.times.shape) != (
            (count, len(self.skeleton), 4),
            (count, 3),
            (count,),
        ):
            raise CorpusError(f"corpus {self.name!r}: rotations, root and times are not those of {count} postures")
        bounds = [(clip.start, clip.stop) for clip in self.clips]
        if [0, *(stop for _, stop in bounds)] != [*(start for start, _ in bounds), count]:
            raise CorpusError(f"corpus {self.name!r}: the clips do not follow one another from 0 to {count}")
        if self.facing not in ("free", "stage"):
            raise CorpusError(f"corpus {self.name!r}: facing must be 'free' or 'stage', not {self.facing!r}")
        if FACING in self.skeleton.names:
            raise CorpusError(f"corpus {self.name!r}: a joint cannot be called {FACING!r}; that is the body's turn")

    def __len__(self) -> int:
        return len(self.rotations)

    @cached_property
    def begins(self) -> Ints:
        """Postures from which a move leads to the next one in the same clip [M]."""
        return np.concatenate(
            [np.zeros(0, np.int64), *(np.arange(clip.start, clip.stop - 1) for clip in self.clips)]
        ).astype(np.int64)

    @cached_property
    def seconds(self) -> Floats:
        """Durations of those moves [M]."""
        return np.asarray(self.times[self.begins + 1] - self.times[self.begins])

    @cached_property
    def lanes(self) -> tuple[str, ...]:
        """What moves on its own [L]: the joints, then the facing where it is free."""
        return (*self.skeleton.names, FACING) if self.facing == "free" else self.skeleton.names

    @cached_property
    def lane_parents(self) -> Ints:
        """Parent lane of each lane [L], -1 for the root and the facing."""
        free = (-1,) if self.facing == "free" else ()
        return np.array((*self.skeleton.parents, *free), dtype=np.int64)

    def to_lanes(self, rotations: Floats) -> Floats:
        """Orientations of the lanes [..., L, 4] of postures with local rotations [..., J, 4]."""
        if self.facing == "stage":
            return rotations
        turn = rot.about_vertical(rot.heading(rotations[..., 0, :]))
        tilt = rot.inv_mul(turn, rotations[..., 0, :])
        return np.concatenate([tilt[..., None, :], rotations[..., 1:, :], turn[..., None, :]], axis=-2)

    def from_lanes(self, lanes: Floats) -> Floats:
        """Local rotations [..., J, 4] from orientations of the lanes [..., L, 4]; the inverse of `to_lanes`."""
        if self.facing == "stage":
            return lanes
        pelvis = rot.mul(lanes[..., -1, :], lanes[..., 0, :])
        return np.concatenate([pelvis[..., None, :], lanes[..., 1:-1, :]], axis=-2)

    @cached_property
    def _clip_of(self) -> NDArray[np.int32]:
        return np.repeat(np.arange(len(self.clips), dtype=np.int32), [clip.stop - clip.start for clip in self.clips])

    def where(self, posture: int) -> tuple[str, int]:
        """The clip that a posture is in and its number there."""
        clip = self.clips[self._clip_of[posture]]
        return clip.name, posture - clip.start
