"""Trajectory of the root: feet in stance carry the body; without one it travels as in the corpus."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.contact import Posed, lowest_height
from motionmind.body.limbs import limb_of_points
from motionmind.body.skeleton import Skeleton
from motionmind.footing.smoothing import smoothed

FLOOR_GRIP_M = 0.015  # metres above the floor at which a foot's hold on it has fallen to 1/e
CORPUS_TRAVEL_WEIGHT = 0.15  # weight of the corpus's travel, relative to 1 for a standing foot
HALF_SPREAD_MPS = 0.3  # m/s of missing travel at which half of it is spread evenly over time
TRAVEL_STARTS_S = 0.3  # seconds in which even travel starts and stops
RAISED_FOOT_M = 0.1, 0.25  # metres from the lowest foot to the second: even travel begins to shrink, and is least
LEAST_TRAVEL_SHARE = 0.3  # share of even travel that remains: no dancer walks with a leg in the air
TRAVEL_SHRINKS_S = 0.2  # seconds over which travel shrinks and grows again
FOOT_FIRMNESS_EXPONENT = 4  # exponent of a limb's firmness: of two feet, mostly the firmer one bears the body


def root_trajectory(
    skeleton: Skeleton,
    posed: Posed,
    clearance: Floats,
    stands: Floats,
    drift: Floats,
    a: Floats,
    b: Floats,
    seconds: float,
    easily: Floats,
) -> Floats:
    """Return positions [N, 3] of the root, metres, from `a` to `b`; `stand` sets their final heights.

    From each frame to the next, points of the body that stand near the floor should stay, and the root should move by
    `drift`: the displacements v minimise sum_p w_p |v + v_p|^2 + SLIP |v - drift|^2, with v_p the motion of point p
    relative to the root and w_p = exp(-height / GRIP) stands^BEARS of its limb, under the condition that they add up to
    b - a. So v = (SLIP drift - sum_p w_p v_p + l) / (SLIP + sum_p w_p), with one multiplier l for all: the distance
    missing to `b` is added where the body stands least firmly; a long one in proportion to `easily`, with a ramp at
    both ends.

    Args:
        skeleton: the body.
        posed: the movement about its root, of N frames.
        clearance: height of the lowest point above the floor [N], metres.
        stands: firmness of each limb, and last of the trunk, between frames [N - 1, limbs + 1], 0 to 1.
        drift: displacement of the corpus's bodies from each frame to the next [N - 1, 3], metres.
        a: first position of the root [3], metres.
        b: last position of the root [3], metres.
        seconds: total duration.
        easily: ease of stepping between frames [N - 1], LEAST to 1 (`steps_easily`).
    """
    points = posed.places[:, : 2 * len(skeleton)]
    height = points[..., 1] - points[..., 1].min(axis=-1, keepdims=True) + clearance[:, None]
    firm = (stands**FOOT_FIRMNESS_EXPONENT)[:, limb_of_points(skeleton)]
    hold = np.exp(-np.maximum(height[1:], height[:-1]) / FLOOR_GRIP_M) * firm
    weight = CORPUS_TRAVEL_WEIGHT + hold.sum(axis=1)
    steps = (CORPUS_TRAVEL_WEIGHT * drift - np.einsum("np,npk->nk", hold, np.diff(points, axis=0))) / weight[:, None]
    slack = (1.0 / weight) / np.sum(1.0 / weight)
    missing = b - a - steps.sum(axis=0)
    fast = np.linalg.norm(missing) / seconds
    evenly = fast**2 / (fast**2 + HALF_SPREAD_MPS**2)
    since = np.linspace(0.0, seconds, len(steps) + 2)[1:-1]
    ramp = easily * np.minimum(np.minimum(since, since[::-1]) / TRAVEL_STARTS_S, 1.0)
    slack = (1.0 - evenly) * slack + evenly * ramp / ramp.sum()
    steps += slack[:, None] * missing
    return np.asarray(a + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]))


def steps_easily(heights: Floats, fps: float) -> Floats:
    """Return the ease of stepping between frames [N - 1], LEAST to 1; with one foot high up, a body would hop.

    Args:
        heights: heights of each foot's lowest point above any level [N, feet], metres.
        fps: frames a second.
    """
    if heights.shape[1] < 2:
        return np.ones(len(heights) - 1)
    first, second = np.sort(heights, axis=1)[:, :2].T
    low, high = RAISED_FOOT_M
    s = np.clip((second - first - low) / (high - low), 0.0, 1.0)
    easily = smoothed(1.0 - (1.0 - LEAST_TRAVEL_SHARE) * s * s * (3.0 - 2.0 * s), 0.5 * TRAVEL_SHRINKS_S, fps)
    return np.asarray(0.5 * (easily[1:] + easily[:-1]))


def stand(skeleton: Skeleton, rotations: Floats, root: Floats, clearance: Floats) -> Floats:
    """Lift or lower each posture so that its lowest point is `clearance` above y = 0.

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
