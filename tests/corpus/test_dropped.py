"""Frames that a recording dropped: filled where few are missing, left out where many are, and told."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind.body.motion import Motion
from motionmind.corpus.dropped import Gap, fill_gaps, find_gaps
from motionmind.corpus.gather import gather
from motionmind.corpus.recordings import Taking, take
from motionmind.errors import MotionMindWarning
from motionmind.geometry import rotations as rot

FPS = 60.0


def dance(frames: int = 240) -> Motion:
    """Every joint swings, and the body goes to and fro."""
    body = ballet_clip("adagio").skeleton
    t = np.arange(frames) / FPS
    axes = np.random.default_rng(0).normal(size=(len(body), 3))
    turns = rot.exp(np.sin(3.0 * t)[:, None, None] * 0.4 * axes)
    return Motion(body, turns, np.stack([np.sin(2.0 * t), 0.9 + 0.0 * t, 0.5 * t], axis=1), t, "dance")


def without(motion: Motion, start: int, stop: int, kind: str) -> Motion:
    """The motion without some of its frames, as programs fill these."""
    rotations, root = motion.rotations.copy(), motion.root.copy()
    rotations[start:stop], root[start:stop] = (
        (rot.IDENTITY, 0.0) if kind == "zeros" else (rotations[start - 1], root[start - 1])
    )
    if kind == "elsewhere":
        root[start:stop] += [0.0, 0.0, 5.0]
    return replace(motion, rotations=rotations, root=root)


@pytest.mark.parametrize("kind", ["zeros", "repeated", "elsewhere"])
@pytest.mark.parametrize("missing", [1, 3, 8])
def test_a_few_frames_are_reconstructed(kind: str, missing: int) -> None:
    motion, stop = dance(), 100 + missing
    filled = fill_gaps(without(motion, 100, stop, kind))
    assert (filled.left, {(one.start, one.stop, one.exact) for one in filled.repairs}) == ((), {(100, stop, False)})
    assert {one.joint for one in filled.repairs} == {*motion.skeleton.names}
    assert np.degrees(rot.angle(filled.motion.rotations, motion.rotations)).max() < 3.0
    assert np.abs(filled.motion.root - motion.root).max() < 0.01
    frames = f"frame {100}" if missing == 1 else f"frames 100-{stop - 1}"
    assert f"({frames}): reconstructed" in filled.report
    assert ("repeat" in filled.report) == (kind == "repeated")


@pytest.mark.parametrize("kind", ["zeros", "repeated"])
def test_many_frames_are_left_out_of_what_is_learned(kind: str) -> None:
    faulty = without(dance(), 90, 135 if kind == "zeros" else 110, kind)
    with pytest.warns(MotionMindWarning, match=r"dance: .* \(frames 90-\d+\): left out"):
        taken = take(faulty, Taking())
    assert len(taken.pieces) == 2
    times = np.concatenate([one.times for one in taken.pieces])
    assert not np.any((times > 89.5 / FPS) & (times < 109.5 / FPS))
    with pytest.warns(MotionMindWarning, match="left out"):
        assert len(gather("mine", [faulty]).clips) == 2


@pytest.mark.parametrize("period", [6, 13, 29, 30, 59, 61, 100])
@pytest.mark.parametrize("rounds", [2, 3, 6])
@pytest.mark.parametrize("heading_deg", [0.0, 75.0, 200.0])
@pytest.mark.parametrize("turn_deg", [0.0, 40.0])
def test_a_loop_that_is_put_back_is_cut(period: int, rounds: int, heading_deg: float, turn_deg: float) -> None:
    """Walks of 1.5 m a round, straight or in a curve, that begin again at their start, a millimetre off."""
    at = np.arange(period * rounds) % period
    once, share = dance(period), at / period
    heading = np.radians(heading_deg + turn_deg * share)
    root = np.stack([np.sin(heading) * 1.5 * share, 0.9 + 0.0 * share, np.cos(heading) * 1.5 * share], axis=1)
    root += np.random.default_rng(period).normal(scale=0.001, size=root.shape)
    rotations = once.rotations[at].copy()
    rotations[:, 0] = rot.mul(rot.from_axis_angle([0.0, 1.0, 0.0], heading), rotations[:, 0])
    loop = Motion(once.skeleton, rotations, root, np.arange(len(at)) / FPS, "loop")
    assert find_gaps(loop) == [Gap(start, start, "leap") for start in range(period, len(at), period)]
    assert fill_gaps(loop).motion.root == pytest.approx(root, abs=0.0)


def test_a_leap_is_no_movement() -> None:
    motion = dance()
    root = motion.root.copy()
    root[120:] += [3.0, 0.0, 0.0]
    leaping = replace(motion, root=root)
    assert find_gaps(leaping) == [Gap(120, 120, "leap")]
    with pytest.warns(MotionMindWarning, match="the whole body leaps before frame 125: cut there"):
        taken = take(
            replace(
                leaping,
                rotations=np.concatenate([motion.rotations[:5], motion.rotations])[:240],
                root=np.concatenate([root[:5], root])[:240],
            ),
            Taking(skip=0),
        )
    assert [one.times[0] * FPS for one in taken.pieces] == pytest.approx([0.0, 125.0])


def test_frames_are_counted_as_in_the_file() -> None:
    with pytest.warns(MotionMindWarning, match=r"\(frames 100-101\): reconstructed"):
        taken = take(without(dance(), 100, 102, "zeros"), Taking(skip=10))
    assert {(one.start, one.stop) for one in taken.pieces[0].clip.repairs} == {(100, 102)}


def test_what_stands_still_or_is_slow_on_purpose_is_no_fault() -> None:
    motion = dance()
    rest = np.tile(motion.rotations[:1], (60, 1, 1)), np.tile(motion.root[:1], (60, 1))
    times = np.arange(300) / FPS
    begins = replace(
        motion,
        rotations=np.concatenate([rest[0], motion.rotations]),
        root=np.concatenate([rest[1], motion.root]),
        times=times,
    )
    assert find_gaps(begins) == []
    holds = np.interp(np.arange(240), [0, 100, 140, 239], [0, 100, 100, 199])  # slows down, holds, and sets off again
    smooth = np.convolve(np.pad(holds, 12, "edge"), np.ones(25) / 25.0, "valid")
    assert find_gaps(replace(motion.at(smooth / FPS + 1e-9 * np.arange(240)), times=motion.times)) == []
    assert find_gaps(replace(without(motion, 100, 104, "zeros"), keyframed=True)) == []
    there = np.abs(np.arange(240) - 119.5).astype(int)  # back and forth, with the same frame twice where it turns
    assert find_gaps(replace(motion, rotations=motion.rotations[there], root=motion.root[there])) == []


def test_frames_that_are_all_doubled_are_told_and_stay() -> None:
    motion = dance()
    doubled = replace(
        motion, rotations=motion.rotations[::2].repeat(2, axis=0), root=motion.root[::2].repeat(2, axis=0)
    )
    filled = fill_gaps(doubled)
    assert (filled.motion, filled.repairs, filled.left) == (doubled, (), ())
    assert "of 240 frames repeat the one before; they stay" in filled.report


def test_sound_recordings_have_none(shared_data: object) -> None:
    from motionmind import own_skeleton, read_motion

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for clip in ("cmu-05/05_16.bvh", "bandai/kick_normal_001.bvh", "cmu-16/16_01.amc"):
            motion = own_skeleton(read_motion(f"{shared_data}/{clip}"))
            assert fill_gaps(motion, begin=1).report == ""
