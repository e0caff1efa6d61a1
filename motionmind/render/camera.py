"""The camera of a film: parallel projection, and a picture that shows a whole path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor

import numpy as np

from motionmind._typing import Floats
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.solids import Cones, Ellipsoids, bounding_box
from motionmind.render.view import View, to_view

Corner = tuple[int, int]

SAMPLES_PER_PX = 2  # along each side


@dataclass(frozen=True, eq=False)
class Camera:
    """A view of the world, and the extent of its picture.

    Attributes:
        view: the direction it looks from.
        origin: the point of the world [3] on the floor, metres, that is the origin of the view's axes.
        left, top: the picture's upper left corner in the view's axes, metres.
        scale: pixels to a metre.
        width, height: size of the picture, pixels, even.
        margin: width of its free edge, pixels.
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
        """Project points of the world [..., 3], metres, to x and y in the picture [..., 2], pixels, y down."""
        in_view = (points - self.origin) @ self.view.axes.T
        return np.stack([in_view[..., 0] - self.left, self.top - in_view[..., 1]], axis=-1) * self.scale

    @cached_property
    def on_floor(self) -> Floats:
        """Map x, y, 1 in the picture, pixels, to x, z on the floor, metres from the origin: an affine matrix [2, 3]."""
        right, up, towards = self.view.axes
        along = up - towards * (up[1] / towards[1])  # up in the picture, and along the floor
        return np.column_stack([right / self.scale, -along / self.scale, self.left * right + self.top * along])[[0, 2]]

    def solids(self, cones: Cones, balls: Ellipsoids, middle: Floats) -> tuple[Cones, Ellipsoids]:
        """Transform solids to the view's axes.

        Args:
            cones, balls: solids [..., N, 3] in the world, metres.
            middle: the point of the world [3], metres, that gets z = 0: the origin of haze.
        """
        towards = np.array(self.view.towards)
        return to_view(cones, balls, self.view, self.origin + towards * (towards @ (middle - self.origin)))

    def buffer(self, cones: Cones, balls: Ellipsoids, around: int) -> tuple[Corner, DepthBuffer]:
        """Allocate an empty depth buffer just large enough for solids.

        Args:
            cones, balls: solids [N, 3] in the view's axes, metres.
            around: margin, pixels of the picture.

        Returns:
            The buffer's upper left corner in the picture, x and y in pixels; and the buffer, with `SAMPLES_PER_PX`.
        """
        (left, bottom), (right, top) = bounding_box(cones, balls)[:, :2]
        x, y = (floor(edge * self.scale) - around for edge in (left - self.left, self.top - top))
        after_x, after_y = (ceil(edge * self.scale) + around for edge in (right - self.left, self.top - bottom))
        width, height = SAMPLES_PER_PX * (after_x - x), SAMPLES_PER_PX * (after_y - y)
        place = self.left + x / self.scale, self.top - y / self.scale
        return (x, y), DepthBuffer(*place, width, height, SAMPLES_PER_PX * self.scale)


def aim(view: View, origin: Floats, boxes: Floats, points: Floats, least: float, size: int, strip: int) -> Camera:
    """Aim a camera at a whole path, at the largest scale that fits.

    A long path first widens the picture, up to twice its height, and only then shrinks the body.

    Args:
        view: the direction to look from.
        origin: a point of the world on the floor [3], metres.
        boxes: least and greatest x and y of the body in each frame [F, 2, 2] in the view's axes, metres.
        points: further points to show [P, 2], in the same axes.
        least: extent at least assumed of the body, metres.
        size: height of the picture, pixels; a flat path makes it lower.
        strip: height of the strip for text at the lower edge, pixels.
    """
    corners = np.concatenate([boxes.reshape(-1, 2), points])
    low, high = corners.min(axis=0), corners.max(axis=0)
    body = max(float((boxes[:, 1] - boxes[:, 0]).max()), least)
    margin, (wide, tall) = round(0.06 * size), high - low
    body_size, max_width = 0.80 * size, 2.0 * size  # a body of 80 % of the height leaves room for its path
    room, widest = size - strip - 2 * margin, max_width - 2 * margin
    scale = float(min(body_size / body, room / tall, widest / wide))
    width = min(max(ceil(wide * scale) + 2 * margin, round(body_size)), round(max_width))
    height = min(max(ceil(tall * scale) + 2 * margin + strip, round(0.6 * size)), size)
    width, height = width + width % 2, height + height % 2  # films store colours at half the resolution
    x, y = 0.5 * (low + high)
    left, top = float(x - 0.5 * width / scale), float(y + 0.5 * (height - strip) / scale)
    return Camera(view, origin, left, top, scale, width, height, margin)
