"""GLB out, read back by a small reader of its own, which follows the glTF specification and knows nothing of ours."""

from __future__ import annotations

import json
import struct
import time
from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import validated
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from motionmind._typing import Floats, Indices
from motionmind.body.human import human23, human44
from motionmind.body.mirror import LEFT, MIDDLE, RIGHT, sides_of
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.cli import main
from motionmind.errors import MotionMindError
from motionmind.formats import read_motion, write_motion, write_posture
from motionmind.formats._glb_body import FRONT
from motionmind.formats.glb import write_glb
from motionmind.geometry import rotations as rot

# --- the reader -----------------------------------------------------------------------------------------------------

COMPONENTS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Scene:
    """A GLB file: its JSON, its numbers, and where its nodes are at any time."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        chunks, at = [], 12
        while at < length:
            size, kind = struct.unpack_from("<I4s", data, at)
            assert size % 4 == 0
            chunks.append((kind, data[at + 8 : at + 8 + size]))
            at += 8 + size
        assert at == length
        assert [kind for kind, _ in chunks] == [b"JSON", b"BIN\0"]
        self.json: dict[str, Any] = json.loads(chunks[0][1])
        self.binary = chunks[1][1]
        self.nodes: list[dict[str, Any]] = self.json["nodes"]

    def numbers(self, accessor: int) -> NDArray[Any]:
        """What an accessor shows [n, components]."""
        shown = self.json["accessors"][accessor]
        view = self.json["bufferViews"][shown["bufferView"]]
        dtype, width = np.dtype(COMPONENTS[shown["componentType"]]), WIDTHS[shown["type"]]
        start = view.get("byteOffset", 0) + shown.get("byteOffset", 0)
        assert start % dtype.itemsize == 0
        size = shown["count"] * width * dtype.itemsize
        assert shown.get("byteOffset", 0) + size <= view["byteLength"]
        return np.frombuffer(self.binary[start : start + size], dtype).reshape(-1, width)

    @cached_property
    def joints(self) -> list[int]:
        """The nodes of the one skin."""
        (skin,) = self.json["skins"]
        return list(skin["joints"])

    @cached_property
    def channels(self) -> dict[tuple[int, str], tuple[Floats, Floats]]:
        """Times and values of the one animation, if there is any, by node and by what they move."""
        animations = self.json.get("animations", [])
        assert len(animations) <= 1
        found = {}
        for animation in animations:
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                assert sampler["interpolation"] == "LINEAR"
                values = (self.numbers(sampler[end]).astype(np.float64) for end in ("input", "output"))
                times, output = values
                found[channel["target"]["node"], channel["target"]["path"]] = times[:, 0], output
        return found

    def globals(self, when: float | None = None) -> Floats:
        """The nodes' matrices in the world [N, 4, 4], at a time of the animation, or as they stand in the file."""
        out = np.full((len(self.nodes), 4, 4), np.nan)
        waiting = [(root, np.eye(4)) for root in self.json["scenes"][self.json["scene"]]["nodes"]]
        while waiting:
            node, above = waiting.pop()
            assert np.isnan(out[node]).all(), "a node hangs from two others"
            local = np.eye(4)
            local[:3, 3] = self.value(node, "translation", [0, 0, 0], when)
            local[:3, :3] = Rotation.from_quat(self.value(node, "rotation", [0, 0, 0, 1], when)).as_matrix()
            out[node] = above @ local
            waiting += [(child, out[node]) for child in self.nodes[node].get("children", [])]
        assert np.isfinite(out).all(), "a node is in no scene"
        return out

    def value(self, node: int, path: str, default: list[float], when: float | None) -> Floats:
        """Appendix C of the specification: the value before the first key is the first's, after the last the last's."""
        if when is None or (node, path) not in self.channels:
            return np.array(self.nodes[node].get(path, default), dtype=np.float64)
        times, values = self.channels[node, path]
        after = int(np.clip(np.searchsorted(times, when), 1, len(times) - 1))
        share = float(np.clip((when - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0))
        a, b = values[after - 1], values[after]
        if path == "translation":
            return np.asarray(a + share * (b - a))
        angle = np.arccos(np.clip(abs(a @ b), 0.0, 1.0))
        if angle < 1e-6:
            return np.asarray(a + share * (b - a))
        return np.asarray(
            (np.sin((1 - share) * angle) * a + np.sign(a @ b) * np.sin(share * angle) * b) / np.sin(angle)
        )

    def places(self, when: float | None = None) -> Floats:
        """Where the skin's joints are [J, 3]."""
        return self.globals(when)[self.joints, :3, 3]

    def rest(self) -> Floats:
        """The rest pose that the inverse bind matrices mean: the joints' matrices in the world [J, 4, 4]."""
        (skin,) = self.json["skins"]
        columns = self.numbers(skin["inverseBindMatrices"]).astype(np.float64)
        return np.linalg.inv(columns.reshape(-1, 4, 4).swapaxes(1, 2))

    def vertices(self, name: str) -> Floats:
        """The mesh's vertices, one attribute [V, components]."""
        (mesh,) = self.json["meshes"]
        (accessor,) = {primitive["attributes"][name] for primitive in mesh["primitives"]}
        return self.numbers(accessor).astype(np.float64)

    def painted(self, paint: str) -> Indices:
        """Which vertices have a material [n]."""
        (mesh,) = self.json["meshes"]
        names = [material["name"] for material in self.json["materials"]]
        (found,) = [part for part in mesh["primitives"] if names[part["material"]] == paint]
        return self.numbers(found["indices"])[:, 0].astype(np.intp)


# --- what is written ------------------------------------------------------------------------------------------------


def beetle() -> Skeleton:
    """A body of six legs, of two joints each, a head, and a joint that stands where its parent does."""
    names, parents, offsets, tips = ["thorax", "head"], [-1, 0], [[0.0, 0.0, 0.0], [0.0, 0.0, 0.02]], [[0.0] * 3] * 2
    for side, sign in (("L", 1.0), ("R", -1.0)):
        for z, row in ((0.01, "front"), (0.0, "middle"), (-0.01, "hind")):
            names += [f"{row}.{side}", f"{row}_shin.{side}"]
            parents += [0, len(names) - 2]
            offsets += [[sign * 0.006, 0.0, z], [sign * 0.01, 0.004, 0.0]]
            tips += [[0.0] * 3, [sign * 0.006, -0.012, 0.0]]
    return Skeleton(
        "beetle", (*names, "wing"), (*parents, 0), np.array([*offsets, [0.0] * 3]), np.array([*tips, [0.0] * 3])
    )


def dot() -> Skeleton:
    return Skeleton("dot", ("dot",), (-1,), np.zeros((1, 3)))


BODIES = {body.name: body for body in (human23(), human44(), beetle(), dot())}


def wandering(skeleton: Skeleton, frames: int = 12, seed: int = 0, *, even: bool = False) -> Motion:
    """Random postures, at random times that begin late; quaternions on random sides."""
    rng = np.random.default_rng(seed)
    rotations = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    times = np.arange(frames) / 24.0 if even else -3.0 + np.cumsum(rng.uniform(0.01, 0.5, frames))
    return Motion(skeleton, rotations, rng.normal(size=(frames, 3)), times, name="wandering")


def written(tmp_path: Path, motion: Motion) -> Scene:
    write_glb(tmp_path / "a.glb", motion)
    return Scene(tmp_path / "a.glb")


def expected(motion: Motion, when: float) -> Floats:
    """Where the joints are [J, 3] at a time: rotations by scipy's slerp, the root linear."""
    root = [np.interp(when, motion.times, motion.root[:, axis]) for axis in range(3)]
    rotations = np.stack(
        [
            Slerp(motion.times, Rotation.from_quat(motion.rotations[:, joint]))(when).as_quat()
            for joint in range(len(motion.skeleton))
        ]
    )
    return motion.skeleton.positions(rotations, np.array(root))


# --- laws -----------------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("even", [False, True])
def test_every_joint_is_where_it_was_at_any_time(tmp_path: Path, body: str, even: bool) -> None:
    motion = wandering(BODIES[body], even=even)
    scene = written(tmp_path, motion)
    first, last = motion.times[0], motion.times[-1]
    assert [scene.nodes[node]["name"] for node in scene.joints] == list(motion.skeleton.names)
    for when in (*motion.times, *np.random.default_rng(1).uniform(first, last, 20)):
        np.testing.assert_allclose(scene.places(when - first), expected(motion, when), atol=1e-5)


def test_turns_go_the_short_way_round(tmp_path: Path) -> None:
    motion = wandering(human23(), 50)
    for (_, path), (_, values) in written(tmp_path, motion).channels.items():
        if path == "rotation":
            assert (np.sum(values[1:] * values[:-1], axis=-1) >= 0.0).all()
            np.testing.assert_allclose(np.linalg.norm(values, axis=-1), 1.0, atol=1e-6)


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("frames", [1, 3])
def test_the_tree_is_the_skeletons(tmp_path: Path, body: str, frames: int) -> None:
    skeleton = BODIES[body]
    scene = written(tmp_path, wandering(skeleton, frames))
    above = {child: node for node, value in enumerate(scene.nodes) for child in value.get("children", [])}
    parents = [scene.joints.index(above[node]) if node in above else -1 for node in scene.joints]
    assert parents == list(skeleton.parents)


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("frames", [1, 3])
def test_the_skin_knows_the_rest_pose(tmp_path: Path, body: str, frames: int) -> None:
    skeleton = BODIES[body]
    scene = written(tmp_path, wandering(skeleton, frames))
    rest = scene.rest()
    np.testing.assert_allclose(rest[:, :3, :3], np.tile(np.eye(3), (len(skeleton), 1, 1)), atol=1e-12)
    offsets = rest[1:, :3, 3] - rest[list(skeleton.parents[1:]), :3, 3]
    np.testing.assert_allclose(offsets, skeleton.offsets[1:], atol=1e-6)
    lowest = min(rest[:, 1, 3].min(), (rest[:, 1, 3] + skeleton.tips[:, 1]).min())
    np.testing.assert_allclose([rest[0, 0, 3], lowest, rest[0, 2, 3]], 0.0, atol=1e-6)
    if frames > 1:  # nodes stand at rest, so that inverse binds undo them
        np.testing.assert_allclose(
            scene.globals()[scene.joints] @ np.linalg.inv(rest), np.tile(np.eye(4), (len(skeleton), 1, 1)), atol=1e-6
        )


@pytest.mark.parametrize("body", BODIES)
def test_one_posture_stands_still(tmp_path: Path, body: str) -> None:
    motion = wandering(BODIES[body], 1)
    scene = written(tmp_path, motion)
    assert "animations" not in scene.json
    here = motion.skeleton.positions(motion.rotations[0], motion.root[0])
    np.testing.assert_allclose(scene.places(), here, atol=1e-5)
    write_posture(tmp_path / "b.GLB", motion.posture(0))
    np.testing.assert_allclose(Scene(tmp_path / "b.GLB").places(), here, atol=1e-5)


@pytest.mark.parametrize("body", BODIES)
def test_the_mesh_lies_around_its_bones(tmp_path: Path, body: str) -> None:
    skeleton = BODIES[body]
    scene = written(tmp_path, wandering(skeleton))
    places, normals = scene.vertices("POSITION"), scene.vertices("NORMAL")
    joints, weights = scene.vertices("JOINTS_0").astype(int), scene.vertices("WEIGHTS_0")
    np.testing.assert_array_equal(weights, np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1)))
    assert (joints[:, 1:] == 0).all()
    rest = scene.rest()[:, :3, 3]
    span = float(np.ptp(np.concatenate([rest, rest + skeleton.tips]), axis=0).max()) or 1.0
    for joint in set(joints[:, 0]):
        ends = [rest[child] for child in skeleton.children(joint)] or [rest[joint] + skeleton.tips[joint]]
        if len(skeleton) == 1:
            ends = [rest[0] + [0.0, 0.1, 0.0]]
        mine = places[joints[:, 0] == joint]
        near = np.min([_distance(mine, rest[joint], end) for end in ends], axis=0)
        assert near.max() < 0.1 * span
        for end in ends:  # no bone is bare, and each has a volume
            if np.linalg.norm(end - rest[joint]) > 1e-3 * span:
                around = _distance(mine, rest[joint], end)
                assert np.linalg.norm(mine - end, axis=-1).min() < 0.1 * span
                assert around.max() > 0.004 * span
    triangles = places.reshape(-1, 3, 3)
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    np.testing.assert_allclose(np.repeat(across, 3, axis=0), normals, atol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0, atol=1e-6)


