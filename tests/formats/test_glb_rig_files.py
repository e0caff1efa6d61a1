"""Movement on the character of a glTF file: its nodes, skins, meshes and pictures as they were, and a new animation."""

from __future__ import annotations

import base64
import json
import random
import re
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from gltf_files import MIXAMO, RATE, File, reframed, validated
from plain_gltf import PlainGltf, furthest

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.formats import read_motion
from motionmind.formats._rig_file import RigFile
from motionmind.formats.rig_files import read_rig, write_on_rig
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import own_skeleton

DANCE = ballet_clip("adagio").resample(RATE).slice(30, 70)
A, B = 4, 33
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


def between(own: Motion) -> Motion:
    """Movement from frame A to frame B that goes elsewhere in between."""
    share = np.linspace(0.0, 1.0, 11)
    bump = np.sin(np.pi * share)[:, None]
    bump[-1] = 0.0
    rng = np.random.default_rng(4)
    turns = rot.slerp(own.rotations[A], own.rotations[B], share[:, None])
    turns = rot.mul(turns, rot.exp(bump[..., None] * rng.uniform(-0.8, 0.8, (len(own.skeleton), 3))))
    turns[0], turns[-1] = own.rotations[A], own.rotations[B]
    root = own.root[A] + share[:, None] * (own.root[B] - own.root[A]) + 0.2 * bump * rng.normal(size=3)
    return Motion(own.skeleton, rot.normalise(turns), root, np.arange(11) / RATE, name="between")


class Written:
    """A file, and movement between two of its frames that was written on its rig, beside it."""

    def __init__(self, path: Path, unit: str | float | None = None) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MotionMindWarning)
            source = read_motion(path, unit=unit)
            self.motion = between(own_skeleton(source))
            self.out = path.with_name("out.glb")
            write_on_rig(self.out, self.motion, read_rig(path, (A, B), motion=source, unit=unit))
            self.back = own_skeleton(read_motion(self.out, unit=unit))
        self.source, self.result = PlainGltf(path), PlainGltf(self.out)

    def check(self, *, starts: float = 0.0) -> None:
        """Check both ends in all nodes, joints in between, meshes and skins; the source starts at some second."""
        source, result = self.source, self.result
        for frame, seconds in ((A, 0.0), (B, float(self.motion.times[-1]))):
            wanted = source.world(starts + frame / RATE)
            size = max(float(np.abs(one).max()) for one in wanted.values())
            assert furthest(wanted, result.world(seconds)) < 1e-5 * max(1.0, size)
        turns = [one.skeleton.global_rotations(one.rotations) for one in (self.back, self.motion)]
        assert np.degrees(rot.angle(*turns)).max() < 1e-3
        np.testing.assert_allclose(self.back.root, self.motion.root, atol=1e-5)
        assert kept(source) == kept(result)
        for key in ("meshes", "skins", "materials", "scenes", "textures", "samplers", "extensions"):
            assert shape_of(source.json.get(key)) == shape_of(result.json.get(key)), key
        assert not new_faults(source.path, self.out)


def new_faults(source: Path, result: Path) -> set[str]:
    """Return what the validator finds in a result and not in its source."""
    found, had = ({one["code"] for one in validated(path)} for path in (result, source))
    return found - had - {"UNUSED_OBJECT"}  # the makers of files here leave accessors behind


def kept(file: PlainGltf) -> list[Any]:
    """Return all numbers that skins, meshes and old animations point at, and the bytes of pictures."""
    skins, animations = file.json.get("skins", []), file.json["animations"]
    accessors = [skin["inverseBindMatrices"] for skin in skins if "inverseBindMatrices" in skin]
    for mesh in file.json.get("meshes", []):
        for part in mesh["primitives"]:
            accessors += [index for _, index in sorted(part["attributes"].items())]
            accessors += [target["POSITION"] for target in part.get("targets", [])] + [part["indices"]]
    for one in animations[file.path.name == "out.glb" :]:
        accessors += [sampler[end] for sampler in one["samplers"] for end in ("input", "output")]
    pictures = [file.picture(index) for index in range(len(file.json.get("images", [])))]
    return [file.numbers(index).tolist() for index in accessors] + pictures


