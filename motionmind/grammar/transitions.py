"""Joint graphs: which state follows which in a corpus, how often, and who attests it.

A *chain* is a joint, or the body's facing where that travels on its own. States are numbered from 0 in each chain;
state s of chain j has the row `starts[j] + s` in flat arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from motionmind._typing import Floats, Int32s, Ints

Weights = Literal["conditional", "printed"]


@dataclass(frozen=True, eq=False)
class Transitions:
    """The joint graphs of L chains, flat: G states in all, E attested transitions in all.

    Attributes:
        starts: first row of each chain [L + 1].
        indptr: transitions of each state [G + 1].
        targets: the state that a transition leads to, increasing within a row [E].
        counts: how often it was seen, each time by the weight of who made it [E].
        visits: how many postures are in each state, each by its weight [G].
        attests: index of the first posture from which the transition was made [E].
        arrives: index of the posture that it led to there [E].
        seconds: its mean duration [E].
    """

    starts: Ints
    indptr: Ints
    targets: Int32s
    counts: Floats
    visits: Floats
    attests: Int32s
    arrives: Int32s
    seconds: Floats

    @property
    def sources(self) -> Ints:
        """Row of the state that each transition leaves [E]."""
        return np.repeat(np.arange(len(self.visits)), np.diff(self.indptr))

    def sizes(self) -> Ints:
        """Number of states in each chain [L]."""
        return np.diff(self.starts)

    def weights(self, scheme: Weights, novelty: float = 0.0) -> Floats:
        """Weight in nats of each transition s -> s' [E].

        `conditional` is -log P(s' | s) = log C(s) - log C(s, s'), C(s) counted over the transitions that leave s
        ([I98] 2.2.1); `printed` is -log f(s) + log f(s') - log f(s, s') with relative frequencies, as [C98] and
        [TR97] print it. `novelty` from 0 to 1 tempers either: at 1 all n transitions that leave s cost log n alike.
        """
        weights = self._weights(scheme)
        return (1.0 - novelty) * weights + novelty * np.log(np.diff(self.indptr)[self.sources])

    def _weights(self, scheme: Weights) -> Floats:
        sources = self.sources
        if scheme == "conditional":
            leaving = np.bincount(sources, weights=self.counts, minlength=len(self.visits))
            return np.asarray(np.log(leaving[sources]) - np.log(self.counts))
        chain = np.searchsorted(self.starts, sources, side="right") - 1
        chain_of_row = np.repeat(np.arange(len(self.starts) - 1), self.sizes())
        visited = self.visits / np.bincount(chain_of_row, weights=self.visits)[chain_of_row]
        moved = self.counts / np.bincount(chain, weights=self.counts)[chain]
        return np.asarray(
            -np.log(visited[sources]) + np.log(visited[self.starts[chain] + self.targets]) - np.log(moved)
        )

    def edge(self, chain: int, state: int, target: int) -> int:
        """Index of the transition from `state` to `target` in a chain; -1 where it is not attested."""
        row = self.starts[chain] + state
        first, last = self.indptr[row], self.indptr[row + 1]
        at = int(first + np.searchsorted(self.targets[first:last], target))
        return at if at < last and self.targets[at] == target else -1

    def edges(self, path: Int32s) -> Ints:
        """Indices of the transitions of all chains in each move of a path of states [T + 1, L]: [T, L], as `edge`."""
        width = int(self.sizes().max()) + 1
        keys = self.sources * width + self.targets  # in order, for rows are, and the targets in each
        asked = (self.starts[:-1] + path[:-1]) * width + path[1:]
        at = np.minimum(np.searchsorted(keys, asked), len(keys) - 1)
        return np.where(keys[at] == asked, at, -1) if len(keys) else np.full(asked.shape, -1)


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
) -> Transitions:
    """Count the transitions of all chains.

    Args:
        states: state of each chain in each posture [N, L].
        sizes: number of states in each chain [L].
        begins: postures from which a move leads, none across clips [M]; of those that attest a transition the first in
            this order is kept.
        seconds: duration of those moves [M].
        pooled: a chain whose states are equal steps of a circle: what is counted is by how many steps it turns, pooled
            over where it turns from, and holds from every state alike.
        ends: the posture that each move leads to [M]; None for the next one.
        weights: what each move counts [M]; None for 1.
        posture_weights: what each posture counts [N]; None for 1.
    """
    ends = begins + 1 if ends is None else ends
    weights = np.ones(len(begins)) if weights is None else weights
    posture_weights = np.ones(len(states)) if posture_weights is None else posture_weights
    chains, size = states.shape[1], np.asarray(sizes, dtype=np.int64)
    sources, targets, counts, attests, arrives, durations, visits = [], [], [], [], [], [], []
    for chain in range(chains):
        src, dst = states[begins, chain].astype(np.int64), states[ends, chain].astype(np.int64)
        if chain == pooled:
            src, dst = np.zeros_like(src), (dst - src) % size[chain]
        keys, first, which = np.unique(src * size[chain] + dst, return_index=True, return_inverse=True)
        count = np.bincount(which, weights=weights, minlength=len(keys))
        mean = np.bincount(which, weights=weights * seconds, minlength=len(keys)) / count
        source, target, visited = keys // size[chain], keys % size[chain], states[:, chain]
        if chain == pooled:
            turned = (np.arange(size[chain])[:, None] + target[None, :]) % size[chain]
            order = np.argsort(turned, axis=1)
            source, target = np.repeat(np.arange(size[chain]), len(keys)), np.take_along_axis(turned, order, 1).ravel()
            first, count, mean = first[order].ravel(), count[order].ravel(), mean[order].ravel()
            visits.append(np.full(size[chain], posture_weights.sum() / size[chain]))
        else:
            visits.append(np.bincount(visited, weights=posture_weights, minlength=size[chain]))
        sources.append(source)
        targets.append(target)
        counts.append(count)
        attests.append(begins[first])
        arrives.append(ends[first])
        durations.append(mean)
    starts = np.concatenate([[0], np.cumsum(size)]).astype(np.int64)
    rows = np.concatenate([starts[chain] + source for chain, source in enumerate(sources)])
    leaving = np.bincount(rows, minlength=starts[-1])
    return Transitions(
        starts,
        np.concatenate([[0], np.cumsum(leaving)]).astype(np.int64),
        np.concatenate(targets).astype(np.int32),
        np.concatenate(counts).astype(np.float64),
        np.concatenate(visits).astype(np.float64),
        np.concatenate(attests).astype(np.int32),
        np.concatenate(arrives).astype(np.int32),
        np.concatenate(durations).astype(np.float64),
    )
