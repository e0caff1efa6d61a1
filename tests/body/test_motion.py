"""Postures and motions: what is refused at the door, and the laws of resampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.mirror import find_sides, mirrored
from motionmind.body.motion import Insertion, Motion, Posture, Velocity
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

ARM = Skeleton("arm", ("shoulder", "elbow"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]))


def some_motion(frames: int, rate: float = 30.0, seed: int = 0, start: float = 0.0) -> Motion:
    rng = np.random.default_rng(seed)
    steps = rot.exp(rng.uniform(-0.4, 0.4, (frames, 2, 3)))
    q = [steps[0]]
    for step in steps[1:]:
        q.append(rot.mul(q[-1], step))
    times = start + np.arange(frames) / rate
    return Motion(ARM, rot.normalise(np.array(q)), np.cumsum(rng.normal(size=(frames, 3)), 0), times, "waving")


# --- velocities -------------------------------------------------------------------------------------------------------


def turning(frames: int, rate: float, turns: Floats, travel: Floats, seed: int = 0) -> Motion:
    """An arm that turns steadily by `turns` [2, 3] radians a second about axes of its own, and travels steadily."""
    start = rot.normalise(np.random.default_rng(seed).normal(size=(2, 4)))
    times = 5.0 + np.arange(frames) / rate
    rotations = rot.mul(start, rot.exp(turns * (times - 5.0)[:, None, None]))
    return Motion(ARM, rot.normalise(rotations), travel * times[:, None], times)


@given(st.integers(2, 40), st.sampled_from([5.0, 24.0, 30.0, 120.0]), st.integers(0, 99))
def test_a_steady_movement_has_its_velocity_at_both_ends(frames: int, rate: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    turns, travel = rng.uniform(-4.0, 4.0, (2, 3)), rng.normal(size=3)
    motion = turning(frames, rate, turns, travel, seed)
    for found in (Velocity.at_start(motion), Velocity.at_end(motion)):
        np.testing.assert_allclose(found.rotations, turns, atol=1e-6)
        np.testing.assert_allclose(found.root, travel, atol=1e-9)


def test_a_velocity_foretells_the_next_frame_in_the_joint_s_own_frame() -> None:
    turns = np.array([[0.0, 3.0, 0.0], [1.0, 0.0, -2.0]])
    motion = turning(11, 60.0, turns, np.array([0.0, 0.0, 1.2]))
    found = Velocity.at_end(motion.slice(0, 10))
    ahead = rot.mul(motion.rotations[9], rot.exp(found.rotations / 60.0))
    assert rot.angle(ahead, motion.rotations[10]).max() < 1e-9
    np.testing.assert_allclose(motion.root[9] + found.root / 60.0, motion.root[10], atol=1e-9)


@given(st.integers(2, 30), st.sampled_from([8.0, 30.0, 120.0]), st.integers(0, 99))
def test_a_movement_run_backwards_begins_with_the_velocity_it_ended_with_reversed(
    frames: int, rate: float, seed: int
) -> None:
    motion = some_motion(frames, rate, seed)
    backwards = Motion(ARM, motion.rotations[::-1], motion.root[::-1], motion.times[-1] - motion.times[::-1])
    for found, expected in (
        (Velocity.at_start(backwards), Velocity.at_end(motion)),
        (Velocity.at_end(backwards), Velocity.at_start(motion)),
    ):
        np.testing.assert_allclose(found.rotations, -expected.rotations, atol=1e-9)
        np.testing.assert_allclose(found.root, -expected.root, atol=1e-9)


def test_a_mirror_mirrors_the_velocity() -> None:
    """A velocity of turning is an axial vector: what a mirror keeps of it is the part along the mirror's axis."""
    rng, body = np.random.default_rng(3), human23()
    steps = rot.exp(rng.uniform(-0.2, 0.2, (6, 23, 3)))
    rotations = np.stack([steps[0], rot.mul(steps[0], steps[1]), rot.mul(steps[0], steps[2])])
    motion = Motion(body, rot.normalise(rotations), rng.normal(size=(3, 3)), np.array([0.0, 0.03, 0.06]))
    for ends in (Velocity.at_start, Velocity.at_end):
        own, seen = ends(motion), ends(mirrored(motion))
        partners = find_sides(body).partners
        np.testing.assert_allclose(seen.rotations, own.rotations[partners] * [1.0, -1.0, -1.0], atol=1e-9)
        np.testing.assert_allclose(seen.root, own.root * [-1.0, 1.0, 1.0], atol=1e-12)