def shape_of(value: Any) -> Any:
    """Return JSON as text."""
    return json.dumps(value, sort_keys=True)


def renamed(file: File) -> File:
    for node, name in zip(file.json["nodes"], human23().names, strict=False):
        node["name"] = f"mixamorig:{MIXAMO[name]}"
    return file


def character(tmp_path: Path) -> File:
    """A skinned dancer with Mixamo's names and joints' frames that point anywhere."""
    file = renamed(File(tmp_path / "in.glb", DANCE))
    reframed(file)
    return file


@pytest.fixture
def file(tmp_path: Path) -> File:
    return character(tmp_path)


def track(file: File, node: int, path: str, values: Floats, animation: int = 0) -> None:
    """Let an animation move a node, with the keys of its first channel."""
    one = file.json["animations"][animation]
    kind = {"rotation": "VEC4", "weights": "SCALAR"}.get(path, "VEC3")
    one["samplers"].append({"input": one["samplers"][0]["input"], "output": file.add(values, kind)})
    one["channels"].append({"sampler": len(one["samplers"]) - 1, "target": {"node": node, "path": path}})


def hang(file: File, name: str, child: int | None = None, parent: int | None = None, **more: Any) -> int:
    """Add a node above `child`, or below `parent`; return its number."""
    nodes, scene = file.json["nodes"], file.json["scenes"][0]["nodes"]
    nodes.append({"name": name, **more} | ({"children": [child]} if child is not None else {}))
    if parent is not None:
        nodes[parent].setdefault("children", []).append(len(nodes) - 1)
    else:
        scene[:] = [node for node in scene if node != child] + [len(nodes) - 1]
    return len(nodes) - 1


# --- ways to build a character --------------------------------------------------------------------------------------


def plain(file: File) -> None:
    """Nothing more."""


def in_centimetres_under_a_small_node(file: File) -> None:
    """As Mixamo's: the node above the joints has a scale of 0.01, and turns z up."""
    turn = rot.from_axis_angle([1.0, 0.0, 0.0], np.pi / 2)
    nodes = file.json["nodes"]
    nodes[0]["translation"] = (100.0 * rot.mul_vec(turn, np.array(nodes[0]["translation"]))).tolist()
    nodes[0]["rotation"] = rot.mul(turn, np.array(nodes[0].get("rotation", rot.IDENTITY))).tolist()
    for node in nodes[1:23]:
        node["translation"] = (100.0 * np.array(node["translation"])).tolist()
    keys = 100.0 * rot.mul_vec(turn, file.array(file.samplers[0]["output"]))
    file.samplers[0]["output"] = file.add(keys, "VEC3")
    file.samplers[1]["output"] = file.add(rot.mul(turn, file.array(file.samplers[1]["output"])), "VEC4")
    skin = file.json["skins"][0]
    binds = file.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4)
    binds[:, :3, :3] *= 100.0
    binds[:, 3, :3] *= 100.0
    skin["inverseBindMatrices"] = file.add(binds.reshape(-1, 16), "MAT4")
    hang(file, "Armature", child=0, rotation=rot.inv(turn).tolist(), scale=[0.01] * 3)


def with_matrices(file: File) -> None:
    """A joint that nothing moves has a matrix, as the node above all joints has."""
    node = file.json["nodes"][3]
    matrix = np.eye(4)
    matrix[:3, 3] = node.pop("translation")
    matrix[:3, :3] = rot.to_matrix(np.array(node.pop("rotation")))
    node["matrix"] = matrix.T.ravel().tolist()
    one = file.json["animations"][0]
    one["channels"] = [channel for channel in one["channels"] if channel["target"]["node"] != 3]
    shifted = np.eye(4)
    shifted[3, :3] = [0.5, 0.0, -0.25]
    hang(file, "Armature", child=0, matrix=shifted.ravel().tolist())


