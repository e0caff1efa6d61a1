"""Pictures that were looked at and found right: what is drawn today must still look like them.

Each is one posture, without words, whose fonts differ between versions of Pillow. After a change that is meant to be
seen, `MOTIONMIND_GOLDEN=write pytest tests/render/test_golden.py` draws them anew into the folder golden; look at each.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import ant
from PIL import Image
from test_render import moved

from motionmind._typing import Pixels
from motionmind.body.human import human23, human44
from motionmind.body.mirror import LEFT, RIGHT
from motionmind.body.motion import Insertion, Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.render import palette
from motionmind.render.body_shape import shape_of
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import colour, draw, halved
from motionmind.render.sheet import _Sheet
from motionmind.render.view import FRONT, STAGE_RIGHT, to_view

GOLDEN = Path(__file__).parent / "golden"
OFF = 16  # of 255, in any of red, green and blue: more is another colour, or another edge
SHARE = 0.0005  # of all pixels that may be off: rounding moves an edge by a pixel here and there


def bent(skeleton: Skeleton, **turns: tuple[float, float, float]) -> Posture:
    """A skeleton at rest, but for some joints' rotation vectors, radians."""
    rotations = np.tile(rot.IDENTITY, (len(skeleton), 1))
    for joint, turn in turns.items():
        rotations[skeleton.index(joint)] = rot.exp(np.array(turn))
    return Posture(skeleton, rotations, np.zeros(3))


def standing(**turns: tuple[float, float, float]) -> Posture:
    """human23, bent, with its lowest solid on the floor."""
    posture = bent(human23(), **turns)
    cones, balls = shape_of(human23()).solids(posture.rotations, posture.root)
    lowest = min(cones.bounds()[0, :, 1].min(), balls.bounds()[0, :, 1].min())
    return replace(posture, root=np.array([0.0, -lowest, 0.0]))


def in_arabesque(knee: float = 0.0) -> Posture:
    """On the left leg, the right one behind, its knee bent, radians; one arm to the audience, the other to the side."""
    return standing(
        pelvis=(0.35, 0.0, 0.0),
        left_hip=(-0.35, 0.0, 0.0),
        right_hip=(1.2, 0.0, 0.0),
        right_knee=(knee, 0.0, 0.0),
        right_ankle=(0.9, 0.0, 0.0),
        thorax=(-0.35, 0.0, 0.0),
        left_shoulder=(0.0, -1.4, 0.0),
    )


def tile(motion: Motion, frame: int) -> Pixels:
    """One posture as contact sheets show it, from the front and from the side."""
    sheet = _Sheet(motion, [frame], STAGE_RIGHT)
    return np.hstack([np.asarray(sheet._view(0, window)) for window in sheet.windows])


def arabesque() -> Pixels:
    return tile(in_arabesque().as_motion(), 0)


def hexapod() -> Pixels:
    """An insect whose left middle leg is lifted and whose right hind leg is ahead."""
    posture = bent(ant(), left_mid_femur=(0.0, 0.0, 0.6), right_hind_femur=(0.0, -0.7, 0.0))
    return tile(moved(posture.as_motion(), 0.0, 0.0062, 0.0), 0)


def hand() -> Pixels:
    """The left palm of human44, the fingers half closed, from the front."""
    curled = dict.fromkeys(("left_fingers", "left_fingers_middle", "left_fingers_end"), (0.0, 0.0, -0.7))
    posture = bent(human44(), left_elbow=(-0.9, 0.0, 0.0), left_wrist=(-0.5, 0.0, 0.2), **curled)
    body = shape_of(posture.skeleton)
    fingers = posture.skeleton.positions(posture.rotations, posture.root)[posture.skeleton.index("left_fingers")]
    buffer = DepthBuffer(-0.15, 0.1, 360, 240, 1200.0)
    draw(buffer, *to_view(*body.solids(posture.rotations, posture.root), FRONT, fingers))
    return halved(colour(buffer, body, np.full((240, 360, 3), 255, dtype=np.uint8)))


def inserted() -> Pixels:
    """Half-way from arabesque to an upright stand, the left hip and the right wrist bridged."""
    a, b = in_arabesque(), standing(left_shoulder=(0.0, 0.0, -1.2), right_shoulder=(0.0, 0.0, 1.2))
    between = rot.normalise(rot.slerp(a.rotations, b.rotations, 0.5))
    return tile(
        Motion(
            a.skeleton,
            np.stack([a.rotations, between, b.rotations]),
            np.stack([a.root, 0.5 * (a.root + b.root), b.root]),
            np.arange(3.0),
            insertions=(Insertion(np.array([0.0, 2.0]), (("left_hip", 0), ("right_wrist", 0))),),
        ),
        1,
    )


PICTURES: dict[str, Callable[[], Pixels]] = {
    picture.__name__: picture for picture in (arabesque, hexapod, hand, inserted)
}


def off(one: Pixels, other: Pixels) -> float:
    """The share of pixels that differ; 1 where the shapes do."""
    if one.shape != other.shape:
        return 1.0
    return float((np.abs(one.astype(int) - other).max(axis=-1) > OFF).mean())


def golden(name: str) -> Pixels:
    with Image.open(GOLDEN / f"{name}.png") as picture:
        return np.asarray(picture.convert("RGB"))


@pytest.mark.parametrize("name", PICTURES)
def test_it_looks_as_it_did(name: str) -> None:
    drawn = PICTURES[name]()
    if os.environ.get("MOTIONMIND_GOLDEN") == "write":
        GOLDEN.mkdir(exist_ok=True)
        Image.fromarray(drawn & 0xF8 | 4).save(
            GOLDEN / f"{name}.png", optimize=True
        )  # 4 off at most, and half as large
    assert off(drawn, golden(name)) < SHARE


def test_a_knee_that_bends_is_noticed() -> None:
    assert off(tile(in_arabesque(knee=0.2).as_motion(), 0), golden("arabesque")) > SHARE
    assert off(tile(in_arabesque(knee=-0.2).as_motion(), 0), golden("arabesque")) > SHARE


@pytest.mark.parametrize("name", PICTURES)
def test_colours_that_are_exchanged_are_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for colours in (palette.COLOURS, palette.INSERTED):
        exchanged = {LEFT: colours[RIGHT], RIGHT: colours[LEFT]}
        for side, paint in exchanged.items():
            monkeypatch.setitem(colours, side, paint)
    assert off(PICTURES[name](), golden(name)) > SHARE


def test_a_bridge_that_is_not_marked_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Motion, "bridged", lambda motion: np.zeros((len(motion), len(motion.skeleton)), dtype=bool))
    assert off(inserted(), golden("inserted")) > SHARE
