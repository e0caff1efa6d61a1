"""Places of joints: rotations fitted to them put joints where they were, and bend knees and elbows as they bent."""

from __future__ import annotations

import logging
import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionmind import read_motion
from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.formats._joint_places import _DIRECTIONS, fit_joints
from motionmind.formats._smpl import smpl_bodies
from motionmind.formats.smpl_data import read_npy, read_npy_clips
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import to_human23

FRAMES = 80
HINGES = ("left_knee", "right_knee", "left_elbow", "right_elbow")


def body(count: int = 22) -> Skeleton:
    """SMPL's body with the directions of its bones."""
    plain = next(one for one in smpl_bodies().values() if len(one) == count)
    offsets = np.array(plain.offsets)
    for joint, name in enumerate(plain.names[1:], start=1):
        side, _, kind = name.rpartition("_")
        direction = np.array(_DIRECTIONS[kind]) * ([-1.0, 1.0, 1.0] if side == "right" else [1.0, 1.0, 1.0])
        offsets[joint] = np.linalg.norm(offsets[joint]) * direction / np.linalg.norm(direction)
    return replace(plain, offsets=offsets)


def movement(seed: int, count: int = 22, rate: float = 20.0) -> Motion:
    """Smooth movement in which knees and elbows are hinges, and pelvis, hips, shoulders and chest turn any way."""
    rng = np.random.default_rng(seed)
    skeleton, times = body(count), np.arange(round(FRAMES * rate / 20.0)) / rate
    waves = np.sin(2.0 * np.pi * (rng.uniform(0.2, 0.8, (count, 3)) * times[:, None, None] + rng.random((count, 3))))
    vectors = 0.25 * waves * (rng.random((count, 3)) + 0.5)
    for name in HINGES:
        bend = 1.0 + 0.8 * waves[:, skeleton.index(name), 0]  # 11 to 103 degrees
        axis = [1.0, 0.0, 0.0] if "knee" in name else [0.0, 1.0 if "right" in name else -1.0, 0.0]
        vectors[:, skeleton.index(name)] = bend[:, None] * axis
    vectors[:, 0] *= 3.0
    root = np.array([0.0, 0.95, 0.0]) + 0.1 * waves[:, 0]
    return Motion(skeleton, rot.exp(vectors), root, times, name="a")


def places(motion: Motion) -> Floats:
    return motion.skeleton.positions(motion.rotations, motion.root)


@pytest.mark.parametrize("count", [22, 24])
@pytest.mark.parametrize("seed", range(4))
def test_joints_are_where_they_were(seed: int, count: int) -> None:
    wanted = places(movement(seed, count))
    skeleton, rotations, reached = fit_joints(wanted, 20.0)
    np.testing.assert_allclose(reached, wanted, atol=1e-9)
    np.testing.assert_allclose(skeleton.positions(rotations, wanted[:, 0]), wanted, atol=1e-9)


@pytest.mark.parametrize("rate", [20.0, 60.0])
@pytest.mark.parametrize("seed", range(4))
def test_limbs_twist_as_their_hinges_show(seed: int, rate: float) -> None:
    motion = movement(seed, rate=rate)
    skeleton, rotations, _ = fit_joints(places(motion), rate)
    found, wanted = skeleton.global_rotations(rotations), motion.skeleton.global_rotations(motion.rotations)
    for name in ("pelvis", "spine3"):
        off = rot.angle(found[:, skeleton.index(name)], wanted[:, skeleton.index(name)])
        assert off.max() < 1e-6, name
    for name in ("left_hip", "right_hip", "left_shoulder", "right_shoulder", *HINGES):
        off = np.degrees(rot.angle(found[:, skeleton.index(name)], wanted[:, skeleton.index(name)]))
        assert np.median(off) < 6.0, name
        assert off.max() < 25.0, name


def test_straight_limbs_do_not_twist() -> None:
    motion = movement(0)
    turns = np.tile(rot.IDENTITY, (FRAMES, 22, 1))
    turns[:, 0] = motion.rotations[:, 0]
    _, rotations, _ = fit_joints(places(replace(motion, rotations=turns)), 20.0)
    assert np.degrees(rot.angle(rotations[:, 1:], rot.IDENTITY)).max() < 1.0


def test_the_fit_turns_with_the_world() -> None:
    wanted = places(movement(1))
    turn = rot.about_vertical(2.0)
    skeleton, rotations, _ = fit_joints(wanted, 20.0)
    other, turned, _ = fit_joints(rot.mul_vec(turn, wanted) + np.array([3.0, 0.0, -2.0]), 20.0)
    np.testing.assert_allclose(other.offsets, skeleton.offsets, atol=1e-9)
    assert rot.angle(turned[:, 0], rot.mul(turn, rotations[:, 0])).max() < 1e-6
    assert rot.angle(turned[:, 1:], rotations[:, 1:]).max() < 1e-6


@pytest.mark.parametrize("frames", [1, 2])
def test_short_movement(frames: int, tmp_path: Path) -> None:
    wanted = places(movement(2))[:frames]
    np.save(tmp_path / "a.npy", wanted)
    motion = read_motion(tmp_path / "a.npy")
    np.testing.assert_allclose(places(motion), wanted, atol=1e-9)


