"""glTF in: movement comes back from every way that the format has to hold it, and nothing else does."""

from __future__ import annotations

import base64
import json
import logging
import re
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from gltf_files import MIXAMO, RATE, File, reframed, wandering

from motionmind.body.human import human23, human44
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.formats import read_motion, write_motion
from motionmind.formats.gltf import read_gltf
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import own_skeleton, to_human23


@pytest.fixture
def file(tmp_path: Path) -> File:
    return File(tmp_path / "a.glb", wandering(human23()))


def same_movement(found: Motion, wanted: Motion, *, atol: float = 1e-6) -> None:
    assert found.skeleton.difference(wanted.skeleton) is None
    np.testing.assert_allclose(found.times, wanted.times - wanted.times[0], atol=1e-6)
    assert rot.angle(found.rotations, wanted.rotations).max() < atol
    np.testing.assert_allclose(found.root, wanted.root, atol=atol)
    np.testing.assert_allclose(found.skeleton.offsets, wanted.skeleton.offsets, atol=atol)


# --- what MotionMind writes -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("frames", [1, 2, 9])
@pytest.mark.parametrize(
    "body", [human23(), human44(), Skeleton("two", ("a", "b"), (-1, 0), np.eye(3)[[0, 1]] * [[0.0], [0.3]])]
)
def test_what_was_written_is_read(body: Skeleton, frames: int, tmp_path: Path) -> None:
    tall = replace(body, offsets=body.offsets * 1.1, tips=body.tips * 1.2)
    motion = wandering(tall, frames)
    write_motion(tmp_path / "a.glb", motion)
    found = read_motion(tmp_path / "a.glb")
    same_movement(found, motion)
    np.testing.assert_allclose(found.skeleton.tips, tall.tips, atol=1e-9)
    assert (found.name, found.skeleton.name) == ("a", body.name)


def test_marks_come_back(tmp_path: Path) -> None:
    motion = replace(wandering(human23()), times=3.0 + np.arange(8) / RATE)
    marked = replace(motion, insertions=(Insertion(motion.times[[2, 4, 6]], (("left_hip", 1),)),), keyframed=True)
    write_motion(tmp_path / "a.glb", marked)
    found = read_motion(tmp_path / "a.glb")
    np.testing.assert_array_equal(found.inserted(), marked.inserted())
    np.testing.assert_array_equal(found.bridged(), marked.bridged())
    assert found.keyframed


def test_movement_that_stands_still(tmp_path: Path) -> None:
    still = wandering(human23(), 5)
    still = replace(
        still, rotations=np.repeat(still.rotations[:1], 5, axis=0), root=np.repeat(still.root[:1], 5, axis=0)
    )
    write_motion(tmp_path / "a.glb", still)
    same_movement(read_motion(tmp_path / "a.glb"), still)


# --- ways to hold numbers -------------------------------------------------------------------------------------------


def test_text_with_buffers_beside_it_and_in_it(file: File, tmp_path: Path) -> None:
    wanted = read_gltf(file.write())
    data = bytes(file.data)
    (tmp_path / "some data.bin").write_bytes(data)
    for uri in ("some%20data.bin", "data:application/octet-stream;base64," + base64.b64encode(data).decode()):
        file.json["buffers"][0]["uri"] = uri
        (tmp_path / "a.gltf").write_text(json.dumps(file.json))
        same_movement(read_motion(tmp_path / "a.gltf"), wanted)


@pytest.mark.parametrize(
    ("uri", "said"),
    [
        ("../secret.bin", "it must be in this file's folder or below"),
        ("/etc/passwd", "it must be in this file's folder or below"),
        ("https://example.org/a.bin", "it must be in this file's folder or below"),
        ("missing.bin", "missing.bin: cannot be read"),
        ("data:;base64,???", "a data URI is not base64"),
    ],
)
def test_buffers_from_elsewhere_are_refused(file: File, uri: str, said: str) -> None:
    file.json["buffers"][0]["uri"] = uri
    with pytest.raises(FormatError, match=re.escape(said)):
        read_gltf(file.write())


@pytest.mark.parametrize(("dtype", "atol"), [("<i1", 0.05), ("<i2", 2e-4)])
def test_quantised_rotations(file: File, dtype: str, atol: float) -> None:
    wanted = read_gltf(file.write())
    for sampler in file.samplers[1:]:
        sampler["output"] = file.add(file.array(sampler["output"]), "VEC4", dtype)
    same_movement(read_gltf(file.write()), wanted, atol=atol)


