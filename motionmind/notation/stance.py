"""Place legs on the floor: find the pelvis and the angles of standing and touching legs, with the weight over the feet.

All postures are computed at once, in the frame that the body faces in: x to its left, z ahead, the floor at y = 0. The
right leg is computed as its mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy import SIDES, Anatomy, Leg
from motionmind.geometry import rotations as rot

ON_BALL_DEG = 24.0  # from this lift of the heel on, the ball alone bears the weight
MAX_RAISE_RAD = np.radians(120.0)  # of a touching leg


@dataclass(frozen=True)
class Feet:
    """The legs of T postures on the floor; arrays [T, 2] for the left and the right leg.

    Attributes:
        stands: whether a leg stands, with or without weight.
        touches: whether it rests on the floor without standing.
        planted: whether it bears weight in the posture that its angles give; such legs are not placed.
        out, ahead: place of the ball of the foot relative to the point under its own hip, metres.
        turn: direction of the foot, outward, radians.
        knee: direction of the knee, outward, radians.
        heel: angle by which the heel is lifted, radians.
        bend: the least bend of the knee, radians.
        towards: direction in which a touching leg reaches, radians.
        weight: shares of the weight [T, 2].
        pivot: distance behind its ball of the point about which a foot turns, metres.
        lean: displacement of the weight from its place, to the left and ahead [T, 2], metres.
    """

    stands: Bools
    touches: Bools
    planted: Bools
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
        root: places of the root [T, 3], metres; its height is above the floor if a leg stands.
        shortfall: length by which a standing leg is too short, or height at which a touching foot stays above the
            floor [T, 2], metres; 0 for neither.
        imbalance: distance of the weight from its place [T], metres; almost 0, unless no place of the pelvis balances.
    """

    rotations: Floats
    root: Floats
    shortfall: Floats
    imbalance: Floats


class _Bones:
    """The left leg's segments, in metres, and both legs' joints."""

    def __init__(self, body: Anatomy, leg: Leg) -> None:
        skeleton = body.skeleton
        chains = [body.leg_joints(leg, side) for side in SIDES]
        self.indices = np.array(chains)
        _, knee, ankle, toes, *_ = chains[0]
        self.hips = skeleton.offsets[self.indices[:, 0]]
        self.knee, self.ankle, self.toes = skeleton.offsets[knee], skeleton.offsets[ankle], skeleton.offsets[toes]
        # From the ankle to the ball, then to each further row of knuckles, and to the tip.
        self.foot = [*skeleton.offsets[chains[0][3:]], skeleton.tips[chains[0][-1]]]
        self.heel = np.array(leg.heel)


class _Leg:
    """Constants of one side's legs in T postures, while the pelvis moves; mirrored for the right side.

    Attributes:
        ankle: places of the ankles of legs that stand [T, 3], metres.
        sole: rotations of their feet [T, 4].
        lifted: rotations of their toes [T, 4].
        reach: lengths from hip to ankle with the knee at its least bend [T], metres.
        rows: postures in which the leg touches [R].
        joints: local rotations of touching legs [R, ..., 4], the thigh's as it is turned about its own length.
        axis: level axes about which they are raised [R, 3].
        up, ahead: places of their feet's points while they hang down [R, P]: heights above the hip, and distances from
            it in the direction that they reach in, metres.
    """

    def __init__(self, bones: _Bones, given: Floats, feet: Feet, side: int) -> None:
        across = [1.0, 0.0, 0.0]
        self.sole = rot.mul(rot.about_vertical(feet.turn[:, side]), rot.from_axis_angle(across, feet.heel[:, side]))
        self.lifted = rot.from_axis_angle(across, -feet.heel[:, side])
        self.ankle = _ball(bones, feet, side) - rot.mul_vec(self.sole, bones.toes)
        knee = rot.from_axis_angle(across, feet.bend[:, side])
        self.reach = np.linalg.norm(bones.knee + rot.mul_vec(knee, bones.ankle), axis=-1)
        self.rows = np.flatnonzero(feet.touches[:, side])
        joints, self.pelvis = given[np.ix_(self.rows, bones.indices[side])], given[self.rows, 0]
        if side == 1:
            joints, self.pelvis = rot.mirror(joints), rot.mirror(self.pelvis)
        joints[:, 0] = rot.about_vertical(rot.heading(joints[:, 0]))
        self.joints = joints
        sine, cosine = np.sin(feet.towards[self.rows, side]), np.cos(feet.towards[self.rows, side])
        self.axis = np.stack([-cosine, np.zeros(len(self.rows)), sine], axis=-1)
        points = _foot_points(bones, joints)
        self.up, self.ahead = points[..., 1], sine[:, None] * points[..., 0] + cosine[:, None] * points[..., 2]


