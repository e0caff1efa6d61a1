"""Draw random pairs of a corpus's postures, and find the cheapest paths between them.

The paths depend on the grammar alone: any number of moves, no guide, no pace. They show how well the joint graphs are
connected, and the value of another transition.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.body.motion import Posture
from motionmind.corpus.corpus import Corpus
from motionmind.errors import MotionMindError
from motionmind.grammar.grammar import Grammar
from motionmind.learned.model import LearnedCorpus
from motionmind.search.solve import solve
from motionmind.tween.ends import bring_ends
from motionmind.tween.formulate import formulate
from motionmind.tween.request import TweenRequest

PLAIN_REQUEST = TweenRequest.of(guide=0.0, without=("pace",))


class Solved(NamedTuple):
    """The cheapest paths of P pairs of postures.

    Attributes:
        costs: nats [P].
        bounds: lower bounds of all paths' costs, nats [P].
        moves: numbers of moves [P].
        bridged: numbers of moves of each joint chain that no clip attests [P, L].
    """

    costs: Floats
    bounds: Floats
    moves: Ints
    bridged: Ints


def draw_pairs(corpus: Corpus, pairs: int, seed: int) -> Ints:
    """Draw pairs of different postures of a corpus, by index [P, 2].

    Raises:
        MotionMindError: the corpus has a single posture.
    """
    if len(corpus) < 2:
        raise MotionMindError(f"corpus {corpus.name!r} has one posture; a pair needs two")
    rng = np.random.default_rng(seed)
    first, apart = rng.integers(len(corpus), size=pairs), rng.integers(1, len(corpus), size=pairs)
    return np.stack([first, (first + apart) % len(corpus)], axis=1)


def solve_pairs(learned: LearnedCorpus, pairs: Ints) -> Solved:
    """Find the cheapest path between the postures of each pair [P, 2], with the options of `PLAIN_REQUEST`."""
    costs, bounds, moves = np.zeros(len(pairs)), np.zeros(len(pairs)), np.zeros(len(pairs), np.int64)
    bridged = np.zeros((len(pairs), len(learned.grammar.chains)), np.int64)
    for number, (a, b) in enumerate(pairs.tolist()):
        ends = bring_ends(learned.corpus, _posture(learned.corpus, a), _posture(learned.corpus, b))
        formulation = formulate(learned, ends, PLAIN_REQUEST)
        if not formulation.stays:
            found = solve(formulation.searched)
            costs[number], bounds[number], moves[number] = found.cost, found.lower_bound, len(found.path) - 1
            bridged[number] = _count_bridges(found.path, learned.grammar)
    return Solved(costs, bounds, moves, bridged)


def _posture(corpus: Corpus, number: int) -> Posture:
    return Posture(corpus.skeleton, corpus.rotations[number], corpus.root[number])


def _count_bridges(path: Int32s, grammar: Grammar) -> Ints:
    """Count each chain's moves in a path [T + 1, L] that no clip attests, without waits at the goal [L]."""
    waits = (path[:-1] == path[1:]) & (path[:-1] == path[-1])
    return np.asarray(((grammar.transitions.edges(path) < 0) & ~waits).sum(axis=0))
