"""Posture and motion JSON, and the doors of the package: dispatch by suffix, whole files or none."""

from __future__ import annotations

import contextlib
import json
import os
import random
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.body.human import human23
from motionmind.body.motion import Insertion, Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.files import write_atomically
from motionmind.formats import read_motion, read_posture, write_motion, write_posture
from motionmind.geometry import rotations as rot

Mutate = Callable[[str, random.Random], bytes]


def random_motion(frames: int = 4, seed: int = 0, skeleton: Skeleton | None = None) -> Motion:
    rng = np.random.default_rng(seed)
    body = skeleton or human23()
    rotations = rot.normalise(rng.normal(size=(frames, len(body), 4)))
    times = np.cumsum(rng.uniform(0.01, 0.1, size=frames))
    return Motion(body, rotations, rng.normal(size=(frames, 3)), times, name="übung 1")


def tall() -> Skeleton:
    body = human23()
    return Skeleton("human23", body.names, body.parents, body.offsets * 1.1, body.tips * 1.1)


@pytest.fixture
def posture(tmp_path: Path) -> Path:
    path = tmp_path / "posture.json"
    write_posture(path, random_motion().posture(1))
    return path


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    path = tmp_path / "motion.json"
    write_motion(path, random_motion())
    return path


def fails(path: Path, content: object) -> str:
    """The message with which reading `content` fails, without the file's name."""
    if isinstance(content, (dict, list)):
        content = json.dumps(content)
    path.write_bytes(content if isinstance(content, bytes) else str(content).encode())
    with pytest.raises(FormatError) as caught:
        read_motion(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(str(path))


# --- round trips ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "body", [human23(), tall(), Skeleton('"odd" näme', ("a b", "c\n"), (-1, 0), np.eye(3)[:2] * 0.1)]
)
def test_a_posture_reads_back(tmp_path: Path, body: Skeleton) -> None:
    there = random_motion(skeleton=body).posture(2)
    write_posture(tmp_path / "a.json", there)
    back = read_posture(tmp_path / "a.json")
    assert back.skeleton == body
    assert back.skeleton.name == body.name
    np.testing.assert_allclose(back.rotations, there.rotations, rtol=0, atol=1e-9)
    np.testing.assert_allclose(back.root, there.root, rtol=0, atol=1e-9)
    first = (tmp_path / "a.json").read_bytes()
    write_posture(tmp_path / "a.json", back)
    assert (tmp_path / "a.json").read_bytes() == first


@pytest.mark.parametrize("keyframed", [True, False])
def test_keyframes_say_that_they_are(tmp_path: Path, keyframed: bool) -> None:
    there = replace(random_motion(5), keyframed=keyframed)
    write_motion(tmp_path / "a.json", there)
    assert read_motion(tmp_path / "a.json").keyframed is keyframed
    assert (b"keyframed" in (tmp_path / "a.json").read_bytes()) is keyframed


@pytest.mark.parametrize("body", [human23(), tall()])
@pytest.mark.parametrize("plan", [[], [[0.0, 0.5, 1.0]], [[0.0], [0.25, 0.5]]])
def test_a_motion_reads_back(tmp_path: Path, body: Skeleton, plan: list[list[float]]) -> None:
    plain = random_motion(50, skeleton=body)
    bridged = [tuple((body.names[move], move) for move in range(len(times) - 1)) for times in plan]
    insertions = tuple(Insertion(np.array(times), joints) for times, joints in zip(plan, bridged, strict=True))
    there = Motion(body, plain.rotations, plain.root, plain.times, plain.name, insertions)
    write_motion(tmp_path / "a.json", there)
    back = read_motion(tmp_path / "a.json")
    assert back.skeleton == body
    assert back.name == there.name
    for one, other in zip(back.insertions, insertions, strict=True):
        np.testing.assert_allclose(one.times, other.times, rtol=0, atol=1e-9)
        assert one.bridged == other.bridged
    for field in ("rotations", "root", "times"):
        np.testing.assert_allclose(getattr(back, field), getattr(there, field), rtol=0, atol=1e-9)
    first = (tmp_path / "a.json").read_bytes()
    assert (b'"insertions"' in first) == bool(plan)
    write_motion(tmp_path / "a.json", back)
    assert (tmp_path / "a.json").read_bytes() == first


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 4))
def test_any_skeleton_reads_back(tmp_path_factory: pytest.TempPathFactory, seed: int, joints: int, frames: int) -> None:
    rng = np.random.default_rng(seed)
    parents = (-1, *(int(rng.integers(joint)) for joint in range(1, joints)))
    names = tuple(f"joint {rng.integers(1000)}-{joint}" for joint in range(joints))
    body = Skeleton("random", names, parents, rng.normal(size=(joints, 3)), rng.normal(size=(joints, 3)))
    there = random_motion(frames, seed, body)
    path = tmp_path_factory.getbasetemp() / "property.json"
    write_motion(path, there)
    back = read_motion(path)
    assert back.skeleton == body
    assert rot.angle(there.rotations, back.rotations).max() < 1e-6
    np.testing.assert_allclose(back.root, there.root, rtol=0, atol=1e-9)


