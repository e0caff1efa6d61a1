"""What a chaotic reordering is to be held against: shuffles, Dabby's mapping, Cunningham's quadrants.

Indices are those of a piece's postures, as in `motionmind.chaos.reorder`.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from motionmind._typing import Floats, Ints
from motionmind.body.limbs import sided_parts
from motionmind.body.skeleton import Skeleton
from motionmind.chaos.reorder import checked, runs
from motionmind.errors import MotionMindError


def shuffled(count: int, rng: Generator) -> Ints:
    """The piece's postures in random order [N]: every permutation is as likely."""
    return np.asarray(rng.permutation(count), dtype=np.int64)


def chunk_shuffled(lengths: Ints, rng: Generator) -> Ints:
    """The piece cut into chunks of the given lengths [R], which add up to N, and the chunks put in random order [N].

    With the runs of a variation it keeps as much of the piece's order, in stretches as long, and nothing else of the
    variation. Where the piece is cut is random too, as the lengths are taken in random order; and no chunk follows the
    one that it follows in the piece, so that `runs` are those lengths again. All such orders are as likely.

    Raises:
        MotionMindError: a length is less than 1.
    """
    lengths = np.asarray(lengths, dtype=np.int64)
    if np.any(lengths < 1):
        raise MotionMindError(f"a chunk has 1 posture at least, not {lengths.min()}")
    cuts = np.cumsum(rng.permutation(lengths))
    order = rng.permutation(len(lengths))
    while len(lengths) > 1 and len(runs(order)) < len(lengths):  # about one in e is without a succession
        order = rng.permutation(len(lengths))
    chunks = np.split(np.arange(lengths.sum()), cuts[:-1]) if len(lengths) else []
    return np.concatenate([*(chunks[chunk] for chunk in order), np.zeros(0, dtype=np.int64)])


def dabby(sites: Floats, points: Floats) -> Ints:
    """Index [L] of the site [N, d] with the smallest first coordinate that is not less than the point's [L, d].

    That is Dabby's mapping; what comes past the largest it leaves open, and here it is the site with the largest. Of
    equal sites the one with the lowest index is taken. Source: Dabby, "Musical variations from a chaotic mapping",
    Chaos 6:95 (1996).

    Raises:
        MotionMindError: there is no site, or points and sites are no finite numbers of the same dimension.
    """
    sites, points = checked(sites, points)
    order = np.argsort(sites[:, 0], kind="stable")
    ascending = sites[order, 0]
    place = np.searchsorted(ascending, np.minimum(points[:, 0], ascending[-1]), side="left")
    return np.asarray(order[place], dtype=np.int64)


def quadrants(skeleton: Skeleton, count: int, rng: Generator) -> Ints:
    """Body parts shuffled separately, after Merce Cunningham: the posture that each joint is taken from [N, J].

    Every part (see `sided_parts`) goes through the piece in a random order of its own; its joints stay together.
    """
    indices = np.empty((count, len(skeleton)), dtype=np.int64)
    for joints in sided_parts(skeleton).values():
        indices[:, joints] = shuffled(count, rng)[:, None]
    return indices
