"""The angles of a body's joints that bring its parts where signs point, within the joints' limits."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.geometry import rotations as rot
from motionmind.laban.measured import LIMBS

N_TWISTS = 48  # of a limb about the direction in which it points, that are tried
TILT_RANGE_DEG = (-15.0, 75.0)  # of the pelvis, which leaves a bent standing leg within the hip's limits
MAX_LIST_DEG = 15.0  # of the pelvis to a side, for the same reason
MAX_LIFT_DEG = 150.0  # bend of a knee
CLEARANCE_M = 0.015  # between the floor and a foot in the air
_UP = np.array([0.0, 1.0, 0.0])
# Shares of a lean and a turn that joints take; a lean begins in the hips.
_HEAD = {"cervical": (0.4, 4 / 9, 0.4), "atlantal": (0.6, 5 / 9, 0.6)}
_TORSO_TURN = {"lumbar": 1 / 3, "thorax": 2 / 3}

Angles = dict[str, Floats]  # degrees [3] about x, y and z, by joint without a side


class Aim(NamedTuple):
    """Where a part of the body is to point.

    Attributes:
        along: unit vector [3]: x to the left, y up, z ahead of the body.
        bend: flexion of the knee or elbow, degrees.
    """

    along: Floats
    bend: float = 0.0


def pose_trunk(body: Anatomy, torso: Aim, torso_turn: float, head: Aim, head_turn: float) -> tuple[Angles, Angles]:
    """Return the angles of the torso's and of the head's joints.

    Args:
        body: a person's anatomy.
        torso, head: where they point.
        torso_turn, head_turn: where they face, degrees to the left of the body's front.
    """
    lean = np.degrees(rot.log(rot.between(_UP, torso.along)))
    angles: Angles = {}
    for joint in ("pelvis", "lumbar", "thorax"):
        wanted = lean * [1.0, 0.0, 1.0]
        wanted[1] = torso_turn * _TORSO_TURN.get(joint, 0.0)
        if joint == "pelvis":
            wanted[[0, 2]] = np.clip(wanted[0], *TILT_RANGE_DEG), np.clip(wanted[2], -MAX_LIST_DEG, MAX_LIST_DEG)
        angles[joint] = _limited(body, joint, "", wanted)
        lean = lean - angles[joint]  # what is beyond the hips' limits
    chest = _global(body, angles, "thorax")
    turn = rot.about_vertical(np.radians(head_turn))
    swing = rot.between(_UP, rot.mul_vec(rot.inv(turn), head.along))
    local = rot.inv_mul(chest, rot.mul(turn, swing))
    whole = _degrees(body, body.named("cervical", ""), local[None])[0]
    return angles, {joint: _limited(body, joint, "", whole * shares) for joint, shares in _HEAD.items()}


def pose_limb(body: Anatomy, limb: str, side: str, aim: Aim, torso: Angles) -> Angles:
    """Return the angles of an arm's or a leg's joints, as written for the left.

    The limb may turn about the line along which it points; of all turns the one is taken that, within the limits,
    brings it nearest; of several the least.

    Args:
        body: a person's anatomy.
        limb: "arm" or "leg".
        side: "left" or "right".
        aim: where it points, from shoulder to wrist or from hip to ankle.
        torso: the angles of the torso's joints.
    """
    first, middle, _ = LIMBS[limb]
    above = _global(body, torso, "thorax" if limb == "arm" else "pelvis")
    along = aim.along
    if side == SIDES[1]:
        above, along = rot.mirror(above), along * [-1.0, 1.0, 1.0]
    bend = np.zeros(3)
    angle = body.joints[middle].angles["flexion"]
    bend[angle.axis] = angle.sign * aim.bend
    joint = body.named(first, "left")
    turns = np.linspace(-np.pi, np.pi, N_TWISTS, endpoint=False)
    turned = rot.mul(rot.from_axis_angle(along, turns), rot.between(_line(body, limb, round(aim.bend, 1)), along))
    at_rest = _rotations(body, {})[0, joint]
    degrees = _degrees(body, joint, rot.mul(rot.inv_mul(above, turned), at_rest))
    reached = body.rotations({f"left_{first}": degrees.clip(body.limits[0][joint], body.limits[1][joint])})[:, joint]
    line = rot.mul_vec(rot.mul(above, rot.mul_inv(reached, at_rest)), _line(body, limb, round(aim.bend, 1)))
    best = int(np.lexsort((np.abs(turns), np.round(rot.norm(line - along), 3)))[0])
    return {first: _limited(body, first, "left", degrees[best]), middle: _limited(body, middle, "left", bend)}


def standing_height(body: Anatomy, bend: float) -> float:
    """Return the height of the hip over the floor when a leg stands, its knee bent by some degrees, metres."""
    hip, knee, ankle = (body.named(joint, "left") for joint in LIMBS["leg"])
    points = body.skeleton.positions_and_tips(_rotations(body, {}), np.zeros((1, 3)))[0]
    thigh, shank = (float(np.linalg.norm(points[a] - points[b])) for a, b in ((hip, knee), (knee, ankle)))
    reach = np.sqrt(thigh**2 + shank**2 + 2.0 * thigh * shank * np.cos(np.radians(bend)))
    return float(reach) + float(points[ankle, 1] - _leg_points(body, points).min())


def _leg_points(body: Anatomy, points: Floats) -> Floats:
    """Return the heights of the joints and tips of the left foot, out of all points [P, 3]."""
    assert body.leg is not None  # as of a person
    foot = [body.named(body.leg.ankle, "left"), *body.foot(body.leg.toes, "left")]
    return np.asarray(points[[*foot, len(body.skeleton) + foot[-1]], 1])


def lift_leg(body: Anatomy, side: str, aim: Aim, torso: Angles, hip_height: float) -> Angles:
    """Return the angles of a leg in the air, as `pose_limb`, with its knee bent as far as keeps the foot off the floor.

    Args:
        body: a person's anatomy.
        side: "left" or "right".
        aim: where the leg points.
        torso: the angles of the torso's joints.
        hip_height: height of the hip over the floor, metres.
    """
    hip, ankle = body.named("hip", "left"), body.joints["ankle"].angles["plantar"]
    pelvis = torso["pelvis"] * ([1.0, 1.0, 1.0] if side == SIDES[0] else [1.0, -1.0, -1.0])
    angles: Angles = {}
    for bend in np.arange(aim.bend, MAX_LIFT_DEG + 1.0, 5.0):
        angles = pose_limb(body, "leg", side, aim._replace(bend=float(bend)), torso)
        flexed = np.zeros(3)  # the foot, so that the toes do not hang lower than the heel
        flexed[ankle.axis] = -0.5 * ankle.sign * (bend - aim.bend)
        angles["ankle"] = _limited(body, "ankle", "left", flexed)
        given = {f"left_{joint}": own[None] for joint, own in angles.items()} | {"pelvis": pelvis[None]}
        points = body.skeleton.positions_and_tips(body.rotations(given), np.zeros((1, 3)))[0]
        if points[hip, 1] - _leg_points(body, points).min() < hip_height - CLEARANCE_M:
            break
    return angles


def _limited(body: Anatomy, joint: str, side: str, degrees: Floats) -> Floats:
    """Return angles [3] within a joint's limits, to a tenth of a degree."""
    index = body.named(joint, side)
    return np.asarray(np.round(degrees.clip(body.limits[0][index], body.limits[1][index]), 1) + 0.0)  # no -0.0


