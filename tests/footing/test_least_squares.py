"""Banded systems are solved as SciPy solves them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solveh_banded

from motionmind.footing.least_squares import solve_diagonals


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("count", "width"), [(1, 1), (2, 3), (40, 3), (120, 9)])
def test_a_positive_definite_system_has_the_solution_that_scipy_finds(count: int, width: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    diagonals = rng.standard_normal((width, count))
    diagonals[0] = 2.0 * width + rng.uniform(0.0, 1e6, count) * (rng.random(count) < 0.2)
    right = rng.standard_normal(count)
    if count < width:  # SciPy takes no more diagonals than there are
        diagonals = diagonals[:count]
    given = diagonals.copy(), right.copy()
    np.testing.assert_allclose(
        solve_diagonals(diagonals, right), solveh_banded(diagonals, right, lower=True), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_array_equal(diagonals, given[0])
    np.testing.assert_array_equal(right, given[1])
