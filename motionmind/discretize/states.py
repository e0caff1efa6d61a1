"""StateSpace: every joint's states as orientations, and the way from orientations to states and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints, States
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.geometry import rotations as rot

# Two orientations that turn into each other by less than this many radians are one state.
SAME = 1e-5
# Cosines of half angles that differ by less than this are a tie. BLAS adds in an order of its own, and a score's
# angles often lie exactly midway between two states: without a margin the last bit would choose. It is far above
# rounding (1e-16) and below what sets two states apart (1 - cos(SAME / 2) = 1.25e-11).
_TIE = 1e-12
# Doubles in the largest block of cosines: 1 MB, so that it stays near the processor. Of 1/8 to 8 MB the fastest, 4 to 6
# times as fast as 2 MB and more.
_BLOCK = 1 << 17


@dataclass(frozen=True, eq=False)
class StateSpace:
    """The states of every joint: what an orientation is called, and what orientation a state stands for.

    The states of joint j are `centres[starts[j]:starts[j + 1]]`, so that all of them are one array, which a file
    can hold and memory can map.

    Attributes:
        names: the joints [J].
        centres: unit quaternions x, y, z, w [S_0 + ... + S_(J-1), 4], canonical sign, joint after joint.
        starts: where each joint's states begin in `centres` [J + 1], the last entry being their number.
        kind: the kind of discretization that made them, such as "codebook".
        tolerances: degrees [J] within which a state stands for an orientation. All kinds but the expert library
            keep every orientation they were fitted to within it; there, what lies further off is not in the
            vocabulary.
        labels: per joint [J] the names of its states [S_j], or nothing where nobody named them.
    """

    names: tuple[str, ...]
    centres: Floats
    starts: Ints
    kind: str
    tolerances: Floats
    labels: tuple[tuple[str, ...], ...] = ()

    def __post_init__(self) -> None:
        # asarray, not array: what is memory-mapped stays so.
        centres = np.asarray(self.centres, dtype=np.float64)
        starts = np.asarray(self.starts, dtype=np.int64)
        tolerances = np.asarray(self.tolerances, dtype=np.float64)
        labels = tuple(tuple(names) for names in self.labels) or ((),) * len(self.names)
        J = len(self.names)
        if J == 0 or len(set(self.names)) != J:
            raise MotionMindError("a state space needs joints, each named once")
        if starts.shape != (J + 1,) or starts[0] != 0 or np.any(np.diff(starts) < 1):
            raise MotionMindError(f"state space: starts must rise from 0 in {J} steps, a state a joint at least")
        if centres.shape != (starts[-1], 4) or tolerances.shape != (J,) or len(labels) != J:
            raise MotionMindError(
                f"state space: {J} joints with {starts[-1]} states need as many tolerances, labels and centres, "
                f"not {tolerances.shape}, {len(labels)} and {centres.shape}"
            )
        # Written so that a NaN fails too.
        if not np.all(np.abs(np.linalg.norm(centres, axis=-1) - 1.0) <= 1e-6):
            raise MotionMindError("state space: every centre must be a unit quaternion")
        if not np.all(tolerances > 0.0):
            raise MotionMindError("state space: tolerances must be positive degrees")
        for name, size, named in zip(self.names, np.diff(starts), labels, strict=True):
            if len(named) not in (0, size):
                raise MotionMindError(f"state space: {name} has {size} states but {len(named)} labels")
        for field, array in (("centres", centres), ("starts", starts), ("tolerances", tolerances)):
            view = array.view()
            view.setflags(write=False)
            object.__setattr__(self, field, view)
        object.__setattr__(self, "labels", labels)

    @classmethod
    def of_joints(
        cls,
        names: Sequence[str],
        centres: Sequence[Floats],
        *,
        kind: str,
        tolerances: Floats,
        labels: Sequence[Sequence[str]] = (),
    ) -> StateSpace:
        """The state space whose joint j has the states `centres[j]` [S_j, 4]."""
        starts = np.concatenate([[0], np.cumsum([len(c) for c in centres])])
        flat = rot.canonical(np.concatenate([np.asarray(c, dtype=np.float64) for c in centres]))
        return cls(tuple(names), flat, starts, kind, tolerances, tuple(tuple(named) for named in labels))

    @cached_property
    def sizes(self) -> Ints:
        """Number of states of each joint [J]."""
        return np.diff(self.starts)

    def __len__(self) -> int:
        return len(self.names)

    def index(self, joint: str) -> int:
        """Index of the joint called `joint`; SkeletonError names the joints there are."""
        if joint not in self.names:
            raise SkeletonError(f"no joint {joint!r} among the states; there are {', '.join(self.names)}")
        return self.names.index(joint)

    def of(self, joint: int | str) -> Floats:
        """The centres [S_j, 4] of a joint, by index or name."""
        j = self.index(joint) if isinstance(joint, str) else joint
        return self.centres[self.starts[j] : self.starts[j + 1]]

    def label(self, joint: int | str, state: int) -> str:
        """What people call a state: the library's name for it, or "state 17" where nobody gave one."""
        j = self.index(joint) if isinstance(joint, str) else joint
        if not 0 <= state < self.sizes[j]:
            raise MotionMindError(f"{self.names[j]} has states 0 to {self.sizes[j] - 1}, no state {state}")
        return self.labels[j][state] if self.labels[j] else f"state {state}"

    def assign(self, rotations: Floats) -> States:
        """The nearest state [N, J] of every orientation in `rotations` [N, J, 4]; ties go to the lowest index."""
        rotations = checked_rotations(self.names, rotations)
        states = np.empty(rotations.shape[:2], dtype=np.int32)
        for j in range(len(self)):
            states[:, j] = nearest(rotations[:, j], self.of(j))[0]
        return states

    def decode(self, states: NDArray[np.integer]) -> Floats:
        """The orientations [N, J, 4] that `states` [N, J] stand for; `assign` takes them back."""
        states = np.asarray(states)
        if states.ndim != 2 or states.shape[1] != len(self) or not np.issubdtype(states.dtype, np.integer):
            raise MotionMindError(f"states must be integers [N, {len(self)}], not {states.dtype} {list(states.shape)}")
        wrong = np.argwhere((states < 0) | (states >= self.sizes))
        if len(wrong):
            n, j = wrong[0]
            raise MotionMindError(
                f"posture {n}: {self.names[j]} has states 0 to {self.sizes[j] - 1}, no state {states[n, j]}"
            )
        return np.asarray(self.centres[self.starts[:-1] + states])

    def distance(self, rotations: Floats, states: NDArray[np.integer]) -> Floats:
        """Degrees [N, J] between `rotations` [N, J, 4] and the centres of `states` [N, J]."""
        rotations = checked_rotations(self.names, rotations)
        centres = self.decode(states)
        if len(centres) != len(rotations):
            raise MotionMindError(f"{len(rotations)} postures cannot be compared with {len(centres)} rows of states")
        return np.degrees(rot.angle(rotations, centres))


