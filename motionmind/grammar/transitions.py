"""Joint graphs: the transitions between states in a corpus, their counts, and the postures that attest them.

A *chain* is a joint, or the body's facing if that is a chain of its own. Learning builds a networkx graph of the states
of each chain, and flattens the graphs into the arrays that a search reads (`Transitions`), so a search need not load
networkx. States are numbered from 0 in each chain; state s of chain j has the row `starts[j] + s` in flat arrays.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.executors.here import this_process
from motionmind.executors.team import Team
from motionmind.grammar.schemes import Weights

if TYPE_CHECKING:
    import networkx as nx


@dataclass(frozen=True, eq=False)
class Transitions:
    """The joint graphs of L chains in flat arrays: G states and E attested transitions in all.

    Attributes:
        starts: first row of each chain [L + 1].
        indptr: transitions of each state [G + 1].
        targets: the state that each transition leads to, increasing within a row [E].
        counts: total weight of the corpus's moves that made each transition [E].
        visits: total weight of the postures in each state [G].
        attests: index of the first posture from which each transition was made [E].
        arrives: index of the posture that it led to from there [E].
        seconds: its mean duration, weighted alike [E].
    """

    starts: Ints
    indptr: Ints
    targets: Int32s
    counts: Floats
    visits: Floats
    attests: Int32s
    arrives: Int32s
    seconds: Floats

    # Cached for all tweens: each takes time in proportion to the number of transitions.

    @cached_property
    def sources(self) -> Ints:
        """Row of the state that each transition leaves [E]."""
        return np.repeat(np.arange(len(self.visits)), np.diff(self.indptr))

    @cached_property
    def _conditional(self) -> Floats:
        """Weight of each transition in the scheme `conditional` [E], nats."""
        leaving = np.bincount(self.sources, weights=self.counts, minlength=len(self.visits))
        return np.asarray(np.log(leaving[self.sources]) - np.log(self.counts))

    @cached_property
    def _keys(self) -> Ints:
        """A key for each transition, increasing with its row and, within a row, with its target [E]."""
        return np.asarray(self.sources * self._width + self.targets)

    @property
    def _width(self) -> int:
        """A number greater than that of any chain's states."""
        return int(self.sizes().max()) + 1

    def graph(self, chain: int) -> nx.DiGraph:
        """Return the joint graph of a chain, as learning built it.

        Nodes are states, with `visits`. Edges are transitions, with `count`, `weight` (-log P(next | state), nats),
        `seconds`, and the postures that they lead from and to where first made, `attests` and `arrives`.
        """
        first, last = self.starts[chain], self.starts[chain + 1]
        edges = slice(self.indptr[first], self.indptr[last])
        return _graph(
            self.visits[first:last],
            _ChainTransitions(
                self.sources[edges] - first,
                self.targets[edges],
                self.counts[edges],
                self.seconds[edges],
                self.attests[edges],
                self.arrives[edges],
            ),
        )

    def sizes(self) -> Ints:
        """Number of states in each chain [L]."""
        return np.diff(self.starts)

    def weights(self, scheme: Weights, novelty: float = 0.0) -> Floats:
        """Return the weight of each transition s -> s' [E], nats.

        With w the weight in the scheme and n the number of transitions that leave s, it is

            (1 - novelty) w(s, s') + novelty log n

        Args:
            scheme: `conditional`: w = -log P(s' | s) = log C(s) - log C(s, s'), with C(s) the sum of the counts
                C(s, s') over the transitions that leave s (Stuart and Bradley, "Learning the grammar of dance", ICML
                (1998), section 2.2.1). `printed`: w = -log f(s) + log f(s') - log f(s, s') with the relative
                frequencies f in the chain, as printed in Bradley and Stuart, Chaos 8:800 (1998), and in their technical
                report CU-CS-844-97 (1997).
            novelty: 0 to 1; at 1 all transitions that leave a state cost the same.
        """
        weights = self._conditional if scheme == "conditional" else self._printed()
        if novelty == 0.0:
            return weights.copy()
        return (1.0 - novelty) * weights + novelty * np.log(np.diff(self.indptr)[self.sources])

    def _printed(self) -> Floats:
        """Return the weight of each transition in the scheme `printed` [E], nats."""
        sources = self.sources
        chain = np.searchsorted(self.starts, sources, side="right") - 1
        chain_of_row = np.repeat(np.arange(len(self.starts) - 1), self.sizes())
        visited = self.visits / np.bincount(chain_of_row, weights=self.visits)[chain_of_row]
        moved = self.counts / np.bincount(chain, weights=self.counts)[chain]
        return np.asarray(
            -np.log(visited[sources]) + np.log(visited[self.starts[chain] + self.targets]) - np.log(moved)
        )

    def edge(self, chain: int, state: int, target: int) -> int:
        """Return the index of the transition from `state` to `target` in a chain; -1 if it is not attested."""
        row = self.starts[chain] + state
        first, last = self.indptr[row], self.indptr[row + 1]
        at = int(first + np.searchsorted(self.targets[first:last], target))
        return at if at < last and self.targets[at] == target else -1

    def edges(self, path: Int32s) -> Ints:
        """Return the indices of all chains' transitions in a path [T, L]; -1 for unattested ones.

        Args:
            path: states [T + 1, L].
        """
        return self.find(self.starts[:-1] + path[:-1], path[1:])

    def find(self, rows: Ints, targets: Ints | Int32s) -> Ints:
        """Return the indices of transitions; -1 for unattested ones.

        Args:
            rows: row of the state that each leaves, of any shape.
            targets: the state of the same chain that each leads to, in the same shape.
        """
        keys, wanted = self._keys, rows * self._width + targets
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        return np.where(keys[at] == wanted, at, -1) if len(keys) else np.full(wanted.shape, -1)


