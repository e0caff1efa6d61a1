"""The body in the solve: positions of its points and of its centre of mass, and their Jacobians.

A frame's unknowns are the displacement of the root (3), metres, then one angle for each *degree of freedom* d of a
joint, radians: a rotation about an axis e_d in the joint's own frame. A joint's rotation is the reference's times
exp(sum of x_d e_d). Most joints have three degrees of freedom, a hinge has one; a joint with none keeps the reference.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.contact import contact_points
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.body.support import masses_of
from motionmind.geometry import rotations as rot
from motionmind.jit import jit
from motionmind.solver.system import Normal

MAX_SERIES_RAD2 = 1e-8  # squared angle up to which series replace sine and cosine


class Body(NamedTuple):
    """The constants of a skeleton with J joints and P points: joints, tips and heels (`contact_points`).

    Attributes:
        skeleton: the skeleton.
        owners: the joint whose segment carries each point [P].
        local: positions of the points in their joints' frames [P, 3], metres.
        moves: `moves[p, j]` is whether a rotation of joint j moves point p [P, J]; no joint moves its own position.
        ancestors: `ancestors[j, i]` is whether joint i is joint j or an ancestor of it [J, J].
        mass_shares: share of the body's mass in each segment [J]; all of it in the root where masses are unknown.
        mass_centres: centres of these masses in the joints' frames [J, 3], metres.
        has_masses: whether masses are known.
    """

    skeleton: Skeleton
    owners: Indices
    local: Floats
    moves: Bools
    ancestors: Bools
    mass_shares: Floats
    mass_centres: Floats
    has_masses: bool


@remembered
def body_of(skeleton: Skeleton) -> Body:
    """Return the constants of a skeleton."""
    count = len(skeleton)
    places, owners = contact_points(skeleton, np.tile(rot.IDENTITY, (1, count, 1)), np.zeros((1, 3)))
    ancestors = np.zeros((count, count), dtype=np.bool_)
    for joint, parent in enumerate(skeleton.parents):
        ancestors[joint] = ancestors[parent] if joint else False
        ancestors[joint, joint] = True
    moves = ancestors[owners]
    moves[np.arange(count), np.arange(count)] = False
    masses = masses_of(skeleton)
    shares, centres = np.zeros(count), np.zeros((count, 3))
    shares[0] = 1.0
    if masses is not None:
        shares, centres = masses.shares, masses.centres
    return Body(skeleton, owners, places[0] - places[0][owners], moves, ancestors, shares, centres, masses is not None)


class Freedom(NamedTuple):
    """The degrees of freedom of a body: D angles.

    Attributes:
        joints: joint of each angle [D], increasing.
        axes: axis of each angle in the joint's frame [D, 3], unit vectors.
    """

    joints: Indices
    axes: Floats

    @property
    def unknowns(self) -> int:
        """The number of unknowns of a frame, 3 + D."""
        return 3 + len(self.joints)

    def slices(self, joint: int) -> tuple[slice, slice]:
        """Return the slices of a joint's angles and of its unknowns."""
        begin, end = np.searchsorted(self.joints, [joint, joint + 1]).tolist()
        return slice(begin, end), slice(3 + begin, 3 + end)


