"""Balance of a centre of mass over its support."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.jit import jit

WALKING_MPS = 0.5  # a body that travels faster falls from foot to foot, as walkers do


def walks(root: Floats, fps: float) -> bool:
    """Return whether a body travels too fast to balance over each foot, from its root's positions [N, 3], metres."""
    return bool(np.linalg.norm((root[-1] - root[0])[[0, 2]]) * fps > WALKING_MPS * (len(root) - 1))


def is_beyond(points: Floats, touches: Bools, centre: Floats, overhang: float) -> Bools:
    """Return whether a centre of mass is more than `overhang` beyond its support in each frame [N].

    Args:
        points: level positions of the body's points [N, P, 2], metres.
        touches: whether each bears the body on the floor [N, P].
        centre: level position of the centre of mass [N, 2], metres.
        overhang: allowed distance from the support, metres.
    """
    return np.asarray(np.linalg.norm(centre - nearest_in_support(points, touches, centre), axis=1) > overhang)


def falls_without(points: Floats, low: Bools, feet: Bools, centre: Floats, overhang: float) -> Floats:
    """Return the degree to which a body would fall without each foot [N, feet]: 0 if balanced, 1 if it surely falls.

    Args:
        points: level positions of the body's points [N, P, 2], metres.
        low: whether each would bear the body if all feet stood [N, P].
        feet: whether each belongs to each foot [feet, P].
        centre: level position of the centre of mass [N, 2], metres.
        overhang: allowed distance from the support, metres.
    """
    out = np.zeros((len(centre), len(feet)))
    for number, own in enumerate(feet):
        far = np.linalg.norm(centre - nearest_in_support(points, low & ~own, centre), axis=1)
        out[:, number] = np.clip((far - overhang) / 0.1, 0.0, 1.0)  # surely at 0.1 m
    return out


def nearest_in_support(points: Floats, touches: Bools, wanted: Floats) -> Floats:
    """Return the point of each support nearest to a wanted point [N, 2]; the wanted point itself without a support.

    The support is the convex hull of the points that touch the floor. For a point outside it, the nearest point lies on
    a segment between two of them. From a point inside, their directions leave no gap of half a turn.

    Args:
        points: level positions of points on the floor [N, P, 2], metres.
        touches: whether each bears the body [N, P].
        wanted: level positions [N, 2], metres.
    """
    # Contiguous, because each memory layout would be compiled anew.
    return _nearest_in_support(np.ascontiguousarray(points), touches, np.ascontiguousarray(wanted))


@jit
def _nearest_in_support(points: Floats, touches: Bools, wanted: Floats) -> Floats:
    out = wanted.copy()
    angles, chosen = np.empty(points.shape[1]), np.empty(points.shape[1], np.int64)
    for t in range(len(points)):
        count = 0
        for i in range(points.shape[1]):
            if touches[t, i]:
                chosen[count] = i
                angles[count] = np.arctan2(points[t, i, 1] - wanted[t, 1], points[t, i, 0] - wanted[t, 0])
                count += 1
        if count > 2:
            angles[:count].sort()
            gap = angles[0] + 2.0 * np.pi - angles[count - 1]
            for i in range(1, count):
                gap = max(gap, angles[i] - angles[i - 1])
            if gap < np.pi:
                continue
        best = np.inf
        for number in range(count):
            i = chosen[number]
            dx, dy = points[t, i, 0] - wanted[t, 0], points[t, i, 1] - wanted[t, 1]
            for j in chosen[: number + 1]:
                ex, ey = points[t, j, 0] - points[t, i, 0], points[t, j, 1] - points[t, i, 1]
                length = ex * ex + ey * ey
                share = 0.0 if length < 1e-12 else min(max(-(dx * ex + dy * ey) / length, 0.0), 1.0)
                x, y = dx + share * ex, dy + share * ey
                if x * x + y * y < best:
                    best = x * x + y * y
                    out[t, 0], out[t, 1] = wanted[t, 0] + x, wanted[t, 1] + y
    return out