def count_transitions(
    states: Int32s,
    sizes: Ints,
    begins: Ints,
    seconds: Floats,
    pooled: int | None = None,
    *,
    ends: Ints | None = None,
    weights: Floats | None = None,
    posture_weights: Floats | None = None,
    team: Team | None = None,
) -> Transitions:
    """Count the transitions of all chains.

    Args:
        states: state of each chain in each posture [N, L].
        sizes: number of states in each chain [L].
        begins: the posture that each move leads from, within one clip [M]; the first move in this order that attests a
            transition is kept.
        seconds: duration of each move [M].
        pooled: a chain whose states are equal steps of a circle. Its transitions are counted by the number of steps
            that they turn, and apply from every state.
        ends: the posture that each move leads to [M]; None for the next one.
        weights: weight of each move [M]; None for 1.
        posture_weights: weight of each posture [N]; None for 1.
        team: threads, one job per chain; None for the current thread.
    """
    ends = begins + 1 if ends is None else ends
    weights = np.ones(len(begins)) if weights is None else weights
    posture_weights = np.ones(len(states)) if posture_weights is None else posture_weights
    size = np.asarray(sizes, dtype=np.int64)

    def graph_of(chain: int) -> nx.DiGraph:
        src, dst = states[begins, chain].astype(np.int64), states[ends, chain].astype(np.int64)
        if chain == pooled:
            turns = _count(np.zeros_like(src), (dst - src) % size[chain], size[chain], begins, ends, seconds, weights)
            return _graph(np.full(size[chain], posture_weights.sum() / size[chain]), _pool(turns, size[chain]))
        visits = np.bincount(states[:, chain], weights=posture_weights, minlength=size[chain]).astype(np.float64)
        return _graph(visits, _count(src, dst, size[chain], begins, ends, seconds, weights))

    return flatten((team or this_process()).map(graph_of, range(states.shape[1])))


