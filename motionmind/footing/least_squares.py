"""Least squares over a trajectory in space: rows that look at three successive frames each, in one banded system.

The unknowns are x, y and z of all frames in turn, so that a row of three frames spans nine of them, and the normal
equations have seventeen diagonals.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.jit import jit

_BAND = 9


class Rows(NamedTuple):
    """Rows of a least-squares problem: weight (coefficients . unknowns - target)^2 each.

    Attributes:
        first: frame that each row begins with [R].
        coefficients: of x, y and z of that frame and the next two [R, 9].
        targets: what they should add up to [R].
        weights: of the rows' squares [R].
    """

    first: Ints
    coefficients: Floats
    targets: Floats
    weights: Floats


def position_rows(frames: Ints, directions: Floats, targets: Floats, weights: Floats) -> Rows:
    """Return rows for how far along directions [R, 3] or [3] a trajectory is at some frames [R]: targets [R]."""
    coefficients = np.zeros((len(frames), _BAND))
    coefficients[:, :3] = directions
    return Rows(frames, coefficients, targets, weights)


def difference_rows(axis: int, shares: tuple[float, float, float], targets: Floats, weights: Floats) -> Rows:
    """Return rows for sums of one coordinate over each three successive frames, weighted by `shares`.

    Args:
        axis: the coordinate, 0 to 2.
        shares: of the three frames.
        targets: of the sums [N - 2].
        weights: of the rows [N - 2].
    """
    coefficients = np.zeros((len(targets), _BAND))
    coefficients[:, axis::3] = shares
    return Rows(np.arange(len(targets)), coefficients, targets, weights)


def joined(rows: list[Rows]) -> Rows:
    """Return rows one after another, as one."""
    return Rows(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))


def solve(rows: list[Rows], start: Floats, fixed: Bools) -> Floats:
    """Return the trajectory [N, 3] whose weighted sum of squares over all rows is least.

    Args:
        rows: of the problem, their arrays in one piece; each frame that is not fixed must matter to one.
        start: a trajectory with the right places at the fixed frames [N, 3].
        fixed: frames that do not change [N].
    """
    flat = np.ascontiguousarray(start).reshape(-1)
    matrix, right = np.zeros((len(flat), _BAND)), np.zeros(len(flat))
    matrix[:, 0] = 1e-9
    for some in rows:
        _add_normal_equations(*some, flat, matrix, right)
    _solve_but_fixed(matrix, right, fixed)
    return np.asarray(start + right.reshape(-1, 3))


def bending_diagonals(weights: Floats) -> Floats:
    """Return the lower diagonals [3, N] of sum_t weights[t] (x[t] - 2 x[t + 1] + x[t + 2])^2, weights [N - 2]."""
    out = np.zeros((3, len(weights) + 2))
    out[0, :-2] += weights
    out[0, 1:-1] += 4.0 * weights
    out[0, 2:] += weights
    out[1, :-2] -= 2.0 * weights
    out[1, 1:-1] -= 2.0 * weights
    out[2, :-2] = weights
    return out


def solve_diagonals(diagonals: Floats, right: Floats) -> Floats:
    """Return the solution [M] of a positive definite system with lower diagonals [B, M] and right side [M].

    SciPy does the same, but its linear algebra takes longer to import than a tween to realise.
    """
    rows, out = np.zeros(diagonals.shape[::-1]), right.copy()
    for k, diagonal in enumerate(diagonals):
        rows[k:, k] = diagonal[: len(diagonal) - k]
    solve_rows(rows, out)
    return out


@jit
def solve_rows(matrix: Floats, right: Floats) -> None:
    """Solve a positive definite system in place, by Cholesky's factors: matrix[i, k] is that of i and i - k [M, B]."""
    factorise(matrix)
    substitute(matrix, right)


@jit
def factorise(matrix: Floats) -> None:
    """Write Cholesky's factor of a positive definite matrix in its place, as `solve_rows` takes it [M, B]."""
    size, width = matrix.shape
    for i in range(size):
        for k in range(min(i, width - 1), -1, -1):
            total = matrix[i, k]
            for m in range(k + 1, min(i, width - 1) + 1):
                if m - k < width:
                    total -= matrix[i, m] * matrix[i - k, m - k]
            matrix[i, k] = np.sqrt(total) if k == 0 else total / matrix[i - k, 0]


@jit
def substitute(matrix: Floats, right: Floats) -> None:
    """Solve a system with such a factor [M, B] in place of its right side [M]."""
    size, width = matrix.shape
    for i in range(size):
        for k in range(1, min(i, width - 1) + 1):
            right[i] -= matrix[i, k] * right[i - k]
        right[i] /= matrix[i, 0]
    for i in range(size - 1, -1, -1):
        right[i] /= matrix[i, 0]
        for k in range(1, min(i, width - 1) + 1):
            right[i - k] -= matrix[i, k] * right[i]


@jit
def _add_normal_equations(
    first: Ints, coefficients: Floats, targets: Floats, weights: Floats, flat: Floats, matrix: Floats, right: Floats
) -> None:
    """Add the normal equations of rows to others, for a change from a trajectory [3 N]: to a matrix as `solve_rows`
    takes it [3 N, 9], and to the right side [3 N]."""
    for r in range(len(first)):
        if weights[r] == 0.0:
            continue
        at = 3 * first[r]
        missing = targets[r]
        for k in range(_BAND):
            if coefficients[r, k] != 0.0:
                missing -= coefficients[r, k] * flat[at + k]
        for k in range(_BAND):
            weighted = weights[r] * coefficients[r, k]
            if weighted == 0.0:
                continue
            right[at + k] += weighted * missing
            for m in range(k + 1):
                if coefficients[r, m] != 0.0:
                    matrix[at + k, k - m] += weighted * coefficients[r, m]


@jit
def _solve_but_fixed(matrix: Floats, right: Floats, fixed: Bools) -> None:
    """Solve such a system in place of its right side [3 N], with a change of 0 in the fixed frames [N]."""
    # Their own equations outweigh all others.
    firmly = 1e12 * max(matrix[:, 0].max(), 1.0)
    for t in np.flatnonzero(fixed):
        for k in range(3 * t, 3 * t + 3):
            matrix[k, 0], right[k] = firmly, 0.0
    solve_rows(matrix, right)
    for t in np.flatnonzero(fixed):
        right[3 * t : 3 * t + 3] = 0.0
