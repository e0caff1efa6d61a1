"""Ends that move: frames before A and after B, brought onto the corpus's skeleton as velocities."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.legs import find_legs
from motionmind.body.motion import Motion, Posture, Velocity
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError, MotionMindWarning, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.names.postures import find_posture
from motionmind.retarget.retarget import to_human23
from motionmind.tween.ends import bring_ends
from motionmind.tween.engine import Engine

CLIP = ballet_clip("adagio").resample(30.0)
A, B = CLIP.posture(40), CLIP.posture(100)
BEFORE, AFTER = CLIP.slice(30, 41), CLIP.slice(100, 104)


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def stood_elsewhere(motion: Motion) -> Motion:
    return replace(motion, root=motion.root + np.array([3.0, 0.0, -1.0]), times=motion.times - 40.0)


def renamed(motion: Motion) -> Motion:
    """The same movement on the same joints, by Mixamo's names."""
    trunk = {"pelvis": "Hips", "lumbar": "Spine", "thorax": "Spine1", "cervical": "Neck", "atlantal": "Head"}
    limbs = {
        "hip": "UpLeg",
        "knee": "Leg",
        "ankle": "Foot",
        "toes": "ToeBase",
        "clavicle": "Shoulder",
        "shoulder": "Arm",
        "elbow": "ForeArm",
        "wrist": "Hand",
        "fingers": "HandMiddle1",
    }
    sided = {f"{side}_{own}": side.title() + other for side in ("left", "right") for own, other in limbs.items()}
    names = trunk | sided
    body = motion.skeleton
    return replace(motion, skeleton=replace(body, name="other", names=tuple(names[joint] for joint in body.names)))


def test_the_velocities_are_those_of_the_frames_before_a_and_after_b(ballet: Engine) -> None:
    found = bring_ends(ballet.corpus, A, B, BEFORE, stood_elsewhere(AFTER))
    assert found.leaving is not None
    assert found.arriving is not None
    for velocity, expected in ((found.leaving, Velocity.at_end(BEFORE)), (found.arriving, Velocity.at_start(AFTER))):
        assert np.abs(velocity.rotations).max() > 0.1
        np.testing.assert_allclose(velocity.rotations, expected.rotations, atol=1e-9)
        np.testing.assert_allclose(velocity.root, expected.root, atol=1e-9)
    alone = bring_ends(ballet.corpus, A, B, after=AFTER)
    assert alone.leaving is None
    assert alone.arriving is not None


def test_velocities_are_on_the_corpus_s_skeleton(ballet: Engine) -> None:
    """As postures are: movement on another rig is retargeted."""
    recorded = renamed(BEFORE)
    found = bring_ends(ballet.corpus, recorded.posture(-1), B, recorded)
    on_human23 = to_human23(recorded)
    assert human23().difference(on_human23.skeleton) is None
    assert found.leaving is not None
    expected = Velocity.at_end(on_human23)
    np.testing.assert_allclose(found.leaving.rotations, expected.rotations, atol=1e-9)
    np.testing.assert_allclose(found.leaving.rotations, Velocity.at_end(BEFORE).rotations, atol=1e-5)


def test_the_report_says_how_much_movement_was_given(ballet: Engine) -> None:
    tween = ballet.tween(A, B, moves=4, before=BEFORE)
    assert tween.report()["asked"]["before"] == pytest.approx(10.0 / 30.0)
    assert tween.report()["asked"]["after"] is None
    assert tween.before == pytest.approx(10.0 / 30.0)
    assert ballet.tween(A, B, moves=4, after=AFTER).asked["after"] == pytest.approx(0.1)


def test_the_ends_are_exact_however_they_move(ballet: Engine) -> None:
    motion = ballet.tween(A, B, before=BEFORE, after=AFTER).motion
    np.testing.assert_array_equal(motion.rotations[[0, -1]], [A.rotations, B.rotations])
    np.testing.assert_array_equal(motion.root[[0, -1]], [A.root, B.root])