class State:
    """A movement near a reference, at given unknowns.

    Attributes:
        x: the unknowns [N, 3 + D].
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres.
        places: positions of the body's points [N, P, 3], metres.
        global_rotations: rotations of the joints in the world [N, J, 4].
        axes: derivative of the joint's rotation in the world by each angle [N, D, 3].
        own_axes: the same in the joint's own frame [N, D, 3].
    """

    def __init__(self, body: Body, freedom: Freedom, reference: Floats, root: Floats, x: Floats) -> None:
        self.body, self.freedom, self.x = body, freedom, x
        joints, axes, moved = freedom.joints, freedom.axes, np.unique(freedom.joints)
        turned = np.zeros((len(x), len(body.skeleton), 3))
        for joint in moved:
            own, columns = freedom.slices(joint)
            turned[:, joint] = x[:, columns] @ axes[own]
        self.rotations = reference.copy()
        self.rotations[:, moved] = rot.mul(reference[:, moved], rot.exp(turned[:, moved]))
        self.root = root + x[:, :3]
        self.global_rotations = body.skeleton.global_rotations(self.rotations)
        owners, count = body.owners, len(body.skeleton)
        self.places = np.empty((len(x), len(owners), 3))
        self.places[:, :count] = body.skeleton.positions(self.rotations, self.root)
        tips = rot.mul_vec(
            self.global_rotations[:, owners[count:]],
            np.broadcast_to(body.local[count:], (len(x), len(owners) - count, 3)),
        )
        self.places[:, count:] = self.places[:, owners[count:]] + tips
        self.own_axes = _right_jacobian(turned[:, joints], axes)
        self.axes = rot.mul_vec(self.global_rotations[:, joints], self.own_axes)

    @cached_property
    def mass(self) -> Floats:
        """Position of the centre of mass [N, 3], metres."""
        return np.asarray(self._moments[:, 0])

    @cached_property
    def _moments(self) -> Floats:
        """Sum of mass share times position over each joint and its descendants [N, J, 3], metres."""
        body, count = self.body, len(self.body.skeleton)
        centres = np.broadcast_to(body.mass_centres, (len(self.x), count, 3))
        own = self.places[:, :count] + rot.mul_vec(self.global_rotations, centres)
        heavy = slice(None) if body.has_masses else slice(1)  # all of it in the root
        shares = body.ancestors[heavy] * body.mass_shares[heavy, None]
        return np.asarray(np.einsum("ij,tik->tjk", shares, own[:, heavy]))

    @cached_property
    def mass_jacobian(self) -> Floats:
        """Jacobian of the centre of mass [N, 3, 3 + D]."""
        body, joints = self.body, self.freedom.joints
        below = body.ancestors.T @ body.mass_shares
        lever = self._moments[:, joints] - below[joints, None] * self.places[:, joints]
        out = np.zeros((len(self.x), 3, self.freedom.unknowns))
        out[:, range(3), range(3)] = 1.0
        out[:, :, 3:] = np.swapaxes(rot.cross(self.axes, lever), 1, 2)
        return out


class Rows(NamedTuple):
    """Rows in the positions of points: sum_k coefficients[k] direction . place(points[k], first + offsets[k]).

    Attributes:
        first: first frame of each row [R].
        directions: vectors [R, 3].
        points: point numbers [R, K].
        offsets: frames from the first to that of each point [R, K], 0 to 2.
        coefficients: factors of the points [R, K].
    """

    first: Indices
    directions: Floats
    points: Indices
    offsets: Indices
    coefficients: Floats

    def changes(self, state: State, step: Floats) -> Floats:
        """Return the first-order change of the rows [R] under a step [N, 3 + D]."""
        out = np.zeros(len(self.first))
        _change(self, _geometry_of(state), step, out)
        return out

    def add(self, state: State, normal: Normal, residual: Floats, weight: Floats) -> None:
        """Add the squared rows to the normal equations, with their residuals [R] and weights [R]."""
        _add(self, _geometry_of(state), residual, weight, normal.blocks, normal.gradient)

    def add_uniform(self, state: State, normal: Normal, residual: Floats, sd: float) -> None:
        """Add the squared rows with their residuals [R], all of one standard deviation."""
        self.add(state, normal, residual, np.full(len(self.first), sd**-2.0))

    def add_broken(self, state: State, step: Floats, normal: Normal, residual: Floats, sd: float) -> bool:
        """Add the rows whose residuals [R] a step [N, 3 + D] makes positive, and return whether there are any."""
        broken = residual + self.changes(state, step) > 0.0
        first, directions, points, offsets, coefficients = self
        rows = Rows(first[broken], directions[broken], points[broken], offsets[broken], coefficients[broken])
        rows.add_uniform(state, normal, residual[broken], sd)
        return bool(broken.any())


def rows_at(first: Indices, directions: Floats, points: Indices) -> Rows:
    """Return rows of one point [R] in one frame [R] each, along directions [R, 3]."""
    one = np.ones((len(first), 1))
    return Rows(first, directions, points[:, None], np.zeros_like(one, dtype=np.int64), one)


class _Geometry(NamedTuple):
    """The body at a state, as compiled functions take it.

    Attributes:
        places: positions of the points [N, P, 3], metres.
        axes: axes of the angles in the world [N, D, 3].
        joints: joint of each angle [D].
        moves: whether each angle moves a point [P, D].
    """

    places: Floats
    axes: Floats
    joints: Indices
    moves: Bools


def _geometry_of(state: State) -> _Geometry:
    """Return the geometry of a state."""
    joints = state.freedom.joints
    return _Geometry(state.places, state.axes, joints, np.ascontiguousarray(state.body.moves[:, joints]))


