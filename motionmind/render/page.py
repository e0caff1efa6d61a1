"""A motion as a page: one HTML file that plays it in any browser, from disk, without a network.

The player's modules and three.js (in `vendor/`) lie in `player/`, as they were written; there is no build step. A page opened from
disk may not load one file from another, so each module goes into the page as a data: URL, and an import map says which
name is which. The page forbids itself every request.
"""

from __future__ import annotations

import html
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from itertools import product
from pathlib import Path
from string import Template
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.files import FilePath, write_atomically
from motionmind.render.body_shape import BodyShape, shape_of
from motionmind.render.figure import BRIDGED, COLOURS, INK, INSERTED, bridge_balls

_PLAYER = Path(__file__).parent / "player"
_THREE = {"three": "three.module.min.js", "three/core": "three.core.min.js", "three/OrbitControls": "OrbitControls.js"}
_CORE = b'from"./three.core.min.js"'  # a path means nothing to a module that is a URL of its own
_BITS = 20  # of each of the three numbers that a quaternion is written as
# Which coefficients are written of a quaternion, by which is left out.
_OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])


def page(motion: Motion, first: int = 0) -> str:
    """The page that plays `motion`, on any skeleton; `first` is its first frame's number in what it is a part of."""
    return _filled(motion, _data(motion, first), "main")


def page_beside(motion: Motion, folder: str, data: Mapping[str, Any]) -> str:
    """The page that plays `motion` beside something else: `beside.html`, `.css` and `.js` in a folder of `player/`, a
    module that finds `data` as `beside` among the page's own."""
    style, beside = (_text(f"{folder}/beside.{suffix}") for suffix in ("css", "html"))
    return _filled(motion, {**_data(motion, 0), "beside": data}, f"{folder}/beside", style, beside)


def _filled(motion: Motion, data: Mapping[str, Any], start: str, style: str = "", beside: str = "") -> str:
    """The page with all that is in it."""
    return Template(_text("page.html")).substitute(
        title=html.escape(motion.name or motion.skeleton.name),
        style=_text("player.css") + style,
        beside=beside,
        modules=_modules(start),
        # numpy's numbers are floats; within a script element nothing but "<" can end it.
        data=msgspec.json.encode(data, enc_hook=float).decode().replace("<", "\\u003c"),
        start=start,
    )


def write_page(path: FilePath, motion: Motion, first: int = 0) -> None:
    """Write the page that plays `motion` to `path`; MotionMindError if it cannot be written."""
    write_atomically(path, page(motion, first).encode())


@cache
def _modules(start: str) -> str:
    """The import map, with the module that a page starts by."""
    sources = {f"motionmind/{file.stem}": file.read_bytes() for file in sorted(_PLAYER.glob("*.js"))}
    sources[f"motionmind/{start}"] = (_PLAYER / f"{start}.js").read_bytes()
    for name, file in _THREE.items():
        sources[name] = (_PLAYER / "vendor" / file).read_bytes().replace(_CORE, b'from"three/core"')
    urls = {name: f"data:text/javascript;charset=utf-8;base64,{base64_of(source)}" for name, source in sources.items()}
    return msgspec.json.encode({"imports": urls}).decode()


def _data(motion: Motion, first: int) -> dict[str, Any]:
    """What the player reads; player/README.md says what is what."""
    skeleton = motion.skeleton
    body = shape_of(skeleton)
    return {
        "name": motion.name,
        "first": first,
        "farthest": _farthest(motion),
        "skeleton": {"names": skeleton.names, "parents": skeleton.parents, "offsets": skeleton.offsets.tolist()},
        "body": _body_data(body),
        "colours": {"given": COLOURS, "inserted": INSERTED, "bridged": BRIDGED, "ink": INK},
        "times": base64_of(motion.times.astype("<f8").tobytes()),
        "root": base64_of(motion.root.astype("<f4").tobytes()),
        "rotations": base64_of(packed(motion.rotations).tobytes()),
        "insertions": [
            {
                "times": one.times.tolist(),
                "bridged": [{"joint": skeleton.index(joint), "move": move} for joint, move in one.bridged],
            }
            for one in motion.insertions
        ],
    }


def _farthest(motion: Motion) -> list[int]:
    """Frames in which some joint is farther than in all others, in one of 26 directions."""
    joints = motion.skeleton.positions(motion.rotations, motion.root)
    found = set[int]()
    for direction in product((-1.0, 0.0, 1.0), repeat=3):
        found.add(int((joints @ np.array(direction)).max(axis=-1).argmax()))
    return sorted(found)


def _body_data(body: BodyShape) -> dict[str, Any]:
    joints = len(body.skeleton)
    marks = bridge_balls(body, np.zeros((joints, 3)), np.ones(joints, dtype=bool))
    return {
        "size": body.size,
        "frames": [asdict(frame) for frame in body.frames],
        "cones": [asdict(cone) for cone in body.cones],
        "balls": [asdict(ball) for ball in body.balls],
        "marks": marks.axes[:, 0, 0].tolist(),
    }


def packed(rotations: Floats) -> NDArray[np.uint64]:
    """Unit quaternions [..., 4] in 64 bits each [...], to 1e-6 a coefficient.

    The coefficient that is largest in size follows from the others, so it is left out; `q` and `-q` being the same
    rotation, it is taken as positive. From the highest bit on: which it is (4 bits), and the other three in their
    order, 20 bits each, as whole numbers from 0 to 2^20 - 2 for -1 / sqrt(2) to 1 / sqrt(2). Source: Fiedler,
    "Snapshot compression" (gafferongames.com, 2015), "smallest three".
    """
    largest = np.argmax(np.abs(rotations), axis=-1)
    sign = np.where(np.take_along_axis(rotations, largest[..., None], axis=-1) < 0.0, -1.0, 1.0)
    others = sign * np.take_along_axis(rotations, _OTHERS[largest], axis=-1)
    most = 2 ** (_BITS - 1) - 1
    levels = np.rint((np.sqrt(2.0) * others).clip(-1.0, 1.0) * most + most).astype("<u8")
    word = largest.astype("<u8")
    for i in range(3):
        word = word << np.uint64(_BITS) | levels[..., i]
    return np.asarray(word.astype("<u8"))


def _text(name: str) -> str:
    return (_PLAYER / name).read_text(encoding="utf-8")


def base64_of(data: bytes) -> str:
    """Bytes as a page holds them."""
    return b64encode(data).decode("ascii")
