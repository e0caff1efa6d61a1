"""Several dancers in one GLB: a body and a node for each, and one animation that moves all."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from gltf_files import validated

from motionmind import MotionMindWarning, read_motion
from motionmind.ensemble.dancers import Dancer, Ensemble
from motionmind.formats.glb import write_group_glb
from motionmind.geometry import rotations as rot

PIECE = ballet_clip("jump")
NAMES = ("Anna", "Ben", "Chloe")


@pytest.fixture
def written(tmp_path: Path) -> Path:
    dancers = (Dancer(name, PIECE, (2.0 * i, 0.0), 0.3 * i, 0.5 * i, i == 2) for i, name in enumerate(NAMES))
    write_group_glb(tmp_path / "trio.glb", Ensemble("trio", tuple(dancers)).motions())
    return tmp_path / "trio.glb"


def document(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    found: dict[str, Any] = json.loads(data[20 : 20 + length])
    return found


def test_the_validator_finds_nothing(written: Path) -> None:
    assert validated(written) == []


def test_every_dancer_is_a_node_with_a_body_that_the_animation_moves(written: Path) -> None:
    found = document(written)
    nodes, skins = found["nodes"], found["skins"]
    assert [nodes[root]["name"] for root in found["scenes"][0]["nodes"][::2]] == list(NAMES)
    moved = {channel["target"]["node"] for channel in found["animations"][0]["channels"]}
    assert moved == {joint for skin in skins for joint in skin["joints"]}
    assert [skin["name"] for skin in skins] == list(NAMES)
    for skin in skins:
        assert [nodes[joint]["name"] for joint in skin["joints"]] == list(PIECE.skeleton.names)
        children = {child for joint in skin["joints"] for child in nodes[joint].get("children", ())}
        assert children == set(skin["joints"]) - {skin["skeleton"]}


def test_equal_bodies_share_a_mesh(written: Path) -> None:
    found = document(written)
    assert len(found["meshes"]) == 2, "that of a dancer in the mirror is another"


def test_the_first_dancer_is_read_again(written: Path) -> None:
    with pytest.warns(MotionMindWarning, match="Anna is read, not Ben, Chloe"):
        read = read_motion(written)
    first = replace(PIECE, name="Anna")
    np.testing.assert_allclose(read.root[0, [0, 2]], [0.0, 0.0], atol=1e-6)
    assert rot.angle(read.at(first.times - first.times[0]).rotations, first.rotations).max() < 0.05
