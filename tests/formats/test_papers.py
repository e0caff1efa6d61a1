"""The papers' own notation, in and out."""

from __future__ import annotations

import contextlib
import random
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.formats import read_motion, read_posture, write_motion
from motionmind.formats.papers import read_papers, write_papers
from motionmind.geometry import rotations as rot

Mutate = Callable[[str, random.Random], bytes]
Form = Literal["braces", "lines"]

TOY = Skeleton(
    "toy", ("pelvis", "left_hip"), (-1, 0), np.array([[0, 0, 0], [0, -0.5, 0]]), np.array([[0, 0, 0], [0, -1, 0]])
)
BRACES = "{pelvis, 0.37187, 0, 0, 0.92823; left hip, 0, 0, 0, 1}\n{pelvis, 0, 0, 0, 1; left hip, 1, 0, 0, 0}\n"
LINES = "pelvis 0.37187 0 0 0.92823 left_hip 0 0 0 1\npelvis 0 0 0 1 left_hip 1 0 0 0\n"


def read(folder: Path, text: str, **options: float) -> Motion:
    path = folder / "dance.txt"
    path.write_text(text)
    return read_papers(path, skeleton=TOY, **options)  # type: ignore[arg-type]


def random_motion(body: Skeleton, frames: int, seed: int) -> Motion:
    rng = np.random.default_rng(seed)
    rotations = rot.normalise(rng.normal(size=(frames, len(body), 4)))
    return Motion(body, rotations, np.zeros((frames, 3)), np.arange(frames, dtype=float), name="m")


@pytest.mark.parametrize(
    "text",
    [
        BRACES,
        LINES,
        BRACES.replace(" ", "").replace("lefthip", "Left-Hip"),
        BRACES.replace("left hip", "left_hip").replace("}\n{", "; }   {").replace("; ", ";\n   "),
        BRACES.replace("{", "\n# a comment {\n{\n"),
        BRACES.replace("\n", "\r\n"),
        LINES.replace("left_hip", "left hip").replace(" ", "\t"),
        "# one posture a line\n\n" + LINES.replace("\npelvis", "   # and the next\n\n PELVIS"),
        LINES.replace(" 0 ", ", 0, "),
    ],
)
def test_both_forms(tmp_path: Path, text: str) -> None:
    motion = read(tmp_path, text)
    assert (motion.name, motion.skeleton) == ("dance", TOY)
    np.testing.assert_allclose(motion.rotations[0], [[0.37187, 0, 0, 0.92823], [0, 0, 0, 1]], atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0, atol=1e-12)
    np.testing.assert_allclose(motion.rotations[1], [[0, 0, 0, 1], [1, 0, 0, 0]])
    np.testing.assert_array_equal(motion.times, [0.0, 1.0])


def test_the_rate_is_the_readers(tmp_path: Path) -> None:
    np.testing.assert_allclose(read(tmp_path, BRACES, rate=5.0).times, [0.0, 0.2])
    np.testing.assert_allclose(read_motion(tmp_path / "dance.txt", skeleton=TOY, fps=4.0).times, [0.0, 0.25])
    for rate in (0.0, -1.0, float("nan")):
        with pytest.raises(MotionMindError, match="a rate must be a positive number"):
            read(tmp_path, BRACES, rate=rate)


def test_a_rate_that_a_comment_states(tmp_path: Path) -> None:
    assert read(tmp_path, "# a dance\n#12.5 postures a second\n" + BRACES).fps == pytest.approx(12.5)
    assert read(tmp_path, BRACES + "\n# 12.5 postures a second").fps == 1.0
    with pytest.raises(FormatError, match=r"dance\.txt:1: 0 postures a second: must be more than 0"):
        read(tmp_path, "# 0 postures a second\n" + BRACES)


def test_the_body_stands_on_the_floor(tmp_path: Path) -> None:
    motion = read(tmp_path, BRACES)
    lowest = TOY.positions_and_tips(motion.rotations, motion.root)[..., 1].min(axis=1)
    np.testing.assert_allclose(lowest, 0.0, atol=1e-12)
    np.testing.assert_array_equal(motion.root[:, [0, 2]], 0.0)
    np.testing.assert_allclose(motion.root[1], [0, 0.5, 0])  # hip 0.5 below, leg straight up from it


