"""Small pictures of postures with a transparent background, for light and dark pages alike."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from io import BytesIO
from math import ceil

import numpy as np
from PIL import Image

from motionmind._typing import Floats, Pixels
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.render.body_shape import shape_of
from motionmind.render.camera import SAMPLES_PER_PX
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import colour, draw, given_colours, halved, inserted_colours
from motionmind.render.solids import bounding_box, posture_solids
from motionmind.render.view import VIEWS, to_view

THUMBNAIL_HEIGHT_PX = 96  # in the gallery, as in places.js


class Thumbnails:
    """A cache of pictures, which drops the least recently used."""

    def __init__(self) -> None:
        self._held: OrderedDict[tuple[str, int, int], bytes] = OrderedDict()
        self._size = 0
        self._drawing = asyncio.Lock()  # draw one picture at a time: it leaves a processor to the engine

    async def draw(self, key: str, motion: Motion, frame: int, height: int) -> bytes:
        """Return the picture of a movement's frame from the cache, or draw it; raise MotionMindError as `thumbnail`."""
        if (known := self._find(key, frame, height)) is not None:
            return known
        async with self._drawing:
            if (drawn := self._find(key, frame, height)) is None:  # nobody has drawn it meanwhile
                drawn = await asyncio.to_thread(thumbnail, motion, frame, height)
                self.hold(key, frame, height, drawn)
        return drawn

    def _find(self, key: str, frame: int, height: int) -> bytes | None:
        """Return a picture; None if it is not in the cache."""
        if (known := self._held.get((key, frame, height))) is not None:
            self._held.move_to_end((key, frame, height))
        return known

    def hold(self, key: str, frame: int, height: int, picture: bytes) -> None:
        """Add a picture to the cache."""
        if (key, frame, height) not in self._held:
            self._held[key, frame, height] = picture
            self._size += len(picture)
        while self._size > 16 * 2**20:
            self._size -= len(self._held.popitem(last=False)[1])


def thumbnail(motion: Motion, frame: int, height: int) -> bytes:
    """Draw a frame of a motion as PNG, in three-quarter view.

    Args:
        motion: the motion, on any skeleton.
        frame: the frame.
        height: height of the picture, pixels.

    Raises:
        MotionMindError: there is no such frame, or the height is out of range.
    """
    motion.posture(frame)
    if not 32 <= height <= 480:
        raise MotionMindError(f"a thumbnail must be 32 to 480 pixels high, not {height}")
    body, view = shape_of(motion.skeleton), VIEWS["quarter"]
    root = motion.root[frame]
    cones, balls = posture_solids(*body.solids(motion.rotations[frame][None], root[None]), 0)
    cones, balls = to_view(cones, balls, view, root * [1.0, 0.0, 1.0])
    (left, bottom), (right, top) = bounding_box(cones, balls)[:, :2]
    aspect_ratio = 0.9
    # 1.32 body heights leave room for raised arms.
    tall = max(1.32 * body.height, 1.08 * (top - bottom), 1.08 * (right - left) / aspect_ratio)
    wide = ceil(aspect_ratio * height)
    scale = height / tall
    # A standing body stands at the bottom of the picture; a leaping body is above it.
    floor = min(bottom, max(0.0, top - 0.96 * tall)) - 0.04 * tall
    corner = 0.5 * (left + right) - 0.5 * wide / scale, floor + tall
    buffer = DepthBuffer(*corner, SAMPLES_PER_PX * wide, SAMPLES_PER_PX * height, SAMPLES_PER_PX * scale)
    draw(buffer, cones, balls)
    paints = inserted_colours(body) if motion.inserted()[frame] else given_colours(body)

    def on(paper: int) -> Floats:
        background: Pixels = np.full((SAMPLES_PER_PX * height, SAMPLES_PER_PX * wide, 3), paper, dtype=np.uint8)
        return halved(colour(buffer, body, background, SAMPLES_PER_PX, paints)).astype(float)

    black, white = on(0), on(255)
    opacity = 1.0 - (white - black).mean(axis=-1, keepdims=True) / 255.0  # paper shows through where it is not covered
    inked = black / np.maximum(opacity, 1e-3)
    picture = np.concatenate([inked, 255.0 * opacity], axis=-1).clip(0.0, 255.0).round().astype(np.uint8)
    file = BytesIO()
    Image.fromarray(picture).save(file, "png")
    return file.getvalue()
