"""Everyday words for parts of the body, for messages: which joints of human23 move a hand, a foot, the head."""

from __future__ import annotations

from collections.abc import Iterable

from motionmind.errors import suggestion

_SIDES = "left_", "right_"
_JOINTS = {
    "hand": ("wrist", "fingers"),
    "finger": ("fingers",),
    "thumb": ("fingers",),
    "forearm": ("elbow",),
    "arm": ("shoulder", "elbow"),
    "upper_arm": ("shoulder",),
    "collar": ("clavicle",),
    "foot": ("ankle", "toes"),
    "toe": ("toes",),
    "heel": ("ankle",),
    "shin": ("knee",),
    "calf": ("knee",),
    "leg": ("hip", "knee"),
    "thigh": ("hip",),
    "head": ("atlantal",),
    "neck": ("cervical",),
    "chest": ("thorax",),
    "torso": ("thorax", "lumbar"),
    "spine": ("lumbar", "thorax"),
    "back": ("lumbar", "thorax"),
    "waist": ("lumbar",),
    "hips": ("hip", "pelvis"),
    "root": ("pelvis",),
}


def suggest_joint(name: str, known: Iterable[str], otherwise: str = "there are") -> str:
    """Return '; did you mean left_wrist or left_fingers?' for "left_hand"; else as `motionmind.errors.suggestion`.

    Args:
        name: the name that no joint has.
        known: the names that there are.
        otherwise: the words before them, if none is meant.
    """
    known = list(known)
    side, part = next(((side, name.removeprefix(side)) for side in _SIDES if name.startswith(side)), ("", name))
    sides = (side,) if side else ("", *_SIDES)
    meant = (f"{side}{joint}" for joint in _JOINTS.get(part, ()) for side in sides)
    there = [joint for joint in meant if joint in known]
    return f"; did you mean {' or '.join(there)}?" if there else suggestion(name, known, otherwise)
