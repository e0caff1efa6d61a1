"""One posture as a picture: a body's solids in a depth buffer, then in colours, with lines around its parts."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from motionmind._typing import Bools, Floats, Pixels
from motionmind.body.mirror import MIDDLE
from motionmind.body.palette import Colour
from motionmind.geometry import rotations as rot
from motionmind.render import raster
from motionmind.render.body_solids import BodyShape
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.palette import BRIDGED, COLOURS, INK, INSERTED
from motionmind.render.solids import Cones, Ellipsoids

DEPTH_STEP_M = 0.016  # how far a part stands before another with a line between them, on a body 1.70 m tall


def draw(buffer: DepthBuffer, cones: Cones, balls: Ellipsoids, only: frozenset[int] | None = None) -> None:
    """Draw one posture's solids into a depth buffer, numbered as in `BodyShape.parts`.

    Args:
        buffer: the depth buffer.
        cones, balls: the solids [N, 3] in the viewer's axes, metres.
        only: numbers of the solids to draw; all by default.
    """
    numbers = np.arange(len(cones.a) + len(balls.centre), dtype=np.int16)
    if only is not None:
        numbers = numbers[np.isin(numbers, list(only))]
        balls_from = len(cones.a)
        few, others = numbers[numbers < balls_from], numbers[numbers >= balls_from] - balls_from
        cones = Cones(cones.a[few], cones.b[few], cones.a_radius[few], cones.b_radius[few])
        balls = Ellipsoids(balls.centre[others], balls.axes[others])
    buffer.draw(cones, balls, numbers)


def given_colours(body: BodyShape, trunk: Colour = COLOURS[MIDDLE]) -> Floats:
    """Return the RGB [N, 3], 0 to 255, of a body's solids: warm left, cool right, by default a grey trunk."""
    colours = {**COLOURS, MIDDLE: trunk}
    return np.array([colours[paint] for paint in body.paints], dtype=np.float64)


def inserted_colours(body: BodyShape) -> Floats:
    """Return the RGB [N, 3], 0 to 255, of a body's solids in inserted movement: violet, the left still warmer."""
    return np.array([INSERTED[paint] for paint in body.paints], dtype=np.float64)


def bridge_balls(body: BodyShape, joints: Floats, which: Bools) -> Ellipsoids:
    """Build the balls that mark bridged joints, larger than the body is there.

    Append them to the body's own balls, `balls.joined(bridge_balls(...))`: `colour` knows them by their numbers, which
    follow those of `BodyShape.parts`.

    Args:
        body: the body.
        joints: positions of its joints [..., J, 3], metres.
        which: the bridged ones [J].
    """
    radii = _girths(body)[which]
    return Ellipsoids(joints[..., which, :], radii[:, None, None] * np.eye(3))


@lru_cache(maxsize=8)
def _girths(body: BodyShape) -> Floats:
    """Compute the radii [J], metres, of balls that stand out from the solids around the joints: 5 cm at least."""
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
    return np.asarray(np.maximum(1.2 * radii, 0.050 * body.size))


def haze(body: BodyShape) -> tuple[float, float, float]:
    """Return the depths where haze begins and is full, metres in the viewer's axes, and its share of white there."""
    depth = 0.45 * body.size  # metres, before and behind the root
    return depth, -depth, 0.30


def colour(
    buffer: DepthBuffer, body: BodyShape, background: Pixels, line: int = 2, paints: Floats | None = None
) -> Pixels:
    """Paint a depth buffer before a background.

    Farther surfaces are paler. Where a body part stands before another, a line around it lies on the farther one, so
    the nearer keeps its shape. Solids numbered beyond the body's are balls around bridged joints.

    Args:
        buffer: the depth buffer [H, W].
        body: the body drawn in it.
        background: the picture behind it [H, W, 3], RGB; unchanged.
        line: width of the lines, pixels.
        paints: RGB of the body's solids [N, 3], 0 to 255; `given_colours(body)` by default.

    Returns:
        The picture [H, W, 3].
    """
    names = {name: number for number, name in enumerate(dict.fromkeys(body.parts))}
    joints = len(body.skeleton)  # no more can be bridged
    parts = np.array([names[part] for part in body.parts] + [len(names)] * joints)
    colours = np.concatenate([given_colours(body) if paints is None else paints, np.tile(BRIDGED, (joints, 1))]).astype(
        float
    )
    picture = background.copy()
    ink = np.array(INK, dtype=np.uint8)
    arrays = buffer.solid, buffer.depth, buffer.shade
    raster.colour(picture, *arrays, colours, parts, haze(body), DEPTH_STEP_M * body.size, line, ink)
    return picture


def halved(picture: Pixels) -> Pixels:
    """Return a picture [H, W, 3] at half its width and height [H // 2, W // 2, 3], each pixel the mean of four."""
    height, width = len(picture) // 2, picture.shape[1] // 2
    four = picture[: 2 * height, : 2 * width].reshape(height, 2, width, 2, 3).sum(axis=(1, 3), dtype=np.uint16)
    return np.asarray((four + 2) // 4, dtype=np.uint8)  # 2, to round and not truncate
