"""One-sided terms of the solve: each pushes only the excess over a bound.

Where a bound is on a vector, such as a velocity, rows lead towards the nearest vector that is allowed, whose distance
bounds the excess from above: such a step cannot raise the sum of squares. Rows along the excess alone overshoot as its
direction turns. Source: Lange, "MM Optimization Algorithms" (2016), chapter 5, on distances to convex sets.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, ClassVar, TypeVar

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.capsules import LEG, capsules_of, pair_depths
from motionmind.body.limits import within_limits
from motionmind.body.tempo import runs_of
from motionmind.footing.balance import nearest_in_support
from motionmind.footing.smoothing import sliding_max
from motionmind.geometry import rotations as rot
from motionmind.synth.kinematics import Rows, State, inverse_right_jacobian, rows_at
from motionmind.synth.system import Normal

UP = np.array([0.0, 1.0, 0.0])
NEAR_M = 0.06  # between legs that may pass through each other within a frame
OPPOSITE = 0.2  # cosine between the directions from leg to leg below which they have changed sides
EDGE = 1e-6  # in a term's unit: tolerance of its bound


R = TypeVar("R")


def _once(method: Callable[[Any, State], R]) -> Callable[[Any, State], R]:
    """Cache the result of a term's method for the last state, which `add` and `foresee` share."""
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

    Rows within the bound do not push, so a step may cross it. The solve adds the rows that a step would break, and
    computes the step again. This is one iteration of a primal-dual active set. Source: Hintermüller, Ito, Kunisch,
    "The primal-dual active set strategy as a semismooth Newton method", SIAM Journal on Optimization 13 (2002).
    """

    @abstractmethod
    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows within their bounds that a step [N, n] would break, and return whether there are any."""


def _beyond(vectors: Floats, most: Floats | float) -> Floats:
    """Return the part of vectors [..., k] beyond a length [...]."""
    size = np.linalg.norm(vectors, axis=-1)
    return np.asarray(vectors * np.maximum(1.0 - most / np.maximum(size, EDGE), 0.0)[..., None])


@dataclass
class Floor(OneSided):
    """Keep points above the floor.

    Attributes:
        floor: height of the floor [N], metres.
        spread: standard deviation of the depth, metres.
    """

    unit: ClassVar[str] = "cm"

    floor: Floats
    spread: float

    def _deep(self, state: State) -> Floats:
        return np.asarray(self.floor[:, None] - state.places[..., 1])

    def _rows(self, chosen: Bools) -> Rows:
        frames, points = np.nonzero(chosen)
        return rows_at(frames, np.tile(-UP, (len(frames), 1)), points)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        deep = self._deep(state)
        deep[[0, -1]] = -1.0
        pushes = deep > EDGE
        self._rows(pushes).add_alike(state, normal, deep[pushes], self.spread)
        normal.cost += float(np.sum(deep[pushes] ** 2)) * self.spread**-2.0

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        deep = self._deep(state)
        above = deep <= EDGE
        above[[0, -1]] = False
        return self._rows(above).add_broken(state, step, normal, deep[above], self.spread)

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.asarray(100.0 * np.maximum(self._deep(state).max(axis=1), 0.0))


