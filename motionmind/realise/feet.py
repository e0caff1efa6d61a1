"""Feet: the tracks that they go along relative to the root, and legs that bring them to where they should be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.realise.footfalls import Stance
from motionmind.realise.legs import find_legs, reach

GRIP = 0.015  # metres above the lower end of a foot at which the other's hold on the floor has fallen to 1/e
SETTLES = 0.3  # seconds in which a foot that hovers where it is given comes down to the floor
BENDS = 0.25  # seconds in which a departure of a swinging foot from the movement's own track begins and ends
LIFT = 0.08  # metres to which a step lifts a foot that the movement does not lift
KNEE = 8.0  # radians a second at which knees bend at most in a step, which is lifted less if it is quick
FAR = 0.15  # metres from its own track to which a foot must go to be lifted so far


class Foot(NamedTuple):
    """A leg that can be placed: its number among the limbs, its joints, and the place among them of its knee.

    The part of it that stands is everything beyond the shank.
    """

    limb: int
    leg: list[int]
    knee: int

    @property
    def joints(self) -> list[int]:
        """The joints of the foot itself; none if the leg ends in the shank's own tip."""
        return self.leg[self.knee + 1 :]


def find_free_feet(skeleton: Skeleton, fixed: Bools) -> list[Foot]:
    """Return the feet of a body's legs, but for those with joints that must not change."""
    numbers, legs = find_legs(skeleton)
    return [
        Foot(number, leg, knee) for number, (leg, knee) in zip(numbers, legs, strict=True) if not fixed[leg].any()
    ]


def foot_points(foot: Foot, joints: Indices, count: int) -> Bools:
    """Return which of a body's points are a foot's [P]: its joints, tips and heel; of a leg without a foot, its tip.

    Args:
        foot: the foot.
        joints: the joint that each point belongs to [P] (`contact_points`).
        count: number of joints; after them come the joints' tips.
    """
    out = np.isin(joints, foot.joints)
    if not foot.joints:
        out[count + foot.leg[-1]] = True
    return out


def track_of(foot: Foot, places: Floats) -> Floats:
    """Return where a foot is, level, relative to the root [N, 2], metres, so that one that stands or rolls stays.

    It moves as its last bone does, both ends of it by how low they are.

    Args:
        foot: the foot.
        places: of all joints, then all tips, relative to the root [N, 2 J, 3], metres.
    """
    count = places.shape[1] // 2
    ends = places[:, [foot.leg[-1], count + foot.leg[-1]]]
    height = np.maximum(ends[1:, :, 1], ends[:-1, :, 1])
    share = np.exp(-(height - height.min(axis=1, keepdims=True)) / GRIP)
    share /= share.sum(axis=1, keepdims=True)
    moved = np.einsum("np,npk->nk", share, np.diff(ends[..., [0, 2]], axis=0))
    return np.asarray(ends[0, :, [0, 2]].mean(axis=1) + np.concatenate([np.zeros((1, 2)), np.cumsum(moved, axis=0)]))


def departure(
    track: Floats, height: Floats, stances: list[Stance], leg: float, fps: float, moving: tuple[bool, bool], lifts: bool
) -> Floats:
    """Return a foot's displacement from the movement's own track [N, 3], metres: 0 in the first and the last frame.

    Where the foot stands it is what keeps it in its place, on the floor; between two places it is as smooth as can be,
    and tends to 0. A foot that swings is kept above the floor, and lifted as far as it is taken elsewhere.

    Args:
        track: of the foot in the world [N, 2], metres, level.
        height: of its lowest point above the floor [N], metres.
        stances: when and where it stands.
        leg: length of the leg, metres.
        fps: frames a second.
        moving: whether the foot's velocity is given in the first and in the last frame.
        lifts: whether to lift it.
    """
    count = len(track)
    wanted, stands = np.zeros((count, 3)), np.zeros(count)
    bump = np.zeros(count)
    last = 0
    for stance in stances:
        here = slice(stance.start, stance.end + 1)
        share = np.linspace(0.0, 1.0, stance.end + 1 - stance.start)[:, None]
        wanted[here][:, [0, 2]] = stance.place + share * stance.slip - track[here]
        wanted[here, 1] = _settled(height, stance, fps) - height[here]
        stands[here] = 1.0
        if last < stance.start:
            swing = np.arange(last, stance.start + 1)
            s = (swing - swing[0]) / max(len(swing) - 1, 1)
            bend = 0.5 * KNEE * (len(swing) - 1) / (np.pi * fps)
            bump[swing] = np.sin(np.pi * s) ** 4 * min((1.0 - np.cos(bend)) * leg / LIFT, 1.0)
        last = stance.end
    for end, moves in ((0, moving[0]), (-1, moving[1])):
        if moves:  # it comes to rest within a while
            frames = np.arange(count) if end == 0 else np.arange(count)[::-1]
            stands *= np.minimum(frames / (BENDS * fps), 1.0)
    out = _bend(wanted, stands, fps)
    off = np.hypot(out[:, 0], out[:, 2])
    low = height + out[:, 1]
    free = stands == 0.0
    change = np.minimum(_greatest_change(off, free) / FAR, 1.0)
    floor = LIFT * bump * change * lifts
    soft = 0.01 * bump + 1e-4
    over = (low - floor) / soft
    lifted = floor + soft * np.where(over > 30.0, over, np.log1p(np.exp(np.minimum(over, 30.0))))
    out[free, 1] += (lifted - low)[free]
    out[[0, -1]] = 0.0
    return out


