"""One posture as a picture of a body: from solids to colours, with lines where one part passes in front of another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motionmind._typing import Bools, Floats, Pixels
from motionmind.body.mirror import LEFT, MIDDLE, RIGHT
from motionmind.geometry import rotations as rot
from motionmind.render.body_shape import FACE, HAIR, MARK, BodyShape
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.solids import Cones, Ellipsoids

COLOURS = {
    LEFT: (222, 98, 66),
    RIGHT: (62, 118, 190),
    MIDDLE: (168, 164, 160),
    FACE: (244, 216, 190),
    HAIR: (84, 70, 62),
    MARK: (255, 226, 120),
}
INSERTED = COLOURS | {LEFT: (190, 95, 130), RIGHT: (95, 105, 195), MIDDLE: (140, 90, 200)}  # what the engine made
BRIDGED = (20, 190, 120)  # balls around joints amid a move that no corpus attests
INK = (34, 30, 34)
STEP = 0.016  # metres by which a part must stand before another for a line between them
_HAZE = 0.30  # share of white in what is farthest from the viewer
_DEEP = 0.45  # metres before and behind the root between which the haze grows, on a body 1.70 m tall
_STANDS_OUT = 1.2  # radius of a bridged joint's ball by that of the body there
_LEAST_BALL = 0.050  # metres, on a body 1.70 m tall


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
    def axes(self) -> Floats:
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


def seen(cones: Cones, balls: Ellipsoids, view: View, origin: Floats) -> tuple[Cones, Ellipsoids]:
    """Solids in a viewer's axes, with `origin` [..., 3] of the world, metres, in the middle of the view."""
    turn, origin = view.axes.T, np.asarray(origin)[..., None, :]
    return (
        Cones((cones.a - origin) @ turn, (cones.b - origin) @ turn, cones.a_radius, cones.b_radius),
        Ellipsoids((balls.centre - origin) @ turn, view.axes @ balls.axes),
    )


def draw(canvas: DepthBuffer, cones: Cones, balls: Ellipsoids, only: frozenset[int] | None = None) -> None:
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


def plain(body: BodyShape) -> Floats:
    """RGB [N, 3] of a body's solids, from 0 to 255: left is warm, right is cool, the trunk is neutral."""
    return np.array([COLOURS[paint] for paint in body.paints], dtype=np.float64)


def inserted(body: BodyShape) -> Floats:
    """RGB [N, 3] of a body's solids where the engine made the movement: violet, left still warmer than right."""
    return np.array([INSERTED[paint] for paint in body.paints], dtype=np.float64)


def bridge_balls(body: BodyShape, joints: Floats, which: Bools) -> Ellipsoids:
    """Balls around the bridged ones, `which` [J], of a body's joints, which are at `joints` [..., J, 3], metres.

    They are larger than the body is there. Drawn after the body's own balls, as `balls.joined(bridge_balls(...))`, they
    have the numbers after those of `Body.parts`, by which `colour` knows them.
    """
    radii = _girths(body)[which]
    return Ellipsoids(joints[..., which, :], radii[:, None, None] * np.eye(3))


@lru_cache(maxsize=8)
def _girths(body: BodyShape) -> Floats:
    """Radii [J] in metres of balls that stand out from the solids that the joints are in."""
    skeleton, rest = body.skeleton, np.tile(rot.IDENTITY, (len(body.skeleton), 1))
    cones, balls = body.solids(rest, np.zeros(3))
    joints = skeleton.positions(rest, np.zeros(3))[:, None]
    along = cones.b - cones.a
    t = ((joints - cones.a) * along).sum(axis=-1) / np.maximum((along**2).sum(axis=-1), 1e-12)
    t = t.clip(0.0, 1.0)
    thick = cones.a_radius + t * (cones.b_radius - cones.a_radius)
    in_cones = np.linalg.norm(joints - cones.a - t[..., None] * along, axis=-1) < thick
    in_balls = np.linalg.norm(np.linalg.inv(balls.axes) @ (joints - balls.centre)[..., None], axis=(-2, -1)) < 1.0
    thin = np.linalg.norm(balls.axes, axis=-2).min(axis=-1)
    radii = np.concatenate([in_cones * thick, in_balls * thin], axis=-1).max(axis=-1)
    return np.asarray(np.maximum(_STANDS_OUT * radii, _LEAST_BALL * body.size))


def haze(body: BodyShape) -> tuple[float, float, float]:
    """The depths where haze begins and where it is full, metres in the viewer's axes, and how much white that is."""
    return _DEEP * body.size, -_DEEP * body.size, _HAZE


def colour(
    canvas: DepthBuffer, body: BodyShape, background: Pixels, line: int = 2, paints: Floats | None = None
) -> Pixels:
    """The picture [H, W, 3] of what is on a canvas, before a background of the same shape.

    The solids have the RGB `paints` [N, 3], `plain(body)` by default; any whose number is beyond those of the body are
    balls around bridged joints. What is farther is paler. A line, `line` pixels wide, runs round each part where it
    stands before another, and is drawn on that other, so that the nearer part keeps its shape.
    """
    from motionmind.render import raster

    names = {name: number for number, name in enumerate(dict.fromkeys(body.parts))}
    joints = len(body.skeleton)  # no more can be bridged
    parts = np.array([names[part] for part in body.parts] + [len(names)] * joints)
    colours = np.concatenate([plain(body) if paints is None else paints, np.tile(BRIDGED, (joints, 1))]).astype(float)
    picture = background.copy()
    ink = np.array(INK, dtype=np.uint8)
    shown = canvas.solid, canvas.depth, canvas.shade
    raster.colour(picture, *shown, colours, parts, haze(body), STEP * body.size, line, ink)
    return picture


def halved(picture: Pixels) -> Pixels:
    """A picture [H, W, 3] at half its width and height, each pixel the mean of four."""
    from motionmind.render import raster

    return raster.halved(picture)
