"""Places legs on the floor: finds the pelvis and the angles of legs that stand or touch, with the weight over the feet.

All postures are computed at once, in the frame that the body faces in: x to its left, z ahead, the floor at y = 0. The
right leg is computed as its mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy import SIDES, Anatomy, Leg
from motionmind.geometry import rotations as rot

ON_BALL = 24.0  # degrees of a lifted heel from which the ball alone bears the weight
MAX_ROUNDS = 60  # of moving the pelvis; each leaves about a fifth of the imbalance
BALANCED = 1e-7  # metres of imbalance at which the rounds end


@dataclass(frozen=True)
class Feet:
    """The legs of T postures on the floor; arrays [T, 2] for the left and the right leg.

    Attributes:
        stands: whether a leg stands, with or without weight.
        touches: whether it rests on the floor without standing.
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
    pelvis = rotations[:, 0]
    hips = rot.mul_vec(pelvis[:, None], bones.hips)  # [T, 2, 3] from the root
    middle = hips.mean(axis=1)
    shift = np.zeros((len(rotations), 2))  # of the hips' middle, to the left and ahead
    stands = feet.stands.any(axis=1)
    shares = np.where(feet.stands, feet.weight, 0.0)
    total = shares.sum(axis=1, keepdims=True)
    shares = np.where(total > 0.0, shares / np.where(total > 0.0, total, 1.0), 0.5 * feet.stands)
    # Between two straight legs a tiny shift of the pelvis bends one knee or the other, by its square root. If the error
    # changes sign without shrinking, the step is halved.
    error, step = np.zeros_like(shift), np.ones_like(shift)
    for _ in range(MAX_ROUNDS):
        root, shortfall = _stand(bones, out, pelvis, hips - middle[:, None], shift, feet)
        root = root - middle
        shortfall += _touch(bones, out, rotations, root, hips, feet)
        previous, error = error, body.centre_of_mass(out, root)[:, [0, 2]] - _support(bones, feet, shares)
        error = np.where((stands & (total[:, 0] > 0.0))[:, None], error - feet.lean, 0.0)
        step = np.where((error * previous < 0.0) & (np.abs(error) > 0.5 * np.abs(previous)), 0.5 * step, step)
        far = np.abs(error).max(axis=1) > BALANCED
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

    A flat foot supports halfway between ankle and ball, one whose heel is lifted by `ON_BALL` or more at its ball.
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
    """Place the standing legs in `out` [T, J, 4].

    Args:
        bones: the left leg's segments.
        out: local rotations [T, J, 4], changed in place.
        pelvis: rotations of the pelvis [T, 4].
        hips: places of the hips relative to their middle [T, 2, 3], metres.
        shift: horizontal place of the hips' middle, left and ahead [T, 2], metres.
        feet: the legs on the floor.

    Returns:
        The place of the hips' middle [T, 3], and the lengths by which legs are too short [T, 2]; metres.
    """
    height, short, ankles, soles = _hip_height(bones, hips, shift, feet)
    for side, sign in enumerate((1.0, -1.0)):
        hip = np.array([sign, 1.0, 1.0]) * hips[:, side]
        hip += np.stack([sign * shift[:, 0], height, shift[:, 1]], axis=-1)
        thigh, knee = _reach(bones, ankles[side] - hip, feet.knee[:, side])
        mirrored_pelvis = pelvis if side == 0 else rot.mirror(pelvis)
        joints = np.stack(
            [
                rot.inv_mul(mirrored_pelvis, thigh),
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


def _hip_height(
    bones: _Bones, hips: Floats, shift: Floats, feet: Feet
) -> tuple[Floats, Floats, list[Floats], list[Floats]]:
    """Find the height of the hips' middle [T] that standing legs allow; 0 if none stands.

    Also return the lengths by which legs are too short [T, 2], and each leg's ankle [T, 3] and sole [T, 4], mirrored
    for the right leg.
    """
    height = np.full(len(hips), np.inf)
    short = np.zeros((len(hips), 2))
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
    return np.where(np.isfinite(height), height, 0.0), short, ankles, soles


def _reach(bones: _Bones, target: Floats, towards: Floats) -> tuple[Floats, Floats]:
    """Solve for the rotations of hip and knee [T, 4] that bring the ankle to `target` [T, 3] relative to the hip.

    The knee points `towards` [T] radians outward: thigh, shank and that direction are coplanar. By the law of cosines;
    the ankle may lie off the shank's axis.
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
    """Raise touching legs until their feet's lowest point is on the floor, by bisection of the angle.

    Return the heights above the floor of feet whose legs do not reach it hanging straight down [T, 2], metres.
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
    """Return the height above the hip [T], metres, of the lowest point of a foot whose thigh is turned by `thigh`."""
    turned = rot.mul(thigh, joints[:, 1])
    place = rot.mul_vec(thigh, bones.knee) + rot.mul_vec(turned, bones.ankle)
    lowest = place[:, 1] + rot.mul_vec(rot.mul(turned, joints[:, 2]), bones.heel)[:, 1]
    for joint, step in enumerate(bones.foot, start=2):
        turned = rot.mul(turned, joints[:, joint])
        place = place + rot.mul_vec(turned, step)
        lowest = np.minimum(lowest, place[:, 1])
    return lowest