def _rotations(body: Anatomy, angles: Angles) -> Floats:
    """Return the local rotations [1, J, 4] of a posture with some angles of its trunk."""
    given = {joint: own[None] for joint, own in angles.items()}
    return body.rotations({"pelvis": np.zeros((1, 3))} | given)


def _global(body: Anatomy, angles: Angles, joint: str) -> Floats:
    """Return the orientation of a joint of the trunk [4]."""
    return np.asarray(body.skeleton.global_rotations(_rotations(body, angles))[0, body.named(joint, "")])


def _degrees(body: Anatomy, joint: int, local: Floats) -> Floats:
    """Return the angles [n, 3] of a joint's local rotations [n, 4]."""
    rotations = np.repeat(_rotations(body, {}), len(local), axis=0)
    rotations[:, joint] = local
    return np.asarray(body.degrees_of(np.array([joint]), rotations)[:, 0])


@lru_cache(maxsize=256)
def _line(body: Anatomy, limb: str, bend: float) -> Floats:
    """Return the unit vector along a left limb that hangs and bends by some degrees [3]."""
    first, middle, last = (body.named(joint, "left") for joint in LIMBS[limb])
    angle = body.joints[LIMBS[limb][1]].angles["flexion"]
    degrees = np.zeros((1, 3))
    degrees[0, angle.axis] = angle.sign * bend
    points = body.skeleton.positions(body.rotations({body.skeleton.names[middle]: degrees}), np.zeros((1, 3)))[0]
    along = points[last] - points[first]
    return np.asarray(along / np.linalg.norm(along))
