"""Checks of the arrays that postures and motions hold, which are read-only from then on."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.arguments import as_floats
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot


class Body(Protocol):
    """A posture or a motion."""

    @property
    def skeleton(self) -> Skeleton:
        """The body."""

    @property
    def rotations(self) -> Floats:
        """Local rotations [..., J, 4]."""

    @property
    def root(self) -> Floats:
        """Positions of the root joint [..., 3], metres."""


def freeze_checked(thing: Body, rotations: tuple[int, ...], root: tuple[int, ...]) -> None:
    """Check the shapes and values of a new object's arrays, then make them read-only.

    Args:
        thing: a posture or a motion, which has the arrays `rotations` and `root`.
        rotations: the shape that its rotations must have: [J, 4], or [T, J, 4] of a motion.
        root: the shape that the root's positions must have.

    Raises:
        MotionMindError: an array has another shape, holds what is no finite number, or a quaternion's length is not 1.
    """
    name = getattr(thing, "name", "") or type(thing).__name__.lower()
    for what, shape in (("rotations", rotations), ("root", root)):
        array = as_floats(what, getattr(thing, what))
        if array.shape != shape:
            raise MotionMindError(f"{name}: {what} must have the shape {shape}, not {array.shape}")
        if not np.isfinite(array).all():
            where = np.argwhere(~np.isfinite(array))[0]
            raise MotionMindError(f"{name}: {_place(thing, what, where)} is not a finite number")
        array.setflags(write=False)
        object.__setattr__(thing, what, array)
    with np.errstate(over="ignore"):  # a length beyond all numbers is not 1 either
        length = rot.norm(thing.rotations)
    if np.any(np.abs(length - 1.0) > 1e-6):
        where = np.argwhere(np.abs(length - 1.0) > 1e-6)[0]
        raise MotionMindError(
            f"{name}: {_place(thing, 'rotations', where)} has length {length[tuple(where)]:.6g}, not 1"
        )


def _place(thing: Body, what: str, where: Indices) -> str:
    moving = np.ndim(thing.rotations) == 3
    frame = f" in frame {where[0]}" if moving else ""
    if what == "root":
        return f"the root's position{frame}"
    return f"the rotation of {thing.skeleton.names[where[1 if moving else 0]]}{frame}"
