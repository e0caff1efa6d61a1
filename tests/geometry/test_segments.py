"""The distance of segments: the least over all their points, also where they touch, are parallel or are points."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.geometry.segments import nearest_points

_RNG = np.random.default_rng(5)
_PLANE = np.array([1.0, 0.0, 1.0])
CASES = {
    "anywhere": [(_RNG.normal(size=(2, 3)), _RNG.normal(size=(2, 3))) for _ in range(60)],
    "crossing": [(_PLANE * _RNG.normal(size=(2, 3)), _PLANE * _RNG.normal(size=(2, 3))) for _ in range(60)],
    "parallel": [(end := _RNG.normal(size=(2, 3)), end + _RNG.normal(size=3)) for _ in range(20)],
    "in line": [(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[x, 0.0, 0], [x + 1.5, 0, 0]])) for x in (-3, -1, 2)],
    "points": [(np.tile(_RNG.normal(size=3), (2, 1)), _RNG.normal(size=(2, 3))) for _ in range(20)]
    + [(_RNG.normal(size=(2, 3)), np.tile(_RNG.normal(size=3), (2, 1))) for _ in range(20)]
    + [(np.zeros((2, 3)), np.ones((2, 3)))],
}


def _distances(first: Floats, second: Floats, count: int = 300) -> Floats:
    """Distances of all of `count` points along one segment from those along the other."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    one, other = (ends[0] + share * (ends[1] - ends[0]) for ends in (first, second))
    return np.asarray(np.linalg.norm(one[:, None] - other[None], axis=-1))


@pytest.mark.parametrize("kind", CASES)
def test_no_two_points_are_nearer_and_those_named_are_so_far(kind: str) -> None:
    for first, second in CASES[kind]:
        far, s, t = nearest_points(first, second)
        least = _distances(first, second).min()
        step = (np.linalg.norm(first[1] - first[0]) + np.linalg.norm(second[1] - second[0])) / 299
        assert least - step <= far <= least + 1e-12
        assert 0.0 <= s <= 1.0
        assert 0.0 <= t <= 1.0
        between = first[0] + s * (first[1] - first[0]) - second[0] - t * (second[1] - second[0])
        assert np.linalg.norm(between) == pytest.approx(far, abs=1e-12)


def test_it_does_not_matter_which_is_first() -> None:
    for first, second in CASES["anywhere"] + CASES["parallel"]:
        assert nearest_points(first, second)[0] == pytest.approx(nearest_points(second, first)[0], abs=1e-12)
