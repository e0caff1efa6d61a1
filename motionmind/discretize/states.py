"""The state space of a body: every joint's states as orientations, and the mapping between the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints, States
from motionmind.body.everyday import suggest_joint
from motionmind.display import displayed
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.geometry import rotations as rot

SAME_ROTATION_RAD = 1e-5  # closer orientations are one state
# Cosines of half angles that differ by less are a tie. BLAS adds in an unspecified order, and a score's angles often
# lie exactly midway between two states, so the last bit would decide without a margin. The margin is far
# above rounding (1e-16) and below the difference between distinct states (1 - cos(SAME_ROTATION_RAD / 2) = 1.25e-11).
_TIE_RATIO = 1e-12
# Size of a block of cosines: 1 MB of doubles, which stays in the processor's cache. It is the fastest of 1/8 to 8 MB,
# and 4 to 6 times as fast as 2 MB and more.
_N_COSINES_PER_BLOCK = 1 << 17


@dataclass(frozen=True, eq=False)
class StateSpace:
    """The states of every joint, each represented by an orientation, its centre.

    The states of joint j are `centres[starts[j]:starts[j + 1]]`: all states are one array, which can be memory-mapped
    from a file.

    Attributes:
        names: the joints [J].
        centres: unit quaternions x, y, z, w [S_0 + ... + S_(J-1), 4], canonical sign, joint after joint.
        starts: index of each joint's first state in `centres` [J + 1]; the last entry is the number of states.
        kind: the kind of discretization that made them, such as "codebook".
        tolerances: greatest angle between an orientation and its state's centre [J], degrees. It holds for every
            orientation that the states were fitted to, except for expert libraries: there, orientations farther off are
            not in the vocabulary.
        labels: names of the states [S_j] of each joint [J]; empty for a joint whose states have no names.

    >>> import numpy as np
    >>> from motionmind.discretize import StateSpace
    >>> centres = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    >>> StateSpace(("hip", "knee"), centres, np.array([0, 1, 2]), "codebook", np.array([15.0, 15.0]))
    <StateSpace by codebook: joints 2, states 2>
    """

    names: tuple[str, ...]
    centres: Floats
    starts: Ints
    kind: str
    tolerances: Floats
    labels: tuple[tuple[str, ...], ...] = ()

    def __repr__(self) -> str:
        return f"<StateSpace by {displayed(self.kind)}: joints {len(self.names)}, states {len(self.centres)}>"

    def __post_init__(self) -> None:
        # asarray, not array: memory-mapped arrays stay memory-mapped.
        centres = np.asarray(self.centres, dtype=np.float64)
        starts = np.asarray(self.starts, dtype=np.int64)
        tolerances = np.asarray(self.tolerances, dtype=np.float64)
        labels = tuple(tuple(names) for names in self.labels) or ((),) * len(self.names)
        J = len(self.names)
        if J == 0 or len(set(self.names)) != J:
            raise MotionMindError("a state space needs at least one joint, and distinct joint names")
        if starts.shape != (J + 1,) or starts[0] != 0 or np.any(np.diff(starts) < 1):
            raise MotionMindError(f"state space: starts must rise from 0 in {J} steps, by at least one state each")
        if centres.shape != (starts[-1], 4) or tolerances.shape != (J,) or len(labels) != J:
            raise MotionMindError(
                f"state space: {J} joints with {starts[-1]} states need tolerances [{J}], {J} tuples of labels "
                f"and centres [{starts[-1]}, 4], not {list(tolerances.shape)}, {len(labels)} and {list(centres.shape)}"
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
        """Make a state space from the centres of each joint.

        Args:
            names: names of the joints [J].
            centres: unit quaternions of each joint's states, [J] arrays [S_j, 4].
            kind: the kind of discretization.
            tolerances: degrees [J].
            labels: names of each joint's states, as in the class.

        Raises:
            MotionMindError: the arguments do not fit together.
        """
        starts = np.concatenate([[0], np.cumsum([len(c) for c in centres])])
        flat = rot.canonical(np.concatenate([np.asarray(c, dtype=np.float64) for c in centres]))
        return cls(tuple(names), flat, starts, kind, tolerances, tuple(tuple(named) for named in labels))

    @classmethod
    def joined(cls, spaces: Sequence[StateSpace]) -> StateSpace:
        """Concatenate one or more state spaces of the same kind, on different joints."""
        starts = np.concatenate([[0], np.cumsum(np.concatenate([space.sizes for space in spaces]))])
        return cls(
            tuple(name for space in spaces for name in space.names),
            np.concatenate([space.centres for space in spaces]),
            starts,
            spaces[0].kind,
            np.concatenate([space.tolerances for space in spaces]),
            tuple(labels for space in spaces for labels in space.labels),
        )

    def alone(self, joint: int) -> StateSpace:
        """Return the states of one joint as a state space."""
        return StateSpace.of_joints(
            [self.names[joint]],
            [self.of(joint)],
            kind=self.kind,
            tolerances=self.tolerances[[joint]],
            labels=[self.labels[joint]],
        )

    @cached_property
    def sizes(self) -> Ints:
        """Number of states of each joint [J]."""
        return np.diff(self.starts)

    def __len__(self) -> int:
        return len(self.names)

    def index(self, joint: str) -> int:
        """Return the index of the joint called `joint`; a SkeletonError lists the joints if there is none."""
        if joint not in self.names:
            raise SkeletonError(f"no joint {joint!r} among the states{suggest_joint(joint, self.names)}")
        return self.names.index(joint)

    def of(self, joint: int | str) -> Floats:
        """Return the centres [S_j, 4] of a joint, by index or name."""
        j = self.index(joint) if isinstance(joint, str) else joint
        return self.centres[self.starts[j] : self.starts[j + 1]]

    def label(self, joint: int | str, state: int) -> str:
        """Return the label of a state, or "state 17" if it has none; MotionMindError if there is no such state."""
        j = self.index(joint) if isinstance(joint, str) else joint
        if not 0 <= state < self.sizes[j]:
            raise MotionMindError(f"{self.names[j]} has states 0 to {self.sizes[j] - 1}, no state {state}")
        return self.labels[j][state] if self.labels[j] else f"state {state}"

    def assign(self, rotations: Floats) -> States:
        """Return the nearest state [N, J] of every orientation [N, J, 4]; ties go to the lowest index.

        Raises:
            MotionMindError: the shape is wrong, or a quaternion is not a unit quaternion.
        """
        rotations = checked_rotations(self.names, rotations)
        states = np.empty(rotations.shape[:2], dtype=np.int32)
        for j in range(len(self)):
            states[:, j] = nearest(rotations[:, j], self.of(j))[0]
        return states

    def decode(self, states: NDArray[np.integer]) -> Floats:
        """Return the centres [N, J, 4] of `states` [N, J]; `assign` is the inverse.

        Raises:
            MotionMindError: the shape is wrong, or there is no such state.
        """
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
        """Return the angles [N, J], degrees, between `rotations` [N, J, 4] and the centres of `states` [N, J]."""
        rotations = checked_rotations(self.names, rotations)
        centres = self.decode(states)
        if len(centres) != len(rotations):
            raise MotionMindError(f"{len(rotations)} postures cannot be compared with {len(centres)} rows of states")
        return np.degrees(rot.angle(rotations, centres))


def nearest(rotations: Floats, centres: Floats, *, block: int = _N_COSINES_PER_BLOCK) -> tuple[States, Floats]:
    """Find the nearest state of each orientation of one joint; ties go to the lowest index.

    The angle between unit quaternions a and b is 2 acos |a . b|, so the nearest centre has the largest |a . b|, which
    also makes q and -q the same.

    Args:
        rotations: orientations of the joint [N, 4].
        centres: orientations of its states [S, 4].
        block: number of products held in memory at a time.

    Returns:
        The index of the nearest state [N], and the cosine of half the angle to it [N].
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
        # argmax of booleans is the first true entry.
        states[part] = np.argmax(dots >= (best - _TIE_RATIO)[:, None], axis=1)
        cosines[part] = best
    return states, cosines


