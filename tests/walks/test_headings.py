"""Where a body faces: by its walks, the near way round, and near a path's states without a leap."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot
from motionmind.walks.headings import TURN_PERSISTENCE_S, correct_headings, travel_along, turn_with_walks

STILL = np.zeros(40), np.full(40, 0.01)  # walks that turn to neither side
TIMES = np.linspace(0.0, 4.0, 41)
SURE = np.ones(40)  # walks are trusted


def facings(*degrees: float) -> dict[int, Floats]:
    """Rotations to face at evenly spaced moves of twenty."""
    moves = np.round(np.linspace(0, 20, len(degrees))).astype(int)
    return dict(zip(moves.tolist(), rot.about_vertical(np.radians(degrees)), strict=True))


@pytest.mark.parametrize("rates", [(None, None), (0.0, 0.0), (0.7, None), (-0.7, 0.7), (2.0, -3.0)])
@pytest.mark.parametrize(("a", "b", "turn"), [(170, -170, 20), (-170, 170, -20), (10, 100, 90), (0, 179, 179)])
def test_a_body_turns_the_near_way(a: float, b: float, turn: float, rates: tuple[float | None, float | None]) -> None:
    found = turn_with_walks(*STILL, SURE, TIMES, facings(a, b), rates)
    assert found[0] == pytest.approx(np.radians(a))
    assert np.degrees(found[-1] - found[0]) == pytest.approx(turn)
    if rates == (None, None):
        assert np.all(np.diff(found) * np.sign(turn) > 0.0)


def test_walks_that_surely_turn_lead_the_far_way() -> None:
    turn = np.full(40, np.radians(200.0) / 40.0)
    found = turn_with_walks(turn, turn**2, SURE, TIMES, facings(0.0, -150.0), (None, None))
    assert np.degrees(found[-1]) == pytest.approx(210.0)
    unsure = turn_with_walks(turn, turn**2 + 4.0, SURE, TIMES, facings(0.0, -150.0), (None, None))
    assert np.degrees(unsure[-1]) == pytest.approx(-150.0)


@pytest.mark.parametrize("steps", [40, 80])
def test_walks_lead_the_far_way_by_the_estimate_of_least_square_error(steps: int) -> None:
    """From 0 to -150 degrees it is the far way if the estimate of what walks turn, 200 degrees, is above 30."""
    mean, times = np.radians(200.0) / steps, np.linspace(0.0, 4.0, steps + 1)
    for share in (0.14, 0.16):
        # share = M^2 / (M^2 + V), and V is the steps' variance times the steps in TURN_PERSISTENCE_S.
        varies = np.radians(200.0) ** 2 * (1.0 / share - 1.0) / (steps * TURN_PERSISTENCE_S * steps / 4.0)
        turn, spread = np.full(steps, mean), np.full(steps, mean**2 + varies)
        ends = {0: rot.about_vertical(0.0), steps // 2: rot.about_vertical(np.radians(-150.0))}
        found = turn_with_walks(turn, spread, np.ones(steps), times, ends, (None, None))
        assert np.degrees(found[-1]) == pytest.approx(210.0 if share > 0.15 else -150.0)


def test_the_missing_turn_goes_where_walks_are_least_certain() -> None:
    varies = np.linspace(0.001, 0.02, 40)
    found = turn_with_walks(np.zeros(40), varies, SURE, TIMES, facings(0.0, 120.0), (None, None))
    np.testing.assert_allclose(np.diff(np.degrees(found)), 120.0 * varies / varies.sum(), atol=1e-9)


def test_walks_that_are_not_trusted_do_not_turn_the_body() -> None:
    """It turns the near way, evenly, whatever they do and however unevenly they vary."""
    turn = np.radians(200.0) / 20.0 * np.linspace(0.0, 1.0, 40)
    spread = turn**2 + np.linspace(0.0, 1e-3, 40)
    found = turn_with_walks(turn, spread, 0.0 * SURE, TIMES, facings(0.0, 150.0), (None, None))
    np.testing.assert_allclose(np.degrees(found), np.linspace(0.0, 150.0, 41), atol=1e-6)
    trusted = turn_with_walks(turn, spread, SURE, TIMES, facings(0.0, 150.0), (None, None))
    assert np.degrees(trusted[20]) < 60.0


def test_a_body_that_passes_facings_evenly_turns_evenly() -> None:
    for direction in (1.0, -1.0):
        wanted = facings(*(direction * np.linspace(0.0, 300.0, 6)))
        found = turn_with_walks(*STILL, SURE, TIMES, wanted, (None, None))
        np.testing.assert_allclose(np.diff(found), direction * np.radians(300.0) / 40.0, atol=1e-9)


@given(st.integers(0, 10_000))
def test_every_facing_is_met_however_the_body_turns_at_its_ends(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wanted = facings(*rng.uniform(-180.0, 180.0, rng.integers(2, 21)))
    turn = rng.normal(0.0, 0.1, 40)
    rates = [float(rate) if rng.random() < 0.7 else None for rate in rng.normal(0.0, 2.0, 2)]
    found = turn_with_walks(
        turn, turn**2 + rng.uniform(0.0, 0.1, 40), rng.uniform(0.0, 1.0, 40), TIMES, wanted, (rates[0], rates[1])
    )
    for move, facing in wanted.items():
        assert rot.angle(rot.about_vertical(found[2 * move]), facing) < 1e-7


@pytest.mark.parametrize("rates", [(1.5, -2.0), (None, 0.8), (0.0, None)])
def test_a_body_that_turns_at_an_end_does_so(rates: tuple[float | None, float | None]) -> None:
    times = np.linspace(0.0, 4.0, 8001)
    ends = {0: rot.about_vertical(0.3), 4000: rot.about_vertical(1.2)}
    found = turn_with_walks(np.zeros(8000), np.full(8000, 1e-3), np.ones(8000), times, ends, rates)
    for step, rate in zip(np.diff(found)[[0, -1]] / times[1], rates, strict=True):
        assert step == pytest.approx(0.9 / 4.0 if rate is None else rate, abs=0.01)


def test_the_turning_at_an_end_is_that_of_its_own_step() -> None:
    """However fast the body would turn there, and in the steps beside it."""
    times, varies = np.linspace(0.0, 4.0, 8001), np.full(8000, 1e-3)
    varies[[0, -1]] = 0.02  # there what is missing is turned twenty times as fast
    ends = {0: rot.about_vertical(0.3), 4000: rot.about_vertical(1.3)}
    free, found = (
        turn_with_walks(np.zeros(8000), varies, np.ones(8000), times, ends, rates)
        for rates in ((None, None), (1.5, -2.0))
    )
    assert np.diff(free)[0] / times[1] > 4.0
    np.testing.assert_allclose(np.diff(found)[[0, -1]] / times[1], [1.5, -2.0], atol=0.05)


@pytest.mark.parametrize("rate", [6.0, -6.0])
@pytest.mark.parametrize("end", [0, 1])
def test_a_body_that_spins_at_an_end_turns_once_more_that_way_at_most(rate: float, end: int) -> None:
    turning, rates = np.sign(rate) * np.radians(900.0) / 40.0 * np.ones(40), [None, None]
    rates[end] = rate
    walks = turning, turning**2 + 1e-6, SURE, TIMES, facings(0.0, 40.0)
    wound = turn_with_walks(*walks, (rates[0], rates[1]))
    assert np.degrees(wound[-1] - wound[0]) == pytest.approx(40.0 + (720.0 if rate > 0.0 else -1080.0), abs=1e-6)
    near = turn_with_walks(*walks, (rates[0], rates[1]), near=True)
    assert np.degrees(near[-1] - near[0]) == pytest.approx(40.0 + np.sign(rate) * 360.0, abs=1e-6)
    # Not against its spin, whatever walks do.
    against = turn_with_walks(-turning, *walks[1:], (rates[0], rates[1]), near=True)
    assert np.degrees(against[-1] - against[0]) == pytest.approx(40.0, abs=1e-6)


# --- near the states of a path ----------------------------------------------------------------------------------------


@given(st.integers(0, 10_000), st.floats(0.01, 0.5))
def test_corrected_headings_are_near_their_states_and_do_not_leap(seed: int, within: float) -> None:
    """The body turns steadily; its states lie all about it, but no further from one to the next than half a turn."""
    rng = np.random.default_rng(seed)
    headings = np.cumsum(rng.uniform(-0.8, 0.8, 30))
    path = np.cumsum(rng.uniform(-0.8, 0.8, 30))
    centres = rot.heading(rot.about_vertical(path))  # states know no whole turns
    corrected = headings + correct_headings(headings, centres, np.full(30, within))
    assert np.abs(np.angle(np.exp(1j * (corrected - centres)))).max() <= within + 1e-9
    # A path and headings that differ by less than 1.6 a move: what is added changes by no more, and the tolerance.
    assert np.abs(np.diff(corrected - headings)).max() <= 1.6 + 2.0 * within + 1e-9


def test_headings_within_their_states_are_left_alone() -> None:
    headings = np.linspace(0.0, 30.0, 50)
    centres = rot.heading(rot.about_vertical(headings + 0.1 * np.sin(np.arange(50))))
    np.testing.assert_allclose(correct_headings(headings, centres, np.full(50, 0.11)), 0.0, atol=1e-12)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_where_both_turn_opposite_ways_corrections_come_to_a_whole_turn_and_stay_there(way: float) -> None:
    """The walks turn by a third of a turn one way, the path by two thirds the other, and both then stand."""
    share = np.clip(np.linspace(0.0, 2.0, 40), 0.0, 1.0)
    headings, path = way * share * 2.0 * np.pi / 3.0, -way * share * 4.0 * np.pi / 3.0
    out = correct_headings(headings, rot.heading(rot.about_vertical(path)), np.full(40, 0.2))
    np.testing.assert_allclose(out[20:], -way * 2.0 * np.pi, atol=1e-9)
    assert out[0] == 0.0
    assert np.all(way * np.diff(out) < 1e-9)


# --- travel -----------------------------------------------------------------------------------------------------------


def test_a_body_travels_level_and_in_its_heading_midway() -> None:
    travel = np.array([[0.0, 0.3, 1.0], [1.0, 0.0, 0.0]])
    found = travel_along(travel, np.radians([0.0, 180.0, 180.0]))
    np.testing.assert_allclose(found, [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], atol=1e-12)
