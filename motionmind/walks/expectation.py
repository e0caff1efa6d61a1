"""The expectation of walks through a corpus, between two postures: where each joint is, and where the body faces.

The search takes it as its guide, before any path is known; the motion takes it again, of walks near the path.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline
from motionmind.learned.carriage import Carriage
from motionmind.walks.headings import turn_with_walks
from motionmind.walks.mean_walk import mean_walk
from motionmind.walks.stops import Stop, moments_rates


class Expectation(NamedTuple):
    """The expectation of walks at T moves and midway between them: the half steps.

    Attributes:
        half_steps: times [2 T + 1], seconds.
        poses: orientations of the joints [2 T + 1, J, 4], without the body's turning where facing is free.
        headings: where the body faces [2 T + 1], radians.
        moments: probabilities of moments of the corpus [2 T + 1, n].
        moves: probabilities of moves of the corpus in each half step [2 T, m].
        trust: how far each joint is trusted to the walks in each half step [2 T, J], from 0 to 1.
        of_moments: which of the corpus's moments are meant [n]; all of them where they are a slice.
        of_moves: which of its moves are meant [m]; all of them where they are a slice.
        left_out: share of walks whose ends others stand for (`motionmind.walks.mean_walk.MeanWalk`).
    """

    half_steps: Floats
    poses: Floats
    headings: Floats
    moments: Floats
    moves: Floats
    trust: Floats
    of_moments: Ints | slice = slice(None)
    of_moves: Ints | slice = slice(None)
    left_out: float = 0.0

    def chains(self, corpus: Corpus, at: Floats) -> Floats:
        """Return orientations of the chains [K, L, 4] at some times [K]: a C2 curve through those of the half steps."""
        out = rotation_spline(self.half_steps, self.poses, at)
        if corpus.facing == "free":
            turn = rot.about_vertical(natural_spline(self.half_steps, self.headings, at))
            out = np.concatenate([out, turn[:, None]], axis=1)
        return out


def expect(
    corpus: Corpus,
    carriage: Carriage,
    stops: Mapping[int, Stop],
    half_steps: Floats,
    path: Floats | None = None,
    near: bool = False,
) -> Expectation:
    """Return what walks through a corpus expect between the stops.

    Args:
        corpus: the movement that was learned from.
        carriage: how its bodies hold themselves, travel and stand.
        stops: what is passed exactly, by the number of moves that lead there; increasing, with the first and the last.
        half_steps: times of the moves and midway between them [2 T + 1], seconds.
        path: orientations of the joints at the moves that walks are to be near to [T + 1, J, 4]; None for all walks.
        near: whether the body turns the near way, whatever walks do (`turn_with_walks`): where the time is what the
            corpus takes for that.
    """
    moving = any(stop.rates is not None for stop in stops.values())
    rates = partial(moments_rates, corpus, carriage) if moving else None
    walk = mean_walk(corpus.skeleton, carriage, rates, stops, half_steps, path)
    # Each half step leads to the middle of a move or from there.
    middles, of = _middles(walk.of, len(carriage.weights), len(carriage.turn))
    moves = walk.moments[:-1, middles] + walk.moments[1:, middles]
    moves /= moves.sum(axis=1, keepdims=True)
    if corpus.facing == "free":
        first, *_, last = stops.values()
        ends = tuple(None if stop.rates is None else float(stop.rates.turn) for stop in (first, last))
        facing = {move: stop.chains[-1] for move, stop in stops.items()}
        turned = carriage.turn[of]
        turn, spread = moves @ turned, moves @ turned**2
        lasts = float(carriage.trust.lasts[0])
        headings = turn_with_walks(turn, spread, walk.trust[:, 0], half_steps, facing, (ends[0], ends[1]), near, lasts)
    else:
        headings = rot.heading(walk.poses[:, 0])
    return Expectation(half_steps, walk.poses, headings, walk.moments, moves, walk.trust, walk.of, of, walk.left_out)


def _middles(moments: Ints | slice, count: int, moves: int) -> tuple[Ints | slice, Ints | slice]:
    """Return which of some moments are middles of moves, and of which moves, of a corpus with `count` moments."""
    if isinstance(moments, slice):
        return slice(count - moves, None), moments
    middles = np.flatnonzero(moments >= count - moves)
    return middles, moments[middles] - (count - moves)
