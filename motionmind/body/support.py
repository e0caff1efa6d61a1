"""Support: the limbs that bear a body, its balance over them, flights, and standing feet that rise.

A limb *bears* the body in a frame in which one of its points is near the lowest point of the body and hardly moves. A
body is *airborne* while even its lowest point is well above the floor. In between, as on half-pointe, or in a recording
with an inexact floor, it stands: so "near" is measured from the body's lowest point, not from the floor.

The *support* is the convex hull of the bearing limbs' low points on the floor; the *overhang* is the distance of the
centre of mass from it, seen from above. Limbs are those of `limbs_of`, then the trunk: a body can stand on its hands
and sit, and an insect stands on six limbs. Lengths are for a person as tall as human23, and scale with the body.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.anatomy import Masses
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.contact import Posed, contact_points, limb_heights, pose
from motionmind.body.human import human23
from motionmind.body.limbs import limb_of_points
from motionmind.body.skeleton import Skeleton, joints_of, place, remembered
from motionmind.geometry.rotations import norm
from motionmind.jit import jit

SUPPORT_HEIGHT_M = 0.05  # metres above the body's lowest point within which a limb can bear
SUPPORT_SPEED_MPS = 0.3  # metres a second: a point that moves faster does not bear
# Metres above the floor of the lowest point of a body in the air. Dancers on half-pointe, and recordings whose floor is
# a little off, reach 8 to 12 cm; above it, the mass of the dancers of `cmu-05` and `cmu-16` falls freely.
AIRBORNE_M = 0.12


class Support(NamedTuple):
    """The support of a body in each of T frames.

    Attributes:
        bears: whether each limb, and last the trunk, bears the body [T, limbs + 1].
        airborne: whether the body is in the air [T].
        mass: the centre of mass [T, 3], metres; None for a body whose masses are not known.
        overhang: distance of the centre of mass from the support, seen from above [T], metres: 0 over it, NaN where no
            limb bears; None as for `mass`.
    """

    bears: Bools
    airborne: Bools
    mass: Floats | None
    overhang: Floats | None


def find_support(
    skeleton: Skeleton, rotations: Floats, root: Floats, fps: float, floor: float | Floats = 0.0
) -> Support:
    """Find the limbs that bear a body, and its balance over them, in each frame.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4].
        root: positions of the root [T, 3], metres.
        fps: frames a second.
        floor: height of the floor, or in each frame [T], metres.
    """
    posed = pose(skeleton, rotations, root)
    limb = limb_of_points(skeleton)[posed.joints]
    bears, airborne, touches = find_bearers(posed.places, limb, size_of(skeleton), fps, floor)
    mass = mass_of(skeleton, posed)
    over = None if mass is None else overhang(posed.places[..., [0, 2]], touches, mass[:, [0, 2]])
    return Support(bears, airborne, mass, over)


def find_bearers(
    places: Floats, limb: Ints, size: float, fps: float, floor: float | Floats = 0.0
) -> tuple[Bools, Bools, Bools]:
    """Find which limbs bear a body [T, limbs + 1], when it is in the air [T], and which points are its support [T, P].

    Args:
        places: of the points that can touch the floor [T, P, 3], metres.
        limb: the limb, or trunk, that each belongs to [P].
        size: of the body (`size_of`).
        fps: frames a second.
        floor: height of the floor, or in each frame [T], metres.
    """
    lowest = places[..., 1].min(axis=-1)
    airborne = lowest > floor + AIRBORNE_M * size
    bears, touches = _find_bearers(
        places, limb, lowest + SUPPORT_HEIGHT_M * size, airborne, SUPPORT_SPEED_MPS * size, fps
    )
    return bears, airborne, touches


@remembered
def size_of(skeleton: Skeleton) -> float:
    """Return the size of a body relative to human23, by its greatest extent at rest, spread legs included.

    A body that is a single point has size 1.
    """
    return (_extent(skeleton) / _extent_of_person()) or 1.0


def centre_of_mass(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats | None:
    """Return the centre of mass [..., 3], metres; None for a body whose masses are not known.

    Args:
        skeleton: the body; any proportions have the shares of mass of the anatomy.
        rotations: local rotations [..., J, 4].
        root: positions of the root [..., 3], metres.
    """
    masses = masses_of(skeleton)
    if masses is None:
        return None
    turned = skeleton.global_rotations(rotations)
    return masses.centre(place(skeleton, joints_of(skeleton), turned, root), turned)


def mass_of(skeleton: Skeleton, posed: Posed) -> Floats | None:
    """Return the centre of mass of a posed movement [T, 3], metres; None where masses are unknown."""
    masses = masses_of(skeleton)
    return None if masses is None else masses.centre(posed.places, posed.turned)


@remembered
def masses_of(skeleton: Skeleton) -> Masses | None:
    """Return the masses of a body's segments; None where they are not known."""
    anatomy = anatomy_of(skeleton)
    return None if anatomy is None or not anatomy.has_masses else anatomy.masses_of(skeleton)