def place_legs(body: Anatomy, leg: Leg, rotations: Floats, feet: Feet) -> Stance:
    """Place the legs of postures as `feet` prescribes.

    The hips are as high as the standing legs allow with their knees at the least bend, and are moved horizontally until
    the centre of mass is over the feet. Touching legs are raised until their feet are on the floor.

    Args:
        body: the anatomy.
        leg: the names of its legs' joints.
        rotations: local rotations [T, J, 4] in the frame that the body faces in.
        feet: the legs on the floor.

    Returns:
        The postures with their legs placed.
    """
    bones, out = _Bones(body, leg), rotations.copy()
    legs = [_Leg(bones, rotations, feet, side) for side in (0, 1)]
    pelvis = rotations[:, 0]
    hips = rot.mul_vec(pelvis[:, None], bones.hips)  # [T, 2, 3] from the root
    middle = hips.mean(axis=1)
    shift = np.zeros((len(rotations), 2))  # of the hips' middle, to the left and ahead
    stands = feet.stands.any(axis=1)
    shares = np.where(feet.stands, feet.weight, 0.0)
    total = shares.sum(axis=1, keepdims=True)
    shares = np.where(total > 0.0, shares / np.where(total > 0.0, total, 1.0), 0.5 * feet.stands)
    support = _support(bones, feet, shares)
    # Between two straight legs a tiny shift of the pelvis bends one knee or the other, by its square root. If the error
    # changes sign without shrinking, the step is halved.
    error, step = np.zeros_like(shift), np.ones_like(shift)
    for _ in range(60):  # each leaves about a fifth of the imbalance
        root, shortfall = _stand(bones, legs, out, pelvis, hips - middle[:, None], shift, feet)
        root = root - middle
        shortfall += _touch(bones, legs, out, root, hips)
        previous, error = error, body.centre_of_mass(out, root)[:, [0, 2]] - support
        error = np.where((stands & (total[:, 0] > 0.0))[:, None], error - feet.lean, 0.0)
        step = np.where((error * previous < 0.0) & (np.abs(error) > 0.5 * np.abs(previous)), 0.5 * step, step)
        far = np.abs(error).max(axis=1) > 1e-7  # metres
        if not far.any():
            break
        # Balanced postures stay, so no posture depends on the others.
        shift = shift - np.where(far[:, None], step * error, 0.0)
    return Stance(out, root, shortfall, np.abs(error).max(axis=1))


def _ball(bones: _Bones, feet: Feet, side: int) -> Floats:
    """Return the place of a foot's ball [T, 3], metres, mirrored for the right leg."""
    return np.stack([bones.hips[0, 0] + feet.out[:, side], np.zeros(len(feet.out)), feet.ahead[:, side]], axis=-1)


