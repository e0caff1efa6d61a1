"""Whether a posture stands in balance: its centre of mass, and the area that the standing soles support."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.contact import contact_points
from motionmind.body.motion import Posture
from motionmind.body.support import centre_of_mass, overhang, size_of
from motionmind.studio.reach import standing_soles

HALF_WIDTH_M = 0.035  # of a foot of a body of human size, whose points are along its middle
_AROUND = np.stack([np.cos(turn := np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)), np.sin(turn)], axis=1)


class Balance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The balance of a posture, metres.

    Attributes:
        mass: the centre of mass.
        support: corners x, z of the area that the standing soles support, in order; empty in the air.
        outside: distance of the centre of mass from that area, seen from above: 0 over it, None in the air.
    """

    mass: tuple[float, float, float]
    support: list[tuple[float, float]]
    outside: float | None


def balance_of(posture: Posture) -> Balance | None:
    """Return the balance of a posture; None if the masses of its body are not known."""
    mass = centre_of_mass(posture.skeleton, posture.rotations, posture.root)
    if mass is None:
        return None
    soles = standing_soles(posture)
    middle = contact_points(posture.skeleton, posture.rotations, posture.root)[0][soles][:, ::2]
    points = (middle[:, None] + HALF_WIDTH_M * size_of(posture.skeleton) * _AROUND).reshape(-1, 2)
    outside = float(overhang(points[None], np.ones((1, len(points)), dtype=bool), mass[None, ::2])[0])
    x, y, z = mass.tolist()
    return Balance((x, y, z), corners(points), None if math.isnan(outside) else outside)


def corners(points: Floats) -> list[tuple[float, float]]:
    """Return the corners of the convex hull of points [P, 2], in order (Andrew's monotone chain)."""
    ordered = sorted({(float(x), float(z)) for x, z in points})
    if len(ordered) < 3:
        return ordered
    out: list[tuple[float, float]] = []
    for way in (ordered, ordered[::-1]):
        chain: list[tuple[float, float]] = []
        for point in way:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0.0:
                chain.pop()
            chain.append(point)
        out += chain[:-1]
    return out


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Return twice the signed area of a triangle."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
