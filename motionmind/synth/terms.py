"""Terms of the solve: each adds its squared residuals, in units of their standard deviations, to one system.

A term says what a movement should be like, and how firmly. `add(state, normal)` adds its rows, linearised at a state;
`gives(state)` returns its residual frame by frame, in the unit that reports name. One-sided terms push back only the
excess over their bounds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Protocol

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
NEAR_M = 0.06  # between legs that may pass through each other from one frame to the next
OPPOSITE = 0.2  # cosine between the directions from leg to leg below which they have changed sides
EDGE = 1e-6  # in a term's unit: tolerance of its bound


class Term(Protocol):
    """A sum of squares over a movement.

    Attributes:
        unit: unit of `gives`; empty for a term that reports omit.
    """

    unit: ClassVar[str]

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows, linearised at a state, and the cost there."""

    def gives(self, state: State) -> Floats:
        """Return the residual in each frame [N], in the unit that reports name."""


class OneSided:
    """Rows that push one way: while beyond their bounds, or while they would still push after the last step.

    This is the primal-dual active set. Rows released as soon as they are satisfied return in the next iteration, and
    limbs that touch chatter without end. Source: Hintermüller, Ito and Kunisch, "The primal-dual active set
    strategy as a semismooth Newton method", SIAM Journal on Optimization 13 (2002).
    """

    _kept: Bools | None = None
    _active: tuple[Indices, ...]
    _left: Floats

    def _activate(self, over: Floats) -> tuple[Indices, ...]:
        """Return the indices of the rows that push; `over` is the excess over the bound, negative within it."""
        pushes = over > EDGE
        if self._kept is not None:
            pushes |= self._kept
        self._active = np.nonzero(pushes)
        self._left = over[self._active]
        return self._active

    def after(self, state: State, step: Floats) -> None:
        """Note which rows would still push after a step [N, n] from a state."""
        raise NotImplementedError

    def _keep(self, shape: tuple[int, ...], changes: Floats) -> None:
        """Remember the rows that still push after a step with these changes."""
        self._kept = np.zeros(shape, dtype=np.bool_)
        self._kept[self._active] = self._left + changes > 0.0


@dataclass
class Track:
    """Stay near the reference.

    Attributes:
        spreads: standard deviations of the unknowns in each frame [N, n], metres and radians.
    """

    unit: ClassVar[str] = "degrees"

    spreads: Floats

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        weight = self.spreads**-2.0
        diagonal = np.arange(state.x.shape[1])
        normal.block(0)[:, diagonal, diagonal] += weight
        normal.gradient += weight * state.x
        normal.cost += float(np.sum(weight * state.x**2))

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.asarray(np.degrees(np.abs(state.x[:, 3:]).max(axis=1, initial=0.0)))


@dataclass
class Run:
    """Depart from the reference slowly, which keeps its accelerations: second differences of the unknowns.

    Unknowns are 0 before the first frame and after the last.

    Attributes:
        spreads: standard deviations of these differences [n], metres and radians per frame squared.
    """

    unit: ClassVar[str] = ""

    spreads: Floats

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        weight, x = self.spreads**-2.0, state.x
        padded = np.zeros((len(x) + 4, x.shape[1]))
        padded[2:-2] = x
        bends = np.diff(padded, 2, axis=0)
        normal.cost += float(np.sum(weight * bends**2))
        normal.gradient += weight * np.diff(bends, 2, axis=0)
        diagonal = np.arange(x.shape[1])
        for k, share in enumerate((6.0, -4.0, 1.0)):
            normal.block(k)[: len(x) - k, diagonal, diagonal] += share * weight

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.zeros(len(state.x))


