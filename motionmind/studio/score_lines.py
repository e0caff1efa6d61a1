"""Write a posture as lines of a score: a position for each layer, and the posture that combines them."""

from __future__ import annotations

import re

import numpy as np

from motionmind.body.anatomy import SIDES
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.motion import Posture
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot


def score_lines(posture: Posture, name: str) -> str:
    """Return a posture as lines for a score on the same body.

    Angles are in whole degrees, and the body faces the audience. Legs are given by their angles, not as standing.

    Args:
        posture: the posture.
        name: its name in the score.

    Raises:
        MotionMindError: the body is neither human23 nor human44.
    """
    anatomy = anatomy_of(posture.skeleton)
    if anatomy is None:
        raise MotionMindError(f"scores need the body human23 or human44, not {posture.skeleton.name}")
    word = re.sub(r"[^A-Za-z0-9_]+", "-", name).strip("-") or "mine"
    rotations = posture.rotations.copy()
    rotations[0] = rot.mul(rot.about_vertical(-rot.heading(rotations[0])), rotations[0])
    degrees = np.rint(anatomy.degrees(rotations))

    def terms(joints: tuple[str, ...], side: str) -> str:
        out = []
        for joint in joints:
            row = degrees[anatomy.named(joint, side)]
            values = ((called, angle.sign * row[angle.axis]) for called, angle in anatomy.joints[joint].angles.items())
            if given := " ".join(f"{called} {value:g}" for called, value in values if abs(value) > 0.5):
                out.append(f"{joint} {given}")
        return ", ".join(out) or "neutral"

    lines, cells = [], []
    for layer, joints in anatomy.layers.items():
        sides = [terms(joints, side) for side in (SIDES if anatomy.paired(joints[0]) else SIDES[:1])]
        lines += [layer, f"  {word} = {' / '.join(sides)}"]
        cells.append(f"{word} left")
    return "\n".join([*lines, f"posture {word} = {' | '.join(cells)}", ""])
