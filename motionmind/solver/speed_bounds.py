"""Bounds on the speeds of joints, and on the speed and the acceleration of the root, as terms of the solve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.geometry import rotations as rot
from motionmind.solver.kinematics import State, inverse_right_jacobian
from motionmind.solver.one_sided import UP, VectorBound, beyond, once_per_state
from motionmind.solver.system import Normal


@dataclass
class Speed(VectorBound):
    """Bound the angular speed of the joints; for the root, tilt and turn about the vertical separately.

    Attributes:
        most: greatest speeds of the joints [J], rad/s; for the root, of its tilt.
        turns: greatest speed at which the root turns about the vertical, rad/s.
        fps: frames a second.
        sd: standard deviation of the excess, rad/s.
    """

    unit: ClassVar[str] = "degrees/s"

    most: Floats
    turns: float
    fps: float
    sd: float

    @once_per_state
    def vectors(self, state: State) -> Floats:
        """Return the angular velocities [N - 1, J, 3] in the joints' frames, rad/s; that of the root in the world."""
        joints, out = np.unique(state.freedom.joints), np.zeros((len(state.x) - 1, state.rotations.shape[1], 3))
        before, after = state.rotations[:-1, joints], state.rotations[1:, joints]
        out[:, joints] = self.fps * rot.log(rot.inv_mul(before, after))
        out[:, 0] = rot.mul_vec(state.rotations[:-1, 0], out[:, 0])
        return out

    def change(self, state: State, step: Floats) -> Floats:
        """Return their first-order change [N - 1, J, 3]; see `VectorBound.change`."""
        out, every = np.zeros((len(step) - 1, state.rotations.shape[1], 3)), np.arange(len(step) - 1)
        for joint in np.unique(state.freedom.joints).tolist():
            columns = state.freedom.slices(joint)[1]
            pairs = np.stack([step[:-1, columns], step[1:, columns]], axis=1)
            out[:, joint] = np.einsum("radx,rad->rx", self._jacobian(state, joint, every), pairs)
        return out

    def excess(self, state: State, vectors: Floats) -> Floats:
        """Return the differences of velocities [N - 1, J, 3] from the nearest allowed, rad/s."""
        excess, root = beyond(vectors, self.most), vectors[:, 0]
        excess[:, 0] = beyond(root * (1.0 - UP), self.most[0]) + beyond(root * UP, self.turns)
        return excess

    def _jacobian(self, state: State, joint: int, first: Indices) -> Floats:
        """Return the Jacobian of a joint's velocities from some frames to the next [R, 2, d, 3]."""
        axes = (state.own_axes if joint else state.axes)[:, state.freedom.slices(joint)[0]]
        before, after = axes[first], axes[first + 1]
        if joint == 0:  # other joints' excess lies along their rotation, which the logarithm's Jacobian preserves
            turn = np.broadcast_to(self.vectors(state)[first, :1] / self.fps, before.shape)
            before, after = inverse_right_jacobian(turn, before), inverse_right_jacobian(-turn, after)
        return self.fps * np.stack([-before, after], axis=1)

    def add_rows(self, state: State, normal: Normal, off: Floats, excess: Floats, chosen: Bools) -> None:
        """Add rows of the chosen velocities [N - 1, J]; see `VectorBound.add_rows`."""
        for joint in np.flatnonzero(chosen.any(axis=0)).tolist():
            (first,) = np.nonzero(chosen[:, joint])
            jacobian, columns = self._jacobian(state, joint, first), state.freedom.slices(joint)[1]
            normal.add_joint(first, columns, jacobian, off[first, joint], self.sd**-2.0)

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        out = np.zeros(len(state.x))
        out[1:] = np.degrees(rot.norm(self.excess(state, self.vectors(state))).max(axis=1))
        return out


@dataclass
class Travel(VectorBound):
    """Bound the speed or the acceleration of the root, except in flight.

    Attributes:
        order: 1 for its speed, 2 for its acceleration.
        axes: 1 for each bounded axis, 0 for the others [3].
        most: the bound, m/s or m/s^2.
        free: whether a difference is unbounded [N - order].
        fps: frames a second.
        sd: standard deviation of the excess.
    """

    unit: ClassVar[str] = ""

    order: int
    axes: Floats
    most: float
    free: Bools
    fps: float
    sd: float

    def vectors(self, state: State) -> Floats:
        """Return the velocities or accelerations of the root [N - order, 3], m/s or m/s^2."""
        return self._moved(state.root)

    def change(self, state: State, step: Floats) -> Floats:
        """Return their first-order change [N - order, 3]; see `VectorBound.change`."""
        return self._moved(step[:, :3])

    def _moved(self, root: Floats) -> Floats:
        """Return the velocities or accelerations [N - order, 3] of positions, or their changes, [N, 3]."""
        return np.asarray(self.fps**self.order * np.diff(root, self.order, axis=0) * self.axes)

    def excess(self, state: State, vectors: Floats) -> Floats:
        """Return the differences of vectors [N - order, 3] from the nearest allowed; see `VectorBound.excess`."""
        return beyond(vectors, self.most) * ~self.free[:, None]

    def add_rows(self, state: State, normal: Normal, off: Floats, excess: Floats, chosen: Bools) -> None:
        """Add rows of the chosen vectors [N - order]; see `VectorBound.add_rows`."""
        (first,) = np.nonzero(chosen)
        shares = self.fps**self.order * np.array([[-1.0, 1.0], [1.0, -2.0, 1.0]][self.order - 1])
        jacobian = np.tile(shares[:, None, None] * np.diag(self.axes), (len(first), 1, 1, 1))
        normal.add_joint(first, slice(0, 3), jacobian, off[first], self.sd**-2.0)

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        return np.zeros(len(state.x))