def _distance(points: Floats, start: Floats, end: Floats) -> Floats:
    """Of points [n, 3] from the segment between two."""
    along = end - start
    share = np.clip((points - start) @ along / max(float(along @ along), 1e-30), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=-1))


@pytest.mark.parametrize("body", BODIES)
def test_the_mesh_is_closed_and_turned_outwards(tmp_path: Path, body: str) -> None:
    scene = written(tmp_path, wandering(BODIES[body]))
    triangles = np.round(scene.vertices("POSITION"), 7).reshape(-1, 3, 3)
    edges = Counter(
        (tuple(triangle[i]), tuple(triangle[(i + 1) % 3])) for triangle in triangles.tolist() for i in range(3)
    )
    assert all(edges[b, a] == count for (a, b), count in edges.items())
    volume = np.einsum("ni,ni->n", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6.0
    assert volume > 0.0
    painted = np.concatenate([scene.painted(material["name"]) for material in scene.json["materials"]])
    np.testing.assert_array_equal(np.sort(painted), np.arange(3 * len(triangles)))


@pytest.mark.parametrize("body", ["human23", "human44", "beetle"])
def test_colours_tell_left_from_right_and_front_from_back(tmp_path: Path, body: str) -> None:
    scene = written(tmp_path, wandering(BODIES[body]))
    places, normals = scene.vertices("POSITION"), scene.vertices("NORMAL")
    assert places[scene.painted(LEFT), 0].mean() > 0.0 > places[scene.painted(RIGHT), 0].mean()
    assert abs(places[scene.painted(MIDDLE), 0].mean()) < 1e-3
    front = normals[scene.painted(FRONT)]
    assert (front[:, 1:].max(axis=1) > 0.2).all()  # ahead, or up where a foot lies
    assert front[:, 2].mean() > 0.5
    colours = {m["name"]: m["pbrMetallicRoughness"]["baseColorFactor"] for m in scene.json["materials"]}
    assert colours[LEFT][0] > 2 * colours[LEFT][2]  # warm
    assert colours[RIGHT][2] > 2 * colours[RIGHT][0]  # cool


def test_the_nose_and_the_knee_turn_with_their_joints(tmp_path: Path) -> None:
    """A person who sits turned to the left: the shank's ridge points to where the knee does."""
    skeleton = human23()
    rotations = np.tile(rot.IDENTITY, (2, 23, 1))
    rotations[1, 0] = rot.about_vertical(np.pi / 2)
    rotations[1, skeleton.index("left_knee")] = rot.from_axis_angle([1.0, 0.0, 0.0], np.pi / 2)
    scene = written(tmp_path, Motion(skeleton, rotations, np.zeros((2, 3)), np.array([0.0, 1.0])))
    skinned = scene.globals(1.0)[scene.joints] @ np.linalg.inv(scene.rest())
    front = scene.painted(FRONT)
    joints = scene.vertices("JOINTS_0")[front, 0].astype(int)
    turned = np.einsum("nij,nj->ni", skinned[joints][:, :3, :3], scene.vertices("NORMAL")[front])
    for joint, direction in (("atlantal", [1, 0, 0]), ("left_hip", [1, 0, 0]), ("left_knee", [0, -1, 0])):
        mean = turned[joints == skeleton.index(joint)].mean(axis=0)
        np.testing.assert_allclose(mean / np.linalg.norm(mean), direction, atol=0.1)


@pytest.mark.parametrize(
    ("names", "parents", "sides"),
    [
        (("hips", "lfemur", "rfemur"), (-1, 0, 0), (MIDDLE, LEFT, RIGHT)),
        (("Hips", "LeftUpLeg", "LeftToe", "RightUpLeg"), (-1, 0, 1, 0), (MIDDLE, LEFT, LEFT, RIGHT)),
        (("root", "thigh.R", "thigh.L", "end"), (-1, 0, 0, 1), (MIDDLE, RIGHT, LEFT, RIGHT)),
        (("rail", "lift"), (-1, 0), (MIDDLE, MIDDLE)),
        (("root", "left wing", "tip"), (-1, 0, 1), (MIDDLE, LEFT, LEFT)),  # without a right one
    ],
)
def test_sides_by_names(names: tuple[str, ...], parents: tuple[int, ...], sides: tuple[str, ...]) -> None:
    assert tuple(sides_of(Skeleton("s", names, parents, np.zeros((len(names), 3))))) == sides


# --- the file -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("frames", [1, 2, 7])
def test_the_file_is_whole_and_nothing_in_it_is_unused(tmp_path: Path, body: str, frames: int) -> None:
    scene = written(tmp_path, wandering(BODIES[body], frames))
    document = scene.json
    (buffer,), (mesh,), (skin,) = document["buffers"], document["meshes"], document["skins"]
    assert buffer == {"byteLength": len(scene.binary)}
    used, targets = {skin["inverseBindMatrices"]: None}, {}
    for primitive in mesh["primitives"]:
        used |= dict.fromkeys(primitive["attributes"].values(), 34962) | {primitive["indices"]: 34963}
        assert scene.numbers(primitive["indices"]).max() < len(scene.vertices("POSITION"))
    samplers = [sampler for animation in document.get("animations", []) for sampler in animation["samplers"]]
    used |= {sampler[end]: None for sampler in samplers for end in ("input", "output")}
    assert sorted(used) == list(range(len(document["accessors"])))
    for accessor, target in used.items():
        targets.setdefault(document["accessors"][accessor]["bufferView"], set()).add(target)
    assert sorted(targets) == list(range(len(document["bufferViews"])))
    end = 0
    for number, view in enumerate(document["bufferViews"]):
        assert targets[number] == {view.get("target")}
        assert end <= view["byteOffset"] < end + 4
        assert view["byteOffset"] % 4 == 0
        end = view["byteOffset"] + view["byteLength"]
    assert end <= len(scene.binary) < end + 4
    bounded = {*(sampler["input"] for sampler in samplers)}
    bounded |= {primitive["attributes"]["POSITION"] for primitive in mesh["primitives"]}
    for number, accessor in enumerate(document["accessors"]):
        assert ("min" in accessor) == ("max" in accessor) == (number in bounded)
        if number in bounded:
            values = scene.numbers(number)
            np.testing.assert_array_equal(values.min(axis=0), np.array(accessor["min"], dtype="<f4"))
            np.testing.assert_array_equal(values.max(axis=0), np.array(accessor["max"], dtype="<f4"))
    for sampler in samplers:
        times = scene.numbers(sampler["input"])[:, 0]
        assert times[0] == 0.0
        assert (np.diff(times) > 0.0).all()
        assert len(scene.numbers(sampler["output"])) == len(times) == frames
    assert {part["material"] for part in mesh["primitives"]} == set(range(len(document["materials"])))
    assert [node for node in scene.nodes if "skin" in node] == [{"name": scene.nodes[-1]["name"], "mesh": 0, "skin": 0}]
    assert scene.globals().shape == (len(scene.nodes), 4, 4)


def test_the_same_motion_gives_the_same_bytes(tmp_path: Path) -> None:
    motion = wandering(human44())
    sides = np.where(np.random.default_rng(2).random((len(motion), 44, 1)) < 0.5, -1.0, 1.0)
    again = Motion(motion.skeleton, motion.rotations * sides, motion.root, motion.times, name=motion.name)
    write_glb(tmp_path / "a.glb", motion)
    write_motion(tmp_path / "b.glb", again)
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


def test_names_of_any_script(tmp_path: Path) -> None:
    names = ("", 'a "b"', "Hüfte", "膝", "a\nb", "\udc80")
    skeleton = Skeleton("é", names, (-1, 0, 1, 2, 3, 4), np.full((6, 3), 0.1))
    scene = written(tmp_path, wandering(skeleton))
    assert tuple(scene.nodes[node]["name"] for node in scene.joints) == names


def test_what_glb_cannot_hold_is_said(tmp_path: Path) -> None:
    motion = wandering(human23(), 3)
    far = Motion(motion.skeleton, motion.rotations, motion.root + 1e7, motion.times, name="far")
    with pytest.raises(MotionMindError, match=r"far: root: GLB cannot hold 1e\+07 metres"):
        write_glb(tmp_path / "a.glb", far)
    late = Motion(motion.skeleton, motion.rotations, motion.root, np.array([0.0, 1e6, 1e6 + 0.01]), name="late")
    with pytest.raises(MotionMindError, match=r"late: frame 2 is 0\.01 s after the one before it, at 1e\+06 s: too cl"):
        write_glb(tmp_path / "a.glb", late)
    with pytest.raises(MotionMindError, match=r"cannot be written: there is no such file or folder$"):
        write_glb(tmp_path / "none" / "a.glb", motion)
    assert list(tmp_path.iterdir()) == []


def test_speed_is_of_the_order_that_was_promised(tmp_path: Path) -> None:
    motion = wandering(human23(), 10_000)
    write_glb(tmp_path / "a.glb", motion)
    start = time.process_time()
    write_glb(tmp_path / "a.glb", motion)
    assert time.process_time() - start < 1.0  # about 0.06 s


@pytest.mark.long
@settings(max_examples=40)
@given(st.data())
def test_any_body(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    count = data.draw(st.integers(1, 8))
    parents = (-1, *(data.draw(st.integers(0, joint - 1)) for joint in range(1, count)))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    size = data.draw(st.sampled_from([1e-6, 1e-3, 1.0, 100.0]))
    bare = rng.random((2, count, 1)) < 0.3
    offsets, tips = np.where(bare, 0.0, rng.normal(size=(2, count, 3)) * size)
    skeleton = Skeleton("random", tuple(f"joint {i}" for i in range(count)), parents, offsets, tips)
    motion = wandering(skeleton, data.draw(st.integers(2, 4)), data.draw(st.integers(0, 99)))
    path = tmp_path_factory.getbasetemp() / "property.glb"
    write_glb(path, motion)
    scene = Scene(path)
    for when in rng.uniform(motion.times[0], motion.times[-1], 3):
        reached = expected(motion, when)
        np.testing.assert_allclose(scene.places(when - motion.times[0]), reached, atol=1e-5 * max(1.0, size))
    assert np.isfinite(scene.vertices("POSITION")).all()
    np.testing.assert_allclose(np.linalg.norm(scene.vertices("NORMAL"), axis=-1), 1.0, atol=1e-5)


# --- the command line -----------------------------------------------------------------------------------------------


def run(*arguments: str) -> int | str | None:
    with pytest.raises(SystemExit) as end:
        main(list(arguments))
    return end.value.code


def test_convert(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    motion = wandering(human23(), 20, even=True)
    write_motion("clip.bvh", motion)
    write_posture("one.json", motion.posture(3))
    assert run("convert", "clip.bvh", "clip.glb") == 0
    assert capsys.readouterr().out == "clip.glb: 20 frames, 23 joints (clip)\n"
    np.testing.assert_allclose(Scene(Path("clip.glb")).places(0.25), expected(motion, 0.25), atol=1e-4)
    assert run("convert", "one.json", "one.glb") == 0
    np.testing.assert_allclose(Scene(Path("one.glb")).places(), expected(motion, motion.times[3]), atol=1e-5)
    capsys.readouterr()
    for arguments in (("clip.bvh", "none/x.glb"), ("clip.bvh", "clip.glb.x")):
        assert run("convert", *arguments) == 2
        shown = capsys.readouterr()
        assert shown.out == ""
        assert len(shown.err.splitlines()) == 1


@pytest.mark.long
def test_tween(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    postures = Path(__file__).parents[2] / "corpora" / "ballet" / "postures"
    ends = [str(postures / f"{name}.json") for name in ("arabesque", "fifth")]
    assert run("tween", *ends, "--corpus", "ballet", "-o", "tween.json") == 0
    assert run("tween", *ends, "--corpus", "ballet", "-o", "tween.glb") == 0
    assert "tween.glb" in capsys.readouterr().out
    motion, scene = read_motion("tween.json"), Scene(Path("tween.glb"))
    for when in (0.0, 0.4, float(motion.times[-1])):
        np.testing.assert_allclose(scene.places(when), expected(motion, when), atol=1e-5)


# --- other people's programs ----------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("frames", [1, 5])
def test_the_validator_finds_nothing(tmp_path: Path, body: str, frames: int) -> None:
    written(tmp_path, wandering(BODIES[body], frames))
    assert validated(tmp_path / "a.glb") == []
