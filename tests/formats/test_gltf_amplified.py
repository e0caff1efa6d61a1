"""Small glTF files that mention much: numbers, files and joints that are shared are read once, or refused at once."""

from __future__ import annotations

import copy
import random
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from gltf_files import File, wandering

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.formats import read_motion
from motionmind.formats._gltf import Gltf, from_matrix
from motionmind.formats.gltf import _distinct, read_gltf
from motionmind.formats.rig_files import read_rig, write_on_rig
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import own_skeleton


@pytest.fixture
def file(tmp_path: Path) -> File:
    return File(tmp_path / "a.glb", wandering(human23()))


@contextmanager
def memory_below(limit: int) -> Iterator[None]:
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < limit
    finally:
        tracemalloc.stop()


def same(found: Motion, wanted: Motion) -> None:
    assert rot.angle(found.rotations, wanted.rotations).max() < 1e-6
    np.testing.assert_allclose(found.root, wanted.root, atol=1e-6)


# --- numbers --------------------------------------------------------------------------------------------------------


def one_sampler(file: File) -> None:
    """All joints turn by one sampler."""
    for channel in file.json["animations"][0]["channels"][2:]:
        channel["sampler"] = 1


def one_output(file: File) -> None:
    """All joints turn by samplers of their own with the same numbers."""
    for sampler in file.samplers[2:]:
        sampler["output"] = file.samplers[1]["output"]


def one_place(file: File) -> None:
    """All joints turn by accessors of their own to the same bytes."""
    for sampler in file.samplers[2:]:
        file.json["accessors"].append(copy.deepcopy(file.json["accessors"][file.samplers[1]["output"]]))
        sampler["output"] = len(file.json["accessors"]) - 1


@pytest.mark.parametrize("share", [one_sampler, one_output, one_place])
def test_shared_numbers_are_read_once(
    share: Callable[[File], None], file: File, monkeypatch: pytest.MonkeyPatch
) -> None:
    for sampler in file.samplers[2:]:
        sampler["output"] = file.add(file.array(file.samplers[1]["output"]), "VEC4")
    wanted = read_gltf(file.write())
    share(file)
    whole, read = Gltf._checked, []
    monkeypatch.setattr(Gltf, "_checked", lambda self, *given: read.append(given) or whole(self, *given))
    same(read_gltf(file.write()), wanted)
    assert len(read) <= 4  # times, places and rotations, and the matrices of the skin


def test_numbers_that_overlap_without_end(file: File) -> None:
    keys = 4000
    clock, start = file.add(np.arange(keys) / 30.0, "SCALAR"), file.add(np.ones((keys + 1000, 4)), "VEC4")
    for place, sampler in enumerate(file.samplers[1:]):
        shifted = copy.deepcopy(file.json["accessors"][start]) | {"byteOffset": 16 * place, "count": keys}
        file.json["accessors"].append(shifted)
        sampler |= {"input": clock, "output": len(file.json["accessors"]) - 1}
    with (
        memory_below(24 * len(file.write().read_bytes())),
        pytest.raises(FormatError, match="has data that too many others have, in part"),
    ):
        read_gltf(file.path)


def test_joints_may_use_parts_of_one_clock(file: File) -> None:
    wanted = read_gltf(file.write())
    clock = file.json["accessors"][file.samplers[0]["input"]]
    for first, sampler in enumerate(file.samplers[1:]):
        part = clock | {"byteOffset": clock.get("byteOffset", 0) + 4 * (first % 4), "count": 8 - first % 4}
        file.json["accessors"].append(part)
        keys = file.array(sampler["output"])[first % 4 :]
        sampler |= {"input": len(file.json["accessors"]) - 1, "output": file.add(keys, "VEC4")}
    found = read_gltf(file.write())
    assert rot.angle(found.rotations[4:], wanted.rotations[4:]).max() < 1e-6


def test_frames_of_all_joints_are_counted_before_any(file: File) -> None:
    keys = 150_000
    file.samplers[0] |= {
        "input": file.add(np.arange(keys) / 30.0, "SCALAR"),
        "output": file.add(np.ones((keys, 3)), "VEC3"),
    }
    for channel in file.json["animations"][0]["channels"]:
        channel |= {"sampler": 0, "target": {"node": channel["target"]["node"], "path": "translation"}}
    with (
        memory_below(12 * len(file.write().read_bytes())),
        pytest.raises(MotionMindError, match=r"150000 frames of .* joints are more than can be made at once"),
    ):
        read_gltf(file.path)


# --- files ----------------------------------------------------------------------------------------------------------


