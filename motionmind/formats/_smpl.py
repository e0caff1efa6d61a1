"""SMPL's bodies: their joints, and movement retargeted to them from human44 and human23."""

from __future__ import annotations

from functools import cache

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES
from motionmind.body.human import human44
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import to_human23

# SMPL's tree: Loper, Mahmood, Romero, Pons-Moll and Black, "SMPL: A Skinned Multi-Person Linear Model", ACM Trans.
# Graph. 34:6 (2015); SMPL+H: Romero, Tzionas and Black, "Embodied Hands", ACM Trans. Graph. 36:6 (2017); SMPL-X:
# Pavlakos et al., "Expressive Body Capture", CVPR (2019). The names are those of the models' published code.
_Rows = tuple[tuple[str, str], ...]  # joint and parent

_FINGERS = ("index", "middle", "pinky", "ring", "thumb")

_BODY: _Rows = (
    ("pelvis", ""),
    *((f"{side}_hip", "pelvis") for side in SIDES),
    ("spine1", "pelvis"),
    *((f"{side}_knee", f"{side}_hip") for side in SIDES),
    ("spine2", "spine1"),
    *((f"{side}_ankle", f"{side}_knee") for side in SIDES),
    ("spine3", "spine2"),
    *((f"{side}_foot", f"{side}_ankle") for side in SIDES),
    ("neck", "spine3"),
    *((f"{side}_collar", "spine3") for side in SIDES),
    ("head", "neck"),
    *((f"{side}_shoulder", f"{side}_collar") for side in SIDES),
    *((f"{side}_elbow", f"{side}_shoulder") for side in SIDES),
    *((f"{side}_wrist", f"{side}_elbow") for side in SIDES),
)
_HANDS: _Rows = tuple(
    (f"{side}_{finger}{row}", f"{side}_{finger}{row - 1}" if row > 1 else f"{side}_wrist")
    for side in SIDES
    for finger in _FINGERS
    for row in (1, 2, 3)
)

# {SMPL's joint: human44's at the same place}, if the names differ. SMPL's spine2 is about as high above the pelvis as
# human44's thorax, its spine3 as thorax_middle.
_PLACE_SOURCES = {
    "spine1": "lumbar",
    "spine2": "thorax",
    "spine3": "thorax_middle",
    "neck": "cervical",
    "head": "atlantal",
    **{f"{side}_collar": f"{side}_clavicle" for side in SIDES},
    **{f"{side}_foot": f"{side}_toes" for side in SIDES},
    **{f"{side}_hand": f"{side}_fingers" for side in SIDES},
    **{
        f"{side}_{finger}{row}": f"{side}_{'thumb' if finger == 'thumb' else 'fingers'}{joint}"
        for side in SIDES
        for finger in _FINGERS
        for row, joint in enumerate(("", "_middle", "_end"), start=1)
    },
}
# {SMPL's joint: human44's with its rotation}, if that is another joint, the last of a row.
_ROTATION_SOURCES = {"spine1": "lumbar_upper", "spine3": "thorax_upper", "neck": "cervical_upper"}

# Offset along z of each finger from human44's fingers, which represent four: a hand is about 84 mm broad (Buryanov and
# Kotiuk, as for human44).
FINGERS_AHEAD_M = {"index": 0.021, "ring": -0.021, "pinky": -0.042}
# Offsets of joints from their place in human44. Those of jaw and eyes in the head are guesses.
_OFFSETS_M = {
    "jaw": (0.0, 0.02, 0.02),
    "left_eye_smplhf": (0.03, 0.08, 0.08),
    "right_eye_smplhf": (-0.03, 0.08, 0.08),
    **{
        f"{side}_{finger}{row}": (0.0, 0.0, ahead)
        for side in SIDES
        for finger, ahead in FINGERS_AHEAD_M.items()
        for row in (1, 2, 3)
    },
}