def test_numbers_that_are_interleaved(file: File) -> None:
    wanted = read_gltf(file.write())
    for sampler in file.samplers[1:]:
        sampler["output"] = file.add(file.array(sampler["output"]), "VEC4", stride=20)
    same_movement(read_gltf(file.write()), wanted)


# --- ways to move ---------------------------------------------------------------------------------------------------


def test_a_curve_is_followed(file: File) -> None:
    # x = t^3 between keys at 0 and 1 s: values 0 and 1, slopes 0 and 3 (3.11, appendix C).
    file.samplers[0] |= {
        "input": file.add(np.array([0.0, 1.0]), "SCALAR"),
        "output": file.add(np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [3, 0, 0], [1, 0, 0], [0, 0, 0]], float), "VEC3"),
        "interpolation": "CUBICSPLINE",
    }
    found = read_gltf(file.write())
    np.testing.assert_allclose(found.root[:, 0], found.times**3, atol=1e-6)
    assert (found.fps, found.times[-1]) == (pytest.approx(RATE), 1.0)


def test_jumps(file: File) -> None:
    times = np.array([0.0, 0.5, 1.0])
    file.samplers[0] |= {
        "input": file.add(times, "SCALAR"),
        "output": file.add(np.array([[1, 0, 0], [2, 0, 0], [3, 0, 0]], float), "VEC3"),
        "interpolation": "STEP",
    }
    found = read_gltf(file.write())
    np.testing.assert_array_equal(
        found.root[:, 0], np.where(found.times < 0.5, 1.0, np.where(found.times < 1.0, 2.0, 3.0))
    )


def test_keys_that_say_nothing_may_be_left_out(file: File) -> None:
    """As exporters leave out keys in the middle of what does not move: the clock is that of the others."""
    wanted = read_gltf(file.write())
    keys = file.array(file.samplers[3]["output"])
    keys[:] = keys[0]
    file.samplers[3]["output"] = file.add(keys, "VEC4")
    still = read_gltf(file.write())
    file.samplers[3] |= {"input": file.add(wanted.times[[0, -1]], "SCALAR"), "output": file.add(keys[[0, -1]], "VEC4")}
    same_movement(read_gltf(file.write()), still)


def test_uneven_keys_stay_where_they_are(tmp_path: Path) -> None:
    motion = replace(wandering(human23()), times=np.array([0.0, 0.1, 0.25, 0.7, 0.8, 1.5, 1.6, 2.0]))
    write_motion(tmp_path / "a.glb", motion)
    same_movement(read_motion(tmp_path / "a.glb"), motion)


# --- ways to build a body -------------------------------------------------------------------------------------------


def test_frames_of_bones_do_not_count(file: File) -> None:
    wanted = read_gltf(file.write())
    reframed(file)
    same_movement(read_gltf(file.write()), wanted, atol=1e-5)


def test_the_rest_pose_is_the_one_that_was_bound(file: File) -> None:
    """The nodes stand in the first posture, as where somebody exports an animation that is being edited."""
    wanted = read_gltf(file.write())
    reframed(file)
    for sampler, channel in zip(file.samplers, file.json["animations"][0]["channels"], strict=True):
        target = file.json["nodes"][channel["target"]["node"]]
        target[channel["target"]["path"]] = file.array(sampler["output"])[0].tolist()
    same_movement(read_gltf(file.write()), wanted, atol=1e-5)


