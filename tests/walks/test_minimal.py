"""The minimal movement between two postures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot
from motionmind.walks.minimal import END_VELOCITY_DECAY_S, departure, minimal_movement

SOON = 1e-6  # seconds


def spaced(length: float, steps: int = 24) -> Floats:
    """Times from 2 s on, with instants right after the first and right before the last."""
    times = 2.0 + np.linspace(0.0, length, steps + 1)
    return np.concatenate([times[:1], [times[0] + SOON], times[1:-1], [times[-1] - SOON], times[-1:]])


def velocities(rotations: Floats) -> Floats:
    """Angular velocities at both ends [2, m, 3] of a movement at `spaced` times, in the joints' own frames."""
    begins, ends = rotations[[0, -1]], rotations[[1, -2]]
    return np.asarray(rot.log(rot.inv_mul(begins, ends)) / np.array([SOON, -SOON])[:, None, None])


@pytest.mark.parametrize("length", [0.05, END_VELOCITY_DECAY_S, 0.7, 5.0])
@pytest.mark.parametrize("given_rates", [(True, True), (True, False), (False, True)])
def test_a_departure_is_0_at_both_ends_and_has_the_given_rates_there(
    length: float, given_rates: tuple[bool, bool]
) -> None:
    rng, times = np.random.default_rng(0), spaced(length)
    rates = [rng.normal(size=(4, 3)) if has else None for has in given_rates]
    out = departure(times, *rates)
    assert out.shape == (len(times), 4, 3)
    np.testing.assert_array_equal(out[[0, -1]], 0.0)
    for found, rate in zip((out[1] / SOON, -out[-2] / SOON), rates, strict=True):
        np.testing.assert_allclose(found, 0.0 if rate is None else rate, atol=1e-4)


def test_a_departure_is_small_and_is_over_after_a_while() -> None:
    times = np.linspace(0.0, 3.0, 301)
    out = departure(times, np.array(1.0), np.array(-2.0))
    np.testing.assert_array_equal(out[(times >= END_VELOCITY_DECAY_S) & (times <= 3.0 - END_VELOCITY_DECAY_S)], 0.0)
    assert np.abs(out).max() < 2.0 * END_VELOCITY_DECAY_S * 4.0 / 27.0 + 1e-9  # the cubic's own maximum
    assert np.abs(np.diff(out, 2)).max() < 2.0 * 6.0 / END_VELOCITY_DECAY_S * 0.01**2 * 1.1  # nowhere a leap or a kink
    np.testing.assert_array_equal(departure(times, None, None), 0.0)


@pytest.mark.parametrize("length", [0.2, END_VELOCITY_DECAY_S, 3.0])
def test_a_departure_lasts_for_all_of_a_short_time(length: float) -> None:
    t, lasts = np.linspace(0.0, length, 31), min(length, END_VELOCITY_DECAY_S)
    cubic = t * np.maximum(1.0 - t / lasts, 0.0) ** 2
    np.testing.assert_allclose(departure(1.0 + t, np.array(3.0), None), 3.0 * cubic, atol=1e-12)
    np.testing.assert_allclose(departure(1.0 + t, None, np.array(3.0)), -3.0 * cubic[::-1], atol=1e-12)


def test_rates_of_numbers_are_of_the_times_shape() -> None:
    assert departure(np.linspace(0.0, 1.0, 5), np.asarray(2.0), None).shape == (5,)


@given(st.integers(0, 10_000))
def test_with_no_velocity_the_minimal_movement_is_slerp(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends, times = rot.normalise(rng.normal(size=(2, 5, 4))), np.sort(rng.uniform(0.0, 4.0, 9))
    found = minimal_movement(ends, times, None, None)
    share = (times - times[0]) / (times[-1] - times[0])
    assert rot.angle(found, rot.slerp(ends[:1], ends[1:], share[:, None])).max() < 1e-7


@pytest.mark.parametrize("length", [0.1, 0.45, 2.0])
@pytest.mark.parametrize("given_rates", [(True, True), (True, False), (False, True)])
def test_the_minimal_movement_meets_its_ends_with_their_velocities(
    length: float, given_rates: tuple[bool, bool]
) -> None:
    rng, times = np.random.default_rng(1), spaced(length)
    ends = rot.normalise(rng.normal(size=(2, 6, 4)))
    rates = [rng.normal(size=(6, 3)) if has else None for has in given_rates]
    found = minimal_movement(ends, times, *rates)
    assert rot.angle(found[[0, -1]], ends).max() < 1e-7
    even = rot.log(rot.inv_mul(*ends)) / length
    for velocity, rate in zip(velocities(found), rates, strict=True):
        np.testing.assert_allclose(velocity, even if rate is None else rate, atol=1e-3)


def test_a_body_that_turns_evenly_already_goes_on_so() -> None:
    rng, times = np.random.default_rng(2), np.linspace(0.0, 1.5, 16)
    ends = rot.normalise(rng.normal(size=(2, 6, 4)))
    even = rot.log(rot.inv_mul(*ends)) / 1.5
    found, straight = minimal_movement(ends, times, even, even), minimal_movement(ends, times, None, None)
    assert rot.angle(found, straight).max() < 1e-7