def test_steps_finer_than_the_rounding_stay_apart(tmp_path: Path) -> None:
    there = random_motion(3)
    there = Motion(there.skeleton, there.rotations, there.root, np.array([0.0, 1e-12, 2e-12]))
    write_motion(tmp_path / "a.json", there)
    np.testing.assert_array_equal(read_motion(tmp_path / "a.json").times, there.times)


def test_what_a_person_sees(posture: Path, motion: Path) -> None:
    text = posture.read_text()
    assert text.startswith(
        '{\n  "format": "motionmind-posture",\n  "version": 1,\n  "skeleton": "human23",\n  "root": ['
    )
    assert '\n    "left_knee": [' in text
    assert "-0.0," not in text
    lines = motion.read_text().splitlines()
    assert lines[1:5] == [
        '"format": "motionmind-motion",',
        '"version": 1,',
        '"name": "übung 1",',
        '"skeleton": "human23",',
    ]
    assert sum(line.startswith("[[") for line in lines) == 4


def test_a_posture_written_by_hand(tmp_path: Path) -> None:
    rotations = {name: [0, 0, 0, 1] for name in reversed(human23().names)}
    rotations["left_hip"] = [0.7071068, 0, 0, 0.7071068]
    content = {
        "format": "motionmind-posture",
        "version": 1,
        "skeleton": "human23",
        "root": [0, 1, 0],
        "rotations": rotations,
    }
    path = tmp_path / "hand.json"
    path.write_text("\ufeff" + json.dumps(content, indent=4).replace("\n", "\r\n"))
    read = read_posture(path)
    hip = read.skeleton.index("left_hip")
    np.testing.assert_allclose(
        read.rotations[hip], [0.5**0.5, 0, 0, 0.5**0.5], atol=1e-12
    )  # seven digits, mended silently


def test_thousands_of_postures_are_quick(tmp_path: Path) -> None:
    write_motion(tmp_path / "a.json", random_motion(5_000))
    start = time.process_time()
    assert len(read_motion(tmp_path / "a.json")) == 5_000
    assert time.process_time() - start < 2.0  # about 0.15 s; much more would be a mistake


# --- what is mended, with a warning --------------------------------------------------------------------------------


def test_one_quaternion_that_is_not_unit(posture: Path) -> None:
    content = json.loads(posture.read_text())
    content["rotations"]["left_knee"] = [0, 0, 0, 2]
    posture.write_text(json.dumps(content))
    with pytest.warns(MotionMindWarning, match=r"posture\.json: the rotation of left_knee has length 2, not 1; made 1"):
        read = read_posture(posture)
    assert read.rotations[read.skeleton.index("left_knee")].tolist() == [0, 0, 0, 1]


def test_rounded_quaternions_are_mended_without_a_word(posture: Path) -> None:
    content = json.loads(posture.read_text())
    content["rotations"]["left_knee"] = [0, 0, 0, 1.005]
    posture.write_text(json.dumps(content))
    read = read_posture(posture)
    assert read.rotations[read.skeleton.index("left_knee")].tolist() == [0, 0, 0, 1]


def test_many_quaternions_that_are_not_unit_are_one_warning(motion: Path) -> None:
    content = json.loads(motion.read_text())
    content["rotations"][1][3] = [0, 0, 0, 2]
    content["rotations"][2] = [[0, 0.5, 0, 0]] * 23
    motion.write_text(json.dumps(content))
    with pytest.warns(MotionMindWarning, match=r"left_ankle in frame 1 has length 2, not 1, and 23 more") as caught:
        read_motion(motion)
    assert len(caught) == 1


