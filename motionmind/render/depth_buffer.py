"""The depth buffer: solids as pixels, the nearest in front."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Int16s, Singles
from motionmind.render.solids import EMPTY, Cones, Ellipsoids


class DepthBuffer:
    """A depth buffer: for each pixel which solid is nearest, how near, and how bright.

    Solids are in the viewer's axes, x to the right, y up, z towards the viewer; parallel projection.

    Attributes:
        solid: index of the solid that each pixel shows [H, W], EMPTY where there is none.
        depth: z of what it shows [H, W], metres; -inf where there is nothing.
        shade: its brightness [H, W], from 0 to 1; it says nothing where there is nothing.
    """

    def __init__(self, left: float, top: float, width: int, height: int, scale: float) -> None:
        """A canvas of `width` by `height` pixels, `scale` to a metre, its upper left corner at x `left`, y `top`."""
        self.solid: Int16s = np.full((height, width), EMPTY, dtype=np.int16)
        self.depth: Singles = np.full((height, width), -np.inf, dtype=np.float32)
        self.shade: Singles = np.ones((height, width), dtype=np.float32)
        self._place = float(left), float(top), float(scale)

    def clear(self) -> None:
        """Wipe it, for the next picture: to fill memory anew is faster than to have it anew."""
        self.solid.fill(EMPTY)
        self.depth.fill(-np.inf)

    def draw(self, cones: Cones, balls: Ellipsoids, numbers: Int16s) -> None:
        """Draw solids ([N, 3]); `numbers` are what the canvas calls them, the cones and then the balls."""
        from motionmind.render.raster import draw

        ends = np.column_stack([cones.a, cones.b, cones.a_radius, cones.b_radius])
        shapes = np.concatenate([balls.centre[:, None], balls.axes @ np.swapaxes(balls.axes, -1, -2)], axis=1)
        draw(self.solid, self.depth, self.shade, self._place, ends, shapes, np.array(numbers, dtype=np.int16))
