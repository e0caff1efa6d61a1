"""Polylines on a floor: points [P, 2] joined by straight lines, two points or more."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from motionmind._typing import Floats


def length_of(points: Floats) -> float:
    """Return the length of a polyline [P, 2], metres."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def places_along(points: Floats, shares: Floats) -> Floats:
    """Return the places on a polyline [N, 2], metres, at shares of its length [N], 0 to 1."""
    far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.stack([np.interp(shares * far[-1], far, axis) for axis in points.T], axis=1)


def offsets_to(points: Floats, places: Floats) -> Floats:
    """Return the displacements from the nearest point of a polyline [P, 2] to some places [N, 2]: [N, 2], metres."""
    nearest, least = np.zeros_like(places), np.full(len(places), np.inf)
    for first, last in pairwise(points):
        along, from_first = last - first, places - first
        share = np.clip(from_first @ along / max(float(along @ along), 1e-18), 0.0, 1.0)
        off = from_first - share[:, None] * along
        far = np.linalg.norm(off, axis=1)
        nearest[far < least] = off[far < least]
        least = np.minimum(least, far)
    return nearest
