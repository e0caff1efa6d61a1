"""The expectation of walks through a corpus between two postures: each joint's orientation, and the heading.

It guides the search before any path is known. Synthesis computes it again, from walks near the path.
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
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.walks.headings import turn_with_walks
from motionmind.walks.mean_walk import mean_walk
from motionmind.walks.stops import Stop, sample_rates


class Expectation(NamedTuple):
    """The expectation of walks at the ends and middles of T moves: the half steps.

    Attributes:
        half_steps: times [2 T + 1], seconds.
        poses: orientations of the joints [2 T + 1, J, 4], without the body's turn where the facing is free.
        headings: heading of the body [2 T + 1], radians.
        samples: probabilities of the corpus's samples [2 T + 1, n].
        moves: probabilities of the corpus's moves in each half step [2 T, m].
        trust: trust in the walks per joint and half step [2 T, J], from 0 to 1.
        of_samples: indices of these samples [n]; a slice means all.
        of_moves: indices of these moves [m]; a slice means all.
        left_out: share of walks whose end samples are represented by others (`motionmind.walks.mean_walk.MeanWalk`).
    """

    half_steps: Floats
    poses: Floats
    headings: Floats
    samples: Floats
    moves: Floats
    trust: Floats
    of_samples: Ints | slice = slice(None)
    of_moves: Ints | slice = slice(None)
    left_out: float = 0.0

    def chains(self, corpus: Corpus, at: Floats) -> Floats:
        """Return orientations of the joint chains [K, L, 4] at times [K], on a C2 curve through the half steps."""
        out = rotation_spline(self.half_steps, self.poses, at)
        if corpus.facing == "free":
            turn = rot.about_vertical(natural_spline(self.half_steps, self.headings, at))
            out = np.concatenate([out, turn[:, None]], axis=1)
        return out


def expect(
    corpus: Corpus,
    statistics: PostureStatistics,
    stops: Mapping[int, Stop],
    half_steps: Floats,
    path: Floats | None = None,
    near: bool = False,
) -> Expectation:
    """Return the expectation of walks through a corpus between the stops.

    Args:
        corpus: the movement learned from.
        statistics: its posture statistics.
        stops: postures to pass exactly, keyed by the number of moves before each; increasing, first and last included.
        half_steps: times of the ends and middles of the moves [2 T + 1], seconds.
        path: orientations of the joints at the moves, which the walks follow [T + 1, J, 4]; None for all walks.
        near: turn the body the short way whatever the walks do (`turn_with_walks`), for durations that are typical of
            the short way.
    """
    moving = any(stop.rates is not None for stop in stops.values())
    rates = partial(sample_rates, corpus, statistics) if moving else None
    walk = mean_walk(corpus.skeleton, statistics, rates, stops, half_steps, path)
    # Each half step leads to or from the middle of a move.
    middles, of = _middles(walk.of, len(statistics.weights), len(statistics.turn))
    moves = walk.samples[:-1, middles] + walk.samples[1:, middles]
    moves /= moves.sum(axis=1, keepdims=True)
    if corpus.facing == "free":
        first, *_, last = stops.values()
        ends = tuple(None if stop.rates is None else float(stop.rates.turn) for stop in (first, last))
        facing = {move: stop.chains[-1] for move, stop in stops.items()}
        turned = statistics.turn[of]
        turn, spread = moves @ turned, moves @ turned**2
        decay = float(statistics.trust.lasts[0])
        headings = turn_with_walks(turn, spread, walk.trust[:, 0], half_steps, facing, (ends[0], ends[1]), near, decay)
    else:
        headings = rot.heading(walk.poses[:, 0])
    return Expectation(half_steps, walk.poses, headings, walk.samples, moves, walk.trust, walk.of, of, walk.left_out)


def _middles(samples: Ints | slice, count: int, moves: int) -> tuple[Ints | slice, Ints | slice]:
    """Return the columns of samples that are middles of moves, and the indices of their moves.

    Args:
        samples: indices of the samples; a slice means all.
        count: number of samples in the corpus.
        moves: number of moves in the corpus; their middles are its last samples.
    """
    if isinstance(samples, slice):
        return slice(count - moves, None), samples
    middles = np.flatnonzero(samples >= count - moves)
    return middles, samples[middles] - (count - moves)
