"""Builds a low-poly body for any skeleton: a tapered prism around each bone, with a ridge along its front.

Some programs treat an armature without a mesh as empty, and it does not show which way a knee points.
`motionmind.render` draws better bodies, which a file could not hold.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.mirror import MIDDLE, sides_of
from motionmind.body.palette import FRONT_COLOUR, SIDE_COLOURS, Colour
from motionmind.body.skeleton import Skeleton

FRONT = "front"

COLOURS: Mapping[str, Colour] = {**SIDE_COLOURS, FRONT: FRONT_COLOUR}

# The prism's section: corners about the bone, starting at its front. The two faces beside the first corner are the
# ridge, narrow enough that a limb seen from the front still shows its side's colour.
_CORNERS_RAD = np.radians([0.0, 22.0, 80.0, 140.0, 220.0, 280.0, 338.0])
_RING_SHARES = np.array([0.0, 0.5, 1.0])  # places of the sections along the bone


@dataclass(frozen=True, eq=False)
class Bones:
    """The B bones under the mesh: from each joint to its children, and from each leaf to its tip.

    Attributes:
        joints: the joint that moves each bone [B].
        starts, ends: its ends at rest [B, 3], metres.
        radii: at its ends [B, 2], metres.
        sides: LEFT, RIGHT or MIDDLE for each bone.
        heads: whether it is a head, a leaf in the middle [B].
    """

    joints: Indices
    starts: Floats
    ends: Floats
    radii: Floats
    sides: tuple[str, ...]
    heads: Bools


@dataclass(frozen=True, eq=False)
class Mesh:
    """The body's V vertices at rest; triangles share no vertices, so each is flat.

    Attributes:
        positions, normals: of the vertices [V, 3]; metres, and unit vectors.
        joints: the joint that moves each vertex [V].
        paints: {name in `COLOURS`: its vertices [n], at least one}; three in a row are a triangle, counterclockwise
            from outside.
    """

    positions: Floats
    normals: Floats
    joints: Indices
    paints: Mapping[str, Indices]


def body_mesh(skeleton: Skeleton, root: Floats) -> Mesh:
    """Build the mesh of a body at rest with its root at `root` [3], metres.

    Its front points to +z, on a bone along z to +y.
    """
    bones = bones_of(skeleton, root)
    corners = _corners(bones)  # [B, P, 3]
    template, ridge = _template()
    triangles = corners[:, template]  # [B, F, 3, 3]
    normals = np.cross(triangles[:, :, 1] - triangles[:, :, 0], triangles[:, :, 2] - triangles[:, :, 0])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    paint = np.array([[FRONT if front else side for front in ridge] for side in bones.sides])
    painted = np.repeat(paint.ravel(), 3)
    return Mesh(
        triangles.reshape(-1, 3),
        np.repeat(normals.reshape(-1, 3), 3, axis=0),
        np.repeat(bones.joints, 3 * len(template)),
        {name: np.flatnonzero(painted == name) for name in COLOURS if (painted == name).any()},
    )


def bones_of(skeleton: Skeleton, root: Floats) -> Bones:
    """Return the bones with a length, of a body at rest with its root at `root` [3], metres.

    If no bone has a length, return a single one that points up.
    """
    count, parents = len(skeleton), skeleton.parents
    both = skeleton.rest + root
    rest, tips = both[:count], both[count:]
    span = float(np.ptp(both, axis=0).max()) or 1.0
    sides = sides_of(skeleton)
    radii = _radii(skeleton, sides, span)
    rows: list[tuple[int, Floats, float, float, str, bool]] = []
    for joint, parent in enumerate(parents):
        if parent >= 0:
            start = radii[parent] if sides[parent] == sides[joint] else radii[joint]
            rows.append((parent, rest[joint], start, radii[joint], sides[joint], False))
    for joint in sorted(set(range(count)) - set(parents)):
        length = float(np.linalg.norm(skeleton.tips[joint]))
        head = sides[joint] == MIDDLE and joint > 0
        thick = min(max(0.35 * length, radii[joint]), 0.05 * span) if head else radii[joint]
        rows.append((joint, tips[joint], thick, (0.9 if head else 0.6) * thick, sides[joint], head))
    rows = [row for row in rows if np.linalg.norm(row[1] - rest[row[0]]) > 1e-4 * span]
    if not rows:
        rows = [(0, rest[0] + [0.0, 0.1 * span, 0.0], 0.02 * span, 0.02 * span, MIDDLE, False)]
    joints = np.array([row[0] for row in rows])
    return Bones(
        joints,
        rest[joints],
        np.array([row[1] for row in rows]),
        np.array([row[2:4] for row in rows]),
        tuple(row[4] for row in rows),
        np.array([row[5] for row in rows]),
    )


def _radii(skeleton: Skeleton, sides: list[str], span: float) -> Floats:
    """Return the body's radii at its joints [J], metres; they shrink towards a limb's end."""
    reach = np.linalg.norm(skeleton.tips, axis=-1)
    for joint in range(len(skeleton) - 1, 0, -1):
        parent = skeleton.parents[joint]
        reach[parent] = max(reach[parent], reach[joint] + np.linalg.norm(skeleton.offsets[joint]))
    trunk = np.array([side == MIDDLE for side in sides])
    return np.asarray((0.008 * span + 0.04 * np.minimum(reach, 0.6 * span)) * np.where(trunk, 1.5, 1.0))


def _corners(bones: Bones) -> Floats:
    """Return the prisms' corners [B, P, 3]: the rings', from the bone's start on, then the points at its two ends."""
    along = bones.ends - bones.starts
    axis = along / np.linalg.norm(along, axis=-1, keepdims=True)
    front = np.where(np.abs(axis[:, 2:]) > 0.8, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    front = front - np.sum(front * axis, axis=-1, keepdims=True) * axis
    front /= np.linalg.norm(front, axis=-1, keepdims=True)
    across = np.cross(axis, front)
    around = (
        front[:, None] * np.cos(_CORNERS_RAD)[:, None] + across[:, None] * np.sin(_CORNERS_RAD)[:, None]
    )  # [B, C, 3]
    thick = bones.radii[:, :1] + _RING_SHARES * (bones.radii[:, 1:] - bones.radii[:, :1])  # [B, R]
    stand_out = np.ones((len(axis), len(_RING_SHARES), len(_CORNERS_RAD)))
    stand_out[:, :, 0] = 1.3  # the ridge, in radii
    stand_out[bones.heads, 1, 0] = 1.8  # the nose, at half the head's height
    middles = bones.starts[:, None] + _RING_SHARES[:, None] * along[:, None]  # [B, R, 3]
    rings = middles[:, :, None] + (thick[:, :, None] * stand_out)[..., None] * around[:, None]
    # Caps end half a radius beyond the bone.
    ends = np.stack([bones.starts - 0.5 * bones.radii[:, :1] * axis, bones.ends + 0.5 * bones.radii[:, 1:] * axis], 1)
    return np.concatenate([rings.reshape(len(axis), -1, 3), ends], axis=1)


def _template() -> tuple[Indices, list[bool]]:
    """Return the prism's triangles [F, 3] as indices of its corners, and whether each belongs to the ridge [F]."""
    count, rings = len(_CORNERS_RAD), len(_RING_SHARES)
    bottom, top, last = rings * count, rings * count + 1, (rings - 1) * count
    triangles: list[tuple[int, int, int]] = []
    ridge: list[bool] = []
    for i in range(count):
        j = (i + 1) % count
        for k in range(0, last, count):
            triangles += [(k + i, k + j, k + count + j), (k + i, k + count + j, k + count + i)]
        triangles += [(bottom, j, i), (top, last + i, last + j)]
        ridge += [0 in (i, j)] * (2 * rings - 2) + [False, False]
    return np.array(triangles), ridge
