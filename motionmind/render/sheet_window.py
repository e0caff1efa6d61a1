"""The windows of a contact sheet: the part of a view that it shows of every posture."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from motionmind._typing import Pixels
from motionmind.render.camera import SAMPLES_PER_PX
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.palette import SHEET
from motionmind.render.view import ABOVE, View


@dataclass(frozen=True)
class Window:
    """A view through a window around the floor under the root.

    Attributes:
        view: the direction.
        half: half the width, metres.
        top: y of the upper edge above the view's origin, metres.
        width, height: size in the finished picture, pixels.
        scale: pixels of the finished picture to a metre.
    """

    view: View
    half: float
    top: float
    width: int
    height: int
    scale: float

    @property
    def floor(self) -> int:
        """The first row of samples under the floor; the row after the last if the floor is outside the window."""
        row, last = round(self.to_samples(0.0, 0.0)[1]), SAMPLES_PER_PX * self.height
        return row if 0 <= row <= last else last

    def to_samples(self, x: float, y: float) -> tuple[float, float]:
        """Convert a point of the view, metres, to column and row, samples."""
        return (x + self.half) * self.scale * SAMPLES_PER_PX, (self.top - y) * self.scale * SAMPLES_PER_PX

    def buffer(self) -> DepthBuffer:
        """Allocate an empty depth buffer for the window, with `SAMPLES_PER_PX`."""
        rows, columns = SAMPLES_PER_PX * self.height, SAMPLES_PER_PX * self.width
        return DepthBuffer(-self.half, self.top, columns, rows, SAMPLES_PER_PX * self.scale)

    def background(self) -> Pixels:
        """Draw paper above the floor and ground under it, or ground alone if seen from above [H, W, 3], RGB samples."""
        picture = np.full((SAMPLES_PER_PX * self.height, SAMPLES_PER_PX * self.width, 3), SHEET.ground, dtype=np.uint8)
        if self.view is not ABOVE:
            picture[: self.floor] = SHEET.paper
            picture[self.floor : self.floor + SAMPLES_PER_PX] = SHEET.floor
        return picture


def window_around(view: View, half: float, low: float, high: float, scale: float) -> Window:
    """Build the window of `half` metres to either side and from `low` to `high`, plus a margin, in whole pixels.

    The origin lies on a pixel's edge, which keeps the line of the floor sharp.

    Args:
        view: the direction.
        half, low, high: x to either side, and least and greatest y of the view, metres.
        scale: pixels to a metre.
    """
    margin = 6  # pixels
    width = 2 * (ceil(half * scale) + margin)
    above, below = ceil(high * scale) + margin, ceil(-low * scale) + margin
    return Window(view, 0.5 * width / scale, above / scale, width, above + below, scale)
