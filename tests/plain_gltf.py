"""glTF read as its specification says, in few lines of its own: nothing is guessed, repaired or left out."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class PlainGltf:
    """A glTF file: its JSON, its numbers, and its nodes in the world."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        data = self.path.read_bytes()
        binary = b""
        if data[:4] == b"glTF":
            (length,) = struct.unpack_from("<I", data, 12)
            text, binary = data[20 : 20 + length], data[28 + length :]
        else:
            text = data
        self.json: dict[str, Any] = json.loads(text)
        self.nodes: list[dict[str, Any]] = self.json["nodes"]
        self.buffers = [self._fetch(one["uri"]) if "uri" in one else binary for one in self.json.get("buffers", [])]

    def _fetch(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        return (self.path.parent / unquote(uri)).read_bytes()

    def view(self, index: int) -> bytes:
        """Return the bytes of a buffer view."""
        view = self.json["bufferViews"][index]
        start = view.get("byteOffset", 0)
        return self.buffers[view["buffer"]][start : start + view["byteLength"]]

    def picture(self, index: int) -> bytes:
        """Return the bytes of an image."""
        image = self.json["images"][index]
        return self.view(image["bufferView"]) if "bufferView" in image else self._fetch(image["uri"])

    def numbers(self, index: int) -> Floats:
        """Return the numbers of an accessor [n, components]."""
        shown = self.json["accessors"][index]
        dtype, width, count = np.dtype(COMPONENTS[shown["componentType"]]), WIDTHS[shown["type"]], shown["count"]
        stride = self.json["bufferViews"][shown["bufferView"]].get("byteStride") or width * dtype.itemsize
        strides = (stride, dtype.itemsize)
        data = self.view(shown["bufferView"])
        return np.ndarray((count, width), dtype, data, shown.get("byteOffset", 0), strides).astype(float)

    def tracks(self, animation: int = 0) -> dict[tuple[int, str], tuple[Floats, Floats]]:
        """Return times and values of an animation's channels, by node and path."""
        found = {}
        one = self.json["animations"][animation]
        for channel in one["channels"]:
            sampler, target = one["samplers"][channel["sampler"]], channel["target"]
            assert sampler.get("interpolation", "LINEAR") in ("LINEAR", "STEP")  # the same at keys
            values = self.numbers(sampler["output"])
            found[target["node"], target["path"]] = self.numbers(sampler["input"])[:, 0], values
        return found

    def world(self, seconds: float | None = None, animation: int = 0) -> dict[str, Floats]:
        """Return the matrices [4, 4] of named nodes in the world, at a key of an animation or as they stand."""
        tracks = {} if seconds is None else self.tracks(animation)
        out: dict[str, Floats] = {}
        parents = {child: node for node, one in enumerate(self.nodes) for child in one.get("children", [])}
        waiting = [(node, np.eye(4)) for node in range(len(self.nodes)) if node not in parents]
        while waiting:
            node, above = waiting.pop()
            one = self.nodes[node]
            local = np.array(one.get("matrix", np.eye(4).ravel()), dtype=float).reshape(4, 4).T
            trs = {"translation": [0.0] * 3, "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0] * 3} | one
            for path in ("translation", "rotation", "scale"):
                if (node, path) in tracks:
                    assert "matrix" not in one  # 3.11
                    times, values = tracks[node, path]
                    trs[path] = values[int(np.abs(times - seconds).argmin())]
            if "matrix" not in one:
                local[:3, :3] = Rotation.from_quat(trs["rotation"]).as_matrix() * np.array(trs["scale"])
                local[:3, 3] = trs["translation"]
            here = above @ local
            assert one.get("name", str(node)) not in out
            out[one.get("name", str(node))] = here
            waiting += [(child, here) for child in one.get("children", [])]
        return out


def furthest(one: dict[str, Floats], other: dict[str, Floats]) -> float:
    """Return the largest difference between the matrices of nodes that two files share."""
    shared = one.keys() & other.keys()
    assert shared
    return max(float(np.abs(one[name] - other[name]).max()) for name in shared)
