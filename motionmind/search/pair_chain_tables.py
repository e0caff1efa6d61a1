"""The tables of pair chains: their costs, and their least costs so far and to go, by dynamic programming."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.trellis import Trellis


class PairChains(NamedTuple):
    """Costs and tables, in nats, of the pair chains of a trellis with at least two chains.

    Each chain but the first has a pair chain with its partner. At each move this has a table of pairs, (position of the
    partner, position of the chain), listed under the chain's variable i. Pairs are numbered by indices into the two
    domains, the chain's own fastest.

    Attributes:
        partner: the other chain of each chain's pair chain [L]; the first chain has no pair chain of its own.
        child_ptr: `children[child_ptr[chain] : child_ptr[chain + 1]]` have `chain` as their partner [L + 1].
        children: chains with a partner, by partner [L - 1].
        pair_ptr: first pair of variable i [n + 1].
        pair_cost: the pair chain's share of what a pair costs at its move [Q].
        so_far: least cost of the pair chain up to a pair, the pair included [Q].
        to_go: least cost of the pair chain after a pair [Q].
        half_ptr: first entry of variable i in `half` [n + 1].
        half: least cost of the pair chain after a half step, the partner having moved to i's move and the chain not:
            by (position of the partner at the move, position of the chain one move before).
        edge_share: share of an edge's cost that its chain's own pair chain bears [R].
        partner_ptr: first entry of variable i in `partner_share` [n + 1].
        partner_share: share that the pair chain of variable i bears of its partner's edges, in their order.
    """

    partner: Ints
    child_ptr: Ints
    children: Ints
    pair_ptr: Ints
    pair_cost: Floats
    so_far: Floats
    to_go: Floats
    half_ptr: Ints
    half: Floats
    edge_share: Floats
    partner_ptr: Ints
    partner_share: Floats


def empty(trellis: Trellis) -> PairChains:
    """Return pair chains of a trellis, all their costs and tables 0."""
    chains, partner = trellis.chains, np.maximum(trellis.parents, 0)
    child_ptr = np.concatenate([[0], np.cumsum(np.bincount(partner[1:], minlength=chains))])
    children = 1 + np.argsort(partner[1:], kind="stable")
    i, a = partners(trellis)
    sizes, edges = np.diff(trellis.dom_ptr), np.diff(trellis.row_ptr[trellis.dom_ptr])
    lengths = np.zeros((3, len(sizes)), np.int64)
    lengths[:, i] = sizes[a] * sizes[i], np.where(i >= chains, sizes[a] * sizes[i - chains], 0), edges[a]
    pair_ptr, half_ptr, partner_ptr = (np.concatenate([[0], np.cumsum(of)]) for of in lengths)
    count = pair_ptr[-1]
    return PairChains(
        partner, child_ptr, children, pair_ptr, np.zeros(count), np.zeros(count), np.zeros(count),
        half_ptr, np.zeros(half_ptr[-1]), np.zeros(len(trellis.row_to)), partner_ptr, np.zeros(partner_ptr[-1]),
    )  # fmt: skip


def count_pairs(trellis: Trellis) -> int:
    """Count the pairs that the pair chains of a trellis list; memory and the time of a sweep grow with them."""
    sizes = np.diff(trellis.dom_ptr)
    i, a = partners(trellis)
    return int(sizes[i] @ sizes[a])


def partners(trellis: Trellis) -> tuple[Ints, Ints]:
    """Return the variables that have a pair chain, and the partner of each."""
    i = np.arange(len(trellis.dom_ptr) - 1)
    i = i[i % trellis.chains > 0]
    chain = i % trellis.chains
    return i, i - chain + np.maximum(trellis.parents, 0)[chain]


@jit
def push_so_far(trellis: Trellis, tables: PairChains, i: int) -> None:
    """Compute `so_far` of variable i from one move before: first its chain moves, then the partner."""
    chains = trellis.chains
    first, last, size = tables.pair_ptr[i], tables.pair_ptr[i + 1], size_of(trellis, i)
    for k in range(first, last):
        tables.so_far[k] = tables.pair_cost[k]
    if i < chains:
        return
    a, least = partner_of(trellis, i - chains), np.full(last - first, np.inf)
    for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
        moved = least_moved(trellis, tables, i - chains, p - trellis.dom_ptr[a])
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            base, cost = (
                (trellis.row_to[e] - trellis.dom_ptr[a + chains]) * size,
                partner_edge_share(trellis, tables, i - chains, e),
            )
            for x in range(size):
                least[base + x] = min(least[base + x], moved[x] + cost)
    for k in range(first, last):
        tables.so_far[k] += least[k - first]


@jit
def pull_to_go(trellis: Trellis, tables: PairChains, i: int) -> None:
    """Compute `half` of variable i, and with it `to_go` of its chain's variable one move before."""
    b = i - trellis.chains
    a, was, size = partner_of(trellis, b), size_of(trellis, b), size_of(trellis, i)
    for p in range(size_of(trellis, a + trellis.chains)):
        base = tables.pair_ptr[i] + p * size
        rest = np.empty(size)
        for x in range(size):
            rest[x] = tables.pair_cost[base + x] + tables.to_go[base + x]
        for x in range(was):
            least = np.inf
            for e in range(trellis.row_ptr[trellis.dom_ptr[b] + x], trellis.row_ptr[trellis.dom_ptr[b] + x + 1]):
                least = min(least, tables.edge_share[e] + rest[trellis.row_to[e] - trellis.dom_ptr[i]])
            tables.half[tables.half_ptr[i] + p * was + x] = least
    tables.to_go[tables.pair_ptr[b] : tables.pair_ptr[b + 1]] = np.inf
    for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
        base = tables.pair_ptr[b] + (p - trellis.dom_ptr[a]) * was
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            half = tables.half_ptr[i] + (trellis.row_to[e] - trellis.dom_ptr[a + trellis.chains]) * was
            cost = partner_edge_share(trellis, tables, b, e)
            for x in range(was):
                tables.to_go[base + x] = min(tables.to_go[base + x], cost + tables.half[half + x])


