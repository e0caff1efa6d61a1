"""Improve a path: minimise one chain, or one moment, exactly, while the rest stays as it is, until nothing improves.

Both are solved by dynamic programming: along a chain backwards in time, at a moment up the tree.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.jit import jit
from motionmind.search.costs import coupling, edge_cost, path_cost
from motionmind.search.trellis import Trellis, correction


@jit
def polish(trellis: Trellis, path: Ints) -> float:
    """Improve a path [n] of positions in place, chain by chain and moment by moment, and return its cost in nats.

    What lies as it did when it was last minimised, between neighbours that do, is not minimised again.
    """
    chains, cost = trellis.chains, path_cost(trellis, path)
    chain_waits, moment_waits = np.ones(chains, np.bool_), np.ones(trellis.moves + 2, np.bool_)
    while True:
        for chain in range(chains):
            if chain_waits[chain]:
                before = path[chain::chains].copy()
                minimise_chain(trellis, path, chain)
                chain_waits[chain] = False
                for move in np.flatnonzero(path[chain::chains] != before):
                    moment_waits[move - 1 : move + 2] = True
                    _wake_neighbours(trellis, chain, chain_waits)
        for t in range(1, trellis.moves + 1):
            if moment_waits[t]:
                before = path[t * chains : (t + 1) * chains].copy()
                minimise_moment(trellis, path, t)
                moment_waits[t] = False
                for changed in np.flatnonzero(path[t * chains : (t + 1) * chains] != before):
                    moment_waits[t - 1] = moment_waits[t + 1] = chain_waits[changed] = True
                    _wake_neighbours(trellis, int(changed), chain_waits)
        better = path_cost(trellis, path)
        if not better < cost - 1e-9:
            return min(better, cost)
        cost = better


@jit
def _wake_neighbours(trellis: Trellis, chain: int, waits: Bools) -> None:
    """Note that a chain's parent and children wait to be minimised, for it has changed."""
    if trellis.parents[chain] >= 0:
        waits[trellis.parents[chain]] = True
    for child in range(chain + 1, trellis.chains):
        if trellis.parents[child] == chain:
            waits[child] = True


@jit
def minimise_chain(trellis: Trellis, path: Ints, chain: int) -> None:
    """Replace a chain's positions by the cheapest, given the other chains.

    value[p] is the least cost of the chain from position p on, its couplings to the others included.
    """
    chains = trellis.chains
    value = np.empty(trellis.dom_ptr[trellis.moves * chains + chain + 1])
    for t in range(trellis.moves, 0, -1):
        i = t * chains + chain
        for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
            rest = 0.0 if t == trellis.moves else np.inf
            for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
                rest = min(rest, trellis.row_cost[e] + value[trellis.row_to[e]])
            value[p] = rest + trellis.unary[p] + coupling(trellis, path, i, p)
            for child in range(chain + 1, chains):
                below = i - chain + child
                if trellis.parents[child] == chain:
                    value[p] += correction(trellis, trellis.up_ptr[below] + p - trellis.dom_ptr[i], path[below])
    for i in range(chain + chains, len(path), chains):
        before, least = path[i - chains], np.inf
        for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
            if trellis.row_cost[e] + value[trellis.row_to[e]] < least:
                least = trellis.row_cost[e] + value[trellis.row_to[e]]
                path[i] = trellis.row_to[e]


@jit
def minimise_moment(trellis: Trellis, path: Ints, t: int) -> None:
    """Replace all positions at move t by the cheapest, given the other moves.

    value[p] is the least cost of a chain with position p and of the chains below it in the tree.
    """
    chains = trellis.chains
    first = trellis.dom_ptr[t * chains]
    value = np.full(trellis.dom_ptr[(t + 1) * chains] - first, np.inf)
    for chain in range(chains - 1, -1, -1):
        i = t * chains + chain
        before = path[i - chains]
        for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
            p = trellis.row_to[e]
            value[p - first] = trellis.row_cost[e] + trellis.unary[p]
            if t < trellis.moves:
                value[p - first] += edge_cost(trellis, p, path[i + chains])
            for child in range(chain + 1, chains):
                if trellis.parents[child] == chain:
                    value[p - first] += _cheapest(trellis, value, first, i - chain + child, p - trellis.dom_ptr[i])[0]
    for chain in range(chains):
        i, parent = t * chains + chain, trellis.parents[chain]
        above = -1 if parent < 0 else path[i - chain + parent] - trellis.dom_ptr[i - chain + parent]
        path[i] = _cheapest(trellis, value, first, i, above)[1]


@jit
def _cheapest(trellis: Trellis, value: Floats, first: int, i: int, above: int) -> tuple[float, int]:
    """Return the least cost of variable i, and its position, where its parent has index `above` (-1 for no parent)."""
    least, best = np.inf, -1
    u = trellis.up_ptr[i] + above
    q, last = (trellis.col_ptr[u], trellis.col_ptr[u + 1]) if above >= 0 else (0, 0)
    for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
        cost = value[p - first]
        if q < last and trellis.col_to[q] == p:
            cost += trellis.col_cost[q]
            q += 1
        if cost < least:
            least, best = cost, p
    return least, best
