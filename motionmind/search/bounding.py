"""Bound a trellis from both sides, until the lower bound meets the cost of the best path found or stalls.

Rounds of sweeps raise the lower bound. Each round also finds and polishes a path, and prunes the positions that only
costlier paths than the best go through. A* starts from the result: the last bound is its heuristic, the best path its
incumbent, and the remaining trellis, which contains the best path, its problem.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.search import heuristic, pair_chains, trws
from motionmind.search.costs import path_cost
from motionmind.search.heuristic import Heuristic
from motionmind.search.pair_chain_tables import count_pairs
from motionmind.search.polish import polish
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS, ROUNDING_NATS
from motionmind.search.trellis import Trellis, states_of
from motionmind.search.watcher import Watcher

N_SWEEPS_PER_ROUND = 2  # few, since pruning pays at once: on ballet 2 is the fastest of 1 to 8
N_FIRST_SWEEPS = 3  # in the first round, on the whole trellis: one more is worth more than polishing the path
MAX_PAIR_CHAIN_SWEEPS = 100  # for each number of moves
MAX_STATE_PAIRS = 1 << 23  # in pair chains, 32 bytes each; larger ones are neither built nor kept for A*


class Bounded:
    """Bounds on one trellis.

    Attributes:
        trellis: the remaining trellis, in the original's memory; it contains the best path found and every path cheaper
            than `cost`.
        heuristic: the last proven bound on the cost to go.
        cost: cost of the best path found, or the limit that a path must stay below, nats.
        states: the best path found [T + 1, L]; empty until then.
        lower_bound: no path that is cheaper than `cost` costs less than this, nats.
    """

    def __init__(self, trellis: Trellis, heuristic: Heuristic, cost: float, states: Int32s | None = None) -> None:
        self.trellis, self.heuristic, self.cost, self.lower_bound = trellis, heuristic, cost, -np.inf
        self.states = np.zeros((0, trellis.chains), dtype=np.int32) if states is None else states

    @property
    def found(self) -> bool:
        """Whether a path has been found."""
        return len(self.states) > 0

    @property
    def closed(self) -> bool:
        """Whether bound and path meet, or the remaining trellis has no better path."""
        return self.lower_bound >= self.cost - OPTIMAL_WITHIN_NATS

    @property
    def limit(self) -> float:
        """Cost in nats below which paths are of interest, including the best path found."""
        return self.cost + ROUNDING_NATS if self.found else self.cost - ROUNDING_NATS

    def update(self, lower_bound: float, chosen: Ints, through: Floats | None) -> None:
        """Update the bounds with a lower bound and a path of positions [n]; polish a path within 10 % of the best.

        Args:
            lower_bound: bound on all paths, nats.
            chosen: the path.
            through: lower bounds on the cost of every path through each position, nats [P]; None to leave the path as
                it is.
        """
        cost = path_cost(self.trellis, chosen)
        if through is not None and cost <= self.cost + 0.1 * abs(self.cost):
            cost = polish(self.trellis, chosen, through)
        if cost < self.cost:
            self.cost, self.states = cost, states_of(self.trellis, chosen)
        self.lower_bound = min(max(self.lower_bound, lower_bound), self.cost)

    def accept(self, cost: float, states: Int32s, lower_bound: float) -> None:
        """Update the bounds with a lower bound and, if it costs at most `limit`, a path of states [T + 1, L]."""
        if cost <= self.limit:
            self.cost, self.states = cost, states
        self.lower_bound = min(max(self.lower_bound, lower_bound), self.cost)

    def undercut(self, below: float) -> None:
        """Restrict the search to paths cheaper than `below` nats."""
        if below < self.cost:
            self.cost, self.states = below, self.states[:0]
            self.lower_bound = min(self.lower_bound, below)

    def replace(self, trellis: Trellis, heuristic: Heuristic) -> None:
        """Replace the trellis by a pruned one; an empty domain means that no path below the limit is left."""
        if np.any(np.diff(trellis.dom_ptr) == 0):
            self.lower_bound = self.cost
        else:
            self.trellis, self.heuristic = trellis, heuristic

    def stalls(self, gap: float, size: int, share: float) -> bool:
        """Return whether the gap and the number of positions both remain above a share of their earlier values."""
        return self.cost - self.lower_bound > share * gap and len(self.trellis.dom) > share * size


def tighten(state: Bounded, sweeps: int, watcher: Watcher) -> None:
    """Tighten the bounds of a trellis by at most `sweeps` pairs of message sweeps; then, if needed, by pair chains."""
    _tighten_by_messages(state, sweeps, watcher)
    several = state.trellis.chains > 1
    if not (state.closed or watcher.wants_stop()) and several and count_pairs(state.trellis) <= MAX_STATE_PAIRS:
        tables = pair_chains.build(state.trellis, state.heuristic.messages)
        state.heuristic = Heuristic.of_pair_chains(tables)
        tighten_by_pair_chains(state, watcher)


def _tighten_by_messages(state: Bounded, sweeps: int, watcher: Watcher) -> None:
    """Tighten by messages until bound and path meet, they stall, or the watcher stops the search."""
    messages, done = trws.no_messages(state.trellis), 0
    while done < sweeps:
        first, gap, size = done == 0, state.cost - state.lower_bound, len(state.trellis.dom)
        at_once = min(N_FIRST_SWEEPS if first else N_SWEEPS_PER_ROUND, sweeps - done)
        chosen = np.zeros(len(state.trellis.dom_ptr) - 1, dtype=np.int64)
        lower_bound, _ = trws.tighten(state.trellis, messages, chosen, at_once, state.cost)
        done += at_once
        last = done >= sweeps or watcher.wants_stop()
        # The first path only serves to prune; polish it only if no other will follow.
        state.update(lower_bound, chosen, messages.through if last or not first else None)
        if state.closed and not state.found:
            break
        # Prune the whole trellis in place, as most of it is left; later copy the small rest, to free memory.
        trellis, messages = trws.prune(state.trellis, messages, state.limit, first)
        state.replace(trellis, Heuristic.of_messages(messages))
        if state.closed or last or (not first and state.stalls(gap, size, 0.9)):
            break


def tighten_by_pair_chains(state: Bounded, watcher: Watcher) -> None:
    """Tighten by the heuristic's pair chains, in the same way."""
    state.lower_bound = max(state.lower_bound, min(pair_chains.lower_bound(state.heuristic.tables), state.cost))
    for done in range(MAX_PAIR_CHAIN_SWEEPS):
        if state.closed:
            break
        gap, size = state.cost - state.lower_bound, len(state.trellis.dom)
        chosen, through = np.zeros(len(state.trellis.dom_ptr) - 1, dtype=np.int64), np.zeros(size)
        tables = state.heuristic.tables
        lower_bound = pair_chains.sweep(state.trellis, tables, through)
        heuristic.descend(state.trellis, Heuristic.of_pair_chains(tables), chosen)
        state.update(lower_bound, chosen, through)
        if state.found or not state.closed:
            trellis, tables = pair_chains.prune(state.trellis, tables, through, state.limit)
            state.replace(trellis, Heuristic.of_pair_chains(tables))
        if watcher.wants_stop() or (done and state.stalls(gap, size, 0.98)):
            break