def flatten(graphs: Iterable[nx.DiGraph]) -> Transitions:
    """Return the joint graphs of all chains, as `Transitions.graph` returns each, in flat arrays.

    Args:
        graphs: a graph for each chain, with its nodes, and the edges of each, in increasing order.
    """
    visits, leaving, counted = list[Floats](), list[Ints](), [_ChainTransitions.none()]
    for graph in graphs:
        visits.append(np.array([visited for _, visited in graph.nodes(data="visits")], dtype=np.float64))
        leaving.append(np.array([degree for _, degree in graph.out_degree()], dtype=np.int64))
        edges = graph.edges(data=True)
        columns = zip(*((s, t, *(values[key] for key in _EDGE_ATTRIBUTES)) for s, t, values in edges), strict=True)
        counted.append(_ChainTransitions(*map(np.array, columns)) if edges else _ChainTransitions.none())
    _, targets, counts, seconds, attests, arrives = map(np.concatenate, zip(*counted, strict=True))
    return Transitions(
        np.cumsum([0, *map(len, visits)], dtype=np.int64),
        np.cumsum(np.concatenate([np.zeros(1, np.int64), *leaving])),
        targets.astype(np.int32),
        counts,
        np.concatenate(visits),
        attests.astype(np.int32),
        arrives.astype(np.int32),
        seconds,
    )


_EDGE_ATTRIBUTES = ("count", "seconds", "attests", "arrives")  # in the order of the fields of `_ChainTransitions`


class _ChainTransitions(NamedTuple):
    """The transitions of one chain, in the order of sources, then targets, each [E_j]; fields as in `Transitions`."""

    sources: Ints
    targets: Ints | Int32s
    counts: Floats
    seconds: Floats
    attests: Ints | Int32s
    arrives: Ints | Int32s

    @classmethod
    def none(cls) -> _ChainTransitions:
        whole, real = np.zeros(0, np.int64), np.zeros(0)
        return cls(whole, whole, real, real, whole, whole)


def _count(
    sources: Ints, targets: Ints, size: int, begins: Ints, ends: Ints, seconds: Floats, weights: Floats
) -> _ChainTransitions:
    """Count the transitions that a chain of `size` states makes in the moves [M] from `sources` to `targets`."""
    keys, first, which = np.unique(sources * size + targets, return_index=True, return_inverse=True)
    counts = np.asarray(np.bincount(which, weights=weights, minlength=len(keys)), dtype=np.float64)
    mean = np.bincount(which, weights=weights * seconds, minlength=len(keys)) / counts
    return _ChainTransitions(keys // size, keys % size, counts, mean, begins[first], ends[first])


def _pool(turns: _ChainTransitions, size: int) -> _ChainTransitions:
    """Copy the transitions from state 0 of a circle of `size` states to every state."""
    targets = (np.arange(size)[:, None] + turns.targets[None, :]) % size
    order = np.argsort(targets, axis=1)
    return _ChainTransitions(
        np.repeat(np.arange(size), len(turns.targets)),
        np.take_along_axis(targets, order, 1).ravel(),
        turns.counts[order].ravel(),
        turns.seconds[order].ravel(),
        turns.attests[order].ravel(),
        turns.arrives[order].ravel(),
    )


def _graph(visits: Floats, counted: _ChainTransitions) -> nx.DiGraph:
    """Return the joint graph of a chain; its states' visits are [S]."""
    import networkx as nx

    leaving = np.bincount(counted.sources, counted.counts, len(visits))
    weights = np.log(leaving[counted.sources]) - np.log(counted.counts)
    graph = nx.DiGraph()
    graph.add_nodes_from((state, {"visits": visited}) for state, visited in enumerate(visits.tolist()))
    graph.add_edges_from(
        (source, target, {"weight": weight, **dict(zip(_EDGE_ATTRIBUTES, values, strict=True))})
        for weight, source, target, *values in zip(
            weights.tolist(), *(array.tolist() for array in counted), strict=True
        )
    )
    return graph
