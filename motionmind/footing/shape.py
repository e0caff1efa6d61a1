"""Shape of a body: its points and parts relative to the root, feet apart from everything else."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.contact import Posed
from motionmind.body.limbs import limb_of_points, limbs_of
from motionmind.body.skeleton import Skeleton
from motionmind.footing.feet import Foot, foot_points, track_of


class Shape(NamedTuple):
    """A body and its parts in each frame, relative to the root.

    Attributes:
        places: positions of the points that may touch the floor [N, P, 3], metres.
        feet: whether a point belongs to each foot [feet, P].
        others: whether a point belongs to each other part: limbs without their feet, then the trunk [parts, P].
        low: height of each foot's lowest point [N, feet], metres.
        low_others: the same of the other parts [N, parts]; infinite for one without points.
        tracks: level positions of the feet, constant while they stand or roll [N, feet, 2], metres.
        outward: level unit vectors from the middle of the hips to each leg's [N, feet, 2].
    """

    places: Floats
    feet: Bools
    others: Bools
    low: Floats
    low_others: Floats
    tracks: Floats
    outward: Floats

    @property
    def lowest(self) -> Floats:
        """Height of the lowest point of the body [N], metres."""
        return np.asarray(self.places[..., 1].min(axis=1))


def shape_of(skeleton: Skeleton, posed: Posed, feet: list[Foot]) -> Shape:
    """Return the shape of a body posed about its root."""
    places, limb = posed.places, limb_of_points(skeleton)[posed.joints]
    of_feet = points_of_feet(skeleton, posed.joints, feet)
    others = (limb == np.arange(len(limbs_of(skeleton)) + 1)[:, None]) & ~of_feet.any(axis=0)
    hips = places[:, [foot.leg[0] for foot in feet]][..., [0, 2]]
    outward = hips - hips.mean(axis=1, keepdims=True) if feet else hips
    outward /= np.maximum(np.linalg.norm(outward, axis=-1, keepdims=True), 1e-9)
    tracks = [track_of(foot, places, len(skeleton)) for foot in feet]
    along = np.stack(tracks, axis=1) if feet else np.zeros((len(places), 0, 2))
    return Shape(places, of_feet, others, lowest(places, of_feet), lowest(places, others), along, outward)


def points_of_feet(skeleton: Skeleton, joints: Indices, feet: list[Foot]) -> Bools:
    """Return whether each point belongs to each foot [feet, P], from the joint of each point [P]."""
    own = [foot_points(foot, joints, len(skeleton)) for foot in feet]
    return np.stack(own) if own else np.zeros((0, len(joints)), dtype=np.bool_)


def lowest(places: Floats, parts: Bools) -> Floats:
    """Return the height of the lowest point of each part [N, parts], metres; infinite for a part without points.

    Args:
        places: positions of the body's points [N, P, 3], metres.
        parts: whether a point belongs to each part [parts, P].
    """
    heights = [places[:, own, 1].min(axis=1, initial=np.inf) for own in parts]
    return np.stack(heights, axis=1) if heights else np.zeros((len(places), 0))
