"""Costs of a path of positions, of its edges and of its couplings.

Polishing and sampling sum the costs of a chain or a move in their own loops: shared functions made polishing 1.4 times
slower.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Ints
from motionmind.jit import jit
from motionmind.search.trellis import Trellis, correction


@jit
def path_cost(trellis: Trellis, path: Ints) -> float:
    """Return the cost in nats of a path [n] of positions; infinite where it takes an edge that does not exist."""
    cost = 0.0
    for i in range(len(path)):
        cost += trellis.unary[path[i]] + coupling(trellis, path, i, path[i])
        if i >= trellis.chains:
            cost += edge_cost(trellis, path[i - trellis.chains], path[i])
    return cost


@jit
def edge_cost(trellis: Trellis, p: int, x: int) -> float:
    """Return the cost of the edge from position `p` to `x`; infinite where there is none.

    The binary search is inlined here and in `correction`: a shared function slowed polishing.
    """
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
    """Return the correction for position `x` of variable `i` with its parent variable as in the path."""
    if trellis.up_ptr[i + 1] == trellis.up_ptr[i]:
        return 0.0
    above = i - i % trellis.chains + trellis.parents[i % trellis.chains]
    return correction(trellis, trellis.up_ptr[i] + path[above] - trellis.dom_ptr[above], x)