@dataclass
class Balance(OneSided):
    """Keep the zero-moment point and the centre of mass within their allowed distances from the support.

    The zero-moment point is where the floor's force acts, c - (h / g) c'' for a centre of mass c at height h. Source:
    Kajita et al., "Biped walking pattern generation by using preview control of zero-moment point", ICRA (2003).

    Attributes:
        touches: whether each point supports the body [N, P].
        floor: height of the floor [N], metres.
        overhang: allowed distance of the centre of mass from the support, metres.
        room: the same of the zero-moment point: half a foot's width, because points lie on its midline.
        near: nearness to each end of the movement [2, N], 0 to 1: given postures may be out of balance.
        gravity: m/s^2.
        fps: frames a second.
        spread: standard deviation of the excess, metres.
        reach: excess beyond which the pull is constant, metres: balance out of reach is not worth a jerk.
    """

    unit: ClassVar[str] = "cm"

    touches: Bools
    floor: Floats
    overhang: float
    room: float
    near: Floats
    gravity: float
    fps: float
    spread: float
    reach: float = 0.005

    def _points(self, state: State, level: Floats) -> Floats:
        """Return the zero-moment point and the centre of mass in inner frames [2, N - 2, 2], metres, given the level
        position of the latter [N, 2]."""
        inner = level[1:-1]
        return np.stack([inner - self._levers(state)[:, None] * np.diff(level, 2, axis=0), inner])

    def _levers(self, state: State) -> Floats:
        """Return h / g in inner frames [N - 2], frames squared."""
        height = np.maximum(state.mass[1:-1, 1] - self.floor[1:-1], 0.1)
        return np.asarray(height / self.gravity * self.fps**2)

    def _excess(self, state: State, points: Floats) -> Floats:
        """Return the vectors from the nearest allowed points to points [2, N - 2, 2], metres."""
        places, ends = np.ascontiguousarray(state.places[..., [0, 2]]), [0, -1]
        level = state.mass[ends][:, [0, 2]]
        given = np.linalg.norm(level - nearest_in_support(places[ends], self.touches[ends], level), axis=1)
        near = (given[:, None] * self.near).max(axis=0)[1:-1]
        off = [point - nearest_in_support(places[1:-1], self.touches[1:-1], point) for point in points]
        room = np.stack([np.maximum(near, self.room), np.maximum(near, self.overhang)])
        return _beyond(np.stack(off), room)

    def _eased(self, excess: Floats) -> Floats:
        return np.asarray(np.sqrt(1.0 + np.sum((excess / self.reach) ** 2, axis=-1)))

    def _rows(self, state: State, normal: Normal, off: Floats, excess: Floats, chosen: Bools) -> None:
        """Add rows of the chosen points [2, N - 2], at offsets [2, N - 2, 2] from the nearest allowed points."""
        levers = self._levers(state)
        shares = np.zeros((2, len(levers), 3))
        shares[0] = np.stack([-levers, 1.0 + 2.0 * levers, -levers], axis=1)
        shares[1, :, 1] = 1.0
        weights = self.spread**-2.0 / self._eased(excess)
        for which in range(2):
            (first,) = np.nonzero(chosen[which])
            for axis in range(2):
                ways = shares[which, first][:, :, None] * np.eye(3)[2 * axis]
                normal.add_mass(first, ways, off[which, first, axis], weights[which, first])

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        excess = self._excess(state, self._points(state, state.mass[:, [0, 2]]))
        self._rows(state, normal, excess, excess, np.any(excess != 0.0, axis=2))
        normal.cost += float(np.sum(2.0 * (self.reach / self.spread) ** 2 * (self._eased(excess) - 1.0)))

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        level = state.mass[:, [0, 2]]
        then = level + np.einsum("txi,ti->tx", state.mass_jacobian, step)[:, [0, 2]]
        now, then = self._points(state, level), self._points(state, then)
        excess = self._excess(state, then)
        chosen = np.any(excess != 0.0, axis=2) & ~np.any(self._excess(state, now) != 0.0, axis=2)
        self._rows(state, normal, now - (then - excess), excess, chosen)
        return bool(chosen.any())

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        out, points = np.zeros(len(state.x)), self._points(state, state.mass[:, [0, 2]])
        out[1:-1] = 100.0 * np.linalg.norm(self._excess(state, points)[1], axis=1)
        return out


