"""From any format to any other with the command line; and what a format has no place for is said, and nothing else."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from command_line import Run

from motionmind.body.human import human23, human44
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.formats import lossy_fields, read_motion, write_motion
from motionmind.formats._smpl import smpl_bodies
from motionmind.formats.bvh import read_bvh
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import to_human23

SUFFIXES = ["json", "bvh", "txt", "npz"]


@pytest.fixture
def convert(run: Run) -> Run:
    """Runs `motionmind convert` in a folder of its own."""
    return partial(run, "convert")


def moving(skeleton: Skeleton, frames: int = 8, seed: int = 0) -> Motion:
    """Random postures, 20 a second; the body's lowest point touches the floor, where the papers' notation puts it."""
    rng = np.random.default_rng(seed)
    rotations = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    root = np.zeros((frames, 3))
    root[:, 1] = -skeleton.positions_and_tips(rotations, root)[..., 1].min(axis=-1)
    return Motion(skeleton, rotations, root, np.arange(frames) / 20.0, name="in")


def taller(skeleton: Skeleton) -> Skeleton:
    return Skeleton(skeleton.name, skeleton.names, skeleton.parents, skeleton.offsets * 1.1, skeleton.tips * 1.1)


# --- size -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("suffix", "unit", "said"),
    [
        ("bvh", "m", "170 m tall; the unit seems wrong (--unit gives another)"),
        ("bvh", "mm", "0.17 m tall; the unit seems wrong"),
        ("glb", "cm", "0.017 m tall; the unit seems wrong"),
        ("bvh", "cm", ""),
        ("glb", None, ""),
    ],
)
def test_people_of_no_persons_height(suffix: str, unit: str | None, said: str, convert: Run) -> None:
    write_motion(f"in.{suffix}", moving(human23()))
    ran = convert(f"in.{suffix}", "out.json", *(("--unit", unit) if unit else ()))
    assert ran.code == 0
    assert (f"in.{suffix}: a person {said}" in ran.err) if said else ("a person" not in ran.err)


def test_people_whose_asf_file_states_another_unit(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    names = ["femur", "tibia", "foot", "humerus", "radius", "hand"]
    bones = {"thorax": "0 1 0", "head": "0 1 0"} | {f"{side}{name}": "0 -1 0" for side in "lr" for name in names}
    lines = [
        ":version 1.10",
        ":name lost",
        ":units",
        "  length 1.0",
        "  angle deg",
        ":root",
        "  order TX TY TZ RX RY RZ",
    ]
    lines += ["  axis XYZ", "  position 0 0 0", "  orientation 0 0 0", ":bonedata"]
    for bone, direction in bones.items():
        lines += ["  begin", f"    name {bone}", f"    direction {direction}", "    length 0.4", "    axis 0 0 0 XYZ"]
        lines += ["    dof rx", "    limits (-180 180)", "  end"]
    lines += [":hierarchy", "  begin", "    root thorax lfemur rfemur", "    thorax head lhumerus rhumerus"]
    for side in "lr":
        lines += [f"    {side}{upper} {side}{lower}" for upper, lower in pairwise(names) if lower != "humerus"]
    (tmp_path / "a.asf").write_text("\n".join([*lines, "  end", ""]))
    frame = [f"{bone} 0" for bone in bones]
    (tmp_path / "a.amc").write_text("\n".join([":FULLY-SPECIFIED", ":DEGREES", "1", "root 0 0 0 0 0 0", *frame, ""]))
    read_motion(tmp_path / "a.amc")
    assert [str(one.message) for one in recwarn] == [
        f"{tmp_path / 'a.amc'}: a person 0.0414 m tall; the unit seems wrong (its ASF file states it)"
    ]


def test_other_bodies_may_have_any_size(convert: Run) -> None:
    insect = Skeleton("insect", ("body", "leg"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 0.002, 0.0]]))
    write_motion("in.bvh", moving(insect))
    assert "a person" not in convert("in.bvh", "out.json", "--unit", "cm").err


# --- formats --------------------------------------------------------------------------------------------------------


def test_the_joints_that_are_told_are_those_in_the_file(convert: Run) -> None:
    write_motion("in.json", moving(human44()))
    for suffix in ("npz", "vrma", "glb", "bvh"):
        ran = convert("in.json", f"out.{suffix}")
        assert f" {len(read_motion(f'out.{suffix}').skeleton)} joints (" in ran.out


@pytest.mark.parametrize("source", SUFFIXES)
@pytest.mark.parametrize("target", [*SUFFIXES, "glb"])
def test_a_body_of_known_size_moves_alike_in_all(source: str, target: str, convert: Run) -> None:
    motion = moving(human23())
    write_motion(f"in.{source}", motion)
    ran = convert(f"in.{source}", f"out.{target}", "--source-fps", 20)
    assert ran.code == 0
    assert re.fullmatch(rf"out\.{target}: 8 frames, (23|52) joints \(.*\)\n", ran.out)
    if target == "npz":
        assert ran.out == "out.npz: 8 frames, 52 joints (SMPL+H)\n"
    if target != "glb":  # of which tests/test_glb.py reads what is in it
        again = to_human23(read_motion(f"out.{target}", fps=20))
        assert rot.angle(again.rotations, motion.rotations).max() < 1e-5
        np.testing.assert_allclose(again.root, motion.root, atol=1e-5)
        np.testing.assert_allclose(again.times, motion.times, atol=1e-6)


@pytest.mark.parametrize("target", ["json", "bvh", "npz"])
def test_frames_a_second(target: str, convert: Run) -> None:
    write_motion("in.json", replace(moving(human23()), times=np.array([0, 0.1, 0.15, 0.3, 0.4, 0.5, 0.6, 0.7])))
    assert convert("in.json", f"out.{target}", "--fps", 10).out.startswith(f"out.{target}: 8 frames")
    assert read_motion(f"out.{target}").fps == pytest.approx(10.0)


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("in", 0.0254), ("0.5", 0.5), (None, 0.01)])
def test_units(unit: str | None, metres: float, convert: Run) -> None:
    motion = moving(human23())
    write_motion("in.json", motion)
    assert convert("in.json", "a.bvh", *(["--out-unit", unit] if unit else [])).code == 0
    np.testing.assert_allclose(read_bvh("a.bvh", unit=1.0).root * metres, motion.root, atol=1e-6)
    assert convert("a.bvh", "b.bvh", "--unit", metres, "--out-unit", "mm").code == 0
    np.testing.assert_allclose(read_bvh("b.bvh", unit=1.0).root * 0.001, motion.root, atol=1e-6)


@pytest.mark.parametrize(
    ("unit", "rate", "said"),
    [
        ("cm", 20, "set Scale to 0.01 and tick Update Scene FPS"),
        ("m", 20, "tick Update Scene FPS"),
        ("in", 24, "set Scale to 0.0254"),
        ("m", 24, ""),
    ],
)
def test_settings_of_blenders_import(unit: str, rate: int, said: str, convert: Run) -> None:
    write_motion("in.json", moving(human23()))
    ran = convert("in.json", "a.bvh", "--out-unit", unit, "--fps", rate)
    remedy = "(or write it with --for blender)"
    assert ran.err == (f"note: a.bvh: in Blender's import, {said} {remedy}\n" if said else "")


@pytest.mark.parametrize(("program", "metres"), [("blender", 1.0), ("maya", 0.01)])
def test_bvh_for_a_program(program: str, metres: float, convert: Run) -> None:
    motion = moving(human23())
    write_motion("in.json", motion)
    ran = convert("in.json", "a.bvh", "--for", program)
    assert (ran.code, ran.err) == (0, "")
    again = read_bvh("a.bvh", unit=1.0)
    assert again.fps == pytest.approx(24.0)
    np.testing.assert_allclose(again.root * metres, motion.stretch_to(24.0).root, atol=1e-6)
    np.testing.assert_allclose(again.root[-1] * metres, motion.root[-1], atol=1e-6)
    assert convert("in.json", "b.bvh", "--for", program, "--fps", 10, "--out-unit", "in").code == 0
    assert read_bvh("b.bvh").fps == pytest.approx(10.0)
    np.testing.assert_allclose(read_bvh("b.bvh", unit="in").root[0], motion.root[0], atol=1e-6)


def test_the_format_to_take_instead(convert: Run) -> None:
    write_motion("in.json", moving(human23()))
    assert (
        "a.bvh: not for Unreal Engine: it reads no BVH: write .glb"
        in convert("in.json", "a.bvh", "--for", "unreal").err
    )
    assert "a.glb: not for Maya: it reads no glTF: write .bvh" in convert("in.json", "a.glb", "--for", "maya").err
    refused = convert("in.json", "a.npz", "--for", "blender")
    assert (refused.code, refused.err) == (2, "error: a.npz: not for Blender: it reads .bvh and .glb\n")
    assert [path.name for path in Path().iterdir()] == ["in.json"]


def test_units_that_cannot_be(convert: Run) -> None:
    write_motion("in.json", moving(human23()))
    assert "--out-unit mm: only BVH needs a unit" in convert("in.json", "a.glb", "--out-unit", "mm").err
    assert "unit 'furlong' is unknown" in convert("in.json", "a.bvh", "--out-unit", "furlong").err
    assert [path.name for path in Path().iterdir()] == ["in.json"]


# --- what has no place ----------------------------------------------------------------------------------------------


def inserted(motion: Motion) -> Motion:
    """The frames from 2 to 6 are the engine's, but for the first and the last of them; two joints are bridged."""
    times = motion.times[[2, 4, 6]]
    return replace(motion, insertions=(Insertion(times, (("left_hip", 0), ("right_knee", 1))),))


