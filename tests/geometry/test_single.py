"""Single vectors and rotations of compiled code: those of arrays are the oracle."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind.geometry import rotations as rot
from motionmind.geometry import single

RNG = np.random.default_rng(4)
P, Q = rot.normalise(RNG.normal(size=(2, 4)))


def test_single_rotations_are_those_of_arrays() -> None:
    p, q, axis = single.rotation(P), single.rotation(Q), (0.6, 0.0, 0.8)
    np.testing.assert_allclose(single.product(p, q), rot.mul(P, Q), atol=1e-15)
    np.testing.assert_allclose(single.about(axis, 0.7), rot.from_axis_angle(axis, 0.7), atol=1e-15)
    assert single.length((2.0, 3.0, 6.0)) == pytest.approx(7.0)
