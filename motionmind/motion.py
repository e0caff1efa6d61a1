"""Posture and Motion: arrays on a skeleton. A motion is a sequence of postures with their times."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.errors import MotionMindError
from motionmind.skeleton import Skeleton

Array = NDArray[np.float64]

FASTEST = 10_000.0  # frames a second; more is a slip of the keyboard, not a camera


@dataclass(frozen=True, eq=False)
class Posture:
    """One moment of a body.

    Attributes:
        skeleton: the body.
        rotations: unit quaternions x, y, z, w [J, 4], each local to the parent's frame.
        root: position of the root joint [3], metres.
    """

    skeleton: Skeleton
    rotations: Array
    root: Array

    def __post_init__(self) -> None:
        _settle(self, (len(self.skeleton), 4), (3,))

    def as_motion(self) -> Motion:
        """This posture as a motion of one frame at time 0."""
        return Motion(self.skeleton, self.rotations[None], self.root[None], np.zeros(1))


@dataclass(frozen=True, eq=False)
class Motion:
    """A sequence of postures.

    Attributes:
        skeleton: the body.
        rotations: unit quaternions x, y, z, w [T, J, 4], each local to the parent's frame.
        root: positions of the root joint [T, 3], metres.
        times: seconds, strictly increasing [T].
        name: what the clip is called.
        moves: times [M + 1] of the postures between which the moves of a tween were planned, seconds; empty for
            movement that no plan stands behind.
    """

    skeleton: Skeleton
    rotations: Array
    root: Array
    times: Array
    name: str = ""
    moves: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        times = np.array(self.times, dtype=np.float64)
        if times.ndim != 1 or len(times) == 0:
            raise MotionMindError(f"{self.name or 'motion'}: no frames")
        if not np.isfinite(times).all() or np.any(np.diff(times) <= 0.0):
            raise MotionMindError(f"{self.name or 'motion'}: times must be finite and increasing")
        _settle(self, (len(times), len(self.skeleton), 4), (len(times), 3))
        moves = np.array(self.moves, dtype=np.float64)
        if moves.ndim != 1 or not np.isfinite(moves).all() or np.any(np.diff(moves) <= 0.0):
            raise MotionMindError(f"{self.name or 'motion'}: the moves' times must be finite and increasing")
        for name, array in (("times", times), ("moves", moves)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.times)

    def posture(self, frame: int) -> Posture:
        """The posture at index `frame`, negative ones from the end; MotionMindError past either end."""
        if not -len(self) <= frame < len(self):
            name = self.name or "the motion"
            raise MotionMindError(f"{name} has frames 0 to {len(self) - 1}, no frame {frame}")
        return Posture(self.skeleton, self.rotations[frame], self.root[frame])

    def slice(self, start: int, stop: int) -> Motion:
        """The frames from `start` up to, not including, `stop`; times are kept as they are."""
        return replace(
            self,
            rotations=self.rotations[start:stop],
            root=self.root[start:stop],
            times=self.times[start:stop],
            moves=np.zeros(0),
        )

    @property
    def fps(self) -> float:
        """Frames per second, from the median step; 0 for a single frame."""
        return 0.0 if len(self) < 2 else float(1.0 / np.median(np.diff(self.times)))

    def resample(self, rate: float) -> Motion:
        """The motion at `rate` postures a second, from its first time on; rotations by slerp, root linear.

        Frames that fall on a frame of the source are that frame. A motion shorter than one step keeps its
        first posture. Jitter of the source's clock of up to a thousandth of a step does not lose the last one.
        """
        if not 0.0 < rate <= FASTEST:
            raise MotionMindError(
                f"a rate must be a positive number of postures a second, {FASTEST:g} at most, not {rate}"
            )
        if len(self) == 1:
            return self
        span = self.times[-1] - self.times[0]
        steps = int(np.floor(span * rate + 1e-3))
        times = self.times[0] + np.arange(steps + 1) / rate
        at = np.minimum(times, self.times[-1])
        after = np.clip(np.searchsorted(self.times, at, side="right"), 1, len(self) - 1)
        before = after - 1
        share = (at - self.times[before]) / (self.times[after] - self.times[before])
        return replace(
            self,
            rotations=rot.normalise(rot.slerp(self.rotations[before], self.rotations[after], share[:, None])),
            root=self.root[before] + share[:, None] * (self.root[after] - self.root[before]),
            times=times,
            moves=np.zeros(0),
        )


def _settle(thing: Posture | Motion, rotations: tuple[int, ...], root: tuple[int, ...]) -> None:
    """Check shapes and values at the door, then freeze the arrays: what is built is right from then on."""
    name = getattr(thing, "name", "") or type(thing).__name__.lower()
    for what, shape in (("rotations", rotations), ("root", root)):
        array = np.array(getattr(thing, what), dtype=np.float64)
        if array.shape != shape:
            raise MotionMindError(f"{name}: {what} must have the shape {shape}, not {array.shape}")
        if not np.isfinite(array).all():
            where = np.argwhere(~np.isfinite(array))[0]
            raise MotionMindError(f"{name}: {_place(thing, what, where)} is not a finite number")
        array.setflags(write=False)
        object.__setattr__(thing, what, array)
    length = np.linalg.norm(thing.rotations, axis=-1)
    if np.any(np.abs(length - 1.0) > 1e-6):
        where = np.argwhere(np.abs(length - 1.0) > 1e-6)[0]
        raise MotionMindError(
            f"{name}: {_place(thing, 'rotations', where)} has length {length[tuple(where)]:.6g}, not 1"
        )


def _place(thing: Posture | Motion, what: str, where: NDArray[np.intp]) -> str:
    moving = isinstance(thing, Motion)
    frame = f" in frame {where[0]}" if moving else ""
    if what == "root":
        return f"the root's position{frame}"
    return f"the rotation of {thing.skeleton.names[where[1 if moving else 0]]}{frame}"
