"""Running means and maxima."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind.footing.smoothing import bell, sliding_max, smoothed


@pytest.mark.parametrize("reach", [0, 1, 3, 30])
def test_a_sliding_maximum_is_that_of_the_values_within_its_reach(reach: int) -> None:
    values = np.random.default_rng(0).random(20)
    expected = [values[max(k - reach, 0) : k + reach + 1].max() for k in range(20)]
    np.testing.assert_array_equal(sliding_max(values, reach), expected)


@pytest.mark.parametrize("seconds", [0.01, 0.2, 5.0])
def test_smoothing_keeps_lines_and_ends(seconds: float) -> None:
    line, rough = np.linspace(0.3, 2.0, 25), np.random.default_rng(1).random(25)
    np.testing.assert_allclose(smoothed(line, seconds, 30.0), line)
    np.testing.assert_allclose(smoothed(rough, seconds, 30.0)[[0, -1]], rough[[0, -1]])


def test_a_bell_is_even_greatest_in_the_middle_and_adds_up_to_one() -> None:
    weights = bell(4)
    assert weights.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(weights, weights[::-1])
    assert np.all(np.diff(weights[:5]) > 0.0)
