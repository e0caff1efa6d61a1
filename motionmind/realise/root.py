"""Where the body goes: carried by its feet where they stand, as the corpus's bodies travel where none does."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES
from motionmind.body.limbs import limb_of_points, limbs_of
from motionmind.body.limits import anatomy_of
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot

GRIP = 0.015  # metres above the floor at which a foot's hold on it has fallen to 1/e
SLIP = 0.15  # what the corpus's own travel weighs beside a foot that stands
BEARS = 4  # power of how much limbs stand by which they bear the body: of two feet the one that stands the surer


def root_trajectory(
    skeleton: Skeleton, rotations: Floats, clearance: Floats, stands: Floats, drift: Floats, a: Floats, b: Floats
) -> Floats:
    """Positions [N, 3] of the root from `a` [3] to `b` [3], level; heights are as `stand` makes them.

    From each frame to the next the points of the body that stand near the floor are to stay, and the root is to go by
    `drift`: the displacements v minimise sum_p w_p |v + v_p|^2 + SLIP |v - drift|^2, with v_p how point p moves seen
    from the root and w_p = exp(-height / GRIP) stands^BEARS of its limb, under the condition that they add up to b - a.
    So v = (SLIP drift - sum_p w_p v_p + l) / (SLIP + sum_p w_p), with one l for all: what is missing to `b` is made up
    where the body stands least.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        clearance: height of the lowest point above the floor [N], metres.
        stands: how much each limb, and last the trunk, stands from each frame to the next [N - 1, limbs + 1], 0 to 1.
        drift: how far the corpus's bodies would travel from each frame to the next [N - 1, 3].
        a: first position of the root.
        b: last position.
    """
    points = skeleton.positions_and_tips(rotations, np.zeros((len(rotations), 3)))
    height = points[..., 1] - points[..., 1].min(axis=-1, keepdims=True) + clearance[:, None]
    hold = np.exp(-np.maximum(height[1:], height[:-1]) / GRIP) * stands[:, limb_of_points(skeleton)] ** BEARS
    weight = SLIP + hold.sum(axis=1)
    steps = (SLIP * drift - np.einsum("np,npk->nk", hold, np.diff(points, axis=0))) / weight[:, None]
    slack = (1.0 / weight) / np.sum(1.0 / weight)
    steps += slack[:, None] * (b - a - steps.sum(axis=0))
    return np.asarray(a + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]))


def stand(skeleton: Skeleton, rotations: Floats, root: Floats, clearance: Floats) -> Floats:
    """Root positions [N, 3] that put each posture's lowest point `clearance` [N] metres above y = 0."""
    lifted = root.copy()
    lifted[:, 1] += clearance - lowest(skeleton, rotations, root)
    return lifted


def lowest(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats:
    """Heights [...] of the lowest joint, tip or heel of postures with local rotations [..., J, 4] and root [..., 3]."""
    return np.asarray(lows(skeleton, rotations, root).min(axis=-1))


def lows(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats:
    """The same for each limb, and last for the trunk [..., limbs + 1]; infinite where all joints are of limbs.

    Heels are known of bodies with an anatomy, whose proportions they are given in.
    """
    heights, limb = skeleton.positions_and_tips(rotations, root)[..., 1], limb_of_points(skeleton)
    anatomy = anatomy_of(skeleton)
    if anatomy is not None and anatomy.leg is not None:
        heel = np.array(anatomy.leg.heel) * skeleton.height / anatomy.skeleton.height
        ankles = [anatomy.named(anatomy.leg.ankle, side) for side in SIDES]
        turned = skeleton.global_rotations(rotations)[..., ankles, :]
        heels = np.stack([heel, heel * np.array([-1.0, 1.0, 1.0])])
        heights = np.concatenate([heights, heights[..., ankles] + rot.mul_vec(turned, heels)[..., 1]], axis=-1)
        limb = np.concatenate([limb, limb[ankles]])
    count = len(limbs_of(skeleton)) + 1
    out = np.full((*heights.shape[:-1], count), np.inf)
    for number in range(count):
        out[..., number] = heights[..., limb == number].min(axis=-1, initial=np.inf)
    return out