def with_a_sword(file: File) -> None:
    """A prop that the animation moves in the hand, with a scale; and one that mirrors, which nothing moves."""
    count = len(DANCE)
    sword = hang(file, "sword", parent=20, translation=[0.0, 0.1, 0.0])
    track(file, sword, "translation", np.linspace([0.0, 0.1, 0.0], [0.3, 0.1, 0.0], count))
    track(file, sword, "rotation", rot.from_axis_angle([0.0, 0.0, 1.0], np.linspace(0.0, 2.0, count)))
    track(file, sword, "scale", np.linspace([1.0, 1.0, 1.0], [2.0, 1.0, 1.0], count))
    hang(file, "shield", matrix=np.diag([-1.0, 1.0, 1.0, 1.0]).ravel().tolist())


def with_scales_of_joints(file: File) -> None:
    """As exporters write all channels of all bones."""
    track(file, 0, "scale", np.full((len(DANCE), 3), 0.5))
    track(file, 7, "scale", np.linspace([1.0, 1.0, 1.0], [1.5, 1.5, 1.5], len(DANCE)))


def with_several_animations(file: File) -> None:
    file.json["animations"].append(json.loads(json.dumps(file.json["animations"][0])) | {"name": "another"})


def with_a_face(file: File) -> None:
    """Morph targets, moved by the file's animation."""
    vertices = file.json["accessors"][file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    target = file.add(np.full((vertices["count"], 3), 0.01), "VEC3")
    file.json["accessors"][target] |= {"min": [0.01] * 3, "max": [0.01] * 3}
    del file.json["accessors"][target]["normalized"]
    for part in file.json["meshes"][0]["primitives"]:
        part["targets"] = [{"POSITION": target}]
    file.json["meshes"][0]["weights"] = [0.25]


def with_extras(file: File) -> None:
    file.json["nodes"][0]["extras"] = {"of mine": [1, 2]}
    file.json["nodes"][4]["extras"] = 5
    file.json["asset"]["extras"] = {"author": "somebody"}
    file.json["meshes"][0]["extras"] = {"targetNames": ["smile"]}


def with_pictures(file: File) -> None:
    (file.path.parent / "skin.png").write_bytes(PNG)
    uri = "data:image/png;base64," + base64.b64encode(PNG).decode()
    view = file.add(np.zeros(1), "SCALAR")
    file.json["accessors"].pop(view)
    file.data[file.json["bufferViews"][-1]["byteOffset"] :] = PNG
    file.json["bufferViews"][-1]["byteLength"] = len(PNG)
    held = {"bufferView": len(file.json["bufferViews"]) - 1, "mimeType": "image/png"}
    file.json["images"] = [{"uri": "skin.png"}, {"uri": uri}, held]
    file.json["textures"] = [{"source": 0}, {"source": 1}, {"source": 2}]
    for material, paint in zip(file.json["materials"], (0, 1, 2), strict=False):
        material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": paint}


def that_is_a_vrm(file: File) -> None:
    names = human23().names
    bones = {"hips": "pelvis", "spine": "lumbar", "chest": "thorax", "neck": "cervical", "head": "atlantal"}
    for side in ("left", "right"):
        limbs = {"UpperLeg": "hip", "LowerLeg": "knee", "Foot": "ankle", "Toes": "toes", "Shoulder": "clavicle"}
        limbs |= {"UpperArm": "shoulder", "LowerArm": "elbow", "Hand": "wrist", "MiddleProximal": "fingers"}
        bones |= {f"{side}{bone}": f"{side}_{joint}" for bone, joint in limbs.items()}
    humanoid = {"humanBones": {bone: {"node": names.index(joint)} for bone, joint in bones.items()}}
    file.json["extensionsUsed"] = ["VRMC_vrm"]
    file.json["extensions"] = {"VRMC_vrm": {"specVersion": "1.0", "humanoid": humanoid}}


KINDS = [
    plain,
    in_centimetres_under_a_small_node,
    with_matrices,
    with_a_sword,
    with_several_animations,
    with_a_face,
    with_extras,
    with_pictures,
]


@pytest.mark.parametrize("build", KINDS, ids=lambda build: build.__name__)
def test_characters_keep_all_that_they_have_and_both_ends(build: Callable[[File], None], file: File) -> None:
    build(file)
    written = Written(file.write())
    written.check()
    assert len(written.result.json["animations"]) == 1 + len(written.source.json["animations"])
    assert written.result.json["animations"][0]["name"] == "between"


def test_other_units_than_metres(file: File) -> None:
    """As exports in centimetres without a node that says so."""
    Written(file.write(), unit=0.5).check()


def test_scales_that_are_animated(file: File) -> None:
    """Between the ends the body's size changes, which moves its joints but turns none."""
    with_scales_of_joints(file)
    above = hang(file, "Armature", child=0)
    track(file, above, "scale", np.full((len(DANCE), 3), 0.5))
    written = Written(file.write())
    np.testing.assert_allclose(written.back.root, written.motion.root, atol=1e-5)
    for frame, seconds in ((A, 0.0), (B, float(written.motion.times[-1]))):
        assert furthest(written.source.world(frame / RATE), written.result.world(seconds)) < 1e-5
    turns = [one.skeleton.global_rotations(one.rotations) for one in (written.back, written.motion)]
    assert np.degrees(rot.angle(*turns)).max() < 1e-3
    assert not new_faults(file.path, written.out)


def test_extras_stay(file: File) -> None:
    with_extras(file)
    written = Written(file.write())
    source, result = written.source.json, written.result.json
    assert result["nodes"][0]["extras"]["of mine"] == [1, 2]
    assert [node.get("extras") for node in result["nodes"][1:]] == [node.get("extras") for node in source["nodes"][1:]]
    assert (result["asset"], result["meshes"]) == (source["asset"], source["meshes"])


def test_a_vrm(file: File, tmp_path: Path) -> None:
    """It stays one: its extension lists the same nodes."""
    that_is_a_vrm(file)
    file.write().rename(tmp_path / "in.vrm")
    written = Written(tmp_path / "in.vrm")
    for frame, seconds in ((A, 0.0), (B, float(written.motion.times[-1]))):
        assert furthest(written.source.world(frame / RATE), written.result.world(seconds)) < 1e-5
    assert written.result.json["extensions"] == written.source.json["extensions"]
    assert kept(written.result) == kept(written.source)


@pytest.mark.parametrize("where", ["beside", "in the text", "two"])
def test_text_with_buffers_beside_it_or_in_it(where: str, file: File, tmp_path: Path) -> None:
    """The result has all in one file; views of a second buffer, of odd length, keep their alignment."""
    data = bytes(file.data)
    views = sorted(file.json["bufferViews"], key=lambda view: view["byteOffset"])
    middle = views[len(views) // 2]["byteOffset"]
    parts = [data[:middle] + b"\0", data[middle:]] if where == "two" else [data]
    for view in views if where == "two" else []:
        if view["byteOffset"] >= middle:
            view |= {"buffer": 1, "byteOffset": view["byteOffset"] - middle}
    file.json["buffers"] = []
    for number, part in enumerate(parts):
        (tmp_path / f"a part {number}.bin").write_bytes(part)
        text = base64.b64encode(part).decode()
        uri = f"data:application/octet-stream;base64,{text}" if where == "in the text" else f"a%20part%20{number}.bin"
        file.json["buffers"].append({"byteLength": len(part), "uri": uri})
    (tmp_path / "in.gltf").write_text(json.dumps(file.json), "utf-8")
    Written(tmp_path / "in.gltf").check()


def test_views_of_extensions_move_with_their_data(file: File) -> None:
    """The first buffer stays the first: data of a compressed view that nothing here reads is where it was."""
    view = file.json["bufferViews"][0]
    packed = {"buffer": 0, "byteOffset": 8, "byteLength": 8, "byteStride": 4, "count": 2, "mode": "ATTRIBUTES"}
    file.json["bufferViews"].append({"buffer": 1, "byteLength": 64, "extensions": {"EXT_meshopt_compression": packed}})
    file.json["buffers"].append({"byteLength": 64, "extensions": {"EXT_meshopt_compression": {"fallback": True}}})
    file.json["extensionsUsed"] = ["EXT_meshopt_compression"]
    source = file.write()
    written = PlainGltf(source).json
    file.path = source
    out = source.with_name("out.glb")
    write_on_rig(out, between(own_skeleton(read_motion(source))), read_rig(source, (A, B)))
    result = PlainGltf(out)
    assert result.json["bufferViews"][0] == view
    (packed_again,) = (one for one in result.json["bufferViews"] if "extensions" in one)
    assert packed_again == written["bufferViews"][-1] | {"byteOffset": 0}
    assert result.json["buffers"][1] == written["buffers"][1]


def test_joints_that_no_animation_moves_get_channels(file: File) -> None:
    with_matrices(file)
    written = Written(file.write())
    moved = {channel["target"]["node"] for channel in written.result.json["animations"][0]["channels"]}
    assert set(range(23)) <= moved
    assert "matrix" not in written.result.json["nodes"][3]
    assert "matrix" in written.result.json["nodes"][-1]  # nothing moves the node above the joints


def test_an_animation_that_begins_late(file: File) -> None:
    times = file.array(file.samplers[0]["input"]) + 1.5
    clock = file.add(times, "SCALAR")
    file.json["accessors"][clock] |= {"min": [float(times[0, 0])], "max": [float(times[-1, 0])]}
    del file.json["accessors"][clock]["normalized"]
    for sampler in file.samplers:
        sampler["input"] = clock
    Written(file.write()).check(starts=1.5)


# --- postures, other files ------------------------------------------------------------------------------------------


def test_a_character_without_movement(file: File) -> None:
    """It gets an animation; without one, its own pose is that of frame 0."""
    del file.json["animations"]
    source = file.write()
    motion = read_motion(source)
    assert len(motion) == 1
    moves = between(own_skeleton(DANCE))
    write_on_rig(source.with_name("out.glb"), moves, read_rig(source))
    back = own_skeleton(read_motion(source.with_name("out.glb")))
    assert np.degrees(rot.angle(back.rotations, moves.rotations)).max() < 1e-3
    np.testing.assert_allclose(back.root, moves.root, atol=1e-4)
    assert not new_faults(source, source.with_name("out.glb"))


def test_a_posture_becomes_the_nodes_pose(file: File) -> None:
    in_centimetres_under_a_small_node(file)
    source = file.write()
    own = own_skeleton(read_motion(source))
    out = source.with_name("out.glb")
    write_on_rig(out, own.posture(A).as_motion(), read_rig(source, (A, A)))
    result = PlainGltf(out)
    assert len(result.json["animations"]) == 1  # the file's own
    assert furthest(PlainGltf(source).world(A / RATE), result.world()) < 1e-5
    assert not new_faults(source, out)


def test_ends_in_two_files_of_one_character(file: File, tmp_path: Path) -> None:
    with_a_sword(file)
    one = file.write()
    (tmp_path / "other.glb").write_bytes(one.read_bytes())
    first, last = read_rig(one, (A, A)), read_rig(tmp_path / "other.glb", (B, B))
    assert first.is_like(last)
    moves = between(own_skeleton(read_motion(one)))
    write_on_rig(tmp_path / "out.glb", moves, first.with_ends_of(first, last))
    result = PlainGltf(tmp_path / "out.glb")
    assert furthest(PlainGltf(one).world(A / RATE), result.world(0.0)) < 1e-5
    assert furthest(PlainGltf(one).world(B / RATE), result.world(float(moves.times[-1]))) < 1e-5


def rig_of(tmp_path: Path, name: str, *builds: Callable[[File], None]) -> RigFile:
    file = character(tmp_path)
    file.path = tmp_path / name
    for build in builds:
        build(file)
    return read_rig(file.write(), (A, A))


def under_a_node(file: File) -> None:
    hang(file, "Armature", child=0)


def test_a_mesh_or_a_prop_more_is_the_same_rig_but_other_axes_are_not(tmp_path: Path) -> None:
    one = rig_of(tmp_path, "one.glb")
    assert one.is_like(rig_of(tmp_path, "armed.glb", with_a_sword))
    large = rig_of(tmp_path, "large.glb", under_a_node)
    assert large.is_like(rig_of(tmp_path, "again.glb", under_a_node))
    assert not large.is_like(rig_of(tmp_path, "small.glb", in_centimetres_under_a_small_node))
    other = File(tmp_path / "axes.glb", DANCE)
    reframed(renamed(other), seed=2)
    assert not one.is_like(read_rig(other.write(), (A, A)))


# --- faults ---------------------------------------------------------------------------------------------------------


def broken(change: Callable[[dict[str, Any]], Any]) -> Callable[[File], None]:
    def build(file: File) -> None:
        change(file.json)

    return build


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda json: json.update(images=None), "images: expected list, got null"),
        (lambda json: json.update(images=[{"uri": "nothing.png"}]), "nothing.png: cannot be read"),
        (lambda json: json.update(images=[{"uri": "../a.png"}]), "it must be in this file's folder or below"),
        (lambda json: json.update(images=[{"uri": "data:,what"}]), "is neither PNG, JPEG, WebP nor KTX 2"),
        (lambda json: json["bufferViews"][2].update(buffer=9), "buffer 9 does not exist: the file has 1"),
        (lambda json: json["buffers"].append({"byteLength": 4, "uri": "gone.bin"}), "gone.bin: cannot be read"),
    ],
)
def test_damaged_files_are_refused_in_one_line(
    change: Callable[[dict[str, Any]], Any], said: str, file: File, tmp_path: Path
) -> None:
    change(file.json)
    path = file.write()
    (tmp_path / "out").mkdir()
    moves = between(own_skeleton(DANCE))

    def write() -> None:
        write_on_rig(tmp_path / "out" / "out.glb", moves, read_rig(path, (A, B)))

    with pytest.raises(FormatError, match=re.escape(said)) as refused:
        write()
    assert "\n" not in str(refused.value)
    assert not [*(tmp_path / "out").iterdir()]


