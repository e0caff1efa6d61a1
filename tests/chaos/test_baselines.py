from __future__ import annotations

import numpy as np
import pytest
from bundled_clips import ballet_clip
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motionmind.body.human import human23, human44
from motionmind.body.limbs import TRUNK, sided_parts
from motionmind.body.skeleton import Skeleton
from motionmind.chaos.baselines import chunk_shuffled, dabby, quadrants, shuffled
from motionmind.chaos.reorder import runs
from motionmind.errors import MotionMindError

LENGTHS = st.lists(st.integers(1, 6), max_size=12)
INTEGERS = st.integers(-4, 4).map(float)
SEEDS = st.integers(0, 1000)


@given(st.integers(0, 60), SEEDS)
def test_a_shuffle_is_a_permutation(count: int, seed: int) -> None:
    assert sorted(shuffled(count, np.random.default_rng(seed))) == list(range(count))


def test_a_shuffle_prefers_no_order() -> None:
    """24 orders of four, 250 each of 6,000: chi-squared with 23 degrees of freedom is below 49.7 but once in 1,000."""
    rng = np.random.default_rng(1)
    orders = np.unique([shuffled(4, rng) for _ in range(6000)], axis=0, return_counts=True)[1]
    assert len(orders) == 24
    assert np.sum((orders - 250.0) ** 2 / 250.0) < 49.7


@given(LENGTHS, SEEDS)
def test_shuffled_chunks_are_a_permutation_with_the_runs_that_were_asked_for(lengths: list[int], seed: int) -> None:
    found = chunk_shuffled(np.array(lengths, dtype=np.int64), np.random.default_rng(seed))
    assert sorted(found) == list(range(sum(lengths)))
    assert sorted(runs(found)) == sorted(lengths)


def test_shuffled_chunks_prefer_no_order() -> None:
    """Of four single postures 11 orders are without a succession (OEIS A000255)."""
    rng = np.random.default_rng(2)
    found = np.unique([chunk_shuffled(np.ones(4, dtype=int), rng) for _ in range(5500)], axis=0, return_counts=True)[1]
    assert len(found) == 11
    assert np.sum((found - 500.0) ** 2 / 500.0) < 29.6  # 10 degrees of freedom, once in 1,000


def test_chunks_of_nothing_are_refused() -> None:
    with pytest.raises(MotionMindError, match="a chunk needs 1 posture or more, not 0"):
        chunk_shuffled(np.array([2, 0]), np.random.default_rng(0))


@given(
    arrays(np.float64, st.tuples(st.integers(1, 20), st.just(2)), elements=INTEGERS),
    arrays(np.float64, st.tuples(st.integers(0, 20), st.just(2)), elements=INTEGERS | st.just(0.5)),
)
def test_dabbys_mapping_takes_the_next_site_to_the_right(sites: np.ndarray, points: np.ndarray) -> None:
    x = sites[:, 0]
    for point, found in zip(points[:, 0], dabby(sites, points), strict=True):
        right = x[x >= point]
        assert x[found] == (right.min() if len(right) else x.max())
        assert found == np.flatnonzero(x == x[found])[0]


def test_dabbys_mapping_gives_a_piece_back_and_keeps_the_order_of_places() -> None:
    rng = np.random.default_rng(3)
    sites, points = rng.normal(size=(50, 3)), rng.normal(size=(500, 3))
    assert np.array_equal(dabby(sites, sites), np.arange(50))
    along = points[np.argsort(points[:, 0])]
    assert np.all(np.diff(sites[dabby(sites, along), 0]) >= 0.0)


def test_dabbys_mapping_needs_sites() -> None:
    with pytest.raises(MotionMindError, match="one or more"):
        dabby(np.zeros((0, 3)), np.zeros((1, 3)))


@pytest.mark.parametrize("body", [human23(), human44()], ids=lambda body: body.name)
def test_a_person_has_four_limbs_and_a_trunk(body: Skeleton) -> None:
    parts = sided_parts(body)
    assert set(parts) == {TRUNK, "left_hip", "right_hip", "left_clavicle", "right_clavicle"}
    assert sorted(np.concatenate(list(parts.values()))) == list(range(len(body)))
    for part, joints in parts.items():
        names = [body.names[joint] for joint in joints]
        side = part.split("_")[0]
        assert all(name.startswith(side) or (part == TRUNK and "_hip" not in name) for name in names)


def test_a_body_without_sides_is_all_trunk() -> None:
    snake = Skeleton("snake", ("a", "b", "c"), (-1, 0, 1), np.zeros((3, 3)))
    assert {part: list(joints) for part, joints in sided_parts(snake).items()} == {TRUNK: [0, 1, 2]}


def test_quadrants_go_through_the_piece_each_in_its_own_order() -> None:
    motion = ballet_clip("jump")
    indices = quadrants(motion.skeleton, 40, np.random.default_rng(4))
    orders = []
    for joints in sided_parts(motion.skeleton).values():
        assert np.all(indices[:, joints] == indices[:, joints[:1]])
        assert sorted(indices[:, joints[0]]) == list(range(40))
        orders.append(indices[:, joints[0]].tobytes())
    assert len(set(orders)) == len(orders)


def test_the_same_seed_gives_the_same_orders() -> None:
    one, two = ((shuffled(30, rng), chunk_shuffled(np.full(9, 3), rng)) for rng in map(np.random.default_rng, (5, 5)))
    assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))
