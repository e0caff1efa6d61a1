"""Relations of two dancers: where the follower is, how it faces, and which hands they hold, seen by the leader."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices, Int32s
from motionmind.body.motion import Motion
from motionmind.geometry import rotations as rot

HANDS = ("left_fingers", "right_fingers")
HELD_M = 0.15  # distance of the knuckles of two hands up to which they are held
STILL_MPS = 0.2  # leader's level speed up to which it stands
TURNING_RAD_S = 0.5  # leader's speed about the vertical from which it turns
N_LEADER_STATES = 5 * 3 * 3 * 3


class Relations(NamedTuple):
    """Relations at N times, in the leader's frame: x to its left, z to its front.

    Attributes:
        places: x and z of the follower's root from the leader's [N, 2], metres.
        facings: by how much the follower is turned to the left of the leader [N], radians.
        hands: displacement from a leader's hand to a follower's [N, 4, 3], metres, for left and left, left and right,
            right and left, right and right; [N, 0, 3] for bodies without hands.
    """

    places: Floats
    facings: Floats
    hands: Floats

    @property
    def distances(self) -> Floats:
        """Level distances of the roots [N], metres."""
        return rot.norm(self.places)

    @property
    def held(self) -> Bools:
        """Which pairs of hands are held [N, pairs]."""
        return rot.norm(self.hands) <= HELD_M

    def part(self, frames: Indices | slice) -> Relations:
        """Return the relations at some of the times."""
        return Relations(self.places[frames], self.facings[frames], self.hands[frames])

    @classmethod
    def joined(cls, parts: Sequence[Relations]) -> Relations:
        """Return relations one after another."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))


def relate(leader: Motion, follower: Motion) -> Relations:
    """Return the relations of two dancers in their frames.

    Args:
        leader: movement of the leader, of N frames.
        follower: movement of the follower at the same times, on the same joints.
    """
    away, places = inverse_heading(leader), [one.positions() for one in (leader, follower)]
    roots = rot.mul_vec(away, follower.root - leader.root)
    facings = rot.heading(follower.rotations[:, 0]) - rot.heading(leader.rotations[:, 0])
    names = leader.skeleton.names
    own = [names.index(hand) for hand in HANDS] if set(HANDS) <= set(names) else []
    apart = places[1][:, None, own] - places[0][:, own, None]
    hands = rot.mul_vec(away[:, None], apart.reshape(len(leader), len(own) ** 2, 3))
    return Relations(roots[:, [0, 2]], np.angle(np.exp(1j * facings)), hands)


def inverse_heading(motion: Motion) -> Floats:
    """Return the rotations [N, 4] from the world into the frame of a dancer."""
    return rot.about_vertical(-rot.heading(motion.rotations[:, 0]))


def leader_states(leader: Motion) -> Int32s:
    """Return the state of a leader in each frame [N]: how it travels and turns, and how high its hands are.

    It stands, or goes to the front, the left, the back or the right; turns to neither side, left or right; and has each
    hand below the hips, up to the shoulders or above them.
    """
    seconds = np.maximum(np.gradient(leader.times), 1e-9) if len(leader) > 1 else np.ones(1)
    velocity, turning = np.zeros((len(leader), 3)), np.zeros(len(leader))
    if len(leader) > 1:
        velocity = np.gradient(leader.root, axis=0) / seconds[:, None]
        turning = np.gradient(np.unwrap(rot.heading(leader.rotations[:, 0]))) / seconds
    x, _, z = rot.mul_vec(inverse_heading(leader), velocity).T
    quarter = np.round(np.arctan2(x, z) / (0.5 * np.pi)).astype(np.int64) % 4
    travel = np.where(np.hypot(x, z) > STILL_MPS, 1 + quarter, 0)
    turn = np.where(np.abs(turning) < TURNING_RAD_S, 0, np.where(turning > 0.0, 1, 2))
    state, names, heights = 3 * travel + turn, leader.skeleton.names, leader.positions()[..., 1]
    for hand in HANDS:
        height = np.zeros(len(leader), dtype=np.int64)
        if hand in names:
            shoulder = heights[:, names.index(hand.replace("fingers", "shoulder"))]
            level = heights[:, names.index(hand)]
            height = (level > heights[:, 0]).astype(np.int64) + (level > shoulder)
        state = 3 * state + height
    return np.asarray(state, dtype=np.int32)
