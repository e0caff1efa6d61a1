"""A banded system has the solution that NumPy finds for the same one written out."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind._typing import Bools, Floats
from motionmind.solver.system import Normal

SHAPES = [(1, 1), (1, 5), (2, 3), (3, 4), (12, 1), (12, 7), (30, 18)]


def written_out(normal: Normal) -> Floats:
    """The couplings as one symmetric matrix [N n, N n]."""
    count, n = normal.gradient.shape
    whole = np.zeros((count, n, count, n))
    for k in range(min(3, count)):
        for t in range(count - k):
            whole[t, :, t + k] = normal.block(k)[t]
    upper = np.triu(whole.reshape(count * n, count * n))
    return np.asarray(upper + np.triu(upper, 1).T)


def with_rows(shape: tuple[int, int], seed: int) -> tuple[Normal, Floats, Floats]:
    """A system of random rows about up to three frames, and the same dense: its matrix and half its gradient."""
    rng, (count, n) = np.random.default_rng(seed), shape
    normal, span = Normal(count, n), min(3, count)
    whole, gradient = np.zeros((count * n, count * n)), np.zeros(count * n)
    for first in range(count - span + 1):
        for _ in range(2):
            row, residual = np.zeros((count, n)), rng.normal()
            row[first : first + span] = 10.0 ** rng.uniform(-2.0, 2.0) * rng.normal(size=(span, n))
            flat = row.ravel()
            whole += np.outer(flat, flat)
            gradient += flat * residual
            normal.gradient += row * residual
            for a in range(span):
                for b in range(a, span):
                    normal.block(b - a)[first + a] += np.outer(row[first + a], row[first + b])
    return normal, whole, gradient


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("shape", SHAPES)
def test_a_step_is_the_dense_solution(shape: tuple[int, int], seed: int) -> None:
    normal, whole, gradient = with_rows(shape, seed)
    np.testing.assert_allclose(written_out(normal), whole, rtol=1e-12, atol=1e-12)
    wanted = np.linalg.solve(whole + 0.3 * np.eye(len(whole)), -gradient)
    step = normal.step(0.3, np.zeros(shape[0], dtype=np.bool_))
    np.testing.assert_allclose(step.ravel(), wanted, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("shape", SHAPES)
def test_fixed_frames_stay_and_the_others_take_the_step_that_is_best_then(shape: tuple[int, int], seed: int) -> None:
    fixed: Bools = np.random.default_rng(seed).random(shape[0]) < 0.4
    normal, whole, gradient = with_rows(shape, seed)
    free = np.repeat(~fixed, shape[1])
    wanted = np.linalg.solve(whole[np.ix_(free, free)] + 0.3 * np.eye(free.sum()), -gradient[free])
    step = normal.step(0.3, fixed)
    np.testing.assert_array_equal(step[fixed], 0.0)
    np.testing.assert_allclose(step.ravel()[free], wanted, rtol=1e-7, atol=1e-9)


def test_nothing_moves_where_no_row_pulls() -> None:
    normal = Normal(5, 3)
    normal.block(0)[2, 1, 1], normal.gradient[2, 1] = 4.0, -4.0
    step = normal.step(1.0, np.zeros(5, dtype=np.bool_))
    wanted = np.zeros((5, 3))
    wanted[2, 1] = 0.8
    np.testing.assert_allclose(step, wanted, atol=1e-15)


def test_what_lies_under_the_diagonal_is_not_read() -> None:
    normal, whole, gradient = with_rows((6, 4), 0)
    normal.blocks[:, *np.tril_indices(4, -1)] = np.nan
    step = normal.step(0.3, np.zeros(6, dtype=np.bool_))
    np.testing.assert_allclose(step.ravel(), np.linalg.solve(whole + 0.3 * np.eye(24), -gradient), rtol=1e-7)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_rows_of_a_joint_are_those_of_a_dense_jacobian(frames: int) -> None:
    rng, normal, columns = np.random.default_rng(frames), Normal(7, 6), slice(2, 5)
    first, jacobian = np.array([0, 1, 4]), rng.normal(size=(3, frames, 3, 2))
    residual = rng.normal(size=(3, 2))
    normal.add_joint(first, columns, jacobian, residual, 2.5)
    rows = np.zeros((3, 2, 7, 6))
    for r, begin in enumerate(first):
        rows[r, :, begin : begin + frames, columns] = np.moveaxis(jacobian[r], 2, 0)
    flat = rows.reshape(6, 42)
    np.testing.assert_allclose(written_out(normal), 2.5 * flat.T @ flat, atol=1e-12)
    np.testing.assert_allclose(normal.gradient.ravel(), 2.5 * flat.T @ residual.ravel(), atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_rows_of_the_mass_are_those_of_its_jacobian(seed: int) -> None:
    rng, normal = np.random.default_rng(seed), Normal(7, 5)
    first, ways, of_mass = np.array([0, 2, 3, 4]), rng.normal(size=(4, 3, 3)), rng.normal(size=(7, 3, 5))
    residual, weight = rng.normal(size=4), rng.uniform(0.1, 10.0, 4)
    normal.add_mass(first, ways, residual, weight)
    normal.expand(of_mass)
    normal.expand(of_mass)  # they count once
    rows = np.zeros((4, 7, 5))
    for r, begin in enumerate(first):
        rows[r, begin : begin + 3] = np.einsum("kx,kxi->ki", ways[r], of_mass[begin : begin + 3])
    flat = rows.reshape(4, 35)
    np.testing.assert_allclose(written_out(normal), flat.T @ (weight[:, None] * flat), atol=1e-11)
    np.testing.assert_allclose(normal.gradient.ravel(), flat.T @ (weight * residual), atol=1e-11)


def test_steps_of_a_linear_problem_go_all_the_way() -> None:
    """With hardly any damping the first step makes the gradient zero."""
    normal, whole, gradient = with_rows((8, 2), 1)
    whole += 1e-9 * np.eye(16)
    step = normal.step(1e-9, np.zeros(8, dtype=np.bool_))
    assert np.abs(whole @ step.ravel() + gradient).max() < 1e-6 * np.abs(gradient).max()