def in_one_file(file: File, tmp_path: Path, times: int) -> None:
    """Put all data into a file beside the file, and mention it by many names."""
    file.json["buffers"] = [
        {"uri": ("all.bin", "./all.bin", "%61ll.bin")[number % 3], "byteLength": len(file.data)}
        for number in range(times)
    ]
    for number, view in enumerate(file.json["bufferViews"]):
        view["buffer"] = number % times
    (tmp_path / "all.bin").write_bytes(bytes(file.data) + bytes(10**6))


def test_a_file_with_many_buffers_is_read_once(file: File, tmp_path: Path) -> None:
    wanted = read_gltf(file.write())
    in_one_file(file, tmp_path, 20)
    with memory_below(5 * 10**6):
        found = read_gltf(file.write())
    same(found, wanted)


def test_a_rig_keeps_a_file_with_many_buffers_and_pictures_once(file: File, tmp_path: Path) -> None:
    picture = b"\x89PNG" + bytes(10**6)
    (tmp_path / "skin.png").write_bytes(picture)
    file.json["images"] = [{"uri": "skin.png"}, {"uri": "./skin.png"}] * 5
    in_one_file(file, tmp_path, 20)
    motion = own_skeleton(read_motion(file.write()))
    write_on_rig(tmp_path / "b.glb", motion, read_rig(file.path, None, motion=motion))
    assert (tmp_path / "b.glb").stat().st_size < 3 * 10**6
    with pytest.warns(MotionMindWarning, match="the first animation that moves is read"):
        same(own_skeleton(read_motion(tmp_path / "b.glb")), motion)
    assert (tmp_path / "b.glb").read_bytes().count(picture) == 1


# --- joints ---------------------------------------------------------------------------------------------------------


def test_nodes_above_joints_count(file: File) -> None:
    nodes = file.json["nodes"]
    first = len(nodes)
    nodes += [{"children": [first + number + 1]} for number in range(4000)]
    nodes[-1]["children"] = [file.json["scenes"][0]["nodes"][0]]
    with pytest.raises(FormatError, match="joints and nodes above them are more than a body has"):
        read_gltf(file.write())


@pytest.mark.parametrize("seed", range(5))
def test_skins_that_share_joints_are_one_body(seed: int, file: File) -> None:
    """Skins of one joint or two, in any order, that join to the whole: more than pairs in turn would join."""
    rng = random.Random(seed)
    wanted = read_gltf(file.write())
    (skin,) = file.json["skins"]
    joints = skin["joints"]
    pairs = [[joints[rng.randrange(number)], joints[number]] for number in range(1, len(joints))]
    rng.shuffle(pairs)
    file.json["skins"] = [{"joints": pair, "name": f"skin {number}"} for number, pair in enumerate(pairs)]
    found = read_gltf(file.write())
    assert found.skeleton.name == "skin 0"
    same(found, wanted)
    nodes = file.json["nodes"]
    nodes.append({"name": "prop"})
    file.json["skins"].append({"joints": [len(nodes) - 1]})
    with pytest.warns(MotionMindWarning, match="skin 0 is read, not a skin without a name"):
        same(read_gltf(file.write()), wanted)


@pytest.mark.parametrize("seed", range(20))
def test_names_become_distinct(seed: int) -> None:
    rng = random.Random(seed)
    names = [rng.choice(["a", "a 2", "a 3", "b", "a 2 2"]) for _ in range(rng.randrange(1, 30))]
    wanted: list[str] = []
    for name in names:
        choices = [name, *(f"{name} {number}" for number in range(2, 99))]
        wanted.append(next(one for one in choices if one not in wanted))
    assert list(_distinct(names)) == wanted


def test_matrices_are_taken_apart_together() -> None:
    rng = np.random.default_rng(0)
    place, turn = rng.normal(size=(2, 5, 3)), rot.normalise(rng.normal(size=(2, 5, 4)))
    scale = rng.uniform(0.1, 3.0, (2, 5, 3))
    matrix = np.zeros((2, 5, 4, 4))
    matrix[..., :3, :3], matrix[..., :3, 3], matrix[..., 3, 3] = rot.to_matrix(turn) * scale[..., None, :], place, 1.0
    rows = matrix.swapaxes(-1, -2).reshape(2, 5, 16)
    found = from_matrix(rows)
    np.testing.assert_allclose(found[0], place)
    assert rot.angle(found[1], turn).max() < 1e-7
    np.testing.assert_allclose(found[2], scale)
    rows[1, 3, :3] *= -1.0
    with pytest.raises(ValueError, match="mirrors"):
        from_matrix(rows)
    rows[1, 3, :3] = 0.0
    with pytest.raises(ValueError, match="has no volume"):
        from_matrix(rows)
