"""BVH in and out, checked against matrices that are built from the file's words without our code."""

from __future__ import annotations

import contextlib
import logging
import random
import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import ant, tumble
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionmind.body.human import human23, human44
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.formats import read_motion, write_motion
from motionmind.formats._bvh_file import BvhFile
from motionmind.formats._bvh_hierarchy import BvhJoint
from motionmind.formats._smpl import smpl_bodies
from motionmind.formats.bvh import bvh_unit, has_inserted_frames, read_bvh, read_bvh_clips, write_bvh
from motionmind.formats.units import UNITS, guess_unit, is_hand
from motionmind.geometry import rotations as rot

Mutate = Callable[[str, random.Random], bytes]

SMALL = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 50 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 40 0
    }
  }
  JOINT Leg
  {
    OFFSET 10 -5 0
    CHANNELS 3 Xrotation Yrotation Zrotation
    End Site
    {
      OFFSET 0 -85 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.04
0 90 0 10 20 30 1 2 3 4 5 6
1 91 2 11 21 31 2 3 4 5 6 7
2 92 4 12 22 32 3 4 5 6 7 8
"""


def write(folder: Path, text: str | bytes, name: str = "clip.bvh") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def fails(folder: Path, text: str | bytes) -> str:
    """The message with which reading fails, without the file's name."""
    path = write(folder, text)
    with pytest.raises(FormatError) as caught:
        read_bvh(path, unit=1.0)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message.removeprefix(str(path))


def positions(motion: Motion) -> dict[str, np.ndarray]:
    found = motion.skeleton.positions(motion.rotations, motion.root)
    return {name: found[:, joint] for joint, name in enumerate(motion.skeleton.names)}


def tips(motion: Motion) -> dict[str, np.ndarray]:
    found = motion.skeleton.positions_and_tips(motion.rotations, motion.root)[:, len(motion.skeleton) :]
    return {name: found[:, joint] for joint, name in enumerate(motion.skeleton.names)}


def parse(words: list[str]) -> list[dict]:
    """The joints of a plain BVH hierarchy."""
    joints: list[dict] = []
    stack: list[dict] = []
    for at, word in enumerate(words):
        if word in ("ROOT", "JOINT"):
            joints.append({"name": words[at + 1], "parent": stack[-1] if stack else None, "end": None})
            stack.append(joints[-1])
        elif word == "Site":
            stack.append({"end of": stack[-1]})
        elif word == "OFFSET":
            offset = [float(w) for w in words[at + 1 : at + 4]]
            stack[-1].get("end of", {})["end"] = offset
            stack[-1]["offset"] = offset
        elif word == "CHANNELS":
            stack[-1]["channels"] = words[at + 2 : at + 2 + int(words[at + 1])]
        elif word == "}":
            stack.pop()
    return joints


def oracle(path: Path, frames: list[int], *, added: bool = False) -> tuple[dict[str, list], dict[str, list]]:
    """Positions of joints and of end sites in the file's unit, by 4 x 4 matrices: nothing of ours is used."""
    words = path.read_text().split()
    joints = parse(words[: words.index("MOTION")])
    numbers = [float(word) for word in words[words.index("Time:") + 2 :]]
    width = sum(len(joint["channels"]) for joint in joints)
    assert len(numbers) % width == 0
    where: dict[str, list] = {joint["name"]: [] for joint in joints}
    ends: dict[str, list] = {joint["name"]: [] for joint in joints if joint["end"]}
    for frame in frames:
        row = numbers[frame * width : (frame + 1) * width]
        for joint in joints:
            shift, turn = np.eye(4), np.eye(4)
            shift[:3, 3] = joint["offset"]
            for channel in joint["channels"]:
                value, axis = row.pop(0), "XYZ".index(channel[0])
                if channel.endswith("position"):
                    shift[axis, 3] = value + (joint["offset"][axis] if added and joint["parent"] else 0.0)
                else:
                    step = np.eye(4)
                    step[:3, :3] = Rotation.from_euler("xyz"[axis], value, degrees=True).as_matrix()
                    turn = turn @ step
            joint["matrix"] = (joint["parent"]["matrix"] if joint["parent"] else np.eye(4)) @ shift @ turn
            where[joint["name"]].append(joint["matrix"][:3, 3])
            if joint["end"]:
                ends[joint["name"]].append((joint["matrix"] @ [*joint["end"], 1.0])[:3])
    return where, ends


# --- the shared recordings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("cmu-05/05_01.bvh", "cmu"),
        ("cmu-05/05_16.bvh", "cmu"),
        ("bandai/kick_normal_001.bvh", "cm"),
        ("bandai/walk_normal_001.bvh", "cm"),
        ("importer/bvh_test1.bvh", "in"),
        ("importer/bvh_test2.bvh", "cm"),
        ("importer/bvhio_example.bvh", "in"),
        ("importer/dab.bvh", "cmu"),
        ("importer/full_precision_frame_time.bvh", "dm"),
        ("importer/jumping_jacks.bvh", "cmu"),
        ("importer/rotation_first_root.bvh", "cmu"),
        ("importer/sinusoidal_no_end_sites.bvh", "ft"),
        ("importer/standard_skeleton.bvh", "in"),
        ("importer/test_freebvh.bvh", "cm"),
        ("importer/test_mocapbank.bvh", "cm"),
    ],
)
def test_positions_agree_with_matrices_built_from_the_file(shared_data: Path, name: str, unit: str) -> None:
    path = shared_data / name
    assert bvh_unit(path)[0] == unit
    motion = read_bvh(path)
    assert motion.name == motion.skeleton.name == path.stem
    frames = sorted({0, 1, len(motion) // 2, len(motion) - 1} & set(range(len(motion))))
    where, ends = oracle(path, frames)
    scale = UNITS[unit]
    for joint, found in positions(motion).items():
        np.testing.assert_allclose(found[frames], np.array(where[joint]) * scale, atol=1e-7)
    for joint, found in tips(motion).items():
        if joint in ends:
            np.testing.assert_allclose(found[frames], np.array(ends[joint]) * scale, atol=1e-7)


def test_a_root_that_walks_is_folded_into_the_hips_with_a_warning(shared_data: Path) -> None:
    path = shared_data / "bandai" / "run_normal_001.bvh"
    with pytest.warns(MotionMindWarning, match="Hips becomes the root.*path of joint_Root itself is lost"):
        motion = read_bvh(path)
    where, _ = oracle(path, [0, 23])
    for joint, found in positions(motion).items():
        np.testing.assert_allclose(found[[0, 23]], np.array(where[joint]) * 0.01, atol=1e-7)


def test_positions_near_zero_are_added_to_offsets(shared_data: Path) -> None:
    path = shared_data / "importer" / "makehuman_tpose.bvh"
    with pytest.warns(MotionMindWarning, match="are added to OFFSETs"):
        motion = read_bvh(path)
    assert (len(motion), len(motion.skeleton)) == (1, 173)
    where, _ = oracle(path, [0], added=True)
    for joint, found in positions(motion).items():
        np.testing.assert_allclose(found, np.array(where[joint]) * UNITS["dm"], atol=1e-6)
    assert 1.5 < np.ptp(motion.skeleton.positions_and_tips(motion.rotations, motion.root), axis=1).max() < 2.0


def test_a_wrong_count_in_the_header_is_said_and_the_data_wins(shared_data: Path) -> None:
    path = shared_data / "importer" / "boxing_toes_header_count_off_by_one.bvh"
    with pytest.warns(MotionMindWarning, match=r"header_count.*says 3069 frames, the file holds 3070"):
        motion = read_bvh(path)
    assert len(motion) == 3070
    assert motion.fps == pytest.approx(100.0)
    where, _ = oracle(path, [3069])
    np.testing.assert_allclose(positions(motion)["Head"][3069], where["Head"][0] * 0.01, atol=1e-7)


def test_a_line_cut_short_is_named(shared_data: Path) -> None:
    with pytest.raises(FormatError, match=r"cmu_kick_truncated\.bvh:35: 'z' where ROOT, JOINT"):
        read_bvh(shared_data / "importer" / "cmu_kick_truncated.bvh")


def test_every_recording_reads_and_a_person_has_a_persons_size(shared_data: Path) -> None:
    files = sorted([*shared_data.glob("cmu-05/*.bvh"), *shared_data.glob("bandai/*.bvh")])
    assert len(files) == 26
    for path in files:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MotionMindWarning)
            motion = read_bvh(path)
        assert motion.skeleton.names[0] == "Hips"
        assert motion.fps == pytest.approx(120.0 if "cmu" in str(path) else 30.0, rel=1e-5)
        some = motion.slice(1, len(motion)).posture(0)  # the CMU clips' first frame is a T-pose below the floor
        places = some.skeleton.positions_and_tips(some.rotations, some.root)
        assert 1.2 < np.ptp(places[:, 1]) < 2.2
        assert -0.1 < places[:, 1].min() < 0.3


# --- reading -------------------------------------------------------------------------------------------------------


def test_a_small_file(tmp_path: Path) -> None:
    path = write(tmp_path, SMALL)
    motion = read_bvh(path, unit="cm")
    assert motion.skeleton.names == ("Hips", "Spine", "Leg")
    assert motion.skeleton.parents == (-1, 0, 0)
    np.testing.assert_allclose(motion.skeleton.offsets, [[0, 0, 0], [0, 0.5, 0], [0.1, -0.05, 0]])
    np.testing.assert_allclose(motion.skeleton.tips, [[0, 0, 0], [0, 0.4, 0], [0, -0.85, 0]])
    np.testing.assert_allclose(motion.root, [[0, 0.9, 0], [0.01, 0.91, 0.02], [0.02, 0.92, 0.04]])
    np.testing.assert_allclose(motion.times, [0, 0.04, 0.08])
    expected = Rotation.from_euler("XYZ", [6, 7, 8], degrees=True)
    assert rot.angle(motion.rotations[2, 2], expected.as_quat()) < 1e-12


def test_a_clock_that_is_wrong_can_be_set_right(tmp_path: Path) -> None:
    path = write(tmp_path, SMALL)
    right = read_bvh(path, unit="cm", fps=50.0)
    np.testing.assert_allclose(right.times, [0, 0.02, 0.04])
    np.testing.assert_array_equal(right.rotations, read_bvh(path, unit="cm").rotations)
    np.testing.assert_array_equal(read_motion(path, fps=50.0).times, right.times)
    for fps in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(MotionMindError, match="fps must be a positive number of frames a second"):
            read_bvh(path, fps=fps)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace("  ", "\t"),
        lambda text: "\ufeff" + text,
        lambda text: text.encode("utf-16"),
        lambda text: text.replace("Xrotation", "XROTATION").replace("Yposition", "yPosition"),
        lambda text: text.replace("HIERARCHY", "Hierarchy").replace("OFFSET", "offset").replace("JOINT", "Joint"),
        lambda text: text.replace("\n{", " {").replace("Hips {", "Hips{"),
        lambda text: text.replace("Frames: 3\nFrame Time: 0.04", "Frame Time:\t.04\n\nFrames:3"),
        lambda text: text.replace("\n1 91", "\n\n# a comment\n// another\n   \n1 91"),
        lambda text: "\n\n# made by hand\n" + text + "\n\n\n",
        lambda text: text.replace("30 1", "30\n1").replace("31 2", "31\n2").replace("32 3", "32\n3"),  # wrapped
        lambda text: text.rstrip("\n"),
        lambda text: text.replace("1 91", "\x85\u0661 91"),  # what Python takes for a blank and for a digit
    ],
)
def test_the_same_movement_in_other_dress(tmp_path: Path, change) -> None:  # type: ignore[no-untyped-def]
    plain = read_bvh(write(tmp_path, SMALL))
    dressed = read_bvh(write(tmp_path, change(SMALL)))
    assert dressed.skeleton == plain.skeleton
    np.testing.assert_array_equal(dressed.rotations, plain.rotations)
    np.testing.assert_array_equal(dressed.root, plain.root)
    np.testing.assert_array_equal(dressed.times, plain.times)


