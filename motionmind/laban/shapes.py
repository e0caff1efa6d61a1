"""The shapes of signs: outlines, the shading of levels, narrow signs, pins and holds, as marks of a plate.

Source: A. Hutchinson Guest, "Labanotation: the system of analyzing and recording movement", 4th ed., Routledge (2005).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.laban.signs import PLACE, Direction, Hold, Turn, Value
from motionmind.plots.marks import Dot, Line, Mark, Polygon, Words
from motionmind.render.palette import INK, PAPER

SIGN_EDGE_PX = 1.4  # of a sign
_STRIPE_PX = 5.0  # between the stripes of a high sign
_DOT_PX = 2.2
_POINT_SHARE = 1 / 3  # of a sign's height that points ahead or back, at most a column's width
_CROSS_PX = 8.0  # height of a narrow sign
_PIN_PX = 8.0  # half the length of a pin


class Box(NamedTuple):
    """Where a sign is drawn, pixels; y points down."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def middle(self) -> tuple[float, float]:
        """Its centre."""
        return 0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom)


def draw_sign(value: Value, box: Box, *, on_left: bool, faces: int = 0) -> Iterator[Mark]:
    """Yield the marks of a sign.

    Args:
        value: the sign.
        box: where it is drawn.
        on_left: whether it is left of the centre line, to which the signs for ahead and back are near.
        faces: for a turn sign of torso or head, the degrees to the left that it faced before.
    """
    if isinstance(value, Hold):
        yield Dot(box.middle, 4.0, PAPER, INK, SIGN_EDGE_PX)
    elif isinstance(value, Turn):
        yield from _turn(value.left, value.left - faces, box)
    elif not value.level:
        yield from _path(value.around, box, on_left=on_left)
    else:
        yield from _direction(value, box, on_left=on_left)


def outline(around: str, box: Box, *, on_left: bool) -> Floats:
    """Return the corners of a direction sign's outline [N, 2], pixels."""
    left, top, right, bottom = box
    x, y = box.middle
    point = min(_POINT_SHARE * (bottom - top), right - left)
    if around == PLACE:
        corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
    elif around == "left":
        corners = [(left, y), (right, top), (right, bottom)]
    elif around == "right":
        corners = [(left, top), (right, y), (left, bottom)]
    elif around == "forward":
        near, far = (right, left) if on_left else (left, right)
        corners = [(near, top), (x, top), (x, top + point), (far, top + point), (far, bottom), (near, bottom)]
    elif around == "back":
        near, far = (right, left) if on_left else (left, right)
        corners = [(near, bottom), (x, bottom), (x, bottom - point), (far, bottom - point), (far, top), (near, top)]
    elif around.endswith("forward"):
        drop = (0.0, point) if around.startswith("left") else (point, 0.0)
        corners = [(left, top + drop[0]), (right, top + drop[1]), (right, bottom), (left, bottom)]
    else:
        rise = (0.0, point) if around.startswith("left") else (point, 0.0)
        corners = [(left, top), (right, top), (right, bottom - rise[1]), (left, bottom - rise[0])]
    return np.array(corners)


def _direction(value: Direction, box: Box, *, on_left: bool) -> Iterator[Mark]:
    """Yield a direction sign: its outline and shading, and a narrow sign before it."""
    if value.bend:
        room = min(_CROSS_PX + 3.0, 0.5 * (box.bottom - box.top))
        for shift in (0.0,) if value.bend == 1 else (-3.0, 3.0):
            yield from _cross(box.middle[0] + shift, box.bottom - 0.5 * room, 0.5 * (room - 3.0))
        box = box._replace(bottom=box.bottom - room)
    corners = outline(value.around, box, on_left=on_left)
    yield Polygon(corners, INK if value.level == "low" else PAPER, INK, SIGN_EDGE_PX)
    if value.level == "high":
        yield from (Line(stripe, INK, 1.0) for stripe in stripes(corners))
    if value.level == "middle":
        yield Dot(_inside(value.around, box), _DOT_PX, INK, INK)
    if value.touch:  # a hook, on the side away from the centre line
        out, side = (box.left, -1.0) if on_left else (box.right, 1.0)
        top = box.top + 2.0
        hook = [(out, top + 4.0), (out + side * 4.0, top + 3.0), (out + side * 5.0, top), (out + side * 4.0, top - 3.0)]
        yield Line(np.array(hook), INK, 1.6)


