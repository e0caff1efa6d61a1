"""Laws of rotations, SciPy's Rotation the oracle; samples lie near no turn and near half a turn too."""

from __future__ import annotations

import doctest
from itertools import permutations
from types import ModuleType

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from motionmind._typing import Bools, Floats
from motionmind.geometry import rotations as rot
from motionmind.geometry import splines

ORDERS = ["".join(order) for order in permutations("xyz")]
UP = np.array([0.0, 1.0, 0.0])


def _axes(count: int, seed: int) -> Floats:
    axes = np.random.default_rng(seed).normal(size=(count, 3))
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def _angles(count: int, seed: int) -> Floats:
    """Angles all over [0, pi], a third of them close to 0, a third close to pi, both ends among them."""
    rng = np.random.default_rng(seed)
    close = 10.0 ** rng.uniform(-15.0, -1.0, count)
    angles = np.choose(np.arange(count) % 3, [close, np.pi - close, rng.uniform(0.0, np.pi, count)])
    angles[:2] = 0.0, np.pi
    return angles


def some(count: int = 600, seed: int = 0) -> Floats:
    """Rotations [count, 4] of both signs."""
    q = rot.from_axis_angle(_axes(count, seed), _angles(count, seed + 1))
    return q * np.random.default_rng(seed + 2).choice([-1.0, 1.0], (count, 1))


def assert_same(a: Floats, b: Floats, within: float = 1e-12) -> None:
    """Equal as rotations, to `within` radians."""
    a, b = np.broadcast_arrays(a, b)
    apart = np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))
    assert 2.0 * apart.max() <= within


A, B, C = some(seed=10), some(seed=20), some(seed=30)


def test_products_are_scipys_and_unit() -> None:
    assert_same(rot.mul(A, B), (Rotation.from_quat(A) * Rotation.from_quat(B)).as_quat())
    np.testing.assert_allclose(np.linalg.norm(rot.mul(A, B), axis=-1), 1.0, atol=1e-15)


def test_products_are_associative() -> None:
    np.testing.assert_allclose(rot.mul(rot.mul(A, B), C), rot.mul(A, rot.mul(B, C)), atol=1e-15)


def test_a_rotation_times_its_inverse_is_the_identity_on_both_sides() -> None:
    assert_same(rot.mul(A, rot.inv(A)), rot.IDENTITY)
    assert_same(rot.mul(rot.inv(A), A), rot.IDENTITY)
    np.testing.assert_array_equal(rot.mul(A, rot.IDENTITY), A)
    np.testing.assert_array_equal(rot.mul(rot.IDENTITY, A), A)


def test_differences_lead_from_one_rotation_to_the_other() -> None:
    assert_same(rot.mul(A, rot.inv_mul(A, B)), B)
    assert_same(rot.mul(rot.mul_inv(A, B), B), A)


def test_vectors_turn_as_scipy_turns_them() -> None:
    v = np.random.default_rng(0).normal(size=(len(A), 3))
    np.testing.assert_allclose(rot.mul_vec(A, v), Rotation.from_quat(A).apply(v), atol=1e-14)
    np.testing.assert_allclose(rot.mul_vec(rot.mul(A, B), v), rot.mul_vec(A, rot.mul_vec(B, v)), atol=1e-14)


def test_exp_and_log_are_inverse() -> None:
    vectors = _axes(600, 1) * _angles(600, 2)[:, None]
    np.testing.assert_allclose(rot.log(rot.exp(vectors))[2:], vectors[2:], rtol=1e-12, atol=1e-15)
    assert_same(rot.exp(rot.log(A)), A)
    assert_same(rot.exp(vectors), Rotation.from_rotvec(vectors).as_quat())


def test_exp_and_log_hold_where_their_series_begin() -> None:
    for size in (0.0, 1e-300, 1e-16, 0.99e-8, 1.01e-8, 2e-8, 1e-4):
        vector = np.array([0.0, size, 0.0])
        np.testing.assert_allclose(rot.log(rot.exp(vector)), vector, rtol=1e-15, atol=0.0)
        np.testing.assert_allclose(rot.exp(vector)[1], np.sin(size / 2.0), rtol=1e-15, atol=0.0)


def test_exp_takes_more_than_a_turn() -> None:
    assert_same(rot.exp(np.array([0.0, 2.5 * np.pi, 0.0])), rot.about_vertical(0.5 * np.pi))