def test_a_body_that_moves_through_a_does_not_stay_there(ballet: Engine) -> None:
    assert ballet.tween(A, A).moves == 0
    assert ballet.tween(A, A, before=BEFORE).moves > 0
    assert ballet.tween(A, A, after=CLIP.slice(40, 50)).moves > 0


def test_frames_that_do_not_lead_to_a_or_from_b_are_refused(ballet: Engine) -> None:
    with pytest.raises(MotionMindError, match=r"before A does not end in A: \w+ is [\d.]+ degrees off there"):
        ballet.tween(A, B, before=CLIP.slice(20, 31))
    with pytest.raises(MotionMindError, match=r"after B does not begin in B: \w+ is [\d.]+ degrees off there"):
        ballet.tween(A, B, after=CLIP.slice(110, 120))
    turned = BEFORE.rotations.copy()
    turned[-1, 7] = rot.mul(turned[-1, 7], rot.from_axis_angle([1.0, 0.0, 0.0], np.radians(12.0)))
    with pytest.raises(MotionMindError, match=f"{CLIP.skeleton.names[7]} is 12 degrees off"):
        ballet.tween(A, B, before=replace(BEFORE, rotations=turned))
    turned[-1] = rot.mul(BEFORE.rotations[-1], rot.from_axis_angle([1.0, 0.0, 0.0], np.radians(0.5)))
    ballet.tween(A, B, moves=3, before=replace(BEFORE, rotations=turned))  # the rounding of a file


def test_one_frame_is_no_movement(ballet: Engine) -> None:
    with pytest.raises(MotionMindError, match="has one frame, which shows no velocity"):
        ballet.tween(A, B, before=A.as_motion())
    with pytest.raises(MotionMindError, match="has one frame, which shows no velocity"):
        ballet.tween(A, B, after=B.as_motion())


def flipped(motion: Motion, frames: slice) -> Motion:
    """The motion as recorded with a fault: its left hip half a turn off in some frames."""
    rotations, hip = motion.rotations.copy(), motion.skeleton.index("left_hip")
    rotations[frames, hip] = rot.mul(rotations[frames, hip], rot.about_vertical(np.pi))
    return replace(motion, rotations=rotations)


@pytest.mark.parametrize(("first", "last"), [(0, 11), (3, 8)])
def test_a_flip_of_the_recording_is_no_velocity(ballet: Engine, first: int, last: int) -> None:
    """A velocity is that of the frames between it and the end; right at the end, there is none to be had."""
    fine = CLIP.resample(120.0)
    before, after = fine.slice(150, 161), fine.slice(400, 411)
    a, b = before.posture(-1), after.posture(0)
    found = bring_ends(ballet.corpus, a, b, flipped(before, slice(first, 7)), flipped(after, slice(4, last)))
    for velocity, wanted in (
        (found.leaving, Velocity.at_end(before.slice(7, 11))),
        (found.arriving, Velocity.at_start(after.slice(0, 4))),
    ):
        assert velocity is not None
        np.testing.assert_allclose(velocity.rotations, wanted.rotations, atol=1e-9)
    with pytest.warns(
        MotionMindWarning, match=r"before A shows no velocity: left_hip flips by 1\d\d degrees in a frame"
    ):
        alone = bring_ends(ballet.corpus, a, b, flipped(before, slice(0, 10)), after)
    assert (alone.leaving, alone.before) == (None, None)
    assert alone.arriving is not None
    with pytest.warns(MotionMindWarning, match="after B shows no velocity: left_hip flips"):
        assert bring_ends(ballet.corpus, a, b, None, flipped(after, slice(1, 11))).arriving is None


