"""Weighted means of rotations: what counts in them."""

from __future__ import annotations

import numpy as np

from motionmind.walks.means import NEGLIGIBLE_WEIGHT_RATIO, scale_weights


def test_a_weight_counts_the_more_the_greater_it_is_and_never_jumps() -> None:
    weights = np.linspace(0.0, 4.0 * NEGLIGIBLE_WEIGHT_RATIO, 4001)
    found = scale_weights(1.0, weights[None], np.arange(len(weights)))[: len(weights), 0]
    steps = np.diff(found) / np.diff(weights)
    assert steps.min() >= 0.0
    assert steps.max() < 2.0 + 1e-9
    np.testing.assert_array_equal(found[weights < NEGLIGIBLE_WEIGHT_RATIO], 0.0)
    np.testing.assert_array_equal(
        found[weights > 2.0 * NEGLIGIBLE_WEIGHT_RATIO], weights[weights > 2.0 * NEGLIGIBLE_WEIGHT_RATIO]
    )