def nearest(rotations: Floats, centres: Floats, *, block: int = _BLOCK) -> tuple[States, Floats]:
    """For one joint: the index [N] of the nearest of `centres` [S, 4] to `rotations` [N, 4], and the cosine of
    half the angle to it [N].

    The angle between unit quaternions is 2 acos |a . b|, so the nearest is the largest |a . b|, which also makes
    q and -q the same. Ties go to the lowest index. At most `block` products are held at a time.
    """
    states = np.empty(len(rotations), dtype=np.int32)
    cosines = np.empty(len(rotations))
    transposed = np.ascontiguousarray(centres.T)
    rows = max(1, block // len(centres))
    for start in range(0, len(rotations), rows):
        part = slice(start, start + rows)
        dots = np.ascontiguousarray(rotations[part]) @ transposed
        np.abs(dots, out=dots)
        best = dots.max(axis=1)
        # argmax of a truth table is its first true entry.
        states[part] = np.argmax(dots >= (best - _TIE)[:, None], axis=1)
        cosines[part] = best
    return states, cosines


def distinct(centres: Floats) -> Floats:
    """`centres` [S, 4] without those that an earlier one equals, up to sign and `SAME` radians."""
    keep = np.ones(len(centres), dtype=bool)
    limit = np.cos(0.5 * SAME)
    rows = max(1, _BLOCK // max(1, len(centres)))
    for start in range(0, len(centres), rows):
        same = np.abs(centres[start : start + rows] @ centres.T) >= limit
        for n, row in enumerate(same, start):
            keep[n] = not np.any(row[:n] & keep[:n])
    return centres[keep]


def checked_rotations(names: Sequence[str], rotations: Floats) -> Floats:
    """`rotations` as float64 [N, J, 4], or a MotionMindError that names the joint and posture that is wrong."""
    rotations = np.asarray(rotations, dtype=np.float64)
    if rotations.ndim != 3 or rotations.shape[1:] != (len(names), 4):
        raise MotionMindError(f"rotations must have the shape [N, {len(names)}, 4], not {list(rotations.shape)}")
    # Written so that a NaN fails too.
    wrong = np.argwhere(~(np.abs(np.sum(rotations * rotations, axis=-1) - 1.0) <= 1e-5))
    if len(wrong):
        n, j = wrong[0]
        raise MotionMindError(f"posture {n}: the rotation of {names[j]} is {rotations[n, j]}, not a unit quaternion")
    return rotations
