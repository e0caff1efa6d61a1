"""Pair chains: a tighter bound, from dynamic programming over pairs of chains.

Messages along single edges cannot see around a cycle: they let a variable be half one value and half another. Two
coupled chains form a *pair chain*, one chain of pairs of states, whose least cost dynamic programming finds exactly.
Every chain but the first forms a pair chain with its *partner*: its parent, or the first chain if it has no parent.
Each coupling belongs to one pair chain; a chain's own costs, of its states and edges, are shared among all its pair
chains. Whatever the shares, the least costs of all pair chains add up to a lower bound on the trellis.

Coordinate ascent improves the shares. The *min-marginal* of a pair chain for a position of a variable is its least cost
with that position: the minimum of so_far + to_go. Moving shares until all pair chains of the variable have the same
min-marginals, their mean, never lowers the bound: n pair chains with mean m(x) cost n min m(x) together, at least the
sum of their minima before. The edges between a variable and its chain's next are treated alike. Sweeps go forward and
back along the moves, as with messages; so_far stays up to date in the forward sweep, and to_go in the backward sweep.

With values chosen for all variables up to one, the least remaining cost of the pair chains bounds the cost to go, and
it grows consistently along a path (`step`): this estimate guides A*. The min-marginals of a variable's pair chains for
a position, plus the least costs of the other pair chains, bound all paths through the position.

Sources: Komodakis, Paragios and Tziritas, "MRF energy minimization and beyond via dual decomposition", IEEE TPAMI
33(3), 2011; Kolmogorov, "A new look at reweighted message passing", IEEE TPAMI 37(5), 2015 (the averaging in order).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Bools, Floats, Ints
from motionmind.jit import jit
from motionmind.search.pair_chain_tables import (
    PairChains,
    empty,
    fill_to_go,
    least_moved,
    pair_chains_of,
    partner_edge_share,
    partner_of,
    partners,
    pull_to_go,
    push_so_far,
    size_of,
)
from motionmind.search.trellis import Trellis, coupling_rows, positions_above, reachable, subset
from motionmind.search.trws import Messages


def build(trellis: Trellis, messages: Messages) -> PairChains:
    """Build the pair chains of a trellis, sharing the costs evenly as reparametrised by messages."""
    chains, tables = trellis.chains, empty(trellis)
    theta, edge = _reparametrise(trellis, messages)
    shares = 1.0 / (np.diff(tables.child_ptr) + (np.arange(chains) > 0))  # of each chain in the pair chains it is in
    first = np.empty(trellis.up_ptr[-1], np.int64)  # pair of each coupling row, less the variable's first position
    own, out, rows = _slices(trellis.dom_ptr), _slices(trellis.row_ptr[trellis.dom_ptr]), _slices(trellis.up_ptr)
    pairs, borne = _slices(tables.pair_ptr), _slices(tables.partner_ptr)
    for i, a in zip(*map(np.ndarray.tolist, partners(trellis)), strict=True):
        mine, theirs = shares[i % chains], shares[a % chains]
        tables.edge_share[out[i]], tables.partner_share[borne[i]] = mine * edge[out[i]], theirs * edge[out[a]]
        cost = tables.pair_cost[pairs[i]].reshape(own[a].stop - own[a].start, -1)  # written to in place
        np.add(theirs * theta[own[a], None], mine * theta[own[i]], out=cost)
        if rows[i].stop > rows[i].start:
            cost -= messages.up_col[rows[i], None] + messages.down_col[own[i]]
            first[rows[i]] = pairs[i].start - own[i].start + cost.shape[1] * np.arange(len(cost))
    tables.pair_cost[np.repeat(first, np.diff(trellis.col_ptr)) + trellis.col_to] += trellis.col_cost
    fill_to_go(trellis, tables)
    return tables


def _slices(ptr: Ints) -> list[slice]:
    """Return the slices between row pointers."""
    return [slice(first, end) for first, end in pairwise(ptr.tolist())]


@jit
def sweep(trellis: Trellis, tables: PairChains, through: Floats) -> float:
    """Sweep once forward and once back, and return the lower bound that this proves, in nats.

    Args:
        trellis: the problem.
        tables: its pair chains, improved in place.
        through: receives a lower bound on the cost of every path through each position, nats [P].
    """
    chains = trellis.chains
    for t in range(trellis.moves + 1):
        for i in range(t * chains + 1, (t + 1) * chains):
            push_so_far(trellis, tables, i)
        for i in range(t * chains, (t + 1) * chains):
            _average_positions(trellis, tables, i)
        if t < trellis.moves:
            for i in range(t * chains, (t + 1) * chains):
                _average_edges(trellis, tables, i)
    least = np.zeros(chains)
    for t in range(trellis.moves, -1, -1):
        if t < trellis.moves:
            for i in range((t + 1) * chains - 1, t * chains - 1, -1):
                _average_edges(trellis, tables, i)
            for i in range(t * chains + 1, (t + 1) * chains):
                pull_to_go(trellis, tables, i + chains)
        for i in range((t + 1) * chains - 1, t * chains - 1, -1):
            _average_positions(trellis, tables, i)
        begin, end = trellis.dom_ptr[t * chains], trellis.dom_ptr[(t + 1) * chains]
        for p in range(begin, end):
            through[p] = 0.0
        for i in range(t * chains + 1, (t + 1) * chains):
            for j in (i, partner_of(trellis, i)):
                minima = _position_minima(trellis, tables, i, j)
                if j == i:
                    least[i % chains] = np.min(minima)
                for p in range(len(minima)):
                    through[trellis.dom_ptr[j] + p] += minima[p] - least[i % chains]
        whole = np.sum(least)
        for p in range(begin, end):
            through[p] += whole
    return float(np.sum(least))


@jit
def lower_bound(tables: PairChains) -> float:
    """Return the lower bound in nats: the least cost of all pair chains from the start on."""
    bound = 0.0
    for chain in range(1, len(tables.partner)):
        bound += tables.pair_cost[tables.pair_ptr[chain]] + tables.to_go[tables.pair_ptr[chain]]
    return bound


def prune(trellis: Trellis, tables: PairChains, through: Floats, below: float) -> tuple[Trellis, PairChains]:
    """Remove the positions that no path cheaper than `below` goes through; return the rest with its pair chains.

    If there is no such path, a domain is left empty, and the pair chains are meaningless.

    Args:
        trellis: the problem.
        tables: its pair chains.
        through: a lower bound on the cost of every path through each position, nats [P].
        below: nats.
    """
    kept = reachable(trellis, through, below)
    smaller = subset(trellis, kept, coupling_rows(trellis, kept), False)
    fewer = empty(smaller)
    if np.any(np.diff(smaller.dom_ptr) == 0):
        return smaller, fewer
    edges = np.repeat(kept, np.diff(trellis.row_ptr)) & kept[trellis.row_to]
    _keep_shares(trellis, tables, kept, fewer)
    fewer.edge_share[:] = tables.edge_share[edges]
    fill_to_go(smaller, fewer)
    return smaller, fewer


@jit
def _keep_shares(trellis: Trellis, tables: PairChains, kept: Bools, fewer: PairChains) -> None:
    """Write the costs of pairs of kept positions [P], and the shares of partners' edges between them."""
    pair = entry = 0
    for i in range(len(trellis.dom_ptr) - 1):
        if i % trellis.chains == 0:
            continue
        a, first, last = partner_of(trellis, i), trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
        borne = tables.partner_ptr[i] - trellis.row_ptr[trellis.dom_ptr[a]]
        for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
            if kept[p]:
                base = tables.pair_ptr[i] + (p - trellis.dom_ptr[a]) * (last - first) - first
                for x in range(first, last):
                    if kept[x]:
                        fewer.pair_cost[pair] = tables.pair_cost[base + x]
                        pair += 1
                for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
                    if kept[trellis.row_to[e]]:
                        fewer.partner_share[entry] = tables.partner_share[borne + e]
                        entry += 1


