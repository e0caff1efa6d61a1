"""Feet: the legs that have one, the points of each, and its track relative to the root."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.legs import find_hinge, find_legs
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.jit import jit

GRIP_HEIGHT_M = 0.015  # above the floor, or a foot's lowest point, at which a point's grip has fallen to 1/e


class Foot(NamedTuple):
    """A leg with a foot, which is everything beyond the shank.

    Attributes:
        limb: number of the limb.
        leg: joints of the leg, outward.
        knee: index of the knee among them.
        hinge: axis of the knee in the frame of the joint above [3]; None if unknown.
    """

    limb: int
    leg: list[int]
    knee: int
    hinge: Floats | None

    @property
    def joints(self) -> list[int]:
        """The joints of the foot itself; none if the leg ends in the tip of the shank."""
        return self.leg[self.knee + 1 :]


def find_free_feet(skeleton: Skeleton, fixed: Bools) -> list[Foot]:
    """Return the feet of a body, except those of legs with `fixed` joints."""
    return [foot for foot in _find_feet(skeleton) if not fixed[foot.leg].any()]


@remembered
def _find_feet(skeleton: Skeleton) -> list[Foot]:
    """Return the feet of a body."""
    numbers, legs = find_legs(skeleton)
    return [
        Foot(number, leg, knee, find_hinge(skeleton, leg[knee]))
        for number, (leg, knee) in zip(numbers, legs, strict=True)
    ]


def foot_points(foot: Foot, joints: Indices, count: int) -> Bools:
    """Return whether each point belongs to a foot [P]: joints, tips and heel, or the tip of a leg without a foot.

    Args:
        foot: the foot.
        joints: joint of each point [P] (`contact_points`).
        count: number of joints; their tips follow them.
    """
    out = np.zeros(len(joints), dtype=np.bool_)
    for joint in foot.joints:
        out |= joints == joint
    if not foot.joints:
        out[count + foot.leg[-1]] = True
    return out


def track_of(foot: Foot, places: Floats, count: int) -> Floats:
    """Return the level track of a foot relative to the root [N, 2], metres: constant while the foot stands or rolls.

    The track moves with the two ends of the last bone, weighted by how low they are.

    Args:
        foot: the foot.
        places: positions of all joints, then all tips, then other points, relative to the root [N, P, 3], metres.
        count: number of joints.
    """
    ends = places[:, [foot.leg[-1], count + foot.leg[-1]]]
    height, level = ends[..., 1], ends[..., [0, 2]]
    grips = _grip(np.maximum(height[1:], height[:-1]))
    # A foot that rolls to and fro returns to its place only roughly, so the total displacement is that of the end that
    # is low in the first and in the last frame.
    both, out = _grip(height[0] + height[-1]), np.empty((len(places), 2))
    _write_track(np.ascontiguousarray(ends), grips, both @ level[0], both @ (level[-1] - level[0]), out)
    return out


@jit
def _write_track(ends: Floats, grips: Floats, first: Floats, whole: Floats, out: Floats) -> None:
    """Write the level track of a foot [N, 2], metres.

    Args:
        ends: positions of both ends of its last bone [N, 2, 3], metres.
        grips: grip of each end between frames [N - 1, 2].
        first: start of the track [2].
        whole: its displacement over all frames [2].
        out: the track.
    """
    last = len(ends) - 1
    out[0] = 0.0
    for t in range(last):
        for k in range(2):
            moved = grips[t, 0] * (ends[t + 1, 0, 2 * k] - ends[t, 0, 2 * k])
            out[t + 1, k] = out[t, k] + (moved + grips[t, 1] * (ends[t + 1, 1, 2 * k] - ends[t, 1, 2 * k]))
    for k in range(2):
        drift = whole[k] - out[last, k]
        for t in range(last + 1):
            out[t, k] = first[k] + (out[t, k] + (1.0 if t == last else t * (1.0 / last)) * drift)


def _grip(height: Floats) -> Floats:
    """Return the grip of the two ends of a foot [..., 2] from their heights [..., 2], metres; the grips add up to 1."""
    share = np.exp(-(height - height.min(axis=-1, keepdims=True)) / GRIP_HEIGHT_M)
    return np.asarray(share / share.sum(axis=-1, keepdims=True))