# --- files ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_places_in_a_file(dtype: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    wanted = places(movement(3))
    np.save(tmp_path / "a.npy", wanted.astype(dtype))
    with caplog.at_level(logging.INFO, "motionmind.formats.smpl_data"):
        motion = read_motion(tmp_path / "a.npy")
    np.testing.assert_allclose(places(motion), wanted, atol=1e-5)
    assert (motion.name, motion.fps) == ("a", pytest.approx(20.0))
    assert re.search(r"rotations are fitted to places \(joints within 0\.0 mm\)", caplog.text)
    assert read_motion(tmp_path / "a.npy", fps=30).fps == pytest.approx(30.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # feet that wave in the air show no floor
        assert to_human23(motion).skeleton.name == "human23"


def results(path: Path, **changes: Any) -> Path:
    """Write what MDM does: three samples, the second shorter."""
    samples = np.stack([places(movement(seed)).transpose(1, 2, 0) for seed in range(3)]).astype("f4")
    held = {"motion": samples, "text": ["a person jumps"] * 3, "lengths": np.array([FRAMES, 40, FRAMES])}
    held |= {"num_samples": 3, "num_repetitions": 1} | changes
    np.save(path, {name: value for name, value in held.items() if value is not None})  # type: ignore[arg-type]
    return path


def test_samples_of_a_model(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = results(tmp_path / "results.npy")
    with caplog.at_level(logging.INFO, "motionmind.formats.smpl_data"):
        first = read_motion(path)
    assert "the first of 3 samples is read" in caplog.text
    assert first.name == "results"
    clips = list(read_npy_clips(path))
    assert [(clip.name, len(clip)) for clip in clips] == [("results#1", 80), ("results#2", 40), ("results#3", 80)]
    for seed, clip in enumerate(clips):
        np.testing.assert_allclose(places(clip), places(movement(seed))[: len(clip)], atol=1e-5)
        again = read_npy(path, clip=str(seed + 1))
        np.testing.assert_array_equal(again.rotations, clip.rotations)
        assert again.name == clip.name
    np.testing.assert_array_equal(first.rotations, clips[0].rotations)
    whole = results(tmp_path / "whole.npy", lengths=None)
    assert [len(clip) for clip in read_npy_clips(whole)] == [80, 80, 80]


def test_a_file_of_one_movement_has_one_clip(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", places(movement(0)))
    (only,) = read_npy_clips(tmp_path / "a.npy")
    assert only.name == "a"
    with pytest.raises(FormatError, match="no sample '2'; it holds one movement"):
        read_npy(tmp_path / "a.npy", clip="2")


class Runs:
    """What runs a command when it is unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return eval, ("1/0",)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"motion": None}, "no 'motion': not MDM's results"),
        ({"motion": "all of it"}, "'motion': it holds no numbers"),
        ({"motion": np.zeros((3, 21, 3, 5))}, "'motion' has the shape [3, 21, 3, 5], not samples by 22 by 3 by frames"),
        ({"motion": np.zeros((3, 22, 3, 0))}, "'motion' has the shape [3, 22, 3, 0]"),
        ({"motion": np.zeros((3, 22, 3))}, "'motion' has the shape [3, 22, 3]"),
        ({"motion": np.full((3, 22, 3, 5), np.nan)}, "'motion'[0, 0, 0, 0] is nan"),
        ({"motion": np.zeros((3, 22, 3, 80))}, "places of joints that are no body: left_hip and pelvis coincide"),
        ({"lengths": np.array([80, 81, 80])}, "'lengths' must be 3 numbers of frames, from 1 to 80"),
        ({"lengths": np.array([80, 0, 80])}, "'lengths' must be 3 numbers"),
        ({"lengths": np.array([80.5, 80, 80])}, "'lengths' must be 3 numbers"),
        ({"lengths": np.array([80])}, "'lengths' must be 3 numbers"),
        ({"text": Runs()}, "not MDM's pickle of arrays: it names builtins.eval, and pickled code is never run"),
    ],
)
def test_results_that_are_no_movement(changes: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = results(tmp_path / "results.npy", **changes)
    with pytest.raises(FormatError, match=re.escape(message)) as caught:
        read_motion(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("clip", ["0", "4", "-1", "1.0", "", "walk", "9" * 30])
def test_samples_have_numbers(clip: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"no sample .*; it has 3, from 1"):
        read_npy(results(tmp_path / "results.npy"), clip=clip)


@pytest.mark.parametrize("held", [np.array([1, "a"], dtype=object), np.array(None), np.array([{}], dtype=object)])
def test_other_objects(held: Any, tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", held)
    with pytest.raises(FormatError, match=r"a\.npy: "):
        read_motion(tmp_path / "a.npy")


def test_cut_short(tmp_path: Path) -> None:
    data = results(tmp_path / "results.npy").read_bytes()
    for length in (11, 100, 130, 200, len(data) // 2, len(data) - 1):
        (tmp_path / "cut.npy").write_bytes(data[:length])
        with pytest.raises(FormatError, match=r"cut\.npy: "):
            read_motion(tmp_path / "cut.npy")


def test_bones_that_stretch_are_reported(tmp_path: Path) -> None:
    wanted = places(movement(0))
    wanted[10, 20] += [0.1, 0.0, 0.0]
    np.save(tmp_path / "a.npy", wanted)
    with pytest.warns(
        MotionMindWarning, match=r"lengths of bones vary: left_wrist is \d+ mm off its place in frame 10"
    ):
        read_motion(tmp_path / "a.npy")


def test_features_are_refused_with_what_to_do(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros((10, 263)))
    with pytest.raises(FormatError, match="263 are HumanML3D's features: give its joints instead"):
        read_motion(tmp_path / "a.npy")
    np.save(tmp_path / "a.npy", places(movement(0)))
    with pytest.raises(MotionMindError, match="fps must be a positive number"):
        read_npy(tmp_path / "a.npy", fps=-1.0)