@jit
def step(trellis: Trellis, tables: PairChains, i: int, frontier: NDArray[np.uint16], e: int) -> float:
    """Return the growth in nats of f (cost so far plus the bound on the rest) with edge `e`.

    It is at least 0 up to rounding.

    Args:
        trellis: the problem.
        tables: its pair chains.
        i: the variable that takes the position that the edge leads to.
        frontier: last choice in each chain [L], as an index into its domain: at i's move for chains before i's, one
            move before for all others.
        e: an edge of i's chain.
    """
    chain = i % trellis.chains
    b = i - trellis.chains
    before, x = frontier[chain], trellis.row_to[e] - trellis.dom_ptr[i]
    grown = 0.0
    if chain > 0:
        partner = frontier[tables.partner[chain]]
        k = tables.pair_ptr[i] + partner * size_of(trellis, i) + x
        grown += (
            tables.edge_share[e]
            + tables.pair_cost[k]
            + tables.to_go[k]
            - tables.half[tables.half_ptr[i] + partner * size_of(trellis, b) + before]
        )
    for k in range(tables.child_ptr[chain], tables.child_ptr[chain + 1]):
        c = b - chain + tables.children[k]
        size, y = size_of(trellis, c), frontier[tables.children[k]]
        grown += tables.partner_share[tables.partner_ptr[c] + e - trellis.row_ptr[trellis.dom_ptr[b]]]
        grown += (
            tables.half[tables.half_ptr[c + trellis.chains] + x * size + y]
            - tables.to_go[tables.pair_ptr[c] + before * size + y]
        )
    return grown


