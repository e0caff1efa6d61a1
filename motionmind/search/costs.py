"""The cost of a path of positions, and of one block of it, a chain or a moment, while the rest stays as it is.

With all other chains fixed a chain is a chain in time; with all other moves fixed the body at one move is a tree. Both
can be minimised (`motionmind.search.polish`) or sampled (`motionmind.search.sample`) exactly.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.csr import find_entry
from motionmind.search.trellis import Trellis, correction


@jit
def path_cost(trellis: Trellis, path: Ints) -> float:
    """Return the cost in nats of a path [n] of positions; infinite where it takes an edge that does not exist."""
    cost = 0.0
    for i in range(len(path)):
        cost += trellis.unary[path[i]] + _coupling(trellis, path, i, path[i])
        if i >= trellis.chains:
            cost += _edge_cost(trellis, path[i - trellis.chains], path[i])
    return cost


@jit
def add_couplings(trellis: Trellis, path: Ints, i: int, p: int, cost: float) -> float:
    """Add to `cost` the corrections, in nats, of position `p` of variable `i` with its parent and its children.

    All other variables are where `path` [n] has them.
    """
    chains, chain = trellis.chains, i % trellis.chains
    cost += _coupling(trellis, path, i, p)
    for child in range(chain + 1, chains):
        below = i - chain + child
        if trellis.parents[child] == chain and trellis.up_ptr[below + 1] > trellis.up_ptr[below]:
            cost += correction(trellis, trellis.up_ptr[below] + p - trellis.dom_ptr[i], path[below])
    return cost


@jit
def set_moment_costs(trellis: Trellis, path: Ints, i: int, costs: Floats) -> None:
    """Write what each position of variable `i` costs on its own, its edges from and to the path included, in nats.

    Args:
        trellis: the problem.
        path: positions [n] of all other moves.
        i: the variable, at move 1 or later.
        costs: costs of the positions of the variable's move, from the first on; unreachable ones are left as they are.
    """
    chains = trellis.chains
    before, first = path[i - chains], trellis.dom_ptr[i - i % chains]
    for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
        p = trellis.row_to[e]
        costs[p - first] = trellis.row_cost[e] + trellis.unary[p]
        if i + chains < len(path):
            costs[p - first] += _edge_cost(trellis, p, path[i + chains])


@jit
def _edge_cost(trellis: Trellis, p: int, x: int) -> float:
    """Return the cost of the edge from position `p` to `x`; infinite where there is none."""
    e = find_entry(trellis.row_ptr, trellis.row_to, p, x)
    return float(trellis.row_cost[e]) if e >= 0 else np.inf


@jit
def _coupling(trellis: Trellis, path: Ints, i: int, x: int) -> float:
    """Return the correction for position `x` of variable `i` with its parent variable as in the path."""
    if trellis.up_ptr[i + 1] == trellis.up_ptr[i]:
        return 0.0
    above = i - i % trellis.chains + trellis.parents[i % trellis.chains]
    return correction(trellis, trellis.up_ptr[i] + path[above] - trellis.dom_ptr[above], x)
