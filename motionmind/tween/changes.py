"""Describe joints' moves as a viewer sees them: the body part, and the new state's name or the direction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionmind._typing import Floats, Int32s
from motionmind.body.anatomy import Angle
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.limbs import sided_parts
from motionmind.body.mirror import MIDDLE, sides_of
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import FACING
from motionmind.discretize.states import StateSpace
from motionmind.geometry import rotations as rot

WHOLE_BODY = "whole body"
# Nouns for angles whose names in a body's file do not follow "toward".
_NOUNS = {
    "tilt": "forward tilt",
    "back": "backward tilt",
    "rotation": "outward rotation",
    "inward": "inward rotation",
    "plantar": "plantar flexion",
    "dorsal": "dorsiflexion",
    "radial": "radial deviation",
    "ulnar": "ulnar deviation",
}


def name_parts(skeleton: Skeleton, chains: Sequence[str]) -> tuple[str, ...]:
    """Return the body part of each chain [L]: "left arm", "head", or the first joint of a limb without a name.

    The facing turns the whole body.
    """
    anatomy = anatomy_of(skeleton)
    parts: dict[str, str] = {FACING: WHOLE_BODY}
    for part, joints in sided_parts(skeleton).items():
        parts |= {skeleton.names[joint]: part.replace("_", " ") for joint in joints}
    if anatomy is not None:
        for name, side in zip(skeleton.names, sides_of(skeleton), strict=True):
            joint = anatomy.anatomy(name)[0]
            if layer := next((layer for layer, joints in anatomy.layers.items() if joint in joints), ""):
                parts[name] = layer if side == MIDDLE else f"{side} {layer.removesuffix('s')}"
    return tuple(parts[chain] for chain in chains)


def describe_changes(
    space: StateSpace, skeleton: Skeleton, path: Int32s, orientations: Floats
) -> tuple[tuple[str, ...], ...]:
    """Describe each chain's move of a path [T][L]: "to second", "toward flexion", "to the left"; "" where it is still.

    Args:
        space: the states of each chain.
        skeleton: the body.
        path: states [T + 1, L].
        orientations: the states' orientations [T + 1, L, 4].
    """
    anatomy, count = anatomy_of(skeleton), len(skeleton)
    angles = anatomy.degrees(orientations[:, :count]) if anatomy else None
    moves = []
    for move, after in enumerate(path[1:].tolist()):
        words = [""] * len(space)
        for chain in np.flatnonzero(path[move] != path[move + 1]).tolist():
            if space.labels and space.labels[chain]:
                words[chain] = f"to {space.labels[chain][after[chain]]}"
            elif chain >= count:
                turn = rot.log(rot.inv_mul(orientations[move, chain], orientations[move + 1, chain]))[1]
                words[chain] = f"to the {'left' if turn > 0.0 else 'right'}"
            elif angles is not None and anatomy is not None:
                name, joint = anatomy.anatomy(skeleton.names[chain])
                ends = angles[move : move + 2, chain]
                words[chain] = _describe_turn(joint.angles, anatomy.paired(name), *ends)
        moves.append(tuple(words))
    return tuple(moves)


def _describe_turn(angles: dict[str, Angle], is_paired: bool, before: Floats, after: Floats) -> str:
    """Name the direction of the greatest change of a joint's angles about x, y and z, degrees: "toward flexion"."""
    name, angle = max(angles.items(), key=lambda item: abs(after[item[1].axis] - before[item[1].axis]))
    is_positive = angle.sign * (after[angle.axis] - before[angle.axis]) > 0.0
    if angle.opposite or is_paired:
        direction = name if is_positive else angle.opposite or f"less {name}"
        return f"toward {_NOUNS.get(direction, direction)}"
    return f"toward {name} {'left' if is_positive else 'right'}"
