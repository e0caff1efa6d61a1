"""A body's handles, the named angles of its joints, and setting one of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.contact import heels_of
from motionmind.body.joint_angles import JointAngles
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Posture
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed
from motionmind.errors import MotionMindError, suggestion
from motionmind.geometry import rotations as rot

# Joints to drag, with everyday words for them.
_HANDLES = {
    "pelvis": "pelvis",
    "thorax": "chest",
    "atlantal": "head",
    "elbow": "elbow",
    "wrist": "hand",
    "knee": "knee",
    "ankle": "foot",
}
_LABELS = {
    "flexion": "bend / stretch",
    "abduction": "out / across",
    "rotation": "turn out / in",
    "tilt": "lean forward / back",
    "list": "lean left / right",
    "bend": "lean left / right",
    "turn": "turn left / right",
    "plantar": "point / flex",
    "inversion": "roll in / out",
    "elevation": "up / down",
    "protraction": "forward / back",
    "supination": "palm up / down",
    "radial": "to the thumb / little finger",
    "spread": "spread",
}
_FREELY = ("bend", "turn", "lean")  # rotations about x, y and z, for a joint without named angles
_WORDS = {"lumbar": "lower back", "thorax": "upper back", "cervical": "neck", "atlantal": "head"}


class Handle(NamedTuple):
    """A joint or a heel that can be dragged.

    Attributes:
        joint: its name, as `motionmind.studio.reach.drag` takes it.
        words: words for it.
        on: the joint that carries it; itself, unless it is a heel.
        at: its position in that joint's frame, metres.
    """

    joint: str
    words: str
    on: str
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Turn(NamedTuple):
    """An angle of a joint, degrees.

    Attributes:
        joint: the joint.
        words: words for the joint.
        angle: the angle's name: "flexion".
        label: words for its positive and negative sense: "bend / stretch".
        least, most: its limits.
        degrees: its value.
    """

    joint: str
    words: str
    angle: str
    label: str
    least: float
    most: float
    degrees: float


def words_of(joint: str) -> str:
    """Return a joint's name in words."""
    side, _, stem = joint.partition("_")
    if side in ("left", "right"):
        return f"{side} {_WORDS.get(stem, stem).replace('_', ' ')}"
    return displayed(_WORDS.get(joint, joint).replace("_", " "))


def handles_of(skeleton: Skeleton) -> list[Handle]:
    """Return handles: a person's joints by name, with heels; else the root, limbs' ends and those ends' parents."""
    if anatomy_of(skeleton) is not None:
        out = []
        for name in skeleton.names:
            side, _, stem = name.partition("_")
            if name in _HANDLES:
                out.append(Handle(name, _HANDLES[name], name))
            elif side in ("left", "right") and stem in _HANDLES:
                out.append(Handle(name, f"{side} {_HANDLES[stem]}", name))
        for name, (ankle, (x, y, z)) in heels_of(skeleton).items():
            out.append(Handle(name, name.replace("_", " "), skeleton.names[ankle], (float(x), float(y), float(z))))
        return out
    leaves = [joint for joint in range(1, len(skeleton)) if not skeleton.children(joint)]
    middles = [skeleton.parents[leaf] for leaf in leaves]
    chosen = sorted({0, *leaves, *(joint for joint in middles if len(skeleton.children(joint)) == 1)})
    return [Handle(name, words_of(name), name) for name in (skeleton.names[joint] for joint in chosen)]


def turns_of(posture: Posture) -> list[Turn]:
    """Return all adjustable joint angles of a posture."""
    skeleton, out = posture.skeleton, []
    anatomy = anatomy_of(skeleton)
    if anatomy is None:
        vectors = np.degrees(rot.log(posture.rotations))
        return [
            Turn(name, words_of(name), angle, angle, -180.0, 180.0, float(vectors[joint, axis]))
            for joint, name in enumerate(skeleton.names)
            for axis, angle in enumerate(_FREELY)
        ]
    angles = JointAngles(skeleton, posture.rotations[None])
    values, least, most = (np.degrees(a) for a in (angles.of(posture.rotations), angles.least, angles.most))
    for joint, name in enumerate(skeleton.names):
        for called, angle in anatomy.anatomy(name)[1].angles.items():
            at = joint, angle.axis
            ends = sorted(angle.sign * end for end in np.clip((least[at], most[at]), -180.0, 180.0))
            value = float(angle.sign * values[at])
            label = _LABELS.get(called, " / ".join(filter(None, (called, angle.opposite))))
            out.append(Turn(name, words_of(name), called, label, float(ends[0]), float(ends[1]), value))
    return out


def turned(posture: Posture, joint: str, angle: str, degrees: float) -> Posture:
    """Return the posture with one angle of a joint set, within its limits.

    Raises:
        SkeletonError: there is no such joint.
        MotionMindError: it has no such angle.
    """
    skeleton = posture.skeleton
    number, anatomy = skeleton.index(joint), anatomy_of(skeleton)
    if anatomy is None:
        if angle not in _FREELY:
            raise MotionMindError(f"{displayed(joint)} has no angle {displayed(angle)}{suggestion(angle, _FREELY)}")
        rotations, vector = posture.rotations.copy(), rot.log(posture.rotations[number])
        vector[_FREELY.index(angle)] = np.radians(degrees)
        rotations[number] = rot.exp(vector)
        return Posture(skeleton, rotations, posture.root)
    named = anatomy.anatomy(joint)[1].angles
    if angle not in named:
        raise MotionMindError(f"{displayed(joint)} has no angle {displayed(angle)}{suggestion(angle, [*named])}")
    angles = JointAngles(skeleton, posture.rotations[None])
    values, at = angles.of(posture.rotations), (number, named[angle].axis)
    values[at] = named[angle].sign * np.radians(degrees)
    return Posture(skeleton, rot.normalise(angles.rotations(angles.within(values))), posture.root)


def mirror(posture: Posture) -> Posture:
    """Return the posture mirrored in place, on the same body.

    Raises:
        SkeletonError: the body is not symmetric.
    """
    return Posture(posture.skeleton, mirrored(posture.as_motion()).rotations[0], posture.root)