# --- shares ----------------------------------------------------------------------------------------------------------


def _reparametrise(trellis: Trellis, messages: Messages) -> tuple[Floats, Floats]:
    """Return the costs of positions plus all messages to them [P], and of edges along chains less those [R]."""
    theta, edge = trellis.unary + messages.down_row + messages.up_row + messages.down_col, trellis.row_cost.copy()
    above, _ = positions_above(trellis.chains, trellis.parents, trellis.dom_ptr, trellis.up_ptr)
    np.add.at(theta, above, messages.up_col)
    edge -= np.repeat(messages.up_row, np.diff(trellis.row_ptr)) + messages.down_row[trellis.row_to]
    return theta, edge


@jit
def _average_positions(trellis: Trellis, tables: PairChains, i: int) -> None:
    """Move shares of the positions of variable i until its pair chains have the same min-marginals."""
    members = pair_chains_of(tables, i % trellis.chains)
    if len(members) < 2 or size_of(trellis, i) < 2:
        return
    first = i - i % trellis.chains
    minima = np.empty((len(members), size_of(trellis, i)))
    mean = np.zeros(minima.shape[1])
    for k in range(len(members)):
        of_one = _position_minima(trellis, tables, first + members[k], i)
        for x in range(len(mean)):
            minima[k, x] = of_one[x]
            mean[x] += of_one[x]
    mean /= len(members)
    for k in range(len(members)):
        j, more = first + members[k], mean - minima[k]
        size = size_of(trellis, j)
        for p in range(size_of(trellis, partner_of(trellis, j))):
            base = tables.pair_ptr[j] + p * size
            for x in range(size):
                tables.pair_cost[base + x] += more[x] if j == i else more[p]
                tables.so_far[base + x] += more[x] if j == i else more[p]


