"""Posture, Motion and Velocity: arrays on a skeleton. A motion is a sequence of postures with their times.

A motion records which of its stretches the engine made: each is an `Insertion`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from motionmind._cells import html_of
from motionmind._typing import Bools, Floats
from motionmind.arguments import (
    as_floats,
    check_flag,
    check_integer,
    check_items,
    check_mapping,
    check_real,
    check_text,
    check_type,
)
from motionmind.body.frozen import freeze_checked
from motionmind.body.rates import FILM_FPS, MAX_FPS, check_size
from motionmind.body.skeleton import Skeleton
from motionmind.body.tables import data_frame, data_set
from motionmind.credits.credit import Credit, add_up, check_shares
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

SAME_TIME_S = 1e-6  # times no further apart count as equal
# Time over which a line is fitted for a velocity. In a dancer's recordings, at 30 and 120 frames a second, this time
# fits the movement on both sides of its end best: a shorter one has more noise, a longer one is out of date.
VELOCITY_SPAN_S = 1.0 / 15.0


@dataclass(frozen=True, eq=False)
class Posture:
    """A posture of a body.

    Attributes:
        skeleton: the body.
        rotations: unit quaternions x, y, z, w [J, 4], each local to the parent's frame.
        root: position of the root joint [3], metres.
        recorded: credits of the movement that it was taken from, as in Motion.

    >>> import numpy as np
    >>> from motionmind import Posture, human23
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> posture.skeleton.name
    'human23'
    """

    skeleton: Skeleton
    rotations: Floats
    root: Floats
    recorded: tuple[Credit, ...] = ()

    def __post_init__(self) -> None:
        check_type("skeleton", self.skeleton, Skeleton)
        freeze_checked(self, (len(self.skeleton), 4), (3,))
        check_items("recorded", self.recorded, "credits", Credit)
        check_shares(self.recorded)

    def __repr__(self) -> str:
        x, y, z = self.root
        return f"<Posture on {displayed(self.skeleton.name)}, root at {x:.2f}, {y:.2f}, {z:.2f} m>"

    def _repr_html_(self) -> str:
        return html_of(self)

    def as_motion(self) -> Motion:
        """Return this posture as a motion of one frame at time 0."""
        return Motion(self.skeleton, self.rotations[None], self.root[None], np.zeros(1), recorded=self.recorded)


@dataclass(frozen=True, eq=False)
class Insertion:
    """A stretch of movement that the engine inserted between two postures, A and B.

    Attributes:
        times: times [M + 1] of the postures that its M moves join, seconds; the first is A's, the last B's.
        bridged: moves of joints that no corpus attests: the joint's name, and the index of the move.
        credits: credits of the movement that it is made of; empty if unknown, or if nothing moves.

    >>> import numpy as np
    >>> from motionmind import Insertion
    >>> Insertion(np.array([0.0, 0.4, 0.8]), bridged=(("left_hip", 1),)).bridged
    (('left_hip', 1),)
    """

    times: Floats
    bridged: tuple[tuple[str, int], ...] = ()
    credits: tuple[Credit, ...] = ()

    def __post_init__(self) -> None:
        times = as_floats("times", self.times)
        check_items("bridged", self.bridged, "pairs of a joint's name and a move", tuple)
        check_items("credits", self.credits, "credits", Credit)
        check_shares(self.credits)
        if times.ndim != 1 or len(times) == 0 or not np.isfinite(times).all() or np.any(np.diff(times) <= 0.0):
            raise MotionMindError("an insertion's times must be finite and increasing, one at least")
        for joint, move in self.bridged:
            if not 0 <= move < len(times) - 1:
                raise MotionMindError(f"an insertion of {len(times) - 1} moves has no move {move}, bridged by {joint}")
        times.setflags(write=False)
        object.__setattr__(self, "times", times)

    def __repr__(self) -> str:
        start, end = self.times[[0, -1]]
        return f"<Insertion from {start:.2f} to {end:.2f} s: moves {len(self.times) - 1}, bridged {len(self.bridged)}>"

    def renamed(self, joints: Mapping[str, str]) -> Insertion:
        """Return the same insertion with joints renamed by `joints` (old -> new); joints not in it are left out."""
        check_mapping("joints", joints)
        return replace(self, bridged=tuple((joints[joint], move) for joint, move in self.bridged if joint in joints))


@dataclass(frozen=True, eq=False)
class Motion:
    """A sequence of postures.

    Attributes:
        skeleton: the body.
        rotations: unit quaternions x, y, z, w [T, J, 4], each local to the parent's frame.
        root: positions of the root joint [T, 3], metres.
        times: seconds, strictly increasing [T].
        name: the clip's name.
        insertions: the stretches that the engine made, in order of time; empty if all movement is recorded.
        keyframed: whether each frame is a posture that someone chose, as in a score; False for frames of a recording,
            and for movement between keyframes.
        recorded: credits of the movement that the engine did not make, in shares that sum to 1; empty if only its name
            is known.
        rate: frames per second that a file states, or that somebody chose; 0 if only `times` show it. Files that record
            a rate have it from here if there is one frame.

    >>> import numpy as np
    >>> from motionmind import Motion, Posture, human23
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> motion = Motion(human23(), np.stack([at_rest] * 3), np.zeros((3, 3)), np.array([0.0, 0.5, 1.0]))
    >>> len(motion), len(motion.resample(10.0)), motion.positions().shape
    (3, 11, (3, 23, 3))
    """

    skeleton: Skeleton
    rotations: Floats
    root: Floats
    times: Floats
    name: str = ""
    insertions: tuple[Insertion, ...] = ()
    keyframed: bool = False
    recorded: tuple[Credit, ...] = ()
    rate: float = 0.0

    def __post_init__(self) -> None:
        check_type("skeleton", self.skeleton, Skeleton)
        check_text("name", self.name)
        check_real("rate", self.rate)
        if not 0.0 <= self.rate < np.inf:
            raise MotionMindError(f"rate must be a number of frames a second, 0 if unknown, not {self.rate}")
        check_items("insertions", self.insertions, "insertions", Insertion)
        check_flag("keyframed", self.keyframed)
        check_items("recorded", self.recorded, "credits", Credit)
        check_shares(self.recorded)
        times = as_floats("times", self.times)
        if times.ndim != 1 or len(times) == 0:
            raise MotionMindError(f"{self.name or 'motion'}: no frames")
        if not np.isfinite(times).all() or np.any(np.diff(times) <= 0.0):
            raise MotionMindError(f"{self.name or 'motion'}: times must be finite and increasing")
        freeze_checked(self, (len(times), len(self.skeleton), 4), (len(times), 3))
        times.setflags(write=False)
        object.__setattr__(self, "times", times)
        # A file's name may hold bytes that are not text, which no format can write.
        object.__setattr__(self, "name", self.name.encode("utf-8", "replace").decode())
        for before, after in pairwise(self.insertions):
            if after.times[0] < before.times[-1] - SAME_TIME_S:
                raise MotionMindError(f"{self.name or 'motion'}: insertions must follow one another")
        for joint, _ in (bridge for insertion in self.insertions for bridge in insertion.bridged):
            if joint not in self.skeleton.names:
                raise MotionMindError(f"{self.name or 'motion'}: {self.skeleton.name} has no joint {joint!r} to bridge")

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        lasts = self.times[-1] - self.times[0]
        name, body = displayed(self.name or "without a name"), displayed(self.skeleton.name)
        return f"<Motion {name} on {body}: frames {len(self)} in {lasts:.2f} s, insertions {len(self.insertions)}>"

    def _repr_html_(self) -> str:
        return html_of(self)

    def posture(self, frame: int) -> Posture:
        """Return the posture at index `frame`; negative indices count from the end.

        Raises:
            MotionMindError: there is no such frame; the message gives the range.
        """
        check_integer("frame", frame)
        if not -len(self) <= frame < len(self):
            name = self.name or "the motion"
            raise MotionMindError(f"{name} has frames 0 to {len(self) - 1}, no frame {frame}")
        recorded = () if self.insertions and self.inserted()[frame] else self.recorded
        return Posture(self.skeleton, self.rotations[frame], self.root[frame], recorded)

    def slice(self, start: int, stop: int) -> Motion:
        """Return the frames from `start` up to, not including, `stop`, at unchanged times."""
        check_integer("start", start)
        check_integer("stop", stop)
        part = replace(
            self,
            rotations=self.rotations[start:stop],
            root=self.root[start:stop],
            times=self.times[start:stop],
            insertions=(),
        )
        if len(part) == 1 and not part.rate and self.fps >= FILM_FPS:
            part = replace(part, rate=self.fps)
        first, last = part.times[0], part.times[-1]
        kept = tuple(one for one in self.insertions if one.times[-1] >= first and one.times[0] <= last)
        return replace(part, insertions=kept) if kept else part

    def inserted(self) -> Bools:
        """Return whether the engine made each frame [T]: the frames between the A and the B of an insertion."""
        found = np.zeros(len(self), dtype=bool)
        for one in self.insertions:
            found |= (self.times > one.times[0] + SAME_TIME_S) & (self.times < one.times[-1] - SAME_TIME_S)
        return found

    def bridged(self) -> Bools:
        """Return whether each joint, in each frame [T, J], is within a move that no corpus attests."""
        found = np.zeros((len(self), len(self.skeleton)), dtype=bool)
        for one in self.insertions:
            for joint, move in one.bridged:
                start, end = one.times[move : move + 2]
                found[:, self.skeleton.index(joint)] |= (self.times > start - SAME_TIME_S) & (
                    self.times < end + SAME_TIME_S
                )
        return found & self.inserted()[:, None]

    @property
    def credits(self) -> tuple[Credit, ...]:
        """Shares of time by clip: insertions by their credits, all else by `own_credits`.

        Empty for an insertion that lasts no time.
        """
        start, end = float(self.times[0]), float(self.times[-1])
        if start == end:
            return () if self.insertions else self.own_credits
        shares, rest = [], end - start
        for one in self.insertions:
            seconds = float(min(one.times[-1], end) - max(one.times[0], start))
            if seconds > SAME_TIME_S:
                rest -= seconds
                shares += [replace(credit, share=credit.share * seconds) for credit in one.credits or (Credit(1.0),)]
        rest = rest if rest > SAME_TIME_S else 0.0
        return add_up([*shares, *(replace(credit, share=credit.share * rest) for credit in self.own_credits)])

    @property
    def own_credits(self) -> tuple[Credit, ...]:
        """Credits of the movement that the engine did not make: `recorded`, or the motion's name."""
        return self.recorded or (Credit(1.0, self.name or "movement"),)

    @cached_property
    def fps(self) -> float:
        """Frames per second, from the median step; 0 for a single frame."""
        return 0.0 if len(self) < 2 else float(1.0 / np.median(np.diff(self.times)))

    @property
    def is_even(self) -> bool:
        """Whether the frames are evenly spaced in time, to a thousandth of a step."""
        steps = self.times - np.linspace(self.times[0], self.times[-1], len(self))
        length = float(self.times[-1] - self.times[0]) / max(len(self) - 1, 1)
        return bool(np.abs(steps).max() <= 1e-3 * length)

    def resample(self, rate: float) -> Motion:
        """Return the motion at `rate` postures a second, from its first time on; rotations by slerp, root linearly.

        A frame at the time of a source frame equals that frame. A motion shorter than one step keeps its first posture.
        The last posture survives jitter of the source's clock of up to a thousandth of a step.

        Args:
            rate: postures a second, at most MAX_FPS.

        Raises:
            MotionMindError: the rate is out of range, or gives too many frames (as for `at`).
        """
        _check_rate(rate)
        span = self.times[-1] - self.times[0]
        steps = np.floor(span * rate + 1e-3)
        self._check_size(steps + 1.0)
        return replace(self.at(self.times[0] + np.arange(steps + 1) / rate), rate=rate)

    def stretch_to(self, rate: float) -> Motion:
        """Return the motion at `rate` postures a second, stretched so that the last frame is the last posture.

        The new duration is the nearest whole number of steps, at least one. Insertions stretch with the motion. A
        single frame stays as it is.

        Args:
            rate: postures a second, at most MAX_FPS.

        Raises:
            MotionMindError: as for `resample`.

        >>> import numpy as np
        >>> from motionmind import Motion, human23
        >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (2, 23, 1))
        >>> len(Motion(human23(), at_rest, np.zeros((2, 3)), np.array([0.0, 2.7])).stretch_to(24.0))
        66
        """
        _check_rate(rate)
        if len(self) == 1:
            return replace(self, rate=rate)
        start, span = self.times[0], self.times[-1] - self.times[0]
        steps = max(1.0, float(np.round(span * rate)))
        self._check_size(steps + 1.0)
        stretch = steps / (span * rate)
        sampled = self.at(start + span * np.arange(steps + 1) / steps)
        insertions = tuple(replace(one, times=start + stretch * (one.times - start)) for one in self.insertions)
        return replace(sampled, times=start + np.arange(steps + 1) / rate, insertions=insertions, rate=rate)

    def _check_size(self, frames: float) -> None:
        """Check the size of a result of `frames` frames; always allow up to twice as many as this motion has."""
        if frames > 2.0 * len(self):
            check_size(frames, len(self.skeleton), self.name)

    def at(self, times: Floats) -> Motion:
        """Return the motion at increasing `times` [N], seconds: rotations by slerp, root linearly; still outside it.

        Raises:
            MotionMindError: the result is too large (`check_size`), and has more than twice as many frames.
        """
        times = as_floats("times", times)
        self._check_size(len(times))
        if len(self) == 1:
            frames = np.zeros(len(times), dtype=int)
            return replace(
                self, rotations=self.rotations[frames], root=self.root[frames], times=times, keyframed=False, rate=0.0
            )
        after = np.clip(np.searchsorted(self.times, times, side="right"), 1, len(self) - 1)
        before = after - 1
        share = ((times - self.times[before]) / (self.times[after] - self.times[before])).clip(0.0, 1.0)
        rotations = np.empty((len(times), len(self.skeleton), 4))
        for start in range(0, len(times), 4096):  # intermediate results take several times the memory of the result
            part = slice(start, start + 4096)
            ends = self.rotations[before[part]], self.rotations[after[part]]
            rotations[part] = rot.normalise(rot.slerp(*ends, share[part, None]))
        return replace(
            self,
            rotations=rotations,
            root=self.root[before] + share[:, None] * (self.root[after] - self.root[before]),
            times=times,
            keyframed=False,
            rate=0.0,
        )

    def positions(self) -> Floats:
        """Return the joints' positions [T, J, 3], metres, by forward kinematics."""
        return self.skeleton.positions(self.rotations, self.root)

    def to_dataframe(self) -> pd.DataFrame:
        """Return the movement as a pandas table: one row per frame, indexed by time in seconds.

        Columns are pairs of a joint and a value: `x`, `y` and `z` are the joint's position, in metres; `qx`, `qy`, `qz`
        and `qw` its rotation, local to its parent; `degrees` its angle from rest, 0 to 180.
        `table["left_knee", "degrees"]` is one curve; `table.xs("degrees", axis=1, level="value")` has the curves of all
        joints.

        Raises:
            MotionMindError: pandas is not installed.
        """
        return data_frame(self.skeleton.names, self.times, self.positions(), self.rotations, self._about())

    def to_xarray(self) -> xr.Dataset:
        """Return the movement as an xarray data set.

        Its variables are `position` (time, joint, axis), metres; `rotation` (time, joint, coefficient), unit
        quaternions x, y, z, w, local to the parent; `turned` (time, joint), degrees from rest, 0 to 180; and `inserted`
        (time), whether the engine made the frame.

        Raises:
            MotionMindError: xarray is not installed.
        """
        names, about = self.skeleton.names, self._about()
        return data_set(names, self.times, self.positions(), self.rotations, self.inserted(), about)

    def _about(self) -> dict[str, str]:
        return {"name": self.name, "skeleton": self.skeleton.name}


