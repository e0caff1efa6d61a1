"""Where a body's points and its mass are, and how they change with its unknowns."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import ant
from moved import HUMAN, differences, freedom_of, moved, random_rotations, random_state

from motionmind.body.contact import contact_points
from motionmind.body.support import centre_of_mass
from motionmind.geometry import rotations as rot
from motionmind.solver.kinematics import MAX_SERIES_RAD2, Rows, State, body_of, rows_at
from motionmind.solver.system import Normal

# Of unknowns: none; on both sides of where sines give way to their series; as a solve has them; past half a turn.
SIZES = [0.0, 0.3 * MAX_SERIES_RAD2**0.5, MAX_SERIES_RAD2**0.5, 0.1, 2.0]


@pytest.mark.parametrize("size", SIZES)
def test_points_and_mass_are_where_the_turned_body_has_them(size: float) -> None:
    state = random_state(1, size)
    places, _ = contact_points(HUMAN, state.rotations, state.root)
    np.testing.assert_allclose(state.places, places, atol=1e-12)
    mass = centre_of_mass(HUMAN, state.rotations, state.root)
    assert mass is not None
    np.testing.assert_allclose(state.mass, mass, atol=1e-12)


def test_a_movement_without_unknowns_is_its_reference() -> None:
    state = random_state(2, 0.0)
    np.testing.assert_allclose(state.rotations, random_rotations(HUMAN, len(state.x), 0.2, 2), atol=1e-15)
    held = np.setdiff1d(np.arange(len(HUMAN)), state.freedom.joints)
    far = moved(state, np.ones(state.x.shape))
    np.testing.assert_array_equal(far.rotations[:, held], state.rotations[:, held])


@pytest.mark.parametrize("size", SIZES)
def test_the_jacobian_of_every_point_is_that_of_central_differences(size: float) -> None:
    state = random_state(3, size, frames=2)
    wanted = differences(lambda there: there.places, state)
    points, ways = np.arange(state.places.shape[1]), np.eye(3)
    for t in range(len(state.x)):
        for axis in range(3):
            rows = rows_at(np.full(len(points), t), np.tile(ways[axis], (len(points), 1)), points)
            for index in np.ndindex(state.x.shape):
                step = np.zeros(state.x.shape)
                step[index] = 1.0
                np.testing.assert_allclose(rows.changes(state, step), wanted[index][t, :, axis], atol=1e-8)


@pytest.mark.parametrize("size", SIZES)
def test_the_jacobian_of_the_mass_is_that_of_central_differences(size: float) -> None:
    state = random_state(4, size)
    wanted = differences(lambda there: there.mass, state)
    for t in range(len(state.x)):
        np.testing.assert_allclose(state.mass_jacobian[t].T, wanted[t, :, t], atol=1e-8)
        assert not np.any(np.delete(wanted[t], t, axis=1))


@pytest.mark.parametrize("size", SIZES)
def test_axes_are_how_fast_joints_turn(size: float) -> None:
    state, width = random_state(5, size, frames=2), 1e-5
    for d, joint in enumerate(state.freedom.joints):
        step = np.zeros(state.x.shape)
        step[:, 3 + d] = width
        after, before = moved(state, step), moved(state, -step)
        own = rot.log(rot.inv_mul(before.rotations[:, joint], after.rotations[:, joint])) / (2.0 * width)
        world = rot.log(rot.mul_inv(after.global_rotations[:, joint], before.global_rotations[:, joint])) / (
            2.0 * width
        )
        np.testing.assert_allclose(state.own_axes[:, d], own, atol=1e-8)
        np.testing.assert_allclose(state.axes[:, d], world, atol=1e-8)


@pytest.mark.parametrize(
    ("size", "rounding"), [(0.2 * MAX_SERIES_RAD2**0.5, 1e-15), (5.0 * MAX_SERIES_RAD2**0.5, 2e-12), (1.0, 1e-14)]
)
def test_axes_are_the_sum_of_their_series(size: float, rounding: float) -> None:
    """J(v) e = sum_k (-v x)^k e / (k + 1)!; closed forms lose digits near zero."""
    state = random_state(6, size, frames=3)
    for joint in np.unique(state.freedom.joints):
        own, columns = state.freedom.slices(joint)
        axes = state.freedom.axes[own]
        turned = np.repeat((state.x[:, columns] @ axes)[:, None], len(axes), axis=1)
        term = wanted = np.broadcast_to(axes, turned.shape)
        for k in range(1, 40):
            term = -np.cross(turned, term) / (k + 1)
            wanted = wanted + term
        np.testing.assert_allclose(state.own_axes[:, own], wanted, rtol=0.0, atol=rounding)


def test_a_body_of_unknown_masses_has_them_in_its_root() -> None:
    insect = ant()
    body, freedom = body_of(insect), freedom_of(insect, balls=("body", "left_mid_femur"), hinges=("left_mid_tibia",))
    state = State(body, freedom, random_rotations(insect, 3, 0.5, 0), np.ones((3, 3)), np.full((3, 10), 0.1))
    assert not body.has_masses
    np.testing.assert_allclose(state.mass, state.root, atol=1e-15)
    np.testing.assert_allclose(state.mass_jacobian, np.tile(np.eye(3, 10), (3, 1, 1)), atol=1e-15)


def test_a_body_of_a_single_frame_and_no_free_joint_only_moves() -> None:
    freedom = freedom_of(HUMAN, balls=(), hinges=())
    step = np.array([[1.0, 2.0, 3.0]])
    reference = random_rotations(HUMAN, 1, 0.5, 0)
    still = State(body_of(HUMAN), freedom, reference, np.zeros((1, 3)), np.zeros((1, 3)))
    there = State(body_of(HUMAN), freedom, reference, np.zeros((1, 3)), step)
    np.testing.assert_allclose(there.places - still.places, np.broadcast_to(step, still.places.shape), atol=1e-12)
    np.testing.assert_allclose(there.mass - still.mass, step, atol=1e-12)


def random_rows(state: State, seed: int, count: int = 40) -> Rows:
    """Rows about three points each, some of them the same, in up to three frames."""
    rng = np.random.default_rng(seed)
    return Rows(
        rng.integers(0, len(state.x) - 2, count),
        rng.normal(size=(count, 3)),
        rng.integers(0, state.places.shape[1], (count, 3)),
        rng.integers(0, 3, (count, 3)),
        rng.normal(size=(count, 3)),
    )


def dense(rows: Rows, state: State) -> np.ndarray:
    """The rows' Jacobian [R, N n], by central differences of what the rows say they are about."""

    def about(there: State) -> np.ndarray:
        places = there.places[rows.first[:, None] + rows.offsets, rows.points]
        return np.asarray(np.einsum("rk,rx,rkx->r", rows.coefficients, rows.directions, places))

    return differences(about, state).reshape(state.x.size, -1).T


@pytest.mark.parametrize("seed", range(3))
def test_rows_of_several_points_and_frames_add_what_a_dense_jacobian_does(seed: int) -> None:
    state, rng = random_state(seed, 0.3, frames=5), np.random.default_rng(seed)
    rows = random_rows(state, seed)
    jacobian, residual, weight = dense(rows, state), rng.normal(size=40), rng.uniform(0.0, 1.0, 40)
    weight[::7] = 0.0
    step = rng.normal(size=state.x.shape)
    np.testing.assert_allclose(rows.changes(state, step), jacobian @ step.ravel(), atol=1e-6)
    normal = Normal(*state.x.shape)
    rows.add(state, normal, residual, weight)
    np.testing.assert_allclose(normal.gradient.ravel(), jacobian.T @ (weight * residual), atol=1e-6)
    count, n = state.x.shape
    wanted = (jacobian.T @ (weight[:, None] * jacobian)).reshape(count, n, count, n)
    for t in range(count):
        np.testing.assert_allclose(np.triu(normal.block(0)[t]), np.triu(wanted[t, :, t]), atol=1e-6)
        for k in range(1, min(3, count - t)):
            np.testing.assert_allclose(normal.block(k)[t], wanted[t, :, t + k], atol=1e-6)
