"""Baselines for chaotic reordering: shuffles, Dabby's mapping, Cunningham's quadrants.

Indices are those of a piece's postures, as in `motionmind.chaos.reorder`.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from motionmind._typing import Floats, Ints
from motionmind.body.limbs import sided_parts
from motionmind.body.skeleton import Skeleton
from motionmind.chaos.reorder import check_sites, runs
from motionmind.errors import MotionMindError


def shuffled(count: int, rng: Generator) -> Ints:
    """Return `count` postures in random order [N], drawn uniformly from all permutations."""
    return np.asarray(rng.permutation(count), dtype=np.int64)


def chunk_shuffled(lengths: Ints, rng: Generator) -> Ints:
    """Cut a piece of N postures into chunks and put these in random order.

    With the lengths of a variation's runs, the result keeps as much of the piece's order as the variation, in stretches
    as long. The lengths, and so the cuts, are in random order. No chunk follows its predecessor in the piece, so `runs`
    returns the lengths again. The distribution is uniform over all such orders.

    Args:
        lengths: lengths of the chunks [R], which add up to N.
        rng: the random generator.

    Returns:
        Indices of postures [N].

    Raises:
        MotionMindError: a length is less than 1.
    """
    lengths = np.asarray(lengths, dtype=np.int64)
    if np.any(lengths < 1):
        raise MotionMindError(f"a chunk needs 1 posture or more, not {lengths.min()}")
    cuts = np.cumsum(rng.permutation(lengths))
    order = rng.permutation(len(lengths))
    while len(lengths) > 1 and len(runs(order)) < len(lengths):  # about one order in e has no succession
        order = rng.permutation(len(lengths))
    chunks = np.split(np.arange(lengths.sum()), cuts[:-1]) if len(lengths) else []
    return np.concatenate([*(chunks[chunk] for chunk in order), np.zeros(0, dtype=np.int64)])


def dabby(sites: Floats, points: Floats) -> Ints:
    """Map each point to the site with the smallest first coordinate that is not less than the point's.

    This is the mapping of Dabby, "Musical variations from a chaotic mapping", Chaos 6:95 (1996), which leaves points
    past the largest site open; here they map to that site. Of equal sites the one with the lowest index counts.

    Args:
        sites: [N, d], in the flow's coordinates.
        points: [L, d].

    Returns:
        Indices of sites [L].

    Raises:
        MotionMindError: there is no site, or sites and points are not finite numbers of the same dimension.
    """
    sites, points = check_sites(sites, points)
    order = np.argsort(sites[:, 0], kind="stable")
    ascending = sites[order, 0]
    place = np.searchsorted(ascending, np.minimum(points[:, 0], ascending[-1]), side="left")
    return np.asarray(order[place], dtype=np.int64)


def quadrants(skeleton: Skeleton, count: int, rng: Generator) -> Ints:
    """Shuffle the postures of each body part separately, after Merce Cunningham.

    Every body part (see `sided_parts`) has a random order of its own; its joints stay together.

    Args:
        skeleton: the body, J joints.
        count: postures of the piece, N.
        rng: the random generator.

    Returns:
        The posture that gives each joint's rotation [N, J].
    """
    indices = np.empty((count, len(skeleton)), dtype=np.int64)
    for joints in sided_parts(skeleton).values():
        indices[:, joints] = shuffled(count, rng)[:, None]
    return indices
