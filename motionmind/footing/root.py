"""Trajectory of the root: a foot in stance carries the body; without one it travels as in the corpus."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.contact import Posed, lowest_height
from motionmind.body.limbs import limb_of_points
from motionmind.body.skeleton import Skeleton
from motionmind.footing.course import Course
from motionmind.footing.feet import GRIP_HEIGHT_M
from motionmind.footing.smoothing import smoothed
from motionmind.geometry.polylines import length_of, places_along

CORPUS_TRAVEL_WEIGHT = 0.15  # relative to 1 for a standing foot
LEAST_TRAVEL_SHARE = 0.3  # of even travel that remains while a leg is raised: no dancer walks with a leg in the air
SWAY_S = 0.5  # slower departures of a body from its route are travel, not sway
CORNER_S = 0.12  # before and after a corner of a route, in which a body turns it
FIRMNESS_EXPONENT = 4  # a limb's firmness to this power is its share of the support: mostly the firmer foot bears


def root_trajectory(
    skeleton: Skeleton,
    posed: Posed,
    clearance: Floats,
    stands: Floats,
    drift: Floats,
    ends: tuple[Floats, Floats],
    seconds: float,
    easily: Floats,
    route: Floats | None = None,
    course: Course | None = None,
) -> Floats:
    """Return positions [N, 3] of the root, metres, from a to b; `stand` sets their final heights.

    Between two frames, points near the floor should stay, and the root should move by `drift`. The displacements v
    minimise sum_p w_p |v + v_p|^2 + c |v - drift|^2 and add up to b - a. Here v_p is the motion of point p relative to
    the root, w_p = exp(-height / GRIP_HEIGHT_M) stands^FIRMNESS_EXPONENT its weight, and c = CORPUS_TRAVEL_WEIGHT.

    The solution is v = (c drift - sum_p w_p v_p + l) / (c + sum_p w_p), with one multiplier l for all frames. It adds
    the distance missing to b where the body stands least firmly. A long distance is added in proportion to `easily`
    instead, with a ramp at both ends. With a route, it is added along the route instead of straight to b; on a
    course, the body is where the course is.

    Args:
        skeleton: the body.
        posed: the movement about its root, of N frames.
        clearance: height of the lowest point above the floor [N], metres.
        stands: firmness of each limb, and last of the trunk, between frames [N - 1, limbs + 1], 0 to 1.
        drift: displacement of the corpus's bodies from each frame to the next [N - 1, 3], metres.
        ends: first and last position of the root, a and b [3], metres.
        seconds: total duration.
        easily: ease of stepping between frames [N - 1], LEAST_TRAVEL_SHARE to 1 (`steps_easily`).
        route: points x, z of a path over the floor from a to b [P, 2], metres; None for the straight line.
        course: where the body is at which time; None if that is free.
    """
    (a, b), points = ends, posed.places[:, : 2 * len(skeleton)]
    height = points[..., 1] - points[..., 1].min(axis=-1, keepdims=True) + clearance[:, None]
    firm = (stands**FIRMNESS_EXPONENT)[:, limb_of_points(skeleton)]
    grip = np.exp(-np.maximum(height[1:], height[:-1]) / GRIP_HEIGHT_M) * firm
    weight = CORPUS_TRAVEL_WEIGHT + grip.sum(axis=1)
    steps = (CORPUS_TRAVEL_WEIGHT * drift - np.einsum("np,npk->nk", grip, np.diff(points, axis=0))) / weight[:, None]
    slack = (1.0 / weight) / np.sum(1.0 / weight)
    missing = b - a - steps.sum(axis=0)
    fast = (np.linalg.norm(missing) if route is None else length_of(route)) / seconds
    evenly = fast**2 / (fast**2 + 0.3**2)  # half of the distance at 0.3 m/s
    since = np.linspace(0.0, seconds, len(steps) + 2)[1:-1]
    ramp = easily * np.minimum(np.minimum(since, since[::-1]) / 0.3, 1.0)  # starts and stops in 0.3 s
    slack = (1.0 - evenly) * slack + evenly * ramp / ramp.sum()
    steps += slack[:, None] * missing
    shares = np.minimum(np.concatenate([[0.0], np.cumsum(slack)]), 1.0)
    way = None if route is None else places_along(route, shares)
    if course is not None:
        way = course.at(np.linspace(0.0, seconds, len(shares)))
    if way is not None:
        steps[:, [0, 2]] = np.diff(_along(way, slack, steps[:, [0, 2]], len(steps) / seconds), axis=0)
    return np.asarray(a + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]))


def _along(way: Floats, slack: Floats, steps: Floats, fps: float) -> Floats:
    """Return the places [N, 2], metres, of a body that sways about its way over the floor.

    It rounds corners, because no body turns them at once.

    Args:
        way: places x, z on its path at each frame [N, 2], metres.
        slack: share of the path in each step [N - 1].
        steps: steps of the body on its straight way [N - 1, 2], metres; it sways as there.
        fps: frames a second.
    """
    sways = np.concatenate([np.zeros((1, 2)), np.cumsum(steps - slack[:, None] * steps.sum(axis=0), axis=0)])
    places = np.empty_like(sways)
    for axis, (path, sway) in enumerate(zip(way.T, sways.T, strict=True)):
        places[:, axis] = smoothed(path, CORNER_S, fps) + sway - smoothed(sway, SWAY_S, fps)
    return places


def steps_easily(heights: Floats, fps: float) -> Floats:
    """Return the ease of stepping between frames [N - 1], LEAST_TRAVEL_SHARE (one foot high up) to 1.

    Args:
        heights: heights of each foot's lowest point above any level [N, feet], metres.
        fps: frames a second.
    """
    if heights.shape[1] < 2:
        return np.ones(len(heights) - 1)
    first, second = np.sort(heights, axis=1)[:, :2].T
    low, high = 0.1, 0.25  # m from the lowest foot to the second: travel begins to shrink, and is least
    s = np.clip((second - first - low) / (high - low), 0.0, 1.0)
    easily = smoothed(1.0 - (1.0 - LEAST_TRAVEL_SHARE) * s * s * (3.0 - 2.0 * s), 0.5 * 0.2, fps)  # over 0.2 s
    return np.asarray(0.5 * (easily[1:] + easily[:-1]))


def stand(skeleton: Skeleton, rotations: Floats, root: Floats, clearance: Floats) -> Floats:
    """Lift or lower each posture to put its lowest point `clearance` above y = 0.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres.
        clearance: height of the lowest point [N], metres.

    Returns:
        Positions of the root [N, 3], metres.
    """
    lifted = root.copy()
    lifted[:, 1] += clearance - lowest_height(skeleton, rotations, root)
    return lifted
