"""Round cones and ellipsoids, and the picture of them in a depth buffer. It knows no bodies.

A depth buffer is taken, and not shapes painted one over another from the farthest on, because limbs that cross or go
through one another have no order: each pixel must be asked on its own which of them is nearer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Floats

EMPTY = -1  # where a pixel shows no solid


@dataclass(frozen=True, eq=False)
class Cones:
    """Round cones: all the balls whose centre and radius lie between those of two balls, as in a limb.

    Attributes:
        a, b: centres of the two balls [..., N, 3], metres.
        a_radius, b_radius: their radii [N], metres.
    """

    a: Floats
    b: Floats
    a_radius: Floats
    b_radius: Floats

    def reach(self) -> Floats:
        """Least and greatest coordinates [2, ..., N, 3]."""
        a, b = self.a_radius[:, None], self.b_radius[:, None]
        return np.stack([np.minimum(self.a - a, self.b - b), np.maximum(self.a + a, self.b + b)])

    def volumes(self) -> Floats:
        """Volumes [..., N] in cubic metres, roughly: the cone between the balls' centres and half of each ball."""
        a, b = self.a_radius, self.b_radius
        length = np.linalg.norm(self.b - self.a, axis=-1)
        return np.asarray(np.pi / 3.0 * (a * a + a * b + b * b) * length + 2.0 / 3.0 * np.pi * (a**3 + b**3))


@dataclass(frozen=True, eq=False)
class Ellipsoids:
    """Ellipsoids.

    Attributes:
        centre: their centres [..., N, 3], metres.
        axes: their half axes as columns [..., N, 3, 3], metres.
    """

    centre: Floats
    axes: Floats

    def reach(self) -> Floats:
        """Least and greatest coordinates [2, ..., N, 3]."""
        half = np.linalg.norm(self.axes, axis=-1)
        return np.stack([self.centre - half, self.centre + half])

    def joined(self, others: Ellipsoids) -> Ellipsoids:
        """These, and then others."""
        return Ellipsoids(
            np.concatenate([self.centre, others.centre], axis=-2), np.concatenate([self.axes, others.axes], axis=-3)
        )

    def volumes(self) -> Floats:
        """Volumes [..., N] in cubic metres."""
        return np.asarray(4.0 / 3.0 * np.pi * np.abs(np.linalg.det(self.axes)))