@cache
def smpl_bodies() -> dict[str, Skeleton]:
    """Return SMPL's skeletons by name, smallest first, with joints at human44's places in metres."""
    face: _Rows = tuple((joint, "head") for joint in ("jaw", "left_eye_smplhf", "right_eye_smplhf"))
    trees = {
        "SMPL body": _BODY,
        "SMPL": _BODY + tuple((f"{side}_hand", f"{side}_wrist") for side in SIDES),
        "SMPL+H": _BODY + _HANDS,
        "SMPL-X": _BODY + face + _HANDS,
    }
    return {name: _body(name, rows) for name, rows in trees.items()}


def _body(name: str, rows: _Rows) -> Skeleton:
    """Build a skeleton from the tree `rows`, with each joint at its place in human44."""
    model = human44()
    places = model.rest[: len(model)]
    joints, parents = [joint for joint, _ in rows], [parent for _, parent in rows]
    sources = [
        model.index(_PLACE_SOURCES.get(joint, "atlantal" if parent == "head" else joint)) for joint, parent in rows
    ]
    rest = places[sources] + [_OFFSETS_M.get(joint, (0.0, 0.0, 0.0)) for joint in joints]
    tips = np.zeros((len(rows), 3))
    for i, joint in enumerate(joints):
        if joint == "head" or not (joint in parents or parents[i] == "head"):
            end = sources[i]
            while below := model.children(end):  # a wrist's fingers come before its thumb
                end = below[0]
            tips[i] = places[end] + model.tips[end] - places[sources[i]]
    above = [joints.index(parent) if parent else -1 for parent in parents]
    offsets = rest - rest[above]
    offsets[0] = 0.0
    return Skeleton(name, tuple(joints), tuple(above), offsets, tips)


def to_smpl(motion: Motion) -> tuple[Skeleton, Floats, Floats]:
    """Retarget a motion to one of SMPL's bodies: its own if it is on one, else SMPL+H.

    Returns:
        The body, its joints' local rotations [T, J, 4], and the pelvis's places [T, 3] in metres, y up.

    Raises:
        SkeletonError: the skeleton maps to neither human44 nor human23.
    """
    body = smpl_body_for(motion.skeleton)
    if body.difference(motion.skeleton) is None:
        return body, motion.rotations.copy(), motion.root
    if human44().difference(motion.skeleton) is not None:
        motion = to_human23(motion)
    given = motion.skeleton.global_rotations(motion.rotations)
    turned = np.empty((len(motion), len(body), 4))
    for i, (joint, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        source = _source(joint, motion.skeleton)
        turned[:, i] = turned[:, parent] if source is None else given[:, motion.skeleton.index(source)]
    return body, body.local_rotations(turned), motion.root


def smpl_body_for(skeleton: Skeleton) -> Skeleton:
    """Return the SMPL body to which `to_smpl` retargets a skeleton: its own if it is one, else SMPL+H."""
    return _smpl_body_of(skeleton) or smpl_bodies()["SMPL+H"]


def _smpl_body_of(skeleton: Skeleton) -> Skeleton | None:
    """Return the SMPL body with these joints; None if there is none."""
    return next((body for body in smpl_bodies().values() if body.difference(skeleton) is None), None)


def _source(joint: str, skeleton: Skeleton) -> str | None:
    """Return the joint of human23 or human44 that gives one of SMPL's its rotation; None for none, as for a jaw."""
    choices = (_ROTATION_SOURCES.get(joint), _PLACE_SOURCES.get(joint, joint))
    return next((name for name in choices if name in skeleton.names), None)


def unmapped_joints(motion: Motion) -> list[str]:
    """Return the names of joints that turn in `motion` but have no counterpart among SMPL's."""
    skeleton = motion.skeleton
    if _smpl_body_of(skeleton):
        return []
    if human44().difference(skeleton) is None:
        kept = {*_PLACE_SOURCES.values(), *_ROTATION_SOURCES.values(), *smpl_bodies()["SMPL+H"].names}
    else:
        kept = set(joint_mapping(skeleton) or skeleton.names)
    return [name for name in turning_joints(motion) if name not in kept]


def turning_joints(motion: Motion) -> list[str]:
    """Return the names of joints that ever turn from rest by more than 1e-6 rad."""
    turns = rot.angle(motion.rotations, rot.IDENTITY).max(axis=0) > 1e-6
    return [motion.skeleton.names[joint] for joint in np.flatnonzero(turns)]
