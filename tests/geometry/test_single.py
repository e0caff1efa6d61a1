"""Single vectors and rotations of compiled code: those of arrays are the oracle."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot
from motionmind.geometry import single

RNG = np.random.default_rng(4)
P, Q = rot.normalise(RNG.normal(size=(2, 4)))
A, B = RNG.normal(size=(2, 3))


def test_single_rotations_are_those_of_arrays() -> None:
    p, q, a = single.rotation(P), single.rotation(Q), single.vector(A)
    np.testing.assert_allclose(single.product(p, q), rot.mul(P, Q), atol=1e-15)
    np.testing.assert_allclose(single.turned(p, a), rot.mul_vec(P, A), atol=1e-15)
    axis = single.unit(a)
    np.testing.assert_allclose(single.about(axis, 0.7), rot.from_axis_angle(A / np.linalg.norm(A), 0.7), atol=1e-15)


def test_single_vectors_are_those_of_arrays() -> None:
    a, b = single.vector(A), single.vector(B)
    np.testing.assert_allclose(single.minus(a, b), A - B)
    np.testing.assert_allclose(single.plus(a, b, 0.3), A + 0.3 * B)
    np.testing.assert_allclose(single.cross(a, b), np.cross(A, B), atol=1e-15)
    assert single.dot(a, b) == pytest.approx(A @ B)
    assert single.length(a) == pytest.approx(np.linalg.norm(A))


@pytest.mark.parametrize("b", [B, A, -A, -2.0 * A])
def test_the_smallest_rotation_leads_from_one_direction_to_the_other_even_its_opposite(b: Floats) -> None:
    q = np.array(single.between(single.vector(A), single.vector(b)))
    np.testing.assert_allclose(q, rot.between(A, b), atol=1e-12)
    np.testing.assert_allclose(rot.mul_vec(q, A / np.linalg.norm(A)), b / np.linalg.norm(b), atol=1e-12)
