"""What files of Kimodo hold, generated: bodies of SOMA in a T-pose that bend at random."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.formats._kimodo import _trees
from motionmind.geometry import rotations as rot

# Joints of SOMA and where they are in the T-pose, metres: the left ones and the middle.
T_POSE = {
    "Hips": (0.0, 1.0, 0.0),
    "Spine1": (0.0, 1.05, 0.0),
    "Spine2": (0.0, 1.12, 0.0),
    "Chest": (0.0, 1.2, 0.0),
    "Neck1": (0.0, 1.46, 0.0),
    "Neck2": (0.0, 1.53, 0.0),
    "Head": (0.0, 1.6, 0.02),
    "LeftShoulder": (0.02, 1.43, 0.04),
    "LeftArm": (0.16, 1.43, 0.0),
    "LeftForeArm": (0.45, 1.43, 0.0),
    "LeftHand": (0.72, 1.43, 0.0),
    "LeftHandMiddleEnd": (0.91, 1.43, 0.0),
    "LeftHandMiddle1": (0.8, 1.43, 0.0),
    "LeftLeg": (0.1, 0.92, 0.0),
    "LeftShin": (0.1, 0.48, 0.01),
    "LeftFoot": (0.1, 0.06, 0.0),
    "LeftToeBase": (0.1, 0.01, 0.13),
}


def body(count: int) -> Skeleton:
    """A body with the tree of so many joints, in a T-pose."""
    name, names, parents = _trees()[count]
    if name != "SOMA":
        return to_smpl_body()
    places = np.zeros((count, 3))
    for joint, (own, parent) in enumerate(zip(names, parents, strict=True)):
        left = own.replace("Right", "Left")
        sign = np.array([-1.0, 1.0, 1.0]) if left != own else np.ones(3)
        places[joint] = sign * T_POSE[left] if left in T_POSE else places[parent] + sign * (0.02, 0.03, 0.01)
    return Skeleton(name, names, parents, places - places[np.maximum(parents, 0)], np.zeros_like(places))


def to_smpl_body() -> Skeleton:
    from motionmind.formats._smpl import smpl_bodies

    return smpl_bodies()["SMPL body"]


def movement(count: int, seed: int = 0, frames: int = 6) -> dict[str, Floats]:
    """What a file holds: a body that bends at random, but not far."""
    rng = np.random.default_rng(seed)
    skeleton = body(count)
    local = rot.exp(0.3 * rng.normal(size=(frames, count, 3)))
    root = np.array([0.0, 1.0, 0.0]) + 0.1 * rng.normal(size=(frames, 3))
    return {
        "posed_joints": skeleton.positions(local, root),
        "global_rot_mats": rot.to_matrix(skeleton.global_rotations(local)),
        "foot_contacts": np.zeros((frames, 4)),
    }
