"""Route term of the solve: the root stays near a path drawn over the floor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry.polylines import offsets_to
from motionmind.solver.kinematics import State
from motionmind.solver.system import Normal

PATH_SWAY_M = 0.03  # a body sways about its path by this much


@dataclass
class Route:
    """Keep the root within PATH_SWAY_M of a path, seen from above; when it gets where is free.

    Attributes:
        points: points x, z of the path [P, 2], metres.
        sd: standard deviation of the excess distance, metres.
        reach: excess beyond which the pull is constant, metres.
    """

    unit: ClassVar[str] = ""

    points: Floats
    sd: float
    reach: float

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        off = offsets_to(self.points, state.root[:, [0, 2]])
        far = np.linalg.norm(off, axis=1)
        beyond = np.maximum(far - PATH_SWAY_M, 0.0)
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