def _greatest_change(off: Floats, free: Bools) -> Floats:
    """Return, for the frames of each swing, how much its departure from its track changes [N], metres."""
    out = np.zeros(len(off))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], free.view(np.int8), [0]])))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        around = off[max(start - 1, 0) : end + 1]
        out[start:end] = around.max()
    return out


def _settled(height: Floats, stance: Stance, fps: float) -> Floats:
    """Return how high a foot stands above the floor during a stance: 0, but as it is given at an end nearby."""
    frames = np.arange(stance.start, stance.end + 1)
    out = np.zeros(len(frames))
    for end, at in ((0, stance.start == 0), (len(height) - 1, stance.end == len(height) - 1)):
        if at:
            s = np.clip(1.0 - np.abs(frames - end) / (SETTLES * fps), 0.0, 1.0)
            out += height[end] * s * s * (3.0 - 2.0 * s)
    return out


def _bend(wanted: Floats, stands: Floats, fps: float) -> Floats:
    """Return departures [N, 3] that are as wanted [N, 3] where a foot stands [N], smooth, and elsewhere near 0."""
    from scipy.linalg import solveh_banded

    count = len(wanted)
    firm = 1e4 * stands**2
    bend = (BENDS * fps) ** 4
    diagonals = np.zeros((3, count))
    pattern = np.array([1.0, -2.0, 1.0])
    pull = firm + (1.0 - stands)
    diagonals[0] += pull
    for k, value in enumerate(pattern):
        diagonals[0, k : count - 2 + k] += bend * value * value
    diagonals[1, : count - 1] += bend * np.concatenate([[-2.0], np.full(count - 3, -4.0), [-2.0]])
    diagonals[2, : count - 2] += bend
    diagonals[0, [1, -2]] += bend  # it departs smoothly
    diagonals[0, [0, -1]] += 1e12
    right = firm[:, None] * wanted
    right[[0, -1]] = 0.0
    return np.asarray(solveh_banded(diagonals, right, lower=True))


def bend_legs(skeleton: Skeleton, rotations: Floats, root: Floats, feet: list[Foot], off: Floats) -> Floats:
    """Return rotations [N, J, 4] whose legs bring the feet to their places; feet keep their orientations.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres.
        feet: those to place.
        off: how far each is from where the rotations have it [N, feet, 3], metres.
    """
    turned, places = skeleton.global_rotations(rotations), skeleton.positions_and_tips(rotations, root)
    out = rotations.copy()
    for number, foot in enumerate(feet):
        chain = [*foot.leg, foot.leg[-1] + len(skeleton)][foot.knee - 1 : foot.knee + 2]
        hip, knee, end = chain
        thigh, shank = reach(turned[:, hip], places[:, chain], places[:, end] + off[:, number])
        thigh, shank = rot.mul(thigh, turned[:, hip]), rot.mul(shank, turned[:, knee])
        out[:, hip] = rot.inv_mul(turned[:, skeleton.parents[hip]], thigh)
        out[:, knee] = rot.inv_mul(thigh, shank)
        if end < len(skeleton):
            out[:, end] = rot.inv_mul(shank, turned[:, end])
    return out
