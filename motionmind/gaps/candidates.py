"""Choose the transitions that most lower the costs of a sample, without the joints' coordination.

The cost of a path of T moves has a lower bound: the sum over joint chains of the chain's cheapest path of T moves, with
each state at its cost alone. A transition adds an edge to each joint graph that lacks it; its gain is how much it
lowers the bounds. The best few are later solved exactly. In a candidate, no joint turns farther than in some move of
the corpus, so the transition can be danced in one move.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.gaps.sample import PLAIN_REQUEST
from motionmind.gaps.transition import Transition, states_of
from motionmind.geometry import rotations as rot
from motionmind.learned.model import LearnedCorpus
from motionmind.tween.problem import build_model


def choose_candidates(learned: LearnedCorpus, pairs: Ints, moves: int, count: int, seed: int) -> list[Transition]:
    """Choose the transitions that most lower the bounds on the costs of pairs of postures, the best first.

    No two of them share their first posture or their last.

    Args:
        learned: the learned corpus.
        pairs: the sample, by indices of postures [P, 2].
        moves: the greatest number of moves of its paths.
        count: how many to choose, at most; fewer if no other has a gain.
        seed: seed of the random choice of candidates.
    """
    rng = np.random.default_rng(seed)
    chosen = _distinct(np.asarray(learned.states), rng)
    possible = np.argwhere(_danceable(learned, chosen))
    bounds = _Bounds(learned, pairs, moves)
    most = int(np.clip(1e10 / bounds.edges, 100, 4000))  # visits about 1e10 edges
    if len(possible) > most:
        possible = possible[np.sort(rng.choice(len(possible), most, replace=False))]
    candidates = [Transition(begin, end) for begin, end in chosen[possible].tolist()]
    gains = [round(bounds.gain(one), 6) for one in candidates]
    found: list[Transition] = []
    for number in np.argsort(np.negative(gains), kind="stable").tolist():
        one = candidates[number]
        if len(found) == count or gains[number] <= 0.0:
            break
        if all(one.begin != other.begin and one.end != other.end for other in found):
            found.append(one)
    return found


def _distinct(states: Int32s, rng: np.random.Generator) -> Ints:
    """Return the first posture of each distinct row of states [N, L], or 400 random ones of these, in order."""
    first = np.sort(np.unique(states, axis=0, return_index=True)[1])
    most = 400
    return first if len(first) <= most else np.sort(rng.choice(first, most, replace=False))


def _danceable(learned: LearnedCorpus, chosen: Ints) -> Bools:
    """Return whether no joint turns farther between two chosen postures than in some move of the corpus [C, C]."""
    corpus, moves = learned.corpus, learned.corpus.moves
    joints = len(corpus.skeleton)
    chains = corpus.to_chains(np.asarray(corpus.rotations))[:, :joints]
    possible = np.ones((len(chosen), len(chosen)), dtype=np.bool_)
    for joint in range(joints):
        turns = chains[:, joint]
        farthest = rot.angle(turns[moves.begins], turns[moves.ends]).max(initial=0.0)
        possible &= rot.angle(turns[chosen][:, None], turns[chosen][None, :]) <= farthest + 1e-9
    np.fill_diagonal(possible, val=False)
    return possible


class _Bounds:
    """Lower bounds of the costs of P pairs of postures, by chain and number of moves.

    Attributes:
        edges: number of edges to visit for new bounds of all chains.
    """

    def __init__(self, learned: LearnedCorpus, pairs: Ints, moves: int) -> None:
        self._learned, self._moves = learned, moves
        self._graph = learned.grammar.transitions
        search = PLAIN_REQUEST.search
        self._model = build_model(learned.grammar, search.weights, search.coordination_factor, search.bridge_price)
        self._leaving = np.bincount(self._graph.sources, weights=self._graph.counts, minlength=len(self._graph.visits))
        self._ends = np.asarray(learned.states)[pairs].transpose(2, 1, 0)  # [L, 2, P]
        self.edges = float(len(self._model.targets)) * len(pairs) * moves
        self._chains = np.stack([self._bound(chain) for chain in range(len(self._ends))])  # [L, T + 1, P]
        self._known: dict[tuple[int, int, int], Floats] = {}

    def gain(self, transition: Transition) -> float:
        """Return how much a transition lowers the mean bound, nats."""
        chains = self._chains.copy()
        for chain, (before, after) in enumerate(states_of(self._learned, transition).T.tolist()):
            if self._graph.edge(chain, before, after) < 0:
                key = chain, before, after
                if key not in self._known:
                    self._known[key] = self._bound(chain, (before, after))
                chains[chain] = self._known[key]
        return float((self._total(self._chains) - self._total(chains)).mean())

    def _total(self, chains: Floats) -> Floats:
        """Return the sum of bounds over chains [L, T + 1, P], minimised over numbers of moves [P]."""
        per_move = PLAIN_REQUEST.search.tau * np.arange(self._moves + 1)
        return np.asarray((chains.sum(axis=0) + per_move[:, None]).min(axis=0))

    def _bound(self, chain: int, edge: tuple[int, int] | None = None) -> Floats:
        """Return a chain's least cost from A to B by number of moves [T + 1, P], with an additional edge if given."""
        model, first, size = self._model, int(self._model.starts[chain]), int(self._graph.sizes()[chain])
        rows = model.indptr[first : first + size + 1]
        alone = model.alone[first : first + size]
        sources, targets = np.repeat(np.arange(size), np.diff(rows)), model.targets[rows[0] : rows[-1]].astype(np.int64)
        costs = model.costs[rows[0] : rows[-1]] + alone[targets]
        if edge is not None:
            price = np.log(self._leaving[self._graph.starts[chain] + edge[0]] + 1.0) + alone[edge[1]]
            sources, targets = np.append(sources, edge[0]), np.append(targets, edge[1])
            costs = np.append(costs, price)
        order = np.argsort(targets, kind="stable")
        sources, targets, costs = sources[order], targets[order], costs[order]
        starts = np.flatnonzero(np.append(True, np.diff(targets) != 0)) if len(targets) else targets
        ends, which = np.unique(self._ends[chain], axis=1, return_inverse=True)
        (a, b), pair = ends, np.arange(ends.shape[1])
        reached = np.full((len(pair), size), np.inf)
        reached[pair, a] = 0.0
        bounds = [reached[pair, b]]
        for _ in range(self._moves):
            then = np.full_like(reached, np.inf)
            if len(targets):
                then[:, targets[starts]] = np.minimum.reduceat(reached[:, sources] + costs, starts, axis=1)
            waited = reached[pair, b] + PLAIN_REQUEST.search.beta + alone[b]  # at the goal
            then[pair, b] = np.minimum(then[pair, b], waited)
            reached = then
            bounds.append(reached[pair, b])
        return np.stack(bounds)[:, which.reshape(-1)]