def test_movement_of_another_body_is_refused(ballet: Engine) -> None:
    arm = Skeleton("arm", ("shoulder",), (-1,), np.zeros((1, 3)))
    waving = Posture(arm, rot.IDENTITY[None], np.zeros(3)).as_motion()
    with pytest.raises(SkeletonError, match="the movement before A is on another skeleton"):
        ballet.tween(A, B, before=waving)
    with pytest.raises(SkeletonError, match="the movement after B is on another skeleton"):
        ballet.tween(A, B, after=waving)


# --- the motion between them ------------------------------------------------------------------------------------------

WINDOWS = [("ballet", 2), ("ballet", 7), ("karate", 1), ("karate", 6), ("walk-hexapod", 0)]


def window(engine: Engine, number: int, fps: float = 120.0) -> tuple[Motion, Motion, Posture, Posture]:
    """Frames before A and after B of a window of a corpus's own movement, five of its moves long; A and B."""
    clip = max(engine.corpus.clips, key=lambda one: one.stop - one.start)
    motion = engine.corpus.motion(clip)
    seconds = float(np.median(engine.corpus.seconds))
    first = motion.times[0] + (4 + 3 * number) * seconds
    times = np.arange(motion.times[0], motion.times[-1], 1.0 / fps)
    fine = motion.at(times)
    a, b = (int(np.searchsorted(times, moment)) for moment in (first, first + 5.0 * seconds))
    return fine.slice(a - 8, a + 1), fine.slice(b, b + 9), fine.posture(a), fine.posture(b)


def speeds(motion: Motion) -> tuple[Floats, Floats]:
    """Velocities of joints [2, J, 3] and root [2, 3] in the first and in the last frame to frame."""
    step = motion.times[1] - motion.times[0]
    turned = rot.log(rot.inv_mul(motion.rotations[[0, -2]], motion.rotations[[1, -1]])) / step
    return turned, np.asarray((motion.root[[1, -1]] - motion.root[[0, -2]]) / step)


@pytest.mark.long
@pytest.mark.parametrize(("name", "number"), WINDOWS)
def test_a_motion_leaves_and_arrives_with_the_velocities_of_its_ends(name: str, number: int) -> None:
    """Within what a frame leaves of it: the error falls with the length of a frame. Legs also hold their feet."""
    engine = Engine.load(name)
    before, after, a, b = window(engine, number)
    given = np.stack([Velocity.at_end(before).rotations, Velocity.at_start(after).rotations])
    assert np.abs(given).max() > 0.3
    legs = [joint for leg, _ in find_legs(engine.corpus.skeleton)[1] for joint in leg]
    carried = np.setdiff1d(np.arange(len(engine.corpus.skeleton)), legs)

    def errors(fps: float, **moving: Any) -> Floats:
        """The greatest error of each joint [J]."""
        motion = engine.tween(a, b, moves=5, fps=fps, **moving).motion
        return np.asarray(np.abs(speeds(motion)[0] - given).max(axis=(0, 2)))

    free = errors(240.0)
    coarse, fine = (errors(fps, before=before, after=after) for fps in (60.0, 240.0))
    assert fine.max() < 0.35 * free.max()
    assert fine[carried].max() < 0.1 * free[carried].max() + 1e-3
    assert fine[carried].max() < 0.4 * coarse[carried].max() + 1e-3


@pytest.mark.long
@pytest.mark.parametrize(("name", "number"), WINDOWS)
def test_one_end_may_move_and_the_other_not(name: str, number: int) -> None:
    engine = Engine.load(name)
    before, after, a, b = window(engine, number)
    plain = speeds(engine.tween(a, b, moves=5, fps=120.0).motion)[0]
    for end, movement in ((0, {"before": before}), (1, {"after": after})):
        found = speeds(engine.tween(a, b, moves=5, fps=120.0, **movement).motion)[0]  # type: ignore[arg-type]
        velocity = Velocity.at_end(before) if end == 0 else Velocity.at_start(after)
        assert np.abs(found[end] - velocity.rotations).max() < 0.25 * np.abs(plain[end] - velocity.rotations).max()