@jit
def fill_to_go(trellis: Trellis, tables: PairChains) -> None:
    """Compute all of `half` and `to_go`, from the last move back."""
    for i in range(len(trellis.dom_ptr) - 2, trellis.chains, -1):
        if i % trellis.chains > 0:
            pull_to_go(trellis, tables, i)


@jit
def least_moved(trellis: Trellis, tables: PairChains, j: int, p: int) -> Floats:
    """Return the least so_far plus an edge of variable j's chain, the partner staying at index `p`, in nats.

    It is listed by where the edge leads [domain one move on].
    """
    after = j + trellis.chains
    moved = np.full(size_of(trellis, after), np.inf)
    base = tables.pair_ptr[j] + p * size_of(trellis, j) - trellis.dom_ptr[j]
    for x in range(trellis.dom_ptr[j], trellis.dom_ptr[j + 1]):
        for e in range(trellis.row_ptr[x], trellis.row_ptr[x + 1]):
            to = trellis.row_to[e] - trellis.dom_ptr[after]
            moved[to] = min(moved[to], tables.so_far[base + x] + tables.edge_share[e])
    return moved


@jit
def partner_edge_share(trellis: Trellis, tables: PairChains, j: int, e: int) -> float:
    """Return the share in nats that the pair chain of variable j bears of edge `e` out of its partner's variable."""
    return float(
        tables.partner_share[tables.partner_ptr[j] + e - trellis.row_ptr[trellis.dom_ptr[partner_of(trellis, j)]]]
    )


@jit
def partner_of(trellis: Trellis, i: int) -> int:
    """Return the partner of variable i in its pair chain: its parent variable, or the first chain's if it has none."""
    chain = i % trellis.chains
    return int(i - chain + max(trellis.parents[chain], 0))


@jit
def pair_chains_of(tables: PairChains, chain: int) -> Ints:
    """Return the chains whose pair chains include a chain: its children, then itself unless it is the first."""
    children = tables.children[tables.child_ptr[chain] : tables.child_ptr[chain + 1]]
    return children if chain == 0 else np.append(children, chain)


@jit
def size_of(trellis: Trellis, i: int) -> int:
    """Return the number of positions of variable i."""
    return int(trellis.dom_ptr[i + 1] - trellis.dom_ptr[i])
