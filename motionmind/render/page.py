"""A motion as a page: one HTML file that plays it in any browser, from disk, without a network.

The player's modules are in `player/`, three.js in `player/vendor/`; there is no build step. A page opened from disk may
not load files, so the page holds each module as a data: URL, and an import map names it. The page's content security
policy forbids every request.
"""

from __future__ import annotations

import html
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from itertools import product
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats
from motionmind.body.contact import find_feet
from motionmind.body.mirror import sides_of
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.body.stage import check_stage
from motionmind.credits.ledger import ledger_of, sections_of
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.music.sound import Sound
from motionmind.render.body_shape import shape_of
from motionmind.render.body_solids import BodyShape
from motionmind.render.figure import bridge_balls
from motionmind.render.markup import base64_of
from motionmind.render.palette import BRIDGED, COLOURS, INK, INSERTED

MAX_PAGE_SOUND_BYTES = 30_000_000  # of a page, as FLAC: about five minutes of stereo
_PLAYER_DIR = Path(__file__).parent / "player"


def page(motion: Motion, first: int = 0, sound: Sound | None = None, stage: tuple[float, float] | None = None) -> str:
    """Build the HTML page that plays a motion.

    Args:
        motion: the motion, on any skeleton.
        first: number of the motion's first frame in the longer motion that it is a part of.
        sound: sound that begins with the motion; the page holds as much of it as the motion lasts.
        stage: width and depth of the stage around the origin, metres, whose edge the floor plan shows; None for none.

    Raises:
        MotionMindError: the sound is too large for a page, or the stage is out of range.
    """
    seconds = float(motion.times[-1] - motion.times[0])
    return _fill(
        motion, player_data(motion, first) | stage_data(stage) | sound_data(motion.name, seconds, sound), "main"
    )


def page_beside(motion: Motion, folder: str, data: Mapping[str, Any]) -> str:
    """Build the HTML page that plays a motion beside something else.

    Args:
        motion: the motion, on any skeleton.
        folder: a folder of `player/` with `beside.html`, `beside.css` and `beside.js`.
        data: the data that this module reads, as `beside` in the page's data.
    """
    style, beside = (_text(f"{folder}/beside.{suffix}") for suffix in ("css", "html"))
    return _fill(motion, {**player_data(motion), "beside": data}, f"{folder}/beside", style, beside)


def _fill(motion: Motion, data: Mapping[str, Any], start: str, style: str = "", beside: str = "") -> str:
    """Fill the template of the page with a motion."""
    is_known = bool(motion.insertions or motion.recorded)
    data = {"credits": sections_of(ledger_of(motion.credits)) if is_known else {}, **data}
    return fill_page(motion.name or motion.skeleton.name, data, start, style, beside)


def fill_page(title: str, data: Mapping[str, Any], start: str, style: str = "", beside: str = "") -> str:
    """Fill the template of the page.

    Args:
        title: the title.
        data: the data that the player reads, as documented in player/README.md.
        start: the module that starts the page.
        style: style sheet after the player's own.
        beside: HTML before the player.
    """
    return Template(_text("page.html")).substitute(
        title=html.escape(displayed(title)),
        style=_text("player.css") + style,
        beside=beside,
        modules=_modules(start),
        # numpy's scalars become floats; only "<" could end the script element.
        data=msgspec.json.encode(data, enc_hook=float).decode().replace("<", "\\u003c"),
        start=start,
    )


def write_page(
    path: FilePath,
    motion: Motion,
    first: int = 0,
    sound: Sound | None = None,
    stage: tuple[float, float] | None = None,
) -> None:
    """Write the page that plays a motion; arguments as of `page`.

    Raises:
        MotionMindError: the file cannot be written, the sound is too large for it, or the stage is out of range.
    """
    write_atomically(path, page(motion, first, sound, stage).encode())


def stage_data(stage: tuple[float, float] | None) -> dict[str, Any]:
    """Return the width and depth of a stage as the player reads them; nothing for no stage.

    Raises:
        MotionMindError: they are out of range.
    """
    return {} if stage is None else {"stage": check_stage(stage)}


def sound_data(name: str, seconds: float, sound: Sound | None) -> dict[str, str]:
    """Return the sound of movement of so many seconds as the player reads it; nothing without sound or movement.

    Raises:
        MotionMindError: the sound is too large for a page.
    """
    if sound is None or seconds <= 0.0:
        return {}
    data = sound.part(0.0, seconds).encode("FLAC")
    if len(data) > MAX_PAGE_SOUND_BYTES:
        raise MotionMindError(
            f"{name or 'motion'}: {len(data) / 1e6:.0f} MB of sound are too much for a page, which holds "
            f"{MAX_PAGE_SOUND_BYTES / 1e6:.0f}: show a shorter part, or make an .mp4"
        )
    return {"sound": base64_of(data)}


