"""Better paths from a path: one chain, or one moment, made best while the rest stays as it is.

With all other chains fixed a chain is a chain; with all other moments fixed the body is a tree. Both are solved
exactly, by dynamic programming, in turn, until neither finds anything better.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.trellis import Trellis
from motionmind.search.trws import correction


@jit
def path_cost(trellis: Trellis, path: Ints) -> float:
    """The cost in nats of a path [n] (positions); infinite where it takes an edge that is not there."""
    cost = 0.0
    for i in range(len(path)):
        cost += trellis.unary[path[i]] + coupling(trellis, path, i, path[i])
        if i >= trellis.chains:
            cost += edge_cost(trellis, path[i - trellis.chains], path[i])
    return cost


@jit
def polish(trellis: Trellis, path: Ints) -> float:
    """Improve a path [n] (positions) in place, chain by chain and moment by moment; its cost then."""
    cost = path_cost(trellis, path)
    while True:
        for chain in range(trellis.chains):
            _best_chain(trellis, path, chain)
        for t in range(1, trellis.moves + 1):
            _best_moment(trellis, path, t)
        better = path_cost(trellis, path)
        if not better < cost - 1e-9:
            return min(better, cost)
        cost = better


@jit
def edge_cost(trellis: Trellis, p: int, x: int) -> float:
    """Cost of the edge from position p to x; infinite where there is none. Edges stand in order of where they lead."""
    low, high = trellis.row_ptr[p], trellis.row_ptr[p + 1]
    while low < high:
        middle = (low + high) // 2
        if trellis.row_to[middle] < x:
            low = middle + 1
        else:
            high = middle
    return float(trellis.row_cost[low]) if low < trellis.row_ptr[p + 1] and trellis.row_to[low] == x else np.inf


@jit
def coupling(trellis: Trellis, path: Ints, i: int, x: int) -> float:
    """Correction for position x of variable i with its parent variable's place in the path."""
    if trellis.up_ptr[i + 1] == trellis.up_ptr[i]:
        return 0.0
    above = i - i % trellis.chains + trellis.parents[i % trellis.chains]
    return correction(trellis, trellis.up_ptr[i] + path[above] - trellis.dom_ptr[above], x)


@jit
def _best_chain(trellis: Trellis, path: Ints, chain: int) -> None:
    """value[p]: the least that a chain costs from position p on, its own costs and its couplings to the others."""
    chains = trellis.chains
    value = np.empty(trellis.dom_ptr[trellis.moves * chains + chain + 1])
    for t in range(trellis.moves, -1, -1):
        i = t * chains + chain
        for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
            rest = 0.0 if t == trellis.moves else np.inf
            for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
                rest = min(rest, trellis.row_cost[e] + value[trellis.row_to[e]])
            value[p] = rest + trellis.unary[p] + coupling(trellis, path, i, p)
            for child in range(chain + 1, chains):
                below = i - chain + child
                if trellis.parents[child] == chain and trellis.up_ptr[below + 1] > trellis.up_ptr[below]:
                    value[p] += correction(trellis, trellis.up_ptr[below] + p - trellis.dom_ptr[i], path[below])
    for i in range(chain + chains, len(path), chains):
        before, least = path[i - chains], np.inf
        for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
            if trellis.row_cost[e] + value[trellis.row_to[e]] < least:
                least = trellis.row_cost[e] + value[trellis.row_to[e]]
                path[i] = trellis.row_to[e]


@jit
def _best_moment(trellis: Trellis, path: Ints, t: int) -> None:
    """value[p]: the least that a chain and the chains below it cost at move t with position p, to and from the path."""
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
                    value[p - first] += _answer(trellis, value, first, i - chain + child, p - trellis.dom_ptr[i])[0]
    for chain in range(chains):
        i, parent = t * chains + chain, trellis.parents[chain]
        above = -1 if parent < 0 else path[i - chain + parent] - trellis.dom_ptr[i - chain + parent]
        path[i] = _answer(trellis, value, first, i, above)[1]


@jit
def _answer(trellis: Trellis, value: Floats, first: int, i: int, above: int) -> tuple[float, int]:
    """The least cost of variable i when its parent is at `above` (an index; -1 for no parent), and where."""
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