@dataclass
class Limits(OneSided):
    """Keep joints within their limits, widened to the given postures.

    Attributes:
        given: local rotations of the given postures [G, J, 4].
        loose: joints without limits [J].
        spread: standard deviation of the excess, radians.
    """

    unit: ClassVar[str] = "degrees"

    given: Floats
    loose: Bools
    spread: float

    def _allowed(self, state: State, rotations: Floats) -> Floats:
        """Return the nearest rotations within the limits [N, J, 4]."""
        joints = np.unique(state.freedom.joints).tolist()
        return within_limits(state.body.skeleton, rotations, self.given, self.loose, joints)

    @_once
    def _excess(self, state: State) -> Floats:
        """Return rotation vectors from the nearest rotations within the limits [N, J, 3], in the joints' frames."""
        off = rot.log(rot.inv_mul(self._allowed(state, state.rotations), state.rotations))
        return np.where(rot.norm(off)[..., None] > EDGE, off, 0.0)

    def _rows(self, state: State, normal: Normal, off: Floats, chosen: Bools) -> None:
        chosen[[0, -1]] = False
        for joint in np.flatnonzero(chosen.any(axis=0)).tolist():
            (frames,), (own, columns) = np.nonzero(chosen[:, joint]), state.freedom.of(joint)
            jacobian = state.own_axes[frames][:, None, own]
            normal.add_joint(frames, columns, jacobian, off[frames, joint], self.spread**-2.0)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        off = self._excess(state)
        self._rows(state, normal, off, np.any(off != 0.0, axis=2))
        normal.cost += float(np.sum(off[1:-1] ** 2)) * self.spread**-2.0

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        turned = np.zeros((*state.rotations.shape[:2], 3))
        for joint in np.unique(state.freedom.joints).tolist():
            own, columns = state.freedom.of(joint)
            turned[:, joint] = np.einsum("td,tdx->tx", step[:, columns], state.own_axes[:, own])
        then = rot.mul(state.rotations, rot.exp(turned))
        allowed = self._allowed(state, then)
        chosen = (rot.angle(allowed, then) > EDGE) & ~np.any(self._excess(state) != 0.0, axis=2)
        self._rows(state, normal, rot.log(rot.inv_mul(allowed, state.rotations)), chosen)
        return bool(chosen.any())

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.asarray(np.degrees(rot.norm(self._excess(state)).max(axis=1)))


@dataclass
class Speed(OneSided):
    """Bound the angular speed of the joints; for the root, tilt and turn about the vertical separately.

    Attributes:
        most: greatest speeds of the joints [J], rad/s; for the root, of its tilt.
        turns: greatest speed at which the root turns about the vertical, rad/s.
        fps: frames a second.
        spread: standard deviation of the excess, rad/s.
    """

    unit: ClassVar[str] = "degrees/s"

    most: Floats
    turns: float
    fps: float
    spread: float

    @_once
    def _velocities(self, state: State) -> Floats:
        """Return the angular velocities [N - 1, J, 3] in the joints' frames, rad/s; that of the root in the world."""
        joints, out = np.unique(state.freedom.joints), np.zeros((len(state.x) - 1, state.rotations.shape[1], 3))
        before, after = state.rotations[:-1, joints], state.rotations[1:, joints]
        out[:, joints] = self.fps * rot.log(rot.inv_mul(before, after))
        out[:, 0] = rot.mul_vec(state.rotations[:-1, 0], out[:, 0])
        return out

    def _excess(self, velocities: Floats) -> Floats:
        """Return the differences of velocities [N - 1, J, 3] from the nearest allowed, rad/s."""
        excess, root = _beyond(velocities, self.most), velocities[:, 0]
        excess[:, 0] = _beyond(root * (1.0 - UP), self.most[0]) + _beyond(root * UP, self.turns)
        return excess

    def _jacobian(self, state: State, velocities: Floats, joint: int, first: Indices) -> Floats:
        """Return the Jacobian of a joint's velocities from some frames to the next [R, 2, d, 3]."""
        axes = (state.own_axes if joint else state.axes)[:, state.freedom.of(joint)[0]]
        before, after = axes[first], axes[first + 1]
        if joint == 0:  # other joints' excess lies along their rotation, which the logarithm's Jacobian preserves
            turn = np.broadcast_to(velocities[first, :1] / self.fps, before.shape)
            before, after = inverse_right_jacobian(turn, before), inverse_right_jacobian(-turn, after)
        return self.fps * np.stack([-before, after], axis=1)

    def _rows(self, state: State, normal: Normal, velocities: Floats, off: Floats, chosen: Bools) -> None:
        """Add rows of the chosen velocities [N - 1, J], at differences [N - 1, J, 3] from the nearest allowed."""
        for joint in np.flatnonzero(chosen.any(axis=0)).tolist():
            (first,) = np.nonzero(chosen[:, joint])
            jacobian, columns = self._jacobian(state, velocities, joint, first), state.freedom.of(joint)[1]
            normal.add_joint(first, columns, jacobian, off[first, joint], self.spread**-2.0)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        velocities = self._velocities(state)
        excess = self._excess(velocities)
        self._rows(state, normal, velocities, excess, np.any(excess != 0.0, axis=2))
        normal.cost += float(np.sum(excess**2)) * self.spread**-2.0

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        now, every = self._velocities(state), np.arange(len(step) - 1)
        then = now.copy()
        for joint in np.unique(state.freedom.joints).tolist():
            columns = state.freedom.of(joint)[1]
            pairs = np.stack([step[:-1, columns], step[1:, columns]], axis=1)
            then[:, joint] += np.einsum("radx,rad->rx", self._jacobian(state, now, joint, every), pairs)
        excess = self._excess(then)
        chosen = np.any(excess != 0.0, axis=2) & ~np.any(self._excess(now) != 0.0, axis=2)
        self._rows(state, normal, now, now - (then - excess), chosen)
        return bool(chosen.any())

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        out = np.zeros(len(state.x))
        out[1:] = np.degrees(rot.norm(self._excess(self._velocities(state))).max(axis=1))
        return out


