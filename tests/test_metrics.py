"""Measures of movement: laws that they keep, and what others' definitions give on the same movement."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from bodies import insect
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.errors import MotionMindError
from motionmind.metrics import (
    angular_jerk,
    angular_speed,
    find_feet,
    find_floor,
    foot_slide,
    l2p,
    l2q,
    npss,
    position_spread,
    seen,
    skating,
    sparc,
)
from motionmind.skeleton import human23, human44

Floats = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1)


def movement(rng: np.random.Generator, *shape: int, step: float = 0.1) -> Floats:
    """Rotations [*shape, 4] that walk at random along the first axis but one of the last two, from random ones."""
    start = rot.exp(rng.normal(size=(*shape[:-2], 1, shape[-1], 3)))
    steps = rot.exp(step * rng.normal(size=(*shape, 3)))
    out = [start[..., 0, :, :]]
    for t in range(1, shape[-2]):
        out.append(rot.mul(out[-1], steps[..., t, :, :]))
    return np.stack(out, axis=-3)


def flipped(rng: np.random.Generator, q: Floats) -> Floats:
    """The same rotations, some as -q."""
    return np.asarray(q * rng.choice([-1.0, 1.0], size=(*q.shape[:-1], 1)))


# --- in between -------------------------------------------------------------------------------------------------------


def lafan1(truth: Floats, made: Floats) -> tuple[float, float]:
    """L2Q and NPSS of global quaternions [B, T, J, 4] whose signs fit, as the protocol's formulas read, one by one."""
    norms = [np.linalg.norm(made[b, t] - truth[b, t]) for b in range(len(truth)) for t in range(truth.shape[1])]
    distances, weights = [], []
    for b in range(len(truth)):
        for joint in range(truth.shape[2]):
            for k in range(4):
                power = [np.fft.fft(q[b, :, joint, k]).real ** 2 for q in (truth, made)]
                share = [one / one.sum() if one.sum() else one for one in power]
                distances.append(np.abs(np.cumsum(share[1]) - np.cumsum(share[0])).sum())
                weights.append(power[0].sum())
    return float(np.mean(norms)), float(np.dot(distances, weights) / np.sum(weights))