@dataclass
class Ballistic:
    """Let the centre of mass fall freely in flight, and accelerate it as little as possible in stance.

    Attributes:
        fps: frames a second.
        falling: whether it is in flight in each inner frame [N - 2].
        gravity: m/s^2.
        push: standard deviations of its acceleration in stance, level and vertical, m/s^2.
        falls: standard deviation of its departure from free fall, m/s^2.
    """

    unit: ClassVar[str] = "m/s^2"

    fps: float
    falling: Bools
    gravity: float
    push: tuple[float, float]
    falls: float

    def _residual(self, state: State) -> Floats:
        residual = self.fps**2 * np.diff(state.mass, 2, axis=0)
        residual[self.falling, 1] += self.gravity
        return np.asarray(residual)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        residual, first = self._residual(state), np.arange(len(state.x) - 2)
        level, vertical = self.push
        weight = np.where(self.falling[:, None], self.falls, (level, vertical, level)) ** -2.0
        shares, axes = self.fps**2 * np.array([1.0, -2.0, 1.0]), np.arange(3)
        for a in range(3):
            normal.pull[first + a] += shares[a] * weight * residual
            for b in range(a, 3):
                normal.weights[b - a, first[:, None] + a, axes, axes] += shares[a] * shares[b] * weight
        normal.cost += float(np.sum(weight * residual**2))

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        out = np.zeros(len(state.x))
        out[1:-1] = np.where(self.falling, np.linalg.norm(self._residual(state), axis=1), 0.0)
        return out


@dataclass
class Contacts:
    """Bring points to their targets, and let supporting points slide no more than the dancer's.

    Attributes:
        frames: frames of the targets [M].
        points: point numbers [M].
        targets: target positions [M, 3], metres.
        spreads: standard deviations of each coordinate [M, 3], metres; infinite where it is free.
        stands: whether the point is to stand there [M].
        grips: points that may support the body [Q].
        moves: their target displacements from frame to frame [N - 1, Q, 2], level, metres.
        slips: standard deviations of these [N - 1, Q], metres; infinite for a point that bears nothing.
        reach: distance from its target beyond which the pull on a point is constant, metres.
    """

    unit: ClassVar[str] = "cm"

    frames: Indices
    points: Indices
    targets: Floats
    spreads: Floats
    stands: Bools
    grips: Indices
    moves: Floats
    slips: Floats
    reach: float = 0.02

    @cached_property
    def _placed(self) -> tuple[Indices, Indices, Rows]:
        """The target and the axis of each coordinate that is not free [R], and their rows."""
        target, axis = np.nonzero(np.isfinite(self.spreads))
        return target, axis, rows_at(self.frames[target], np.eye(3)[axis], self.points[target])

    @cached_property
    def _held(self) -> tuple[Indices, Indices, Indices, Rows]:
        """The first frame, the grip and the level axis of each displacement that counts [R], and their rows."""
        first, grip = (np.repeat(found, 2) for found in np.nonzero(np.isfinite(self.slips)))
        axis = np.arange(len(first)) % 2
        points, after = np.repeat(self.grips[grip][:, None], 2, axis=1), np.tile([0, 1], (len(first), 1))
        shares = np.tile([-1.0, 1.0], (len(first), 1))
        return first, grip, axis, Rows(first, np.eye(3)[2 * axis], points, after, shares)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        off, weight = state.places[self.frames, self.points] - self.targets, self.spreads**-2.0
        for axes in ([0, 2], [1]):  # level, and height: the standard deviations of each are alike
            own = off[:, axes] * (weight[:, axes] > 0.0)
            share = 1.0 / np.maximum(1.0, np.linalg.norm(own, axis=1) / self.reach)
            normal.cost += float(np.sum(share * (2.0 - share) * np.sum(weight[:, axes] * own**2, axis=1)))
            weight[:, axes] *= share[:, None]
        target, axis, rows = self._placed
        rows.add(state, normal.blocks, normal.gradient, off[target, axis], weight[target, axis])
        first, grip, axis, rows = self._held
        slid, weight = self._slid(state)[first, grip, axis], self.slips[first, grip] ** -2.0
        normal.cost += float(np.sum(weight * slid**2))
        rows.add(state, normal.blocks, normal.gradient, slid, weight)

    @classmethod
    def joined(cls, parts: list[Contacts], begins: list[int], count: int) -> Contacts:
        """Return the contacts of a movement of `count` frames, from those of its parts and their first frames."""
        grips = np.unique(np.concatenate([part.grips for part in parts]))
        moves, slips = np.zeros((count - 1, len(grips), 2)), np.full((count - 1, len(grips)), np.inf)
        for begin, part in zip(begins, parts, strict=True):
            at, here = np.searchsorted(grips, part.grips), slice(begin, begin + len(part.moves))
            moves[here, at], slips[here, at] = part.moves, part.slips
        return cls(
            np.concatenate([begin + part.frames for begin, part in zip(begins, parts, strict=True)]),
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.targets for part in parts]),
            np.concatenate([part.spreads for part in parts]),
            np.concatenate([part.stands for part in parts]),
            grips,
            moves,
            slips,
        )

    def part(self, frames: slice) -> Contacts:
        """Return the contacts of a slice of the frames."""
        here = (self.frames >= frames.start) & (self.frames < frames.stop)
        between = slice(frames.start, frames.stop - 1)
        return Contacts(
            self.frames[here] - frames.start,
            self.points[here],
            self.targets[here],
            self.spreads[here],
            self.stands[here],
            self.grips,
            self.moves[between],
            self.slips[between],
        )

    def _slid(self, state: State) -> Floats:
        return np.asarray(np.diff(state.places[:, self.grips][..., [0, 2]], axis=0) - self.moves)

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        out, off = np.zeros(len(state.x)), state.places[self.frames, self.points] - self.targets
        firm = self.stands & (self.spreads[:, 1] < 2.0 * self.spreads[:, 1].min(initial=np.inf, where=self.stands))
        np.maximum.at(out, self.frames[firm], 100.0 * np.abs(off[firm, 1]))
        return out


