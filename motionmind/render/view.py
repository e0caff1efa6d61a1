"""Viewing directions, and the change from world axes to a viewer's. Projection is parallel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np

from motionmind._typing import Floats
from motionmind.render.solids import Cones, Ellipsoids


@dataclass(frozen=True)
class View:
    """A viewing direction, as orthonormal vectors in the world.

    Attributes:
        name: the view in words.
        right, up: right and up in the picture.
        towards: towards the viewer.
    """

    name: str
    right: tuple[float, float, float]
    up: tuple[float, float, float]
    towards: tuple[float, float, float]

    @property
    def axes(self) -> Floats:
        """The matrix [3, 3] from the world's coordinates to the viewer's."""
        return np.array([self.right, self.up, self.towards])


# The stage is seen along -z: a body that faces the audience faces +z, and the performer's left is stage left.
FRONT = View("front, as the audience sees it", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
STAGE_RIGHT = View(
    "side, from stage right: the audience is to the right", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)
)
STAGE_LEFT = View(
    "side, from stage left: the audience is to the left", (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
)
ABOVE = View("from above: the audience is below", (1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))


def view_from(name: str, azimuth: float, elevation: float) -> View:
    """Return the view `azimuth` degrees to the performer's left of the front and `elevation` degrees above."""
    a, e = radians(azimuth), radians(elevation)
    towards = (cos(e) * sin(a), sin(e), cos(e) * cos(a))
    return View(name, (cos(a), 0.0, -sin(a)), (-sin(e) * sin(a), cos(e), -sin(e) * cos(a)), towards)


# Views of films, by the name that `draw_picture` takes; a little from above, as from a raised seat, to show the floor.
VIEWS: Mapping[str, View] = {
    "quarter": view_from("three quarters, from the audience's left", -32.0, 17.0),
    "front": view_from("from the front, as the audience sees it", 0.0, 9.0),
    "side": view_from("from stage right: the audience is to the right", -90.0, 9.0),
    "left": view_from("from stage left: the audience is to the left", 90.0, 9.0),
    "top": ABOVE,
}


def to_view(cones: Cones, balls: Ellipsoids, view: View, origin: Floats) -> tuple[Cones, Ellipsoids]:
    """Transform solids from the world to a viewer's axes.

    Args:
        cones, balls: solids [..., N, 3] in the world, metres.
        view: the viewer's direction.
        origin: the point [..., 3] of the world, metres, that becomes the origin.

    Returns:
        The solids in axes x to the right, y up, z towards the viewer, metres.
    """
    turn, origin = view.axes.T, np.asarray(origin)[..., None, :]
    return (
        Cones((cones.a - origin) @ turn, (cones.b - origin) @ turn, cones.a_radius, cones.b_radius),
        Ellipsoids((balls.centre - origin) @ turn, view.axes @ balls.axes),
    )