@pytest.mark.parametrize("body", [human23(), human44(), *smpl_bodies().values()])
def test_of_what_a_format_holds_nothing_is_said(body: Skeleton) -> None:
    motion = moving(body)
    assert lossy_fields(motion, "a.json") == lossy_fields(motion, "a.glb") == []
    inner = any(body.children(joint) and body.tips[joint].any() for joint in range(len(body)))
    assert bool(lossy_fields(motion, "a.bvh")) == inner
    assert lossy_fields(motion, "a.npz") == [] or body.name == "human44"
    assert lossy_fields(replace(motion, name="another"), "a.JSON") == []


@pytest.mark.parametrize("suffix", ["bvh", "npz", "txt"])
def test_what_the_engine_made(suffix: str) -> None:
    given = lossy_fields(moving(human23()), f"a.{suffix}")
    assert lossy_fields(inserted(moving(human23())), f"a.{suffix}") == [
        *given,
        "the marks of frames that the engine made (3)",
        "the marks of joints that it bridged (left_hip, right_knee)",
    ]


def test_json_holds_it_all(tmp_path: Path) -> None:
    motion = inserted(moving(taller(human44())))
    late = replace(motion, times=motion.times + 3.0, insertions=())
    for one in (motion, late):
        assert lossy_fields(one, "a.json") == []
        write_motion(tmp_path / "a.json", one)
        again = read_motion(tmp_path / "a.json")
        assert again.skeleton == one.skeleton
        assert (again.name, len(again.insertions)) == (one.name, len(one.insertions))
        np.testing.assert_array_equal(again.inserted(), one.inserted())
        np.testing.assert_array_equal(again.bridged(), one.bridged())
        np.testing.assert_allclose(again.times, one.times, atol=1e-9)


