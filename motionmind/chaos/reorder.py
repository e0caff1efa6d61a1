"""Chaotic reordering: wrap a piece around an attractor, and read it along another trajectory.

The piece's N postures lie along a trajectory x, one at each point: its *sites*. A second trajectory y takes at its n-th
point the posture of the nearest site, in whose Voronoi cell it lies:

    index[n] = argmin over i of |x[i] - y[n]|.

The same trajectory returns the piece. One that begins nearby follows the piece until the two diverge, at the rate of
the flow's largest Lyapunov exponent, and then jumps from stretch to stretch of it.

Source: Bradley and Stuart, "Using chaos to generate variations on movement sequences", Chaos 8:800 (1998).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionmind._typing import Floats, Ints
from motionmind.chaos.flows import Flow
from motionmind.chaos.trajectories import trajectory
from motionmind.errors import MotionMindError


@dataclass(frozen=True, eq=False)
class Itinerary:
    """A reordering of a piece, and the trajectories that it comes from.

    Attributes:
        sites: the sites of the piece's postures [N, d], in the flow's coordinates.
        points: the variation's trajectory [L, d].
        indices: the posture of the piece at each point [L].
    """

    sites: Floats
    points: Floats
    indices: Ints


def itinerary(
    flow: Flow,
    count: int,
    length: int | None = None,
    *,
    nudge: ArrayLike = 0.0,
    start: ArrayLike | None = None,
    every: int = 11,
    step: float | None = None,
    transient: int | None = None,
) -> Itinerary:
    """Reorder a piece along a trajectory that begins near its own.

    The nudge is added to the first point of the piece's own trajectory, after the transient. So the variation begins
    with the piece's first postures and leaves them gradually, the later the smaller the nudge. A nudge before the
    transient would lead to an unrelated trajectory on the attractor; for that, call `trajectory` with another start,
    and `reorder`.

    Args:
        flow: the flow.
        count: postures of the piece, N.
        length: postures of the variation, L; None for as many as the piece has.
        nudge: the offset of the first point, in the flow's own coordinates [d]; a number is for the first of them.
        start: see `trajectory`, as for `every`, `step` and `transient`.

    Raises:
        MotionMindError: an argument is out of range, or a trajectory diverges or settles.
    """
    sites = trajectory(flow, start, count=count, every=every, step=step, transient=transient)
    try:
        nudge = np.asarray(nudge, dtype=np.float64)
    except (TypeError, ValueError):
        raise MotionMindError(f"nudge must be a number, or one for each coordinate, not {nudge!r}") from None
    offset = nudge * np.eye(1, sites.shape[1])[0] if nudge.ndim == 0 else nudge
    if offset.shape != sites[0].shape or not np.isfinite(offset).all():
        raise MotionMindError(f"nudge in {flow.name} must be a finite number or {sites.shape[1]} of them, not {nudge}")
    length = count if length is None else length
    try:
        points = trajectory(flow, sites[0] + offset, count=length, every=every, step=step, transient=0)
    except MotionMindError as error:
        raise MotionMindError(f"nudged by {', '.join(f'{x:g}' for x in offset)}: {error}") from error
    return Itinerary(sites, points, reorder(sites, points))


def reorder(sites: Floats, points: Floats) -> Ints:
    """Map each point to the nearest site; of equally near sites to the one with the lowest index.

    Args:
        sites: [N, d].
        points: [L, d].

    Returns:
        Indices of sites [L].

    Raises:
        MotionMindError: there is no site, or sites and points are not finite numbers of the same dimension.
    """
    sites, points = check_sites(sites, points)
    from scipy.spatial import cKDTree

    # The first of coinciding sites stands for all; if all first coordinates differ, no sites coincide.
    labels = np.arange(len(sites))
    if len(np.unique(sites[:, 0])) < len(sites):
        labels = np.sort(np.unique(sites, axis=0, return_index=True)[1])
    tree = cKDTree(sites[labels], balanced_tree=False, compact_nodes=False)
    if len(labels) == 1:
        return np.full(len(points), labels[0], dtype=np.int64)
    # Points near each other search the same part of the tree: this order takes half the time.
    order = cKDTree(points, leafsize=64, balanced_tree=False, compact_nodes=False).indices
    distances, found = tree.query(points[order], k=2)
    indices = np.empty(len(points), dtype=np.int64)
    indices[order] = labels[found[:, 0]]
    margin = 1.0 + 1e-12  # where two distances differ by less, the nearer site is found exactly
    tied = distances[:, 1] <= distances[:, 0] * margin
    for n, reach in zip(order[tied], distances[tied, 1], strict=True):
        near = np.sort(labels[tree.query_ball_point(points[n], reach * margin)])
        indices[n] = near[np.argmin(np.sum((sites[near] - points[n]) ** 2, axis=1))]
    return indices


def check_sites(sites: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return sites [N, d] and points [L, d] as checked arrays.

    Raises:
        MotionMindError: there is no site, or sites and points are not finite numbers of the same dimension.
    """
    sites, points = np.asarray(sites, dtype=np.float64), np.asarray(points, dtype=np.float64)
    if sites.ndim != 2 or points.ndim != 2 or sites.shape[1] != points.shape[1] or sites.size == 0:
        raise MotionMindError(
            f"points of shape {list(points.shape)} cannot be compared with sites of shape {list(sites.shape)}: "
            "sites must be [N, d], one or more, and points [L, d]"
        )
    limit = 1e150  # beyond it squares of distances overflow
    if not (np.abs(sites) < limit).all() or not (np.abs(points) < limit).all():
        raise MotionMindError(f"sites and points must be finite numbers below {limit:g}")
    return sites, points


def runs(indices: Ints) -> Ints:
    """Return the lengths [R] of the stretches that keep the piece's order: i, i + 1, i + 2 and so on.

    Args:
        indices: postures of the piece [L]; the lengths add up to L.
    """
    indices = np.asarray(indices)
    broken = np.flatnonzero(np.diff(indices) != 1) + 1
    return np.diff(np.concatenate([[0], broken, [len(indices)]]) if len(indices) else np.zeros(1, dtype=np.int64))
