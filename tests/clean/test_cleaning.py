"""Cleaning recordings: laws of each step, and bounds that the report states."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bodies import tumble
from bundled_clips import ballet_clip
from damages import apart, backwards, noisy, raised, recording, sliding, spiked
from program_rigs import disguise, rig_names, spread

from motionmind import Engine, read_motion
from motionmind.body.contact import contact_points, find_floor, foot_slide
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.clean import clean_motion
from motionmind.clean.cleaning import STEPS, Cleaning
from motionmind.clean.feet import LOCKED_M, lock_feet
from motionmind.clean.spikes import repair_spikes
from motionmind.clean.stances import _stances
from motionmind.corpus.dropped import find_gaps
from motionmind.corpus.flips import find_flips
from motionmind.corpus.recordings import added_frames
from motionmind.errors import MotionMindError, MotionMindWarning, SkeletonError, WrongTypeError
from motionmind.geometry import rotations as rot
from motionmind.retarget.vertical import Z_UP_TO_Y_UP


def only(motion: Motion, *steps: str) -> Cleaning:
    return clean_motion(motion, without=[step for step in STEPS if step not in steps])


def floor(motion: Motion) -> float:
    return find_floor(motion.skeleton, motion.rotations, motion.root, heels=True)


def damaged(seed: int = 0, degrees: float = 0.5) -> Motion:
    """A recording with jitter, feet that slide, a spike and a floor off 0."""
    motion = sliding(recording())
    return raised(noisy(spiked(motion, "left_knee", 150), degrees, seed), 0.07)


def frozen(motion: Motion, start: int, stop: int) -> Motion:
    """The motion with frames that repeat the one before."""
    rotations, root = motion.rotations.copy(), motion.root.copy()
    rotations[start:stop], root[start:stop] = rotations[start - 1], root[start - 1]
    return replace(motion, rotations=rotations, root=root)


@cache
def moving_frame() -> int:
    """The first frame of a stretch in which 40 frozen frames are no rest."""
    motion = recording()
    wanted = ((start, frozen(motion, start, start + 40)) for start in range(20, 300, 5))
    return next(start for start, held in wanted if [gap.kind for gap in find_gaps(held)] == ["repeated"])


# --- what is reported -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_no_joint_is_off_by_more_than_reported(seed: int) -> None:
    rng = np.random.default_rng(seed)
    degrees, without = rng.uniform(0.0, 3.0), [step for step in STEPS if rng.random() < 0.3]
    motion = damaged(seed, degrees)
    cleaning = clean_motion(motion, without=without)
    far = 1000.0 * apart(motion, cleaning.motion).max(axis=0)
    turned = np.degrees(rot.angle(motion.rotations, cleaning.motion.rotations)).max(axis=0)
    joints = cleaning.summary().joints
    assert [one.joint for one in joints] == [*motion.skeleton.names]
    assert all(far <= np.array([one.mm for one in joints]) + 1e-6)
    assert all(turned <= np.array([one.degrees for one in joints]) + 1e-6)
    assert max(one.mm for one in joints) <= far.max() + 0.02
    steps = cleaning.summary().steps
    assert [step.step for step in steps] == [step for step in STEPS if step not in without]
    assert far.max() <= sum(step.greatest_mm for step in steps) + 1e-9


@pytest.mark.parametrize(
    "clip", ["cmu-05/05_17.bvh", "indian/07.bvh", "bandai/kick_normal_001.bvh", "cmu-16/16_05.amc"]
)
def test_no_joint_of_a_recording_is_off_by_more_than_reported(clip: str, shared_data: Path) -> None:
    path = shared_data / clip
    if not path.exists():
        pytest.skip(f"{path} is missing")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MotionMindWarning)
        motion = read_motion(path)
    cleaning = clean_motion(motion)
    joints = cleaning.summary().joints
    turned = np.degrees(rot.angle(motion.rotations, cleaning.motion.rotations)).max(axis=0)
    assert all(1000.0 * apart(motion, cleaning.motion).max(axis=0) <= np.array([one.mm for one in joints]) + 1e-6)
    assert all(turned <= np.array([one.degrees for one in joints]) + 1e-6)
    assert all(one.held for one in cleaning.contacts)
    begin = added_frames(motion)
    assert floor(cleaning.motion.slice(begin, len(motion))) == pytest.approx(0.0, abs=1e-9)


def test_the_report_is_of_the_steps_that_changed_something() -> None:
    cleaning = clean_motion(damaged())
    steps = {step.step: step for step in cleaning.summary().steps}
    assert steps["gaps"].frames == 0
    assert "left_knee" in steps["flips"].about
    assert steps["filter"].joints == len(cleaning.motion.skeleton)
    assert steps["feet"].frames > 0
    assert steps["floor"].greatest_mm == pytest.approx(abs(cleaning.summary().floor_mm or 0.0), abs=0.02)
    assert cleaning.report()["joints"][0]["jitter"]["noise"] == pytest.approx(0.5, rel=0.2)


def test_a_recording_without_faults_is_left_alone() -> None:
    clean = only(recording(), "gaps", "flips", "filter", "floor")
    np.testing.assert_array_equal(clean.motion.rotations, recording().rotations)
    assert apart(clean.motion, recording()).max() < 2e-4
    assert [step.about for step in clean.steps] == ["none", "none", "cut-off none: no jitter", "at 0"]


@pytest.mark.parametrize("step", STEPS)
def test_a_step_left_out_leaves_its_fault(step: str) -> None:
    motion = frozen(damaged(), 60, 64)
    cleaning = clean_motion(motion, without=[step])
    assert step not in cleaning.moved
    found = cleaning.motion
    if step == "floor":
        assert floor(found) > 0.05
        assert cleaning.floor is None
    elif step == "flips":
        assert find_flips(replace(found, rotations=clean_motion(motion, without=STEPS[1:]).motion.rotations))
        assert "left_knee" in {flip.joint for flip in find_flips(found)}
    elif step == "filter":
        same = [motion.skeleton.index(name) for name in ("left_elbow", "right_wrist", "atlantal")]
        rest = np.r_[0:59, 66:148, 153 : len(motion)]
        np.testing.assert_array_equal(found.rotations[rest][:, same], motion.rotations[rest][:, same])
    elif step == "feet":
        assert cleaning.contacts == ()
    else:
        assert rot.angle(found.rotations[60], found.rotations[63]).max() < np.radians(3.0)


def test_without_any_step_nothing_changes() -> None:
    motion = damaged()
    cleaning = clean_motion(motion, without=STEPS)
    np.testing.assert_array_equal(cleaning.motion.rotations, motion.rotations)
    np.testing.assert_array_equal(cleaning.motion.root, motion.root)
    assert all(one.mm == one.degrees == 0.0 for one in cleaning.summary().joints)


# --- symmetries -----------------------------------------------------------------------------------------------------


def test_cleaning_has_no_direction_in_time() -> None:
    motion = noisy(sliding(recording()), 0.5)
    for step in ("filter", "feet", "floor"):
        forward, backward = only(motion, step).motion, only(backwards(motion), step).motion
        assert apart(forward, backwards(backward)).max() < 5e-4, step


def test_a_mirrored_recording_is_cleaned_alike() -> None:
    motion = damaged()
    assert apart(mirrored(clean_motion(motion).motion), clean_motion(mirrored(motion)).motion).max() < 2e-4


def test_a_recording_with_z_up_is_cleaned_alike() -> None:
    motion = damaged()
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.mul(rot.inv(Z_UP_TO_Y_UP), rotations[:, 0])
    turned = replace(motion, rotations=rotations, root=rot.mul_vec(rot.inv(Z_UP_TO_Y_UP), motion.root))
    expected = rot.mul_vec(rot.inv(Z_UP_TO_Y_UP), clean_motion(motion).motion.positions())
    np.testing.assert_allclose(clean_motion(turned, up="z").motion.positions(), expected, atol=1e-6)


def test_a_clean_recording_hardly_changes_again() -> None:
    once = clean_motion(damaged())
    again = clean_motion(once.motion)
    first, second = (
        np.sqrt((apart(one.motion, one.original) ** 2).mean()) for one in (only(damaged(), "filter"), again)
    )
    assert second < 0.5 * first
    assert abs(again.floor or 0.0) < 3e-3


# --- feet and floor -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("metres", "seconds"), [(0.005, 1.5), (0.02, 2.0), (0.03, 4.0)])
def test_locked_feet_stand_within_a_millimetre(metres: float, seconds: float) -> None:
    motion = only(noisy(sliding(recording(), metres, seconds), 0.3), "filter").motion
    locked = lock_feet(motion)
    places, _ = contact_points(motion.skeleton, locked.motion.rotations, locked.motion.root)
    assert locked.contacts
    for one in locked.contacts:
        own = places[one.first : one.last + 1, one.point]
        assert one.held
        assert rot.norm(own - own.mean(axis=0)).max() <= LOCKED_M


def test_stances_are_no_shorter_than_a_tenth_of_a_second_and_bridge_short_swings() -> None:
    bears = np.zeros(200, dtype=bool)
    bears[[*range(10, 19), *range(40, 52), *range(80, 86), *range(90, 96), *range(120, 130), *range(137, 150)]] = True
    assert _stances(bears, 100.0) == [(40, 52), (80, 96), (120, 130), (137, 150)]
    assert _stances(bears, 10.0) == [(10, 19), (40, 52), (80, 86), (90, 96), (120, 130), (137, 150)]


def test_feet_that_rock_quickly_do_not_stand() -> None:
    still = replace(recording(), rotations=np.repeat(recording().rotations[:1], 360, axis=0))
    still = replace(still, root=np.repeat(recording().root[:1], 360, axis=0))
    slow, quick = (lock_feet(sliding(still, 0.03, seconds)).contacts for seconds in (3.0, 0.8))
    assert {(one.first, one.last) for one in slow} == {(0, 359)}
    assert not quick


def test_feet_slide_less() -> None:
    before = sliding(recording())
    after = only(before, "feet").motion
    slid = [foot_slide(one.skeleton, (seen := one.resample(30.0)).rotations, seen.root) for one in (before, after)]
    assert slid[1] < 0.6 * slid[0]
    elsewhere = [joint for joint, name in enumerate(before.skeleton.names) if "hip" in name or "knee" in name]
    arms = [joint for joint, name in enumerate(before.skeleton.names) if "elbow" in name or "wrist" in name]
    assert rot.angle(after.rotations[:, elsewhere], before.rotations[:, elsewhere]).max() > 0.0
    np.testing.assert_array_equal(after.rotations[:, arms], before.rotations[:, arms])


def test_feet_far_from_the_floor_are_left_alone() -> None:
    motion = recording()
    flying = replace(motion, root=motion.root + np.outer(motion.times, [0.0, 3.0, 0.0]))
    np.testing.assert_array_equal(only(flying, "feet").motion.rotations, flying.rotations)


@pytest.mark.parametrize("height", [-0.3, 0.05, 2.0])
def test_the_floor_is_at_0(height: float) -> None:
    found = only(raised(recording(), height), "floor")
    assert floor(found.motion) == pytest.approx(0.0, abs=1e-9)
    assert found.floor == pytest.approx(height, abs=1e-3)


def test_bodies_without_legs_and_frames_too_few_are_cleaned_as_far_as_possible() -> None:
    motion = clean_motion(recording().slice(0, 3)).motion
    assert len(motion) == 3
    insect = tumble(ballet_clip("adagio").skeleton, 0, 40)
    assert len(clean_motion(insect).motion) == 40
    slow = clean_motion(recording(10.0))
    assert [step.about.partition(":")[0] for step in slow.steps][2:4] == ["left out", "left out"]


# --- gaps and flips -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fps", "degrees"), [(24.0, 70.0), (24.0, 170.0), (60.0, 30.0), (60.0, 90.0), (120.0, 30.0), (120.0, 170.0)]
)
@pytest.mark.parametrize("joint", ["pelvis", "left_knee", "right_wrist"])
def test_a_spike_is_repaired(joint: str, fps: float, degrees: float) -> None:
    motion = recording(fps)
    found = only(spiked(motion, joint, 50, degrees), "flips")
    assert apart(found.motion, motion).max() < 0.05
    assert joint in found.steps[0].about


@pytest.mark.parametrize(("fps", "degrees"), [(24.0, 55.0), (30.0, 40.0), (60.0, 20.0), (240.0, 20.0)])
def test_quick_movement_is_no_spike(fps: float, degrees: float) -> None:
    motion = spiked(recording(fps), "right_wrist", 50, degrees)
    np.testing.assert_array_equal(only(motion, "flips").motion.rotations, motion.rotations)


def test_a_joint_that_goes_elsewhere_and_stays_is_no_spike() -> None:
    turned = np.tile(rot.IDENTITY, (20, 1, 1))
    turned[8:] = rot.from_axis_angle([0.0, 0.0, 1.0], np.radians(80.0))
    assert not repair_spikes(turned, 60.0).spikes.any()


def test_the_pose_before_the_movement_stays() -> None:
    motion = recording()
    rotations, root = motion.rotations.copy(), motion.root.copy()
    rotations[:4], root[:4] = tumble(motion.skeleton, 3, 2).rotations[0], root[4]
    padded = noisy(replace(motion, rotations=rotations, root=root), 0.0)
    jitter = noisy(padded, 1.0)
    held = replace(jitter, rotations=np.concatenate([padded.rotations[:4], jitter.rotations[4:]]))
    found = only(held, "flips", "filter", "feet").motion
    np.testing.assert_array_equal(found.rotations[:4], held.rotations[:4])
    assert rot.angle(found.rotations[4:], held.rotations[4:]).max() > 0.0


def test_frames_that_the_clock_repeats_stay_and_are_counted() -> None:
    motion = recording()
    doubled = motion.slice(0, 240)
    doubled = replace(
        doubled, rotations=doubled.rotations[::2].repeat(2, axis=0), root=doubled.root[::2].repeat(2, axis=0)
    )
    found = clean_motion(doubled, without=["flips", "filter", "feet", "floor"])
    assert re.fullmatch(r"\d+ of 240 frames repeat the one before; they stay", found.steps[0].about)
    assert np.array_equal(found.motion.rotations, doubled.rotations)


def test_short_gaps_are_gone_over_evenly_and_long_ones_left_without_a_corpus() -> None:
    motion = recording()
    short = clean_motion(motion, fill=[(100, 104)], without=STEPS[1:]).motion
    shares = np.arange(1, 6) / 6.0
    np.testing.assert_allclose(
        short.root[100:105], motion.root[99] + shares[:, None] * (motion.root[105] - motion.root[99])
    )
    with pytest.raises(MotionMindError, match="only a corpus can fill them"):
        clean_motion(motion, fill=[(100, 140)])
    start = moving_frame()
    left = clean_motion(frozen(recording(), start, start + 40), without=STEPS[1:])
    assert left.gaps == ((start, start + 40),)
    assert f"1 left: {start}-{start + 39}" in left.steps[0].about


@pytest.mark.parametrize("rig", [None, "Mixamo"])
def test_a_corpus_fills_long_gaps_on_any_rig(rig: str | None) -> None:
    whole = recording(30.0)
    motion = whole if rig is None else disguise(whole, rig_names(rig), spread())
    engine = Engine.load("ballet")
    found = clean_motion(motion, fill=[(60, 99)], engine=engine, without=STEPS[1:]).motion
    outside = np.r_[0:60, 100 : len(motion)]
    np.testing.assert_array_equal(found.rotations[outside], motion.rotations[outside])
    np.testing.assert_array_equal(found.root[outside], motion.root[outside])
    speed = rot.angle(found.rotations[1:], found.rotations[:-1]).max(axis=1) * 30.0
    assert speed[[59, 99]].max() < 12.0  # no jump where it begins and ends
    assert found.inserted()[60:100].all()
    assert not found.inserted()[outside].any()
    assert 0.0 < apart(found, motion)[60:100].max() < 1.0


def test_a_named_gap_may_hold_anything() -> None:
    whole = recording(30.0)
    rotations, root = whole.rotations.copy(), whole.root.copy()
    rotations[60:100], root[60:100] = rot.IDENTITY, [5.0, 0.0, 0.0]
    broken = replace(whole, rotations=rotations, root=root)
    found, expected = (
        clean_motion(one, fill=[(60, 99)], engine=Engine.load("ballet"), without=["feet"]) for one in (broken, whole)
    )
    assert "leaps" not in found.steps[0].about
    assert apart(found.motion, expected.motion).max() < 1e-9


def test_joints_that_the_corpus_lacks_meet_both_sides_of_a_gap() -> None:
    motion = disguise(recording(30.0), rig_names("Mixamo"), spread())
    body = motion.skeleton
    tail = replace(
        body,
        names=(*body.names, "a tail"),
        parents=(*body.parents, 0),
        offsets=np.concatenate([body.offsets, [[0.0, 0.0, -0.1]]]),
        tips=np.concatenate([body.tips, [[0.0, 0.0, -0.3]]]),
    )
    wagged = rot.from_axis_angle([0.0, 1.0, 0.0], 0.5 * motion.times)[:, None]
    motion = replace(motion, skeleton=tail, rotations=np.concatenate([motion.rotations, wagged], axis=1))
    found = clean_motion(motion, fill=[(60, 99)], engine=Engine.load("ballet"), without=STEPS[1:]).motion
    steps = np.degrees(rot.angle(found.rotations[1:, -1], found.rotations[:-1, -1]))
    assert steps[[59, 99]].max() < 3.0


def test_a_frozen_stretch_is_found_and_filled() -> None:
    start = moving_frame()
    motion = frozen(recording(), start, start + 40)
    found = clean_motion(motion, engine=Engine.load("ballet"), without=STEPS[1:])
    assert found.gaps == ()
    assert found.steps[0].about == "1 filled from ballet"
    assert apart(found.motion, motion)[start : start + 40].max() > 0.01


# --- bad input ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"without": ["feets"]}, "there is no step 'feets'"),
        ({"fill": [(0, 3)]}, "a gap lies between frames 1 and 358"),
        ({"fill": [(300, 359)]}, "a gap lies between frames 1 and 358"),
        ({"fill": [(9, 3)]}, "frames 9-3 cannot be filled"),
        ({"up": "x"}, 'up must be "y" or "z"'),
    ],
)
def test_what_cannot_be_done_is_refused(options: dict[str, object], fault: str) -> None:
    with pytest.raises(MotionMindError, match=fault):
        clean_motion(recording(), **options)  # type: ignore[arg-type]


def test_keyframes_and_other_types_are_refused() -> None:
    with pytest.raises(MotionMindError, match="cleaning is for recordings"):
        clean_motion(ballet_clip("adagio"))
    with pytest.raises(MotionMindError, match="a single posture"):
        clean_motion(recording().slice(0, 1))
    with pytest.raises(WrongTypeError):
        clean_motion(recording().posture(0))  # type: ignore[arg-type]


def test_a_corpus_of_another_body_fills_nothing() -> None:
    motion = tumble(ballet_clip("adagio").skeleton, 0, 60)
    other = replace(motion, skeleton=replace(motion.skeleton, names=tuple(f"bone{n}" for n in range(23))))
    with pytest.raises(SkeletonError, match="another skeleton than the corpus"):
        clean_motion(other, fill=[(10, 40)], engine=Engine.load("ballet"))