def _inside(around: str, box: Box) -> tuple[float, float]:
    """Return a point well inside a direction sign."""
    x, y = box.middle
    third = (box.right - box.left) / 6.0
    return x + (third if around == "left" else -third if around == "right" else 0.0), y


def stripes(corners: Floats) -> Iterator[Floats]:
    """Yield the stripes, from lower left to upper right, that fill a polygon [N, 2]; each [2, 2], pixels."""
    sums = corners.sum(axis=1)
    ring = np.concatenate([corners, corners[:1]])
    for total in np.arange(sums.min() + _STRIPE_PX, sums.max(), _STRIPE_PX):
        crossings = []
        for a, b in pairwise(ring):
            low, high = a.sum(), b.sum()
            if (low < total) != (high < total):
                crossings.append(a + (b - a) * (total - low) / (high - low))
        crossings.sort(key=lambda point: float(point[0]))
        for start, end in zip(crossings[::2], crossings[1::2], strict=True):
            yield np.stack([start, end])


def _cross(x: float, y: float, half: float) -> Iterator[Mark]:
    for slope in (1.0, -1.0):
        yield Line(np.array([(x - half, y - slope * half), (x + half, y + slope * half)]), INK, SIGN_EDGE_PX)


def _turn(faces: int, turned: int, box: Box) -> Iterator[Mark]:
    """Yield a turn sign, which rises to the side of the turn, and its pin, which points to the front after it."""
    slant = min(0.35 * (box.right - box.left), 0.3 * (box.bottom - box.top))
    drop = (0.0, slant) if turned > 0 else (slant, 0.0)
    corners = [
        (box.left, box.top + drop[0]),
        (box.right, box.top + drop[1]),
        (box.right, box.bottom - drop[0]),
        (box.left, box.bottom - drop[1]),
    ]
    yield Polygon(np.array(corners), PAPER, INK, SIGN_EDGE_PX)
    yield from _pin(box.middle, faces, min(_PIN_PX, 0.4 * (box.right - box.left), 0.4 * (box.bottom - box.top)))
    if abs(faces) > 360:
        x, y = box.middle
        yield Words((x, y + _PIN_PX + 5.0), str(abs(faces) // 360), 9.0, INK, "middle")


def _pin(at: tuple[float, float], left: float, half: float) -> Iterator[Mark]:
    """Yield a pin whose point is at some degrees to the left of ahead, which is up."""
    angle = np.radians(left)
    along = np.array([-np.sin(angle), -np.cos(angle)])
    centre = np.array(at)
    head = centre - half * along
    across = 1.6 * np.array([-along[1], along[0]])
    yield Polygon(np.stack([head + across, centre + half * along, head - across]), INK, INK, 0.6)
    yield Dot((float(head[0]), float(head[1])), 2.2, INK, INK)


def _path(around: str, box: Box, *, on_left: bool) -> Iterator[Mark]:
    """Yield a straight path: a line for as long as it lasts, and its direction in the middle."""
    x, y = box.middle
    yield Line(np.array([(x, box.top + 1.0), (x, box.bottom - 1.0)]), INK, SIGN_EDGE_PX)
    for end in (box.top + 1.0, box.bottom - 1.0):
        yield Line(np.array([(x - 4.0, end), (x + 4.0, end)]), INK, SIGN_EDGE_PX)
    half = min(7.0, 0.3 * (box.bottom - box.top))
    yield Polygon(outline(around, Box(x - 5.0, y - half, x + 5.0, y + half), on_left=on_left), PAPER, INK, SIGN_EDGE_PX)
