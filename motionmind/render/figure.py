"""One posture as a picture of a body: from solids to colours, with lines where one part passes in front of another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionmind.mirror import LEFT, MIDDLE, RIGHT
from motionmind.render.anatomy import FACE, HAIR, MARK, Body
from motionmind.render.solids import EMPTY, Canvas, Cones, Depths, Ellipsoids, Indices

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]

COLOURS = {
    LEFT: (222, 98, 66),
    RIGHT: (62, 118, 190),
    MIDDLE: (168, 164, 160),
    FACE: (244, 216, 190),
    HAIR: (84, 70, 62),
    MARK: (255, 226, 120),
}
INK = (34, 30, 34)
_STEP = 0.016  # metres by which a part must stand before another for a line between them
_HAZE = 0.30  # share of white in what is farthest from the viewer


@dataclass(frozen=True)
class View:
    """A direction to look from, by the world's directions (unit vectors, at right angles) in the picture.

    Attributes:
        name: what is seen, and from where.
        right, up: what points to the picture's right and to its upper edge.
        towards: what points to the viewer.
    """

    name: str
    right: tuple[float, float, float]
    up: tuple[float, float, float]
    towards: tuple[float, float, float]

    @property
    def axes(self) -> Array:
        """The matrix [3, 3] that takes the world's coordinates to the viewer's."""
        return np.array([self.right, self.up, self.towards])


# The stage is seen along -z, so that what faces the audience looks along +z; the performer's left is then stage left.
FRONT = View("front, as the audience sees it", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
STAGE_RIGHT = View(
    "side, from stage right: the audience is to the right", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)
)
STAGE_LEFT = View(
    "side, from stage left: the audience is to the left", (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
)
ABOVE = View("from above: the audience is below", (1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))


def seen(cones: Cones, balls: Ellipsoids, view: View, origin: Array) -> tuple[Cones, Ellipsoids]:
    """Solids in a viewer's axes, with `origin` [..., 3] of the world, metres, in the middle of the view."""
    turn, origin = view.axes.T, np.asarray(origin)[..., None, :]
    return (
        Cones((cones.a - origin) @ turn, (cones.b - origin) @ turn, cones.a_radius, cones.b_radius),
        Ellipsoids((balls.centre - origin) @ turn, view.axes @ balls.axes),
    )


def draw(canvas: Canvas, cones: Cones, balls: Ellipsoids, only: frozenset[int] | None = None) -> None:
    """Draw one posture's solids ([N, 3], in the viewer's axes) on a canvas, those numbered in `only` if it is given.

    The solids' numbers are those of `Body.parts`.
    """
    numbers = np.arange(len(cones.a) + len(balls.centre), dtype=np.int16)
    if only is not None:
        numbers = numbers[np.isin(numbers, list(only))]
        balls_from = len(cones.a)
        few, others = numbers[numbers < balls_from], numbers[numbers >= balls_from] - balls_from
        cones = Cones(cones.a[few], cones.b[few], cones.a_radius[few], cones.b_radius[few])
        balls = Ellipsoids(balls.centre[others], balls.axes[others])
    canvas.draw(cones, balls, numbers)


def colour(canvas: Canvas, body: Body, background: Pixels, line: int = 2) -> Pixels:
    """The picture [H, W, 3] of what is on a canvas, before a background of the same shape.

    Left is warm, right is cool, the trunk is neutral; what is farther is paler. A line, `line` pixels wide, runs round
    each part where it stands before another, and is drawn on that other, so that the nearer part keeps its shape.
    """
    picture = background.copy()
    solid, depth = canvas.solid.reshape(-1), canvas.depth.reshape(-1)
    filled = np.flatnonzero(solid != EMPTY)
    far = _HAZE * np.clip(0.5 - depth[filled] / np.float32(0.9 * body.size), 0.0, 1.0)
    lit, haze, of = (1.0 - far) * canvas.shade.reshape(-1)[filled], 255.0 * far, solid[filled]
    paints = np.array([COLOURS[paint] for paint in body.paints], dtype=np.float32)
    samples = picture.reshape(-1, 3)
    for channel in range(3):  # one by one: numpy is slow on rows of three
        samples[:, channel][filled] = paints[:, channel][of] * lit + haze
    if len(filled):
        width = canvas.solid.shape[1]
        rows = slice(max(filled[0] // width - line, 0), filled[-1] // width + line + 1)
        picture[rows].reshape(-1, 3)[_edges(canvas.solid[rows], canvas.depth[rows], body, line)] = INK
    return picture


def _edges(solid: Indices, depth: Depths, body: Body, line: int) -> NDArray[np.intp]:
    """Pixels of [H, W], counted row by row, within `line` of one of another part that is nearer by a step."""
    names = {name: number for number, name in enumerate(dict.fromkeys(body.parts))}
    parts = np.array([names[part] for part in body.parts] + [-1])  # EMPTY takes the last
    step, width = np.float32(_STEP * body.size), solid.shape[1]
    solids, depths = solid.reshape(-1), depth.reshape(-1)
    found = []
    for by in range(1, line + 1):
        below = np.flatnonzero(solid[by:] != solid[:-by])
        beside = np.flatnonzero(solid[:, by:] != solid[:, :-by])
        for first, other in ((below, by * width), (beside + beside // (width - by) * by, by)):
            before = first[parts[solids[first]] != parts[solids[first + other]]]
            ahead = depths[before + other] - depths[before]
            found += [before[ahead > step], before[ahead < -step] + other]
    return np.concatenate(found)
