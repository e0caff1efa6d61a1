"""SMPL's bodies: their joints, and movement brought onto them from human44 and human23."""

from __future__ import annotations

from functools import cache

import numpy as np

from motionmind._typing import Floats
from motionmind.body.human import human44
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import to_human23

# SMPL's tree: Loper, Mahmood, Romero, Pons-Moll and Black, "SMPL: A Skinned Multi-Person Linear Model", ACM Trans.
# Graph. 34:6 (2015); SMPL+H: Romero, Tzionas and Black, "Embodied Hands", ACM Trans. Graph. 36:6 (2017); SMPL-X:
# Pavlakos et al., "Expressive Body Capture", CVPR (2019). The names are those of the models' published code.
_Rows = tuple[tuple[str, str], ...]  # a joint, and the joint that it hangs from

_SIDES = ("left", "right")
_FINGERS = ("index", "middle", "pinky", "ring", "thumb")

_BODY: _Rows = (
    ("pelvis", ""),
    *((f"{side}_hip", "pelvis") for side in _SIDES),
    ("spine1", "pelvis"),
    *((f"{side}_knee", f"{side}_hip") for side in _SIDES),
    ("spine2", "spine1"),
    *((f"{side}_ankle", f"{side}_knee") for side in _SIDES),
    ("spine3", "spine2"),
    *((f"{side}_foot", f"{side}_ankle") for side in _SIDES),
    ("neck", "spine3"),
    *((f"{side}_collar", "spine3") for side in _SIDES),
    ("head", "neck"),
    *((f"{side}_shoulder", f"{side}_collar") for side in _SIDES),
    *((f"{side}_elbow", f"{side}_shoulder") for side in _SIDES),
    *((f"{side}_wrist", f"{side}_elbow") for side in _SIDES),
)
_MITTENS: _Rows = tuple((f"{side}_hand", f"{side}_wrist") for side in _SIDES)
_FACE: _Rows = tuple((joint, "head") for joint in ("jaw", "left_eye_smplhf", "right_eye_smplhf"))
_HANDS: _Rows = tuple(
    (f"{side}_{finger}{row}", f"{side}_{finger}{row - 1}" if row > 1 else f"{side}_wrist")
    for side in _SIDES
    for finger in _FINGERS
    for row in (1, 2, 3)
)

# The joint of human44 at the place of one of SMPL's, if the names differ. SMPL's spine2 is about as high above the
# pelvis as human44's thorax, its spine3 as thorax_middle.
_PLACE_OF = {
    "spine1": "lumbar",
    "spine2": "thorax",
    "spine3": "thorax_middle",
    "neck": "cervical",
    "head": "atlantal",
    **{f"{side}_collar": f"{side}_clavicle" for side in _SIDES},
    **{f"{side}_foot": f"{side}_toes" for side in _SIDES},
    **{f"{side}_hand": f"{side}_fingers" for side in _SIDES},
    **{
        f"{side}_{finger}{row}": f"{side}_{'thumb' if finger == 'thumb' else 'fingers'}{joint}"
        for side in _SIDES
        for finger in _FINGERS
        for row, joint in enumerate(("", "_middle", "_end"), start=1)
    },
}
# The joint whose rotation it takes, if that is another: the end of a row.
_ROTATION_OF = {"spine1": "lumbar_upper", "spine3": "thorax_upper", "neck": "cervical_upper"}

# Metres from human44's fingers, which stand for four, to each of them: a hand is about 84 mm broad (Buryanov and
# Kotiuk, as for human44). The places of jaw and eyes in the head are guesses.
_DISPLACEMENTS = {
    "jaw": (0.0, 0.02, 0.02),
    "left_eye_smplhf": (0.03, 0.08, 0.08),
    "right_eye_smplhf": (-0.03, 0.08, 0.08),
    **{
        f"{side}_{finger}{row}": (0.0, 0.0, ahead)
        for side in _SIDES
        for finger, ahead in (("index", 0.021), ("ring", -0.021), ("pinky", -0.042))
        for row in (1, 2, 3)
    },
}


@cache
def smpl_bodies() -> dict[str, Skeleton]:
    """Return SMPL's skeletons by name, smallest first, with joints at human44's places in metres."""
    trees = {
        "SMPL body": _BODY,
        "SMPL": _BODY + _MITTENS,
        "SMPL+H": _BODY + _HANDS,
        "SMPL-X": _BODY + _FACE + _HANDS,
    }
    return {name: _body(name, rows) for name, rows in trees.items()}


def _body(name: str, rows: _Rows) -> Skeleton:
    """Build a skeleton of the tree `rows`, with each joint at its place in human44."""
    model = human44()
    places = model.rest[: len(model)]
    joints, parents = [joint for joint, _ in rows], [parent for _, parent in rows]
    stands = [model.index(_PLACE_OF.get(joint, "atlantal" if parent == "head" else joint)) for joint, parent in rows]
    rest = places[stands] + [_DISPLACEMENTS.get(joint, (0.0, 0.0, 0.0)) for joint in joints]
    tips = np.zeros((len(rows), 3))
    for i, joint in enumerate(joints):
        if joint == "head" or not (joint in parents or parents[i] == "head"):
            end = stands[i]
            while below := model.children(end):  # a wrist's fingers come before its thumb
                end = below[0]
            tips[i] = places[end] + model.tips[end] - places[stands[i]]
    above = [joints.index(parent) if parent else -1 for parent in parents]
    offsets = rest - rest[above]
    offsets[0] = 0.0
    return Skeleton(name, tuple(joints), tuple(above), offsets, tips)


def to_smpl(motion: Motion) -> tuple[Skeleton, Floats, Floats]:
    """Bring a motion onto one of SMPL's bodies: its own if it is on one, else SMPL+H.

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
    """Return the SMPL body that movement on a skeleton is brought onto: its own if it is one, else SMPL+H."""
    return _smpl_body_of(skeleton) or smpl_bodies()["SMPL+H"]


def _smpl_body_of(skeleton: Skeleton) -> Skeleton | None:
    """Return the SMPL body with these joints; None if there is none."""
    return next((body for body in smpl_bodies().values() if body.difference(skeleton) is None), None)


def _source(joint: str, skeleton: Skeleton) -> str | None:
    """Return the joint of human23 or human44 whose rotation one of SMPL's takes; None for none, as for a jaw."""
    choices = (_ROTATION_OF.get(joint), _PLACE_OF.get(joint, joint))
    return next((name for name in choices if name in skeleton.names), None)


def joints_without_place(motion: Motion) -> list[str]:
    """Return the names of joints that turn in `motion` but have no counterpart among SMPL's."""
    skeleton = motion.skeleton
    if _smpl_body_of(skeleton):
        return []
    if human44().difference(skeleton) is None:
        kept = {*_PLACE_OF.values(), *_ROTATION_OF.values(), *smpl_bodies()["SMPL+H"].names}
    else:
        kept = set(joint_mapping(skeleton) or skeleton.names)
    turned = rot.angle(motion.rotations, rot.IDENTITY).max(axis=0) > 1e-6
    return [name for name, turns in zip(skeleton.names, turned, strict=True) if turns and name not in kept]