@dataclass
class Travel(OneSided):
    """Bound the speed or the acceleration of the root, except in flight.

    Attributes:
        order: 1 for its speed, 2 for its acceleration.
        axes: 1 for each axis that counts [3], else 0.
        most: the bound, m/s or m/s^2.
        free: where there is no bound, by difference [N - order].
        fps: frames a second.
        spread: standard deviation of the excess.
    """

    unit: ClassVar[str] = ""

    order: int
    axes: Floats
    most: float
    free: Bools
    fps: float
    spread: float

    def _moved(self, root: Floats) -> Floats:
        """Return the speed or acceleration [N - order, 3] of positions, or of changes of them, [N, 3]."""
        return np.asarray(self.fps**self.order * np.diff(root, self.order, axis=0) * self.axes)

    def _excess(self, moved: Floats) -> Floats:
        return _beyond(moved, self.most) * ~self.free[:, None]

    def _rows(self, normal: Normal, off: Floats, chosen: Bools) -> None:
        (first,) = np.nonzero(chosen)
        shares = self.fps**self.order * np.array([[-1.0, 1.0], [1.0, -2.0, 1.0]][self.order - 1])
        jacobian = np.tile(shares[:, None, None] * np.diag(self.axes), (len(first), 1, 1, 1))
        normal.add_joint(first, slice(0, 3), jacobian, off[first], self.spread**-2.0)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        excess = self._excess(self._moved(state.root))
        self._rows(normal, excess, np.any(excess != 0.0, axis=1))
        normal.cost += float(np.sum(excess**2)) * self.spread**-2.0

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        now = self._moved(state.root)
        then = now + self._moved(step[:, :3])
        excess = self._excess(then)
        chosen = np.any(excess != 0.0, axis=1) & ~np.any(self._excess(now) != 0.0, axis=1)
        self._rows(normal, now - (then - excess), chosen)
        return bool(chosen.any())

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.zeros(len(state.x))


