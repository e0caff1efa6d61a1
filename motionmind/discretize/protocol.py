"""What every kind of discretization can do, and the settings per joint that they share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from motionmind._typing import Floats
from motionmind.discretize.states import StateSpace, checked_rotations
from motionmind.errors import MotionMindError, SkeletonError, did_you_mean

SIDES = ("left_", "right_")


class Discretization(Protocol):
    """A way to divide each joint's orientations into states."""

    @property
    def kind(self) -> str:
        """Which kind this is, such as "codebook"."""
        ...

    def fit(self, names: Sequence[str], rotations: Floats) -> StateSpace:
        """The states for the joints `names` [J], given the orientations `rotations` [N, J, 4] of a corpus.

        The same orientations give the same states, whatever the order of the postures or the joints.
        """
        ...

    def to_spec(self) -> dict[str, object]:
        """What a manifest keeps of this: plain JSON values from which `from_spec` makes it again."""
        ...


def samples(names: Sequence[str], rotations: Floats) -> Floats:
    """`rotations` [N, J, 4] as `fit` may use them; MotionMindError where there are none, or they are none."""
    if len(names) == 0 or len(set(names)) != len(names):
        raise MotionMindError("a discretization needs joints, each named once")
    rotations = checked_rotations(names, rotations)
    if len(rotations) == 0:
        raise MotionMindError("there are no postures to learn states from")
    return rotations


def joints_meant(name: str, names: Sequence[str]) -> list[int]:
    """Indices of the joints that `name` means: itself, or without a side ("hip") the left and the right one."""
    exact = [j for j, joint in enumerate(names) if joint == name]
    return exact or [j for j, joint in enumerate(names) if joint in {side + name for side in SIDES}]


def per_joint_values(names: Sequence[str], value: float, per_joint: Mapping[str, float]) -> Floats:
    """`value`, or what `per_joint` says, for each joint [J].

    A name without its side means both sides, unless that side is named too. A name that means no joint is a
    SkeletonError that suggests the nearest one.
    """
    values = np.full(len(names), float(value))
    # Sideless names first, so that a side of its own has the last word.
    for exact in (False, True):
        for name, own in per_joint.items():
            joints = joints_meant(name, names)
            if not joints:
                hint = did_you_mean(name, nameable(names)) or f"; there are {', '.join(names)}"
                raise SkeletonError(f"no joint {name!r} to set a value for{hint}")
            if (name in names) is exact:
                values[joints] = own
    return values


def nameable(names: Sequence[str]) -> list[str]:
    """What `joints_meant` understands: every joint, and every pair of joints without its side."""
    pairs = [name.removeprefix("left_") for name in names if name.startswith("left_")]
    return list(dict.fromkeys([*names, *pairs]))


def check_range(what: str, values: Mapping[str, float], low: float, high: float) -> None:
    """MotionMindError unless all of `values`, by joint ("" for the default), are numbers from `low` to `high`."""
    for joint, value in values.items():
        number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
        if not number or not low <= value <= high:
            of = f" of {joint}" if joint else ""
            raise MotionMindError(f"the {what}{of} must be a number from {low:g} to {high:g}, not {value!r}")