@pytest.mark.parametrize("given", ["trs", "matrix"])
def test_the_body_hangs_from_something_turned_and_small(given: str, file: File) -> None:
    """As exports from a world with z up, in centimetres, are: one node above the body rights it."""
    wanted = read_gltf(file.write())
    turn = rot.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 2)
    nodes = file.json["nodes"]
    nodes[0]["translation"] = (100.0 * rot.mul_vec(rot.inv(turn), np.array(nodes[0]["translation"]))).tolist()
    nodes[0]["rotation"] = rot.inv(turn).tolist()
    for node in nodes[1:-1]:
        node["translation"] = [100.0 * number for number in node["translation"]]
    keys = file.array(file.samplers[1]["output"])
    file.samplers[0]["output"] = file.add(
        100.0 * rot.mul_vec(rot.inv(turn), file.array(file.samplers[0]["output"])), "VEC3"
    )
    file.samplers[1]["output"] = file.add(rot.mul(rot.inv(turn), keys), "VEC4")
    matrix = np.diag([0.01, 0.01, 0.01, 1.0])
    matrix[:3, :3] = 0.01 * rot.to_matrix(turn)
    held = {"rotation": turn.tolist(), "scale": [0.01] * 3} if given == "trs" else {"matrix": matrix.T.ravel().tolist()}
    nodes.append({"name": "Armature", "children": [0], **held})
    file.json["scenes"][0]["nodes"] = [len(nodes) - 1, len(nodes) - 2]
    del file.json["skins"][0]["inverseBindMatrices"]
    same_movement(read_gltf(file.write()), wanted, atol=1e-5)


def test_a_body_that_was_turned_about_the_vertical(file: File) -> None:
    wanted = read_gltf(file.write())
    turn = rot.about_vertical(1.0)
    file.json["nodes"].append({"name": "Armature", "children": [0], "rotation": turn.tolist()})
    file.json["scenes"][0]["nodes"] = [len(file.json["nodes"]) - 1]
    found = own_skeleton(read_gltf(file.write()))
    assert rot.angle(found.rotations[:, 1:], wanted.rotations[:, 1:]).max() < 1e-6
    assert rot.angle(found.rotations[:, 0], rot.mul(turn, wanted.rotations[:, 0])).max() < 1e-6
    np.testing.assert_allclose(found.root, rot.mul_vec(turn, wanted.root), atol=1e-6)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_inverse_bind_matrices_of_zeros(file: File, share: float, caplog: pytest.LogCaptureFixture) -> None:
    reframed(file)
    wanted = read_gltf(file.write())
    skin = file.json["skins"][0]
    binds = file.array(skin["inverseBindMatrices"])
    binds[: int(np.ceil(share * len(binds)))] = 0.0
    skin["inverseBindMatrices"] = file.add(binds, "MAT4")
    with caplog.at_level(logging.INFO, "motionmind.formats._gltf_poses"):
        found = read_gltf(file.write())
    same_movement(found, wanted)
    assert [record.message for record in caplog.records if "matrices are zero" in record.message]


@pytest.mark.parametrize("axes", [(0.0, 1.0, 1.0), (-1.0, 1.0, 1.0)])
def test_inverse_bind_matrices_that_flatten_or_mirror(file: File, axes: tuple[float, float, float]) -> None:
    skin = file.json["skins"][0]
    binds = file.array(skin["inverseBindMatrices"])
    binds[3] = np.diag([*axes, 1.0]).ravel()
    skin["inverseBindMatrices"] = file.add(binds, "MAT4")
    with pytest.raises(FormatError, match="a matrix mirrors, or has no volume"):
        read_gltf(file.write())


def test_an_armature_without_a_mesh(file: File) -> None:
    wanted = read_gltf(file.write())
    del file.json["skins"], file.json["meshes"]
    file.json["nodes"].pop()
    file.json["scenes"][0]["nodes"] = [0]
    same_movement(read_gltf(file.write()), wanted)


@pytest.mark.parametrize("along_bones", [False, True])
def test_nodes_without_a_skin_that_stand_as_in_a_frame(along_bones: bool, file: File) -> None:
    """As exporters leave them that write no mesh: where no rotations stand at rest, that is the rest pose."""
    file = File(file.path, ballet_clip("adagio").resample(RATE).slice(30, 150))
    wanted = read_gltf(file.write())
    for node in file.json["nodes"]:
        node["name"] = MIXAMO.get(node["name"], node["name"])
    if along_bones:
        reframed(file)
    del file.json["skins"], file.json["meshes"]
    file.json["nodes"].pop()
    file.json["scenes"][0]["nodes"] = [0]
    for sampler, channel in zip(file.samplers, file.json["animations"][0]["channels"], strict=True):
        target = file.json["nodes"][channel["target"]["node"]]
        target[channel["target"]["path"]] = file.array(sampler["output"])[0].tolist()
    if not along_bones:
        same_movement(to_human23(read_gltf(file.write())), wanted, atol=1e-5)
        return
    with pytest.warns(MotionMindWarning, match="neither a skin nor the nodes show the rest pose"):
        found = to_human23(read_gltf(file.write()))
    np.testing.assert_allclose(found.positions(), wanted.positions(), atol=1e-5)
    legs = [0, *(human23().index(f"{side}_{joint}") for side in ("left", "right") for joint in ("hip", "knee"))]
    turned, meant = (one.skeleton.global_rotations(one.rotations)[:, legs] for one in (found, wanted))
    assert np.median(np.degrees(rot.angle(turned, meant)), axis=0).max() < 12.0


