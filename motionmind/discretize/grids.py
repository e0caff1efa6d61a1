"""Grids of states, in quaternion coefficients as in the papers or in Euler angles; only cells that occur are states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from motionmind._typing import Floats
from motionmind.discretize.protocol import check_range, fit_joints, per_joint_values
from motionmind.discretize.states import StateSpace, distinct, nearest
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

_MAX_STEP_RATIO = 0.9  # with a step above 1, a quaternion can round to zero
_MAX_CELL_DEG = 120.0  # wider cells overlap more than they divide


@dataclass(frozen=True)
class QuaternionGrid:
    """A grid of quaternion coefficients, which are rounded to multiples of `step`.

    The method is that of Bradley and Stuart, "Using chaos to generate variations on movement sequences", Chaos 8:800
    (1998). A state is a cell that some orientation of the corpus falls into, normalised to a unit quaternion; an
    orientation belongs to the nearest state. Rounding errs by step / 2 at most in each of four coefficients, so by
    `step` at most in all. That turns a unit vector by asin(step) at most and the rotation by twice that, so
    `step = sin(tolerance / 2)` keeps every orientation of the corpus within `tolerance` of its state.

    Attributes:
        step: the grid's step, without unit, 0.00001 to 0.9.
        per_joint: steps for single joints; "hip" means both hips.
    """

    step: float = 0.13
    per_joint: Mapping[str, float] = field(default_factory=dict)
    kind: ClassVar[str] = "quaternion"

    def __post_init__(self) -> None:
        check_range("quaternion step", {"": self.step, **self.per_joint}, 1e-5, _MAX_STEP_RATIO)

    @staticmethod
    def step_for(tolerance: float) -> float:
        """Return the widest step that keeps every orientation within `tolerance` degrees of its state."""
        return min(_MAX_STEP_RATIO, float(np.sin(0.5 * np.radians(tolerance))))

    def fit(self, names: Sequence[str], rotations: Floats) -> StateSpace:
        """Return the cells of `rotations` [N, J, 4] that occur, for `names` [J]; see `Discretization.fit`."""
        return fit_joints(self, names, rotations)

    def fit_joint(self, names: Sequence[str], joint: int, rotations: Floats) -> StateSpace:
        """Return the cells of one of the joints, of `rotations` [N, 4], that occur; see `ByJoint.fit_joint`."""
        step = per_joint_values(names, self.step, self.per_joint)[[joint]]
        centres, tolerances = self._cells(rotations, step[0]), np.degrees(2.0 * np.arcsin(step))
        return StateSpace.of_joints([names[joint]], [centres], kind=self.kind, tolerances=tolerances)

    def to_spec(self) -> dict[str, object]:
        """Return the steps, as `from_spec` reads them."""
        return {"kind": self.kind, "step": self.step, "per_joint": dict(self.per_joint)}

    @staticmethod
    def _cells(q: Floats, step: float) -> Floats:
        cells = np.unique(np.rint(rot.canonical(q) / step), axis=0)
        return _occurring(q, rot.normalise(cells))


@dataclass(frozen=True)
class EulerGrid:
    """A grid of Euler angles, which are rounded to multiples of `degrees`: "5-degree steps" is `EulerGrid(5)`.

    A state is a cell that some orientation of the corpus falls into. An orientation belongs to the nearest state by the
    angle of rotation, not by its Euler angles, which mean little near gimbal lock.

    Each of the three angles errs by at most h = degrees / 2. The first and last axis may coincide; the middle one is
    perpendicular to both. So the cosine of half the angle between an orientation and its cell's centre is at least
    cos(h/2)^3 - sin(h/2)^2. The angle is then at most sqrt(5) h, and `degrees = tolerance * 2 / sqrt(5)` keeps every
    orientation of the corpus within `tolerance` of its state.

    Attributes:
        degrees: width of the cells, 0.001 to 120.
        order: the axes of the intrinsic turns, x, y and z once each (see `rotations.from_euler`).
        per_joint: widths for single joints; "hip" means both hips.
    """

    degrees: float = 15.0
    order: str = "ZXY"
    per_joint: Mapping[str, float] = field(default_factory=dict)
    kind: ClassVar[str] = "euler"

    def __post_init__(self) -> None:
        check_range("width of Euler cells in degrees", {"": self.degrees, **self.per_joint}, 0.001, _MAX_CELL_DEG)
        if not isinstance(self.order, str) or sorted(self.order.lower()) != ["x", "y", "z"]:
            raise MotionMindError(f"the rotation order must name x, y and z once each, not {self.order!r}")

    @staticmethod
    def degrees_for(tolerance: float) -> float:
        """Return the greatest width, degrees, that keeps every orientation within `tolerance` degrees of its state."""
        return min(_MAX_CELL_DEG, float(tolerance * 2.0 / np.sqrt(5.0)))

    def fit(self, names: Sequence[str], rotations: Floats) -> StateSpace:
        """Return the cells of `rotations` [N, J, 4] that occur, for `names` [J]; see `Discretization.fit`."""
        return fit_joints(self, names, rotations)

    def fit_joint(self, names: Sequence[str], joint: int, rotations: Floats) -> StateSpace:
        """Return the cells of one of the joints, of `rotations` [N, 4], that occur; see `ByJoint.fit_joint`."""
        width = per_joint_values(names, self.degrees, self.per_joint)[[joint]]
        centres, tolerances = self._cells(rotations, np.radians(width[0])), width * np.sqrt(5.0) / 2.0
        return StateSpace.of_joints([names[joint]], [centres], kind=self.kind, tolerances=tolerances)

    def to_spec(self) -> dict[str, object]:
        """Return the widths and the order, as `from_spec` reads them."""
        return {"kind": self.kind, "degrees": self.degrees, "order": self.order, "per_joint": dict(self.per_joint)}

    def _cells(self, q: Floats, width: float) -> Floats:
        # Use the canonical sign: the angles of q and -q are equal, but perhaps not to the last bit.
        cells = np.unique(np.rint(rot.to_euler(self.order, rot.canonical(q)) / width), axis=0)
        return _occurring(q, rot.from_euler(self.order, cells * width))


def _occurring(q: Floats, cells: Floats) -> Floats:
    """Return the `cells` [S, 4] that are nearest to some orientation in `q` [N, 4].

    Removing the others, which are never visited, changes no nearest state.
    """
    cells = distinct(rot.canonical(cells))
    return cells[np.unique(nearest(q, cells)[0])]
