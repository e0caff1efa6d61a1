"""Improve a path: minimise one chain or one move exactly, with the rest fixed, until nothing improves.

Dynamic programming solves both: along a chain backwards in time, at a move up the tree. It skips positions that only
costlier paths go through: half of a large trellis.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.jit import jit
from motionmind.search.costs import edge_cost, path_cost
from motionmind.search.tolerances import SAME_COST_NATS
from motionmind.search.trellis import Trellis, correction


@jit
def polish(trellis: Trellis, path: Ints, through: Floats) -> float:
    """Improve a path [n] of positions in place, chain by chain and move by move, and return its cost in nats.

    Skip a chain or move if neither it nor its neighbours changed since it was last minimised.

    Args:
        trellis: the problem.
        path: the path.
        through: a lower bound on the cost of every path through each position, nats [P].
    """
    chains, cost = trellis.chains, path_cost(trellis, path)
    kept = _useful_positions(path, through, cost)
    chain_pending, move_pending = np.ones(chains, np.bool_), np.ones(trellis.moves + 2, np.bool_)
    while True:
        for chain in range(chains):
            if chain_pending[chain]:
                before, moved = path.copy(), False
                minimise_chain(trellis, path, chain, kept)
                chain_pending[chain] = False
                for t in range(1, trellis.moves + 1):
                    if path[t * chains + chain] != before[t * chains + chain]:
                        moved = move_pending[t - 1] = move_pending[t] = move_pending[t + 1] = True
                if moved:
                    _mark_neighbours(trellis, chain, chain_pending)
                    kept = _useful_positions(path, through, path_cost(trellis, path))
        for t in range(1, trellis.moves + 1):
            if move_pending[t]:
                before = path.copy()
                minimise_move(trellis, path, t, kept)
                move_pending[t] = False
                for chain in range(chains):
                    if path[t * chains + chain] != before[t * chains + chain]:
                        move_pending[t - 1] = move_pending[t + 1] = chain_pending[chain] = True
                        _mark_neighbours(trellis, chain, chain_pending)
        better = path_cost(trellis, path)
        if not better < cost - SAME_COST_NATS:
            return min(better, cost)
        cost = better


@jit
def _useful_positions(path: Ints, through: Floats, cost: float) -> Bools:
    """Return a mask of the positions [P] of `path` and of all that paths of at most `cost` nats may go through."""
    kept = through <= cost + 1e-6  # nats, more than the rounding of bounds
    for p in path:
        kept[p] = True
    return kept


@jit
def _mark_neighbours(trellis: Trellis, chain: int, pending: Bools) -> None:
    """Mark a changed chain's parent and children for minimisation."""
    if trellis.parents[chain] >= 0:
        pending[trellis.parents[chain]] = True
    for child in range(chain + 1, trellis.chains):
        if trellis.parents[child] == chain:
            pending[child] = True


@jit
def minimise_chain(trellis: Trellis, path: Ints, chain: int, kept: Bools) -> None:
    """Replace a chain's positions by the cheapest of the kept ones [P], given the other chains.

    value[p] is the least cost of the chain from position p on, its couplings to the others included.
    """
    chains = trellis.chains
    value = np.full(trellis.dom_ptr[trellis.moves * chains + chain + 1], np.inf)
    for t in range(trellis.moves, 0, -1):
        i = t * chains + chain
        first, end = trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
        for p in range(first, end):
            if kept[p]:
                rest = 0.0 if t == trellis.moves else np.inf
                for e in range(np.uint64(trellis.row_ptr[p]), np.uint64(trellis.row_ptr[p + 1])):
                    rest = min(rest, trellis.row_cost[e] + value[np.uint64(trellis.row_to[e])])
                value[p] = rest + trellis.unary[p]
        for child in range(chain + 1, chains):
            if trellis.parents[child] == chain:
                rows, x = trellis.up_ptr[i - chain + child], path[i - chain + child]
                for p in range(first, end):
                    if value[p] < np.inf:
                        value[p] += correction(trellis, rows + p - first, x)
        if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
            above = i - chain + trellis.parents[chain]
            u = trellis.up_ptr[i] + path[above] - trellis.dom_ptr[above]
            for q in range(trellis.col_ptr[u], trellis.col_ptr[u + 1]):
                value[trellis.col_to[q]] += trellis.col_cost[q]
    for i in range(chain + chains, len(path), chains):
        before, least = path[i - chains], np.inf
        for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
            if trellis.row_cost[e] + value[trellis.row_to[e]] < least:
                least = trellis.row_cost[e] + value[trellis.row_to[e]]
                path[i] = trellis.row_to[e]