@dataclass
class Floor(OneSided):
    """Keep points above the floor.

    Attributes:
        floor: its height [N], metres.
        spread: standard deviation of the depth, metres.
    """

    unit: ClassVar[str] = "cm"

    floor: Floats
    spread: float

    def _deep(self, state: State) -> Floats:
        return np.asarray(self.floor[:, None] - state.places[..., 1])

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        deep = self._deep(state)
        deep[[0, -1]] = -1.0
        frames, points = self._activate(deep)
        self._rows = rows_at(frames, np.tile(-UP, (len(frames), 1)), points)
        self._rows.add(state, normal.blocks, normal.gradient, self._left, np.full(len(frames), self.spread**-2.0))
        normal.cost += float(np.sum(np.maximum(deep, 0.0) ** 2)) * self.spread**-2.0

    def after(self, state: State, step: Floats) -> None:
        """Keep the active rows; see `OneSided.after`."""
        self._keep(state.places.shape[:2], self._rows.changes(state, step))

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.asarray(100.0 * np.maximum(self._deep(state).max(axis=1), 0.0))


@dataclass
class Balance:
    """Keep the zero-moment point and the centre of mass within their allowed distances from the support.

    The zero-moment point is where the floor's force acts, c - (h / g) c'' for a centre of mass c at height h. Source:
    Kajita et al., "Biped walking pattern generation by using preview control of zero-moment point", ICRA (2003).

    Attributes:
        touches: which points support the body [N, P].
        floor: its height [N], metres.
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

    def _excess(self, state: State) -> tuple[Floats, Floats]:
        """Return the excess displacement of both points from the support in inner frames [2, N - 2, 2], metres, and h /
        g, frames squared [N - 2]."""
        mass, level = state.mass, state.mass[:, [0, 2]]
        lever = np.maximum(mass[1:-1, 1] - self.floor[1:-1], 0.1) / self.gravity * self.fps**2
        pressure = level.copy()
        pressure[1:-1] -= lever[:, None] * np.diff(level, 2, axis=0)
        points = np.ascontiguousarray(state.places[..., [0, 2]])
        excess = np.empty((2, len(lever), 2))
        for which, (point, room) in enumerate(((pressure, self.room), (level, self.overhang))):
            off = point - nearest_in_support(points, self.touches, point)
            far = np.linalg.norm(off[[0, -1]], axis=1)
            excess[which] = _beyond(off, np.maximum(np.maximum(far[0] * self.near[0], far[1] * self.near[1]), room))[
                1:-1
            ]
        return excess, lever

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        excess, lever = self._excess(state)
        shares = np.zeros((2, len(lever), 3))
        shares[0] = np.stack([-lever, 1.0 + 2.0 * lever, -lever], axis=1)
        shares[1, :, 1] = 1.0
        size = np.linalg.norm(excess, axis=2)
        eased = np.sqrt(1.0 + (size / self.reach) ** 2)
        normal.cost += float(np.sum(2.0 * (self.reach / self.spread) ** 2 * (eased - 1.0)))
        for which in range(2):
            (first,) = np.nonzero(size[which] > EDGE)
            weight = self.spread**-2.0 / eased[which, first]
            for axis in range(2):
                ways = shares[which, first][:, :, None] * np.eye(3)[2 * axis]
                normal.add_mass(first, ways, excess[which, first, axis], weight)

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        out = np.zeros(len(state.x))
        out[1:-1] = 100.0 * np.linalg.norm(self._excess(state)[0][1], axis=1)
        return out


@dataclass
class Limits:
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

    def _beyond(self, state: State) -> tuple[Floats, Floats]:
        """Return the excess over the limits: rotation vectors in the joints' frames [N, J, 3], and angles [N, J]."""
        joints = np.unique(state.freedom.joints)
        now = within_limits(state.body.skeleton, state.rotations, self.given, self.loose, joints.tolist())
        off = np.zeros((*now.shape[:2], 3))
        off[:, joints] = rot.log(rot.inv_mul(now[:, joints], state.rotations[:, joints]))
        return off, rot.norm(off)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        off, size = self._beyond(state)
        size[[0, -1]] = 0.0
        frames, joints = np.nonzero(size > EDGE)
        beyond = size[frames, joints]
        ways = off[frames, joints] / beyond[:, None]
        for joint in np.unique(joints):
            some, own, columns = joints == joint, *state.freedom.of(joint)
            along = np.einsum("rdk,rk->rd", state.own_axes[frames[some]][:, own], ways[some])
            normal.add_joint(frames[some], columns, along[:, None, :, None], beyond[some, None], self.spread**-2.0)
        normal.cost += float(np.sum(beyond**2)) * self.spread**-2.0

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.asarray(np.degrees(self._beyond(state)[1].max(axis=1)))


