"""Round cones and ellipsoids, and the picture of them in a depth buffer. It knows no bodies.

A depth buffer is taken, and not shapes painted one over another from the farthest on, because limbs that cross or go
through one another have no order: each pixel must be asked on its own which of them is nearer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Depths = NDArray[np.float32]
Indices = NDArray[np.int16]

EMPTY = -1  # where a pixel shows no solid


@dataclass(frozen=True, eq=False)
class Cones:
    """Round cones: all the balls whose centre and radius lie between those of two balls, as in a limb.

    Attributes:
        a, b: centres of the two balls [..., N, 3], metres.
        a_radius, b_radius: their radii [N], metres.
    """

    a: Array
    b: Array
    a_radius: Array
    b_radius: Array

    def reach(self) -> Array:
        """Least and greatest coordinates [2, ..., N, 3]."""
        a, b = self.a_radius[:, None], self.b_radius[:, None]
        return np.stack([np.minimum(self.a - a, self.b - b), np.maximum(self.a + a, self.b + b)])

    def volumes(self) -> Array:
        """Volumes [..., N] in cubic metres, roughly: the cone between the balls' centres and half of each ball."""
        a, b = self.a_radius, self.b_radius
        length = np.linalg.norm(self.b - self.a, axis=-1)
        return np.asarray(np.pi / 3.0 * (a * a + a * b + b * b) * length + 2.0 / 3.0 * np.pi * (a**3 + b**3))


@dataclass(frozen=True, eq=False)
class Ellipsoids:
    """Ellipsoids.

    Attributes:
        centre: their centres [..., N, 3], metres.
        axes: their half axes as columns [..., N, 3, 3], metres.
    """

    centre: Array
    axes: Array

    def reach(self) -> Array:
        """Least and greatest coordinates [2, ..., N, 3]."""
        half = np.linalg.norm(self.axes, axis=-1)
        return np.stack([self.centre - half, self.centre + half])

    def joined(self, others: Ellipsoids) -> Ellipsoids:
        """These, and then others."""
        return Ellipsoids(
            np.concatenate([self.centre, others.centre], axis=-2), np.concatenate([self.axes, others.axes], axis=-3)
        )

    def volumes(self) -> Array:
        """Volumes [..., N] in cubic metres."""
        return np.asarray(4.0 / 3.0 * np.pi * np.abs(np.linalg.det(self.axes)))


class Canvas:
    """A depth buffer: for each pixel which solid is nearest, how near, and how bright.

    Solids are in the viewer's axes, x to the right, y up, z towards the viewer; parallel projection.

    Attributes:
        solid: index of the solid that each pixel shows [H, W], EMPTY where there is none.
        depth: z of what it shows [H, W], metres; -inf where there is nothing.
        shade: its brightness [H, W], from 0 to 1; it says nothing where there is nothing.
    """

    def __init__(self, left: float, top: float, width: int, height: int, scale: float) -> None:
        """A canvas of `width` by `height` pixels, `scale` to a metre, its upper left corner at x `left`, y `top`."""
        self.solid: Indices = np.full((height, width), EMPTY, dtype=np.int16)
        self.depth: Depths = np.full((height, width), -np.inf, dtype=np.float32)
        self.shade: Depths = np.ones((height, width), dtype=np.float32)
        self._place = float(left), float(top), float(scale)

    def clear(self) -> None:
        """Wipe it, for the next picture: to fill memory anew is faster than to have it anew."""
        self.solid.fill(EMPTY)
        self.depth.fill(-np.inf)

    def draw(self, cones: Cones, balls: Ellipsoids, numbers: Indices) -> None:
        """Draw solids ([N, 3]); `numbers` are what the canvas calls them, the cones and then the balls."""
        from motionmind.render.raster import draw

        ends = np.column_stack([cones.a, cones.b, cones.a_radius, cones.b_radius])
        shapes = np.concatenate([balls.centre[:, None], balls.axes @ np.swapaxes(balls.axes, -1, -2)], axis=1)
        draw(self.solid, self.depth, self.shade, self._place, ends, shapes, np.array(numbers, dtype=np.int16))