def _support(bones: _Bones, feet: Feet, shares: Floats) -> Floats:
    """Return the point on the floor [T, 2], left and ahead, over which the centre of mass belongs, metres.

    A flat foot supports halfway between ankle and ball, one whose heel is lifted by `ON_BALL_DEG` or more at its ball.
    """
    out = np.zeros((len(shares), 2))
    for side, sign in enumerate((1.0, -1.0)):
        back = 0.5 * bones.toes[2] * (1.0 - np.clip(np.degrees(feet.heel[:, side]) / ON_BALL_DEG, 0.0, 1.0))
        ball, turn = _ball(bones, feet, side), feet.turn[:, side]
        place = np.stack([sign * (ball[:, 0] - back * np.sin(turn)), ball[:, 2] - back * np.cos(turn)], axis=-1)
        out += shares[:, side, None] * np.where(feet.stands[:, side, None], place, 0.0)
    return out


def _stand(
    bones: _Bones, legs: list[_Leg], out: Floats, pelvis: Floats, hips: Floats, shift: Floats, feet: Feet
) -> tuple[Floats, Floats]:
    """Place the standing legs in `out` [T, J, 4].

    Args:
        bones: the left leg's segments.
        legs: the left and the right ones.
        out: local rotations [T, J, 4], changed in place.
        pelvis: rotations of the pelvis [T, 4].
        hips: places of the hips relative to their middle [T, 2, 3], metres.
        shift: horizontal place of the hips' middle, left and ahead [T, 2], metres.
        feet: the legs on the floor.

    Returns:
        The place of the hips' middle [T, 3], and the lengths by which legs are too short [T, 2]; metres.
    """
    height, short = _hip_height(legs, hips, shift, feet)
    for side, (sign, leg) in enumerate(zip((1.0, -1.0), legs, strict=True)):
        hip = np.array([sign, 1.0, 1.0]) * hips[:, side]
        hip += np.stack([sign * shift[:, 0], height, shift[:, 1]], axis=-1)
        thigh, knee = _two_bone_ik(bones, leg.ankle - hip, feet.knee[:, side])
        mirrored_pelvis = pelvis if side == 0 else rot.mirror(pelvis)
        joints = np.stack(
            [
                rot.inv_mul(mirrored_pelvis, thigh),
                knee,
                rot.inv_mul(rot.mul(thigh, knee), leg.sole),
                leg.lifted,
            ],
            axis=1,
        )
        joints = joints if side == 0 else rot.mirror(joints)
        placed = bones.indices[side, : joints.shape[1]]
        out[:, placed] = np.where(feet.stands[:, side, None, None], joints, out[:, placed])
    return np.stack([shift[:, 0], height, shift[:, 1]], axis=-1), short


def _hip_height(legs: list[_Leg], hips: Floats, shift: Floats, feet: Feet) -> tuple[Floats, Floats]:
    """Return the height of the hips' middle [T] that standing legs allow, 0 if none stands, and the lengths by which
    legs are too short [T, 2], metres."""
    height = np.full(len(hips), np.inf)
    short = np.zeros((len(hips), 2))
    for side, (sign, leg) in enumerate(zip((1.0, -1.0), legs, strict=True)):
        hip = np.array([sign, 1.0, 1.0]) * hips[:, side]
        hip[:, 0] += sign * shift[:, 0]
        hip[:, 2] += shift[:, 1]
        far = np.hypot(leg.ankle[:, 0] - hip[:, 0], leg.ankle[:, 2] - hip[:, 2])
        stands = feet.stands[:, side]
        short[:, side] = np.where(stands, np.maximum(far - leg.reach + 1e-9, 0.0), 0.0)
        top = leg.ankle[:, 1] + np.sqrt(np.maximum(leg.reach**2 - far**2, 1e-6)) - hip[:, 1]
        height = np.where(stands, np.minimum(height, top), height)
    return np.where(np.isfinite(height), height, 0.0), short