@pytest.mark.parametrize(
    "name", ["mixamorig:Hips", "End", "EndSite", "End Effector", "my  left hip", "ROOT", "Hüfte", "0"]
)
def test_names(tmp_path: Path, name: str) -> None:
    motion = read_bvh(write(tmp_path, SMALL.replace("Spine", name)))
    assert motion.skeleton.names[1] == " ".join(name.split())


def test_latin_1_names(tmp_path: Path) -> None:
    assert read_bvh(write(tmp_path, SMALL.replace("Spine", "Rücken").encode("latin-1"))).skeleton.names[1] == "Rücken"


def test_missing_end_sites_leave_no_tip(tmp_path: Path) -> None:
    text = SMALL.replace("    End Site\n    {\n      OFFSET 0 40 0\n    }\n", "")
    assert read_bvh(write(tmp_path, text)).skeleton.tips[1].tolist() == [0, 0, 0]


def test_of_several_end_sites_the_first_is_the_tip(tmp_path: Path) -> None:
    end = "    End Site\n    {\n      OFFSET 0 40 0\n    }\n"
    motion = read_bvh(write(tmp_path, SMALL.replace(end, end + end.replace("0 40 0", "7 8 9"))), unit=1.0)
    np.testing.assert_array_equal(motion.skeleton.tips[motion.skeleton.index("Spine")], [0.0, 40.0, 0.0])


