"""Better paths from a path: one lane, or one moment, made best while the rest stays as it is.

With all other lanes fixed a lane is a chain; with all other moments fixed the body is a tree. Both are solved exactly,
by dynamic programming, in turn, until neither finds anything better.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.trellis import Grid
from motionmind.search.trws import correction


@jit
def path_cost(grid: Grid, path: Ints) -> float:
    """The cost in nats of a path [n] (positions); infinite where it takes an edge that is not there."""
    cost = 0.0
    for i in range(len(path)):
        cost += grid.unary[path[i]] + coupling(grid, path, i, path[i])
        if i >= grid.lanes:
            cost += edge_cost(grid, path[i - grid.lanes], path[i])
    return cost


@jit
def polish(grid: Grid, path: Ints) -> float:
    """Improve a path [n] (positions) in place, lane by lane and moment by moment; its cost then."""
    cost = path_cost(grid, path)
    while True:
        for lane in range(grid.lanes):
            _best_lane(grid, path, lane)
        for t in range(1, grid.moves + 1):
            _best_moment(grid, path, t)
        better = path_cost(grid, path)
        if not better < cost - 1e-9:
            return min(better, cost)
        cost = better


@jit
def edge_cost(grid: Grid, p: int, x: int) -> float:
    """Cost of the edge from position p to x; infinite where there is none. Edges stand in order of where they lead."""
    low, high = grid.row_ptr[p], grid.row_ptr[p + 1]
    while low < high:
        middle = (low + high) // 2
        if grid.row_to[middle] < x:
            low = middle + 1
        else:
            high = middle
    return float(grid.row_cost[low]) if low < grid.row_ptr[p + 1] and grid.row_to[low] == x else np.inf


@jit
def coupling(grid: Grid, path: Ints, i: int, x: int) -> float:
    """Correction for position x of variable i with its parent variable's place in the path."""
    if grid.up_ptr[i + 1] == grid.up_ptr[i]:
        return 0.0
    above = i - i % grid.lanes + grid.parents[i % grid.lanes]
    return correction(grid, grid.up_ptr[i] + path[above] - grid.dom_ptr[above], x)


@jit
def _best_lane(grid: Grid, path: Ints, lane: int) -> None:
    """value[p]: the least that a lane costs from position p on, its own costs and its couplings to the others."""
    lanes = grid.lanes
    value = np.empty(grid.dom_ptr[grid.moves * lanes + lane + 1])
    for t in range(grid.moves, -1, -1):
        i = t * lanes + lane
        for p in range(grid.dom_ptr[i], grid.dom_ptr[i + 1]):
            rest = 0.0 if t == grid.moves else np.inf
            for e in range(grid.row_ptr[p], grid.row_ptr[p + 1]):
                rest = min(rest, grid.row_cost[e] + value[grid.row_to[e]])
            value[p] = rest + grid.unary[p] + coupling(grid, path, i, p)
            for child in range(lane + 1, lanes):
                below = i - lane + child
                if grid.parents[child] == lane and grid.up_ptr[below + 1] > grid.up_ptr[below]:
                    value[p] += correction(grid, grid.up_ptr[below] + p - grid.dom_ptr[i], path[below])
    for i in range(lane + lanes, len(path), lanes):
        before, least = path[i - lanes], np.inf
        for e in range(grid.row_ptr[before], grid.row_ptr[before + 1]):
            if grid.row_cost[e] + value[grid.row_to[e]] < least:
                least = grid.row_cost[e] + value[grid.row_to[e]]
                path[i] = grid.row_to[e]


@jit
def _best_moment(grid: Grid, path: Ints, t: int) -> None:
    """value[p]: the least that a lane and the lanes below it cost at move t with position p, to and from the path."""
    lanes = grid.lanes
    first = grid.dom_ptr[t * lanes]
    value = np.full(grid.dom_ptr[(t + 1) * lanes] - first, np.inf)
    for lane in range(lanes - 1, -1, -1):
        i = t * lanes + lane
        before = path[i - lanes]
        for e in range(grid.row_ptr[before], grid.row_ptr[before + 1]):
            p = grid.row_to[e]
            value[p - first] = grid.row_cost[e] + grid.unary[p]
            if t < grid.moves:
                value[p - first] += edge_cost(grid, p, path[i + lanes])
            for child in range(lane + 1, lanes):
                if grid.parents[child] == lane:
                    value[p - first] += _answer(grid, value, first, i - lane + child, p - grid.dom_ptr[i])[0]
    for lane in range(lanes):
        i, parent = t * lanes + lane, grid.parents[lane]
        above = -1 if parent < 0 else path[i - lane + parent] - grid.dom_ptr[i - lane + parent]
        path[i] = _answer(grid, value, first, i, above)[1]


@jit
def _answer(grid: Grid, value: Floats, first: int, i: int, above: int) -> tuple[float, int]:
    """The least cost of variable i when its parent is at `above` (an index; -1 for no parent), and where."""
    least, best = np.inf, -1
    u = grid.up_ptr[i] + above
    q, last = (grid.col_ptr[u], grid.col_ptr[u + 1]) if above >= 0 else (0, 0)
    for p in range(grid.dom_ptr[i], grid.dom_ptr[i + 1]):
        cost = value[p - first]
        if q < last and grid.col_to[q] == p:
            cost += grid.col_cost[q]
            q += 1
        if cost < least:
            least, best = cost, p
    return least, best
