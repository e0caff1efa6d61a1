"""Bodies that are nobody's."""

from __future__ import annotations

import numpy as np

from motionmind.body.skeleton import Skeleton


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
