"""Clips of glTF files by name: each comes back as it is, whatever the others are, and none is mixed with another."""

from __future__ import annotations

import base64
import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import File, wandering, with_clips

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Insertion, Motion
from motionmind.clip_names import distinct_names, find_name, read_names, split_clip
from motionmind.errors import FormatError, MotionMindWarning
from motionmind.formats import read_clips, read_motion, write_motion
from motionmind.formats.rig_files import read_rig, write_on_rig
from motionmind.geometry import rotations as rot
from motionmind.names.finding import find_motion
from motionmind.names.spelling import Moment, parse_posture

ODD = [
    "Dance",
    "Dance",
    "",
    "a#b",
    "Walk@2",
    "Run~",
    "Hip Hop",
    "a//b/",
    "x.glb#y",
    "line\nbreak",
    "  ",
    "2",
    "Dance (2)",
]
ODD += ["it's", "Arm|mixamo.com|Layer0", "\u202eevil", "n" * 500, "n" * 499 + "m", "é", "@3", "#", "-o", "2"]


def motions(count: int) -> list[Motion]:
    """Movements of different lengths."""
    return [wandering(human23(), 3 + number % 5, number) for number in range(count)]


def same(found: Motion, wanted: Motion) -> None:
    assert len(found) == len(wanted)
    assert rot.angle(found.rotations, wanted.rotations).max() < 1e-5
    np.testing.assert_allclose(found.root, wanted.root, atol=1e-5)


def quietly(path: Path | str) -> Motion:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MotionMindWarning)
        return read_motion(path)


# --- names ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(20))
def test_names_are_distinct_printable_and_those_of_the_file_as_far_as_they_can_be(seed: int) -> None:
    rng = np.random.default_rng(seed)
    words = ["a", "a (2)", "1", "2", "3", "2 (2)", "", " ", "\n", "b"]
    given = [words[one] for one in rng.integers(0, len(words), rng.integers(1, 12))]
    found = distinct_names(given)
    assert len(set(found)) == len(given)
    for number, (name, own) in enumerate(zip(found, given, strict=True)):
        assert name.strip()
        assert "\n" not in name
        assert find_name(found, name) == number
        if own.strip() and given.index(own) == number:
            assert name == own
            assert find_name(found, own) == number
        elif not own.strip() and str(number + 1) not in given:
            assert name == str(number + 1)
    numbers = [number for number in range(1, len(found) + 1) if str(number) not in found]
    assert all(find_name(found, str(number)) == number - 1 for number in numbers)
    assert find_name(found, str(len(found) + 1)) in (
        None,
        *(i for i, n in enumerate(found) if n == str(len(found) + 1)),
    )


def test_many_equal_names_are_numbered() -> None:
    found = distinct_names(["a"] * 50_000)  # in quadratic time, these would take minutes
    assert len(set(found)) == 50_000
    assert found[-1] == "a (50000)"


@pytest.mark.parametrize("suffix", ["glb", "gltf", "GLB", "vrm", "vrma"])
def test_only_paths_of_gltf_name_clips_and_an_existing_file_has_priority(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a#b.{suffix}"
    assert split_clip(path) == (path, None)
    for clip in ("Dance", "", "x/y", "b.glb#c"):
        assert split_clip(f"{path}#{clip}") == (str(path), clip)
    assert split_clip(f"{tmp_path}/a.json#1") == (f"{tmp_path}/a.json#1", None)
    longer = tmp_path / f"a#b.{suffix}#b.glb"
    path.touch()
    longer.touch()
    assert split_clip(longer) == (longer, None)
    assert split_clip(f"{longer}#c") == (str(longer), "c")


def test_every_clip_is_read_by_its_name_whatever_it_is(tmp_path: Path) -> None:
    wanted = motions(len(ODD))
    path = with_clips(tmp_path / "hero.glb", list(zip(ODD, wanted, strict=True))).write()
    names = read_names(path)
    assert names == distinct_names(ODD)
    for name, motion in zip(names, wanted, strict=True):
        found = read_motion(f"{path}#{name}")
        assert found.name == f"hero#{name}"
        same(found, motion)
        named = parse_posture(f"{path}#{name}")
        assert (named.source.place, named.source.name, named.moment, named.is_moving) == (str(path), name, None, False)
        same(find_motion(named.source), motion)
        at = parse_posture(f"{path}#{name}@2~")
        assert (at.source.name, at.moment, at.is_moving) == (name, Moment(2), True)
    listed = list(read_clips(path))
    assert [one.name for one in listed] == [f"hero#{name}" for name in names]
    for found, motion in zip(listed, wanted, strict=True):
        same(found, motion)


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ("dance", "no clip 'dance'; did you mean Dance?"),
        ("", "no clip ''; there are Dance, Kick"),
        ("3", "no clip '3'; there are Dance, Kick"),
        ("0", "no clip '0'; there are"),
        ("9" * 5_000, "no clip '99999"),
    ],
)
def test_a_missing_clip_is_told_with_those_there_are(wanted: str, said: str, tmp_path: Path) -> None:
    path = with_clips(tmp_path / "a.glb", list(zip(["Dance", "Kick"], motions(2), strict=True))).write()
    with pytest.raises(FormatError) as caught:
        read_motion(f"{path}#{wanted}")
    assert str(caught.value).startswith(f"{path}: {said}")


