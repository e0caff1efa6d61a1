"""The filter of jitter: its gain, the noise that it finds, and what it leaves of quick movement."""

from __future__ import annotations

import numpy as np
import pytest
from damages import apart, backwards, noisy, recording
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.clean.jitter import (
    MIN_FILTERED_FRAMES,
    MIN_NOISE_M,
    MIN_NOISE_RAD,
    filter_places,
    filter_rotations,
    measure_noise,
    smooth,
)
from motionmind.geometry import rotations as rot


def solved(values: Floats, cut_off: float, fps: float) -> Floats:
    """The least-squares problem of the filter, by a dense solver."""
    second = np.diff(np.eye(len(values)), 2, axis=0)
    factor = (2.0 * np.sin(np.pi * cut_off / fps)) ** -4
    return np.asarray(np.linalg.solve(np.eye(len(values)) + factor * second.T @ second, values))


@given(st.integers(3, 40), st.floats(0.5, 60.0), st.integers(0, 99))
@settings(deadline=None, max_examples=40)
def test_the_filter_solves_its_problem(count: int, cut_off: float, seed: int) -> None:
    values = np.random.default_rng(seed).standard_normal((count, 2))
    np.testing.assert_allclose(smooth(values, cut_off, 150.0), solved(values, cut_off, 150.0), atol=1e-7)


@pytest.mark.parametrize("share", [0.3, 1.0, 2.5])
def test_the_gain_is_that_of_a_butterworth_filter_run_twice(share: float) -> None:
    fps, cut_off = 240.0, 4.0
    times = np.arange(4800) / fps
    wave = np.sin(2.0 * np.pi * share * cut_off * times)
    middle = slice(1200, 3600)
    gain = smooth(wave, cut_off, fps)[middle] @ wave[middle] / (wave[middle] @ wave[middle])
    assert gain == pytest.approx(1.0 / (1.0 + share**4), abs=0.01)


def test_straight_lines_and_turns_of_constant_speed_stay() -> None:
    times = np.arange(200) / 60.0
    np.testing.assert_allclose(smooth(3.0 - 2.0 * times, 2.0, 60.0), 3.0 - 2.0 * times, atol=1e-9)
    spin = rot.from_axis_angle([0.0, 0.6, 0.8], 9.0 * times)
    turned = rot.normalise(smooth(rot.continuous(spin[:, None]), 2.0, 60.0))[60:-60, 0]
    assert np.degrees(rot.angle(turned, spin[60:-60])).max() < 0.1


@pytest.mark.parametrize("fps", [24.0, 60.0, 240.0])
@pytest.mark.parametrize("degrees", [0.3, 1.5])
def test_the_noise_is_measured_beside_movement(fps: float, degrees: float) -> None:
    motion = noisy(recording(fps, seconds=20.0), degrees)
    found = np.degrees(filter_rotations(motion.rotations, fps).noise)
    assert np.median(found) == pytest.approx(degrees, rel=0.15)


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0, 120.0, 240.0])
def test_movement_without_jitter_stays_to_the_last_bit(fps: float) -> None:
    motion = recording(fps)
    quiet = noisy(motion, 0.5 * np.degrees(MIN_NOISE_RAD))
    found = filter_rotations(quiet.rotations, fps)
    untouched = np.isinf(found.cut_offs).all(axis=0)
    assert untouched.mean() > 0.9 if fps < 30.0 else untouched.all()
    np.testing.assert_array_equal(found.values[:, untouched], quiet.rotations[:, untouched])
    np.testing.assert_array_equal(filter_places(motion.root[:, None], fps).values[:, 0], motion.root)


def test_few_frames_do_not_show_their_noise() -> None:
    motion = noisy(recording(), 2.0).slice(0, MIN_FILTERED_FRAMES - 1)
    np.testing.assert_array_equal(filter_rotations(motion.rotations, 60.0).values, motion.rotations)


