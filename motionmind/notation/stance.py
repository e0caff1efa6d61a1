"""Legs on the floor: where the pelvis is, and the angles of legs that stand or touch, so that the weight is carried.

All is computed for many postures at once, in the frame that the body faces in: x to its left, z ahead, the floor at
y = 0. The right leg is computed as its mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy import SIDES, Anatomy, Leg
from motionmind.geometry import rotations as rot

ON_BALL = 24.0  # degrees that the heel is lifted from which on the ball alone carries
ROUNDS = 60  # of moving the pelvis until the weight is where it should be; each leaves about a fifth of the fault
CLOSE = 1e-7  # metres


@dataclass(frozen=True)
class Feet:
    """What the legs of T postures do on the floor; arrays [T, 2] for the left and the right one.

    Attributes:
        stands: which legs bear weight or are put down; touches: which rest on the floor.
        out, ahead: of the ball of the foot from the place under its own hip, metres.
        turn: where the foot points, outward; knee: where the knee does; heel: how far it is lifted; bend: the least
            bend of the knee; towards: where a leg that touches goes; radians.
        weight: the shares of the weight [T, 2].
        pivot: how far behind its ball a foot turns, metres.
        lean: how far the weight is off its place, to the left and ahead [T, 2], metres.
    """

    stands: Bools
    touches: Bools
    out: Floats
    ahead: Floats
    turn: Floats
    knee: Floats
    heel: Floats
    bend: Floats
    towards: Floats
    weight: Floats
    pivot: Floats
    lean: Floats


@dataclass(frozen=True)
class Stance:
    """Postures with their legs placed.

    Attributes:
        rotations: local [T, J, 4].
        root: position of the root [T, 3], metres; its height is the body's over the floor, where a leg stands.
        short: how much a leg is too short to reach the floor [T, 2], metres, or, of one that touches, how far its foot
            stays above it; 0 where neither.
        astray: how far the weight is off its place [T], metres: next to nothing, unless no place of the pelvis will do.
    """

    rotations: Floats
    root: Floats
    short: Floats
    astray: Floats


class _Bones:
    """The segments of the left leg of a body, metres."""

    def __init__(self, body: Anatomy, leg: Leg) -> None:
        skeleton = body.skeleton
        chains = [body.leg_joints(leg, side) for side in SIDES]
        self.indices = np.array(chains)
        _, knee, ankle, toes, *_ = chains[0]
        self.hips = skeleton.offsets[self.indices[:, 0]]
        self.knee, self.ankle, self.toes = skeleton.offsets[knee], skeleton.offsets[ankle], skeleton.offsets[toes]
        # From the ankle to the ball, from there to the next row of knuckles, if there is one, and so on to the tip.
        self.foot = [*skeleton.offsets[chains[0][3:]], skeleton.tips[chains[0][-1]]]
        self.heel = np.array(leg.heel)


def place(body: Anatomy, leg: Leg, rotations: Floats, feet: Feet) -> Stance:
    """Postures [T, J, 4] in the frame that the body faces in, their legs as `feet` says.

    The hips are as high as the legs that stand allow with their knees bent as little as they may be, and moved over the
    feet until the centre of mass is over them. Legs that touch are raised until they do.
    """
    bones, out = _Bones(body, leg), rotations.copy()
    pelvis = rotations[:, 0]
    hips = rot.mul_vec(pelvis[:, None], bones.hips)  # [T, 2, 3] from the root
    middle = hips.mean(axis=1)
    shift = np.zeros((len(rotations), 2))  # of the middle of the hips, to the left and ahead
    stands = feet.stands.any(axis=1)
    shares = np.where(feet.stands, feet.weight, 0.0)
    total = shares.sum(axis=1, keepdims=True)
    shares = np.where(total > 0.0, shares / np.where(total > 0.0, total, 1.0), 0.5 * feet.stands)
    # Between two straight legs a hair's breadth of the pelvis bends one knee or the other, by the root of that breadth:
    # where the fault changes sides without growing smaller, steps are halved.
    wrong, step = np.zeros_like(shift), np.ones_like(shift)
    for _ in range(ROUNDS):
        root, short = _stand(bones, out, pelvis, hips - middle[:, None], shift, feet)
        root = root - middle
        short += _touch(bones, out, rotations, root, hips, feet)
        before, wrong = wrong, body.centre_of_mass(out, root)[:, [0, 2]] - _support(bones, feet, shares)
        wrong = np.where((stands & (total[:, 0] > 0.0))[:, None], wrong - feet.lean, 0.0)
        step = np.where((wrong * before < 0.0) & (np.abs(wrong) > 0.5 * np.abs(before)), 0.5 * step, step)
        far = np.abs(wrong).max(axis=1) > CLOSE
        if not far.any():
            break
        # Who is there stays, so that no posture depends on the others.
        shift = shift - np.where(far[:, None], step * wrong, 0.0)
    return Stance(out, root, short, np.abs(wrong).max(axis=1))


def _ball(bones: _Bones, feet: Feet, side: int) -> Floats:
    """Where the ball of a foot is [T, 3], as of the left leg."""
    return np.stack([bones.hips[0, 0] + feet.out[:, side], np.zeros(len(feet.out)), feet.ahead[:, side]], axis=-1)


def _support(bones: _Bones, feet: Feet, shares: Floats) -> Floats:
    """The place [T, 2] on the floor, left and ahead, over which the centre of mass belongs.

    Halfway between ankle and ball of a flat foot, over the ball of one whose heel is lifted by `ON_BALL` or more.
    """
    out = np.zeros((len(shares), 2))
    for side, sign in enumerate((1.0, -1.0)):
        back = 0.5 * bones.toes[2] * (1.0 - np.clip(np.degrees(feet.heel[:, side]) / ON_BALL, 0.0, 1.0))
        ball, turn = _ball(bones, feet, side), feet.turn[:, side]
        place = np.stack([sign * (ball[:, 0] - back * np.sin(turn)), ball[:, 2] - back * np.cos(turn)], axis=-1)
        out += shares[:, side, None] * np.where(feet.stands[:, side, None], place, 0.0)
    return out


def _stand(
    bones: _Bones, out: Floats, pelvis: Floats, hips: Floats, shift: Floats, feet: Feet
) -> tuple[Floats, Floats]:
    """Place the legs that stand; the middle of the hips [T, 3], and by how much legs are too short [T, 2].

    `hips` [T, 2, 3] are seen from their middle.
    """
    height = np.full(len(out), np.inf)
    short = np.zeros((len(out), 2))
    ankles, soles = [], []
    for side, sign in enumerate((1.0, -1.0)):
        sole = rot.mul(rot.about_vertical(feet.turn[:, side]), rot.from_axis_angle([1.0, 0.0, 0.0], feet.heel[:, side]))
        ankle = _ball(bones, feet, side) - rot.mul_vec(sole, bones.toes)
        knee = rot.from_axis_angle([1.0, 0.0, 0.0], feet.bend[:, side])
        reach = np.linalg.norm(bones.knee + rot.mul_vec(knee, bones.ankle), axis=-1)
        hip = np.array([sign, 1.0, 1.0]) * hips[:, side]
        hip[:, 0] += sign * shift[:, 0]
        hip[:, 2] += shift[:, 1]
        far = np.hypot(ankle[:, 0] - hip[:, 0], ankle[:, 2] - hip[:, 2])
        stands = feet.stands[:, side]
        short[:, side] = np.where(stands, np.maximum(far - reach + 1e-9, 0.0), 0.0)
        top = ankle[:, 1] + np.sqrt(np.maximum(reach**2 - far**2, 1e-6)) - hip[:, 1]
        height = np.where(stands, np.minimum(height, top), height)
        ankles.append(ankle)
        soles.append(sole)
    height = np.where(np.isfinite(height), height, 0.0)
    for side, sign in enumerate((1.0, -1.0)):
        hip = np.array([sign, 1.0, 1.0]) * hips[:, side]
        hip += np.stack([sign * shift[:, 0], height, shift[:, 1]], axis=-1)
        thigh, knee = _reach(bones, ankles[side] - hip, feet.knee[:, side])
        seen = pelvis if side == 0 else rot.mirror(pelvis)
        joints = np.stack(
            [
                rot.inv_mul(seen, thigh),
                knee,
                rot.inv_mul(rot.mul(thigh, knee), soles[side]),
                rot.from_axis_angle([1.0, 0.0, 0.0], -feet.heel[:, side]),
            ],
            axis=1,
        )
        joints = joints if side == 0 else rot.mirror(joints)
        leg = bones.indices[side, : joints.shape[1]]
        out[:, leg] = np.where(feet.stands[:, side, None, None], joints, out[:, leg])
    return np.stack([shift[:, 0], height, shift[:, 1]], axis=-1), short


def _reach(bones: _Bones, target: Floats, towards: Floats) -> tuple[Floats, Floats]:
    """Rotations of hip and knee [T, 4] that bring the ankle to `target` [T, 3], seen from the hip.

    The knee points `towards` [T] radians outward: the thigh, the shank and that direction are in one plane. By the law
    of cosines; the ankle may lie off the shank's own axis.
    """
    thigh, shank = -bones.knee[1], float(np.hypot(bones.ankle[1], bones.ankle[2]))
    slant = np.arctan2(bones.ankle[2], -bones.ankle[1])
    far = np.linalg.norm(target, axis=-1)
    cosine = (far**2 - thigh**2 - shank**2) / (2.0 * thigh * shank)
    bend = np.arccos(np.clip(cosine, -1.0, 1.0)) + slant
    knee = rot.from_axis_angle([1.0, 0.0, 0.0], bend)
    end = bones.knee + rot.mul_vec(knee, bones.ankle)
    down = target / np.maximum(far, 1e-9)[:, None]
    forward = np.stack([np.sin(towards), np.zeros(len(towards)), np.cos(towards)], axis=-1)
    across = np.cross(forward, down)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-9)
    line = rot.from_matrix(np.stack([across, -down, np.cross(down, across)], axis=-1))
    return rot.mul(line, rot.from_axis_angle([1.0, 0.0, 0.0], np.arctan2(end[:, 2], -end[:, 1]))), knee


def _touch(bones: _Bones, out: Floats, given: Floats, root: Floats, hips: Floats, feet: Feet) -> Floats:
    """Raise the legs that touch until their feet's lowest point is on the floor, by bisection of the angle raised.

    How far above the floor the feet of legs that hang straight down are already [T, 2], metres.
    """
    above = np.zeros(feet.touches.shape)
    for side in (0, 1):
        rows = np.flatnonzero(feet.touches[:, side])
        if len(rows) == 0:
            continue
        joints, pelvis = given[np.ix_(rows, bones.indices[side])], given[rows, 0]
        if side == 1:
            joints, pelvis = rot.mirror(joints), rot.mirror(pelvis)
        twist = rot.about_vertical(rot.heading(joints[:, 0]))
        floor = -(root[rows, 1] + hips[rows, side, 1])
        axis = np.stack([-np.cos(feet.towards[rows, side]), np.zeros(len(rows)), np.sin(feet.towards[rows, side])], -1)
        low, high = np.zeros(len(rows)), np.full(len(rows), np.radians(120.0))
        above[rows, side] = np.maximum(_lowest(bones, twist, joints) - floor, 0.0)
        for _ in range(48):
            middle = 0.5 * (low + high)
            over = _lowest(bones, rot.mul(rot.from_axis_angle(axis, middle), twist), joints) > floor
            low, high = np.where(over, low, middle), np.where(over, middle, high)
        joints[:, 0] = rot.inv_mul(pelvis, rot.mul(rot.from_axis_angle(axis, high), twist))
        out[np.ix_(rows, bones.indices[side])] = joints if side == 0 else rot.mirror(joints)
    return above


def _lowest(bones: _Bones, thigh: Floats, joints: Floats) -> Floats:
    """Height [T] over the hip of the lowest point of a foot whose leg hangs at `thigh`."""
    turned = rot.mul(thigh, joints[:, 1])
    place = rot.mul_vec(thigh, bones.knee) + rot.mul_vec(turned, bones.ankle)
    lowest = place[:, 1] + rot.mul_vec(rot.mul(turned, joints[:, 2]), bones.heel)[:, 1]
    for joint, step in enumerate(bones.foot, start=2):
        turned = rot.mul(turned, joints[:, joint])
        place = place + rot.mul_vec(turned, step)
        lowest = np.minimum(lowest, place[:, 1])
    return lowest
