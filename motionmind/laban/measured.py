"""Measure in a score's postures what the columns of a staff say: directions of limbs, bends, supports, turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy import SIDES, Anatomy, Leg
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.laban.signs import ARMS, LEGS, TWISTS
from motionmind.notation.posture_line import Row
from motionmind.notation.stance import ON_BALL_DEG

LOW_SUPPORT_DEG = 30.0  # a standing knee that bends by more is a low support, halfway to a sign of 60 degrees
# From the joint at a part's root to the joint or tip at its end, by way of the joint that bends.
LIMBS = {"leg": ("hip", "knee", "ankle"), "arm": ("shoulder", "elbow", "wrist")}


@dataclass(frozen=True)
class Measured:
    """The postures of a score as a staff's columns see them, in the frame that the body faces in.

    Attributes:
        directions: by column of `GESTURES`, unit vectors from the part's root to its end [T, 3]: x left, y up, z ahead.
        bends: by column of limbs, flexion of the knee or elbow [T], degrees.
        twists: by column of `TWISTS`, where a part faces [T], degrees to the left of the body's front.
        facing: where the body faces [T], degrees to the left, without jumps.
        bears: whether the left and the right leg bear weight [T, 2].
        touches: whether they rest on the floor without weight [T, 2].
        feet: places of the middles of the feet in the world [T, 2, 3], metres.
        levels: of each leg if it bears weight [T, 2]: 0 low, 1 middle, 2 high.
    """

    directions: dict[str, Floats]
    bends: dict[str, Floats]
    twists: dict[str, Floats]
    facing: Floats
    bears: Bools
    touches: Bools
    feet: Floats
    levels: Floats


def check_body(body: Anatomy) -> Leg:
    """Return the names of a person's leg joints; MotionMindError if the body is not a person's."""
    needed = {"pelvis", "thorax", "cervical", "atlantal", *LIMBS["leg"], *LIMBS["arm"]}
    if body.leg is None or not needed <= set(body.joints):
        raise MotionMindError(f"Labanotation is drawn of people (human23, human44), not of {body.skeleton.name}")
    return body.leg


def measure(body: Anatomy, rows: Sequence[Row], motion: Motion) -> Measured:
    """Measure the postures of a score.

    Args:
        body: the score's body.
        rows: the score's rows [T].
        motion: its movement, a frame a row.

    Raises:
        MotionMindError: the body is not a person's.
    """
    leg = check_body(body)
    skeleton = body.skeleton
    face = np.array([row.face for row in rows])
    back = rot.about_vertical(-np.radians(face))
    points = skeleton.positions_and_tips(motion.rotations, motion.root)
    turned = rot.mul(back[:, None], skeleton.global_rotations(motion.rotations))

    def line(start: int, end: int) -> Floats:
        along = rot.mul_vec(back, points[:, end] - points[:, start])
        return np.asarray(along / np.maximum(rot.norm(along), 1e-9)[:, None])

    cervical, tip = body.named("cervical", ""), len(skeleton) + body.named("atlantal", "")
    directions = {"torso": line(body.named("pelvis", ""), cervical), "head": line(cervical, tip)}
    bends = {}
    for column in (*LEGS, *ARMS):
        side, _, limb = column.partition(" ")
        first, middle, last = (body.named(joint, side) for joint in LIMBS[limb])
        directions[column] = line(first, last)
        cosine = (line(first, middle) * line(middle, last)).sum(axis=1)
        bends[column] = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    parts = (body.named("thorax", ""), body.named("atlantal", ""))
    twists = {c: np.degrees(rot.heading(turned[:, part])) for c, part in zip(TWISTS, parts, strict=True)}
    bears, touches = _supports(body, leg, rows)
    ankles, balls = ([body.named(joint, side) for side in SIDES] for joint in (leg.ankle, leg.toes))
    knees = np.stack([bends[column] for column in LEGS], axis=1)
    lifted = _heel_lift(body, leg, points, motion) >= ON_BALL_DEG
    return Measured(
        directions,
        bends,
        twists,
        face[0] + np.concatenate([[0.0], np.cumsum(_wrapped(np.diff(face)))]),
        bears,
        touches,
        0.5 * (points[:, ankles] + points[:, balls]),  # which stays where a foot turns
        np.where(knees >= LOW_SUPPORT_DEG, 0, np.where(lifted, 2, 1)),
    )


def _wrapped(degrees: Floats) -> Floats:
    """Return angles between -180 and 180 degrees."""
    return np.asarray((degrees + 180.0) % 360.0 - 180.0)


def _supports(body: Anatomy, leg: Leg, rows: Sequence[Row]) -> tuple[Bools, Bools]:
    """Return whether each leg bears weight, and whether it only rests on the floor [T, 2]."""
    layer = next(i for i, joints in enumerate(body.layers.values()) if leg.hip in joints)
    bears, touches = np.zeros((len(rows), 2), dtype=np.bool_), np.zeros((len(rows), 2), dtype=np.bool_)
    for t, row in enumerate(rows):
        if row.up is not None:
            continue
        legs = row.limbs[layer]
        stands = ["stand" in own or "planted" in own for own in legs]
        for side in (0, 1):
            other = legs[1 - side].get("weight", 50.0) if stands[1 - side] else 50.0
            weight = legs[side].get("weight", 100.0 - other)
            bears[t, side] = stands[side] and weight > 0.0
            touches[t, side] = not bears[t, side] and (stands[side] or "touch" in legs[side])
    return bears, touches


def _heel_lift(body: Anatomy, leg: Leg, points: Floats, motion: Motion) -> Floats:
    """Return by how many degrees each foot's heel is lifted [T, 2]."""
    turned = body.skeleton.global_rotations(motion.rotations)
    out = np.zeros((len(motion), 2))
    for number, side in enumerate(SIDES):
        ankle, toes = body.named(leg.ankle, side), body.named(leg.toes, side)
        heel = np.array(leg.heel) * [1.0 - 2.0 * number, 1.0, 1.0]
        sole = body.skeleton.offsets[toes] - heel
        along = rot.mul_vec(turned[:, ankle], sole)
        flat = np.degrees(np.arcsin(sole[1] / np.linalg.norm(sole)))
        out[:, number] = flat - np.degrees(np.arcsin(np.clip(along[:, 1] / rot.norm(along), -1.0, 1.0)))
    return out
