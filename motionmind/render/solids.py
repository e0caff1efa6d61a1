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
_LIGHT = np.array([0.0, 0.6, 0.8])  # from above the viewer; from neither side, so that a mirrored body looks mirrored
_SHADE = 0.62  # brightness of what the light does not reach


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

    def volumes(self) -> Array:
        """Volumes [..., N] in cubic metres."""
        return np.asarray(4.0 / 3.0 * np.pi * np.abs(np.linalg.det(self.axes)))


class Canvas:
    """A depth buffer: for each pixel which solid is nearest, how near, and how bright.

    Solids are in the viewer's axes, x to the right, y up, z towards the viewer; parallel projection.

    Attributes:
        solid: index of the solid that each pixel shows [H, W], EMPTY where there is none.
        depth: z of what it shows [H, W], metres; -inf where there is nothing.
        shade: its brightness [H, W], from 0 to 1.
    """

    def __init__(self, left: float, top: float, width: int, height: int, scale: float) -> None:
        """A canvas of `width` by `height` pixels, `scale` to a metre, its upper left corner at x `left`, y `top`."""
        self.solid: Indices = np.full((height, width), EMPTY, dtype=np.int16)
        self.depth: Depths = np.full((height, width), -np.inf, dtype=np.float32)
        self.shade: Depths = np.ones((height, width), dtype=np.float32)
        self._left, self._top, self._scale = left, top, scale
        self._x = left + (np.arange(width) + 0.5) / scale
        self._y = top - (np.arange(height) + 0.5) / scale

    def cone(self, solid: int, a: Array, b: Array, a_radius: float, b_radius: float) -> None:
        """Draw the round cone from the ball at `a` [3] to that at `b` [3], metres.

        The surface is the farthest that any of its balls comes towards the viewer: at the pixel p the greatest
        a_z + t d_z + sqrt(q(t)) for t in [0, 1], with q(t) = r(t)^2 - |p - c(t)|^2 = A + B t + C t^2 in the picture's
        plane. It is concave for C < 0, and stationary where B + 2 C t = -d_z sqrt((B^2 - 4 A C) / (d_z^2 - C)).
        """
        along, widening = b - a, b_radius - a_radius
        quadratic = widening**2 - along[0] ** 2 - along[1] ** 2
        if (
            quadratic > -1e-6 * max(a_radius, b_radius) ** 2
        ):  # seen from an end: one ball hides all but the rim of the other
            self._ball(solid, a, a_radius)
            self._ball(solid, b, b_radius)
            return
        low = np.minimum(a - a_radius, b - b_radius)
        box = self._box(low, np.maximum(a + a_radius, b + b_radius))
        x, y = self._x[None, box[1]] - a[0], self._y[box[0], None] - a[1]
        constant = a_radius**2 - x * x - y * y
        linear = 2.0 * (a_radius * widening + along[0] * x + along[1] * y)
        spread = np.maximum(linear * linear - 4.0 * quadratic * constant, 0.0)
        t = (-along[2] * np.sqrt(spread / (along[2] ** 2 - quadratic)) - linear) / (2.0 * quadratic)
        t = np.clip(t, 0.0, 1.0)
        height = constant + t * (linear + t * quadratic)
        inside = height > 0.0
        rise = np.sqrt(np.where(inside, height, 0.0))
        radius = a_radius + t * widening
        bright = (_LIGHT[1] * (y - t * along[1]) + _LIGHT[2] * rise) / radius
        self._put(solid, box, inside, a[2] + t * along[2] + rise, bright)

    def ellipsoid(self, solid: int, centre: Array, axes: Array) -> None:
        """Draw the ellipsoid about `centre` [3] whose half axes are the columns of `axes` [3, 3], metres."""
        half = np.linalg.norm(axes, axis=-1)
        box = self._box(centre - half, centre + half)
        x, y = self._x[None, box[1]] - centre[0], self._y[box[0], None] - centre[1]
        inverse = np.linalg.inv(axes)
        m = inverse.T @ inverse  # the surface is v' m v = 1, a quadratic equation for z
        linear = m[0, 2] * x + m[1, 2] * y
        rest = m[0, 0] * x * x + 2.0 * m[0, 1] * x * y + m[1, 1] * y * y - 1.0
        square = linear * linear - m[2, 2] * rest
        inside = square > 0.0
        z = (np.sqrt(np.where(inside, square, 0.0)) - linear) / m[2, 2]
        normal = [m[i, 0] * x + m[i, 1] * y + m[i, 2] * z for i in range(3)]
        length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2) + 1e-12
        bright = (_LIGHT[1] * normal[1] + _LIGHT[2] * normal[2]) / length
        self._put(solid, box, inside, centre[2] + z, bright)

    def _ball(self, solid: int, centre: Array, radius: float) -> None:
        self.ellipsoid(solid, centre, radius * np.eye(3))

    def _box(self, low: Array, high: Array) -> tuple[slice, slice]:
        """Rows and columns of the pixels in a rectangle; those outside the canvas are left out."""
        height, width = self.solid.shape
        rows = np.clip([(self._top - high[1]) * self._scale - 1, (self._top - low[1]) * self._scale + 1], 0, height)
        columns = np.clip([(low[0] - self._left) * self._scale - 1, (high[0] - self._left) * self._scale + 1], 0, width)
        return slice(int(rows[0]), int(np.ceil(rows[1]))), slice(int(columns[0]), int(np.ceil(columns[1])))

    def _put(self, solid: int, box: tuple[slice, slice], inside: NDArray[np.bool_], z: Array, bright: Array) -> None:
        nearer = inside & (z > self.depth[box])
        np.copyto(self.depth[box], z, where=nearer, casting="same_kind")
        np.copyto(self.shade[box], _SHADE + (1.0 - _SHADE) * np.maximum(bright, 0.0), where=nearer, casting="same_kind")
        self.solid[box][nearer] = solid