def test_a_file_with_one_clip_needs_no_name(tmp_path: Path) -> None:
    (wanted,) = motions(1)
    path = with_clips(tmp_path / "a.glb", [("Dance", wanted)]).write()
    assert [one.name for one in read_clips(path)] == ["a"]
    for spelling in (path, f"{path}#Dance", f"{path}#1"):
        same(read_motion(spelling), wanted)


def test_without_a_name_the_first_is_read_and_the_others_are_told(tmp_path: Path) -> None:
    wanted = motions(3)
    path = with_clips(tmp_path / "a b.glb", list(zip(["Idle", "Hip Hop", ""], wanted, strict=True))).write()
    with pytest.warns(MotionMindWarning, match=rf"read, not Hip Hop, 3; name another, as '{path}#Hip Hop'"):
        found = read_motion(path)
    same(found, wanted[0])
    assert found.name == "a b"


# --- which nodes they move ------------------------------------------------------------------------------------------


def scene(
    path: Path, clips: dict[str, dict[str, Floats]], *, is_skinned: bool, keys: dict[str, int] | None = None
) -> Path:
    """Write a body; each clip turns some of its nodes from rest to an angle and back, in the given seconds."""
    parents = {"Hips": None, "Spine": "Hips", "Arm": "Spine", "Leg": "Hips", "Foot": "Leg", "Lamp": None}
    names = list(parents)
    file = File(path, wandering(human23(), 2))
    nodes = [{"name": name, "translation": [0.1, 0.4, 0.0]} for name in names]
    for name, parent in parents.items():
        if parent:
            nodes[names.index(parent)].setdefault("children", []).append(names.index(name))  # type: ignore[attr-defined]
    animations = []
    for clip, turns in clips.items():
        samplers, channels = [], []
        for node, angles in turns.items():
            count, seconds = (keys or {}).get(node, 5), float(angles[0])
            turned = rot.from_axis_angle([1.0, 0.0, 0.0], np.linspace(0.0, angles[1], count))
            times = file.add(np.linspace(0.0, seconds, count), "SCALAR")
            target = {"node": names.index(node), "path": "rotation"}
            channels.append({"sampler": len(samplers), "target": target})
            samplers.append({"input": times, "output": file.add(turned, "VEC4")})
        animations.append({"name": clip, "samplers": samplers, "channels": channels})
    skins = [{"joints": list(range(5))}] if is_skinned else []
    file.json |= {"nodes": nodes, "animations": animations, "skins": skins, "scenes": [{"nodes": [0, 5]}]}
    return file.write()


KICK, WAVE = {"Leg": np.array([1.0, 1.2])}, {"Arm": np.array([1.5, 2.0])}


@pytest.mark.parametrize("is_skinned", [True, False])
@pytest.mark.parametrize("others", [{}, {"Lamp": np.array([2.0, 1.0])}])
def test_clips_that_move_other_nodes_for_other_times_are_two(
    is_skinned: bool, others: dict[str, Floats], tmp_path: Path
) -> None:
    clips = {"kick": KICK, "wave": WAVE} | ({"shine": others} if others else {})
    path = scene(tmp_path / "a.glb", clips, is_skinned=is_skinned)
    kick, wave = (quietly(f"{path}#{name}") for name in ("kick", "wave"))
    assert [round(one.times[-1], 6) for one in (kick, wave)] == [1.0, 1.5]
    assert kick.skeleton.difference(wave.skeleton) is None
    joints = [one.skeleton.names.index(name) for one, name in ((kick, "Leg"), (wave, "Arm"))]
    for one, joint, other, angle in ((kick, joints[0], joints[1], 1.2), (wave, joints[1], joints[0], 2.0)):
        assert rot.angle(one.rotations[-1, joint], rot.IDENTITY) == pytest.approx(angle, abs=1e-5)
        assert rot.angle(one.rotations[:, other], rot.IDENTITY).max() < 1e-6
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MotionMindWarning)
        assert [one.name for one in read_clips(path)] == ["a#kick", "a#wave"]
    same(quietly(path), kick)