@pytest.mark.parametrize("suffix", ["bvh", "npz"])
def test_when_it_begins(suffix: str, tmp_path: Path) -> None:
    motion = replace(moving(human23()), times=3.5 + np.arange(8) / 20.0)
    write_motion(tmp_path / f"a.{suffix}", motion)
    assert read_motion(tmp_path / f"a.{suffix}").times[0] == 0.0
    for other in (suffix, "glb"):
        assert lossy_fields(motion, f"a.{other}") == ["the time when it begins, 3.5 s"]


@pytest.mark.parametrize("suffix", ["txt", "npz"])
def test_proportions(suffix: str, tmp_path: Path) -> None:
    motion = moving(taller(human23()))
    assert "the body's proportions" in lossy_fields(motion, f"a.{suffix}")
    assert "the body's proportions" not in lossy_fields(moving(human23()), f"a.{suffix}")
    write_motion(tmp_path / f"a.{suffix}", motion)
    assert to_human23(read_motion(tmp_path / f"a.{suffix}")).skeleton == human23()


def test_the_papers_know_no_places_and_no_uneven_times() -> None:
    motion = moving(human23())
    assert lossy_fields(motion, "a.txt") == ["where the body is"]
    assert lossy_fields(replace(motion, times=motion.times**2), "a.txt") == ["times", "where the body is"]
    assert lossy_fields(motion.posture(3).as_motion(), "a.txt") == ["where the body is"]


def test_far_ends_in_the_middle_of_a_limb(tmp_path: Path) -> None:
    """An insect's head has a far end, and feelers."""
    offsets = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1], [0.02, 0.0, 0.05]])
    tips = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.04], [0.0, 0.05, 0.0]])
    motion = moving(Skeleton("ant", ("thorax", "head", "feeler"), (-1, 0, 1), offsets, tips))
    assert lossy_fields(motion, "a.bvh") == ["the tips of joints with children (head)"]
    write_motion(tmp_path / "a.bvh", motion)
    again = read_bvh(tmp_path / "a.bvh", unit="cm").skeleton
    np.testing.assert_allclose(again.tips[[0, 2]], tips[[0, 2]], atol=1e-6)
    assert not again.tips[1].any()


def test_joints_that_smpl_lacks() -> None:
    (said,) = lossy_fields(moving(human44()), "a.npz")
    assert re.fullmatch(r"the turns of joints that SMPL does not have \(left_toes_middle, .* and 2 more\)", said)


def test_the_command_says_it(convert: Run, shared_data: Path) -> None:
    write_motion("in.json", inserted(moving(human23())))
    said = "the marks of frames that the engine made (3); the marks of joints that it bridged (left_hip, right_knee)\n"
    assert f"note: a.bvh: no place for {said}" in convert("in.json", "a.bvh").err
    assert convert("in.json", "b.json").err == ""
    assert convert("a.bvh", "c.npz", "--unit", "cm").err == ""
    recording = shared_data / "cmu-05" / "05_02.bvh"
    assert "no place for the body's proportions; the turns of joints" in convert(recording, "d.npz").err