def test_log_has_an_angle_of_at_most_pi() -> None:
    assert np.linalg.norm(rot.log(A), axis=-1).max() <= np.pi + 1e-15


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_are_scipys_and_come_back(order: str) -> None:
    angles = np.random.default_rng(3).uniform(-np.pi, np.pi, (400, 3))
    q = rot.from_euler(order, angles)
    assert_same(q, Rotation.from_euler(order.upper(), angles).as_quat())
    assert_same(rot.from_euler(order.upper(), rot.to_euler(order, q)), q, 1e-13)
    angles[:, 1] *= 0.499
    np.testing.assert_allclose(rot.to_euler(order, rot.from_euler(order, angles)), angles, atol=1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_come_back_at_gimbal_lock_and_near_it(order: str) -> None:
    rng = np.random.default_rng(4)
    off = np.concatenate([np.zeros(50), 10.0 ** rng.uniform(-16.0, -2.0, 750)])
    angles = rng.uniform(-np.pi, np.pi, (800, 3))
    angles[:, 1] = rng.choice([-1.0, 1.0], 800) * (np.pi / 2.0 - off * rng.choice([-1.0, 1.0], 800))
    q = rot.from_euler(order, angles)
    found = rot.to_euler(order, q)
    assert_same(rot.from_euler(order, found), q, 4e-9)
    assert np.all(found[:50, 2] == 0.0)


def test_euler_turns_of_any_number_of_letters() -> None:
    assert_same(rot.from_euler("", np.zeros((5, 0))), rot.IDENTITY)
    assert rot.from_euler("", np.zeros((5, 0))).shape == (5, 4)
    assert_same(rot.from_euler("yy", np.array([0.2, 0.3])), rot.about_vertical(0.5))
    assert_same(rot.from_euler("Zx", np.array([0.2, 0.3])), Rotation.from_euler("ZX", [0.2, 0.3]).as_quat())


@pytest.mark.parametrize("order", ["xyx", "zz", "xyw", ""])
def test_euler_angles_need_three_different_axes(order: str) -> None:
    with pytest.raises(ValueError):  # noqa: PT011
        rot.to_euler(order, A)


def test_matrices_are_scipys_and_come_back() -> None:
    np.testing.assert_allclose(rot.to_matrix(A), Rotation.from_quat(A).as_matrix(), atol=1e-14)
    assert_same(rot.from_matrix(rot.to_matrix(A)), A, 1e-14)
    np.testing.assert_allclose(rot.to_matrix(rot.mul(A, B)), rot.to_matrix(A) @ rot.to_matrix(B), atol=1e-14)


def test_between_is_the_smallest_turn_from_one_direction_to_the_other() -> None:
    a = _axes(600, 5)
    level = np.cross(a, _axes(600, 7))
    angles = _angles(600, 8)
    b = rot.mul_vec(rot.from_axis_angle(level / np.linalg.norm(level, axis=1, keepdims=True), angles), a)
    turn = rot.between(3.0 * a, 0.2 * b)
    np.testing.assert_allclose(rot.mul_vec(turn, a), b, atol=2e-6)  # next to opposite the axis is ambiguous
    far = angles < np.pi - 1e-5
    np.testing.assert_allclose(rot.mul_vec(turn, a)[far], b[far], atol=1e-10)
    np.testing.assert_allclose(rot.angle(turn, rot.IDENTITY), angles, atol=2e-6)


def test_slerp_keeps_its_ends_and_a_constant_speed() -> None:
    assert_same(rot.slerp(A, B, 0.0), A)
    assert_same(rot.slerp(A, B, 1.0), B)
    shares = np.random.default_rng(1).uniform(0.0, 1.0, len(A))
    whole = rot.angle(A, B)
    np.testing.assert_allclose(rot.angle(A, rot.slerp(A, B, shares)), shares * whole, atol=1e-12)
    sure = whole < np.pi - 1e-6  # at half a turn there are two short ways
    expected = np.array(
        [
            Slerp([0.0, 1.0], Rotation.from_quat(np.stack(pair)))(share).as_quat()
            for *pair, share in zip(A[sure], B[sure], shares[sure], strict=True)
        ]
    )
    assert_same(rot.slerp(A, B, shares)[sure], expected, 1e-9)


def test_angle_is_accurate_near_no_turn_and_half_a_turn() -> None:
    angles = _angles(600, 9)
    turned = rot.mul(A, rot.from_axis_angle(_axes(600, 10), angles))
    np.testing.assert_allclose(rot.angle(A, turned), angles, rtol=0.0, atol=1e-15)
    small = rot.from_axis_angle(UP, 1e-12)
    np.testing.assert_allclose(rot.angle(rot.IDENTITY, small), 1e-12, rtol=1e-12)
    np.testing.assert_array_equal(rot.angle(A, A) < 1e-15, True)


def test_angle_is_a_metric_that_both_sides_leave_alone() -> None:
    np.testing.assert_allclose(rot.angle(A, B), rot.angle(B, A), atol=1e-15)
    np.testing.assert_allclose(rot.angle(rot.mul(C, A), rot.mul(C, B)), rot.angle(A, B), atol=1e-14)
    np.testing.assert_allclose(rot.angle(rot.mul(A, C), rot.mul(B, C)), rot.angle(A, B), atol=1e-14)
    assert np.all(rot.angle(A, C) <= rot.angle(A, B) + rot.angle(B, C) + 1e-12)


def test_heading_is_the_twist_whose_swing_is_level() -> None:
    heading = rot.heading(A)
    assert np.all(np.abs(heading) <= np.pi)
    twist = rot.about_vertical(heading)
    swing = rot.inv_mul(twist, A)
    assert_same(rot.mul(twist, swing), A)
    np.testing.assert_allclose(swing[:, 1], 0.0, atol=1e-15)


def test_heading_adds_turns_about_the_vertical() -> None:
    turns = np.random.default_rng(2).uniform(-np.pi, np.pi, len(A))
    off = rot.heading(rot.mul(rot.about_vertical(turns), A)) - rot.heading(A) - turns
    upright = np.hypot(A[:, 1], A[:, 3]) > 1e-3
    np.testing.assert_allclose(np.angle(np.exp(1j * off))[upright], 0.0, atol=1e-12)
    np.testing.assert_allclose(rot.heading(rot.about_vertical(turns)), turns, atol=1e-15)


def test_heading_upside_down_is_zero() -> None:
    assert rot.heading(np.array([1.0, 0.0, 0.0, 0.0])) == 0.0
    assert rot.heading(np.array([0.6, 0.0, -0.8, 0.0])) == 0.0


def test_mirror_is_an_involution_and_a_homomorphism_and_reflects_vectors() -> None:
    np.testing.assert_array_equal(rot.mirror(rot.mirror(A)), A)
    np.testing.assert_allclose(rot.mirror(rot.mul(A, B)), rot.mul(rot.mirror(A), rot.mirror(B)), atol=1e-15)
    v, flip = np.random.default_rng(0).normal(size=(len(A), 3)), np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(rot.mul_vec(rot.mirror(A), flip * v), flip * rot.mul_vec(A, v), atol=1e-14)


def test_canonical_is_the_same_for_both_signs_and_idempotent() -> None:
    q = np.concatenate([A, np.eye(4), -np.eye(4), [[0.6, -0.8, 0.0, 0.0], [-0.6, 0.0, 0.8, 0.0]]])
    np.testing.assert_array_equal(rot.canonical(q), rot.canonical(-q))
    np.testing.assert_array_equal(rot.canonical(rot.canonical(q)), rot.canonical(q))
    assert_same(rot.canonical(q), q, 0.0)
    last = np.array([row[np.flatnonzero(row)[-1]] for row in rot.canonical(q)])
    assert np.all(last > 0.0)


def test_both_signs_are_one_rotation_everywhere() -> None:
    v = np.random.default_rng(0).normal(size=(len(A), 3))
    np.testing.assert_array_equal(rot.mul_vec(-A, v), rot.mul_vec(A, v))
    np.testing.assert_array_equal(rot.to_matrix(-A), rot.to_matrix(A))
    np.testing.assert_array_equal(rot.angle(-A, B), rot.angle(A, B))
    half = np.abs(A[:, 3]) < 1e-12  # half a turn is half a turn the other way, too
    np.testing.assert_allclose(rot.log(-A)[~half], rot.log(A)[~half], atol=1e-15)
    np.testing.assert_allclose(np.angle(np.exp(1j * (rot.heading(-A) - rot.heading(A)))), 0.0, atol=1e-12)
    for order in ORDERS:
        np.testing.assert_array_equal(rot.to_euler(order, -A), rot.to_euler(order, A))
    assert_same(rot.slerp(-A, B, 0.3)[~_opposite(A, B)], rot.slerp(A, B, 0.3)[~_opposite(A, B)])
    assert_same(rot.mirror(-A), rot.mirror(A), 0.0)


def _opposite(a: Floats, b: Floats) -> Bools:
    return rot.angle(a, b) > np.pi - 1e-9


def test_normalise_refuses_what_has_no_direction() -> None:
    np.testing.assert_allclose(rot.normalise([0.0, 0.0, 3.0, 4.0]), [0.0, 0.0, 0.6, 0.8])
    for bad in ([0.0, 0.0, 0.0, 0.0], [np.nan, 0.0, 0.0, 1.0]):
        with pytest.raises(ValueError, match="length zero"):
            rot.normalise(bad)


def test_functions_broadcast_over_leading_axes() -> None:
    q = A[:24].reshape(2, 3, 4, 4)
    for function in (rot.inv, rot.canonical, rot.mirror, lambda p: rot.exp(rot.log(p))):
        assert function(q).shape == q.shape
    assert rot.to_matrix(q).shape == (2, 3, 4, 3, 3)
    assert rot.from_matrix(rot.to_matrix(q)).shape == q.shape
    assert rot.to_euler("zxy", q).shape == (2, 3, 4, 3)
    assert rot.heading(q).shape == (2, 3, 4)
    assert rot.slerp(q, q[:1], np.full((2, 3, 4), 0.5)).shape == q.shape


@pytest.mark.parametrize("module", [rot, splines])
def test_examples_in_docstrings_hold(module: ModuleType) -> None:
    found = doctest.testmod(module)
    assert found.attempted > 0
    assert found.failed == 0