def test_joints_with_0_1_2_channels_and_axes_twice(tmp_path: Path) -> None:
    text = SMALL.replace("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 0")
    text = text.replace("CHANNELS 3 Xrotation Yrotation Zrotation", "CHANNELS 2 Yrotation Zrotation")
    text = text.replace(
        "CHANNELS 6 Xposition Yposition Zposition Zrotation", "CHANNELS 5 Zrotation Yposition Zrotation"
    )
    text = text[: text.index("Frames")] + "Frames: 1\nFrame Time: 1\n10 90 20 30 40 50 60\n"
    motion = read_bvh(write(tmp_path, text), unit="cm")
    np.testing.assert_allclose(motion.root, [[0, 0.9, 0]])
    expected = Rotation.from_euler("ZXY", [30, 30, 40], degrees=True).as_quat()  # two turns about z one after another
    assert rot.angle(motion.rotations[0, 0], expected) < 1e-12
    assert rot.angle(motion.rotations[0, 1], rot.IDENTITY) == 0.0
    assert rot.angle(motion.rotations[0, 2], Rotation.from_euler("YZ", [50, 60], degrees=True).as_quat()) < 1e-12


def positioned(rows: list[str]) -> str:
    text = SMALL.replace("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 3 Xposition Yposition Zposition")
    return text[: text.index("Frames")] + f"Frames: {len(rows)}\nFrame Time: 1\n" + "\n".join(rows) + "\n"


def test_constant_positions_take_the_place_of_the_offset(tmp_path: Path) -> None:
    rows = ["0 90 0 0 0 0 1 51 2 0 0 0"] * 2
    motion = read_bvh(write(tmp_path, positioned(rows)), unit="cm")
    np.testing.assert_allclose(motion.skeleton.offsets[1], [0.01, 0.51, 0.02])


def test_positions_that_vary_are_said_with_their_amount(tmp_path: Path) -> None:
    rows = ["0 90 0 0 0 0 0 50 0 0 0 0", "0 90 0 0 0 9 0 52 0 0 0 0"]
    with pytest.warns(MotionMindWarning, match=r"clip\.bvh: .*mean place: Spine \(by up to 10 mm\)"):
        motion = read_bvh(write(tmp_path, positioned(rows)), unit="cm")
    np.testing.assert_allclose(motion.skeleton.offsets[1], [0, 0.51, 0])
    rows[1] = rows[1].replace("52", "50.4")
    motion = read_bvh(write(tmp_path, positioned(rows)), unit="cm")  # nobody sees 2 mm
    np.testing.assert_allclose(motion.skeleton.offsets[1], [0, 0.502, 0])