def test_a_bone_on_the_floor_that_everything_hangs_from(tmp_path: Path) -> None:
    from motionmind.formats.glb import write_glb

    wanted = wandering(human23())
    write_glb(tmp_path / "a.glb", wanted, has_root=True)
    same_movement(read_gltf(tmp_path / "a.glb"), wanted)


@pytest.mark.parametrize("extension", ["VRMC_vrm", "VRM", "VRMC_vrm_animation"])
def test_bones_that_vrm_names(extension: str, file: File) -> None:
    file = File(file.path, ballet_clip("adagio").resample(RATE).slice(0, 20))
    wanted = read_gltf(file.write())
    bones = {"pelvis": "hips", "lumbar": "spine", "thorax": "chest", "cervical": "neck", "atlantal": "head"}
    for side in ("left", "right"):
        limbs = (
            "hip knee ankle toes clavicle shoulder elbow wrist",
            "UpperLeg LowerLeg Foot Toes Shoulder UpperArm LowerArm Hand",
        )
        pairs = zip(*(words.split() for words in limbs), strict=True)
        bones |= {f"{side}_{joint}": side + bone for joint, bone in pairs}
    nodes = file.json["nodes"]
    numbered = {bones[node["name"]]: number for number, node in enumerate(nodes) if node["name"] in bones}
    for number, node in enumerate(nodes):
        node["name"] = f"Bone.{number:03}"
    rows = [{"bone": name, "node": number} for name, number in numbered.items()]
    by_name = {name: {"node": number} for name, number in numbered.items()}
    file.json["extensions"] = {extension: {"humanoid": {"humanBones": rows if extension == "VRM" else by_name}}}
    found = to_human23(read_gltf(file.write()))
    kept = [i for i, name in enumerate(human23().names) if not name.endswith("fingers")]
    assert rot.angle(found.rotations[:, kept], to_human23(wanted).rotations[:, kept]).max() < 1e-5
    here = found.skeleton.positions(found.rotations, found.root)[:, kept]
    np.testing.assert_allclose(here, wanted.skeleton.positions(wanted.rotations, wanted.root)[:, kept], atol=1e-5)


@pytest.mark.parametrize("name", ["adagio", "developpe"])
def test_vrm_animations_come_back(name: str, tmp_path: Path) -> None:
    motion = ballet_clip("adagio").resample(30.0) if name == "adagio" else wandering(human23())
    write_motion(tmp_path / "a.vrma", motion)
    found = to_human23(read_motion(tmp_path / "a.vrma"))
    same_movement(found, to_human23(motion), atol=1e-5)
    document = File.__new__(File)
    data = (tmp_path / "a.vrma").read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document.json = json.loads(data[20 : 20 + length])
    extension = document.json["extensions"]["VRMC_vrm_animation"]
    bones = {bone: row["node"] for bone, row in extension["humanoid"]["humanBones"].items()}
    required = ["hips", "spine", "head"]  # VRMC_vrm-1.0, humanoid
    required += [side + bone for side in ("left", "right") for bone in ("UpperLeg", "LowerLeg", "Foot")]
    required += [side + bone for side in ("left", "right") for bone in ("UpperArm", "LowerArm", "Hand")]
    assert (extension["specVersion"], set(required) - set(bones)) == ("1.0", set())
    assert all(document.json["nodes"][node]["name"] == bone for bone, node in bones.items())
    moved = {
        c["target"]["node"] for c in document.json["animations"][0]["channels"] if c["target"]["path"] != "rotation"
    }
    assert moved == {bones["hips"]}


def test_a_posture_is_no_animation(tmp_path: Path) -> None:
    with pytest.raises(MotionMindError, match="a VRM animation needs two frames at least"):
        write_motion(tmp_path / "a.vrma", wandering(human23(), 1))


