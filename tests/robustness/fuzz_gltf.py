"""Generates glTF files of many joints, with samplers, accessors and buffers that are shared or overlap."""

from __future__ import annotations

import base64
import json
import random
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from fuzz_structures import MAX_BYTES, SIZES, TEXTS

MATRIX = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0.1, 0, 1]
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class _Numbers:
    """Times, then rotations, in one buffer; and accessors to them."""

    def __init__(self, rng: random.Random) -> None:
        self.rng, self.keys = rng, rng.choice([1, 2, 2, 3, 30, 30, 700, 5000, 50_000])
        span = rng.choice([1.0, self.keys / 30.0, self.keys / 30.0, 100.0, 4000.0, 1e9])
        rows = np.linspace(0.0, span, self.keys), np.tile([0.1, 0.2, 0.6, 0.8], 3 * self.keys)
        self.pool = np.concatenate(rows).astype("<f4").tobytes()
        self.views: list[dict[str, Any]] = [{"buffer": 0, "byteLength": len(self.pool)}]
        self.accessors: list[dict[str, Any]] = []

    def accessor(self, kind: str, count: int, later: int = 0) -> int:
        """Return a new accessor to the first numbers, or to later ones; few have a fault."""
        start = 0 if kind == "SCALAR" else 4 * self.keys + 4 * later
        faults = [
            {"count": self.rng.choice(SIZES)},
            {"sparse": {"count": 1}},
            {"type": "VEC2"},
            {"componentType": 5121},
        ]
        room = max((len(self.pool) - start) // (4 * WIDTHS[kind]), 1)
        entry = {"bufferView": 0, "byteOffset": start, "componentType": 5126, "type": kind, "count": min(count, room)}
        self.accessors.append(entry | (self.rng.choice(faults) if self.rng.random() < 0.01 else {}))
        return len(self.accessors) - 1

    def matrices(self, count: int) -> int:
        """Return a new accessor to as many matrices in a row."""
        start = len(self.pool)
        self.pool += np.tile(MATRIX, count).astype("<f4").tobytes()
        self.views.append({"buffer": 0, "byteOffset": start, "byteLength": len(self.pool) - start})
        entry = {"bufferView": len(self.views) - 1, "componentType": 5126, "type": "MAT4", "count": count}
        self.accessors.append(entry)
        return len(self.accessors) - 1


def _animation(rng: random.Random, numbers: _Numbers, moved: Sequence[int]) -> dict[str, Any]:
    """An animation of nodes, which share samplers, accessors, bytes in part, or only their times."""
    share = rng.choice(["sampler", "accessor", "bytes", "nothing"])
    kind = rng.choice(["LINEAR", "LINEAR", "LINEAR", "STEP", "CUBICSPLINE"])
    count = numbers.keys * (3 if kind == "CUBICSPLINE" else 1)
    clock = numbers.accessor("SCALAR", numbers.keys)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    for path in ["rotation", "translation", "weights", "scale"][: rng.choice([1, 1, 2, 2, 3, 4])]:
        width = "VEC4" if path == "rotation" else "VEC3"
        output = numbers.accessor(width, count)
        for number, node in enumerate(moved):
            if share != "sampler" or not number:
                one = output if share == "accessor" else numbers.accessor(width, count, number * (share == "bytes"))
                samplers.append({"input": clock, "output": one, "interpolation": kind})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
    return {"name": rng.choice(TEXTS[:4]), "samplers": samplers, "channels": channels}


def _document(rng: random.Random) -> tuple[dict[str, Any], bytes]:
    """A body of few or very many joints, and its numbers."""
    count = rng.randint(1, rng.choice([1, 2, 5, 30, 30, 30, 30, 30, 30, 300, 300, 4500]))
    shape, numbers = rng.choice(["chain", "star", "tree", "comb"]), _Numbers(rng)
    words = rng.choice([["a"], [f"j{i}" for i in range(count)], ["Hips", "Spine", "LeftArm", "RightLeg"], TEXTS[:4]])
    places = [{"translation": [0, 0.1, 0]}] * 30 + [{}, {"matrix": MATRIX}, {"scale": [1, 2, 1]}]
    nodes: list[dict[str, Any]] = [{"name": rng.choice(words), **rng.choice(places)} for _ in range(count)]
    for node in range(1, count):
        above = {"chain": node - 1, "star": 0, "tree": (node - 1) // 2, "comb": (node - 1) & ~1}[shape]
        nodes[above].setdefault("children", []).append(node)
    animations = [
        _animation(rng, numbers, rng.sample(range(count), rng.choice([count, min(count, 2)])))
        for _ in range(rng.choice([0, 1, 1, 1, 1, 2, 9]))
    ]
    skins, bind = [], numbers.matrices(count)
    for number in range(rng.choice([0, 0, 1, 1, 2, 300, 5000])):
        joints = rng.sample(range(count), rng.choice([count if number < 3 else 1, 1, min(count, 2)]))
        bound = {"inverseBindMatrices": bind} if rng.random() < 0.1 else {}
        skins.append({"joints": joints} | bound)
    if rng.random() < 0.1:
        marks = {"insertions": [{"times": [i, i + 0.5]} for i in range(rng.choice([0, 1, 9000]))]}
        nodes[0]["extras"] = {"motionmind": json.dumps(marks)}
    document = {"asset": {"version": "2.0"}, "nodes": nodes, "skins": skins, "animations": animations}
    document |= {"accessors": numbers.accessors, "bufferViews": numbers.views}
    return document | {"buffers": [{"byteLength": len(numbers.pool)}]}, numbers.pool


def gltf_binaries(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """A generated body in a GLB."""
    document, pool = _document(rng)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(pool), b"BIN\0") + pool
    data = struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
    return data if len(data) < MAX_BYTES else gltf_binaries(seeds, rng)


def gltf_texts(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """A generated body in text, with its data in many buffers that are the same, or that are the file itself."""
    document, pool = _document(rng)
    whole = {"uri": f"data:application/octet-stream;base64,{base64.b64encode(pool).decode()}"}
    times = rng.choice([1, 1, 2, 5000])
    itself = [{"uri": "a.gltf"}, {"uri": "./a.gltf"}, {"uri": "%61.gltf"}]
    document["buffers"] = [whole, *(rng.choice(itself) for _ in range(times))]
    for number, one in enumerate(document["accessors"][1:]):
        if number and rng.random() < 0.1:
            document["bufferViews"].append({"buffer": 1 + number % times, "byteLength": rng.choice([100, 10**5])})
            one["bufferView"] = len(document["bufferViews"]) - 1
    data = json.dumps(document).encode()
    return data if len(data) < MAX_BYTES else gltf_texts(seeds, rng)
