"""Measures of a path of states: arrival times, likelihood and cliches.

A path holds the states of L chains in T + 1 postures, int [T + 1, L]. Measures of joints leave the facing out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats, Ints, States
from motionmind.corpus.corpus import FACING
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.transitions import Transitions


def arrivals(path: States) -> Ints:
    """Return the number of moves after which each chain stays in its last state [L]; 0 if it never moves.

    Args:
        path: states [T + 1, L].
    """
    return np.asarray(len(path) - np.cumprod(path[::-1] == path[-1], axis=0).sum(axis=0), dtype=np.int64)


def arrival_spread(path: States) -> float:
    """Return the standard deviation, in moves, of when chains arrive for good; 0 if fewer than two move.

    Bradley and Stuart's short paper on MotionMind (about 2000) balances path lengths to keep it small: all body parts
    should arrive together.

    Args:
        path: states [T + 1, L].
    """
    moving = np.any(path != path[-1], axis=0)
    return float(arrivals(path)[moving].std()) if moving.sum() > 1 else 0.0


def attested_share(path: States, grammar: Grammar) -> float:
    """Return the share of the joints' transitions, holds included, that the corpus attests; NaN for a single posture.

    Args:
        path: states of the grammar's chains [T + 1, L].
        grammar: what was learned from the corpus.
    """
    edges = grammar.transitions.edges(path)[:, : _count_joints(grammar)]
    return float(np.mean(edges >= 0)) if edges.size else float("nan")


def _count_joints(grammar: Grammar) -> int:
    """Return the number of chains that are joints; they come before the facing."""
    return len(grammar.chains) - (grammar.chains[-1] == FACING)


@dataclass(frozen=True, eq=False)
class Habits:
    """A corpus's usual moves: statistics of its E transitions between G states. Holds do not count as moves.

    Attributes:
        joints: the number of joints, which are the first chains.
        transitions: the joint graphs.
        is_hold: whether a transition stays in its state [E].
        choice: whether at least two different moves lead out of a state [G].
        likeliest: whether no move out of the same state is more frequent, and some are less frequent [E].
        percentile: percentile rank, 0 to 100, of a move's frequency among all moves of the joint: the share of less
            frequent moves, plus half the share of equally frequent ones [E]. 50 for a hold.
        log_likelihood: log P(state arrived in | state left), nats [E].
    """

    joints: int
    transitions: Transitions
    is_hold: Bools
    choice: Bools
    likeliest: Bools
    percentile: Floats
    log_likelihood: Floats

    def cliches(self, path: States) -> Bools:
        """Tell, for each joint's move out of a state with a choice, whether it is the likeliest one.

        The mean is the cliche rate. Neither an unattested move is a cliche, nor any move out of a state whose moves are
        all equally frequent.

        Args:
            path: states [T + 1, L].

        Returns:
            One entry for each such move, in the order of moves, then joints.
        """
        moved, edges, rows = self._moves(path)
        chosen = moved & self.choice[rows]
        return (self.likeliest[edges] & (edges >= 0))[chosen]

    def percentiles(self, path: States) -> Floats:
        """Return the percentile of each joint's move in a path [T + 1, L]: 0 if the corpus never made it.

        The mean over the corpus's own moves is 50.
        """
        moved, edges, _ = self._moves(path)
        return np.where(edges >= 0, self.percentile[edges], 0.0)[moved]

    def log_likelihoods(self, path: States) -> Floats:
        """Return log P, nats, of each attested transition of a joint in a path [T + 1, L], holds included."""
        _, edges, _ = self._moves(path)
        return self.log_likelihood[edges[edges >= 0]]

    def _moves(self, path: States) -> tuple[Bools, Ints, Ints]:
        """Return whether each joint moves, its transition or -1, and the row of the state left, each [T, joints]."""
        graph = self.transitions
        before, after = path[:-1, : self.joints], path[1:, : self.joints]
        edges = np.array(
            [
                [graph.edge(chain, *pair) for chain, pair in enumerate(zip(*rows, strict=True))]
                for rows in zip(before.tolist(), after.tolist(), strict=True)
            ],
            dtype=np.int64,
        ).reshape(before.shape)
        return before != after, edges, graph.starts[: self.joints] + before


def learn_habits(grammar: Grammar) -> Habits:
    """Learn the usual moves of the corpus that a grammar was learned from."""
    graph = grammar.transitions
    sources = graph.sources
    chain = np.searchsorted(graph.starts, sources, side="right") - 1
    is_hold = sources - graph.starts[chain] == graph.targets
    move = ~is_hold
    most, least = np.full(len(graph.visits), -np.inf), np.full(len(graph.visits), np.inf)
    np.maximum.at(most, sources[move], graph.counts[move])
    np.minimum.at(least, sources[move], graph.counts[move])
    percentile = np.full(len(sources), 50.0)
    for number in range(len(grammar.chains)):
        mine = move & (chain == number)
        seen, which = np.unique(graph.counts[mine], return_inverse=True)
        share = np.bincount(which, weights=graph.counts[mine], minlength=len(seen))
        percentile[mine] = (100.0 * (np.cumsum(share) - 0.5 * share) / max(share.sum(), 1e-300))[which]
    return Habits(
        _count_joints(grammar),
        graph,
        is_hold,
        np.bincount(sources[move], minlength=len(graph.visits)) > 1,
        move & (graph.counts == most[sources]) & (most > least)[sources],
        percentile,
        -graph.weights("conditional"),
    )