@dataclass
class Speed:
    """Bound the angular speed of the joints; that of the root by how it tilts, and by how it turns about the vertical.

    Attributes:
        most: greatest speeds of the joints [J], rad/s; of the root, how fast it tilts.
        turns: greatest speed at which the root turns about the vertical, rad/s.
        fps: frames a second.
        spread: standard deviation of the excess, rad/s.
    """

    unit: ClassVar[str] = "degrees/s"

    most: Floats
    turns: float
    fps: float
    spread: float

    def _excess(self, state: State) -> tuple[Floats, Floats]:
        """Return the turn of joints from frame to frame, radians, and their excess angular velocity [N - 1, J, 3].

        Both are in the joints' frames, those of the root in the world. The excess leads to the nearest velocity that is
        allowed: along the excess speed alone, rows would overshoot as it turns.
        """
        joints, turned = np.unique(state.freedom.joints), np.zeros((len(state.x) - 1, state.rotations.shape[1], 3))
        before, after = state.rotations[:-1, joints], state.rotations[1:, joints]
        turned[:, joints] = rot.log(rot.inv_mul(before, after))
        turned[:, 0] = rot.mul_vec(state.rotations[:-1, 0], turned[:, 0])
        excess = _beyond(self.fps * turned, self.most)
        root = self.fps * turned[:, 0]
        excess[:, 0] = _beyond(root * (1.0 - UP), self.most[0]) + _beyond(root * UP, self.turns)
        return turned, excess

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        turned, excess = self._excess(state)
        for joint in np.flatnonzero(np.any(excess != 0.0, axis=(0, 2))):
            (first,) = np.nonzero(np.any(excess[:, joint] != 0.0, axis=1))
            own, columns = state.freedom.of(joint)
            axes = (state.own_axes if joint else state.axes)[:, own]
            before, after = axes[first], axes[first + 1]
            if joint == 0:  # the others' excess is along their turn, which these leave as it is
                turn = np.broadcast_to(turned[first, :1], before.shape)
                before, after = inverse_right_jacobian(turn, before), inverse_right_jacobian(-turn, after)
            jacobian = self.fps * np.stack([-before, after], axis=1)
            normal.add_joint(first, columns, jacobian, excess[first, joint], self.spread**-2.0)
        normal.cost += float(np.sum(excess**2)) * self.spread**-2.0

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        out = np.zeros(len(state.x))
        out[1:] = np.degrees(rot.norm(self._excess(state)[1]).max(axis=1))
        return out