@pytest.mark.parametrize(("name", "number"), WINDOWS)
def test_the_root_leaves_and_arrives_nearly_as_its_ends_move(name: str, number: int) -> None:
    """Level, where its feet let it; heights are the floor's matter."""
    engine = Engine.load(name)
    before, after, a, b = window(engine, number)
    given = np.stack([Velocity.at_end(before).root, Velocity.at_start(after).root])[:, [0, 2]]
    off = speeds(engine.tween(a, b, moves=5, fps=120.0, before=before, after=after).motion)[1][:, [0, 2]] - given
    assert np.linalg.norm(off, axis=1).max() < 0.1 * np.linalg.norm(given, axis=1).max() + 0.03


@pytest.mark.long
@pytest.mark.parametrize(("name", "number"), WINDOWS)
@pytest.mark.parametrize("row", [1, 4])
def test_postures_are_passed_exactly_however_near_to_an_end_that_moves(name: str, number: int, row: int) -> None:
    engine = Engine.load(name)
    before, after, a, b = window(engine, number)
    clip = max(engine.corpus.clips, key=lambda one: one.stop - one.start)
    via = engine.corpus.motion(clip).posture(4 + 3 * number + row)
    tween = engine.tween(a, b, fps=240.0, via=[via], before=before, after=after)
    passed = tween.motion.at(tween.motion.insertions[0].times[list(tween.passed)])
    assert np.degrees(rot.angle(passed.rotations[0], via.rotations)).max() < 0.1


@pytest.mark.long
def test_a_body_that_runs_on_goes_on_for_a_while(ballet: Engine) -> None:
    """The movement after A goes the way that the body moved, and further than without."""
    before, _, a, b = window(ballet, 2)
    velocity = Velocity.at_end(before)
    joint = int(np.linalg.norm(velocity.rotations, axis=1).argmax())
    way = velocity.rotations[joint] / np.linalg.norm(velocity.rotations[joint])
    gone = []
    for moving in ({"before": before}, {}):
        motion = ballet.tween(a, b, moves=5, fps=120.0, **moving).motion  # type: ignore[arg-type]
        gone.append(rot.log(rot.inv_mul(motion.rotations[0], motion.rotations[8]))[joint] @ way)
    assert gone[0] > 0.5 * 8 / 120.0 * np.linalg.norm(velocity.rotations[joint])
    assert gone[0] > gone[1]


@pytest.mark.long
def test_names_of_moving_postures_move(ballet: Engine) -> None:
    """A ~ counts in Python as on the command line."""
    still = ballet.tween(*map(ballet.posture, ("ballet/adagio@23", "ballet/adagio@40")))
    assert (still.before, still.after) == (None, None)
    a, b = map(find_posture, ("ballet/adagio@23~", "ballet/adagio@40~"))
    named = ballet.tween(a.posture, b.posture, before=a.before, after=b.after)
    adagio = ballet_clip("adagio")
    near = np.flatnonzero(np.abs(adagio.times - adagio.times[23]) <= 0.2 + 1e-6)[0]
    given = ballet.tween(
        adagio.posture(23), adagio.posture(40), before=adagio.slice(min(near, 22), 24), after=adagio.slice(40, 42)
    )
    np.testing.assert_array_equal(named.motion.rotations, given.motion.rotations)
    assert not np.array_equal(named.motion.rotations[1], still.motion.rotations[1])


def test_nothing_leads_up_to_a_clip_s_first_frame_or_follows_its_last() -> None:
    first, last = (find_posture(f"ballet/adagio@{frame}~") for frame in (0, -1))
    assert first.before is None
    assert last.after is None
    for around in (first.after, last.before):
        assert around is not None
        assert len(around) >= 2
    still = find_posture("ballet/adagio@23")
    assert (still.before, still.after) == (None, None)