def overhang(points: Floats, supports: Bools, mass: Floats) -> Floats:
    """Return the distance of a centre of mass from the convex hull of its supports [T], metres.

    Args:
        points: points of the body, seen from above [T, P, 2], metres.
        supports: whether each point is a support [T, P].
        mass: centre of mass, seen from above [T, 2], metres.

    Returns:
        Distances: 0 over the hull, NaN without a support.
    """
    return _overhang(np.ascontiguousarray(points), supports, np.ascontiguousarray(mass))


def stands_alone(skeleton: Skeleton, rotations: Floats, root: Floats) -> Ints:
    """Return the number of the one limb, or trunk, that postures stand on [...]; -1 where several are low.

    A posture has no speed: the limb is the only one with a point near the body's lowest.

    Args:
        skeleton: the body.
        rotations: local rotations [..., J, 4].
        root: positions of the root [..., 3], metres.
    """
    heights = limb_heights(skeleton, rotations, root)
    low = heights <= heights.min(axis=-1, keepdims=True) + SUPPORT_HEIGHT_M * size_of(skeleton)
    return np.where(low.sum(axis=-1) == 1, low.argmax(axis=-1), -1)


def standing_rise(skeleton: Skeleton, rotations: Floats, root: Floats) -> float:
    """Return the greatest rise of the only standing limb during a movement (`standing_rises`), metres; NaN if None.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4].
        root: positions of the root [T, 3], metres.
    """
    rises = standing_rises(skeleton, rotations, root)
    return float("nan") if rises is None else float(rises.max())


def standing_rises(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats | None:
    """Return the rise of the one limb that a movement stands on at both ends [T], metres.

    It is the height of the limb's lowest point above a line from its first to its last place. None if the ends do not
    stand on the same single limb, or if it steps.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4].
        root: positions of the root [T, 3], metres.
    """
    ends = stands_alone(skeleton, rotations[[0, -1]], root[[0, -1]])
    if ends[0] < 0 or ends[0] != ends[1]:
        return None
    places, joints = contact_points(skeleton, rotations, root)
    places = places[:, limb_of_points(skeleton)[joints] == ends[0]]
    moved = (places[-1] - places[0])[:, [0, 2]]
    if np.linalg.norm(moved, axis=1).min() > 0.1 * size_of(skeleton):  # a step
        return None
    heights = places[..., 1].min(axis=1)
    return np.asarray(heights - np.linspace(heights[0], heights[-1], len(heights)))


@cache
def _extent_of_person() -> float:
    """Return the greatest extent of human23 at rest, metres."""
    return _extent(human23())


def _extent(skeleton: Skeleton) -> float:
    return float(np.ptp(skeleton.rest, axis=0).max())


def _find_bearers(
    places: Floats, limb: Ints, near: Floats, airborne: Bools, still: float, fps: float
) -> tuple[Bools, Bools]:
    """Return which limbs bear a body [T, limbs + 1], and which of its points are its support [T, P].

    Args:
        places: of the points [T, P, 3], metres.
        limb: the limb, or trunk, that each belongs to [P].
        near: height up to which a point is low [T], metres.
        airborne: whether the body is in the air [T].
        still: speed up to which a point bears, metres a second: over two frames, at the ends over one.
        fps: frames a second.
    """
    frames = np.arange(len(places))
    before, after = np.maximum(frames - 1, 0), np.minimum(frames + 1, len(places) - 1)
    frames_between = np.maximum(after - before, 1)[:, None]
    low = (places[..., 1] <= near[:, None]) & ~airborne[:, None]
    rests = low & (norm(places[after] - places[before]) * fps / frames_between < still)
    bears = np.stack([rests[:, limb == one].any(axis=1) for one in range(limb.max() + 1)], axis=1)
    return bears, bears[:, limb] & low


@jit
def _overhang(points: Floats, supports: Bools, mass: Floats) -> Floats:
    """Return the overhang [T], see `overhang`.

    Seen from the centre of mass, points that surround it leave no gap of half a turn between their directions. Outside
    of the hull its distance is that to the nearest of all segments between two supports, for the hull's sides are among
    them and none leaves the hull.
    """
    out = np.full(len(points), np.nan)
    for t in range(len(points)):
        chosen = np.flatnonzero(supports[t])
        if len(chosen) == 0:
            continue
        xs, ys, angles = np.empty(len(chosen)), np.empty(len(chosen)), np.empty(len(chosen))
        least = np.inf
        for i in range(len(chosen)):
            x, y = points[t, chosen[i], 0] - mass[t, 0], points[t, chosen[i], 1] - mass[t, 1]
            xs[i], ys[i], at = x, y, i
            angle = np.arctan2(y, x)
            while at > 0 and angles[at - 1] > angle:  # in order
                angles[at] = angles[at - 1]
                at -= 1
            angles[at] = angle
            for j in range(i + 1):
                side_x, side_y = xs[j] - x, ys[j] - y
                length = side_x**2 + side_y**2
                share = 0.0 if length == 0.0 else min(max(-(x * side_x + y * side_y) / length, 0.0), 1.0)
                least = min(least, (x + share * side_x) ** 2 + (y + share * side_y) ** 2)
        gap = angles[0] + 2.0 * np.pi - angles[-1]
        for i in range(1, len(angles)):
            gap = max(gap, angles[i] - angles[i - 1])
        out[t] = 0.0 if gap < np.pi else np.sqrt(least)
    return out