def _two_bone_ik(bones: _Bones, target: Floats, towards: Floats) -> tuple[Floats, Floats]:
    """Solve for the rotations of hip and knee [T, 4] that bring the ankle to `target` [T, 3] relative to the hip.

    The knee points `towards` [T] radians outward: thigh, shank and that direction are coplanar. The ankle may lie off
    the shank's axis. Closed form, by the law of cosines: the rounds of `place_legs` need the exact ankle. Source:
    Tolani, Goswami and Badler, "Real-time inverse kinematics techniques for anthropomorphic limbs", Graphical Models
    62 (2000).
    """
    thigh, shank = -bones.knee[1], float(np.hypot(bones.ankle[1], bones.ankle[2]))
    slant = np.arctan2(bones.ankle[2], -bones.ankle[1])
    far = np.linalg.norm(target, axis=-1)
    cosine = (far**2 - thigh**2 - shank**2) / (2.0 * thigh * shank)
    # Rounded: near a straight leg the arc cosine would turn the last bit of its argument into 1e-8 radians.
    bend = np.arccos(np.clip(np.round(cosine, 12), -1.0, 1.0)) + slant
    knee = rot.from_axis_angle([1.0, 0.0, 0.0], bend)
    end = bones.knee + rot.mul_vec(knee, bones.ankle)
    down = target / np.maximum(far, 1e-9)[:, None]
    forward = np.stack([np.sin(towards), np.zeros(len(towards)), np.cos(towards)], axis=-1)
    across = rot.cross(forward, down)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-9)
    line = rot.from_matrix(np.stack([across, -down, rot.cross(down, across)], axis=-1))
    return rot.mul(line, rot.from_axis_angle([1.0, 0.0, 0.0], np.arctan2(end[:, 2], -end[:, 1]))), knee


def _touch(bones: _Bones, legs: list[_Leg], out: Floats, root: Floats, hips: Floats) -> Floats:
    """Raise touching legs in `out` [T, J, 4] until their feet's lowest point is on the floor.

    Return the heights above the floor of feet whose legs do not reach it hanging straight down [T, 2], metres.
    """
    above = np.zeros((len(out), 2))
    for side, leg in enumerate(legs):
        if len(leg.rows) == 0:
            continue
        floor = -(root[leg.rows, 1] + hips[leg.rows, side, 1])
        above[leg.rows, side] = np.maximum(leg.up.min(axis=-1) - floor, 0.0)
        joints = leg.joints.copy()
        raised = rot.from_axis_angle(leg.axis, _angle_off_floor(leg, floor))
        joints[:, 0] = rot.inv_mul(leg.pelvis, rot.mul(raised, joints[:, 0]))
        out[np.ix_(leg.rows, bones.indices[side])] = joints if side == 0 else rot.mirror(joints)
    return above


def _angle_off_floor(leg: _Leg, floor: Floats) -> Floats:
    """Return the angles [R], radians, at which the last of a raised foot's points leaves a floor [R] below the hip.

    A point is as high above the hip as `up cos(angle) + ahead sin(angle)`: it goes down to where it is below the hip,
    and leaves the floor as far beyond that as it met it before.
    """
    far = np.hypot(leg.up, leg.ahead)
    share = np.clip(-floor[:, None] / np.maximum(far, 1e-9), -1.0, 1.0)
    leaves = np.arctan2(-leg.ahead, -leg.up) + np.arccos(share)
    return np.asarray(np.where(share < 1.0, leaves, 0.0).max(axis=-1).clip(0.0, MAX_RAISE_RAD))


def _foot_points(bones: _Bones, joints: Floats) -> Floats:
    """Return the places of a foot's points from the hip [R, P, 3], metres, of legs with these rotations [R, ..., 4]."""
    thigh = joints[:, 0]
    turned = rot.mul(thigh, joints[:, 1])
    place = rot.mul_vec(thigh, bones.knee) + rot.mul_vec(turned, bones.ankle)
    points = [place + rot.mul_vec(rot.mul(turned, joints[:, 2]), bones.heel)]
    for joint, step in enumerate(bones.foot, start=2):
        turned = rot.mul(turned, joints[:, joint])
        place = place + rot.mul_vec(turned, step)
        points.append(place)
    return np.stack(points, axis=1)
