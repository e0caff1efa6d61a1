"""Joints that jump in a recording: half turns are undone exactly, the rest is interpolated and said to be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind import Engine, explain, own_skeleton, read_motion
from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.flips import find_flips, repair_flips
from motionmind.corpus.gather import gather
from motionmind.discretize.codebook import Codebook
from motionmind.geometry import rotations as rot
from motionmind.tween.certificate import sources_of

ONE_LEG = np.array([[0.1, 0, 0], [0, -0.4, 0], [0, -0.4, 0], [0, -0.05, 0.15]])
LEG = Skeleton(
    "legs",
    ("pelvis", *(f"{side}_{joint}" for side in ("left", "right") for joint in ("hip", "knee", "ankle", "toes"))),
    (-1, 0, 1, 2, 3, 0, 5, 6, 7),
    np.concatenate([np.zeros((1, 3)), ONE_LEG, ONE_LEG * [-1.0, 1.0, 1.0]]),
    np.array([[0.0, 0, 0.06 * (joint in (4, 8))] for joint in range(9)]),
)
HIP, KNEE, ANKLE, TOES, RIGHT_HIP, RIGHT_ANKLE = 1, 2, 3, 4, 5, 7
FPS = 120.0


def steps(frames: int = 240) -> Motion:
    """Two legs that swing and bend, the left by at least 40 degrees at the knee."""
    t = np.arange(frames) / FPS
    q = np.tile(rot.IDENTITY, (frames, len(LEG), 1))
    q[:, HIP] = rot.exp(np.stack([-0.5 + 0.4 * np.sin(2 * t), 0.3 * np.cos(t), 0.2 * np.sin(t)], axis=1))
    q[:, KNEE] = rot.exp(np.stack([1.2 + 0.5 * np.sin(3 * t), 0 * t, 0 * t], axis=1))
    q[:, ANKLE] = rot.exp(np.stack([0.2 * np.sin(t), 0.1 * np.cos(2 * t), 0 * t], axis=1))
    q[:, TOES] = rot.exp(np.stack([0.1 * np.sin(t), 0 * t, 0 * t], axis=1))
    return Motion(LEG, q, np.stack([0 * t, 0.8 + 0 * t, t], axis=1), t, "steps")


def flipped(motion: Motion, joint: int, keeps: Floats, start: int, stop: int) -> Motion:
    """The motion with a joint turned half about the line to a place below it `keeps` [T, 3] from `start` to `stop`."""
    places = motion.skeleton.positions(motion.rotations, motion.root)
    turned = motion.skeleton.global_rotations(motion.rotations)
    line = rot.mul_vec(rot.inv(turned[:, joint]), keeps - places[:, joint])
    q = motion.rotations.copy()
    half = rot.from_axis_angle(line / np.linalg.norm(line, axis=1, keepdims=True), np.pi)
    q[start:stop, joint] = rot.mul(q, half[:, None])[start:stop, joint]
    return replace(motion, rotations=q)


def place_of(motion: Motion, joint: int) -> Floats:
    return motion.skeleton.positions(motion.rotations, motion.root)[:, joint]


def tip_of(motion: Motion, joint: int) -> Floats:
    return motion.skeleton.positions_and_tips(motion.rotations, motion.root)[:, len(LEG) + joint]


def off(a: Motion, b: Motion) -> Floats:
    """Degrees between the joints of two motions [T, J]."""
    return np.degrees(rot.angle(a.rotations, b.rotations))


# --- putting back -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("start", "stop"), [(60, 72), (60, 62), (30, 110), (0, 40), (200, 240)])
@pytest.mark.parametrize(
    ("joint", "keeps"),
    [
        (HIP, lambda motion: place_of(motion, ANKLE)),
        (HIP, lambda motion: place_of(motion, KNEE)),
        (KNEE, lambda motion: place_of(motion, ANKLE)),
        (TOES, lambda motion: tip_of(motion, TOES)),
    ],
    ids=["hip about the line to the ankle", "hip about the thigh", "knee about the shank", "toes about themselves"],
)
def test_half_turns_about_a_line_down_the_limb_are_undone_exactly(joint: int, keeps, start: int, stop: int) -> None:  # type: ignore[no-untyped-def]
    true = steps()
    recorded = flipped(true, joint, keeps(true), start, stop)
    np.testing.assert_allclose(keeps(recorded), keeps(true), atol=1e-9)  # the half turn is one that a fit may take
    mended = repair_flips(recorded)
    assert find_flips(mended.motion) == ()
    assert off(mended.motion, true).max() < 1e-5
    assert [(one.joint, one.start, one.stop, one.exact) for one in mended.repairs] == [
        (LEG.names[joint], start, stop, True)
    ]
    assert {flip.repair for flip in mended.flips} == {"put back"}


def test_a_single_frame_is_interpolated() -> None:
    true = steps()
    mended = repair_flips(flipped(true, HIP, place_of(true, ANKLE), 60, 61))
    assert off(mended.motion, true).max() < 0.1
    assert [(one.start, one.stop, one.exact) for one in mended.repairs] == [(60, 61, False)]


def test_several_stretches_of_both_legs_are_put_back() -> None:
    true = steps()
    recorded = flipped(true, HIP, place_of(true, ANKLE), 20, 35)
    recorded = flipped(recorded, HIP, place_of(true, ANKLE), 40, 90)
    bent = replace(true, rotations=true.rotations[:, [0, 1, 2, 3, 4, 1, 2, 3, 4]])
    both = flipped(bent, RIGHT_HIP, place_of(bent, RIGHT_ANKLE), 30, 60)
    recorded = replace(recorded, rotations=np.concatenate([recorded.rotations[:, :5], both.rotations[:, 5:]], axis=1))
    mended = repair_flips(recorded)
    assert off(mended.motion, bent).max() < 1e-5
    assert [(one.joint, one.start, one.stop) for one in mended.repairs] == [
        ("left_hip", 20, 35),
        ("left_hip", 40, 90),
        ("right_hip", 30, 60),
    ]
    assert [flip.repair for flip in mended.flips] == ["put back"] * 6


def test_a_half_turn_spread_over_some_frames_is_put_back_but_for_those() -> None:
    """As where a file was filtered, or resampled, after it was fitted."""
    true = steps()
    recorded = flipped(true, HIP, place_of(true, ANKLE), 62, 90)
    q = recorded.rotations.copy()
    share = np.array([1.0, 4.5, 8.0]) / 9.0  # by 20, 70, 70 and 20 degrees
    for last, first in ((59, 63), (88, 92)):
        q[last + 1 : first, HIP] = rot.slerp(q[last, HIP], q[first, HIP], share)
    mended = repair_flips(replace(recorded, rotations=q))
    assert off(mended.motion, true).max() < 1.0
    exact = [(one.start, one.stop) for one in mended.repairs if one.exact]
    guessed = [(one.start, one.stop) for one in mended.repairs if not one.exact]
    assert (exact, guessed) == ([(63, 89)], [(60, 63), (89, 92)])
    assert {flip.repair for flip in mended.flips} == {"put back"}


# --- reconstructing ---------------------------------------------------------------------------------------------------


def test_what_is_no_half_turn_is_interpolated_between_what_was_recorded() -> None:
    true = steps()
    q = true.rotations.copy()
    q[70:82, ANKLE] = rot.mul(q[70:82, ANKLE], rot.from_axis_angle([0.6, 0.0, 0.8], np.radians(140.0)))
    mended = repair_flips(replace(true, rotations=q))
    assert off(mended.motion, true).max() < 5.0  # over a tenth of a second a foot goes nearly straight
    (repair,) = mended.repairs
    assert (repair.joint, repair.start, repair.stop, repair.exact) == ("left_ankle", 70, 82, False)
    assert repair.seconds == pytest.approx((70 / FPS, 81 / FPS))
    assert [flip.repair for flip in mended.flips] == ["reconstructed"] * 2


def test_a_joint_that_does_not_return_is_taken_to_its_other_side_at_a_credible_speed() -> None:
    true = steps()
    q = true.rotations.copy()
    q[100:, ANKLE] = rot.mul(q[100:, ANKLE], rot.from_axis_angle([0.6, 0.0, 0.8], np.radians(120.0)))
    mended = repair_flips(replace(true, rotations=q))
    (repair,) = mended.repairs
    assert repair.start < 100 < repair.stop
    assert repair.stop - repair.start == pytest.approx(120.0 / 720.0 * FPS, abs=3)
    turned = np.degrees(rot.angle(mended.motion.rotations[1:], mended.motion.rotations[:-1]))
    assert turned.max() < 720.0 / FPS + 1.0


@pytest.mark.parametrize("frame", [1, 3, 237, 239])
def test_next_to_an_end_of_the_recording_a_joint_is_held(frame: int) -> None:
    """A fit often settles in its first frames."""
    true = steps()
    q = true.rotations.copy()
    wrong = slice(0, frame) if frame < 100 else slice(frame, 240)
    q[wrong, ANKLE] = rot.mul(q[wrong, ANKLE], rot.from_axis_angle([0.6, 0.0, 0.8], np.radians(120.0)))
    mended = repair_flips(replace(true, rotations=q))
    assert find_flips(mended.motion) == ()
    assert len(mended.motion) == len(true)
    assert off(mended.motion, true).max() < 10.0


def test_a_neighbour_that_makes_up_for_a_flip_is_interpolated_with_it() -> None:
    true = steps()
    turn = rot.from_axis_angle([0.0, 1.0, 0.0], np.radians(50.0))
    q = true.rotations.copy()
    q[100:103, KNEE] = rot.mul(q[100:103, KNEE], turn)
    q[100:103, ANKLE] = rot.mul(rot.from_axis_angle([0.0, 1.0, 0.0], np.radians(-40.0)), q[100:103, ANKLE])
    mended = repair_flips(replace(true, rotations=q))
    assert off(mended.motion, true).max() < 3.0
    assert {one.joint for one in mended.repairs} == {"left_knee", "left_ankle"}


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_whatever_jumps_no_flip_stays_unless_a_fault_is_long_and_nothing_else_changes(data: st.DataObject) -> None:
    true = steps(120)
    q = true.rotations.copy()
    for _ in range(data.draw(st.integers(1, 4))):
        joint = data.draw(st.integers(1, len(LEG) - 1))
        start, stop = sorted(data.draw(st.tuples(st.integers(0, 119), st.integers(1, 120))))
        axis = rot.exp(np.array(data.draw(st.tuples(*[st.floats(-3.0, 3.0)] * 3))))
        q[start:stop, joint] = rot.mul(q[start:stop, joint], axis)
    recorded = replace(true, rotations=q)
    mended = repair_flips(recorded)
    changed = np.zeros(q.shape[:2], dtype=bool)
    for one in mended.repairs:
        changed[one.start : one.stop, LEG.names.index(one.joint)] = True
        assert one.seconds == (recorded.times[one.start], recorded.times[one.stop - 1])
    np.testing.assert_array_equal(mended.motion.rotations[~changed], q[~changed])
    assert len(mended.flips) == len(find_flips(recorded))
    assert find_flips(mended.motion) == () or any(flip.repair == "none" for flip in mended.flips)


def test_a_recording_without_flips_stays_as_it_is() -> None:
    mended = repair_flips(steps())
    np.testing.assert_array_equal(mended.motion.rotations, steps().rotations)
    assert (mended.flips, mended.repairs) == ((), ())


# --- what is said of it -----------------------------------------------------------------------------------------------


def mixed_faults() -> Motion:
    """A hip that is put back and an ankle that is not, after 5 frames of nothing."""
    true = steps()
    motion = flipped(true, HIP, place_of(true, ANKLE), 65, 80)
    q = motion.rotations.copy()
    q[120:132, ANKLE] = rot.mul(q[120:132, ANKLE], rot.from_axis_angle([0.6, 0.0, 0.8], np.radians(140.0)))
    return replace(motion, rotations=q)


def test_a_corpus_knows_what_was_mended_and_so_do_its_mirror_images_and_mixtures() -> None:
    corpus = gather("legs", [mixed_faults()], rate=10.0, skip=5, mirror=True)
    assert [len(clip) for clip in corpus.clips] == [20, 20]
    expected = [("left_hip", 65, 80, True), ("left_ankle", 120, 132, False)]
    assert [(one.joint, one.start, one.stop, one.exact) for one in corpus.clips[0].repairs] == expected
    assert {(flip.frame, flip.repair) for flip in corpus.faults} == {
        (65, "put back"),
        (80, "put back"),
        (120, "reconstructed"),
        (132, "reconstructed"),
    }
    assert [(one.joint, one.start) for one in corpus.clips[1].repairs] == [("right_hip", 65), ("right_ankle", 120)]
    again = gather("more", [], mix=[(corpus, 1.0)])
    assert [clip.repairs for clip in again.clips] == [clip.repairs for clip in corpus.clips]


def test_sources_say_what_was_reconstructed() -> None:
    corpus = gather("legs", [mixed_faults()], rate=10.0)
    for posture in range(len(corpus) - 1):
        places = np.array([posture, posture + 1])
        ankle, hip = sources_of(corpus, places[[0, 0]], places[[1, 1]], ["left_ankle", "left_hip"])
        assert ankle.reconstructed == (posture in (9, 10))  # 0.9 to 1.1 s; the fault is at 1.0 to 1.1 s
        assert not hip.reconstructed
        (back,) = sources_of(corpus, places[1:], places[:1], ["left_ankle"])
        assert back.reconstructed == ankle.reconstructed


def test_an_explanation_says_what_was_reconstructed() -> None:
    engine = Engine.fit([mixed_faults()], name="legs", rate=10.0, discretization=Codebook(2.0))
    corpus = engine.corpus
    a, b = (Posture(corpus.skeleton, corpus.rotations[i], corpus.root[i]) for i in (9, 10))
    told = explain(engine.tween(a, b, moves=1))  # as recorded, but for the ankle at B
    marked = [one.joint for one in told.moves[0].joints if one.source and one.source.reconstructed]
    assert marked == ["left_ankle"]
    assert told.details().count(" s, reconstructed)") == 1


def test_what_was_mended_is_saved_and_summarised(tmp_path: Path) -> None:
    engine = Engine.fit([mixed_faults()], name="legs", rate=10.0)
    engine.save(tmp_path / "legs")
    again = Engine.load(str(tmp_path / "legs"))
    assert again.corpus.clips == engine.corpus.clips
    assert again.corpus.faults == engine.corpus.faults
    assert again.info()["repairs"] == [
        {"clip": "steps", "joint": "left_hip", "start": 65, "stop": 80, "exact": True},
        {"clip": "steps", "joint": "left_ankle", "start": 120, "stop": 132, "exact": False},
    ]


# --- recordings -------------------------------------------------------------------------------------------------------


def test_a_dancers_raised_legs_are_put_back(shared_data: Path) -> None:
    """The ankle stays where it was recorded, and the knee goes on where it was."""
    motion = own_skeleton(read_motion(shared_data / "cmu-05" / "05_17.bvh")).slice(1, 1044)
    mended = repair_flips(motion)
    hip, knee, ankle = (motion.skeleton.index(f"right_{joint}") for joint in ("hip", "knee", "ankle"))
    exact = [one for one in mended.repairs if one.exact]
    assert {one.joint for one in exact} == {"right_hip"}
    before, after = (motion.skeleton.positions(one.rotations, one.root) for one in (motion, mended.motion))
    for one in exact:
        np.testing.assert_allclose(after[one.start : one.stop, ankle], before[one.start : one.stop, ankle], atol=1e-9)
        across = [one.start - 1, one.start], [one.stop - 1, one.stop]
        assert max(np.linalg.norm(before[b, knee] - before[a, knee]) for a, b in across) > 0.2
        assert max(np.linalg.norm(after[b, knee] - after[a, knee]) for a, b in across) < 0.06
        assert np.degrees(rot.angle(*mended.motion.rotations[one.start - 1 : one.start + 1, hip])) < 15.0


@pytest.mark.long
def test_a_dancers_clips_stay_whole(shared_data: Path) -> None:
    clips = [own_skeleton(read_motion(path)) for path in sorted((shared_data / "cmu-05").glob("*.bvh"))]
    engine = Engine.fit(clips, name="dancer", skip=1)
    assert len(engine.corpus.clips) == 20
    assert engine.check(2000, 0)["joinable"] > 0.9
    assert "none" not in {flip.repair for flip in engine.corpus.faults}