def distinct(centres: Floats) -> Floats:
    """Return `centres` [S, 4] without duplicates of an earlier one, up to sign and `SAME_ROTATION_RAD`."""
    keep = np.ones(len(centres), dtype=bool)
    limit = np.cos(0.5 * SAME_ROTATION_RAD)
    rows = max(1, _N_COSINES_PER_BLOCK // max(1, len(centres)))
    for start in range(0, len(centres), rows):
        same = np.abs(centres[start : start + rows] @ centres.T) >= limit
        for n, row in enumerate(same, start):
            keep[n] = not np.any(row[:n] & keep[:n])
    return centres[keep]


def checked_rotations(names: Sequence[str], rotations: Floats) -> Floats:
    """Return `rotations` as float64 [N, J, 4].

    Raises:
        MotionMindError: the shape is wrong, or a quaternion is not a unit quaternion; the message names its posture and
            joint.
    """
    rotations = np.asarray(rotations, dtype=np.float64)
    if rotations.ndim != 3 or rotations.shape[1:] != (len(names), 4):
        raise MotionMindError(f"rotations must have the shape [N, {len(names)}, 4], not {list(rotations.shape)}")
    # Written so that a NaN fails too.
    wrong = np.argwhere(~(np.abs(np.sum(rotations * rotations, axis=-1) - 1.0) <= 1e-5))
    if len(wrong):
        n, j = wrong[0]
        raise MotionMindError(f"posture {n}: the rotation of {names[j]} is {rotations[n, j]}, not a unit quaternion")
    return rotations
