"""Rotations for compiled loops: those of arrays are the oracle."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind.geometry import compiled
from motionmind.geometry import rotations as rot

RNG = np.random.default_rng(4)
P, Q = rot.normalise(RNG.normal(size=(2, 4)))
V = RNG.normal(size=3)


def test_products_are_those_of_arrays_to_the_bit() -> None:
    np.testing.assert_array_equal(compiled.mul(P, Q), rot.mul(P, Q))
    np.testing.assert_array_equal(compiled.mul(tuple(P), Q), rot.mul(P, Q))
    np.testing.assert_array_equal(compiled.inv_mul(P, Q), rot.inv_mul(P, Q))
    np.testing.assert_array_equal(compiled.mul_vec(P, V), rot.mul_vec(P, V))


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-3, 1.0, np.pi - 1e-9, np.pi])
def test_exp_and_log_are_those_of_arrays(angle: float) -> None:
    v = angle * V / np.linalg.norm(V)
    np.testing.assert_allclose(compiled.exp(v), rot.exp(v), atol=1e-15)
    for q in (rot.exp(v), -rot.exp(v)):
        np.testing.assert_allclose(compiled.log(q), rot.log(q), rtol=1e-15, atol=1e-15)


def test_axis_angle_and_norm_are_those_of_arrays() -> None:
    axis = (0.6, 0.0, 0.8)
    np.testing.assert_allclose(compiled.from_axis_angle(axis, 0.7), rot.from_axis_angle(axis, 0.7), atol=1e-15)
    assert compiled.norm((2.0, 3.0, 6.0)) == pytest.approx(7.0)
    assert compiled.norm(V) == pytest.approx(np.linalg.norm(V))
