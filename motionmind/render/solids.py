"""Round cones and ellipsoids, their bounds and volumes; no bodies, no pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Floats

EMPTY_CODE = -1  # the number in a pixel without a solid


@dataclass(frozen=True, eq=False)
class Cones:
    """Round cones: each is the union of all balls whose centres and radii lie between those of two end balls.

    Attributes:
        a, b: centres of the end balls [..., N, 3], metres.
        a_radius, b_radius: their radii [N], metres.
    """

    a: Floats
    b: Floats
    a_radius: Floats
    b_radius: Floats

    def bounds(self) -> Floats:
        """Compute the least and greatest coordinates of each [2, ..., N, 3], metres."""
        a, b = self.a_radius[:, None], self.b_radius[:, None]
        return np.stack([np.minimum(self.a - a, self.b - b), np.maximum(self.a + a, self.b + b)])

    def volumes(self) -> Floats:
        """Approximate the volumes [..., N], cubic metres: the cone between the centres, and half of each end ball."""
        a, b = self.a_radius, self.b_radius
        length = np.linalg.norm(self.b - self.a, axis=-1)
        return np.asarray(np.pi / 3.0 * (a * a + a * b + b * b) * length + 2.0 / 3.0 * np.pi * (a**3 + b**3))


@dataclass(frozen=True, eq=False)
class Ellipsoids:
    """Ellipsoids.

    Attributes:
        centre: centres [..., N, 3], metres.
        axes: half axes as columns [..., N, 3, 3], metres.
    """

    centre: Floats
    axes: Floats

    def bounds(self) -> Floats:
        """Compute the least and greatest coordinates of each [2, ..., N, 3], metres."""
        half = np.linalg.norm(self.axes, axis=-1)
        return np.stack([self.centre - half, self.centre + half])

    def joined(self, others: Ellipsoids) -> Ellipsoids:
        """Append other ellipsoids, along the axis N."""
        return Ellipsoids(
            np.concatenate([self.centre, others.centre], axis=-2), np.concatenate([self.axes, others.axes], axis=-3)
        )

    def volumes(self) -> Floats:
        """Compute the volumes [..., N], cubic metres."""
        return np.asarray(4.0 / 3.0 * np.pi * np.abs(np.linalg.det(self.axes)))


def bounding_box(cones: Cones, balls: Ellipsoids) -> Floats:
    """Compute the least and greatest coordinates of solids [..., N, 3] taken together [..., 2, 3], metres."""
    low, high = np.concatenate([cones.bounds(), balls.bounds()], axis=-2)
    return np.stack([low.min(axis=-2), high.max(axis=-2)], axis=-2)


def posture_solids(cones: Cones, balls: Ellipsoids, posture: int) -> tuple[Cones, Ellipsoids]:
    """Select the solids [N, 3] of one posture from those of several [P, N, 3], by its index."""
    return (
        Cones(cones.a[posture], cones.b[posture], cones.a_radius, cones.b_radius),
        Ellipsoids(balls.centre[posture], balls.axes[posture]),
    )
