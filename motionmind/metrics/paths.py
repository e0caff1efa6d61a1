"""What a path of states is like beside the corpus: how long, how likely, how much of a cliche.

A path has the states of L chains in T + 1 postures, int [T + 1, L]. What is said of joints leaves the facing out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats, Ints, States
from motionmind.corpus.corpus import FACING
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.transitions import Transitions


def arrivals(path: States) -> Ints:
    """The number of moves after which each chain is where it stays to the end [L]; 0 for one that never leaves it."""
    return np.asarray(len(path) - np.cumprod(path[::-1] == path[-1], axis=0).sum(axis=0), dtype=np.int64)


def arrival_spread(path: States) -> float:
    """Standard deviation, in moves, of when the chains that move arrive for good; 0 where fewer than two move.

    What [MM] balances lengths for: that all parts of the body arrive together.
    """
    moving = np.any(path != path[-1], axis=0)
    return float(arrivals(path)[moving].std()) if moving.sum() > 1 else 0.0


@dataclass(frozen=True, eq=False)
class Habits:
    """What is usual in a corpus, for each of E transitions between G states; holds are no moves here.

    Attributes:
        joints: the number of joints, which are the first chains.
        transitions: the joint graphs.
        is_hold: whether a transition stays in its state [E].
        choice: whether at least two different moves lead out of a state [G].
        likeliest: whether no move out of the same state was seen more often, and some were less often [E].
        percentile: of how often it was seen among the joint's moves, each as often as it was made, from 0 to 100: those
            that were seen less often, and half of those as often [E].
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
        """For each joint's move of a path out of a state with a choice, whether it is the likeliest one.

        The mean is the cliche rate. A move that the corpus does not attest is none; where all that lead out of a state
        were seen as often, neither is any of those.
        """
        moved, edges, rows = self._moves(path)
        chosen = moved & self.choice[rows]
        return (self.likeliest[edges] & (edges >= 0))[chosen]

    def percentiles(self, path: States) -> Floats:
        """For each joint's move of a path the percentile of how often the corpus made it: 0 where it never did.

        Of the corpus's own moves the mean is 50.
        """
        moved, edges, _ = self._moves(path)
        return np.where(edges >= 0, self.percentile[edges], 0.0)[moved]

    def log_likelihoods(self, path: States) -> Floats:
        """For each attested transition of a joint in a path, holds among them, its log P, nats."""
        _, edges, _ = self._moves(path)
        return self.log_likelihood[edges[edges >= 0]]

    def attested(self, path: States) -> Bools:
        """For each transition of a joint in a path, holds among them, whether the corpus attests it."""
        return (self._moves(path)[1] >= 0).ravel()

    def _moves(self, path: States) -> tuple[Bools, Ints, Ints]:
        """Whether each joint moves, the transition that it makes or -1, and the row that it leaves [T, joints]."""
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


def find_habits(grammar: Grammar) -> Habits:
    """What is usual in the corpus that a grammar was learned from."""
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
        len(grammar.chains) - (grammar.chains[-1] == FACING),
        graph,
        is_hold,
        np.bincount(sources[move], minlength=len(graph.visits)) > 1,
        move & (graph.counts == most[sources]) & (most > least)[sources],
        percentile,
        -graph.weights("conditional"),
    )
