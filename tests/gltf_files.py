"""GLB files that tests change and write again."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.formats import write_motion
from motionmind.geometry import rotations as rot

RATE = 24.0
MIXAMO = {"pelvis": "Hips", "lumbar": "Spine", "thorax": "Spine1", "cervical": "Neck", "atlantal": "Head"} | {
    f"{side}_{joint}": side.title() + name
    for side in ("left", "right")
    for joint, name in {
        "hip": "UpLeg",
        "knee": "Leg",
        "ankle": "Foot",
        "toes": "ToeBase",
        "clavicle": "Shoulder",
        "shoulder": "Arm",
        "elbow": "ForeArm",
        "wrist": "Hand",
        "fingers": "HandMiddle1",
    }.items()
}


def wandering(skeleton: Skeleton, frames: int = 8, seed: int = 0) -> Motion:
    """Random postures, 24 a second."""
    rng = np.random.default_rng(seed)
    rotations = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    return Motion(skeleton, rotations, rng.normal(size=(frames, 3)), np.arange(frames) / RATE, name="a")


class File:
    """A GLB that is changed and written again: its JSON, its binary data, and numbers of its own."""

    def __init__(self, path: Path, motion: Motion) -> None:
        self.path = path
        write_motion(path, motion)
        data = path.read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        self.json: dict[str, Any] = json.loads(data[20 : 20 + length])
        self.data = bytearray(data[28 + length :])

    def array(self, index: int) -> Floats:
        accessor = self.json["accessors"][index]
        start = self.json["bufferViews"][accessor["bufferView"]]["byteOffset"] + accessor.get("byteOffset", 0)
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor["type"]]
        count = accessor["count"] * width
        return np.frombuffer(bytes(self.data), "<f4", count, start).reshape(-1, width).astype(float)

    def add(self, array: Floats, kind: str, dtype: str = "<f4", *, stride: int = 0) -> int:
        """Append numbers; those of integer types are normalised. Return the accessor's index."""
        rows = np.asarray(array).reshape(len(array), -1)
        if dtype != "<f4":
            rows = np.round(rows * np.iinfo(dtype).max)
        stored = rows.astype(dtype)
        padded = np.zeros((len(rows), stride or stored.nbytes // len(rows)), np.uint8)
        padded[:, : stored.nbytes // len(rows)] = stored.view(np.uint8).reshape(len(rows), -1)
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": padded.size}
        self.json["bufferViews"].append(view | ({"byteStride": stride} if stride else {}))
        self.data += padded.tobytes()
        number = {"<f4": 5126, "<i1": 5120, "<u1": 5121, "<i2": 5122, "<u2": 5123}[dtype]
        accessor = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": number, "count": len(rows)}
        self.json["accessors"].append(accessor | {"type": kind, "normalized": dtype != "<f4"})
        return len(self.json["accessors"]) - 1

    def write(self) -> Path:
        self.json["buffers"][0]["byteLength"] = len(self.data)
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.data) + b"\0" * (-len(self.data) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        self.path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return self.path

    @property
    def samplers(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self.json["animations"][0]["samplers"]
        return found


def with_clips(path: Path, clips: Sequence[tuple[str, Motion]]) -> File:
    """A file of one body with an animation for each clip, as modelling programs export them."""
    file = File(path, clips[0][1])
    for _, motion in clips[1:]:
        other = File(path.with_stem("other"), motion)
        added: dict[str, Any] = json.loads(json.dumps(other.json["animations"][0]))
        for sampler in added["samplers"]:
            for key in ("input", "output"):
                kind = other.json["accessors"][sampler[key]]["type"]
                sampler[key] = file.add(other.array(sampler[key]), kind)
        file.json["animations"].append(added)
        other.path.unlink()
    for animation, (name, _) in zip(file.json["animations"], clips, strict=True):
        animation["name"] = name
    return file


def reframed(file: File, seed: int = 1) -> None:
    """Turn the joints' frames in every direction, at rest and in movement, as bones' frames are in most programs."""
    rng = np.random.default_rng(seed)
    nodes, skin = file.json["nodes"], file.json["skins"][0]
    frames = rot.normalise(rng.normal(size=(len(nodes), 4)))
    parents = {child: node for node, one in enumerate(nodes) for child in one.get("children", [])}
    above = [frames[parents[node]] if node in parents else rot.IDENTITY for node in range(len(nodes))]
    binds = file.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    for node in skin["joints"]:
        nodes[node]["translation"] = rot.mul_vec(rot.inv(above[node]), np.array(nodes[node]["translation"])).tolist()
        local = np.array(nodes[node].get("rotation", [0, 0, 0, 1]))
        nodes[node]["rotation"] = rot.mul(rot.inv_mul(above[node], local), frames[node]).tolist()
        turned = np.eye(4)
        turned[:3, :3] = rot.to_matrix(rot.inv(frames[node]))
        binds[node] = turned @ binds[node]
    skin["inverseBindMatrices"] = file.add(binds.transpose(0, 2, 1).reshape(-1, 16), "MAT4")
    for channel in file.json["animations"][0]["channels"]:
        sampler, node = file.samplers[channel["sampler"]], channel["target"]["node"]
        if channel["target"]["path"] == "rotation":
            keys = rot.mul(rot.inv_mul(above[node], file.array(sampler["output"])), frames[node])
            sampler["output"] = file.add(keys, "VEC4")


VALIDATE = """
const validator = require("gltf-validator"), fs = require("fs");
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(
  (report) => console.log(JSON.stringify(report.issues)));
"""


@cache
def _fails(*command: str) -> bool:
    return subprocess.run(command, check=False, capture_output=True).returncode != 0


def validated(path: Path) -> list[dict[str, Any]]:
    """Return what Khronos' validator finds in a GLB; skip the test without it."""
    node = shutil.which("node")
    if node is None or _fails(node, "-e", 'require("gltf-validator")'):
        pytest.skip("Khronos' gltf-validator is not here (install it for node, and set NODE_PATH)")
    ran = subprocess.run([node, "-e", VALIDATE, str(path)], capture_output=True, text=True, check=True)
    found: list[dict[str, Any]] = json.loads(ran.stdout)["messages"]
    return found