def test_a_velocity_is_of_the_last_fifteenth_of_a_second_or_the_last_step() -> None:
    earlier, later = np.zeros((2, 3)), np.array([[2.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    for rate in (30.0, 120.0):
        count = round(rate / 15.0)
        still = turning(20, rate, earlier, np.zeros(3))
        moves = rot.mul(still.rotations[-1], rot.exp(later * (np.arange(count) + 1.0)[:, None, None] / rate))
        times = 5.0 + np.arange(20 + count) / rate
        motion = Motion(ARM, np.concatenate([still.rotations, moves]), np.zeros((20 + count, 3)), times)
        np.testing.assert_allclose(Velocity.at_end(motion).rotations, later, atol=1e-9)
    keyframes = Motion(ARM, motion.rotations[[0, 10, -1]], np.zeros((3, 3)), np.array([0.0, 1.0, 3.0]))
    np.testing.assert_allclose(Velocity.at_start(keyframes).rotations, 0.0, atol=1e-9)
    np.testing.assert_allclose(Velocity.at_end(keyframes).rotations, later * count / rate / 2.0, atol=1e-9)


def test_noise_of_single_frames_is_averaged_out() -> None:
    turns, rng = np.array([[0.0, 1.0, 0.0], [0.5, 0.0, 0.0]]), np.random.default_rng(0)
    errors = []
    for seed in range(40):
        clean = turning(13, 120.0, turns, np.zeros(3), seed)
        noise = rot.exp(rng.normal(scale=0.002, size=(13, 2, 3)))
        noisy = Motion(ARM, rot.normalise(rot.mul(clean.rotations, noise)), clean.root, clean.times)
        pair = noisy.slice(11, 13)
        errors.append([np.linalg.norm(Velocity.at_end(one).rotations - turns) for one in (noisy, pair)])
    averaged, of_two = np.mean(errors, axis=0)
    assert averaged < of_two / 4.0


def test_one_frame_shows_no_velocity() -> None:
    with pytest.raises(MotionMindError, match="waving has one frame, which shows no velocity"):
        Velocity.at_end(some_motion(1))
    with pytest.raises(MotionMindError, match="has one frame"):
        Velocity.at_start(some_motion(1))


# --- resampling -------------------------------------------------------------------------------------------------------


@given(st.integers(2, 60), st.integers(1, 12), st.floats(-50.0, 50.0), st.sampled_from([24.0, 30.0, 120.0, 29.97]))
def test_frames_on_frames_of_the_source_are_those_frames(frames: int, every: int, start: float, rate: float) -> None:
    motion = some_motion(frames, rate, seed=frames, start=start)
    thinned = motion.resample(rate / every)
    assert len(thinned) == (frames - 1) // every + 1
    np.testing.assert_allclose(thinned.times, motion.times[::every], atol=1e-12)
    assert rot.angle(thinned.rotations, motion.rotations[::every]).max() < 1e-10
    np.testing.assert_allclose(thinned.root, motion.root[::every], atol=1e-9)


@given(st.floats(0.1, 3.0), st.floats(1.0, 240.0), st.integers(2, 40))
def test_a_steady_turn_and_a_steady_walk_stay_steady(step: float, rate: float, frames: int) -> None:
    turning = rot.from_axis_angle([0.6, 0.0, 0.8], np.arange(frames) * step)
    root = np.arange(frames)[:, None] * np.array([0.1, 0.0, -0.2])
    motion = Motion(ARM, np.stack([turning, turning], axis=1), root, np.arange(frames) / 10.0)
    even = motion.resample(rate)
    ahead = even.times * 10.0
    expected = rot.from_axis_angle([0.6, 0.0, 0.8], ahead * step)
    assert rot.angle(even.rotations, expected[:, None]).max() < 1e-9
    np.testing.assert_allclose(even.root, ahead[:, None] * np.array([0.1, 0.0, -0.2]), atol=1e-12)


@given(st.floats(0.5, 500.0), st.integers(1, 30), st.integers(0, 5))
def test_times_are_even_and_cover_the_motion(rate: float, frames: int, seed: int) -> None:
    motion = some_motion(frames, seed=seed, start=7.0)
    even = motion.resample(rate)
    assert even.times[0] == motion.times[0]
    np.testing.assert_allclose(np.diff(even.times), 1.0 / rate, rtol=1e-9)
    assert motion.times[-1] - 1.0 / rate < even.times[-1] + 1e-9 <= motion.times[-1] + 1.1e-3 / rate + 2e-9
    assert even.name == "waving"
    assert np.abs(np.linalg.norm(even.rotations, axis=-1) - 1.0).max() < 1e-12


def test_a_clock_that_jitters_does_not_lose_the_last_posture() -> None:
    steps = np.full(20, 0.2)
    steps[7] -= 1e-4
    motion = some_motion(21)
    jittered = Motion(ARM, motion.rotations, motion.root, np.concatenate([[0.0], np.cumsum(steps)]))
    assert len(jittered.resample(5.0)) == 21
    assert rot.angle(jittered.resample(5.0).rotations[-1], motion.rotations[-1]).max() < 1e-12


def test_a_motion_shorter_than_a_step_keeps_its_first_posture() -> None:
    motion = some_motion(4)
    assert len(motion.resample(5.0)) == 1
    np.testing.assert_array_equal(motion.resample(5.0).posture(0).root, motion.root[0])
    still = motion.slice(2, 3)
    assert len(still.resample(5.0)) == 1
    np.testing.assert_array_equal(still.resample(1000.0).rotations, motion.rotations[2:3])


@pytest.mark.parametrize("rate", [0.0, -5.0, np.nan, np.inf, 1e12])
@pytest.mark.parametrize("frames", [1, 10])
def test_a_rate_that_is_none_is_refused(rate: float, frames: int) -> None:
    with pytest.raises(MotionMindError, match="a rate must be a positive number of postures a second"):
        some_motion(frames).resample(rate)
    with pytest.raises(MotionMindError, match="a rate must be a positive number of postures a second"):
        some_motion(frames).stretch_to(rate)


# --- stretching -------------------------------------------------------------------------------------------------------

RATES = st.one_of(st.floats(0.5, 500.0), st.sampled_from([23.976, 24.0, 29.97, 30.0, 60.0]))


@given(RATES, st.integers(2, 40), st.floats(1.0, 240.0), st.floats(-50.0, 50.0), st.integers(0, 9))
def test_stretched_motion_has_both_ends_and_even_frames(
    rate: float, frames: int, own: float, start: float, seed: int
) -> None:
    motion = some_motion(frames, own, seed, start)
    found = motion.stretch_to(rate)
    span = float(motion.times[-1] - motion.times[0])
    assert found.times[0] == motion.times[0]
    np.testing.assert_allclose(found.times - start, np.arange(len(found)) / rate, atol=1e-9)
    lasts = (len(found) - 1) / rate
    assert len(found) == 2 if span * rate < 0.5 else abs(lasts - span) <= 0.5 / rate + 1e-9
    for frame in (0, -1):
        assert rot.angle(found.rotations[frame], motion.rotations[frame]).max() < 1e-9
        np.testing.assert_allclose(found.root[frame], motion.root[frame], atol=1e-9)
    assert (found.name, found.skeleton) == (motion.name, motion.skeleton)


@given(RATES, st.integers(2, 40), st.integers(0, 9))
def test_stretched_motion_passes_the_same_postures_at_the_same_share_of_its_time(
    rate: float, frames: int, seed: int
) -> None:
    motion = some_motion(frames, 30.0, seed, start=3.0)
    found = motion.stretch_to(rate)
    at = motion.at(np.linspace(motion.times[0], motion.times[-1], len(found)))
    assert rot.angle(found.rotations, at.rotations).max() < 1e-9
    np.testing.assert_allclose(found.root, at.root, atol=1e-9)


@given(st.integers(2, 40), RATES)
def test_motion_of_whole_steps_is_not_stretched(frames: int, rate: float) -> None:
    motion = some_motion(frames, rate)
    found = motion.stretch_to(rate)
    np.testing.assert_allclose(found.times, motion.times, atol=1e-9)
    assert rot.angle(found.rotations, motion.rotations).max() < 1e-9
    again = found.stretch_to(rate)
    np.testing.assert_allclose(again.root, found.root, atol=1e-9)


@given(RATES, st.integers(4, 40))
def test_insertions_stretch_with_their_motion(rate: float, frames: int) -> None:
    plain = some_motion(frames, 30.0, start=2.0)
    motion = replace(plain, insertions=(Insertion(plain.times[[1, 2, -1]], (("elbow", 1),)),))
    found = motion.stretch_to(rate)
    (one,) = found.insertions
    shares = [(each.insertions[0].times - each.times[0]) / np.ptp(each.times) for each in (motion, found)]
    np.testing.assert_allclose(*shares, atol=1e-9)
    assert one.bridged == (("elbow", 1),)


@given(st.integers(2, 6), st.integers(1, 4))
def test_stretched_keyframes_are_keyframes_no_more(frames: int, every: int) -> None:
    motion = replace(some_motion(frames), keyframed=True)
    assert not motion.stretch_to(30.0 / every).keyframed


def test_one_frame_is_not_stretched() -> None:
    motion = some_motion(1)
    found = motion.stretch_to(24.0)
    np.testing.assert_array_equal(found.rotations, motion.rotations)
    np.testing.assert_array_equal(found.times, motion.times)
    assert found.rate == 24.0


# --- the door ---------------------------------------------------------------------------------------------------------

Q, ROOT, TIMES = np.tile(rot.IDENTITY, (3, 2, 1)), np.zeros((3, 3)), np.arange(3.0)


def spoilt(array: np.ndarray, where: tuple[int, ...], value: float) -> np.ndarray:
    out = array.copy()
    out[where] = value
    return out


@pytest.mark.parametrize(
    ("rotations", "root", "times", "words"),
    [
        (spoilt(Q, (1, 1, 0), np.nan), ROOT, TIMES, "wave: the rotation of elbow in frame 1 is not a finite number"),
        (spoilt(Q, (2, 0, 3), np.inf), ROOT, TIMES, "the rotation of shoulder in frame 2 is not a finite number"),
        (Q, spoilt(ROOT, (2, 1), np.nan), TIMES, "the root's position in frame 2 is not a finite number"),
        (spoilt(Q, (0, 1, 3), 0.0), ROOT, TIMES, "the rotation of elbow in frame 0 has length 0, not 1"),
        (spoilt(Q, (0, 1, 0), 0.1), ROOT, TIMES, "has length 1.00499, not 1"),
        (Q, ROOT, spoilt(TIMES, (1,), np.nan), "times must be finite and increasing"),
        (Q, ROOT, np.array([0.0, 1.0, 1.0]), "times must be finite and increasing"),
        (Q, ROOT, np.zeros(0), "no frames"),
        (Q, ROOT, np.zeros((3, 1)), "no frames"),
        (Q[:2], ROOT, TIMES, r"wave: rotations must have the shape \(3, 2, 4\), not \(2, 2, 4\)"),
        (Q[:, :1], ROOT, TIMES, r"rotations must have the shape \(3, 2, 4\), not \(3, 1, 4\)"),
        (Q, ROOT[:, :2], TIMES, r"root must have the shape \(3, 3\), not \(3, 2\)"),
    ],
)
def test_a_motion_that_is_none_is_refused_and_the_fault_named(
    rotations: np.ndarray, root: np.ndarray, times: np.ndarray, words: str
) -> None:
    with pytest.raises(MotionMindError, match=words):
        Motion(ARM, rotations, root, times, "wave")


@pytest.mark.parametrize("times", [[], [np.nan], [0.0, 0.0], [1.0, 0.5], [[0.0]]])
def test_insertions_need_increasing_times(times: list[float]) -> None:
    with pytest.raises(MotionMindError, match="an insertion's times must be finite and increasing, one at least"):
        Insertion(np.array(times))


def test_insertions_are_of_this_body_and_in_order() -> None:
    with pytest.raises(MotionMindError, match="an insertion of 1 moves has no move 1, bridged by elbow"):
        Insertion(np.array([0.0, 0.1]), (("elbow", 1),))
    early, late = Insertion(np.array([0.0, 0.1]), (("knee", 0),)), Insertion(np.array([0.1, 0.2]))
    with pytest.raises(MotionMindError, match="wave: arm has no joint 'knee' to bridge"):
        Motion(ARM, Q, ROOT, TIMES, "wave", (early, late))
    with pytest.raises(MotionMindError, match="wave: insertions must follow one another"):
        Motion(ARM, Q, ROOT, TIMES, "wave", (late, early))


def test_what_the_engine_made_lies_between_its_ends() -> None:
    still = some_motion(1)
    rotations, root = np.repeat(still.rotations, 11, axis=0), np.repeat(still.root, 11, axis=0)
    elbow = ARM.names[1]
    plan = (Insertion(np.array([0.1, 0.3, 0.5]), ((elbow, 1),)), Insertion(np.array([0.5, 0.8]), ((elbow, 0),)))
    motion = Motion(ARM, rotations, root, np.arange(11) / 10.0, "wave", plan)
    for whole in (motion, motion.resample(10.0), motion.resample(20.0)):
        tenths = np.round(20.0 * whole.times).astype(int)
        inside = ((tenths > 2) & (tenths < 10)) | ((tenths > 10) & (tenths < 16))
        np.testing.assert_array_equal(whole.inserted(), inside)
        np.testing.assert_array_equal(whole.bridged()[:, 1], inside & (tenths >= 6))
        assert not whole.bridged()[:, 0].any()
    part = motion.slice(6, 11)
    np.testing.assert_array_equal(part.inserted(), motion.inserted()[6:])
    np.testing.assert_array_equal(part.bridged(), motion.bridged()[6:])
    assert len(motion.slice(9, 11).insertions) == 0


def test_a_posture_that_is_none_is_refused_and_the_fault_named() -> None:
    with pytest.raises(MotionMindError, match="posture: the rotation of elbow is not a finite number"):
        Posture(ARM, spoilt(Q[0], (1, 2), np.nan), ROOT[0])
    with pytest.raises(MotionMindError, match="posture: the root's position is not a finite number"):
        Posture(ARM, Q[0], spoilt(ROOT[0], (0,), np.inf))
    with pytest.raises(MotionMindError, match=r"posture: rotations must have the shape \(2, 4\), not \(3, 2, 4\)"):
        Posture(ARM, Q, ROOT[0])


def test_arrays_are_copied_and_frozen() -> None:
    root = ROOT.copy()
    motion = Motion(ARM, Q, root, TIMES)
    root[:] = 7.0
    np.testing.assert_array_equal(motion.root, 0.0)
    for array in (motion.rotations, motion.root, motion.times, motion.slice(0, 1).times):
        assert not array.flags.writeable


def test_postures_are_counted_from_either_end() -> None:
    motion = some_motion(5)
    np.testing.assert_array_equal(motion.posture(-1).rotations, motion.rotations[4])
    np.testing.assert_array_equal(motion.posture(-5).root, motion.root[0])
    for frame in (5, -6):
        with pytest.raises(MotionMindError, match=f"waving has frames 0 to 4, no frame {frame}"):
            motion.posture(frame)


def test_a_slice_keeps_its_times() -> None:
    motion = some_motion(5)
    np.testing.assert_array_equal(motion.slice(1, 4).times, motion.times[1:4])
    with pytest.raises(MotionMindError, match="waving: no frames"):
        motion.slice(3, 3)


def test_at_any_time_the_motion_is_between_its_neighbours_and_beyond_its_ends_it_stays() -> None:
    motion = some_motion(5)
    middles = 0.5 * (motion.times[1:] + motion.times[:-1])
    between = motion.at(middles)
    half = rot.angle(motion.rotations[:-1], motion.rotations[1:]) / 2.0
    np.testing.assert_allclose(rot.angle(between.rotations, motion.rotations[:-1]), half, atol=1e-7)
    np.testing.assert_allclose(rot.angle(between.rotations, motion.rotations[1:]), half, atol=1e-7)
    np.testing.assert_allclose(between.root, 0.5 * (motion.root[1:] + motion.root[:-1]), atol=1e-12)
    np.testing.assert_allclose(motion.at(motion.times).rotations, motion.rotations, atol=1e-12)
    beyond = motion.at(np.array([-7.0, 99.0]))
    np.testing.assert_allclose(beyond.root, motion.root[[0, -1]], atol=1e-12)
    np.testing.assert_allclose(some_motion(1).at(np.array([0.0, 1.0])).rotations, some_motion(1).rotations[[0, 0]])


def test_frames_a_second_is_the_usual_step() -> None:
    assert some_motion(5, 25.0).fps == pytest.approx(25.0)
    assert some_motion(1).fps == 0.0
    assert len(some_motion(3).posture(1).as_motion()) == 1
