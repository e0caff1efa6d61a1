"""Balance: whether a centre of mass is over its support, and where a support is nearest to it."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.jit import jit

DEEP = 0.1  # metres beyond what is allowed at which a body surely falls
WALKS = 0.5  # metres a second: a body that travels faster falls from foot to foot, as walkers do


def walks(root: Floats, fps: float) -> bool:
    """Return whether a body travels so fast that it is never to stand still over a foot: positions [N, 3], metres."""
    return bool(np.linalg.norm((root[-1] - root[0])[[0, 2]]) * fps > WALKS * (len(root) - 1))


def is_beyond(points: Floats, touches: Bools, centre: Floats, overhang: float) -> Bools:
    """Return where a centre of mass is farther beyond its support than it may be [N].

    Args:
        points: level places of points of the body [N, P, 2], metres.
        touches: which of them bear the body on the floor [N, P].
        centre: level place of the centre of mass [N, 2], metres.
        overhang: how far beyond the support it may be, metres.
    """
    return np.asarray(np.linalg.norm(centre - nearest_in_support(points, touches, centre), axis=1) > overhang)


def falls_without(points: Floats, low: Bools, feet: Bools, centre: Floats, overhang: float) -> Floats:
    """Return how far a body would fall without each foot [N, feet], from 0 to 1 where it surely falls.

    Args:
        points: level places of points of the body [N, P, 2], metres.
        low: which of them would bear it if all its feet stood [N, P].
        feet: which of them are each foot's [feet, P].
        centre: level place of the centre of mass [N, 2], metres.
        overhang: how far beyond its support that may be, metres.
    """
    out = np.zeros((len(centre), len(feet)))
    for number, own in enumerate(feet):
        far = np.linalg.norm(centre - nearest_in_support(points, low & ~own, centre), axis=1)
        out[:, number] = np.clip((far - overhang) / DEEP, 0.0, 1.0)
    return out


def nearest_in_support(points: Floats, touches: Bools, wanted: Floats) -> Floats:
    """Return the point [N, 2] of each support that is nearest to a wanted one [N, 2]; that itself where none bears.

    The support is the convex hull of the points that touch the floor. A point outside of it is nearest to one of the
    segments between two of them; one inside sees them all around itself, with no gap of half a turn.

    Args:
        points: level places of points on the floor [N, P, 2], metres.
        touches: which of them bear the body [N, P].
        wanted: level places [N, 2], metres.
    """
    # The same order in memory, whoever asks, or it would be compiled for each.
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
