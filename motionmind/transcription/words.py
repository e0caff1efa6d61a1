"""Describe positions of body parts: the names that a transcription gives them."""

from __future__ import annotations

from collections.abc import Container
from itertools import chain, count

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import Anatomy

# A part's line, from the joint at its root to the joint or tip at its end; and the joint whose bend is named.
LINES = {
    "legs": ("hip", "ankle", "knee"),
    "arms": ("shoulder", "wrist", "elbow"),
    "torso": ("pelvis", "cervical", ""),
    "head": ("cervical", "atlantal_tip", ""),
}
PLANTED = "on"  # the position of a leg that bears weight
OPEN = "MOVE"  # the open words of phrases: MOVE-2 is the move to the second posture
BENT_DEG = 50.0  # a knee or elbow that bends by more is named
TRUNK_TURNED_DEG = 20.0  # a trunk or head that turns by more is named
UPRIGHT_DEG = 15.0  # a trunk or head that leans by less is upright
DEEP_DEG = 67.5  # beyond, it is nearer to level than to the diagonal
SECTOR_DEG = 45.0  # directions and levels are those of Labanotation: 45 degrees each

_AROUND = ("front", "front-out", "out", "back-out", "back", "back-across", "across", "front-across")
_LEVELS = ("down", "low", "middle", "high", "up")


def limb_word(direction: Floats, bend: float) -> str:
    """Name where a limb points: `front-high`, `out-middle-bent`, `down`.

    Args:
        direction: unit vector along the limb [3]: x outward, y up, z ahead.
        bend: flexion of its knee or elbow, degrees.

    >>> limb_word(np.array([1.0, 0.0, 0.0]), 10.0)
    'out-middle'
    """
    rise = float(np.degrees(np.arcsin(np.clip(direction[1], -1.0, 1.0))))
    level = _LEVELS[int(np.clip(np.round(rise / SECTOR_DEG), -2, 2)) + 2]
    around = _AROUND[round(float(np.degrees(np.arctan2(direction[0], direction[2]))) / SECTOR_DEG) % 8]
    word = level if level in ("down", "up") else f"{around}-{level}"
    return f"{word}-bent" if bend > BENT_DEG else word


def trunk_word(direction: Floats, turn: float) -> str:
    """Name how a trunk or head is held, in the frame that the body faces in: `upright`, `forward-turned`, `aside`.

    Args:
        direction: unit vector along it [3]: x to the left, y up, z ahead.
        turn: its turn about its length, degrees.
    """
    lean = float(np.degrees(np.arccos(np.clip(direction[1], -1.0, 1.0))))
    word = "upright"
    if lean > UPRIGHT_DEG:
        across, along = abs(float(direction[0])), float(direction[2])
        word = ("forward" if along > 0.0 else "back") if abs(along) > across else "aside"
        word += "-deep" if lean > DEEP_DEG else ""
    return f"{word}-turned" if abs(turn) > TRUNK_TURNED_DEG else word


def angle_terms(body: Anatomy, layer: str, degrees: dict[str, Floats]) -> str:
    """Write the angles of a layer's joints as a score does: `hip flexion 20 rotation -5, knee flexion 30`.

    Args:
        body: the anatomy.
        layer: the layer.
        degrees: angles of its joints [3] about x, y and z, by their names without a side.

    Returns:
        The terms; `neutral` if all angles are 0.
    """
    terms = []
    for joint in body.layers[layer]:
        parts = [joint]
        for word, angle in body.joints[joint].angles.items():
            value = angle.sign * float(degrees[joint][angle.axis])
            if value:
                parts.append(
                    f"{word if value > 0 or not angle.opposite else angle.opposite} {_plain(value, angle.opposite)}"
                )
        if len(parts) > 1:
            terms.append(" ".join(parts))
    return ", ".join(terms) or "neutral"


def free_name(word: str, taken: Container[str]) -> str:
    """Return a word, with the least number from 2 on if it is taken."""
    return next(name for name in chain([word], (f"{word}-{number}" for number in count(2))) if name not in taken)


def _plain(value: float, opposite: str) -> str:
    """Write a number of degrees; without its sign if the opposite angle's name says it."""
    return f"{abs(value) if opposite else value:g}"
