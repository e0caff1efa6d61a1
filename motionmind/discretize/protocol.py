"""The protocol of all discretizations, and the per-joint settings that they share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_real
from motionmind.body.everyday import suggest_joint
from motionmind.discretize.states import StateSpace, checked_rotations
from motionmind.errors import MotionMindError, SkeletonError

SIDE_PREFIXES = ("left_", "right_")


@runtime_checkable
class Discretization(Protocol):
    """A way to divide each joint's orientations into states.

    Packages add a kind by an entry point in `motionmind.discretizations`: a callable that makes one from `tolerance`
    and `per_joint`, in degrees, or from the values that `to_spec` wrote.

    >>> from motionmind.discretize import Discretization, make_discretization
    >>> isinstance(make_discretization("codebook"), Discretization)
    True
    """

    @property
    def kind(self) -> str:
        """The name of the kind, such as "codebook"."""
        ...

    def fit(self, names: Sequence[str], rotations: Floats) -> StateSpace:
        """Divide each joint's orientations into states.

        The same orientations give the same states, whatever the order of the postures or the joints.

        Args:
            names: names of the joints [J].
            rotations: unit quaternions x, y, z, w of a corpus's postures [N, J, 4].

        Raises:
            MotionMindError: there are no postures or joints, or a quaternion is not a unit quaternion.
            SkeletonError: a per-joint setting names no joint of `names`.
        """
        ...

    def to_spec(self) -> dict[str, object]:
        """Return plain JSON values for a manifest, from which `from_spec` makes the discretization again."""
        ...


@runtime_checkable
class ByJoint(Discretization, Protocol):
    """A discretization that treats each joint by itself, so that joints can be fitted in parallel."""

    def fit_joint(self, names: Sequence[str], joint: int, rotations: Floats) -> StateSpace:
        """Divide one joint's orientations into the states that `fit` gives this joint.

        Args:
            names: names of all joints [J], for settings by joint.
            joint: the joint's index.
            rotations: unit quaternions of the joint in a corpus's postures [N, 4].

        Raises:
            SkeletonError: a per-joint setting names no joint of `names`.
        """
        ...


def fit_joints(discretization: ByJoint, names: Sequence[str], rotations: Floats) -> StateSpace:
    """Divide each joint's orientations [N, J, 4] into states, joint by joint; as `Discretization.fit`."""
    rotations = _checked_samples(names, rotations)
    return StateSpace.joined([discretization.fit_joint(names, j, rotations[:, j]) for j in range(len(names))])


def _checked_samples(names: Sequence[str], rotations: Floats) -> Floats:
    """Check the arguments of `fit`, and return `rotations` as float64 [N, J, 4].

    Raises:
        MotionMindError: there are no postures or joints, or a quaternion is not a unit quaternion.
    """
    if len(names) == 0 or len(set(names)) != len(names):
        raise MotionMindError("a discretization needs at least one joint, and distinct joint names")
    rotations = checked_rotations(names, rotations)
    if len(rotations) == 0:
        raise MotionMindError("there are no postures to learn states from")
    return rotations


def joints_meant(name: str, names: Sequence[str]) -> list[int]:
    """Return the indices of the joints that `name` means: that joint, or both sides for a name without side ("hip")."""
    exact = [j for j, joint in enumerate(names) if joint == name]
    return exact or [j for j, joint in enumerate(names) if joint in {side + name for side in SIDE_PREFIXES}]


def per_joint_values(names: Sequence[str], value: float, per_joint: Mapping[str, float]) -> Floats:
    """Return the value for each joint [J]: its own in `per_joint`, or else the default.

    Args:
        names: names of the joints [J].
        value: the default.
        per_joint: values by joint. A name without side means both sides, unless a side is named too.

    Raises:
        SkeletonError: a name in `per_joint` matches no joint; the message suggests the nearest one.
    """
    values = np.full(len(names), float(value))
    # Names without side first, so that a named side overrides them.
    for exact in (False, True):
        for name, own in per_joint.items():
            joints = joints_meant(name, names)
            if not joints:
                raise SkeletonError(f"per_joint: no joint {name!r}{suggest_joint(name, nameable(names))}")
            if (name in names) is exact:
                values[joints] = own
    return values


def nameable(names: Sequence[str]) -> list[str]:
    """Return the names that `joints_meant` understands: every joint, and every pair of joints without its side."""
    pairs = [name.removeprefix("left_") for name in names if name.startswith("left_")]
    return list(dict.fromkeys([*names, *pairs]))


def check_range(what: str, values: Mapping[str, float], low: float, high: float) -> None:
    """Check that values are numbers within a range.

    Args:
        what: the name of the setting, for the message.
        values: by joint; "" is the default.
        low: the smallest value allowed.
        high: the largest value allowed.

    Raises:
        MotionMindError: a value is not a number, or out of range.
    """
    for joint, value in values.items():
        of = f" of {joint}" if joint else ""
        check_real(f"the {what}{of}", value)
        if not low <= value <= high:
            raise MotionMindError(f"the {what}{of} must be a number from {low:g} to {high:g}, not {value!r}")