# --- errors --------------------------------------------------------------------------------------------------------


def swap(name: str, value: object) -> Callable[[dict], dict]:
    return lambda content: {**content, name: value}


def without(name: str) -> Callable[[dict], dict]:
    return lambda content: {key: value for key, value in content.items() if key != name}


def turned(joint: str, value: object, drop: str = "") -> Callable[[dict], dict]:
    def change(content: dict) -> dict:
        rotations = {key: old for key, old in content["rotations"].items() if key != drop}
        return {**content, "rotations": {**rotations, joint: value}}

    return change


POSTURE_FAULTS = [
    (swap("format", "motionmind-dance"), ": format 'motionmind-dance' is unknown; it must be 'motionmind-posture' or"),
    (without("format"), ": there is no field format"),
    (swap("version", 2), ": version 2 of motionmind-posture: this MotionMind reads version 1"),
    (without("version"), ": no version of motionmind-posture"),
    (swap("version", "1"), ": version: expected int, got str"),
    (without("root"), ": there is no field root"),
    (swap("toot", []), ": unknown field 'toot'; did you mean root?"),
    (swap("root", [0, 1]), ": root: expected list of length 3"),
    (swap("root", [0, "1", 0]), ": root[1]: expected float, got str"),
    (swap("root", [0, None, 0]), ": root[1]: expected float, got null"),
    (swap("root", [0, 1e300, 0]), ": root is 1e+300, beyond"),
    (turned("left_knee", [0, 0, 0, 0]), ": the rotation of left_knee is zero"),
    (turned("left_knee", [0, 0, 1e200, 0]), ": the rotation of left_knee has a number beyond"),
    (turned("left_knee", [0, 0, 1]), ": rotations[...]: expected list of length 4"),
    (
        turned("left_kne", [0, 0, 0, 1], "left_knee"),
        ": rotations: human23 has no joint 'left_kne'; did you mean left_knee?",
    ),
    (turned("pelvis", [0, 0, 0, 1], "left_knee"), ": rotations: no left_knee; every joint of human23 needs one"),
    (
        swap("skeleton", "human45"),
        ": skeleton 'human45' has no description here",
    ),
    (swap("skeleton", 3), ": skeleton: expected str | object, got int"),
    (swap("skeleton", {"name": "x", "joints": []}), ": skeleton 'x' has no joints"),
    (swap("skeleton", {"name": "x"}), ": skeleton: there is no field joints"),
]


@pytest.mark.parametrize(("change", "message"), POSTURE_FAULTS)
def test_faults_of_a_posture(posture: Path, change: Callable[[dict], dict], message: str) -> None:
    assert message in fails(posture, change(json.loads(posture.read_text())))


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        ([("a", None), ("b", "c")], "the parent 'c' of 'b' is not listed before it"),
        ([("b", "a"), ("a", None)], "the parent 'a' of 'b' is not listed before it"),
        ([("a", None), ("a", "a")], "names a more than once"),
        ([("a", None), ("b", None)], "parent of 'b' must stand before it"),
    ],
)
def test_faults_of_a_skeleton(posture: Path, joints: list[tuple[str, str | None]], message: str) -> None:
    content = json.loads(posture.read_text())
    content["skeleton"] = {"name": "x", "joints": [{"name": n, "parent": p, "offset": [0, 0, 0]} for n, p in joints]}
    assert message in fails(posture, content)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (swap("times", []), ": times: a motion has at least one frame"),
        (swap("times", [0, 1, 2]), ": root has 4 frames, times has 3"),
        (swap("times", [0, 1, 1, 2]), ": times: 1 of frame 2 is not after 1"),
        (swap("times", [0, 1, 2, 1e300]), ": times is 1e+300, beyond"),
        (swap("rotations", [[]] * 4), ": rotations: frame 0 has 0 quaternions, human23 has 23 joints"),
        (swap("rotations", []), ": rotations has 0 frames, times has 4"),
        (swap("root", [[0, 0]] * 4), ": root[0]: expected list of length 3"),
        (swap("insertions", [{"times": ["a"]}]), ": insertions[0].times[0]: expected float, got str"),
        (swap("insertions", [{"times": []}]), ": an insertion's times must be finite and increasing, one at least"),
        (
            swap("insertions", [{"times": [0, 1], "bridged": [["tail", 0]]}]),
            ": übung 1: human23 has no joint 'tail' to bridge",
        ),
    ],
)
def test_faults_of_a_motion(motion: Path, change: Callable[[dict], dict], message: str) -> None:
    assert message in fails(motion, change(json.loads(motion.read_text())))