@dataclass
class Collision(OneSided):
    """Keep limbs, as capsules, from overlapping more than they do in the corpus or at an end.

    While two legs overlap, a plane keeps them apart. It lies between them as they meet and as they part. Where these
    are opposite sides, as when a leg passes from in front of the other to behind it, the plane turns through the line
    from hip to hip, so that the legs open.

    Attributes:
        usual: overlap allowed to each pair of `Capsules.pairs` [P], metres.
        spread: standard deviation of the excess, metres.
        around: frames before legs meet and after they part in which the plane turns, too.
    """

    unit: ClassVar[str] = "cm"

    usual: Floats
    spread: float
    around: int
    _planes: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    _on_plane: Bools = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))

    def separate(self, state: State) -> None:
        """Find the planes between legs that overlap, or change sides between two frames: normals from right to left
        [N, 3], 0 for none."""
        deep, ways, _, _ = self._deep(state)
        legs, planes = self._legs(state), np.zeros((len(deep), 3))
        nearest = np.flatnonzero(legs)[deep[:, legs].argmax(axis=1)]
        frames, skeleton = np.arange(len(deep)), state.body.skeleton
        away, closest = ways[frames, nearest], deep[frames, nearest]
        sides = state.places[:, skeleton.index("left_hip")] - state.places[:, skeleton.index("right_hip")]
        sides /= np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), EDGE)
        passes = (np.sum(away[1:] * away[:-1], axis=1) < OPPOSITE) & (np.minimum(closest[1:], closest[:-1]) > -NEAR_M)
        meets = closest > 0.0
        meets[1:] |= passes
        meets[:-1] |= passes
        for begin, end in runs_of(sliding_max(meets, self.around)):
            before, after = away[max(begin - 1, 0)], away[min(end, len(away) - 1)]
            share = np.linspace(0.0, 1.0, end - begin + 2)[1:-1, None]
            if before @ after < OPPOSITE:
                first, last = np.maximum(1.0 - 2.0 * share, 0.0), np.maximum(2.0 * share - 1.0, 0.0)
                planes[begin:end] = first * before + (1.0 - first - last) * sides[begin:end] + last * after
            else:
                planes[begin:end] = (1.0 - share) * before + share * after
        planes /= np.maximum(np.linalg.norm(planes, axis=1, keepdims=True), EDGE)
        if len(self._planes):  # legs that have come apart stay on their sides
            planes = np.where(np.any(planes != 0.0, axis=1, keepdims=True), planes, self._planes)
        self._planes = planes
        # Later a pair that comes near would count with its whole distance from the plane at once, and steps be refused.
        self._on_plane = legs & np.any(planes != 0.0, axis=1, keepdims=True) & (deep > -NEAR_M)

    def _legs(self, state: State) -> Bools:
        """Return which pairs are of the two legs [P]."""
        capsules = capsules_of(state.body.skeleton)
        return np.asarray(np.array([name.endswith(LEG) for name in capsules.names])[capsules.pairs()].all(axis=1))

    @_once
    def _deep(self, state: State) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the excess overlap of the pairs [N, P], metres; directions from the second capsule to the first
        [N, P, 3]; the nearest points' shares of both axes [N, P, 2]; and the displacement between them [N, P, 3]."""
        capsules = capsules_of(state.body.skeleton)
        pairs = capsules.pairs()
        ends = capsules.place(np.ascontiguousarray(state.places[:, : 2 * len(state.body.skeleton)]))
        depths, ways, at = pair_depths(ends, capsules.radii, pairs)
        share = np.linspace(0.0, 1.0, len(depths))[:, None]
        deep = depths - np.maximum((1.0 - share) * depths[0] + share * depths[-1], self.usual)
        axes = ends[:, pairs]
        where = axes[..., 0, :] + at[..., None] * (axes[..., 1, :] - axes[..., 0, :])
        return deep, ways, at, where[:, :, 0] - where[:, :, 1]

    def _over(self, state: State) -> tuple[Floats, Floats, Floats]:
        """Return the excess overlap of the pairs [N, P], metres; the directions along which they part [N, P, 3]; and
        the nearest points' shares of both axes [N, P, 2]."""
        if not len(self._planes):
            self.separate(state)
        deep, ways, at, apart = self._deep(state)
        beyond = np.linalg.norm(apart, axis=2) - np.einsum("tpk,tk->tp", apart, self._planes)
        deep = deep + np.where(self._on_plane, beyond, 0.0)
        deep[[0, -1]] = -1.0
        return deep, np.where(self._on_plane[..., None], self._planes[:, None], ways), at

    def _rows(self, state: State, chosen: Bools, ways: Floats, at: Floats) -> Rows:
        capsules = capsules_of(state.body.skeleton)
        frames, which = np.nonzero(chosen)
        pairs, at = capsules.pairs()[which], at[frames, which]
        between = capsules.shares[pairs]
        along = between[..., 0] + at * (between[..., 1] - between[..., 0])
        points = capsules.points[pairs].reshape(-1, 4)
        shares = np.stack([along[:, 0] - 1.0, -along[:, 0], 1.0 - along[:, 1], along[:, 1]], axis=1)
        return Rows(frames, ways[frames, which], points, np.zeros_like(points), shares)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        deep, ways, at = self._over(state)
        pushes = deep > EDGE
        self._rows(state, pushes, ways, at).add_alike(state, normal, deep[pushes], self.spread)
        normal.cost += float(np.sum(deep[pushes] ** 2)) * self.spread**-2.0

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        deep, ways, at = self._over(state)
        chosen = (deep <= EDGE) & (deep > -NEAR_M)
        rows = self._rows(state, chosen, ways, at)
        return rows.add_broken(state, step, normal, deep[chosen], self.spread)

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.asarray(100.0 * np.maximum(self._deep(state)[0].max(axis=1), 0.0))
