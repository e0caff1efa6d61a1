"""One-sided terms of the solve: each pushes only the excess over a bound.

The rows of a bounded vector, such as a velocity, lead to the nearest allowed vector. Its distance bounds the excess
from above, so such a step cannot raise the sum of squares; rows along the excess alone overshoot as its direction
turns. Source: Lange, "MM Optimization Algorithms" (2016), chapter 5, on distances to convex sets.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, ClassVar, TypeVar

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.limits import within_limits
from motionmind.footing.balance import nearest_in_support
from motionmind.geometry import rotations as rot
from motionmind.solver.kinematics import Rows, State, rows_at
from motionmind.solver.system import Normal

UP = np.array([0.0, 1.0, 0.0])
BOUND_TOLERANCE = 1e-6  # in the unit of the term


R = TypeVar("R")


def once_per_state(method: Callable[[Any, State], R]) -> Callable[[Any, State], R]:
    """Cache the result of a term's method for the last state, because `add` and `foresee` share it."""
    name = f"{method.__name__} found"

    @wraps(method)
    def found(self: Any, state: State) -> R:
        held = self.__dict__
        if name not in held or held[name][0] is not state:
            held[name] = state, method(self, state)
        last: R = held[name][1]
        return last

    return found


class OneSided(ABC):
    """A term whose rows push only beyond its bound.

    Rows within the bound do not push, so a step may cross it. The solve then adds the rows that the step would break
    and computes the step again: one iteration of a primal-dual active set. Source: Hintermüller, Ito, Kunisch,
    "The primal-dual active set strategy as a semismooth Newton method", SIAM Journal on Optimization 13 (2002).
    """

    @abstractmethod
    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows within their bounds that a step [N, n] would break, and return whether there are any."""


class VectorBound(OneSided):
    """A bound on vectors, whose rows lead towards the nearest allowed ones.

    Attributes:
        sd: standard deviation of the excess, in the vectors' unit.
    """

    unit: ClassVar[str]
    sd: float

    @abstractmethod
    def vectors(self, state: State) -> Floats:
        """Return the bounded vectors [..., k]."""

    @abstractmethod
    def change(self, state: State, step: Floats) -> Floats:
        """Return the first-order change of the vectors [..., k] by a step [N, n]."""

    @abstractmethod
    def excess(self, state: State, vectors: Floats) -> Floats:
        """Return the differences of vectors [..., k] from the nearest allowed ones."""

    @abstractmethod
    def add_rows(self, state: State, normal: Normal, off: Floats, excess: Floats, chosen: Bools) -> None:
        """Add rows of the chosen vectors [...] at differences `off` from their targets; their excess weighs them."""

    def cost(self, excess: Floats) -> float:
        """Return the cost of an excess [..., k]."""
        return float(np.sum(excess**2) * self.sd**-2.0)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        excess = self.excess(state, self.vectors(state))
        self.add_rows(state, normal, excess, excess, np.any(excess != 0.0, axis=-1))
        normal.cost += self.cost(excess)

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        now, change = self.vectors(state), self.change(state, step)
        excess = self.excess(state, now + change)
        chosen = np.any(excess != 0.0, axis=-1) & ~np.any(self.excess(state, now) != 0.0, axis=-1)
        self.add_rows(state, normal, excess - change, excess, chosen)
        return bool(chosen.any())


def beyond(vectors: Floats, most: Floats | float) -> Floats:
    """Return vectors [..., k] shortened by a length [...], at least to 0."""
    size = np.linalg.norm(vectors, axis=-1)
    return np.asarray(vectors * np.maximum(1.0 - most / np.maximum(size, BOUND_TOLERANCE), 0.0)[..., None])


@dataclass
class Floor(OneSided):
    """Keep points above the floor.

    Attributes:
        floor: height of the floor [N], metres.
        sd: standard deviation of the depth, metres.
    """

    unit: ClassVar[str] = "cm"

    floor: Floats
    sd: float

    def _deep(self, state: State) -> Floats:
        return np.asarray(self.floor[:, None] - state.places[..., 1])

    def _rows(self, chosen: Bools) -> Rows:
        frames, points = np.nonzero(chosen)
        return rows_at(frames, np.tile(-UP, (len(frames), 1)), points)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        deep = self._deep(state)
        deep[[0, -1]] = -1.0
        pushes = deep > BOUND_TOLERANCE
        self._rows(pushes).add_uniform(state, normal, deep[pushes], self.sd)
        normal.cost += float(np.sum(deep[pushes] ** 2)) * self.sd**-2.0

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        deep = self._deep(state)
        above = deep <= BOUND_TOLERANCE
        above[[0, -1]] = False
        return self._rows(above).add_broken(state, step, normal, deep[above], self.sd)

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        return np.asarray(100.0 * np.maximum(self._deep(state).max(axis=1), 0.0))


@dataclass
class Balance(VectorBound):
    """Keep the zero-moment point and the centre of mass within their allowed distances from the support.

    The zero-moment point is where the floor's force acts, c - (h / g) c'' for a centre of mass c at height h. Source:
    Kajita et al., "Biped walking pattern generation by using preview control of zero-moment point", ICRA (2003).

    Attributes:
        touches: whether each point supports the body [N, P].
        floor: height of the floor [N], metres.
        overhang: allowed distance of the centre of mass from the support, metres.
        room: the same of the zero-moment point: half a foot's width, because a foot's points lie on its midline.
        near: nearness to each end of the movement [2, N], 0 to 1; an end out of balance widens the bounds.
        gravity: m/s^2.
        fps: frames a second.
        sd: standard deviation of the excess, metres.
        reach: excess beyond which the pull is constant, metres, so that a body far out of balance does not jerk.
    """

    unit: ClassVar[str] = "cm"

    touches: Bools
    floor: Floats
    overhang: float
    room: float
    near: Floats
    gravity: float
    fps: float
    sd: float
    reach: float = 0.005

    def vectors(self, state: State) -> Floats:
        """Return the zero-moment point and the centre of mass in inner frames [2, N - 2, 2], metres."""
        return self._points(state, state.mass)

    def change(self, state: State, step: Floats) -> Floats:
        """Return their first-order change [2, N - 2, 2]; see `VectorBound.change`."""
        return self._points(state, np.einsum("txi,ti->tx", state.mass_jacobian, step))

    def _points(self, state: State, mass: Floats) -> Floats:
        """Return both points from the centre of mass, or their changes from its change [N, 3]."""
        level = mass[:, [0, 2]]
        inner = level[1:-1]
        return np.stack([inner - self._levers(state)[:, None] * np.diff(level, 2, axis=0), inner])

    def _levers(self, state: State) -> Floats:
        """Return h / g in inner frames [N - 2], frames squared."""
        height = np.maximum(state.mass[1:-1, 1] - self.floor[1:-1], 0.1)
        return np.asarray(height / self.gravity * self.fps**2)

    def excess(self, state: State, vectors: Floats) -> Floats:
        """Return the vectors from the nearest allowed points to points [2, N - 2, 2], metres."""
        places, ends = np.ascontiguousarray(state.places[..., [0, 2]]), [0, -1]
        level = state.mass[ends][:, [0, 2]]
        given = np.linalg.norm(level - nearest_in_support(places[ends], self.touches[ends], level), axis=1)
        near = (given[:, None] * self.near).max(axis=0)[1:-1]
        off = [point - nearest_in_support(places[1:-1], self.touches[1:-1], point) for point in vectors]
        room = np.stack([np.maximum(near, self.room), np.maximum(near, self.overhang)])
        return beyond(np.stack(off), room)

    def _eased(self, excess: Floats) -> Floats:
        return np.asarray(np.sqrt(1.0 + np.sum((excess / self.reach) ** 2, axis=-1)))

    def add_rows(self, state: State, normal: Normal, off: Floats, excess: Floats, chosen: Bools) -> None:
        """Add rows of the chosen points [2, N - 2]; see `VectorBound.add_rows`."""
        levers = self._levers(state)
        shares = np.zeros((2, len(levers), 3))
        shares[0] = np.stack([-levers, 1.0 + 2.0 * levers, -levers], axis=1)
        shares[1, :, 1] = 1.0
        weights = self.sd**-2.0 / self._eased(excess)
        for which in range(2):
            (first,) = np.nonzero(chosen[which])
            for axis in range(2):
                directions = shares[which, first][:, :, None] * np.eye(3)[2 * axis]
                normal.add_mass(first, directions, off[which, first, axis], weights[which, first])

    def cost(self, excess: Floats) -> float:
        """Return the cost of an excess [2, N - 2, 2]: quadratic, then linear beyond the reach."""
        return float(np.sum(2.0 * (self.reach / self.sd) ** 2 * (self._eased(excess) - 1.0)))

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        out = np.zeros(len(state.x))
        out[1:-1] = 100.0 * np.linalg.norm(self.excess(state, self.vectors(state))[1], axis=1)
        return out


@dataclass
class Limits(OneSided):
    """Keep joints within their limits, widened to the given postures.

    Attributes:
        given: local rotations of the given postures [G, J, 4].
        loose: joints without limits [J].
        sd: standard deviation of the excess, radians.
    """

    unit: ClassVar[str] = "degrees"

    given: Floats
    loose: Bools
    sd: float

    def _allowed(self, state: State, rotations: Floats) -> Floats:
        """Return the nearest rotations within the limits [N, J, 4]."""
        joints = np.unique(state.freedom.joints).tolist()
        return within_limits(state.body.skeleton, rotations, self.given, self.loose, joints)

    @once_per_state
    def _excess(self, state: State) -> Floats:
        """Return rotation vectors from the nearest rotations within the limits [N, J, 3], in the joints' frames."""
        off = rot.log(rot.inv_mul(self._allowed(state, state.rotations), state.rotations))
        return np.where(rot.norm(off)[..., None] > BOUND_TOLERANCE, off, 0.0)

    def _rows(self, state: State, normal: Normal, off: Floats, chosen: Bools) -> None:
        chosen[[0, -1]] = False
        for joint in np.flatnonzero(chosen.any(axis=0)).tolist():
            (frames,), (own, columns) = np.nonzero(chosen[:, joint]), state.freedom.slices(joint)
            jacobian = state.own_axes[frames][:, None, own]
            normal.add_joint(frames, columns, jacobian, off[frames, joint], self.sd**-2.0)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        off = self._excess(state)
        self._rows(state, normal, off, np.any(off != 0.0, axis=2))
        normal.cost += float(np.sum(off[1:-1] ** 2)) * self.sd**-2.0

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        turned = np.zeros((*state.rotations.shape[:2], 3))
        for joint in np.unique(state.freedom.joints).tolist():
            own, columns = state.freedom.slices(joint)
            turned[:, joint] = np.einsum("td,tdx->tx", step[:, columns], state.own_axes[:, own])
        then = rot.mul(state.rotations, rot.exp(turned))
        allowed = self._allowed(state, then)
        chosen = (rot.angle(allowed, then) > BOUND_TOLERANCE) & ~np.any(self._excess(state) != 0.0, axis=2)
        self._rows(state, normal, rot.log(rot.inv_mul(allowed, state.rotations)), chosen)
        return bool(chosen.any())

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        return np.asarray(np.degrees(rot.norm(self._excess(state)).max(axis=1)))
