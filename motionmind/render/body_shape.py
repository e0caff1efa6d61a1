"""The body of any skeleton: a person's, or tapered limbs."""

from __future__ import annotations

import numpy as np

from motionmind.body.human import human23
from motionmind.body.mirror import MIDDLE, sides_of
from motionmind.body.skeleton import Skeleton
from motionmind.render.body_solids import BodyShape, Cone, as_point, extent, joint_frames
from motionmind.render.person import PersonShape


def shape_of(skeleton: Skeleton) -> BodyShape:
    """Build the body of any skeleton.

    A skeleton that contains human23's tree, with or without further joints, gets a person's body; any other gets a
    tapered limb for each bone.

    Args:
        skeleton: the skeleton, in metres.
    """
    return PersonShape(skeleton).build() if _is_person(skeleton) else _creature(skeleton)


def _is_person(skeleton: Skeleton) -> bool:
    human = human23()
    nearest: list[str | None] = []  # for each joint, the nearest of human23's joints at or above it
    for name, parent in zip(skeleton.names, skeleton.parents, strict=True):
        above = nearest[parent] if parent >= 0 else None
        if name in human.names:
            expected = human.parents[human.index(name)]
            if above != (human.names[expected] if expected >= 0 else None):
                return False
        nearest.append(name if name in human.names else above)
    return set(human.names) <= set(skeleton.names)


def _creature(skeleton: Skeleton) -> BodyShape:
    """Build a tapered limb from each joint to its children and its tip, thinner towards the end of the limb."""
    size = extent(skeleton)
    levels = np.zeros(len(skeleton), dtype=int)  # joints below each joint, along the longest chain
    for joint in range(len(skeleton) - 1, 0, -1):
        parent = skeleton.parents[joint]
        levels[parent] = max(levels[parent], levels[joint] + 1)
    paints, centre = sides_of(skeleton), (0.0, 0.0, 0.0)
    radii = size * (0.008 + 0.006 * np.minimum(levels, 4))
    radii[[paint == MIDDLE for paint in paints]] *= 1.5  # a thicker trunk
    cones = [
        Cone(skeleton.names[parent], paints[joint], parent, centre, radii[joint], joint, centre, radii[joint])
        for joint, parent in enumerate(skeleton.parents)
        if parent >= 0
    ]
    cones += [
        Cone(
            skeleton.names[joint], paints[joint], joint, centre, radii[joint], joint, as_point(tip), 0.6 * radii[joint]
        )
        for joint, tip in enumerate(skeleton.tips)
        if tip.any() or len(skeleton) == 1
    ]
    return BodyShape(skeleton, joint_frames(skeleton), tuple(cones), (), size / human23().height)