def test_a_plan_as_it_was_written_before_is_an_insertion(motion: Path) -> None:
    content = json.loads(motion.read_text()) | {"moves": [0.0, 0.5]}
    motion.write_text(json.dumps(content))
    (insertion,) = read_motion(motion).insertions
    assert (insertion.times.tolist(), insertion.bridged) == ([0.0, 0.5], ())


def test_a_zero_quaternion_is_named_with_its_frame(motion: Path) -> None:
    content = json.loads(motion.read_text())
    content["rotations"][2][1] = [0, 0, 0, 0]
    assert ": the rotation of left_hip in frame 2 is zero, which is not a rotation" in fails(motion, content)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", ":1: the JSON is cut short"),
        (b'{\n"format": "motionmind-posture",\n"ver', ":3: the JSON is cut short"),
        (b'{"format": "motionmind-posture",\n "version": NaN}', ":2: NaN is not a number JSON can hold (column 13)"),
        (b'{"version": -Infinity}', ":1: -Infinity is not a number JSON can hold"),
        (b'{"version": 1,}', " at column 15"),
        (b"[]", ": expected object, got list"),
        (b"\xff\xfe", ": not valid JSON"),
        (b"[" * 100_000, ""),
        (b'{"a":' * 100_000, ": lists nested too deeply"),
    ],
)
def test_what_is_no_json(tmp_path: Path, content: bytes, message: str) -> None:
    assert message in fails(tmp_path / "a.json", content)


