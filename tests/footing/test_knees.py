"""Knees that bend no faster than they can, and keep their fine detail."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from motionmind.footing.knees import SHIFTS, bend_of, distance_of, greatest_around, keep_detail, slow_down, smoothed

FPS, FASTEST = 30.0, 6.0


@st.composite
def knees(draw):
    """Bends of a knee of 40 frames, slow at its two fixed ends, and where its foot stands."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    bends = np.clip(np.cumsum(rng.normal(0.0, 0.5, 40)), 0.0, 2.5)
    bends[[0, -1]] = rng.uniform(0.0, 1.0, 2)
    stands = np.repeat(rng.random(8) < 0.5, 5)
    fixed = np.zeros(40, dtype=bool)
    fixed[[0, -1]] = True
    return bends, stands, fixed


@given(knees())
def test_knees_are_slow_enough_and_keep_what_is_fixed(case):
    bends, stands, fixed = case
    out = slow_down(bends, stands, fixed, FASTEST, FPS)
    assert np.abs(np.diff(out)).max() * FPS <= FASTEST + 1e-6
    assert np.array_equal(out[fixed], bends[fixed])


def test_slow_knees_are_let_be():
    bends = np.linspace(0.0, 2.0, 31)
    assert slow_down(bends, np.ones(31, bool), np.zeros(31, bool), FASTEST, FPS) is bends


def test_a_swinging_leg_bends_more_and_a_standing_one_is_kept():
    bends, stands, fixed = np.zeros(61), np.ones(61, bool), np.zeros(61, bool)
    fixed[[0, -1]] = True
    stands[20:41] = False
    bends[28:33] = 1.5
    out = slow_down(bends, stands, fixed, FASTEST, FPS)
    assert np.abs(out[:19]).max() == 0.0
    assert np.abs(out[42:]).max() == 0.0
    assert np.all(out[22:39] >= bends[22:39] - 0.3)
    assert out[30] > 1.2


def test_a_bend_and_a_distance_are_the_same_thing():
    bends = np.linspace(0.0, 3.0, 20)
    assert np.allclose(bend_of(distance_of(bends, 0.4, 0.45), 0.4, 0.45), bends)


def test_the_greatest_around_is_that_of_a_window_and_beyond_the_ends_of_what_is_there():
    values = np.random.default_rng(0).random(20)
    for reach, beyond in ((0, 0), (1, 0), (3, 3), (30, 2), (2, 5)):
        padded = np.pad(values, reach + beyond, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
        np.testing.assert_array_equal(greatest_around(values, reach, beyond), windows.max(axis=1))


def test_smoothing_keeps_lines():
    line = np.linspace(0.3, 2.0, 25)
    assert np.allclose(smoothed(line, 0.2, FPS), line)


@given(st.integers(0, 2**32 - 1))
def test_a_knee_all_but_straight_keeps_its_own_detail_and_its_foot_hardly_moves(seed):
    rng, time = np.random.default_rng(seed), np.arange(61) / FPS
    own = 0.2 + 0.05 * np.sin(2.0 * np.pi * time)
    # A foot that is to keep its place to the millimetre asks for this of the knee.
    wanted = bend_of(distance_of(own, 0.4, 0.4) - 0.004 + 0.0005 * rng.uniform(-1.0, 1.0, 61), 0.4, 0.4)
    fixed = np.zeros(61, dtype=bool)
    fixed[[0, -1]] = True
    out = keep_detail(wanted, own, fixed, 0.4, 0.4, FPS)
    rough = [FPS**2 * np.sqrt(np.mean(np.diff(bends - own, 2)[1:-1] ** 2)) for bends in (out, wanted)]
    assert rough[0] < 0.6 * rough[1]
    assert np.abs(distance_of(out, 0.4, 0.4) - distance_of(wanted, 0.4, 0.4)).max() < 2.5 * SHIFTS
    assert np.array_equal(out[fixed], wanted[fixed])


def test_a_knee_that_bends_slowly_for_its_foot_does_so():
    own = np.full(91, 0.6)
    wanted = own + 0.4 * np.sin(np.linspace(0.0, np.pi, 91)) ** 2
    fixed = np.zeros(91, dtype=bool)
    fixed[[0, -1]] = True
    out = keep_detail(wanted, own, fixed, 0.4, 0.4, FPS)
    assert np.abs(distance_of(out, 0.4, 0.4) - distance_of(wanted, 0.4, 0.4)).max() < 0.25 * SHIFTS