@given(seeds)
def test_l2q_and_npss_are_those_of_the_protocol(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = movement(rng, 3, 12, 5)
    made = rot.mul(truth, rot.exp(0.2 * rng.normal(size=(3, 12, 5, 3))))
    made[0, :, 0] = rot.IDENTITY  # no power in three of its coefficients
    expected = lafan1(np.asarray(truth), made * np.sign(np.sum(made * truth, axis=-1, keepdims=True)))
    assert l2q(truth, made).mean() == pytest.approx(expected[0])
    smooth = made.copy()
    for t in range(1, 12):
        smooth[:, t] *= np.sign(np.sum(smooth[:, t] * smooth[:, t - 1], axis=-1, keepdims=True))
    assert npss(truth, made) == pytest.approx(lafan1(truth, smooth)[1])


@given(seeds)
def test_the_sign_of_a_quaternion_counts_for_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth, made = movement(rng, 2, 9, 4), movement(rng, 2, 9, 4)
    others = flipped(rng, truth), flipped(rng, made)
    assert np.allclose(l2q(*others), l2q(truth, made))
    assert npss(*others) == pytest.approx(npss(truth, made))
    assert np.allclose(angular_jerk(others[0], 30.0), angular_jerk(truth, 30.0))
    assert np.allclose(angular_speed(others[0], 30.0), angular_speed(truth, 30.0))


@given(seeds)
def test_the_truth_is_no_error_at_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = movement(rng, 2, 9, 4)
    places = rng.normal(size=(2, 9, 4, 3))
    assert np.array_equal(l2q(truth, truth), [0.0, 0.0])
    assert npss(truth, truth) == 0.0
    assert np.array_equal(l2p(places, places, np.ones((4, 3))), [0.0, 0.0])


@given(seeds, st.floats(0.0, np.pi))
def test_l2q_of_joints_that_are_all_off_by_an_angle(seed: int, angle: float) -> None:
    rng = np.random.default_rng(seed)
    truth = movement(rng, 1, 5, 7)
    axis = rng.normal(size=(1, 5, 7, 3))
    made = rot.mul(truth, rot.from_axis_angle(axis / np.linalg.norm(axis, axis=-1, keepdims=True), angle))
    assert l2q(truth, flipped(rng, made))[0] == pytest.approx(2.0 * np.sqrt(7.0) * np.sin(angle / 4.0))


def test_l2p_counts_each_coordinate_in_its_spread() -> None:
    rng = np.random.default_rng(0)
    places = rng.normal(size=(40, 50, 3, 3)) * np.array([0.1, 1.0, 10.0]) + 5.0
    spread = position_spread(places)
    assert np.allclose(spread, [0.1, 1.0, 10.0], rtol=0.05)
    off = places + 2.0 * spread  # every one of nine coordinates is two standard deviations off
    assert np.allclose(l2p(places, off, spread), 2.0 * 3.0)


def test_what_never_moves_measures_nothing() -> None:
    places = np.random.default_rng(0).normal(size=(4, 5, 2, 3))
    places[..., 1, 2] = 1.0
    with pytest.raises(MotionMindError, match="never moves"):
        position_spread(places)


@given(seeds, st.floats(-np.pi, np.pi))
def test_where_the_stage_is_and_how_it_is_turned_counts_for_nothing(seed: int, turn: float) -> None:
    rng = np.random.default_rng(seed)
    body = human23()
    truth, made = movement(rng, 2, 8, len(body)), movement(rng, 2, 8, len(body))
    roots = rng.normal(size=(2, 2, 8, 3))
    about, moved = rot.about_vertical(turn), np.array([rng.normal(), 0.0, rng.normal()])
    found = []
    for q, p in ((rot.IDENTITY, np.zeros(3)), (about, moved)):
        there = [one.copy() for one in (truth, made)]
        for one in there:
            one[..., 0, :] = rot.mul(q, one[..., 0, :])
        places = rot.mul_vec(q, roots) + p
        shown = [seen(body, one, root, there[0], places[0]) for one, root in zip(there, places, strict=True)]
        (true_turns, true_places), (turns, positions) = shown
        found.append([*l2q(true_turns, turns), *l2p(true_places, positions, np.ones(3)), npss(true_turns, turns)])
        assert np.allclose(rot.heading(true_turns[:, 0, 0]), 0.0)
        assert np.allclose(true_places[:, :, 0, ::2].mean(axis=1), 0.0)
    assert np.allclose(found[0], found[1])


# --- smooth -----------------------------------------------------------------------------------------------------------


@given(seeds, st.sampled_from([10.0, 30.0, 120.0]))
def test_the_jerk_of_a_turn_that_is_a_cubic_of_time_is_exact_at_any_rate(seed: int, fps: float) -> None:
    rng = np.random.default_rng(seed)
    a, b, c = rng.normal(size=(3, 4))
    axes = rng.normal(size=(4, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    t = np.arange(12)[:, None] / fps
    turns = rot.from_axis_angle(axes, a * t + b * t**2 + c * t**3)
    assert np.allclose(angular_jerk(turns, fps), 6.0 * np.abs(c), rtol=1e-4, atol=1e-5)


@given(seeds)
def test_jerk_and_speed_are_the_same_however_the_world_is_turned(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turns = movement(rng, 12, 3)
    turned = rot.mul(rot.exp(rng.normal(size=3)), turns)
    assert np.allclose(angular_jerk(turned, 30.0), angular_jerk(turns, 30.0))
    assert np.allclose(angular_speed(turned, 30.0), angular_speed(turns, 30.0))


def test_an_even_turn_has_its_speed_and_no_jerk() -> None:
    turns = rot.about_vertical(0.05 * np.arange(20))[:, None]
    assert np.allclose(angular_speed(turns, 30.0), 1.5)
    assert np.allclose(angular_jerk(turns, 30.0), 0.0, atol=1e-8)


def test_sparc_is_what_its_authors_compute() -> None:
    # The value that the documentation of their code gives for this speed.
    t = np.arange(-1.0, 1.0, 0.01)
    assert sparc(np.exp(-5.0 * t**2), 100.0) == pytest.approx(-1.41403, abs=5e-6)


def test_sparc_falls_with_every_halt_and_not_with_size() -> None:
    t = np.linspace(0.0, 1.0, 301)
    halts = [np.abs(np.sin(np.pi * count * t)) for count in (1, 2, 3, 5)]
    found = [sparc(speed, 100.0) for speed in halts]
    assert all(before > after for before, after in pairwise(found))
    assert sparc(7.0 * halts[2], 100.0) == pytest.approx(found[2])
    assert np.isnan(sparc(np.zeros(30), 30.0))


# --- feet -------------------------------------------------------------------------------------------------------------


def walker(steps: Floats, lift: float = 0.0) -> tuple[Floats, Floats]:
    """Rotations and root of a standing body that is moved by `steps` [T - 1, 3], its soles `lift` above the floor."""
    body = human23()
    ground = -float(body.positions_and_tips(np.tile(rot.IDENTITY, (23, 1)), np.zeros(3))[:, 1].min())
    root = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]) + np.array([0.0, ground + lift, 0.0])
    return np.tile(rot.IDENTITY, (len(root), 23, 1)), root


def test_feet_are_where_limbs_end_on_the_floor() -> None:
    for body, names in (
        (human23(), ["left_toes", "right_toes"]),
        (human44(), ["left_toes_end", "right_toes_end"]),
        (insect(), [name for name in insect().names if name.endswith("tibia")]),
    ):
        assert [body.names[joint] for joint in find_feet(body)] == names


@pytest.mark.parametrize(
    ("step", "lift", "expected"), [(0.026, 0.0, 0.5), (0.024, 0.0, 0.0), (0.026, 0.049, 0.5), (0.026, 0.051, 0.0)]
)
def test_a_foot_skates_that_is_low_and_goes_far(step: float, lift: float, expected: float) -> None:
    steps = np.zeros((20, 3))
    steps[::2, 0] = step
    rotations, root = walker(steps, lift)
    assert skating(human23(), rotations, root) == expected
    assert skating(human23(), rotations, root + np.array([0.0, 1.0, 0.0]), floor=1.0) == expected
    assert find_floor(human23(), rotations, root) == pytest.approx(lift)


def test_a_foot_slides_as_far_as_the_body_goes_on_the_floor() -> None:
    steps = np.zeros((20, 3))
    steps[:, 2] = -0.01
    slides = [foot_slide(human23(), *walker(steps, lift)) for lift in (0.0, 0.005, 0.01, 0.02, 0.03)]
    assert slides[0] == pytest.approx(1.0)
    assert slides == sorted(slides, reverse=True)
    assert slides[-1] == 0.0


def test_a_body_that_turns_on_the_ball_of_its_foot_does_not_skate() -> None:
    body = human23()
    rotations, root = walker(np.zeros((20, 3)))
    ball = body.index("left_toes")
    pivot = body.positions(rotations, root)[0, ball]
    turn = rot.about_vertical(0.5 * np.arange(21))
    rotations[:, 0] = turn
    root = pivot + rot.mul_vec(turn, root - pivot)
    lifted = rotations.copy()
    lifted[:, body.index("right_hip")] = rot.from_axis_angle([1.0, 0.0, 0.0], -1.0)
    assert skating(body, lifted, root) == 0.0
    assert skating(body, rotations, root) == 1.0  # the other foot is dragged along
    assert foot_slide(body, lifted, root) == pytest.approx(0.0, abs=1e-9)
