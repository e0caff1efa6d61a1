from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motionmind.chaos.flows import FLOWS
from motionmind.chaos.reorder import itinerary, reorder, runs
from motionmind.chaos.trajectories import trajectory
from motionmind.errors import MotionMindError

INTEGERS = st.integers(-3, 3).map(float)


@pytest.mark.parametrize("name", FLOWS)
@settings(max_examples=10)
@given(count=st.integers(1, 400), every=st.integers(1, 30))
def test_the_same_start_gives_the_piece_back(name: str, count: int, every: int) -> None:
    found = itinerary(FLOWS[name], count, every=every)
    assert np.array_equal(found.indices, np.arange(count))
    assert np.array_equal(runs(found.indices), [count])
    assert np.array_equal(reorder(found.sites, found.sites), np.arange(count))


@given(
    st.integers(1, 4).flatmap(
        lambda d: st.tuples(
            *(arrays(np.float64, st.tuples(st.integers(1, 30), st.just(d)), elements=INTEGERS) for _ in range(2))
        )
    )
)
def test_the_tree_finds_what_comparing_all_finds(both: tuple[np.ndarray, np.ndarray]) -> None:
    """On small integers, where most distances are met more than once and sites coincide."""
    sites, points = both
    squares = np.sum((sites[None] - points[:, None]) ** 2, axis=-1)
    assert np.array_equal(reorder(sites, points), np.argmin(squares, axis=1))


def test_the_tree_finds_what_comparing_all_finds_along_trajectories() -> None:
    for flow in FLOWS.values():
        found = itinerary(flow, 300, 1000, nudge=0.01)
        squares = np.sum((found.sites[None] - found.points[:, None]) ** 2, axis=-1)
        assert np.array_equal(found.indices, np.argmin(squares, axis=1))


def test_a_variation_begins_as_the_piece_and_leaves_it_the_later_the_smaller_the_nudge() -> None:
    for name in ("lorenz", "rossler"):
        kept = [runs(itinerary(FLOWS[name], 2000, nudge=nudge).indices)[0] for nudge in (1e-2, 1e-6, 1e-10)]
        assert 1 <= kept[0] < kept[1] < kept[2] < 2000


def test_pieces_of_one_and_two_postures() -> None:
    assert np.array_equal(itinerary(FLOWS["lorenz"], 1, 5, nudge=1.0).indices, np.zeros(5))
    two = itinerary(FLOWS["lorenz"], 2, 200)
    assert np.array_equal(two.indices[:2], [0, 1])
    assert set(two.indices) == {0, 1}


def test_a_nudge_moves_the_first_point_and_no_site() -> None:
    plain, nudged = (itinerary(FLOWS["lorenz"], 20, nudge=nudge) for nudge in (0.0, 0.25))
    assert np.array_equal(plain.sites, nudged.sites)
    assert np.allclose(nudged.points[0] - nudged.sites[0], [0.25, 0.0, 0.0])
    aside = itinerary(FLOWS["lorenz"], 20, nudge=[0.0, 0.5, -0.5])
    assert np.allclose(aside.points[0] - aside.sites[0], [0.0, 0.5, -0.5])


@pytest.mark.parametrize("nudge", [np.nan, [0.1, 0.2], [[0.1, 0.2, 0.3]], [0.1, 0.2, np.inf]])
def test_a_nudge_that_is_no_point_is_refused(nudge: object) -> None:
    with pytest.raises(MotionMindError, match="nudge in lorenz must be a finite number or 3 of them"):
        itinerary(FLOWS["lorenz"], 5, nudge=nudge)


def test_sites_and_points_that_do_not_fit_are_refused() -> None:
    for sites, points in ((np.zeros((0, 3)), np.zeros((2, 3))), (np.zeros((2, 3)), np.zeros((2, 2)))):
        with pytest.raises(MotionMindError, match="cannot be compared with sites"):
            reorder(sites, points)
    with pytest.raises(MotionMindError, match="finite"):
        reorder(np.zeros((2, 3)), np.full((1, 3), np.nan))


@given(arrays(np.int64, st.integers(0, 40), elements=st.integers(0, 5)))
def test_runs_are_as_long_as_the_order_survives(indices: np.ndarray) -> None:
    lengths = runs(indices)
    assert lengths.sum() == len(indices)
    parts = np.split(indices, np.cumsum(lengths)[:-1]) if len(lengths) else []
    assert all(len(part) and np.array_equal(part, part[0] + np.arange(len(part))) for part in parts)
    assert all(after[0] != before[-1] + 1 for before, after in pairwise(parts))


def test_the_same_arguments_give_the_same_bytes() -> None:
    one, two = (itinerary(FLOWS["thomas"], 500, nudge=0.01) for _ in range(2))
    assert one.points.tobytes() == two.points.tobytes()
    assert one.indices.tobytes() == two.indices.tobytes()
    assert trajectory(FLOWS["thomas"], count=500).tobytes() == one.sites.tobytes()


def test_a_nudge_that_leads_out_of_the_basin_is_named() -> None:
    with pytest.raises(MotionMindError, match=r"nudged by 1e\+09, 0, 0: lorenz .* diverges .* within 1 step of"):
        itinerary(FLOWS["lorenz"], 5, nudge=1e9)
    with pytest.raises(MotionMindError, match="nudge must be a number, or one for each coordinate, not 'x'"):
        itinerary(FLOWS["lorenz"], 5, nudge="x")  # type: ignore[arg-type]


def test_what_lies_too_far_out_to_compare_is_refused() -> None:
    with pytest.raises(MotionMindError, match=r"below 1e\+150"):
        reorder(np.zeros((2, 3)), np.full((1, 3), 1e200))
