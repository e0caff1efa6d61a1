"""Bodies that are nobody's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot


def ant() -> Skeleton:
    """Six legs of two joints, 2 cm across."""
    names, parents, offsets, tips = ["body"], [-1], [[0.0, 0.0, 0.0]], [[0.0, 0.0, -0.008]]
    for side, out in (("left", 1.0), ("right", -1.0)):
        for row, z in (("front", 0.003), ("mid", 0.0), ("hind", -0.003)):
            parents += [0, len(names)]
            names += [f"{side}_{row}_femur", f"{side}_{row}_tibia"]
            offsets += [[0.002 * out, 0.0, z], [0.005 * out, 0.003, z]]
            tips += [[0.0, 0.0, 0.0], [0.003 * out, -0.009, z]]
    return Skeleton("ant", tuple(names), tuple(parents), np.array(offsets), np.array(tips))


def insect() -> Skeleton:
    """A thorax, a head, and six legs of two joints."""
    names, parents, offsets = ["thorax", "head"], [-1, 0], [(0.0, 0.0, 0.0), (0.0, 0.0, 0.01)]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for z, where in ((0.008, "front"), (0.0, "middle"), (-0.008, "hind")):
            names += [f"{side}_{where}_coxa", f"{side}_{where}_tibia"]
            parents += [0, len(names) - 2]
            offsets += [(sign * 0.004, 0.0, z), (sign * 0.01, 0.004, 0.0)]
    tips = np.zeros((len(names), 3))
    tips[3::2] = [(x, -0.012, 0.0) for x in (0.006,) * 3 + (-0.006,) * 3]
    return Skeleton("insect", tuple(names), tuple(parents), np.array(offsets), tips)


CONVENTIONS: dict[str, tuple[Callable[[str], str], Callable[[str], str]]] = {
    "words in front": (lambda j: f"left_{j}", lambda j: f"right_{j}"),
    "camel case": (lambda j: f"Left{j.title()}", lambda j: f"Right{j.title()}"),
    "namespace": (lambda j: f"rig:Left{j.title()}", lambda j: f"rig:Right{j.title()}"),
    "capitals": (lambda j: f"{j.upper()}_LEFT", lambda j: f"{j.upper()}_RIGHT"),
    "small letters in front": (lambda j: f"l{j}", lambda j: f"r{j}"),
    "great letters in front": (lambda j: f"L{j.title()}Joint", lambda j: f"R{j.title()}Joint"),
    "suffix of Blender": (lambda j: f"{j}.L", lambda j: f"{j}.R"),
    "numbered": (lambda j: f"{j}.L.001", lambda j: f"{j}.R.001"),
    "underscore": (lambda j: f"{j}_l", lambda j: f"{j}_r"),
    "suffix": (lambda j: f"{j}L", lambda j: f"{j}R"),
    "between": (lambda j: f"Bip01 L {j}", lambda j: f"Bip01 R {j}"),
}


def renamed(convention: str) -> Skeleton:
    """human23 with other names for its sides; most say nothing to those who know rigs."""
    left, right = CONVENTIONS[convention]
    names = []
    for name in human23().names:
        side, _, joint = name.partition("_")
        names.append(left(joint) if side == "left" else right(joint) if side == "right" else f"mid{name}")
    return replace(human23(), name=convention, names=tuple(names))


def tumble(skeleton: Skeleton, seed: int, frames: int = 3) -> Motion:
    rng = np.random.default_rng(seed)
    q = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    return Motion(skeleton, q, rng.normal(size=(frames, 3)), np.arange(frames) * 0.1, "tumble")
