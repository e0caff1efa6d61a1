"""The heuristic of A*: the bound on the cost to go from a partial path, read from messages or from pair chains."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Ints
from motionmind.jit import jit
from motionmind.search import pair_chains, trws
from motionmind.search.pair_chain_tables import PairChains
from motionmind.search.trellis import Trellis
from motionmind.search.trws import Messages

_NO_FLOATS, _NO_INTS = np.zeros(0), np.zeros(0, np.int64)
_NO_MESSAGES = Messages(*(_NO_FLOATS,) * len(Messages._fields))
_NO_PAIR_CHAINS = PairChains(
    _NO_INTS, _NO_INTS, _NO_INTS, _NO_INTS, _NO_FLOATS, _NO_FLOATS, _NO_FLOATS, _NO_INTS, _NO_FLOATS, _NO_FLOATS,
    _NO_INTS, _NO_FLOATS,
)  # fmt: skip


class Heuristic(NamedTuple):
    """The messages after a backward sweep, or the pair chains; the arrays of the other are empty."""

    messages: Messages
    tables: PairChains

    @property
    def is_of_pair_chains(self) -> bool:
        """Whether the bound comes from pair chains."""
        return len(self.tables.partner) > 0

    @staticmethod
    def of_messages(messages: Messages) -> Heuristic:
        """Return the heuristic given by messages."""
        return Heuristic(messages, _NO_PAIR_CHAINS)

    @staticmethod
    def of_pair_chains(tables: PairChains) -> Heuristic:
        """Return the heuristic given by pair chains."""
        return Heuristic(_NO_MESSAGES, tables)


@jit
def from_start(heuristic: Heuristic) -> float:
    """Return the bound on the cost of every path, in nats: f of the start."""
    if len(heuristic.tables.partner) > 0:
        return pair_chains.lower_bound(heuristic.tables)
    return float(np.sum(heuristic.messages.constants))


@jit
def step(trellis: Trellis, heuristic: Heuristic, i: int, frontier: NDArray[np.uint16], e: int) -> float:
    """Return the growth in nats of f (cost so far plus the bound on the rest) with edge `e`.

    It is at least 0 up to rounding.

    Args:
        trellis: the problem.
        heuristic: its bound on the cost to go.
        i: the variable that takes the position that the edge leads to.
        frontier: last choice in each chain [L], as an index into its domain: at i's move for chains before i's, one
            move before for all others.
        e: an edge of i's chain.
    """
    if len(heuristic.tables.partner) > 0:
        return pair_chains.step(trellis, heuristic.tables, i, frontier, e)
    chain = i % trellis.chains
    parent = trellis.parents[chain]
    above = trellis.dom_ptr[i - chain + parent] + frontier[parent] if parent >= 0 else -1
    before = trellis.dom_ptr[i - trellis.chains] + frontier[chain]
    return trws.step(trellis, heuristic.messages, i, before, above, e)


@jit
def descend(trellis: Trellis, heuristic: Heuristic, path: Ints) -> None:
    """Write to `path` [n] the positions with the least growth of f at each variable (greedy descent)."""
    chains = trellis.chains
    frontier = np.zeros(chains, np.uint16)
    for chain in range(chains):
        path[chain] = trellis.dom_ptr[chain]
    for i in range(chains, len(path)):
        before, least = path[i - chains], np.inf
        for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
            grown = step(trellis, heuristic, i, frontier, e)
            if grown < least:
                least, path[i] = grown, trellis.row_to[e]
        frontier[i % chains] = path[i] - trellis.dom_ptr[i]
