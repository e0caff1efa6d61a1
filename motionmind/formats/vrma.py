"""Writes VRM animations (`.vrma`): movement of a person for any VRM body, with no body of its own.

A VRM animation is a GLB whose extension maps nodes to VRM's bones: "VRMC_vrm_animation-1.0", VRM Consortium (2024). Its
rest pose must be VRM's T-pose (upright, facing +z, palms down), like human23's; its bones rotate, and only the hips
move.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from motionmind.body.anatomy import SIDES
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.formats._json import rounded
from motionmind.formats._smpl import FINGERS_AHEAD_M
from motionmind.formats.glb import GlbBuffer, animation_of, at_rest, container, joint_nodes
from motionmind.retarget.retarget import to_human23

_BONES = {
    "pelvis": "hips",
    "lumbar": "spine",
    "thorax": "chest",
    "cervical": "neck",
    "atlantal": "head",
    **{
        f"{side}_{joint}": f"{side}{bone}"
        for side in SIDES
        for joint, bone in {
            "clavicle": "Shoulder",
            "shoulder": "UpperArm",
            "elbow": "LowerArm",
            "wrist": "Hand",
            "fingers": "MiddleProximal",
            "hip": "UpperLeg",
            "knee": "LowerLeg",
            "ankle": "Foot",
            "toes": "Toes",
        }.items()
    },
}
# human23's fingers represent four; index, ring and little finger turn with the middle one, ahead of or behind it.
_OTHER_FINGERS = dict(zip(("IndexProximal", "RingProximal", "LittleProximal"), FINGERS_AHEAD_M.values(), strict=True))
N_BONES = len(_BONES) + 2 * len(_OTHER_FINGERS)  # in a file


def write_vrma(path: FilePath, motion: Motion) -> None:
    """Write a person's movement as a VRM animation, retargeted to human23 first.

    Players scale the hips' path by the height of the hips of the displayed body.

    Args:
        path: the file to write.
        motion: the movement.

    Raises:
        MotionMindError: the skeleton does not map to human23, times are too close together for single precision, or the
            file cannot be written.
    """
    motion = to_human23(motion)
    skeleton, name = motion.skeleton, motion.name or "motion"
    if len(motion) == 1:
        raise MotionMindError(f"{path}: a VRM animation needs two frames at least, not one posture (write .glb)")
    nodes = joint_nodes(skeleton, at_rest(skeleton)[0])
    for node, joint in zip(nodes, skeleton.names, strict=True):
        node["name"] = _BONES[joint]
    buffer = GlbBuffer()
    animation = animation_of(buffer, motion, name)
    for side in SIDES:
        finger, hand = skeleton.index(f"{side}_fingers"), skeleton.index(f"{side}_wrist")
        for bone, ahead in _OTHER_FINGERS.items():
            nodes[hand]["children"] = [*nodes[hand]["children"], len(nodes)]
            channel = {"sampler": finger + 1, "target": {"node": len(nodes), "path": "rotation"}}
            animation["channels"].append(channel)
            place = rounded(skeleton.offsets[finger] + np.array([0.0, 0.0, ahead])).tolist()
            nodes.append({"name": f"{side}{bone}", "translation": place})
    bones = {node["name"]: {"node": number} for number, node in enumerate(nodes)}
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "MotionMind"},
        "extensionsUsed": ["VRMC_vrm_animation"],
        "extensions": {"VRMC_vrm_animation": {"specVersion": "1.0", "humanoid": {"humanBones": bones}}},
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0]}],
        "nodes": nodes,
        "animations": [animation],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    write_atomically(path, container(document, bytes(buffer.data), name))
