"""The floor of a stage, and the shadows on it."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np
from PIL import Image, ImageChops, ImageFilter

from motionmind._typing import Floats, Pixels, Singles
from motionmind.body.human import human23
from motionmind.render.camera import Camera, Corner
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import draw
from motionmind.render.palette import PAPER, STAGE
from motionmind.render.solids import Cones, Ellipsoids, bounding_box
from motionmind.render.view import View, to_view

# Layers of a shadow: darkness on the floor; then, by the body's height, the height over which it falls by e, and the
# width of its soft edge. The first layer shows contact with the floor, the second where the body is.
_SHADOW_LAYERS = ((0.40, 0.06, 0.011), (0.32, 0.40, 0.035))
_FROM_BELOW = View("from under the floor", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))


@dataclass(frozen=True, eq=False)
class Shadow:
    """The darkness of the floor in a part of the picture.

    Attributes:
        corner: x and y of the part's upper left corner, pixels.
        dark: darkness [h, w], 0 to 1.
    """

    corner: Corner
    dark: Singles


class Ground:
    """The floor at height 0 under a path, with a grid; around the path it fades into the paper.

    Attributes:
        camera: the camera.
        low, high: least and greatest x and z [2] of the path, metres.
        apron: distance from these over which the floor fades, metres.
        step: spacing of the grid, metres: a power of ten, 1 for people, 0.01 for insects.
    """

    def __init__(self, camera: Camera, low: Floats, high: Floats, height: float) -> None:
        """Lay the floor under a path.

        Args:
            camera: the camera.
            low, high: least and greatest x and z of the path [2], metres.
            height: height of the body, metres.
        """
        self.camera, self.low, self.high = camera, low, high
        self._height = height
        self.apron = 1.1 * height
        self.step = 10.0 ** round(log10(height / human23().height))

    def picture(self, line: float) -> Pixels:
        """Draw the empty floor [H, W, 3], RGB; `line` is the width of the grid's lines, pixels."""
        camera = self.camera
        picture = np.tile(np.array(PAPER, dtype=np.float32), (camera.height, camera.width, 1))
        y, x = np.mgrid[: camera.height, : camera.width].astype(np.float32) + np.float32(0.5)
        opacity, lines = np.ones_like(x), np.zeros_like(x)
        for axis, row in enumerate(camera.on_floor):
            place = row[0] * x + row[1] * y + (row[2] + camera.origin[2 * axis])
            beyond = np.maximum(self.low[axis] - place, place - self.high[axis]) / self.apron
            share = np.clip(beyond, 0.0, 1.0)
            opacity *= 1.0 - share * share * (3.0 - 2.0 * share)
            steps = place / self.step
            off = np.abs(steps - np.round(steps)) * self.step / np.hypot(row[0], row[1])  # pixels from a line's middle
            lines = np.maximum(lines, np.clip(0.5 * line + 0.5 - off, 0.0, 1.0))
        for ink, share in ((STAGE.ground, opacity), (STAGE.grid, opacity * lines)):
            picture += share[..., None] * (np.array(ink, dtype=np.float32) - picture)
        return np.round(picture).astype(np.uint8)

    def shadow(self, cones: Cones, balls: Ellipsoids) -> Shadow:
        """Cast the shadow of solids [N, 3] in the world, metres: darker under what is lower.

        A depth buffer seen from under the floor is blurred, and an affine map lays it on the floor.
        """
        camera, soft = self.camera, self._height * max(soft for _, _, soft in _SHADOW_LAYERS)
        fine = 110.0 / self._height  # samples a metre
        cones, balls = to_view(cones, balls, _FROM_BELOW, camera.origin)
        low, high = bounding_box(cones, balls)[:, :2]
        (left, near), (right, far) = low - 3.0 * soft, high + 3.0 * soft
        buffer = DepthBuffer(left, far, ceil((right - left) * fine), ceil((far - near) * fine), fine)
        draw(buffer, cones, balls)
        touching, over = (self._layer(buffer, fine, *layer) for layer in _SHADOW_LAYERS)

        corners = camera.to_pixels(camera.origin + [(x, 0.0, z) for x in (left, right) for z in (near, far)])
        x, y = (max(floor(edge), 0) for edge in corners.min(axis=0))
        after_x, after_y = (ceil(edge) for edge in corners.max(axis=0))
        size = max(min(after_x, camera.width) - x, 1), max(min(after_y, camera.height) - y, 1)
        to_samples = fine * camera.on_floor * [[1.0], [-1.0]]
        to_samples[:, 2] += to_samples[:, :2] @ [x, y] + [-fine * left, fine * far]
        laid = ImageChops.add(touching, over).transform(
            size, Image.Transform.AFFINE, tuple(to_samples.ravel()), Image.Resampling.BILINEAR
        )
        return Shadow((x, y), np.asarray(laid, dtype=np.float32) / 255.0)

    def _layer(self, buffer: DepthBuffer, fine: float, dark: float, fall: float, soft: float) -> Image.Image:
        """Draw one of `_SHADOW_LAYERS`, 255 for black; `buffer`, under the floor, has `fine` samples a metre."""
        cast = dark * np.exp(np.minimum(buffer.depth, 0.0) / np.float32(fall * self._height))  # depth is -height
        image = Image.fromarray(np.round(255.0 * cast).astype(np.uint8))
        return image.filter(ImageFilter.GaussianBlur(soft * self._height * fine))


def darken(picture: Pixels, shadow: Shadow, bare: Singles) -> None:
    """Lay a shadow on a picture, in place.

    Args:
        picture: RGB [H, W, 3].
        shadow: the shadow.
        bare: how much of the floor each pixel shows [H, W], 0 to 1.
    """
    (x, y), (height, width) = shadow.corner, shadow.dark.shape
    box = slice(y, y + height), slice(x, x + width)
    dark = (shadow.dark * bare[box])[..., None]
    picture[box] = picture[box] + dark * (np.array(STAGE.shadow, dtype=np.float32) - picture[box])
