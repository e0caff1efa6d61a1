"""One posture as a picture of a body: from solids to colours, with lines where one part passes in front of another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionmind.render.anatomy import FACE, HAIR, LEFT, MARK, MIDDLE, RIGHT, Body
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
    count = len(cones.a_radius)
    for solid in range(count):
        if only is None or solid in only:
            ends = cones.a[solid], cones.b[solid]
            canvas.cone(solid, *ends, float(cones.a_radius[solid]), float(cones.b_radius[solid]))
    for ball in range(len(balls.centre)):
        if only is None or count + ball in only:
            canvas.ellipsoid(count + ball, balls.centre[ball], balls.axes[ball])


def colour(canvas: Canvas, body: Body, background: Pixels, line: int = 2) -> Pixels:
    """The picture [H, W, 3] of what is on a canvas, before a background of the same shape.

    Left is warm, right is cool, the trunk is neutral; what is farther is paler. A line, `line` pixels wide, runs round
    each part where it stands before another, and is drawn on that other, so that the nearer part keeps its shape.
    """
    picture = background.copy()
    box = _filled(canvas, line)
    solid, depth, shade = canvas.solid[box], canvas.depth[box], canvas.shade[box]
    filled = solid != EMPTY
    paints = np.array([COLOURS[paint] for paint in body.paints], dtype=np.float32)
    far = np.clip(0.5 - depth[filled] / (0.9 * body.size), 0.0, 1.0)[:, None] * _HAZE
    flesh = paints[solid[filled]] * shade[filled][:, None]
    picture[box][filled] = (flesh + (255.0 - flesh) * far).astype(np.uint8)
    picture[box][_edges(solid, depth, body, line)] = INK
    return picture


def _filled(canvas: Canvas, margin: int) -> tuple[slice, slice]:
    """Rows and columns of the smallest box round what a canvas shows, with a margin in pixels."""
    box = []
    for axis in (1, 0):
        found = np.flatnonzero((canvas.solid != EMPTY).any(axis=axis))
        box.append(slice(max(found[0] - margin, 0), found[-1] + margin + 1) if len(found) else slice(0, 0))
    return box[0], box[1]


def _edges(solid: Indices, depth: Depths, body: Body, line: int) -> NDArray[np.bool_]:
    """Pixels [H, W] within `line` of one of another part that is nearer by a step."""
    names = {name: number for number, name in enumerate(dict.fromkeys(body.parts))}
    parts = np.array([*(names[part] for part in body.parts), -1], dtype=np.int16)[solid]  # EMPTY takes the last
    near = depth - np.float32(_STEP * body.size)
    out = np.zeros(parts.shape, dtype=bool)
    for by in range(1, line + 1):
        for before, after in ((np.s_[by:, :], np.s_[:-by, :]), (np.s_[:, by:], np.s_[:, :-by])):
            differ = parts[before] != parts[after]
            out[before] |= differ & (near[after] > depth[before])
            out[after] |= differ & (near[before] > depth[after])
    return out