def test_what_stands_still_beside_a_new_root_is_left_out_and_named(tmp_path: Path) -> None:
    text = """HIERARCHY
ROOT world {
 OFFSET 1 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
 JOINT floor { OFFSET 0 0 0 End Site { OFFSET 1 0 0 } }
 JOINT Hips { OFFSET 0 90 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Leg { OFFSET 0 -90 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 0 20 } }
  JOINT Head { OFFSET 0 80 0 CHANNELS 3 Zrotation Xrotation Yrotation }
 } }
MOTION
Frames: 2
Frame Time: 1
0 0 90 0 90 0 1 2 3 4 5 6 7 8 9
0 0 90 0 95 50 1 2 3 4 5 6 7 8 9
"""
    with pytest.warns(MotionMindWarning, match="Hips becomes the root.*left out: floor"):
        motion = read_bvh(write(tmp_path, text), unit="cm")
    assert motion.skeleton.names == ("Hips", "Leg", "Head")
    np.testing.assert_allclose(motion.root, [[0.01, 0.9, 0], [0.51, 0.95, 0]], atol=1e-12)  # z turned to x
    expected = Rotation.from_euler("Y", 90, degrees=True) * Rotation.from_euler("ZXY", [1, 2, 3], degrees=True)
    assert rot.angle(motion.rotations[0, 0], expected.as_quat()) < 1e-12


# --- several bodies ------------------------------------------------------------------------------------------------


def write_together(path: Path, motions: list[Motion]) -> list[Motion]:
    """Write several movements of one clock into a file, each below a ROOT; return them as they are read alone."""
    parts = [path.with_name(f"{number}.bvh") for number in range(len(motions))]
    for part, motion in zip(parts, motions, strict=True):
        write_bvh(part, motion, "m")
    texts = [part.read_text().split("MOTION\n") for part in parts]
    rows = [frames.splitlines() for _, frames in texts]
    hierarchy = "".join(above.removeprefix("HIERARCHY\n") for above, _ in texts)
    frames = [" ".join(row) for row in zip(*(lines[2:] for lines in rows), strict=True)]
    path.write_text("\n".join([f"HIERARCHY\n{hierarchy}MOTION", *rows[0][:2], *frames]) + "\n")
    return [read_bvh(part, unit="m") for part in parts]


def same_body(found: Motion, wanted: Motion) -> None:
    assert found.skeleton.difference(wanted.skeleton) is None
    np.testing.assert_array_equal(found.rotations, wanted.rotations)
    np.testing.assert_array_equal(found.root, wanted.root)
    np.testing.assert_array_equal(found.times, wanted.times)


@pytest.mark.parametrize("count", [2, 3])
def test_each_root_is_a_body(count: int, tmp_path: Path) -> None:
    bodies = [human23(), ant(), human23()][:count]
    path = tmp_path / "duo.bvh"
    alone = write_together(path, [tumble(body, seed) for seed, body in enumerate(bodies)])
    names = ["pelvis", ant().names[0], "pelvis (2)"][:count]
    for number, (name, wanted) in enumerate(zip(names, alone, strict=True), 1):
        for clip in (name, str(number)):
            found = read_bvh(path, clip=clip, unit="m")
            same_body(found, wanted)
            assert found.name == f"duo#{clip}"
    clips = list(read_bvh_clips(path, unit="m"))
    assert [clip.name for clip in clips] == [f"duo#{name}" for name in names]
    for found, wanted in zip(clips, alone, strict=True):
        same_body(found, wanted)


@pytest.mark.parametrize(
    ("clip", "message"),
    [
        (None, "it has 2 bodies, 'pelvis', 'pelvis (2)': choose one, as 'duo.bvh#pelvis'"),
        ("Pelvis", "no body 'Pelvis'; it has 'pelvis', 'pelvis (2)'"),
        ("0", "no body '0'"),
        ("3", "no body '3'"),
        ("-1", "no body '-1'"),
        ("", "no body ''"),
        ("٢", "no body"),
    ],
)
def test_a_body_must_be_chosen(clip: str | None, message: str, tmp_path: Path) -> None:
    write_together(tmp_path / "duo.bvh", [tumble(human23(), 0), tumble(human23(), 1)])
    with pytest.raises(FormatError, match=re.escape(f"duo.bvh: {message}")):
        read_bvh(tmp_path / "duo.bvh", clip=clip)


def test_the_only_body_needs_no_choice(tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", tumble(ant(), 0))
    (only,) = read_bvh_clips(tmp_path / "a.bvh")
    same_body(only, read_bvh(tmp_path / "a.bvh"))
    assert only.name == "a"
    same_body(read_bvh(tmp_path / "a.bvh", clip=ant().names[0]), only)


def test_many_bodies_of_one_name_have_names_of_their_own() -> None:
    joints = [BvhJoint(name, -1, 1) for name in ["a", "a (2)", "a", *["b"] * 2000]]
    names = list(BvhFile([], joints, np.zeros((1, 0)), 1, 1.0, []).bodies)
    assert len({*names}) == len(names) == len(joints)
    assert names[:3] == ["a", "a (2)", "a (3)"]
    assert names[-1] == "b (2000)"


# --- what is no BVH ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("HIERARCHY", "HIERARCHI", ":1: not a BVH file"),
        ("OFFSET 0 50 0", "OFFSET 0 fifty 0", ":8: 'fifty' where a number"),
        ("OFFSET 0 50 0", "OFFSET 0 nan 0", ":8: 'nan' where a number"),
        ("OFFSET 0 50 0", "", "joint 'Spine' has no OFFSET"),
        ("CHANNELS 3 Z", "CHANNELS three Z", ":9: 'three' where the number of channels of 'Spine'"),
        ("CHANNELS 3 Zrotation", "CHANNELS 3 Wrotation", ":9: 'WROTATION' is not a channel"),
        ("CHANNELS 3 Zrotation", "CHANNELS 4 Zrotation", ":10: 'END' is not a channel"),
        ("6 Xposition Yposition", "6 Xposition Xposition", ":5: joint 'Hips' has the channel XPOSITION twice"),
        ("JOINT Leg", "JOINT Spine", ":15: a second joint named 'Spine'"),
        ("JOINT Leg", "ROOT Leg", ":15: a ROOT may not appear here"),
        ("JOINT Spine\n  {", "JOINT Spine\n", ":8: 'OFFSET' where the '{' of JOINT Spine was expected"),
        ("JOINT Spine", "JOINT", ":6: a JOINT without a name"),
        ("    }\n  }\n}\nMOTION", "    }\n  }\nMOTION", "the hierarchy is incomplete: 1 '}' missing"),
        ("MOTION", "MOTI", "'MOTI' where ROOT"),
        ("Frames: 3", "", "no line 'Frames: ...'"),
        ("Frames: 3", "Frames: x", ":26: 'x' where the number of frames"),
        ("Frame Time: 0.04", "", "no line 'Frame Time: ...'"),
        ("Frame Time: 0.04", "Frame Time: 0", ":27: Frame Time is 0; it must be the seconds"),
        ("Frame Time: 0.04", "Frame Time: -1", ":27: Frame Time is -1"),
        ("Frame Time: 0.04", "Frame Time:", ":27: '' where a number"),
        ("2 92 4 12 22 32 3 4 5 6 7 8", "2 92 4 12 22 3", ":30: the line holds 6 numbers, a frame of this file has 12"),
        ("1 91 2", "1 91 2 3", ":29: the line holds 13 numbers"),
        ("21 31", "21 nan", ":29: 'nan' where a number"),
        ("21 31", "21 inf", ":29: 'inf' where a number"),
        ("21 31", "21 1e400", ":29: '1e400' where a number"),
        ("21 31", "21 3,1", ":29: '3,1' where a number"),
        ("21 31", "21 3_1", ":29: '3_1' where a number"),
        (SMALL[SMALL.index("0 90 0 10") :], "", "no frames after the header"),
        (SMALL[SMALL.index("MOTION") :], "", "no line MOTION"),
        (SMALL, "", ":1: not a BVH file"),
    ],
)
def test_a_fault_is_named_with_its_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in SMALL
    assert message in fails(tmp_path, SMALL.replace(old, new, 1))