def test_others_are_named(file: File) -> None:
    file.json["animations"] = [file.json["animations"][0], file.json["animations"][0] | {"name": "wave"}]
    path = file.write()
    with pytest.warns(MotionMindWarning, match=f"the first animation that moves is read, not wave; .* '{path}#wave'"):
        read_gltf(path)


def test_a_pose_before_the_movement_is_not_read(file: File) -> None:
    wanted = read_gltf(file.write())
    still = {"input": file.add(np.zeros(1), "SCALAR"), "output": file.add(np.array([[0.0, 0.0, 0.0, 1.0]]), "VEC4")}
    channels = [{"sampler": 0, "target": {"node": 3, "path": "rotation"}}]
    file.json["animations"].insert(0, {"name": "T", "samplers": [still], "channels": channels})
    with pytest.warns(MotionMindWarning, match="the first animation that moves is read, not T"):
        same_movement(read_gltf(file.write()), wanted)


def test_an_animation_for_each_bone_is_one_movement(file: File) -> None:
    wanted = read_gltf(file.write())
    (whole,) = file.json["animations"]
    file.json["animations"] = [
        {"samplers": [whole["samplers"][one["sampler"]]], "channels": [one | {"sampler": 0}]}
        for one in whole["channels"]
    ]
    with pytest.warns(MotionMindWarning, match="24 animations of one node each, equally long, are read as one"):
        same_movement(read_gltf(file.write()), wanted)


# --- what cannot be read --------------------------------------------------------------------------------------------


def sparse(file: File) -> None:
    file.json["accessors"][file.samplers[1]["output"]]["sparse"] = {"count": 1}


def compressed(file: File) -> None:
    accessor = file.json["accessors"][file.samplers[1]["output"]]
    file.json["bufferViews"][accessor["bufferView"]]["extensions"] = {"EXT_meshopt_compression": {}}


def beyond(file: File) -> None:
    file.json["accessors"][file.samplers[1]["output"]]["count"] = 10**12


def not_increasing(file: File) -> None:
    file.samplers[1]["input"] = file.add(np.zeros(8), "SCALAR")


def not_finite(file: File) -> None:
    file.samplers[0]["output"] = file.add(np.full((8, 3), np.nan), "VEC3")


def in_a_circle(file: File) -> None:
    file.json["nodes"][3]["children"] = [1]


def of_two(file: File) -> None:
    file.json["nodes"][4]["children"] = [2]


def mirrored(file: File) -> None:
    file.json["nodes"][0]["scale"] = [-1.0, 1.0, 1.0]


def no_such_joint(file: File) -> None:
    file.json["skins"][0]["joints"][3] = 1000


def nothing(file: File) -> None:
    file.json |= {"skins": [], "animations": []}


def too_long(file: File) -> None:
    file.samplers[0] |= {
        "input": file.add(np.array([0.0, 1e-4, 1e9]), "SCALAR"),
        "output": file.add(np.zeros((3, 3)), "VEC3"),
        "interpolation": "STEP",
    }


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (sparse, "is sparse, which cannot be read"),
        (compressed, r"compressed \(EXT_meshopt_compression\), which cannot be read"),
        (beyond, "lies outside its data"),
        (not_increasing, "its times do not increase"),
        (not_finite, "accessor .* is out of range"),
        (in_a_circle, "hangs from itself|hangs from both"),
        (of_two, "node 2 hangs from both node 1 and node 4"),
        (mirrored, "a scale that mirrors or flattens it"),
        (no_such_joint, "skin 0: joint 1000 does not exist: the file has 24"),
        (nothing, "nothing moves: there is no skin"),
        (too_long, "more than can be made at once"),
    ],
)
def test_what_cannot_be_read(change: Callable[[File], None], said: str, file: File) -> None:
    change(file)
    with pytest.raises(MotionMindError, match=said):
        read_gltf(file.write())


@pytest.mark.parametrize("cut", [3, 11, 19, 40, 2000, -5])
def test_cut_short(cut: int, file: File) -> None:
    file.path.write_bytes(file.path.read_bytes()[:cut])
    with pytest.raises(FormatError, match=r"a\.glb(:1)?: "):
        read_gltf(file.path)