@pytest.mark.parametrize("degrees", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("fps", [30.0, 120.0])
def test_a_filtered_recording_is_nearer_to_the_truth(fps: float, degrees: float) -> None:
    truth = recording(fps)
    damaged = noisy(truth, degrees)
    found = filter_rotations(damaged.rotations, fps)
    before, after = (np.sqrt((apart(truth, one) ** 2).mean()) for one in (damaged, replaced(damaged, found.values)))
    assert after < (0.5 if fps > 100.0 else 0.75) * before


def replaced(motion: Motion, rotations: Floats) -> Motion:
    return Motion(motion.skeleton, rotations, motion.root, motion.times, motion.name)


def test_more_noise_means_a_lower_cut_off() -> None:
    motion = recording(120.0)
    medians = [
        float(np.median(filter_rotations(noisy(motion, degrees).rotations, 120.0).cut_offs))
        for degrees in (0.1, 0.5, 2.5)
    ]
    assert sorted(medians, reverse=True) == medians
    assert medians[-1] < 0.7 * medians[0]


def test_a_kick_is_blunted_less_than_by_one_cut_off_for_all_time() -> None:
    fps = 120.0
    times = np.arange(480) / fps
    truth = rot.from_axis_angle([1.0, 0.0, 0.0], 1.5 * np.exp(-(((times - 2.0) / 0.04) ** 2)))[:, None]
    rng = np.random.default_rng(4)
    damaged = rot.mul(truth, rot.exp(np.radians(0.5) * rng.standard_normal((480, 1, 3))))
    found = filter_rotations(damaged, fps)
    kick, rest = slice(230, 251), slice(30, 180)
    error = np.degrees(rot.angle(found.values, truth)[:, 0])
    sections = butter(2, 6.0 / (0.5 * fps), output="sos")
    blunt = np.degrees(rot.angle(rot.normalise(sosfiltfilt(sections, damaged, axis=0)), truth)[:, 0])
    assert error[kick].max() < 2.5
    assert blunt[kick].max() > 10.0
    assert error[rest].mean() < 0.5 * np.degrees(rot.angle(damaged, truth)[rest, 0]).mean()
    assert found.cut_offs[240, 0] > 2.0 * np.median(found.cut_offs[rest, 0])


def test_the_filter_has_no_direction_in_time_and_none_in_space() -> None:
    motion = noisy(recording(), 1.0)
    forward = filter_rotations(motion.rotations, 60.0).values
    backward = filter_rotations(backwards(motion).rotations, 60.0).values[::-1]
    assert rot.angle(forward, backward).max() < 1e-9
    turn = rot.exp(np.array([0.3, -1.1, 0.7]))
    turned = filter_rotations(rot.mul(turn, motion.rotations), 60.0).values
    assert rot.angle(turned, rot.mul(turn, forward)).max() < 1e-9


def test_the_signs_of_quaternions_do_not_count() -> None:
    motion = noisy(recording(), 1.0)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], motion.rotations.shape[:2])[..., None]
    one, other = (filter_rotations(q, 60.0).values for q in (motion.rotations, signs * motion.rotations))
    assert rot.angle(one, other).max() < 1e-9


@pytest.mark.parametrize("millimetres", [0.5, 4.0])
def test_the_root_is_filtered_by_its_own_noise(millimetres: float) -> None:
    motion = recording()
    noise = 1e-3 * millimetres * np.random.default_rng(0).standard_normal(motion.root.shape)
    found = filter_places((motion.root + noise)[:, None], 60.0)
    assert 1000.0 * found.noise[0] == pytest.approx(millimetres, rel=0.15)
    assert np.abs(found.values[:, 0] - motion.root).mean() < 0.6 * np.abs(noise).mean()
    assert 1e-3 * millimetres > MIN_NOISE_M


def test_noise_of_a_burst_is_not_that_of_the_recording() -> None:
    values = np.random.default_rng(0).standard_normal((400, 1, 3))
    values[100:140] *= 50.0
    assert measure_noise(values)[0] == pytest.approx(1.0, rel=0.25)