@cache
def _modules(start: str) -> str:
    """Build the import map, including the module that the page starts with."""
    sources = {f"motionmind/{file.stem}": file.read_bytes() for file in sorted(_PLAYER_DIR.glob("*.js"))}
    sources[f"motionmind/{start}"] = (_PLAYER_DIR / f"{start}.js").read_bytes()
    vendored = ("three", "three.module.min"), ("three/core", "three.core.min"), ("three/OrbitControls", "OrbitControls")
    for name, file in vendored:
        source = (_PLAYER_DIR / "vendor" / f"{file}.js").read_bytes()
        # A module in a data: URL cannot import by path.
        sources[name] = source.replace(b'from"./three.core.min.js"', b'from"three/core"')
    # Percent-encoded text makes a page a tenth smaller than base64, and packs to two thirds. These characters may
    # stand unquoted in a data: URL, in JSON and in a script element.
    plain = "".join(chr(code) for code in range(33, 127) if chr(code) not in '%#"<\\')
    urls = {name: f"data:text/javascript;charset=utf-8,{quote(source, safe=plain)}" for name, source in sources.items()}
    return msgspec.json.encode({"imports": urls}).decode()


def player_data(motion: Motion, first: int = 0) -> dict[str, Any]:
    """Build the data that the player reads, as documented in player/README.md."""
    skeleton = motion.skeleton
    body = shape_of(skeleton)
    return {
        "name": displayed(motion.name),
        "first": first,
        "farthest": _farthest(motion),
        "skeleton": {
            "names": [displayed(name) for name in skeleton.names],
            "parents": skeleton.parents,
            "offsets": skeleton.offsets.tolist(),
        },
        "body": _body_data(body),
        "colours": {"given": COLOURS, "inserted": INSERTED, "bridged": BRIDGED, "ink": INK},
        "times": base64_of(motion.times.astype("<f8").tobytes()),
        "root": base64_of(motion.root.astype("<f4").tobytes()),
        "rotations": base64_of(packed(motion.rotations).tobytes()),
        "insertions": [
            {
                "times": insertion.times.tolist(),
                "bridged": [{"joint": skeleton.index(joint), "move": move} for joint, move in insertion.bridged],
            }
            for insertion in motion.insertions
        ],
    }


def _farthest(motion: Motion) -> list[int]:
    """Find the frames in which the body reaches farthest, in each of 26 directions."""
    joints = motion.skeleton.positions(motion.rotations, motion.root)
    frames = set[int]()
    for direction in product((-1.0, 0.0, 1.0), repeat=3):
        frames.add(int((joints @ np.array(direction)).max(axis=-1).argmax()))
    return sorted(frames)


def _body_data(body: BodyShape) -> dict[str, Any]:
    joints = len(body.skeleton)
    marks = bridge_balls(body, np.zeros((joints, 3)), np.ones(joints, dtype=bool))
    return {
        "size": body.size,
        "frames": [asdict(frame) for frame in body.frames],
        "cones": [asdict(cone) for cone in body.cones],
        "balls": [asdict(ball) for ball in body.balls],
        "marks": marks.axes[:, 0, 0].tolist(),
        "trails": _trails(body.skeleton),
    }


def _trails(skeleton: Skeleton) -> dict[str, list[dict[str, Any]]]:
    """Return the joints whose paths can be drawn, each with its paint, by body part; a foot without an ankle counts."""
    sides, joints = sides_of(skeleton), range(len(skeleton))
    wrists, ankles = ([one for one in joints if skeleton.names[one].endswith(end)] for end in ("wrist", "ankle"))
    chosen = {"hands": wrists, "feet": ankles or find_feet(skeleton), "pelvis": [0]}
    return {part: [{"joint": one, "paint": sides[one]} for one in ends] for part, ends in chosen.items()}


def packed(rotations: Floats) -> NDArray[np.uint64]:
    """Pack unit quaternions into 64 bits each, to 1e-6 a coefficient.

    The coefficient of largest magnitude follows from the others and is left out; `q` and `-q` are the same rotation, so
    it is made positive. From the highest bit: its index (4 bits), then the other three in order, 20 bits each, as
    whole numbers from 0 to 2^20 - 2 for -1 / sqrt(2) to 1 / sqrt(2). Source: Fiedler, "Snapshot compression"
    (gafferongames.com, 2015), "smallest three".

    Args:
        rotations: x, y, z, w [..., 4].

    Returns:
        Words [...].
    """
    largest = np.argmax(np.abs(rotations), axis=-1)
    sign = np.where(np.take_along_axis(rotations, largest[..., None], axis=-1) < 0.0, -1.0, 1.0)
    kept = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    others = sign * np.take_along_axis(rotations, kept, axis=-1)
    bits = 20
    most = 2 ** (bits - 1) - 1
    levels = np.rint((np.sqrt(2.0) * others).clip(-1.0, 1.0) * most + most).astype("<u8")
    word = largest.astype("<u8")
    for i in range(3):
        word = word << np.uint64(bits) | levels[..., i]
    return np.asarray(word.astype("<u8"))


def _text(name: str) -> str:
    return (_PLAYER_DIR / name).read_text(encoding="utf-8")