def _beyond(vectors: Floats, most: Floats | float) -> Floats:
    """Return the part of vectors [..., 3] beyond a length [...]."""
    size = np.linalg.norm(vectors, axis=-1)
    return np.asarray(vectors * np.maximum(1.0 - most / np.maximum(size, EDGE), 0.0)[..., None])


@dataclass
class Travel:
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

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        excess = _beyond(self.fps**self.order * np.diff(state.root, self.order, axis=0) * self.axes, self.most)
        (first,) = np.nonzero(~self.free & np.any(excess != 0.0, axis=1))
        excess = excess[first]
        shares = self.fps**self.order * np.array([[-1.0, 1.0], [1.0, -2.0, 1.0]][self.order - 1])
        for axis in np.flatnonzero(self.axes):
            shape = len(first), len(shares)
            after = np.broadcast_to(np.arange(len(shares)), shape).copy()
            ways, points = np.tile(np.eye(3)[axis], (len(first), 1)), np.zeros(shape, dtype=np.int64)
            rows = Rows(first, ways, points, after, np.broadcast_to(shares, shape).copy())
            weight = np.full(len(first), self.spread**-2.0)
            rows.add(state, normal.blocks, normal.gradient, np.ascontiguousarray(excess[:, axis]), weight)
        normal.cost += float(np.sum(excess**2)) * self.spread**-2.0

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

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        capsules = capsules_of(state.body.skeleton)
        if not len(self._planes):
            self.separate(state)
        deep, ways, at, apart = self._deep(state)
        on_plane = self._on_plane
        beyond = np.linalg.norm(apart, axis=2) - np.einsum("tpk,tk->tp", apart, self._planes)
        deep += np.where(on_plane, beyond, 0.0)
        deep[[0, -1]] = -1.0
        frames, which = self._activate(deep)
        pull = np.where(on_plane[..., None], self._planes[:, None], ways)[frames, which]
        pairs, at = capsules.pairs()[which], at[frames, which]
        between = capsules.shares[pairs]
        along = between[..., 0] + at * (between[..., 1] - between[..., 0])
        points = capsules.points[pairs].reshape(-1, 4)
        shares = np.stack([along[:, 0] - 1.0, -along[:, 0], 1.0 - along[:, 1], along[:, 1]], axis=1)
        self._rows = Rows(frames, pull, points, np.zeros_like(points), shares)
        self._rows.add(state, normal.blocks, normal.gradient, self._left, np.full(len(frames), self.spread**-2.0))
        normal.cost += float(np.sum(np.maximum(self._left, 0.0) ** 2)) * self.spread**-2.0

    def after(self, state: State, step: Floats) -> None:
        """Keep the active rows; see `OneSided.after`."""
        self._keep((len(step), len(self.usual)), self._rows.changes(state, step))

    def gives(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.gives`."""
        return np.asarray(100.0 * np.maximum(self._deep(state)[0].max(axis=1), 0.0))