def test_no_channels_at_all(tmp_path: Path) -> None:
    assert "no joint has CHANNELS" in fails(
        tmp_path, "HIERARCHY ROOT a { OFFSET 0 0 0 }\nMOTION\nFrames: 9\nFrame Time: 1\n"
    )


def test_deep_nesting_is_no_recursion(tmp_path: Path) -> None:
    def chain(depth: int) -> str:
        joints = "".join(f"JOINT j{i} {{ OFFSET 0 1 0 " for i in range(depth))
        channels = "CHANNELS 3 Zrotation Xrotation Yrotation "
        head = f"HIERARCHY ROOT r {{ OFFSET 0 0 0 {channels}{joints}{'}' * (depth + 1)}\n"
        return head + "MOTION\nFrames: 1\nFrame Time: 1\n1 2 3\n"

    assert len(read_bvh(write(tmp_path, chain(1500)), unit=1.0).skeleton) == 1501
    assert "more than 4000 joints" in fails(tmp_path, chain(100_000))


def test_files_that_are_not_there(tmp_path: Path) -> None:
    for path in (tmp_path / "none.bvh", tmp_path, "\0.bvh"):
        with pytest.raises(FormatError, match="cannot be read: "):
            read_bvh(path)


@pytest.mark.parametrize("unit", ["furlong", "", 0.0, -1.0, float("nan"), float("inf")])
def test_a_unit_that_is_none(tmp_path: Path, unit: str | float) -> None:
    with pytest.raises(MotionMindError, match=r"unit .* is unknown; give one of cm, m, mm, in, ft, dm, cmu"):
        read_bvh(write(tmp_path, SMALL), unit=unit)


def test_units_by_name_and_by_number(tmp_path: Path) -> None:
    path = write(tmp_path, SMALL)
    np.testing.assert_array_equal(read_bvh(path, unit="CM ").root, read_bvh(path, unit=0.01).root)
    np.testing.assert_array_equal(read_bvh(path, unit="0.01").root, read_bvh(path, unit=0.01).root)
    np.testing.assert_array_equal(read_motion(path, unit="in").root, read_bvh(path, unit=0.0254).root)


@pytest.mark.parametrize("unit", list(UNITS))
def test_a_person_of_any_size_is_told_in_any_unit(unit: str) -> None:
    body = human23()
    for height in (1.45, 1.7, 2.0):
        scale = height / 1.7 / UNITS[unit]
        assert guess_unit(Skeleton("p", body.names, body.parents, body.offsets * scale, body.tips * scale))[0] == unit


def test_units_of_what_is_no_person() -> None:
    assert guess_unit(Skeleton("dot", ("a",), (-1,), np.zeros((1, 3)))) == ("cm", 0.01)
    assert guess_unit(Skeleton("rod", ("a",), (-1,), np.zeros((1, 3)), np.array([[0.0, 250.0, 0.0]]))) == ("cm", 0.01)


def hand_of(body: Skeleton, wrist: str, above: int) -> Skeleton:
    """The hand at a wrist, with so many joints of the arm above."""
    top = body.index(wrist)
    for _ in range(above):
        top = body.parents[top]
    kept = [top]
    for joint in range(top + 1, len(body)):
        if body.parents[joint] in kept:
            kept.append(joint)
    parents = [kept.index(body.parents[joint]) if joint != top else -1 for joint in kept]
    offsets = np.where(np.arange(len(kept))[:, None] > 0, body.offsets[kept], 0.0)
    return Skeleton("hand", tuple(body.names[joint] for joint in kept), tuple(parents), offsets, body.tips[kept])


