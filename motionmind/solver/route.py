"""Route term of the solve: the root stays near a path over the floor, or near a place at each frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry.polylines import offsets_to
from motionmind.solver.kinematics import State
from motionmind.solver.system import Normal

PATH_SWAY_M = 0.03  # a body sways about its path by this much
COURSE_SWAY_M = 0.06  # about its place at a time: with feet that stand, less bends the trunk


@dataclass
class Route:
    """Keep the root within PATH_SWAY_M of a path, seen from above; when it gets where is free, unless it is timed.

    Attributes:
        points: points x, z of the path [P, 2], metres.
        sd: standard deviation of the excess distance, metres.
        reach: excess beyond which the pull is constant, metres.
        is_timed: whether the points are the places of the root at the frames.
    """

    unit: ClassVar[str] = ""

    points: Floats
    sd: float
    reach: float
    is_timed: bool = False

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        level = state.root[:, [0, 2]]
        off = level - self.points if self.is_timed else offsets_to(self.points, level)
        far = np.linalg.norm(off, axis=1)
        beyond = np.maximum(far - (COURSE_SWAY_M if self.is_timed else PATH_SWAY_M), 0.0)
        eased = np.sqrt(1.0 + (beyond / self.reach) ** 2)
        normal.cost += float(np.sum(2.0 * (self.reach / self.sd) ** 2 * (eased - 1.0)))
        across, weight = off / np.maximum(far, 1e-9)[:, None], (beyond > 0.0) * self.sd**-2.0 / eased
        for i, first in enumerate((0, 2)):
            normal.gradient[:, first] += weight * beyond * across[:, i]
            for k, second in enumerate((0, 2)):
                normal.block(0)[:, first, second] += weight * across[:, i] * across[:, k]

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        return np.zeros(len(state.x))