@jit
def _average_edges(trellis: Trellis, tables: PairChains, i: int) -> None:
    """Move shares of the edges out of variable i until its pair chains have the same min-marginals."""
    members = pair_chains_of(tables, i % trellis.chains)
    if len(members) < 2 or (size_of(trellis, i) < 2 and size_of(trellis, i + trellis.chains) < 2):
        return
    first = i - i % trellis.chains
    begin, end = trellis.row_ptr[trellis.dom_ptr[i]], trellis.row_ptr[trellis.dom_ptr[i + 1]]
    minima = np.empty((len(members), end - begin))
    mean = np.zeros(end - begin)
    for k in range(len(members)):
        j = first + members[k]
        of_one = _edge_minima(trellis, tables, j) if j == i else _partner_edge_minima(trellis, tables, j)
        for e in range(len(mean)):
            minima[k, e] = of_one[e]
            mean[e] += of_one[e]
    mean /= len(members)
    for k in range(len(members)):
        j, more = first + members[k], mean - minima[k]
        shares, base = (tables.edge_share, begin) if j == i else (tables.partner_share, tables.partner_ptr[j])
        for e in range(len(more)):
            shares[base + e] += more[e]


@jit
def _position_minima(trellis: Trellis, tables: PairChains, j: int, i: int) -> Floats:
    """Return the min-marginals of the pair chain of variable j for the positions of variable i [domain of i].

    i is j or its partner.
    """
    size = size_of(trellis, j)
    minima = np.full(size_of(trellis, i), np.inf)
    for p in range(size_of(trellis, partner_of(trellis, j))):
        base = tables.pair_ptr[j] + p * size
        for x in range(size):
            k = x if j == i else p
            minima[k] = min(minima[k], tables.so_far[base + x] + tables.to_go[base + x])
    return minima


@jit
def _edge_minima(trellis: Trellis, tables: PairChains, j: int) -> Floats:
    """Return the min-marginals of the pair chain of variable j for the edges out of j [edges]."""
    a, after = partner_of(trellis, j), j + trellis.chains
    was, size = size_of(trellis, j), size_of(trellis, after)
    moved = np.full((size_of(trellis, a + trellis.chains), was), np.inf)  # so_far and an edge of the partner
    for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
        base = tables.pair_ptr[j] + (p - trellis.dom_ptr[a]) * was
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            to, cost = (
                trellis.row_to[e] - trellis.dom_ptr[a + trellis.chains],
                partner_edge_share(trellis, tables, j, e),
            )
            for x in range(was):
                moved[to, x] = min(moved[to, x], tables.so_far[base + x] + cost)
    first = trellis.row_ptr[trellis.dom_ptr[j]]
    minima = np.full(trellis.row_ptr[trellis.dom_ptr[j + 1]] - first, np.inf)
    for p in range(len(moved)):
        base = tables.pair_ptr[after] + p * size - trellis.dom_ptr[after]
        for x in range(was):
            for e in range(trellis.row_ptr[trellis.dom_ptr[j] + x], trellis.row_ptr[trellis.dom_ptr[j] + x + 1]):
                k = base + trellis.row_to[e]
                minima[e - first] = min(minima[e - first], moved[p, x] + tables.pair_cost[k] + tables.to_go[k])
    return minima + tables.edge_share[first : first + len(minima)]


@jit
def _partner_edge_minima(trellis: Trellis, tables: PairChains, j: int) -> Floats:
    """Return the min-marginals of the pair chain of variable j for the edges out of its partner [edges]."""
    a, after = partner_of(trellis, j), j + trellis.chains
    size = size_of(trellis, after)
    first = trellis.row_ptr[trellis.dom_ptr[a]]
    minima = np.full(trellis.row_ptr[trellis.dom_ptr[a + 1]] - first, np.inf)
    for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
        moved = least_moved(trellis, tables, j, p - trellis.dom_ptr[a])
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            base = tables.pair_ptr[after] + (trellis.row_to[e] - trellis.dom_ptr[a + trellis.chains]) * size
            for x in range(size):
                minima[e - first] = min(
                    minima[e - first], moved[x] + tables.pair_cost[base + x] + tables.to_go[base + x]
                )
    return minima + tables.partner_share[tables.partner_ptr[j] : tables.partner_ptr[j + 1]]
