"""Splines through numbers, SciPy's the oracle, and through rotations."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline


@pytest.mark.parametrize("count", [2, 3, 4, 9])
@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_a_natural_spline_is_scipys(count: int, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(count)
    times = np.cumsum(rng.uniform(0.1, 2.0, count))
    values = rng.normal(size=(count, *shape))
    at = np.sort(np.concatenate([times, rng.uniform(times[0], times[-1], 50)]))
    expected = CubicSpline(times, values, bc_type="natural")(at)
    np.testing.assert_allclose(natural_spline(times, values, at), expected, atol=1e-12)


def test_a_spline_through_one_knot_stays_there() -> None:
    np.testing.assert_array_equal(natural_spline(np.zeros(1), np.ones((1, 3)), np.arange(4.0)), np.ones((4, 3)))
    key = rot.about_vertical(0.3)[None]
    np.testing.assert_array_equal(rotation_spline(np.zeros(1), key, np.arange(4.0)), np.tile(key, (4, 1)))


def test_splines_of_many_knots_are_made_in_pieces_that_fit() -> None:
    times, keys = wander(150, 40.0, seed=1)
    at = np.linspace(0.0, times[-1], 800)
    np.testing.assert_allclose(
        natural_spline(times, times[:, None] ** 2 + keys[:, 0], at),
        CubicSpline(times, times[:, None] ** 2 + keys[:, 0], bc_type="natural")(at),
        atol=1e-5,
    )
    spans = rot.about_vertical(np.cumsum(np.radians(30.0 + 20.0 * keys[:, 0, 0])))
    expected = CubicSpline(times, np.unwrap(rot.heading(spans)), bc_type="natural")(at)
    assert rot.angle(rotation_spline(times, spans, at), rot.about_vertical(expected)).max() < 1e-6


def wander(count: int, degrees: float, seed: int, chains: int = 5) -> tuple[Floats, Floats]:
    """Times [K] and rotations [K, chains, 4] that turn by at most so many degrees from one to the next."""
    rng = np.random.default_rng(seed)
    keys = [rot.normalise(rng.normal(size=(chains, 4)))]
    for _ in range(count - 1):
        axis = rng.normal(size=(chains, 3))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        keys.append(rot.mul(keys[-1], rot.from_axis_angle(axis, np.radians(degrees) * rng.uniform(0.2, 1.0, chains))))
    return np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 0.3, count - 1))]), np.array(keys)


@pytest.mark.parametrize(("count", "degrees"), [(3, 20.0), (6, 90.0), (12, 170.0), (30, 45.0)])
def test_a_rotation_spline_meets_its_keys_whatever_their_signs(count: int, degrees: float) -> None:
    times, keys = wander(count, degrees, seed=count)
    assert rot.angle(rotation_spline(times, keys, times), keys).max() < 1e-12
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (*keys.shape[:2], 1))
    at = np.linspace(0.0, times[-1], 100)
    assert rot.angle(rotation_spline(times, signs * keys, at), rotation_spline(times, keys, at)).max() < 1e-9


@pytest.mark.parametrize(("count", "degrees"), [(3, 60.0), (7, 40.0), (9, 100.0)])
def test_a_rotation_spline_has_a_continuous_angular_velocity_and_acceleration(count: int, degrees: float) -> None:
    times, keys = wander(count, degrees, seed=count + 1)
    h = 1e-4
    # Angular velocities at half steps h before and after each inner key, then their differences.
    steps = np.arange(-3, 4) * h
    at = (times[1:-1, None] + steps).ravel()
    curve = rotation_spline(times, keys, at).reshape(count - 2, len(steps), -1, 4)
    velocity = rot.log(rot.mul_inv(curve[:, 1:], curve[:, :-1])) / h
    acceleration = np.diff(velocity, axis=1) / h
    speed, bend = np.abs(velocity).max(), np.abs(acceleration).max()
    assert np.abs(velocity[:, 3] - velocity[:, 2]).max() < 2.0 * bend * h + 1e-9 * speed
    across = np.abs(acceleration[:, 3] - acceleration[:, 1]).max()  # one is before the key, one after it
    assert across < 0.02 * bend


def test_keys_about_one_axis_give_the_spline_of_their_angle_through_any_number_of_turns() -> None:
    rng = np.random.default_rng(3)
    axis = np.array([0.48, 0.6, 0.64])
    at = np.linspace(0.0, 1.0, 200)
    for count, most in ((3, 100.0), (8, 170.0), (20, 120.0), (30, 60.0)):
        times = np.linspace(0.0, 1.0, count)
        angles = np.cumsum(np.radians(rng.uniform(-0.2 * most, most, count)))
        keys = rot.from_axis_angle(axis, angles)
        expected = rot.from_axis_angle(axis, natural_spline(times, angles, at))
        assert rot.angle(rotation_spline(times, keys, at), expected).max() < 1e-9
    # Exactly a turn and two away from where it began.
    turns = np.radians(120.0) * np.arange(7)
    expected = rot.about_vertical(np.radians(720.0) * at)
    found = rotation_spline(np.linspace(0.0, 1.0, 7), rot.about_vertical(turns), at)
    assert rot.angle(found, expected).max() < 1e-9


def test_two_keys_give_slerp() -> None:
    times, keys = wander(2, 175.0, seed=5)
    shares = np.linspace(0.0, 1.0, 30)
    expected = rot.slerp(keys[:1], keys[1:], shares[:, None])
    assert rot.angle(rotation_spline(times, keys, shares * times[-1]), expected).max() < 1e-12


@pytest.mark.parametrize("tilt", [0.0, 5.0, 15.0, 30.0])
@pytest.mark.parametrize("step", [40.0, 60.0, 90.0, 120.0])
def test_a_body_that_spins_several_times_is_never_spun_back(tilt: float, step: float) -> None:
    tilts = rot.exp(np.radians(tilt) * np.random.default_rng(1).uniform(-1.0, 1.0, (16, 3)))
    keys = rot.mul(rot.about_vertical(np.radians(step) * np.arange(16)), tilts)
    times = np.arange(16) * 0.2
    at = np.linspace(0.0, times[-1], 15 * 60 + 1)
    curve = rotation_spline(times, keys, at)
    fastest_between_keys = rot.angle(keys[1:], keys[:-1]).max() / 0.2
    assert rot.angle(curve[1:], curve[:-1]).max() / (at[1] - at[0]) < 1.5 * fastest_between_keys


@pytest.mark.parametrize(("first", "last"), [(0, 3), (0, 60), (17, 18), (20, 41), (75, 119), (118, 119)])
def test_a_part_of_a_long_curve_is_that_of_the_whole_to_the_last_bit(first: int, last: int) -> None:
    times, keys = wander(120, 60.0, seed=first)
    at = np.linspace(times[0] - 0.1, times[-1] + 0.1, 1000)
    here = (at >= times[first]) & (at <= times[last])
    np.testing.assert_array_equal(rotation_spline(times, keys, at[here]), rotation_spline(times, keys, at)[here])


def test_a_part_of_a_curve_takes_no_more_memory_the_longer_the_curve_is() -> None:
    peaks = []
    for count in (1_000, 20_000):
        times, keys = np.arange(float(count)), np.tile(rot.IDENTITY, (count, 20, 1))
        keys.setflags(write=False)  # like a corpus's
        tracemalloc.start()
        rotation_spline(times, keys, np.array([500.2, 510.7]))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 2 * peaks[0]
