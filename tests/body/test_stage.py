"""The stage: the least turn and shift that keep a movement there."""

from __future__ import annotations

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind.body.stage import Spot, find_overstep, find_spot, spots_on, turned_path
from motionmind.geometry import rotations as rot

LINE = np.stack([np.linspace(1.0, 5.0, 9), np.linspace(2.0, 2.5, 9)], axis=1)


@pytest.mark.parametrize("seed", range(6))
def test_a_path_at_its_spot_is_on_the_stage(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path, stage = np.cumsum(rng.normal(size=(30, 2)), axis=0), (float(rng.uniform(4, 9)), float(rng.uniform(4, 9)))
    spot = find_spot(path, stage)
    if spot is None:
        assert np.linalg.norm(np.ptp(path, axis=0)) > min(stage)
    else:
        assert (np.abs(spot.at(path)) <= 0.5 * np.array(stage) + 1e-9).all()


def test_it_turns_only_where_a_shift_does_not_do() -> None:
    wide, deep, none = (find_spot(LINE, stage) for stage in ((4.5, 2.0), (2.0, 4.5), (2.0, 2.0)))
    assert wide is not None
    assert deep is not None
    assert none is None
    assert wide.turn == 0.0
    np.testing.assert_allclose(wide.shift, [-2.75, -1.5])
    assert 50.0 < abs(np.degrees(deep.turn)) < 90.0
    assert find_spot(LINE, (2.0, 4.5), may_turn=False) is None


def test_spots_are_counted_from_a_place_and_a_turn() -> None:
    near, pivot = Spot(0.3, np.array([0.5, -0.5])), LINE[2]
    first = next(spots_on(0.1 * LINE, (4.0, 4.0), 0.1 * pivot, near))
    assert first.turn == pytest.approx(near.turn)
    np.testing.assert_allclose(first.at(LINE), near.at(LINE))


def test_a_movement_is_placed_like_its_path() -> None:
    motion, spot = ballet_clip("plies"), Spot(0.7, np.array([1.0, -2.0]))
    placed = spot.place(motion)
    np.testing.assert_allclose(placed.root[:, [0, 2]], spot.at(motion.root[:, [0, 2]]))
    turned = rot.heading(placed.rotations[:, 0]) - rot.heading(motion.rotations[:, 0])
    np.testing.assert_allclose(np.angle(np.exp(1j * turned)), 0.7)
    assert str(spot) == "turned by 40 degrees to the left, moved by +1.00, -2.00 m in x, z"
    there = Spot(0.0, np.array([9.0, 0.0])).place(motion)
    beyond = find_overstep(there, (8.0, 6.0))
    assert beyond is not None
    assert beyond.side == "left"


def test_a_turn_to_the_left_takes_the_front_to_the_left_of_the_stage() -> None:
    np.testing.assert_allclose(turned_path(np.array([[0.0, 1.0]]), 0.5 * np.pi), [[1.0, 0.0]], atol=1e-12)