def test_a_file_cut_anywhere_is_an_error(motion: Path) -> None:
    whole = motion.read_bytes().rstrip()
    for at in range(1, len(whole), max(1, len(whole) // 60)):
        assert "cut short" in fails(motion, whole[:at])


@pytest.mark.long
@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_only_our_errors_escape(tmp_path_factory: pytest.TempPathFactory, mutate: Mutate, seed: int) -> None:
    path = tmp_path_factory.getbasetemp() / "mutated.json"
    small = Skeleton("small", ("a", "b"), (-1, 0), np.eye(3)[:2])
    rng = random.Random(seed)
    if seed % 2:
        write_motion(path, random_motion(2, skeleton=small))
    else:
        write_posture(path, random_motion(2, skeleton=small).posture(0))
    text = path.read_text().replace(",", " , ").replace(":", " : ")
    for _ in range(4):
        path.write_bytes(mutate(text, rng))
        with warnings.catch_warnings(), contextlib.suppress(MotionMindError):
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", MotionMindWarning)
            assert len(read_motion(path)) >= 1


# --- the doors -----------------------------------------------------------------------------------------------------


def test_a_posture_is_read_as_a_motion_of_one_frame(posture: Path) -> None:
    assert len(read_motion(posture)) == 1
    assert read_motion(posture).times.tolist() == [0.0]


def test_a_posture_from_a_motion_needs_its_frame(motion: Path) -> None:
    with pytest.raises(FormatError, match="4 frames, where one posture was expected; say which frame"):
        read_posture(motion)
    np.testing.assert_array_equal(read_posture(motion, frame=-1).rotations, read_motion(motion).rotations[3])
    with pytest.raises(MotionMindError, match="no frame 4"):
        read_posture(motion, frame=4)


@pytest.mark.parametrize("suffix", [".bvh", ".txt", ".BVH", ".JSON"])
def test_postures_in_every_format_that_is_written(tmp_path: Path, suffix: str) -> None:
    there = random_motion().posture(0)
    write_posture(tmp_path / f"a{suffix}", there)
    back = read_posture(tmp_path / f"a{suffix}")
    assert rot.angle(there.rotations, back.rotations).max() < 1e-6


@pytest.mark.parametrize("name", ["a.mov", "a", "a.json.old"])
def test_an_unknown_suffix_names_the_known_ones(tmp_path: Path, name: str) -> None:
    with pytest.raises(
        FormatError, match=r"can be read end in \.json, \.bvh, \.amc, \.txt, \.npz, \.pkl, \.npy, \.pt, \.glb"
    ):
        read_motion(tmp_path / name)
    for write, thing in ((write_motion, random_motion()), (write_posture, random_motion().posture(0))):
        with pytest.raises(MotionMindError, match=r"can be written end in \.json, \.bvh, \.txt, \.glb, \.npz, \.vrma$"):
            write(tmp_path / name, thing)  # type: ignore[operator]


def test_amc_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(MotionMindError, match="can be written end in"):
        write_motion(tmp_path / "a.amc", random_motion())


@pytest.mark.parametrize("suffix", [".json", ".bvh", ".amc", ".txt", ".npz"])
def test_files_that_cannot_be_read(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(FormatError, match="cannot be read: there is no such file or folder"):
        read_motion(tmp_path / f"none{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(FormatError, match="cannot be read: is a directory"):
        read_motion(tmp_path / f"folder{suffix}")


@pytest.mark.parametrize("suffix", [".json", ".bvh", ".txt"])
def test_files_that_cannot_be_written(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(MotionMindError, match=r"cannot be written: there is no such file or folder$"):
        write_posture(tmp_path / "none" / f"a{suffix}", random_motion().posture(0))
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(MotionMindError, match=r"cannot be written: it is a folder$"):
        write_posture(tmp_path / f"folder{suffix}", random_motion().posture(0))
    assert [path.name for path in tmp_path.iterdir()] == [f"folder{suffix}"]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(b"old")

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(MotionMindError, match=r"a\.json: cannot be written: no space left on device"):
        write_atomically(path, b"new")
    assert [(found.name, found.read_bytes()) for found in tmp_path.iterdir()] == [("a.json", b"old")]


def test_an_unwritable_folder(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        if os.access(tmp_path, os.W_OK):
            pytest.skip("this user may write anywhere")
        with pytest.raises(MotionMindError, match="cannot be written: permission denied"):
            write_atomically(tmp_path / "a.json", b"")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.skipif(os.name != "posix", reason="permissions and links as POSIX has them")
def test_permissions_and_links_are_kept(tmp_path: Path) -> None:
    path, link = tmp_path / "a.json", tmp_path / "link.json"
    write_atomically(path, b"1")
    umask = os.umask(0)
    os.umask(umask)
    assert path.stat().st_mode & 0o777 == 0o666 & ~umask
    path.chmod(0o640)
    link.symlink_to(path)
    write_atomically(link, b"2")
    assert link.is_symlink()
    assert (path.read_bytes(), path.stat().st_mode & 0o777) == (b"2", 0o640)
    write_atomically("/dev/null", b"gone")
    assert Path("/dev/null").is_char_device()


def test_importing_the_package_is_cheap() -> None:
    heavy = {"msgspec", "scipy", "numba", "motionmind.formats.bvh"}
    code = f"import sys, motionmind.formats; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.long
def test_the_same_bytes_in_any_process(tmp_path: Path) -> None:
    code = """
import sys, numpy as np
from motionmind.formats import write_motion
from motionmind.body.motion import Motion
from motionmind.body.human import human23
rotations = np.full((2, 23, 4), 0.5)
motion = Motion(human23(), rotations, np.ones((2, 3)) / 3, np.arange(2) / 3)
for suffix in (".json", ".bvh", ".txt"):
    write_motion(sys.argv[1] + suffix, motion)
"""
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        subprocess.run([sys.executable, "-c", code, str(tmp_path / seed)], check=True, env=environment)
    for suffix in (".json", ".bvh", ".txt"):
        assert (tmp_path / f"1{suffix}").read_bytes() == (tmp_path / f"2{suffix}").read_bytes()


def test_a_posture_object_survives_every_door(tmp_path: Path) -> None:
    there = Posture(tall(), random_motion().rotations[0], np.array([0.0, 1.0, 0.0]))
    write_posture(tmp_path / "a.json", there)
    write_motion(tmp_path / "b.json", read_motion(tmp_path / "a.json"))
    assert read_posture(tmp_path / "b.json").skeleton == tall()
