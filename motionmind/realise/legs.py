"""Legs of two long bones: find them in a body, and bring their ends to a place by inverse kinematics."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.limbs import limbs_of, stem_of
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot

SOFT = 0.02  # of a leg's length: this near to its full length a leg that stands stretches less than it would have to
HINGE = 0.1  # sine of a knee's bend below which its axis is mostly the one of other frames


def find_legs(skeleton: Skeleton) -> tuple[list[int], list[tuple[list[int], int]]]:
    """Find the legs of a body: limbs of two bones or more that hang from the root, or from the first fork below it.

    Args:
        skeleton: the body.

    Returns:
        The legs' numbers in `limbs_of`; and for each leg its joints, outward, and the place among them of its knee, the
        joint between its two longest neighbouring bones.
    """
    numbers, out, above = [], [], stem_of(skeleton)[-1]
    lengths, tips = rot.norm(skeleton.offsets), rot.norm(skeleton.tips)
    for number, limb in enumerate(limbs_of(skeleton)):
        if skeleton.parents[limb[0]] != above or len(limb) < 2:
            continue
        bones = [*lengths[limb[1:]].tolist(), float(tips[limb[-1]])]
        pairs = [min(pair) for pair in pairwise(bones)]
        if max(pairs) > 0.0:
            numbers.append(number)
            out.append((limb, pairs.index(max(pairs)) + 1))
    return numbers, out


def find_hinge(skeleton: Skeleton, knee: int) -> Floats | None:
    """Return the axis [3] about which a knee bends, in its own frame; None where nothing is known of the body's joints.

    It is that of the angle with the greatest range, in the sense in which the joint goes farther.
    """
    anatomy = anatomy_of(skeleton)
    if anatomy is None:
        return None
    name = skeleton.names[knee]
    joint, described = anatomy.anatomy(name)
    angle = max(described.angles.values(), key=lambda one: one.range[1] - one.range[0])
    axis = np.eye(3)[angle.axis] * angle.sign * np.sign(sum(angle.range))
    # A turn is mirrored as its axis is, and reversed.
    mirrored = anatomy.paired(joint) and name.startswith("right_")
    return np.asarray(axis * np.array([1.0, -1.0, -1.0]) if mirrored else axis)


def stretched(now: Floats, wanted: Floats, length: Floats | float, soft: Floats | float) -> Floats:
    """Return how far a leg's ends are from each other [N], metres, that is to be longer or shorter.

    Args:
        now: how far they are [N], metres.
        wanted: how far they are to be [N], metres.
        length: of the straight leg, metres.
        soft: of the leg's length: this near to its full length it stretches less than it would have to [N].
    """
    return np.asarray(now + _soft_stretch(wanted - now, length - now, np.asarray(soft * length)))


def reach(
    hip: Floats, leg: Floats, target: Floats, hinge: Floats | None = None, soft: Floats | float = SOFT
) -> tuple[Floats, Floats]:
    """Return rotations [N, ..., 4] of thighs and shanks, in the world, that bring the legs' ends to their targets.

    The knee bends about its own axis until the end is as far from the hip as the target, by the law of cosines; the
    leg then turns the shortest way towards it. A leg that is too short falls smoothly short of the target.

    Args:
        hip: orientations of the hips in the world [N, ..., 4].
        leg: positions of hip, knee and end [N, ..., 3, 3], metres.
        target: positions for the end [N, ..., 3], metres.
        hinge: axis in the hip's frame about which each knee bends where the leg is all but straight [..., 3]; None for
            that of frames where it is not.
        soft: of the leg's length: this near to its full length it stretches less than it would have to [N, ...].
    """
    start, middle, end = np.moveaxis(leg, -2, 0)
    thigh, shank = middle - start, end - middle
    axis = _hinge(hip, thigh, shank, hinge)
    # Components along the axis do not change; across it, the bones and their angle form a triangle.
    along = np.sum(thigh * axis, axis=-1), np.sum(shank * axis, axis=-1)
    across = np.sqrt(np.sum(thigh**2, axis=-1) - along[0] ** 2), np.sqrt(np.sum(shank**2, axis=-1) - along[1] ** 2)
    least, product = (along[0] + along[1]) ** 2 + across[0] ** 2 + across[1] ** 2, 2.0 * across[0] * across[1]
    now, wanted = rot.norm(end - start), rot.norm(target - start)
    far = stretched(now, wanted, np.sqrt(least + product), soft)
    bends = [np.arccos(np.clip((distance**2 - least) / product, -1.0, 1.0)) for distance in (now, far)]
    bend = rot.from_axis_angle(axis, bends[1] - bends[0])
    turn = rot.between(thigh + rot.mul_vec(bend, shank), target - start)
    return turn, rot.mul(turn, bend)


def _hinge(hip: Floats, thigh: Floats, shank: Floats, usual: Floats | None) -> Floats:
    """Return unit axes [N, ..., 3] about which knees bend, from their bones [N, ..., 3], metres.

    In frames where a leg is all but straight the axis is the usual one [..., 3], as seen from the hip [N, ..., 4]: if
    that is not given, that of other frames.
    """
    normal = rot.cross(thigh, shank)
    if usual is None:
        usual = rot.mul_vec(rot.inv(hip), normal).sum(axis=0)
    straight = rot.norm(usual)[..., None] < 1e-9
    if straight.any():  # in all frames: the body axis most nearly at right angles to the thigh, made exactly so
        bone = rot.mul_vec(rot.inv(hip[0]), thigh[0])
        across = np.eye(3)[np.argmin(np.abs(bone), axis=-1)]
        across -= bone * (np.sum(across * bone, axis=-1) / np.sum(bone * bone, axis=-1))[..., None]
        usual = np.where(straight, across, usual)
    size = rot.norm(thigh) * rot.norm(shank)
    normal += (HINGE * size)[..., None] * rot.mul_vec(hip, usual / rot.norm(usual)[..., None])
    return np.asarray(normal / rot.norm(normal)[..., None])


def _soft_stretch(wanted: Floats, room: Floats, soft: Floats) -> Floats:
    """Return how much longer a leg becomes [N], metres.

    All that is wanted, up to `soft` from the end of the room; then exponentially less, so the end is never reached.

    Args:
        wanted: how much longer it should become [N], metres.
        room: how much longer it could become [N], metres.
        soft: distance from the end at which it begins to fall short [N], metres.
    """
    soft = np.maximum(np.minimum(soft, room), 1e-9)
    over = np.maximum(wanted - (room - soft), 0.0)
    return np.asarray(np.minimum(wanted, room - soft) + soft * -np.expm1(-over / soft))
