"""A server of a corpus that listens, and requests to it."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import uvicorn

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Posture
from motionmind.body.skeleton import Skeleton
from motionmind.connections import config
from motionmind.geometry import rotations as rot
from motionmind.names.postures import find_posture
from motionmind.serve.guard import Guard

STANDS = (0.0, 0.971, 0.0)  # the pelvis of human23 at rest, with the toes on the floor
RIG = {
    "pelvis": "Hips",
    "lumbar": "Spine",
    "thorax": "Spine1",
    "cervical": "Neck",
    "atlantal": "Head",
    **{
        f"{side}_{joint}": f"{side.title()}{name}"
        for side in ("left", "right")
        for joint, name in {
            "hip": "UpLeg",
            "knee": "Leg",
            "ankle": "Foot",
            "toes": "ToeBase",
            "clavicle": "Shoulder",
            "shoulder": "Arm",
            "elbow": "ForeArm",
            "wrist": "Hand",
            "fingers": "HandIndex1",
        }.items()
    },
}


@contextmanager
def serving(application: Any, **options: Any) -> Iterator[str]:
    """Serve an application at a free port of this computer, behind the guard; yield its address."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        server = uvicorn.Server(config(Guard(application, "127.0.0.1", **options)))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join(60.0)


def wire(skeleton: Skeleton, stands: Sequence[float] = STANDS) -> dict[str, Any]:
    """A skeleton as the protocol has it."""
    return {
        "joints": [
            {
                "name": name,
                "parent": None if parent < 0 else skeleton.names[parent],
                "rest_translation": list(map(float, stands if parent < 0 else offset)),
                "rest_rotation": [0.0, 0.0, 0.0, 1.0],
            }
            for name, parent, offset in zip(skeleton.names, skeleton.parents, skeleton.offsets, strict=True)
        ]
    }


def keyframe(frame: int, posture: Posture, root: bool = True) -> dict[str, Any]:
    """A posture as a constraint."""
    rotations = {name: list(map(float, q)) for name, q in zip(posture.skeleton.names, posture.rotations, strict=True)}
    found = {"type": "pose_keyframe", "frame": frame, "joint_rotations": rotations}
    return found | {"root_position": list(map(float, posture.root))} if root else found


def ask(constraints: list[dict[str, Any]], frames: int, skeleton: Skeleton | None = None, **more: Any) -> Any:
    """A request to the corpus ballet."""
    return {
        "protocol_version": "1.0",
        "model": "ballet",
        "skeleton": wire(skeleton or human23()),
        "duration_frames": frames,
        "constraints": constraints,
        **more,
    }


def of_ballet(name: str, root: tuple[float, float, float] | None = None) -> Posture:
    """A named posture of the corpus, its root elsewhere."""
    found = find_posture(f"ballet/{name}").posture
    return found if root is None else Posture(found.skeleton, found.rotations, np.array(root))


def on_rig(posture: Posture, size: float = 1.2) -> Posture:
    """A posture of human23 on a foreign rig: other names, arms lowered and legs apart in its zero pose, larger.

    It has two joints that human23 lacks: a thumb, which is bent, and a helper between the pelvis and the spine.
    """
    body = posture.skeleton
    zero = np.tile(rot.IDENTITY, (len(body), 1))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        zero[body.index(f"{side}_shoulder")] = rot.from_axis_angle([0.0, 0.0, 1.0], -sign * np.radians(45.0))
        zero[body.index(f"{side}_hip")] = rot.from_axis_angle([0.0, 0.0, 1.0], sign * np.radians(8.0))
    places, turned = size * body.positions(zero, np.zeros(3)), body.global_rotations(zero)
    names, parents, offsets, rotations = [], [], [], []
    placed = rot.mul_inv(body.global_rotations(posture.rotations), turned)
    for joint, name in enumerate(body.names):
        parent = body.parents[joint]
        if name == "lumbar":
            names.append("mixamorig:Helper")
            parents.append(names.index("mixamorig:Hips"))
            offsets.append(np.zeros(3))
            rotations.append(rot.IDENTITY)
        above = body.names[parent] if parent >= 0 else ""
        parents.append(-1 if parent < 0 else names.index("mixamorig:" + ("Helper" if name == "lumbar" else RIG[above])))
        names.append(f"mixamorig:{RIG[name]}")
        offsets.append(np.zeros(3) if parent < 0 else places[joint] - places[parent])
        rotations.append(placed[joint] if parent < 0 else rot.inv_mul(placed[parent], placed[joint]))
    names.append("mixamorig:LeftHandThumb1")
    parents.append(names.index("mixamorig:LeftHand"))
    offsets.append(np.array([0.02, 0.0, 0.03]))
    rotations.append(rot.from_axis_angle([0.0, 1.0, 0.0], 0.5))
    skeleton = Skeleton("rig", tuple(names), tuple(parents), np.array(offsets))
    return Posture(skeleton, np.array(rotations), size * posture.root)


def rotations_of(sample: Any, names: Sequence[str]) -> Floats:
    """The rotations of a sample as the protocol's client reads it, matrices [T, J, 3, 3], in the order of names."""
    return np.asarray(sample["local_rot_mats"][:, [sample["joint_names"].index(name) for name in names]])


def root_of(sample: Any, name: str) -> Floats:
    """The places of the root [T, 3]."""
    return np.asarray(sample["posed_joints"][:, sample["joint_names"].index(name)])
