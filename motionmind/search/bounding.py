"""Bound a trellis from both sides, until the least that a path can cost meets the best path found, or hardly moves.

Rounds of sweeps raise the lower bound; each also finds a path, which is polished, and removes from the trellis the
positions that no path as cheap as the best goes through. This is what A* starts from: the last bound is its heuristic,
the best path its incumbent, and what is left of the trellis, in which the best path stays, its problem.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.search import heuristic, pair_chains, trws
from motionmind.search.attention import Attention
from motionmind.search.costs import path_cost
from motionmind.search.heuristic import Heuristic
from motionmind.search.pair_chain_tables import count_pairs
from motionmind.search.polish import polish
from motionmind.search.trellis import Trellis, states_of

SWEEPS_AT_ONCE = 2  # few, since pruning pays at once: 2 is fastest of 1 to 8 on real ballet
SWEEPS_AT_FIRST = 3  # of the whole trellis: what one more prunes of it is worth more than polishing the path there
STALLED = (
    0.9  # message sweeps that leave more than this share of the gap, and of the positions, give way to pair chains
)
PAIR_CHAIN_SWEEPS = 100  # at most, for each number of moves
PAIR_CHAINS_STALLED = 0.98  # as STALLED; then A* takes over
WORTH_POLISHING = 0.1  # paths that cost more than this share above the best are not polished
MOST_PAIRS = 1 << 23  # pairs of states in pair chains, 32 bytes each; more are not built, nor kept for A*
PROVEN = 1e-6  # nats: a path within this of its lower bound is reported as optimal
HAIR = 1e-8  # nats: more than rounding moves the cost of a path, less than anyone asks for


class Bounded:
    """Bounds on one trellis.

    Attributes:
        trellis: what is left of it, in its memory; no path cheaper than `cost` lies outside, nor does the best path
            found.
        heuristic: the bound on the cost to go that was proven last.
        cost: cost of the best path found, or what it has to be cheaper than, nats.
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
        """Whether bound and path meet, or nothing is left that a better path could go through."""
        return self.lower_bound >= self.cost - PROVEN

    @property
    def limit(self) -> float:
        """Cost in nats below which paths are of interest, the best path found among them."""
        return self.cost + HAIR if self.found else self.cost - HAIR

    def update(self, lower_bound: float, chosen: Ints, through: Floats | None) -> None:
        """Take in a bound, and a path of positions [n], which is polished if it is near the best.

        Args:
            lower_bound: of all paths, nats.
            chosen: the path.
            through: lower bounds on the cost of every path through each position, nats [P]; None to leave the path as
                it is.
        """
        cost = path_cost(self.trellis, chosen)
        if through is not None and cost <= self.cost + WORTH_POLISHING * abs(self.cost):
            cost = polish(self.trellis, chosen, through)
        if cost < self.cost:
            self.cost, self.states = cost, states_of(self.trellis, chosen)
        self.lower_bound = min(max(self.lower_bound, lower_bound), self.cost)

    def take(self, cost: float, states: Int32s, lower_bound: float) -> None:
        """Take in a bound, and a path [T + 1, L] that is as good as the best known but for rounding, or better."""
        if cost <= self.limit:
            self.cost, self.states = cost, states
        self.lower_bound = min(max(self.lower_bound, lower_bound), self.cost)

    def undercut(self, below: float) -> None:
        """Look for paths cheaper than `below` nats from now on; one that is not is no longer of interest."""
        if below < self.cost:
            self.cost, self.states = below, self.states[:0]
            self.lower_bound = min(self.lower_bound, below)

    def replace(self, trellis: Trellis, heuristic: Heuristic) -> None:
        """Go on with a pruned trellis; if one of its domains is empty, no path below the limit is left."""
        if np.any(np.diff(trellis.dom_ptr) == 0):
            self.lower_bound = self.cost
        else:
            self.trellis, self.heuristic = trellis, heuristic

    def stalls(self, gap: float, size: int, share: float) -> bool:
        """Return whether more than a share is left of an earlier gap, and of an earlier number of positions."""
        return self.cost - self.lower_bound > share * gap and len(self.trellis.dom) > share * size


def tighten(state: Bounded, sweeps: int, attention: Attention) -> None:
    """Tighten the bounds of a trellis by messages, `sweeps` pairs at most; then, if need be, by pair chains."""
    _tighten_by_messages(state, sweeps, attention)
    several = state.trellis.chains > 1
    if not (state.closed or attention.ends()) and several and count_pairs(state.trellis) <= MOST_PAIRS:
        tables = pair_chains.build(state.trellis, state.heuristic.messages)
        state.heuristic = Heuristic.of_pair_chains(tables)
        tighten_by_pair_chains(state, attention)


def _tighten_by_messages(state: Bounded, sweeps: int, attention: Attention) -> None:
    """Tighten by messages until bound and path meet, the gap between them hardly shrinks, or the search is to end."""
    messages, done = trws.no_messages(state.trellis), 0
    while done < sweeps:
        first, gap, size = done == 0, state.cost - state.lower_bound, len(state.trellis.dom)
        at_once = min(SWEEPS_AT_FIRST if first else SWEEPS_AT_ONCE, sweeps - done)
        chosen = np.zeros(len(state.trellis.dom_ptr) - 1, dtype=np.int64)
        lower_bound, _ = trws.tighten(state.trellis, messages, chosen, at_once, state.cost)
        done += at_once
        last = done >= sweeps or attention.ends()
        # The first path only has to prune; it is polished where there will be no other.
        state.update(lower_bound, chosen, messages.through if last or not first else None)
        if state.closed and not state.found:
            break
        # Of the whole trellis much is left; later, little, and what is kept for A* is to be no larger than that.
        trellis, messages = trws.prune(state.trellis, messages, state.limit, first)
        state.replace(trellis, Heuristic.of_messages(messages))
        if state.closed or last or (not first and state.stalls(gap, size, STALLED)):
            break


def tighten_by_pair_chains(state: Bounded, attention: Attention) -> None:
    """Tighten further by the pair chains that are the heuristic, in the same way."""
    state.lower_bound = max(state.lower_bound, min(pair_chains.lower_bound(state.heuristic.tables), state.cost))
    for done in range(PAIR_CHAIN_SWEEPS):
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
        if attention.ends() or (done and state.stalls(gap, size, PAIR_CHAINS_STALLED)):
            break