@jit
def minimise_move(trellis: Trellis, path: Ints, t: int, kept: Bools) -> None:
    """Replace all positions at move t by the cheapest of the kept ones [P], given the other moves.

    value[p] is the least cost of a chain with position p and of the chains below it in the tree.
    """
    chains = trellis.chains
    first = trellis.dom_ptr[t * chains]
    value = np.full(trellis.dom_ptr[(t + 1) * chains] - first, np.inf)
    best = np.empty(chains, np.int64)  # position of each chain that has the least value
    for chain in range(chains - 1, -1, -1):
        i, least = t * chains + chain, np.inf
        edges = range(trellis.row_ptr[path[i - chains]], trellis.row_ptr[path[i - chains] + 1])
        for e in edges:
            p = trellis.row_to[e]
            if kept[p]:
                cost = trellis.row_cost[e] + trellis.unary[p]
                if t < trellis.moves:
                    cost += edge_cost(trellis, p, path[i + chains])
                value[p - first] = cost
        for child in range(chain + 1, chains):
            if trellis.parents[child] == chain:
                below = i - chain + child
                for e in edges:
                    p = trellis.row_to[e]
                    if value[p - first] < np.inf:
                        above = p - trellis.dom_ptr[i]
                        value[p - first] += _least_below(trellis, path, value, first, below, above, best[child])
        best[chain] = first
        for e in edges:
            p = trellis.row_to[e]
            if value[p - first] < least:
                least, best[chain] = value[p - first], p
    for chain in range(chains):
        i, parent = t * chains + chain, trellis.parents[chain]
        above = -1 if parent < 0 else path[i - chain + parent] - trellis.dom_ptr[i - chain + parent]
        path[i] = _cheapest(trellis, path, value, first, i, above)[1]


@jit
def _least_below(trellis: Trellis, path: Ints, value: Floats, first: int, i: int, above: int, best: int) -> float:
    """Return the least cost of variable i, like `_cheapest`, where position `best` has the least value.

    Unless `best` costs more with this parent, only positions that cost less with it can do better.
    """
    u = trellis.up_ptr[i] + above
    least, more = value[best - first], 0.0
    for q in range(np.uint64(trellis.col_ptr[u]), np.uint64(trellis.col_ptr[u + 1])):
        x = np.uint64(trellis.col_to[q])
        least = min(least, value[x - np.uint64(first)] + trellis.col_cost[q])
        if x == np.uint64(best):
            more = trellis.col_cost[q]
    return _cheapest(trellis, path, value, first, i, above)[0] if more > 0.0 else least


@jit
def _cheapest(trellis: Trellis, path: Ints, value: Floats, first: int, i: int, above: int) -> tuple[float, int]:
    """Return the least cost of variable i, and its position, where its parent has index `above` (-1 for no parent).

    Choose among the positions that its chain's position one move before leads to.
    """
    least, best, before = np.inf, -1, path[i - trellis.chains]
    u = trellis.up_ptr[i] + above
    q, last = (trellis.col_ptr[u], trellis.col_ptr[u + 1]) if above >= 0 else (0, 0)
    for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
        p = trellis.row_to[e]
        while q < last and trellis.col_to[q] < p:
            q += 1
        cost = value[p - first]
        if q < last and trellis.col_to[q] == p:
            cost += trellis.col_cost[q]
        if cost < least:
            least, best = cost, p
    return least, best
