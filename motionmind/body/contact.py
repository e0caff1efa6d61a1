"""Contact with the floor: heights of a body's points, the height of the floor, and sliding of feet.

The argument `heels` chooses between two sets of points:

- `heels=True`: joints, tips and heels. The engine places its movement by these, so that heels do not sink into the
  floor. Only bodies with a known anatomy have heels; they are points of the ankle's segment, not joints.
- `heels=False`: joints and tips only. The published measures of skating and sliding, and the floor that they refer to,
  are defined on the joints of a recording.

Movement is given as in `Motion`: local rotations [..., J, 4] and root positions [..., 3]; all lengths are metres.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.arguments import as_floats
from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.limbs import limb_of_points, limbs_of
from motionmind.body.skeleton import Points, Skeleton, place, places_of, points_of, remembered

CONTACT_FPS = 30.0  # frames a second, to measure feet
STANCE_HEIGHT_M = 0.05  # metres above the floor: a lower foot should stand
STANCE_STEP_M = 0.025  # metres that a standing foot may move from one frame to the next
TALL_BODY_M = 1.0  # metres: the limits of feet hold for bodies of at least this height


class Heel(NamedTuple):
    """A heel: a point of the ankle's segment, not a joint.

    Attributes:
        ankle: index of the ankle.
        place: position of the heel in the ankle's frame [3], metres.
    """

    ankle: int
    place: Floats


# --- heights ----------------------------------------------------------------------------------------------------------


def lowest_height(skeleton: Skeleton, rotations: Floats, root: Floats, *, heels: bool = True) -> Floats:
    """Return the heights [...] of the lowest point of postures, metres.

    Args:
        skeleton: the body.
        rotations: local rotations [..., J, 4].
        root: positions of the root [..., 3], metres.
        heels: whether heels count besides joints and tips (see the module).
    """
    from motionmind.body.kinematics import write_lowest  # numba is slow to import

    points, _ = (_with_heels if heels else _without_heels)(skeleton)
    turned, root = skeleton.global_rotations(rotations), as_floats("root", root)
    out = np.empty(turned.shape[:-2])
    out[...] = root[..., 1]
    write_lowest(out.reshape(-1), turned.reshape(-1, len(skeleton), 4), *points)
    return out


def limb_heights(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats:
    """Return the height of the lowest point of each limb, then of the trunk [..., limbs + 1], metres; heels count.

    Limbs are as in `limbs_of`; the trunk's height is infinite if every joint belongs to a limb.

    Args:
        skeleton: the body.
        rotations: local rotations [..., J, 4].
        root: positions of the root [..., 3], metres.
    """
    places, joints = contact_points(skeleton, rotations, root)
    heights = places[..., 1]
    limb = limb_of_points(skeleton)[joints]
    count = len(limbs_of(skeleton)) + 1
    out = np.full((*heights.shape[:-1], count), np.inf)
    for number in range(count):
        out[..., number] = heights[..., limb == number].min(axis=-1, initial=np.inf)
    return out


def lowest_point(anatomy: Anatomy, rotations: Floats, root: Floats) -> tuple[Floats, Indices]:
    """Return the height [T] of the lowest point of an anatomy's own body, metres, and the point's joint [T].

    Heels count, as points of the ankles.

    Args:
        anatomy: the body.
        rotations: local rotations [T, J, 4].
        root: positions of the root [T, 3], metres.
    """
    points, joints = _contacts(anatomy.skeleton, anatomy)
    heights = places_of(anatomy.skeleton, points, rotations, root)[..., 1]
    at = heights.argmin(axis=-1)
    return np.take_along_axis(heights, at[..., None], axis=-1)[..., 0], joints[at]


def contact_points(
    skeleton: Skeleton, rotations: Floats, root: Floats, *, heels: bool = True
) -> tuple[Floats, Indices]:
    """Return the positions [..., P, 3] of all points that can touch the floor, metres, and the joint of each [P].

    These are the joints, then the tips, then the heels of a body with a known anatomy.

    Args:
        skeleton: the body.
        rotations: local rotations [..., J, 4].
        root: positions of the root [..., 3], metres.
        heels: whether heels count besides joints and tips (see the module).
    """
    points, joints = (_with_heels if heels else _without_heels)(skeleton)
    return places_of(skeleton, points, rotations, root), joints


class Posed(NamedTuple):
    """A movement in the world, from which contacts, the centre of mass and bent legs are computed.

    Attributes:
        rotations: local rotations [T, J, 4].
        turned: orientations of the joints in the world [T, J, 4].
        places: positions of the points that can touch the floor [T, P, 3], metres: joints, tips and heels.
        joints: the joint of each point [P].
    """

    rotations: Floats
    turned: Floats
    places: Floats
    joints: Indices

    @property
    def lowest(self) -> Floats:
        """Height of the lowest point [T], metres."""
        return np.asarray(self.places[..., 1].min(axis=1))

    def part(self, frames: slice) -> Posed:
        """Return some of the frames."""
        return self._replace(rotations=self.rotations[frames], turned=self.turned[frames], places=self.places[frames])


def pose(skeleton: Skeleton, rotations: Floats, root: Floats | None = None) -> Posed:
    """Place a movement in the world by forward kinematics.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4].
        root: positions of the root [T, 3], metres; None for the origin.
    """
    points, joints = _with_heels(skeleton)
    turned = skeleton.global_rotations(rotations)
    return Posed(rotations, turned, place(skeleton, points, turned, np.zeros(3) if root is None else root), joints)


@remembered
def _with_heels(skeleton: Skeleton) -> tuple[Points, Indices]:
    return _contacts(skeleton, anatomy_of(skeleton))


@remembered
def _without_heels(skeleton: Skeleton) -> tuple[Points, Indices]:
    return _contacts(skeleton, None)


def _contacts(skeleton: Skeleton, anatomy: Anatomy | None) -> tuple[Points, Indices]:
    """Return all joints, all tips and, given an anatomy with legs, both heels; and the joint of each [P]."""
    ankles, heels = (
        ((), ()) if anatomy is None else _heel_points(anatomy, skeleton is anatomy.skeleton, skeleton.height)
    )
    own = np.arange(len(skeleton))
    joints = np.concatenate([own, own, np.array(ankles, dtype=np.int64)])
    places = np.concatenate([skeleton.tips, heels]) if ankles else skeleton.tips
    return points_of(skeleton, joints[len(skeleton) :], places), joints


def heels_of(skeleton: Skeleton) -> dict[str, Heel]:
    """Return the heels of a body by name, in the order of `contact_points`; none without a known anatomy."""
    anatomy = anatomy_of(skeleton)
    if anatomy is None:
        return {}
    ankles, places = _heel_points(anatomy, skeleton is anatomy.skeleton, skeleton.height)
    heels = (Heel(ankle, np.array(place)) for ankle, place in zip(ankles, places, strict=True))
    return {f"{side}_heel": heel for side, heel in zip(SIDES, heels, strict=False)}


@lru_cache(maxsize=64)
def _heel_points(
    anatomy: Anatomy, is_own: bool, height: float
) -> tuple[tuple[int, ...], tuple[tuple[float, ...], ...]]:
    """Return the ankles, one a side, and the positions of the heels in their frames, metres; none without legs.

    Args:
        anatomy: the anatomy.
        is_own: whether the body is the anatomy's own.
        height: height of any other body, metres.
    """
    if anatomy.leg is None:
        return (), ()
    place = np.array(anatomy.leg.heel)
    if not is_own:  # given in the anatomy's own proportions
        place = place * height / anatomy.skeleton.height
    places = place, place * np.array([-1.0, 1.0, 1.0])
    ankles = (anatomy.named(anatomy.leg.ankle, side) for side in SIDES)
    return tuple(ankles), tuple(tuple(place.tolist()) for place in places)


# --- the floor --------------------------------------------------------------------------------------------------------


def floor_height(lowest: Floats) -> float:
    """Return the height of the floor under movement, metres, from the heights [T] of the body's lowest point.

    A recording's zero is often off, so the floor is the 5 % quantile of the lowest point's height.
    """
    return float(np.quantile(lowest, 0.05))


def find_floor(skeleton: Skeleton, rotations: Floats, root: Floats, *, heels: bool = False) -> float:
    """Return the height of the floor under movement, metres: `floor_height` of its lowest points.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4].
        root: positions of the root [T, 3], metres.
        heels: whether heels count; measures of skating leave them out (see the module).
    """
    return floor_height(lowest_height(skeleton, rotations, root, heels=heels))


# --- feet -------------------------------------------------------------------------------------------------------------


@remembered
def find_feet(skeleton: Skeleton) -> list[int]:
    """Return the joints that end in feet: a person's toes, the last joints of an insect's legs.

    A foot is a leaf of the tree. At rest, its end is within a tenth of the body's height of the lowest point.
    """
    at_rest = skeleton.rest[:, 1]
    ends = np.minimum(at_rest[: len(skeleton)], at_rest[len(skeleton) :])
    low = ends.min() + 0.1 * np.ptp(at_rest)
    return [joint for joint in range(len(skeleton)) if not skeleton.children(joint) and ends[joint] <= low]


def skating(skeleton: Skeleton, rotations: Floats, root: Floats, floor: float = 0.0) -> float:
    """Return the share of frames in which a foot skates: below 5 cm, and moving more than 2.5 cm to the next frame.

    Source: Karunratanakul, Preechakul, Suwajanakorn and Tang, "Guided motion diffusion for controllable human motion
    synthesis", ICCV (2023), with the same limits but two differences. Frames are at 30 a second, not 20, so the limit
    is 0.75 m/s, not 0.5. And both ends of a foot's last bone count: a foot that turns on its ball or its tip stands. A
    foot skates if it has an end below 5 cm in both frames and every such end moves too far horizontally. A foot that
    swings past near the floor, as in walking, counts too: compare with the corpus's own movement. Heels do not count.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4] at 30 frames a second.
        root: positions of the root joint [T, 3], metres.
        floor: height of the floor, metres; for a recording, from `find_floor`.
    """
    slides = foot_slides(skeleton, rotations, root, floor)
    return float((slides > STANCE_STEP_M).any(axis=-1).mean()) if len(slides) else 0.0


def foot_slides(skeleton: Skeleton, rotations: Floats, root: Floats, floor: float | Floats = 0.0) -> Floats:
    """Return how far each foot near the floor slides to the next frame [T - 1, feet], metres; 0 where it is higher.

    A foot is near the floor if one of its ends (see `skating`) is below 5 cm in both frames. Of two such ends, the one
    that moves less horizontally counts.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4].
        root: positions of the root joint [T, 3], metres.
        floor: height of the floor, or in each frame [T], metres.
    """
    return slides_between(skeleton, skeleton.positions_and_tips(rotations, root), floor)


def slides_between(skeleton: Skeleton, places: Floats, floor: float | Floats) -> Floats:
    """Return the `foot_slides`, given places [T, P, 3] of joints and tips, then of any other points, metres."""
    moved, height = _foot_ends(skeleton, places, floor)
    least = np.where(height < STANCE_HEIGHT_M, moved, np.inf).min(axis=-1)
    return np.where(np.isfinite(least), least, 0.0)


def feet_that_stay(skeleton: Skeleton, rotations: Floats, root: Floats, floor: float = 0.0) -> Bools:
    """Return whether each foot stays in place on the floor from the first frame to the last [feet].

    Such a foot is near the floor in every frame (see `foot_slides`), and slides at most 5 cm in all.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4], for at least two frames.
        root: positions of the root joint [T, 3], metres.
        floor: height of the floor, metres.
    """
    moved, height = _foot_ends(skeleton, skeleton.positions_and_tips(rotations, root), floor)
    least = np.where(height < STANCE_HEIGHT_M, moved, np.inf).min(axis=-1)
    return np.asarray(least.sum(axis=0) <= 0.05)  # metres that a foot may slide as it rolls


def foot_slide(skeleton: Skeleton, rotations: Floats, root: Floats, floor: float = 0.0) -> float:
    """Return the mean slide over frames and feet, v (2 - 2^(h / H)), in cm a frame at 30 frames a second.

    Here v is a foot's horizontal displacement, h its height and H = 2.5 cm. The factor falls from 1 on the floor to 0
    at H and above. Of a foot's two ends (see `skating`) below H, the one that slides less counts; heels do not. Source:
    Zhang, Starke, Komura and Saito, "Mode-adaptive neural networks for quadruped motion control", ACM TOG 37(4)
    (2018).

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4] at 30 frames a second.
        root: positions of the root joint [T, 3], metres.
        floor: height of the floor, metres; for a recording, from `find_floor`.
    """
    moved, height = _foot_ends(skeleton, skeleton.positions_and_tips(rotations, root), floor)
    share = np.clip(2.0 - 2.0 ** (height / 0.025), 0.0, 1.0)
    least = np.where(share > 0.0, moved * share, np.inf).min(axis=-1)
    return float(100.0 * np.where(np.isfinite(least), least, 0.0).mean()) if least.size else 0.0


def _foot_ends(skeleton: Skeleton, places: Floats, floor: float | Floats) -> tuple[Floats, Floats]:
    """Return the displacements and heights of both ends of each foot's last bone, [T - 1, feet, 2] each, metres.

    Displacements are horizontal, from each frame to the next; heights are the greater of the two frames' heights above
    the floor. `places` are as in `slides_between`.
    """
    feet = np.array(find_feet(skeleton), dtype=np.intp)
    ends = places[:, np.stack([feet, feet + len(skeleton)], axis=-1)]
    moved = np.hypot(np.diff(ends[..., 0], axis=0), np.diff(ends[..., 2], axis=0))
    height = ends[..., 1] - np.reshape(floor, (-1, 1, 1))
    return moved, np.maximum(height[1:], height[:-1])
