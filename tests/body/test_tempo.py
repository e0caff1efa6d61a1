"""Clocks that movement contradicts, by falls, flights and steps; and recordings, which are taken at their word."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind import read_motion
from motionmind.body.human import human23, human44
from motionmind.body.motion import Insertion, Motion
from motionmind.body.support import centre_of_mass
from motionmind.body.tempo import question_tempo
from motionmind.corpus.gather import gather
from motionmind.errors import MotionMindWarning
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import own_skeleton

BODY = human23()
FPS = 60.0


def at_rest(seconds: float, fps: float = FPS) -> Motion:
    """Standing still, with the soles on the floor."""
    frames = int(seconds * fps)
    root = np.tile([0.0, -BODY.rest[:, 1].min(), 0.0], (frames, 1))
    return Motion(BODY, np.tile(rot.IDENTITY, (frames, 23, 1)), root, np.arange(frames) / fps, name="a")


def jump(fps: float = FPS, height: float = 0.3, gravity: float = 9.81) -> Motion:
    """A stiff body that is thrown up after a second and falls back."""
    still = at_rest(3.0, fps)
    half = np.sqrt(2.0 * height / gravity)
    lift = (height - 0.5 * gravity * (still.times - 1.0 - half) ** 2).clip(0.0)
    return replace(still, root=still.root + lift[:, None] * [0.0, 1.0, 0.0])


def walk(rate: float = 1.8, step: float = 0.65) -> Motion:
    """Legs that swing from the hips, `rate` steps a second of `step` metres."""
    still = at_rest(4.0)
    swing = 0.4 * np.sin(np.pi * rate * still.times)
    rotations = still.rotations.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        rotations[:, BODY.index(f"{side}_hip")] = rot.from_axis_angle([1.0, 0.0, 0.0], sign * swing)
    bob = 0.02 * np.cos(2.0 * np.pi * rate * still.times)
    way = np.stack([0.0 * bob, bob, rate * step * still.times], axis=1)
    return replace(still, rotations=rotations, root=still.root + way)


def tipping(fps: float = FPS, steps: int = 8) -> Motion:
    """A stiff body that passes sideways over one foot and then the other, as an inverted pendulum.

    At each step its mass goes from 13 degrees on one side of the foot to 13 degrees on the other.
    """
    poses, root = [], []
    for side, other, sign in (("left", "right", 1.0), ("right", "left", -1.0)) * (steps // 2):
        posture = np.tile(rot.IDENTITY, (23, 1))
        for joint, bend in (("hip", -0.9), ("knee", 1.8)):
            posture[BODY.index(f"{other}_{joint}")] = rot.from_axis_angle([1.0, 0.0, 0.0], bend)
        ankle = BODY.positions(posture, np.zeros(3))[BODY.index(f"{side}_ankle")]
        x, length = (centre_of_mass(BODY, posture, np.zeros(3)) - ankle)[:2]
        falling = np.radians(2.0) * np.sinh(np.arange(0.0, 1.0, 1.0 / fps) * np.sqrt(9.81 / length))
        falling = falling[falling < np.radians(13.0)]
        turned = np.tile(posture, (2 * len(falling) - 1, 1, 1))
        angle = sign * np.concatenate([-falling[:0:-1], falling]) + np.arctan(x / length)
        turned[:, 0] = rot.from_axis_angle([0.0, 0.0, 1.0], angle)
        turned[:, BODY.index(f"{side}_ankle")] = rot.inv(turned[:, 0])  # the sole stays flat
        ankles = BODY.positions(turned, np.zeros((len(turned), 3)))[:, BODY.index(f"{side}_ankle")]
        poses.append(turned)
        root.append(np.array([0.0, 0.1, 0.0]) - ankles)
    frames = sum(map(len, poses))
    return Motion(BODY, np.concatenate(poses), np.concatenate(root), np.arange(frames) / fps, name="a")


def played(motion: Motion, speed: float) -> Motion:
    return replace(motion, times=motion.times / speed)


@pytest.mark.parametrize("made", [jump, walk, tipping, lambda: at_rest(3.0)])
def test_the_right_clock_is_not_questioned(made: Callable[[], Motion]) -> None:
    assert question_tempo(made()) == ""


@pytest.mark.parametrize(
    ("speed", "said"),
    [
        (2.0, "about 2 times too fast: in the air it falls at 39 m/s2, gravity is 9.8"),
        (0.5, "about 2 times too slow: in the air it falls at 2.5 m/s2, gravity is 9.8"),
        (1.5, "about 1.5 times too fast: in the air it falls at 22 m/s2, gravity is 9.8"),
    ],
)
def test_flights(speed: float, said: str) -> None:
    assert question_tempo(played(jump(), speed)) == said


@pytest.mark.parametrize(
    ("made", "speed"),
    [(made, speed) for made in (jump, tipping) for speed in (0.1, 0.125, 0.2, 0.25, 0.5, 2.0, 3.0)] + [(tipping, 5.0)],
)
def test_a_clock_of_any_speed(made: Callable[[float], Motion], speed: float) -> None:
    """240 and 120 frames a second labelled 24 and 30 play 10 to 4 times too slow; 24 labelled 120 play too fast."""
    found = re.match(
        r"about (\S+) times too (\S+):",
        question_tempo(played(made(max(24.0 / speed, 24.0 if speed > 4.0 else FPS)), speed)),
    )
    assert found
    times, way = found.groups()
    assert way == ("fast" if speed > 1.0 else "slow")
    assert speed == 5.0 or float(times) == pytest.approx(max(speed, 1.0 / speed), rel=0.25)


def test_few_steps_do_not_tell() -> None:
    slow = played(tipping(120.0), 0.2)
    assert question_tempo(slow)
    assert question_tempo(played(tipping(120.0, steps=2), 0.2)) == ""  # too few to tell


def test_falls_on_the_floor() -> None:
    """Knee bends, 1.2 a second: nobody leaves the floor, and at 2.6 times the speed nobody could stay there."""
    still = at_rest(8.0)
    bend = 0.7 * (0.5 - 0.5 * np.cos(2.0 * np.pi * 1.2 * still.times))
    rotations = still.rotations.copy()
    for side in ("left", "right"):
        for joint, share in (("hip", -1.0), ("knee", 2.0), ("ankle", -1.0)):
            rotations[:, BODY.index(f"{side}_{joint}")] = rot.from_axis_angle([1.0, 0.0, 0.0], share * bend)
    low = BODY.positions_and_tips(rotations, np.zeros((len(still), 3)))[..., 1].min(axis=1)
    bends = replace(still, rotations=rotations, root=-low[:, None] * [0.0, 1.0, 0.0])
    assert question_tempo(bends) == ""
    assert "times too fast: it falls at 2" in question_tempo(played(bends, 2.6))


def test_steps() -> None:
    assert (
        question_tempo(played(walk(), 2.0))
        == "about 2 times too fast: it walks with 3.6 steps a second, and never runs"
    )
    assert question_tempo(played(walk(step=0.2), 2.0)) == ""  # small steps may be as quick


def test_what_cannot_be_told() -> None:
    fast = played(jump(), 2.0)
    assert question_tempo(replace(fast, keyframed=True)) == ""
    assert question_tempo(fast.resample(15.0)) == ""
    assert question_tempo(fast.slice(0, 20)) == ""
    assert question_tempo(fast.at(np.delete(fast.times, 9))) == ""
    giant = replace(BODY, offsets=100.0 * BODY.offsets, tips=100.0 * BODY.tips)  # its unit is wrong, not its clock
    assert question_tempo(replace(fast, skeleton=giant)) == ""
    other = Motion(human44(), np.tile(rot.IDENTITY, (len(fast), 44, 1)), fast.root, fast.times)
    assert question_tempo(other) == ""


def test_what_the_engine_made_is_not_questioned() -> None:
    quick = played(jump(), 2.0)
    assert question_tempo(quick)
    assert question_tempo(replace(quick, insertions=(Insertion(quick.times[10:20]),))) == ""


def test_lines_between_keyframes_are_not_questioned() -> None:
    fast = played(jump(), 2.0)
    assert question_tempo(fast.resample(8.0).resample(60.0)) == ""
    assert question_tempo(ballet_clip("jump").resample(30.0)) == ""


def test_a_corpus_questions_its_recordings() -> None:
    with pytest.warns(MotionMindWarning, match=r"are doubtful where .*: leap \(about 2 times too fast: .*\)$"):
        gather("a", [walk(), replace(played(jump(), 2.0), name="leap")])


@pytest.mark.parametrize(
    ("recording", "doubled", "halved"),
    [
        ("cmu-05/05_08.bvh", "fast", "slow"),
        ("cmu-05/05_12.bvh", "", ""),  # tendus on the floor
        ("cmu-16/16_01.amc", "fast", "slow"),
        ("cmu-16/16_12.amc", "walks", "slow"),
        ("cmu-16/16_36.amc", "fast", ""),
        ("indian/15.bvh", "fast", "slow"),
        ("bandai/run_normal_001.bvh", "", ""),
        ("bandai/dance-short_normal_001.bvh", "fast", ""),
    ],
)
@pytest.mark.filterwarnings("ignore::motionmind.MotionMindWarning")
def test_recordings(recording: str, doubled: str, halved: str, shared_data: Path) -> None:
    motion = own_skeleton(read_motion(shared_data / recording))
    assert question_tempo(motion) == ""
    for speed, said in ((2.0, doubled), (0.5, halved)):
        found = question_tempo(played(motion, speed))
        assert said in found
        assert bool(said) == bool(found)