def spoil(value: Any, rng: random.Random) -> Any:
    """Return JSON with one member, however deep, replaced or left out."""
    if not isinstance(value, (dict, list)) or not value or rng.random() < 0.1:
        return rng.choice([None, -1, 10**9, 1.5, "x", [], {}, True, "data:,x"])
    keys = [*value] if isinstance(value, dict) else [*range(len(value))]
    key, copy = rng.choice(keys), value.copy()
    if rng.random() < 0.1:
        del copy[key]
    else:
        copy[key] = spoil(value[key], rng)
    return copy


def test_damage_anywhere_is_refused_or_does_no_harm(file: File, tmp_path: Path) -> None:
    for build in (with_pictures, with_a_sword, with_extras):
        build(file)
    file.json["buffers"][0] |= {"uri": "all.bin", "byteLength": len(file.data)}
    (tmp_path / "all.bin").write_bytes(bytes(file.data))
    whole, moves, counts = file.json, between(own_skeleton(DANCE)), Counter[Any]()
    for seed in range(100):
        rng = random.Random(seed)
        file.json = spoil(spoil(whole, rng), rng)
        (tmp_path / "in.gltf").write_text(json.dumps(file.json), "utf-8")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MotionMindWarning)
            try:
                write_on_rig(tmp_path / "out.glb", moves, read_rig(tmp_path / "in.gltf"))
                counts["written"] += 1
            except MotionMindError as error:
                counts["refused", "\n" in str(error)] += 1
    assert counts.keys() == {"written", ("refused", False)}


def test_a_rig_can_be_written_again(file: File, tmp_path: Path) -> None:
    """Nothing of the first movement is in the second."""
    rig = read_rig(file.write(), (A, B))
    moves = between(own_skeleton(read_motion(file.path)))
    write_on_rig(tmp_path / "one.glb", moves, rig)
    write_on_rig(tmp_path / "out.glb", replace(moves, name="again"), rig)
    write_on_rig(tmp_path / "three.glb", moves, rig)
    assert (tmp_path / "one.glb").read_bytes() == (tmp_path / "three.glb").read_bytes()