def _check_rate(rate: float) -> None:
    check_real("rate", rate)
    if not 0.0 < rate <= MAX_FPS:
        raise MotionMindError(f"a rate must be a positive number of postures a second, {MAX_FPS:g} at most, not {rate}")


@dataclass(frozen=True, eq=False)
class Velocity:
    """The velocity with which a body passes a posture.

    Attributes:
        rotations: angular velocities of the joints [J, 3], radians a second, each in the joint's own frame: after a
            short time dt the joint's rotation is `q exp(dt rotations)`.
        root: velocity of the root joint [3], metres a second, in the world's axes.

    >>> import numpy as np
    >>> from motionmind import Motion, Velocity, human23
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (2, 23, 1))
    >>> rising = Motion(human23(), at_rest, np.array([[0.0, 1.0, 0.0], [0.0, 1.1, 0.0]]), np.array([0.0, 0.1]))
    >>> Velocity.at_end(rising).root.round(6)
    array([0., 1., 0.])
    """

    rotations: Floats
    root: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotations", as_floats("rotations", self.rotations))
        object.__setattr__(self, "root", as_floats("root", self.root))

    @classmethod
    def at_start(cls, motion: Motion) -> Velocity:
        """Return the velocity at the start of a motion; see `at_end`."""
        check_type("motion", motion, Motion)
        return cls._about(motion, 0, motion.times <= motion.times[0] + VELOCITY_SPAN_S + SAME_TIME_S, 1)

    @classmethod
    def at_end(cls, motion: Motion) -> Velocity:
        """Return the velocity at the end of a motion.

        It is the slope of the least-squares line through the last frame, fitted to the frames of the last 1/15 s, or to
        the last but one if that is earlier. Rotations are taken as rotation vectors from the last frame.

        Raises:
            MotionMindError: there is only one frame.
        """
        check_type("motion", motion, Motion)
        return cls._about(motion, -1, motion.times >= motion.times[-1] - VELOCITY_SPAN_S - SAME_TIME_S, -2)

    @classmethod
    def _about(cls, motion: Motion, end: int, near: Bools, neighbour: int) -> Velocity:
        """Return the slope at the frame `end`, from a motion's frames `near` it [T] and the frame next to it."""
        if len(motion) < 2:
            raise MotionMindError(f"{motion.name or 'the motion'} has one frame, which shows no velocity: two at least")
        near[neighbour] = True
        times = motion.times[near] - motion.times[end]
        weights = times / (times @ times)
        turned = rot.log(rot.inv_mul(motion.rotations[end], motion.rotations[near]))
        return cls(np.tensordot(weights, turned, axes=1), weights @ (motion.root[near] - motion.root[end]))
