"""Polylines on a floor."""

from __future__ import annotations

import numpy as np

from motionmind.geometry.polylines import length_of, offsets_to, places_along

CORNER = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]])


def test_length_and_places_by_shares_of_it() -> None:
    assert length_of(CORNER) == 4.0
    places = places_along(CORNER, np.array([0.0, 0.5, 0.75, 0.875, 1.0]))
    np.testing.assert_allclose(places, [[0.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 0.5], [3.0, 1.0]])


def test_offsets_are_from_the_nearest_point() -> None:
    places = np.array([[1.0, 0.5], [4.0, -1.0], [-1.0, -1.0], [2.5, 0.75]])
    np.testing.assert_allclose(offsets_to(CORNER, places), [[0.0, 0.5], [1.0, -1.0], [-1.0, -1.0], [-0.5, 0.0]])


def test_a_path_of_one_place_has_offsets_from_it() -> None:
    np.testing.assert_allclose(offsets_to(np.zeros((2, 2)), np.array([[1.0, 2.0]])), [[1.0, 2.0]])