@pytest.mark.parametrize("is_skinned", [True, False])
def test_what_an_exporter_split_is_one_movement_and_told(is_skinned: bool, tmp_path: Path) -> None:
    """Parts may have different keys, but last equally long; each can be read alone."""
    whole = {node: np.array([1.5, angle]) for node, angle in (("Hips", 0.3), ("Leg", 1.2), ("Arm", 2.0))}
    keys = {"Hips": 31, "Leg": 16, "Arm": 2}
    wanted = read_motion(scene(tmp_path / "whole.glb", {"all": whole}, is_skinned=is_skinned, keys=keys))
    parts = {f"part {node}": {node: turn} for node, turn in whole.items()}
    path = scene(tmp_path / "a.glb", parts, is_skinned=is_skinned, keys=keys)
    said = (
        r"a\.glb: 3 animations of one node each, equally long, are read as one movement: part Hips, part Leg, part Arm"
    )
    with pytest.warns(MotionMindWarning, match=said):
        same(read_motion(path), wanted)
    with pytest.warns(MotionMindWarning, match=said):
        (only,) = read_clips(path)
    assert only.name == "a"
    alone = quietly(f"{path}#part Leg")
    assert rot.angle(alone.rotations[:, alone.skeleton.names.index("Arm")], rot.IDENTITY).max() < 1e-6
    parts["part Arm"] = {"Arm": np.array([1.6, 2.0])}
    longer = scene(tmp_path / "b.glb", parts, is_skinned=is_skinned, keys=keys)
    assert len([quietly(f"{longer}#{name}") for name in parts]) == 3
    assert [one.name for one in read_clips(longer)] == [f"b#{name}" for name in parts]


def test_clips_of_two_bodies_without_skins_are_told_and_read_by_name(tmp_path: Path) -> None:
    path = scene(tmp_path / "a.glb", {"kick": KICK, "shine": {"Lamp": np.array([2.0, 1.0])}}, is_skinned=False)
    said = "animations of another body are not read: shine; name one to read it"
    with pytest.warns(MotionMindWarning, match=said):
        assert read_motion(path).skeleton.names == ("Leg",)
    with pytest.warns(MotionMindWarning, match=said):
        assert [one.name for one in read_clips(path)] == ["a"]
    assert read_motion(f"{path}#shine").skeleton.names == ("Lamp",)
    assert read_motion(f"{path}#kick").skeleton.names == ("Leg",)


def test_a_clip_of_other_nodes_is_refused_and_not_listed(tmp_path: Path) -> None:
    clips = {"shine": {"Lamp": np.array([2.0, 1.0])}, "kick": KICK | WAVE}
    path = scene(tmp_path / "a.glb", clips, is_skinned=True)
    same(read_motion(path), read_motion(f"{path}#kick"))
    assert [one.name for one in read_clips(path)] == ["a"]
    with pytest.raises(FormatError, match="clip 'shine' does not move the body; clips that do: kick"):
        read_motion(f"{path}#shine")


def test_poses_are_read_by_name_and_listed_as_one_frame(tmp_path: Path) -> None:
    dance = wandering(human23(), 6, 6)
    file = with_clips(tmp_path / "a.glb", [("Dance", dance), ("T", wandering(human23(), 2, 5))])
    for sampler in file.json["animations"][1]["samplers"]:
        for key in ("input", "output"):
            file.json["accessors"][sampler[key]]["count"] = 1
    file.json["animations"].reverse()
    path = file.write()
    assert [(one.name, len(one)) for one in read_clips(path)] == [("a#T", 1), ("a#Dance", 6)]
    found = read_motion(f"{path}#T")
    assert len(found) == 1
    assert rot.angle(found.rotations[0], wandering(human23(), 2, 5).rotations[0]).max() < 1e-5
    same(quietly(path), dance)


# --- one clip leaves the others alone -------------------------------------------------------------------------------


def not_finite(file: File, sampler: dict[str, Any]) -> None:
    sampler["output"] = file.add(np.full((4, 4), np.nan), "VEC4")


def beyond(file: File, sampler: dict[str, Any]) -> None:
    file.json["accessors"][sampler["output"]] |= {"count": 10**9}


def sparse(file: File, sampler: dict[str, Any]) -> None:
    file.json["accessors"][sampler["output"]]["sparse"] = {"count": 1}


def elsewhere(file: File, sampler: dict[str, Any]) -> None:
    """The numbers are in a file that is missing."""
    file.json["buffers"].append({"byteLength": 64, "uri": "missing.bin"})
    for key in ("input", "output"):
        view = file.json["accessors"][sampler[key]]["bufferView"]
        file.json["bufferViews"][view] |= {"buffer": 1, "byteOffset": 0}