def test_joints_that_are_never_named_stand_at_rest(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("{pelvis, 0, 0.6, 0, 0.8}")
    with pytest.warns(MotionMindWarning, match=r"left_hip, left_knee, .* and 17 more are not named and stand at rest"):
        posture = read_posture(path)
    assert posture.skeleton == human23()
    np.testing.assert_allclose(posture.rotations[0], [0, 0.6, 0, 0.8])
    assert np.all(posture.rotations[1:] == rot.IDENTITY)


def test_lengths_far_from_one_are_said_once(tmp_path: Path) -> None:
    with pytest.warns(
        MotionMindWarning, match=r"dance\.txt:2: the rotation of pelvis has length 2, not 1, and 1 more"
    ) as caught:
        motion = read(tmp_path, BRACES.replace("pelvis, 0, 0, 0, 1; left hip, 1,", "pelvis, 0, 0, 0, 2; left hip, 3,"))
    assert len(caught) == 1
    np.testing.assert_array_equal(motion.rotations[1], [[0, 0, 0, 1], [1, 0, 0, 0]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ": no posture: write"),
        ("# nothing", ": no posture: write"),
        ("{}", ":1: a posture without joints"),
        ("{pelvis, 0, 0, 0, 1; left hip, 0, 0, 0, 1", ":1: the posture's '}' is missing"),
        ("pelvis, 0, 0, 0, 1}", ":1: 'pelvis, 0, 0, 0, 1' may not appear here"),
        ("{{pelvis, 0, 0, 0, 1}", ":1: '{' may not appear here"),
        ("{pelvis, 0, 0, 0, 1;\nleft hop, 0, 0, 0, 1}", ":2: toy has no joint 'left hop'; did you mean left_hip?"),
        ("{pelvis, 0, 0, 1}", ":1: 3 numbers for 'pelvis', where the four"),
        ("{pelvis 0 0 0 1}", ":1: toy has no joint 'pelvis 0 0 0 1'"),
        ("{pelvis, 0, 0, 0, x}", ":1: 'x' where a number"),
        ("{pelvis, 0, 0, 0, nan}", ":1: 'nan' where a number"),
        ("{pelvis, 0, 0, 0, 1; pelvis, 0, 0, 0, 1}", ":1: 'pelvis' for the second time in posture 0"),
        (BRACES.replace("; left hip, 1, 0, 0, 0", ""), ":2: posture 1 lacks left_hip, unlike the first"),
        (BRACES.replace("; left hip, 0, 0, 0, 1", ""), ":2: posture 1 names left_hip, unlike the first"),
        (BRACES.replace("1, 0, 0, 0", "0, 0, 0, 0"), ":2: the rotation of left_hip is zero"),
        ("0 0 0 1 pelvis", ":1: '0' where a joint's name was expected"),
        ("pelvis 0 0 0", ":1: 3 numbers for 'pelvis'"),
        ("pelvis 0 0 0 1 left_hip 0 0 0 1\npelvis 0 0 0 1 left_hip 0 0", ":2: 2 numbers for 'left_hip'"),
        ("hello world", ":1: toy has no joint 'hello world'"),
    ],
)
def test_faults(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("form", ["braces", "lines"])
def test_what_is_written_reads_back(tmp_path: Path, form: Form) -> None:
    there = random_motion(human23(), 20, seed=1)
    there = replace(there, times=there.times / 30.0)
    write_papers(tmp_path / "a.txt", there, form=form)
    text = (tmp_path / "a.txt").read_text()
    assert text.splitlines()[0] == "# 30 postures a second"
    assert len(text.splitlines()) == 21
    assert ("left hip," in text) == (form == "braces")
    assert ("left_hip " in text) == (form == "lines")
    back = read_papers(tmp_path / "a.txt")
    assert rot.angle(there.rotations, back.rotations).max() < 1e-9
    np.testing.assert_allclose(back.times, there.times - there.times[0], atol=1e-9)
    write_papers(tmp_path / "b.txt", back, form=form)
    assert (tmp_path / "b.txt").read_text() == text


def test_written_by_suffix(tmp_path: Path) -> None:
    write_motion(tmp_path / "a.txt", random_motion(human23(), 1, seed=2))
    assert (tmp_path / "a.txt").read_text().startswith("{pelvis, ")


@pytest.mark.parametrize("name", ["a;b", "a,b", "{", "a#", "", " ", "joint 2", "left hip"])
def test_names_that_have_no_notation(tmp_path: Path, name: str) -> None:
    body = Skeleton("s", ("left_hip", name), (-1, 0), np.zeros((2, 3)))
    with pytest.raises(MotionMindError, match="cannot hold the joint name"):
        write_papers(tmp_path / "a.txt", random_motion(body, 1, seed=0))
    assert list(tmp_path.iterdir()) == []


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_only_our_errors_escape(tmp_path_factory: pytest.TempPathFactory, mutate: Mutate, seed: int) -> None:
    path = tmp_path_factory.getbasetemp() / "mutated.txt"
    rng = random.Random(seed)
    for _ in range(4):
        path.write_bytes(mutate(BRACES if seed % 2 else LINES, rng))
        with warnings.catch_warnings(), contextlib.suppress(MotionMindError):
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", MotionMindWarning)
            assert len(read_papers(path, skeleton=TOY)) >= 1