@jit
def _add_jacobian(t: int, direction: Floats, point: int, coefficient: float, body: _Geometry, out: Floats) -> None:
    """Add a point's Jacobian along a direction, times a coefficient, to a row [3 + D]."""
    places, axes, joints = body.places, body.axes, body.joints
    x, y, z = coefficient * direction[0], coefficient * direction[1], coefficient * direction[2]
    out[0] += x
    out[1] += y
    out[2] += z
    for d in range(len(joints)):
        if body.moves[point, d]:
            joint = joints[d]
            a, b, c = (
                places[t, point, 0] - places[t, joint, 0],
                places[t, point, 1] - places[t, joint, 1],
                places[t, point, 2] - places[t, joint, 2],
            )
            e, f, g = axes[t, d, 0], axes[t, d, 1], axes[t, d, 2]
            out[3 + d] += x * (f * c - g * b) + y * (g * a - e * c) + z * (e * b - f * a)


@jit
def _add(rows: Rows, body: _Geometry, residual: Floats, weight: Floats, blocks: Floats, gradient: Floats) -> None:
    """Add squared rows, with their residuals and weights [R], to `Normal.blocks` and `Normal.gradient`."""
    n = gradient.shape[1]
    row, at, held = np.zeros((3, n)), np.empty(3 * n, np.int64), np.empty(3 * n)
    for r in range(len(rows.first)):
        if weight[r] == 0.0:
            continue
        span = 0
        for k in range(rows.points.shape[1]):
            span = max(span, rows.offsets[r, k] + 1)
        row[:span] = 0.0
        for k in range(rows.points.shape[1]):
            offset = rows.offsets[r, k]
            t, coefficient = rows.first[r] + offset, rows.coefficients[r, k]
            _add_jacobian(t, rows.directions[r], rows.points[r, k], coefficient, body, row[offset])
        count = 0  # entries that are not 0, by frame and unknown
        for a in range(span):
            for i in range(n):
                if row[a, i] != 0.0:
                    at[count], held[count] = a * n + i, row[a, i]
                    count += 1
        for p in range(count):
            a, i = at[p] // n, at[p] % n
            t, weighted = rows.first[r] + a, weight[r] * held[p]
            gradient[t, i] += weighted * residual[r]
            for q in range(p, count):
                blocks[t, i, at[q] - a * n] += weighted * held[q]


@jit
def _change(rows: Rows, body: _Geometry, step: Floats, out: Floats) -> None:
    """Add the first-order change of each row under a step [N, 3 + D] to `out` [R]."""
    row = np.empty(step.shape[1])
    for r in range(len(rows.first)):
        for k in range(rows.points.shape[1]):
            t = rows.first[r] + rows.offsets[r, k]
            row[:] = 0.0
            _add_jacobian(t, rows.directions[r], rows.points[r, k], rows.coefficients[r, k], body, row)
            for i in range(len(row)):
                out[r] += row[i] * step[t, i]


def _right_jacobian(turned: Floats, axes: Floats) -> Floats:
    """Return the right Jacobian of SO(3) at rotation vectors [N, D, 3], times axes [D, 3].

    J(v) e = e - b v x e + c v x (v x e), b = (1 - cos |v|) / |v|^2, c = (|v| - sin |v|) / |v|^3. Source: Chirikjian,
    "Stochastic Models, Information Theory, and Lie Groups", volume 2 (2012), chapter 10.
    """
    square = np.sum(turned * turned, axis=-1)[..., None]
    size = np.sqrt(np.maximum(square, MAX_SERIES_RAD2))
    b = np.where(square < MAX_SERIES_RAD2, 0.5 - square / 24.0, (1.0 - np.cos(size)) / size**2)
    c = np.where(square < MAX_SERIES_RAD2, 1.0 / 6.0 - square / 120.0, (size - np.sin(size)) / size**3)
    across = rot.cross(turned, np.broadcast_to(axes, turned.shape))
    return np.asarray(axes - b * across + c * rot.cross(turned, across))


def inverse_right_jacobian(turned: Floats, vectors: Floats) -> Floats:
    """Return the inverse of the right Jacobian of SO(3) at rotation vectors [..., 3], times vectors [..., 3].

    The inverse of the left Jacobian is this at -v, or its transpose. J^-1(v) e = e + v x e / 2 + d v x (v x e),
    d = (1 - (|v| / 2) cot (|v| / 2)) / |v|^2. Source: as for `_right_jacobian`.
    """
    square = np.sum(turned * turned, axis=-1)[..., None]
    half = 0.5 * np.sqrt(np.maximum(square, MAX_SERIES_RAD2))
    d = np.where(square < MAX_SERIES_RAD2, 1.0 / 12.0 + square / 720.0, (1.0 - half / np.tan(half)) / (4.0 * half**2))
    across = rot.cross(turned, vectors)
    return np.asarray(vectors + 0.5 * across + d * rot.cross(turned, across))
