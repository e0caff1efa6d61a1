"""Round cones and ellipsoids, and the picture of them in a depth buffer. It knows no bodies.

A depth buffer is taken, and not shapes painted one over another from the farthest on, because limbs that cross or go
through one another have no order: each pixel must be asked on its own which of them is nearer.

All solids of a picture are drawn at once, on one list of the pixels that any of them may cover: most are small, and
calls of numpy for each of them would take most of the time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Depths = NDArray[np.float32]
Indices = NDArray[np.int16]
Numbers = NDArray[np.intp]

EMPTY = -1  # where a pixel shows no solid
_UP, _TOWARDS = 0.6, 0.8  # where light comes from: above the viewer; no side, so that a mirrored body looks mirrored
_SHADE = 0.62  # brightness of what the light does not reach
_HAIR = 0.001  # pixels: surfaces no farther apart are one, but for rounding
_END_ON = 1e-3  # of a cone's thickness: one whose ends lie no farther apart in the picture is drawn as two balls


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


class _Surface(NamedTuple):
    """What P pixels of a canvas would show if nothing hid it.

    Attributes:
        pixel: which of the canvas's pixels they are [P], counted row by row.
        solid: the number of the solid there [P].
        depth: its z [P], metres.
        bright: how brightly light falls on some of the P, given by their indices, up to 1; not above 0 in the shade.
    """

    pixel: Numbers
    solid: Indices
    depth: Depths
    bright: Callable[[Numbers], Depths]


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
        self._left, self._top, self._scale = left, top, scale

    def clear(self) -> None:
        """Wipe it, for the next picture: to fill memory anew is faster than to have it anew."""
        self.solid.fill(EMPTY)
        self.depth.fill(-np.inf)

    def draw(self, cones: Cones, balls: Ellipsoids, numbers: Indices) -> None:
        """Draw solids ([N, 3]); `numbers` are what the canvas calls them, the cones and then the balls."""
        of_cones, of_balls = np.split(numbers, [len(cones.a)])
        across = ((cones.b - cones.a)[:, :2] ** 2).sum(axis=-1) - (cones.b_radius - cones.a_radius) ** 2
        long = across >= _END_ON * np.maximum(cones.a_radius, cones.b_radius) ** 2
        if not long.all():  # seen from an end: one ball hides all but the rim of the other
            ends = [getattr(cones, name)[~long] for name in ("a", "b", "a_radius", "b_radius")]
            radii = np.concatenate(ends[2:])[:, None, None]
            balls = Ellipsoids(
                np.concatenate([balls.centre, *ends[:2]]), np.concatenate([balls.axes, radii * np.eye(3)])
            )
            of_balls = np.concatenate([of_balls, np.tile(of_cones[~long], 2)])
            cones = Cones(cones.a[long], cones.b[long], cones.a_radius[long], cones.b_radius[long])
        self._put([self._cones(cones, of_cones[long]), self._ellipsoids(balls, of_balls)])

    def _cones(self, cones: Cones, numbers: Indices) -> _Surface:
        """The surface of round cones of which none is seen from an end.

        It is the farthest that any of a cone's balls comes towards the viewer: at the pixel p the greatest
        a_z + t d_z + sqrt(q(t)) for t in [0, 1], with q(t) = r(t)^2 - |p - c(t)|^2 in the picture's plane, where
        q(t) = Q (A + 2 B t - t^2) and Q > 0. Without bounds it would be at t = B + d_z sqrt((B^2 + A) / (d_z^2 + Q)).
        """
        along, widening = cones.b - cones.a, cones.b_radius - cones.a_radius
        q = along[:, 0] ** 2 + along[:, 1] ** 2 - widening**2
        lean = along[:, 2] / np.sqrt(along[:, 2] ** 2 + q)
        low, high = cones.reach()
        solid, row, y = self._rows(cones.a, low, high)
        # Pixels lie in the box, and in a strip along the cone that is as wide as its thicker end.
        widest, length = np.maximum(cones.a_radius, cones.b_radius), np.hypot(along[:, 0], along[:, 1])
        rise = np.where(np.abs(along[:, 1]) < 1e-9 * length, 1e-9 * length, along[:, 1])
        middle, half = (along[:, 0] / rise)[solid] * y, (widest * length / np.abs(rise))[solid]
        low_x, high_x = ((bound - cones.a)[solid, 0] for bound in (low, high))
        at, x, pixel = self._columns(
            cones.a[solid, 0], row, np.maximum(low_x, middle - half), np.minimum(high_x, middle + half)
        )
        constant = _single(((cones.a_radius**2)[solid] - y * y) / q[solid])
        linear = _single(((cones.a_radius * widening)[solid] + along[solid, 1] * y) / q[solid])
        A = constant[at] - _single(1.0 / q)[solid][at] * (x * x)
        B = linear[at] + _single(along[:, 0] / q)[solid][at] * x
        t = np.clip(B + _single(lean)[solid][at] * np.sqrt(np.maximum(B * B + A, 0.0)), 0.0, 1.0)
        height = A + t * (2.0 * B - t)
        inside = np.flatnonzero(height > 0.0)
        at, t = at[inside], t[inside]
        of = solid[at]
        rise = np.sqrt(_single(q)[of] * height[inside])
        depth = _single(cones.a[:, 2])[of] + t * _single(along[:, 2])[of] + rise

        def bright(some: Numbers) -> Depths:
            one, share = of[some], t[some]
            up = y[at[some]] - share * _single(along[:, 1])[one]
            radius = _single(cones.a_radius)[one] + share * _single(widening)[one]
            return np.asarray((_UP * up + _TOWARDS * rise[some]) / radius)

        return _Surface(pixel[inside], numbers[of], depth, bright)

    def _ellipsoids(self, balls: Ellipsoids, numbers: Indices) -> _Surface:
        """The surface of ellipsoids: v' m v = 1, a quadratic equation for z."""
        inverse = np.linalg.inv(balls.axes)
        m = _single(np.swapaxes(inverse, -1, -2) @ inverse)
        solid, row, y = self._rows(balls.centre, *balls.reach())
        # The shadow v' s^-1 v = 1 of an ellipsoid is an ellipse, whose row y has its ends at known places.
        s = balls.axes[:, :2] @ np.swapaxes(balls.axes[:, :2], -1, -2)
        middle = (s[:, 0, 1] / s[:, 1, 1])[solid] * y
        narrow = (np.linalg.det(s) / s[:, 1, 1])[solid]
        half = np.sqrt(narrow * np.maximum(1.0 - y * y / s[solid, 1, 1], 0.0))
        at, x, pixel = self._columns(balls.centre[solid, 0], row, middle - half, middle + half)
        of = solid[at]
        linear = m[:, 0, 2][of] * x + (m[solid, 1, 2] * y)[at]
        rest = (m[:, 0, 0][of] * x + (2.0 * m[solid, 0, 1] * y)[at]) * x + (m[solid, 1, 1] * y * y - 1.0)[at]
        square = linear * linear - m[:, 2, 2][of] * rest
        inside = np.flatnonzero(square > 0.0)
        at, of, x = at[inside], of[inside], x[inside]
        towards = np.sqrt(square[inside])  # z of m v, which is normal to the surface
        z = (towards - linear[inside]) / m[:, 2, 2][of]

        def bright(some: Numbers) -> Depths:
            one, x_, y_, z_ = of[some], x[some], y[at[some]], z[some]
            across = m[:, 0, 0][one] * x_ + m[:, 0, 1][one] * y_ + m[:, 0, 2][one] * z_
            up = m[:, 0, 1][one] * x_ + m[:, 1, 1][one] * y_ + m[:, 1, 2][one] * z_
            length = np.sqrt(across**2 + up**2 + towards[some] ** 2)
            return np.asarray((_UP * up + _TOWARDS * towards[some]) / length)

        return _Surface(pixel[inside], numbers[of], _single(balls.centre[:, 2])[of] + z, bright)

    def _rows(self, centre: Array, low: Array, high: Array) -> tuple[Numbers, Numbers, Depths]:
        """The canvas's rows from `low` to `high` [N, 3]: whose of the N, which, y from the centre, metres [R]."""
        height = len(self.solid)
        first = np.clip((self._top - high[:, 1]) * self._scale, 0, height).astype(np.intp)
        after = np.ceil(np.clip((self._top - low[:, 1]) * self._scale, 0, height)).astype(np.intp)
        of, count, shift = _ranges(first, after)
        row = count + shift[of]
        return of, row, _single(self._top - (row + 0.5) / self._scale - centre[of, 1])

    def _columns(self, centre: Array, row: Numbers, low: Array, high: Array) -> tuple[Numbers, Depths, Numbers]:
        """The pixels of rows [R] from x `low` to `high`, metres from `centre`: in which of the R, x, which [P]."""
        width = self.solid.shape[1]
        start = (centre - self._left) * self._scale
        first = np.clip(start + low * self._scale, 0, width).astype(np.intp)
        after = np.ceil(np.clip(start + high * self._scale, 0, width)).astype(np.intp)
        of, count, shift = _ranges(first, after)
        x = _single((count + (0.5 - start + shift)[of]) / self._scale)
        return of, x, count + (row * width + shift)[of]

    def _put(self, surfaces: list[_Surface]) -> None:
        """Keep of surfaces what is nearest; of solids that touch, as limbs do in their joint, that of higher number."""
        solids, depths, shades = (array.reshape(-1) for array in (self.solid, self.depth, self.shade))
        for surface in surfaces:
            np.maximum.at(depths, surface.pixel, surface.depth)
        hair = np.float32(_HAIR / self._scale)
        seen = [np.flatnonzero(surface.depth >= depths[surface.pixel] - hair) for surface in surfaces]
        for surface, some in zip(surfaces, seen, strict=True):
            solids[surface.pixel[some]] = EMPTY
        for surface, some in zip(surfaces, seen, strict=True):
            np.maximum.at(solids, surface.pixel[some], surface.solid[some])
        for surface, some in zip(surfaces, seen, strict=True):
            own = some[solids[surface.pixel[some]] == surface.solid[some]]
            shades[surface.pixel[own]] = _SHADE + (1.0 - _SHADE) * np.maximum(surface.bright(own), 0.0)


def _ranges(first: Numbers, after: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """The whole numbers of ranges [N], one range after another, n in all.

    They are `count + shift[of]`: in which range each is [n], the numbers from 0 to n - 1, and what to add in each [N].
    """
    lengths = np.maximum(after - first, 0)
    of = np.repeat(np.arange(len(lengths)), lengths)
    return of, np.arange(len(of)), first - np.cumsum(lengths) + lengths


def _single(array: Array) -> Depths:
    """Numbers of a pixel's are kept in single precision, as its depth is: a millimetre is a tenth of a pixel."""
    return array.astype(np.float32)
