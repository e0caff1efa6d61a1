"""The point of a support that is nearest to another: supports are the hulls of points on the floor."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.jit import jit


@jit
def nearest_in_support(points: Floats, bears: Bools, wanted: Floats) -> Floats:
    """Return the point [N, 2] of each support that is nearest to a wanted one [N, 2]; that itself where none bears.

    The support is the convex hull of the points that bear. A point outside of it is nearest to one of the segments
    between two of them; one inside sees them all around itself, with no gap of half a turn.

    Args:
        points: level places of points on the floor [N, P, 2], metres.
        bears: which of them bear the body [N, P].
        wanted: level places [N, 2], metres.
    """
    out = wanted.copy()
    angles = np.empty(points.shape[1])
    for t in range(len(points)):
        count = 0
        best = np.inf
        for i in range(points.shape[1]):
            if not bears[t, i]:
                continue
            dx, dy = points[t, i, 0] - wanted[t, 0], points[t, i, 1] - wanted[t, 1]
            angles[count] = np.arctan2(dy, dx)
            count += 1
            for j in range(i + 1):
                if not bears[t, j]:
                    continue
                ex, ey = points[t, j, 0] - points[t, i, 0], points[t, j, 1] - points[t, i, 1]
                length = ex * ex + ey * ey
                share = 0.0 if length < 1e-12 else min(max(-(dx * ex + dy * ey) / length, 0.0), 1.0)
                x, y = dx + share * ex, dy + share * ey
                if x * x + y * y < best:
                    best = x * x + y * y
                    out[t, 0], out[t, 1] = wanted[t, 0] + x, wanted[t, 1] + y
        if count > 2:
            angles[:count].sort()
            gap = angles[0] + 2.0 * np.pi - angles[count - 1]
            for i in range(1, count):
                gap = max(gap, angles[i] - angles[i - 1])
            if gap < np.pi:
                out[t] = wanted[t]
    return out