@pytest.mark.parametrize("above", [0, 1])
@pytest.mark.parametrize("name", ["human44", "SMPL+H", "SMPL-X"])
def test_a_hand_alone_is_no_body(name: str, above: int) -> None:
    body = human44() if name == "human44" else smpl_bodies()[name]
    hand = hand_of(body, "left_wrist", above)
    assert is_hand(hand)
    assert not is_hand(body)
    for unit, metres in UNITS.items():
        assert guess_unit(replace(hand, offsets=hand.offsets / metres, tips=hand.tips / metres))[0] == unit


def test_the_note_says_that_a_hand_shows_the_unit(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    hand = hand_of(human44(), "right_wrist", 0)
    write_bvh(tmp_path / "hand.bvh", tumble(hand, 0), "cm")
    with caplog.at_level(logging.INFO, "motionmind.formats.bvh"):
        motion = read_bvh(tmp_path / "hand.bvh")
    np.testing.assert_allclose(motion.skeleton.offsets, hand.offsets, atol=1e-6)
    assert "one unit taken as 0.01 m (cm), by the size of the hand" in caplog.text


def test_the_unit_that_is_taken_is_logged(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("INFO", logger="motionmind.formats.bvh"):
        read_bvh(write(tmp_path, SMALL))
    assert "one unit taken as 0.01 m (cm)" in caplog.text


# --- writing -------------------------------------------------------------------------------------------------------


def wandering(skeleton: Skeleton, frames: int, seed: int) -> Motion:
    rng = np.random.default_rng(seed)
    rotations = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    # Angles at which Euler angles lock, too.
    rotations[:, :: max(1, len(skeleton) // 3)] = rot.from_axis_angle([1.0, 0.0, 0.0], np.pi / 2)
    return Motion(skeleton, rotations, rng.normal(size=(frames, 3)), np.arange(frames) * 0.02, name="wandering")


def assert_same(motion: Motion, again: Motion) -> None:
    order = [again.skeleton.names.index(name) for name in motion.skeleton.names]
    assert rot.angle(motion.rotations, again.rotations[:, order]).max() < 1e-6
    np.testing.assert_allclose(again.root, motion.root, atol=1e-6)
    np.testing.assert_allclose(again.times - again.times[0], motion.times - motion.times[0], atol=1e-9)
    here = motion.skeleton.positions_and_tips(motion.rotations, motion.root)
    there = again.skeleton.positions_and_tips(again.rotations, again.root)
    count = len(motion.skeleton)
    np.testing.assert_allclose(there[:, order], here[:, :count], atol=1e-6)
    leaf = [joint for joint in range(count) if joint not in motion.skeleton.parents]
    np.testing.assert_allclose(there[:, count:][:, order][:, leaf], here[:, count:][:, leaf], atol=1e-6)


@pytest.mark.parametrize("order", ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])
def test_every_rotation_order_is_read_and_read_back(tmp_path: Path, order: str) -> None:
    """Positions of all joints and tips are those of matrices, which are SciPy's, before and after writing."""
    rng = np.random.default_rng(0)
    turns = " ".join(f"{letter}rotation" for letter in order)
    hierarchy = f"""HIERARCHY
    ROOT base {{ OFFSET 1 2 3 CHANNELS 6 Xposition Yposition Zposition {turns}
      JOINT upper {{ OFFSET 0 5 1 CHANNELS 3 {turns}
        JOINT fore {{ OFFSET 2 0 -4 CHANNELS 3 {turns}
          End Site {{ OFFSET 3 1 2 }} }} }}
      JOINT side {{ OFFSET -3 1 0 CHANNELS 3 {turns}
        End Site {{ OFFSET -1 -2 5 }} }} }}
    """
    angles = rng.uniform(-180.0, 180.0, (30, 4, 3))
    angles[:6, :, 1] = [[90.0], [-90.0], [89.9999], [-89.9999], [120.0], [-175.0]]  # locked, nearly so, and beyond
    rows = np.concatenate([rng.normal(size=(30, 3)), angles.reshape(30, 12)], axis=1)
    numbers = "\n".join(" ".join(f"{number:.9f}" for number in row) for row in rows)
    source = write(tmp_path, f"{hierarchy}MOTION\nFrames: 30\nFrame Time: 0.02\n{numbers}\n")
    motion = read_bvh(source, unit=1.0)
    for joint, name in enumerate(motion.skeleton.names):
        at = ["base", "upper", "fore", "side"].index(name)
        expected = Rotation.from_euler(order, angles[:, at], degrees=True).as_quat()
        assert rot.angle(motion.rotations[:, joint], expected).max() < 1e-7
    joints, ends = oracle(source, list(range(30)))
    write_bvh(tmp_path / "again.bvh", motion, unit=1.0)
    again = read_bvh(tmp_path / "again.bvh", unit=1.0)
    for found in (motion, again):
        assert set(joints) == set(found.skeleton.names)
        for name, places in joints.items():
            np.testing.assert_allclose(positions(found)[name], places, atol=1e-5)
        for name, places in ends.items():
            np.testing.assert_allclose(tips(found)[name], places, atol=1e-5)
    written, written_ends = oracle(tmp_path / "again.bvh", list(range(30)))
    for name, places in joints.items():
        np.testing.assert_allclose(written[name], places, atol=1e-5)
    for name, places in ends.items():
        np.testing.assert_allclose(written_ends[name], places, atol=1e-5)


@pytest.mark.parametrize("seed", range(4))
def test_every_joint_has_an_order_of_its_own(tmp_path: Path, seed: int) -> None:
    """The text is made of known rotations, with positions before, between and after the turns; what is read, and what
    is written, word by word, are those rotations again."""
    rng, frames = np.random.default_rng(seed), 12
    orders = rng.permutation(["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]).tolist()
    known = Rotation.random(frames * 6, random_state=seed).as_quat().reshape(frames, 6, 4)
    # Two of them turn on after a right angle about the middle axis, where the other two are one.
    known[:2, :, :] = Rotation.from_euler("y", [[90.0], [-90.0]], degrees=True).as_quat()[:, None]
    places = rng.normal(size=(frames, 3))
    hierarchy, columns = "HIERARCHY\n", []
    for joint, order in enumerate(orders):
        with warnings.catch_warnings(action="ignore"):  # SciPy warns where Euler angles lock
            turns = Rotation.from_quat(known[:, joint]).as_euler(order, degrees=True)
        channels = [(f"{letter}rotation", turns[:, at]) for at, letter in enumerate(order)]
        if joint == 0:
            moves = [(f"{letter}position", 100.0 * places[:, "XYZ".index(letter)]) for letter in orders[1]]
            channels = [moves[0], channels[0], moves[1], *channels[1:], moves[2]]
        columns += [values for _, values in channels]
        words = " ".join(name for name, _ in channels)
        hierarchy += (
            f"{'JOINT' if joint else 'ROOT'} j{joint} {{ OFFSET 0 {10 * joint} 3 CHANNELS {len(channels)} {words}\n"
        )
        if joint in (2, 5):  # two branches of three
            hierarchy += "End Site { OFFSET 5 4 3 }" + {2: " } }", 5: " } } } }"}[joint] + "\n"
    rows = "\n".join(" ".join(f"{number:.9f}" for number in row) for row in np.stack(columns, axis=1))
    source = write(tmp_path, f"{hierarchy}MOTION\nFrames: {frames}\nFrame Time: 0.1\n{rows}\n")
    motion = read_bvh(source, unit="cm")
    assert motion.skeleton.parents == (-1, 0, 1, 0, 3, 4)
    assert rot.angle(motion.rotations, known).max() < 1e-6
    np.testing.assert_allclose(motion.root, places, atol=1e-9)

    write_bvh(tmp_path / "again.bvh", motion)
    words = (tmp_path / "again.bvh").read_text().split()
    numbers = np.array(words[words.index("Time:") + 2 :], dtype=float).reshape(frames, 3 + 3 * 6)
    joints = parse(words[: words.index("MOTION")])
    assert [joint["name"] for joint in joints] == [f"j{joint}" for joint in range(6)]
    assert joints[0]["channels"][:3] == ["Xposition", "Yposition", "Zposition"]
    np.testing.assert_allclose(numbers[:, :3], 100.0 * places, atol=1e-6)
    for joint, written in enumerate(joints):
        order = "".join(channel[0] for channel in written["channels"][-3:])
        degrees = numbers[:, 3 + 3 * joint : 6 + 3 * joint]
        assert rot.angle(Rotation.from_euler(order, degrees, degrees=True).as_quat(), known[:, joint]).max() < 1e-6
    assert rot.angle(read_bvh(tmp_path / "again.bvh", unit="cm").rotations, known).max() < 1e-6


@pytest.mark.parametrize("unit", ["cm", "m", "mm", "in", "cmu", 3.0])
def test_read_back(tmp_path: Path, unit: str | float) -> None:
    motion = wandering(human23(), 40, seed=1)
    write_bvh(tmp_path / "a.bvh", motion, unit=unit)
    again = read_bvh(tmp_path / "a.bvh", unit=unit)
    assert again.skeleton.names == human23().names
    assert again.skeleton.difference(human23()) is None
    assert_same(motion, again)
    if unit != 3.0:
        assert bvh_unit(tmp_path / "a.bvh")[0] == unit


@pytest.mark.parametrize("name", ["cmu-05/05_16.bvh", "bandai/kick_normal_001.bvh", "importer/test_freebvh.bvh"])
def test_recordings_read_back(shared_data: Path, tmp_path: Path, name: str) -> None:
    motion = read_bvh(shared_data / name)
    write_motion(tmp_path / "a.bvh", motion)
    assert_same(motion, read_bvh(tmp_path / "a.bvh", unit="cm"))
    first = (tmp_path / "a.bvh").read_bytes()
    write_bvh(tmp_path / "a.bvh", motion)
    assert (tmp_path / "a.bvh").read_bytes() == first


def test_angles_are_written_without_jumps(tmp_path: Path) -> None:
    skeleton = Skeleton("top", ("top",), (-1,), np.zeros((1, 3)))
    turns = np.linspace(0.0, 6.0 * np.pi, 60)
    motion = Motion(skeleton, rot.about_vertical(turns)[:, None], np.zeros((60, 3)), np.arange(60) / 30.0)
    write_bvh(tmp_path / "a.bvh", motion)
    rows = [line.split() for line in (tmp_path / "a.bvh").read_text().splitlines()[-60:]]
    assert np.abs(np.diff([float(row[-1]) for row in rows])).max() < 30.0


def test_frames_that_the_engine_made_are_known_by_the_ends_of_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(SMALL, "utf-8")
    motion = read_bvh(path)
    write_bvh(path, motion)
    assert not has_inserted_frames(path)
    made = Motion(motion.skeleton, motion.rotations, motion.root, motion.times, insertions=(Insertion(motion.times),))
    write_bvh(path, made)
    assert [line[-1] == " " for line in path.read_text("utf-8").split("\n")[-4:-1]] == [False, True, False]
    assert has_inserted_frames(path)
    np.testing.assert_allclose(read_bvh(path).rotations, motion.rotations, atol=1e-6)
    # As Blender writes it, and others but for the last line.
    for end in (" ", ""):
        lines = SMALL.strip().split("\n")
        path.write_text("\n".join([*(f"{line} " for line in lines[:-1]), lines[-1] + end]), "utf-8")
        assert not has_inserted_frames(path)


def test_a_leaf_without_tip_has_an_end_site(tmp_path: Path) -> None:
    skeleton = Skeleton("top", ("top",), (-1,), np.zeros((1, 3)))
    write_bvh(tmp_path / "a.bvh", Motion(skeleton, np.array([[[0, 0, 0, 1.0]]]), np.zeros((1, 3)), np.zeros(1)))
    text = (tmp_path / "a.bvh").read_text()
    assert text.count("End Site") == 1
    assert "-0.0" not in text
    assert len(read_bvh(tmp_path / "a.bvh")) == 1


def test_uneven_times_cannot_be_written(tmp_path: Path) -> None:
    motion = wandering(human23(), 3, seed=2)
    uneven = Motion(motion.skeleton, motion.rotations, motion.root, np.array([0.0, 0.1, 0.3]))
    with pytest.raises(MotionMindError, match=r"evenly spaced in time; frame 1 is 0\.05 s off a step of 0\.15 s"):
        write_bvh(tmp_path / "a.bvh", uneven)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["", "a{b", "a\nb", " a", "# a"])
def test_names_that_bvh_cannot_hold(tmp_path: Path, name: str) -> None:
    skeleton = Skeleton("s", (name,), (-1,), np.zeros((1, 3)))
    with pytest.raises(MotionMindError, match="not a joint name that BVH can hold"):
        write_bvh(tmp_path / "a.bvh", Motion(skeleton, np.array([[[0, 0, 0, 1.0]]]), np.zeros((1, 3)), np.zeros(1)))


def test_speed_is_of_the_order_that_was_promised(tmp_path: Path) -> None:
    import time

    chain = Skeleton("chain", tuple(f"j{i}" for i in range(33)), tuple(range(-1, 32)), np.full((33, 3), 0.05))
    write_bvh(tmp_path / "a.bvh", wandering(chain, 2000, seed=3))
    start = time.process_time()
    read_bvh(tmp_path / "a.bvh", unit="cm")
    assert time.process_time() - start < 1.0  # about 0.07 s; ten times that would be a mistake


# --- properties ----------------------------------------------------------------------------------------------------


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    count = draw(st.integers(1, 8))
    parents = (-1, *(draw(st.integers(0, joint - 1)) for joint in range(1, count)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    frames = draw(st.integers(1, 5))
    offsets = rng.normal(size=(count, 3)) * (np.arange(count) > 0)[:, None]
    tips = rng.normal(size=(count, 3)) * np.array([joint not in parents for joint in range(count)])[:, None]
    skeleton = Skeleton("random", tuple(f"joint {i}" for i in range(count)), parents, offsets, tips)
    rotations = rot.normalise(rng.normal(size=(frames, count, 4)))
    return Motion(
        skeleton, rotations, rng.normal(size=(frames, 3)), np.arange(frames) / draw(st.sampled_from([1, 30, 120]))
    )


@settings(max_examples=50)
@given(motions())
def test_any_motion_reads_back(tmp_path_factory: pytest.TempPathFactory, motion: Motion) -> None:
    path = tmp_path_factory.getbasetemp() / "property.bvh"
    write_bvh(path, motion, unit="m")
    assert_same(motion, read_bvh(path, unit="m"))


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_only_our_errors_escape(tmp_path_factory: pytest.TempPathFactory, mutate: Mutate, seed: int) -> None:
    path = tmp_path_factory.getbasetemp() / "mutated.bvh"
    rng = random.Random(seed)
    for _ in range(4):
        path.write_bytes(mutate(SMALL, rng))
        with warnings.catch_warnings(), contextlib.suppress(MotionMindError):
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", MotionMindWarning)
            assert len(read_bvh(path)) >= 1


@given(st.binary(max_size=60))
def test_any_bytes(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "bytes.bvh"
    path.write_bytes(data)
    with pytest.raises(FormatError):
        read_bvh(path)


def test_a_clock_and_angles_that_nobody_means_are_told(tmp_path: Path) -> None:
    turns = rot.exp(0.3 * np.random.default_rng(0).normal(size=(20, 23, 3)))
    motion = Motion(human23(), turns, np.zeros((20, 3)), np.arange(20) / 30.0)
    write_bvh(tmp_path / "a.bvh", motion)
    text = (tmp_path / "a.bvh").read_text()
    slow = re.sub(r"Frame Time: .*", "Frame Time: 33.333", text)
    (tmp_path / "slow.bvh").write_text(slow)
    with pytest.warns(MotionMindWarning, match=r"slow\.bvh: Frame Time is 33\.333 seconds; is it in milliseconds"):
        assert read_bvh(tmp_path / "slow.bvh", unit="cm").fps == pytest.approx(1 / 33.333)
    head, _, rows = text.partition("Frame Time")
    lines = [line.split() for line in rows.splitlines()[1:]]
    turned = [[*row[:3], *(f"{np.radians(float(word)):.6f}" for word in row[3:])] for row in lines]
    (tmp_path / "radians.bvh").write_text(head + "Frame Time: 0.03\n" + "\n".join(map(" ".join, turned)))
    with pytest.warns(MotionMindWarning, match=r"no joint turns by more than .* degrees: are its angles in radians\?"):
        read_bvh(tmp_path / "radians.bvh", unit="cm")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read_bvh(tmp_path / "slow.bvh", unit="cm", fps=30.0).fps == pytest.approx(30.0)
        read_bvh(tmp_path / "a.bvh", unit="cm")