@pytest.mark.parametrize("fault", [not_finite, beyond, sparse, elsewhere])
def test_reading_one_clip_reads_no_curve_of_another(fault: Any, tmp_path: Path) -> None:
    wanted = wandering(human23(), 4, 1), wandering(human23(), 4, 2)
    file = with_clips(tmp_path / "a.glb", list(zip(["Good", "Bad"], wanted, strict=True)))
    fault(file, file.json["animations"][1]["samplers"][1])
    path = file.write()
    same(read_motion(f"{path}#Good"), wanted[0])
    same(quietly(path), wanted[0])
    with pytest.raises(FormatError):
        read_motion(f"{path}#Bad")
    with pytest.raises(FormatError):
        list(read_clips(path))


def test_a_named_clip_does_without_the_clock_of_another(tmp_path: Path) -> None:
    """Whether clips are parts of one movement depends on their clocks, but not if one is named."""
    path = scene(tmp_path / "a.glb", {"kick": KICK, "wave": WAVE}, is_skinned=True)
    wanted = read_motion(f"{path}#kick")
    path.write_bytes(path.read_bytes().replace(np.float32(1.5).tobytes(), np.float32(np.nan).tobytes()))
    same(read_motion(f"{path}#kick"), wanted)
    with pytest.raises(FormatError, match="is out of range"):
        read_motion(f"{path}#wave")


@pytest.mark.parametrize("is_embedded", [True, False])
def test_text_with_its_numbers_inside_or_beside_it(is_embedded: bool, tmp_path: Path) -> None:
    wanted = motions(3)
    file = with_clips(tmp_path / "a.glb", list(zip("abc", wanted, strict=True)))
    file.write()
    inside = "data:application/octet-stream;base64," + base64.b64encode(bytes(file.data)).decode()
    (tmp_path / "a.bin").write_bytes(bytes(file.data))
    file.json["buffers"][0]["uri"] = inside if is_embedded else "a.bin"
    path = tmp_path / "text.gltf"
    path.write_text(json.dumps(file.json), "utf-8")
    assert read_names(path) == ("a", "b", "c")
    for name, motion in zip("abc", wanted, strict=True):
        same(read_motion(f"{path}#{name}"), motion)


def test_vrm_animations_have_clips_too(tmp_path: Path) -> None:
    wanted = [wandering(human23(), 4, seed) for seed in (1, 2)]
    donor = tmp_path / "one.vrma"
    for motion, name in zip(wanted, ("one", "two"), strict=True):
        write_motion(tmp_path / f"{name}.vrma", motion)
    path = with_clips(tmp_path / "a.vrma", list(zip(["Nod", "Bow"], wanted, strict=True))).write()
    assert [one.name for one in read_clips(path)] == ["a#Nod", "a#Bow"]
    for name, file in (("Nod", donor), ("Bow", tmp_path / "two.vrma")):
        same(read_motion(f"{path}#{name}"), read_motion(file))


# --- rigs, and what is kept in the file -----------------------------------------------------------------------------


def test_marks_belong_to_the_movement_that_was_written(tmp_path: Path) -> None:
    path = with_clips(tmp_path / "hero.glb", list(zip(["Idle", "Dance"], motions(2), strict=True))).write()
    rig = read_rig(f"{path}#Dance", (0, 3))
    own = read_motion(f"{path}#Dance")
    made = wandering(human23(), 5, 9)
    made = Motion(
        own.skeleton, made.rotations, made.root, made.times, "between", (Insertion(made.times[1:3]),), keyframed=True
    )
    write_on_rig(tmp_path / "out.glb", made, rig)
    found = {name: quietly(f"{tmp_path / 'out.glb'}#{name}") for name in ("between", "Idle", "Dance")}
    assert [len(one.insertions) for one in found.values()] == [1, 0, 0]
    assert [one.keyframed for one in found.values()] == [True, False, False]
    same(found["Dance"], motions(2)[1])


def test_a_rig_has_the_ends_of_the_named_clip(tmp_path: Path) -> None:
    wanted = motions(3)
    path = with_clips(tmp_path / "hero.glb", list(zip("abc", wanted, strict=True))).write()
    for name, motion in zip("abc", wanted, strict=True):
        pose = read_rig(f"{path}#{name}", (1, len(motion) - 1)).armature.ends
        assert rot.angle(pose.rotations[:, -23:], motion.rotations[[1, -1]]).max() < 1e-5


# --- hostile --------------------------------------------------------------------------------------------------------


def test_a_small_file_of_many_clips_is_refused_soon(tmp_path: Path) -> None:
    """Thousands of animations share the numbers of one."""
    file = with_clips(tmp_path / "a.glb", [("a", wandering(human23(), 200))])
    file.json["animations"] = file.json["animations"] * 1_000
    path = file.write()
    with pytest.raises(FormatError, match="its 1000 clips are too long to be read together: name those to read"):
        next(read_clips(path))  # before the first is read
    assert len(read_motion(f"{path}#999")) == 200
