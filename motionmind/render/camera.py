"""The camera of a film: parallel projection, and a picture that takes in all of a path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor

import numpy as np

from motionmind._typing import Floats
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.solids import Cones, Ellipsoids
from motionmind.render.view import View, to_view

Corner = tuple[int, int]

SMOOTH = 2  # samples a pixel, each way
# Shares of the picture's height:
_MARGIN = 0.06  # the free edge around the body
_TALL = 0.80  # the largest extent of a body, which leaves room for its path
_FLAT = 0.6  # the least height of a picture, by the height that `aim` is given
_WIDE = 2.0  # the greatest width of a picture


@dataclass(frozen=True, eq=False)
class Camera:
    """A view of the world and the picture taken of it.

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
            middle: the point of the world [3] whose z becomes 0, from which haze counts.
        """
        towards = np.array(self.view.towards)
        return to_view(cones, balls, self.view, self.origin + towards * (towards @ (middle - self.origin)))

    def buffer(self, cones: Cones, balls: Ellipsoids, around: int) -> tuple[Corner, DepthBuffer]:
        """Allocate an empty depth buffer just large enough for solids.

        Args:
            cones, balls: solids [N, 3] in the view's axes, metres.
            around: margin, pixels of the picture.

        Returns:
            The buffer's upper left corner in the picture, x and y in pixels; and the buffer, `SMOOTH` samples a pixel.
        """
        low, high = np.concatenate([cones.reach(), balls.reach()], axis=-2)[..., :2]
        (left, bottom), (right, top) = low.min(axis=0), high.max(axis=0)
        x, y = (floor(edge * self.scale) - around for edge in (left - self.left, self.top - top))
        after_x, after_y = (ceil(edge * self.scale) + around for edge in (right - self.left, self.top - bottom))
        width, height = SMOOTH * (after_x - x), SMOOTH * (after_y - y)
        place = self.left + x / self.scale, self.top - y / self.scale
        return (x, y), DepthBuffer(*place, width, height, SMOOTH * self.scale)


def aim(view: View, origin: Floats, boxes: Floats, points: Floats, least: float, size: int, strip: int) -> Camera:
    """Aim a camera so that the picture takes in all of a path, at the largest scale that fits.

    A long path first widens the picture, up to twice its height, and only then shrinks the body.

    Args:
        view: the direction to look from.
        origin: a point of the world on the floor [3], metres.
        boxes: least and greatest x and y of the body in each frame [F, 2, 2] in the view's axes, metres.
        points: further points to take in [P, 2], in the same axes.
        least: extent that a body is scaled as if it had, if it is smaller, metres.
        size: height of the picture, pixels; a flat path makes it lower.
        strip: height at its lower edge reserved for words, pixels.
    """
    corners = np.concatenate([boxes.reshape(-1, 2), points])
    low, high = corners.min(axis=0), corners.max(axis=0)
    body = max(float((boxes[:, 1] - boxes[:, 0]).max()), least)
    margin, (wide, tall) = round(_MARGIN * size), high - low
    room, widest = size - strip - 2 * margin, _WIDE * size - 2 * margin
    scale = float(min(_TALL * size / body, room / tall, widest / wide))
    width = min(max(ceil(wide * scale) + 2 * margin, round(_TALL * size)), round(_WIDE * size))
    height = min(max(ceil(tall * scale) + 2 * margin + strip, round(_FLAT * size)), size)
    width, height = width + width % 2, height + height % 2  # films store colours at half the resolution
    x, y = 0.5 * (low + high)
    left, top = float(x - 0.5 * width / scale), float(y + 0.5 * (height - strip) / scale)
    return Camera(view, origin, left, top, scale, width, height, margin)
