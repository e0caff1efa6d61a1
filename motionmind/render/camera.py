"""Where a stage is seen from, and the camera: parallel projection, and a window that takes in all of a path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import ceil, cos, floor, radians, sin

import numpy as np

from motionmind._typing import Floats
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import ABOVE, View, seen
from motionmind.render.solids import Cones, Ellipsoids

Corner = tuple[int, int]

SMOOTH = 2  # samples a pixel, each way
_MARGIN = 0.06  # of the picture's height: between the body and the picture's edges
_TALL = 0.80  # of the picture's height: the most that a body may be wide, which leaves room for its path
_FLAT = 0.6  # of the height that was asked for: the least that a picture has
_WIDE = 2.0  # by its height: how wide a picture may be


def _view(name: str, azimuth: float, elevation: float) -> View:
    """The view from `azimuth` degrees to the performer's left of the front, and from `elevation` degrees above."""
    a, e = radians(azimuth), radians(elevation)
    towards = (cos(e) * sin(a), sin(e), cos(e) * cos(a))
    return View(name, (cos(a), 0.0, -sin(a)), (-sin(e) * sin(a), cos(e), -sin(e) * cos(a)), towards)


# Seen from a little above, as from a raised seat, a floor is a floor.
VIEWS: Mapping[str, View] = {
    "quarter": _view("three quarters, from the audience's left", -32.0, 17.0),
    "front": _view("from the front, as the audience sees it", 0.0, 9.0),
    "side": _view("from stage right: the audience is to the right", -90.0, 9.0),
    "left": _view("from stage left: the audience is to the left", 90.0, 9.0),
    "top": ABOVE,
}


@dataclass(frozen=True, eq=False)
class Camera:
    """A view of the world, and the picture that is taken of it.

    Attributes:
        view: where it looks from.
        origin: the place [3] of the world, metres, on the floor, that is the origin of the view's axes.
        left, top: the picture's upper left corner in the view's axes, metres.
        scale: pixels to a metre.
        width, height: pixels of the picture, even numbers.
        margin: pixels that it leaves free at the edges.
    """

    view: View
    origin: Floats
    left: float
    top: float
    scale: float
    width: int
    height: int
    margin: int

    def to_pixels(self, points: Floats) -> Floats:
        """Where points of the world [..., 3], metres, are in the picture [..., 2], pixels."""
        there = (points - self.origin) @ self.view.axes.T
        return np.stack([there[..., 0] - self.left, self.top - there[..., 1]], axis=-1) * self.scale

    @cached_property
    def on_floor(self) -> Floats:
        """The affine map [2, 3] from x, y, 1 in the picture, pixels, to x, z on the floor, metres from the origin."""
        right, up, towards = self.view.axes
        along = up - towards * (up[1] / towards[1])  # up the picture, and along the floor
        return np.column_stack([right / self.scale, -along / self.scale, self.left * right + self.top * along])[[0, 2]]

    def solids(self, cones: Cones, balls: Ellipsoids, middle: Floats) -> tuple[Cones, Ellipsoids]:
        """Solids of the world in the view's axes; z is counted from the place `middle` [3], for haze."""
        towards = np.array(self.view.towards)
        return seen(cones, balls, self.view, self.origin + towards * (towards @ (middle - self.origin)))

    def canvas(self, cones: Cones, balls: Ellipsoids, around: int) -> tuple[Corner, DepthBuffer]:
        """An empty canvas for solids in the view's axes, `around` pixels larger, and its corner in the picture."""
        low, high = np.concatenate([cones.reach(), balls.reach()], axis=-2)[..., :2]
        (left, bottom), (right, top) = low.min(axis=0), high.max(axis=0)
        x, y = (floor(edge * self.scale) - around for edge in (left - self.left, self.top - top))
        after_x, after_y = (ceil(edge * self.scale) + around for edge in (right - self.left, self.top - bottom))
        width, height = SMOOTH * (after_x - x), SMOOTH * (after_y - y)
        place = self.left + x / self.scale, self.top - y / self.scale
        return (x, y), DepthBuffer(*place, width, height, SMOOTH * self.scale)


def aim(view: View, origin: Floats, boxes: Floats, points: Floats, least: float, size: int, strip: int) -> Camera:
    """The camera that takes in all of a path, as large as the picture allows.

    A long path makes the picture wider, up to twice its height, before it makes the body smaller.

    Args:
        view: where it looks from.
        origin: a place [3] of the world on the floor, metres.
        boxes: of each frame the body's least and greatest x and y [F, 2, 2] in the view's axes, metres.
        points: what else is to be seen [P, 2], in these axes.
        least: metres: a body that is smaller is not made to fill the picture.
        size: height of the picture in pixels; it is less high where the path is flat.
        strip: pixels at its lower edge that are for words.
    """
    everything = np.concatenate([boxes.reshape(-1, 2), points])
    low, high = everything.min(axis=0), everything.max(axis=0)
    body = max(float((boxes[:, 1] - boxes[:, 0]).max()), least)
    margin, (wide, tall) = round(_MARGIN * size), high - low
    room, widest = size - strip - 2 * margin, _WIDE * size - 2 * margin
    scale = float(min(_TALL * size / body, room / tall, widest / wide))
    width = min(max(ceil(wide * scale) + 2 * margin, round(_TALL * size)), round(_WIDE * size))
    height = min(max(ceil(tall * scale) + 2 * margin + strip, round(_FLAT * size)), size)
    width, height = width + width % 2, height + height % 2  # films store colours at half the size
    x, y = 0.5 * (low + high)
    left, top = float(x - 0.5 * width / scale), float(y + 0.5 * (height - strip) / scale)
    return Camera(view, origin, left, top, scale, width, height, margin)
