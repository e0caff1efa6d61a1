"""The depth buffer: which solid each pixel shows; no bodies.

Solids cannot be painted back to front: limbs that cross or pass through each other have no order, so the nearest is
found pixel by pixel.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Int16s, Singles
from motionmind.render import raster
from motionmind.render.solids import EMPTY_CODE, Cones, Ellipsoids


class DepthBuffer:
    """For each pixel, the nearest solid, its depth and its brightness.

    Solids are given in the viewer's axes: x to the right, y up, z towards the viewer; parallel projection.

    Attributes:
        solid: number of the solid that each pixel shows [H, W]; EMPTY where none.
        depth: z of its surface [H, W], metres; -inf where none.
        shade: brightness of its surface [H, W], 0 to 1; meaningless where none.
    """

    def __init__(self, left: float, top: float, width: int, height: int, scale: float) -> None:
        """Make an empty buffer.

        Args:
            left, top: x and y of its upper left corner, metres.
            width, height: its size, pixels.
            scale: pixels to a metre.
        """
        self.solid: Int16s = np.full((height, width), EMPTY_CODE, dtype=np.int16)
        self.depth: Singles = np.full((height, width), -np.inf, dtype=np.float32)
        self.shade: Singles = np.ones((height, width), dtype=np.float32)
        self._place = float(left), float(top), float(scale)

    def clear(self) -> None:
        """Empty the buffer for the next picture; faster than a new one."""
        self.solid.fill(EMPTY_CODE)
        self.depth.fill(-np.inf)

    def draw(self, cones: Cones, balls: Ellipsoids, numbers: Int16s) -> None:
        """Draw solids.

        Args:
            cones, balls: N cones and M ellipsoids in the viewer's axes, metres.
            numbers: their numbers in `solid` [N + M], the cones' first.
        """
        ends = np.column_stack([cones.a, cones.b, cones.a_radius, cones.b_radius])
        shapes = np.concatenate([balls.centre[:, None], balls.axes @ np.swapaxes(balls.axes, -1, -2)], axis=1)
        raster.draw(self.solid, self.depth, self.shade, self._place, ends, shapes, np.array(numbers, dtype=np.int16))
