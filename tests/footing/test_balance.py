"""Balance: the nearest point of a support, and whether a body falls without a foot."""

from __future__ import annotations

import numpy as np

from motionmind.footing.balance import WALKING_MPS, falls_without, is_beyond, nearest_in_support, walks


def test_the_nearest_point_of_a_support_is_in_it_and_none_is_nearer() -> None:
    rng = np.random.default_rng(3)
    points, wanted = rng.normal(size=(40, 6, 2)), 2.0 * rng.normal(size=(40, 2))
    touches = rng.uniform(size=(40, 6)) < 0.6
    found = nearest_in_support(points, touches, wanted)
    for own, bears, there, nearest in zip(points, touches, wanted, found, strict=True):
        if not bears.any():
            np.testing.assert_array_equal(nearest, there)
            continue
        shares = rng.dirichlet(np.full(bears.sum(), 0.3), 2000)
        inside = shares @ own[bears]
        assert np.linalg.norm(nearest - there) <= np.linalg.norm(inside - there, axis=1).min() + 1e-9
        # In the support: no direction has all of its points behind.
        around = np.stack([np.cos(np.arange(72) / 36.0 * np.pi), np.sin(np.arange(72) / 36.0 * np.pi)], axis=1)
        assert np.all((own[bears] @ around.T).max(axis=0) >= nearest @ around.T - 1e-9)


def test_a_body_falls_without_the_foot_that_it_is_over_and_not_without_the_other() -> None:
    points = np.tile([[0.0, 0.0], [0.0, 0.2], [0.4, 0.0], [0.4, 0.2]], (3, 1, 1))
    feet, low = np.array([[1, 1, 0, 0], [0, 0, 1, 1]], dtype=np.bool_), np.ones((3, 4), dtype=np.bool_)
    centre = np.array([[0.0, 0.1], [0.2, 0.1], [0.4, 0.1]])
    falls = falls_without(points, low, feet, centre, 0.05)
    np.testing.assert_allclose(falls, [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    assert not is_beyond(points, low, centre, 0.0).any()
    np.testing.assert_array_equal(is_beyond(points, low & feet[0], centre, 0.05), [False, True, True])


def test_it_walks_by_its_speed_and_not_by_how_far_it_goes() -> None:
    for frames in (30, 300):
        way = np.linspace(0.0, 1.0, frames)[:, None] * np.array([1.0, 5.0, 0.0]) * (frames - 1) / 30.0
        assert walks(1.05 * WALKING_MPS * way, 30.0)
        assert not walks(0.95 * WALKING_MPS * way, 30.0)
