"""Memory-bounded A* over the variables of a trellis, one at a time (operator decomposition).

A node fixes the variables up to one; its *frontier* is the last position chosen in each chain. The remaining cost
depends on the frontier alone, so nodes with the same variable and frontier are duplicates. f is the cost of the fixed
variables plus the heuristic's bound on the rest, and grows by `heuristic.step`. Where the bound is tight, some path
does not raise f at all; since the deeper of two nodes with the same f goes first, the search follows that path, with
one expansion per variable.

When the memory is full, the search forgets the worst leaves. It backs up the least f among a node's forgotten children
into the node and opens it again with that f, so the lower bound stays valid. It forgets a quarter of the memory at a
time, so forgetting costs only a few heap operations per node.

Sources: Standley, "Finding optimal solutions to cooperative pathfinding problems", AAAI 2010 (the decomposition);
Russell, "Efficient memory-bounded search methods", ECAI 1992 (SMA*); Lovinger and Zhang, "Enhanced simplified
memory-bounded A star (SMA*+)", GCAI 2017.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.jit import jit
from motionmind.search.heuristic import Heuristic, from_start, step
from motionmind.search.tolerances import SAME_COST_NATS
from motionmind.search.trellis import Trellis

KEPT_NODES_SHARE = 0.75  # of a full memory; keeping more costs time, keeping less generates more nodes again

# Entries of `_Nodes.counters`
_N_FREE, _N_UNUSED, _N_OPEN, _N_HELD, _PEAK_HELD, _N_EXPANDED, _N_FORGOTTEN, _N_BUCKETS = range(8)


class _Nodes(NamedTuple):
    """The memory of a search: up to N nodes, the open list (a binary heap) and a hash table of the nodes.

    The arrays are allocated once, but written to only as needed: most searches need little of them. Functions get
    32-bit numbers widened to `int`; otherwise Numba would compile them for both widths.

    Attributes:
        var: the last variable that is fixed [N].
        frontier: last choice in each chain, as an index into its domain [N, L].
        f: cost so far plus the bound on the cost to go, nats [N].
        priority: order of the open list, nats [N]: f, or the parent's priority unless f exceeds it by more than the
            slack; forgotten children may raise it.
        parent: index of the parent [N]; -1 for the root.
        children: number of children in memory [N].
        heap_index: index in the heap [N]; -1 for a closed node.
        next_in_bucket: next node of the same bucket [N]; -1 at the end.
        first_in_bucket: first node of each bucket, -1 for none; the first `counters[_N_BUCKETS]`, a power of two, are
            in use.
        heap: the open nodes [N].
        free: stack of free nodes [N]. Its first `counters[_N_UNUSED]` entries stand for nodes that were never used, and
            are not written.
        counters: see above [8].
    """

    var: Int32s
    frontier: NDArray[np.uint16]
    f: Floats
    priority: Floats
    parent: Int32s
    children: Int32s
    heap_index: Int32s
    next_in_bucket: Int32s
    first_in_bucket: Int32s
    heap: Int32s
    free: Int32s
    counters: Ints


class Found(NamedTuple):
    """The result of a search.

    Attributes:
        cost: cost of the best path found, nats; the given limit if none was found.
        lower_bound: no path costs less than this, nats.
        expansions: number of nodes expanded.
        peak_nodes: greatest number of nodes held at once.
        forgotten: number of nodes forgotten because memory was full.
    """

    cost: float
    lower_bound: float
    expansions: int
    peak_nodes: int
    forgotten: int


@jit
def search(
    trellis: Trellis,
    heuristic: Heuristic,
    cost: float,
    slack: float,
    path: Ints,
    node_budget: int,
    expansion_budget: int,
    stopped: Bools,
) -> Found:
    """Search for a path that costs less than `cost`.

    Args:
        trellis: the problem.
        heuristic: the bound on the cost to go.
        cost: limit that a path must stay below, nats.
        slack: nats by which the best path found may exceed the proven bound. Of nodes whose f differs by less, the
            deeper goes first; otherwise the search would expand all of many nearly equal paths.
        path: receives the best path of positions, if one is found [n].
        node_budget: most nodes to hold.
        expansion_budget: most nodes to expand.
        stopped: set from another thread to stop the search after the next expansion [1].
    """
    nodes = _root(trellis, from_start(heuristic), node_budget)
    limit = lower = cost
    while nodes.counters[_N_OPEN] > 0:
        node = int(np.int64(nodes.heap[0]))
        if nodes.priority[node] >= cost - (slack if cost < limit else SAME_COST_NATS):
            lower = nodes.priority[node]
            break
        if nodes.counters[_N_EXPANDED] >= expansion_budget or (stopped[0] and nodes.counters[_N_EXPANDED] > 0):
            lower = nodes.priority[node]
            break
        _close(nodes, node)
        nodes.counters[_N_EXPANDED] += 1
        cost, complete = _expand(trellis, heuristic, nodes, node, cost, slack, path)
        if not complete:
            lower = min(nodes.priority[node], nodes.priority[nodes.heap[0]] if nodes.counters[_N_OPEN] else np.inf)
            break
        _free_dead_ends(nodes, node)
    counters = nodes.counters
    return Found(cost, min(lower, cost), counters[_N_EXPANDED], counters[_PEAK_HELD], counters[_N_FORGOTTEN])


@jit
def _expand(
    trellis: Trellis, heuristic: Heuristic, nodes: _Nodes, node: int, cost: float, slack: float, path: Ints
) -> tuple[float, bool]:
    """Generate the children of a node that may lead below `cost`.

    Return the best known cost, and whether all children fitted into memory.
    """
    chains = trellis.chains
    i = nodes.var[node] + 1
    chain = i % chains
    before = trellis.dom_ptr[i - chains] + nodes.frontier[node, chain]
    floor = nodes.priority[node]  # read now: forgetting may raise it before the last child is generated
    for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
        x = trellis.row_to[e]
        f = nodes.f[node] + step(trellis, heuristic, i, nodes.frontier[node], e)
        if max(f, floor) >= cost - SAME_COST_NATS:
            continue
        priority = f if f > floor + slack else floor
        choice = x - trellis.dom_ptr[i]
        if i == len(trellis.dom_ptr) - 2:
            cost = f
            _trace(trellis, nodes, node, path)
            path[i] = x
            continue
        duplicate = _find(nodes, node, i, choice, chain)
        if duplicate >= 0:
            # With a margin: of two prefixes with equal costs up to rounding, each could replace the other's children.
            if nodes.f[duplicate] <= f + SAME_COST_NATS:
                continue
            if nodes.heap_index[duplicate] >= 0 and nodes.children[duplicate] == 0:
                parent = int(np.int64(nodes.parent[duplicate]))
                _free_leaf(nodes, duplicate)
                if parent != node:
                    _free_dead_ends(nodes, parent)
        if nodes.counters[_N_FREE] == 0 and not _forget(nodes, node):
            return cost, False  # only this node and its ancestors are left
        _add(nodes, node, i, choice, chain, f, priority)
    return cost, True


@jit
def _root(trellis: Trellis, bound: float, node_budget: int) -> _Nodes:
    """Allocate `node_budget` nodes, and open the one that fixes every chain at its start."""
    buckets = 1
    while buckets < node_budget:
        buckets *= 2
    nodes = _Nodes(
        np.empty(node_budget, np.int32),
        np.empty((node_budget, trellis.chains), np.uint16),
        np.empty(node_budget),
        np.empty(node_budget),
        np.empty(node_budget, np.int32),
        np.empty(node_budget, np.int32),
        np.empty(node_budget, np.int32),
        np.empty(node_budget, np.int32),
        np.empty(buckets, np.int32),
        np.empty(node_budget, np.int32),
        np.empty(node_budget, np.int32),
        np.zeros(8, np.int64),
    )
    nodes.counters[_N_BUCKETS] = min(buckets, 1024)  # doubled as nodes are added
    nodes.first_in_bucket[: nodes.counters[_N_BUCKETS]] = -1
    nodes.counters[_N_FREE] = nodes.counters[_N_UNUSED] = node_budget - 1
    nodes.counters[_N_HELD] = nodes.counters[_PEAK_HELD] = 1
    nodes.var[0], nodes.f[0], nodes.priority[0] = trellis.chains - 1, bound, bound
    nodes.frontier[0], nodes.parent[0], nodes.children[0] = 0, -1, 0
    nodes.heap[0], nodes.heap_index[0], nodes.counters[_N_OPEN] = 0, 0, 1
    return nodes


def node_capacity(memory: int, chains: int) -> int:
    """Return the number of nodes that fit into `memory` bytes.

    A node takes 44 bytes and 2 per chain, less than 8 in the buckets (whose number is a power of two), and 1 in the
    mask of kept nodes while the search forgets others.
    """
    return memory // (44 + 2 * chains + 8 + 1)


@jit
def _trace(trellis: Trellis, nodes: _Nodes, node: int, path: Ints) -> None:
    """Write to `path` the positions that a node and its ancestors chose, and the start."""
    for chain in range(trellis.chains):
        path[chain] = trellis.dom_ptr[chain]
    while node > 0:
        i = nodes.var[node]
        path[i] = trellis.dom_ptr[i] + nodes.frontier[node, i % trellis.chains]
        node = nodes.parent[node]


@jit
def _forget(nodes: _Nodes, current: int) -> bool:
    """Forget all but the best open nodes and their ancestors, as many as fit into `KEPT_NODES_SHARE` of the memory.

    Forget leaves first, and back up their priorities. Keep `current`, the node being expanded, and its ancestors.
    Return whether there was anything to forget.
    """
    kept = np.zeros(len(nodes.var), np.bool_)
    size, marked = nodes.counters[_N_OPEN], _mark(nodes, kept, current)
    while nodes.counters[_N_OPEN] > 0:
        node = int(np.int64(nodes.heap[0]))
        if marked + _count_unmarked(nodes, kept, node) > KEPT_NODES_SHARE * len(kept):
            break
        _close(nodes, node)
        last = nodes.counters[_N_OPEN]
        nodes.heap[last], nodes.heap_index[node] = node, last  # behind the heap's new end
        marked += _mark(nodes, kept, node)
    others = bool(nodes.counters[_N_HELD] > marked)
    nodes.counters[_N_OPEN] = 0
    for k in range(size):
        node = int(np.int64(nodes.heap[k]))
        if nodes.heap_index[node] < 0:
            continue  # already forgotten, after its last child
        listed = kept[node]
        while not kept[node] and nodes.children[node] == 0:
            parent = int(np.int64(nodes.parent[node]))
            listed = nodes.heap_index[parent] < 0
            nodes.priority[parent] = (
                nodes.priority[node] if listed else min(nodes.priority[parent], nodes.priority[node])
            )
            nodes.heap_index[parent] = max(nodes.heap_index[parent], 0)
            nodes.heap_index[node] = -1
            _free_node(nodes, node)
            nodes.counters[_N_FORGOTTEN] += 1
            node = parent
        if listed and kept[node]:
            nodes.heap[nodes.counters[_N_OPEN]], nodes.heap_index[node] = node, nodes.counters[_N_OPEN]
            nodes.counters[_N_OPEN] += 1
    for k in range(nodes.counters[_N_OPEN] // 2 - 1, -1, -1):
        _sift_down(nodes, k)
    return others


@jit
def _count_unmarked(nodes: _Nodes, kept: Bools, node: int) -> int:
    """Count the unmarked nodes among a node and its ancestors."""
    count = 0
    while node >= 0 and not kept[node]:
        count += 1
        node = nodes.parent[node]
    return count


@jit
def _mark(nodes: _Nodes, kept: Bools, node: int) -> int:
    """Mark a node and its ancestors as kept, and return how many were unmarked before."""
    count = 0
    while node >= 0 and not kept[node]:
        kept[node] = True
        count += 1
        node = nodes.parent[node]
    return count


@jit
def _free_dead_ends(nodes: _Nodes, node: int) -> None:
    """Free a closed node without children, which leads to no path below the known cost; then its ancestors."""
    while node > 0 and nodes.heap_index[node] < 0 and nodes.children[node] == 0:
        parent = int(np.int64(nodes.parent[node]))
        _free_node(nodes, node)
        node = parent


@jit
def _free_leaf(nodes: _Nodes, leaf: int) -> None:
    """Free an open leaf."""
    _close(nodes, leaf)
    _free_node(nodes, leaf)


# --- nodes and their hash table ---------------------------------------------------------------------------------------


@jit
def _hash(nodes: _Nodes, node: int, var: int, choice: int, chain: int) -> int:
    """Return the bucket for `var` and the frontier of `node` with `choice` in `chain`: the FNV-1a hash."""
    h = np.uint64(14695981039346656037) ^ np.uint64(var)
    for k in range(nodes.frontier.shape[1]):
        h = (h ^ np.uint64(choice if k == chain else nodes.frontier[node, k])) * np.uint64(1099511628211)
    h ^= h >> np.uint64(32)
    return int(h & np.uint64(nodes.counters[_N_BUCKETS] - 1))


@jit
def _bucket_of(nodes: _Nodes, node: int) -> int:
    """Return the bucket of a node."""
    var = int(np.int64(nodes.var[node]))
    chain = var % nodes.frontier.shape[1]
    return _hash(nodes, node, var, int(np.int64(nodes.frontier[node, chain])), chain)


@jit
def _find(nodes: _Nodes, node: int, var: int, choice: int, chain: int) -> int:
    """Return the node that fixes `var` with the frontier of `node` and `choice` in `chain`; -1 if none does."""
    duplicate = nodes.first_in_bucket[_hash(nodes, node, var, choice, chain)]
    while duplicate >= 0:
        same = nodes.var[duplicate] == var and nodes.frontier[duplicate, chain] == choice
        for k in range(nodes.frontier.shape[1]):
            if not same:
                break
            same = k == chain or nodes.frontier[duplicate, k] == nodes.frontier[node, k]
        if same:
            return int(duplicate)
        duplicate = nodes.next_in_bucket[duplicate]
    return -1


@jit
def _double_buckets(nodes: _Nodes) -> None:
    """Double the number of buckets; a node stays, or moves to the same offset in the new half."""
    count = nodes.counters[_N_BUCKETS]
    nodes.counters[_N_BUCKETS] = 2 * count
    for bucket in range(count):
        node = nodes.first_in_bucket[bucket]
        nodes.first_in_bucket[bucket] = nodes.first_in_bucket[count + bucket] = -1
        while node >= 0:
            after, now = nodes.next_in_bucket[node], _bucket_of(nodes, int(np.int64(node)))
            nodes.next_in_bucket[node] = nodes.first_in_bucket[now]
            nodes.first_in_bucket[now] = node
            node = after


@jit
def _add(nodes: _Nodes, node: int, var: int, choice: int, chain: int, f: float, priority: float) -> None:
    """Add an open child of `node`."""
    nodes.counters[_N_FREE] -= 1
    if nodes.counters[_N_FREE] < nodes.counters[_N_UNUSED]:
        nodes.counters[_N_UNUSED] = nodes.counters[_N_FREE]
        child = len(nodes.free) - 1 - nodes.counters[_N_FREE]
    else:
        child = nodes.free[nodes.counters[_N_FREE]]
    nodes.counters[_N_HELD] += 1
    nodes.counters[_PEAK_HELD] = max(nodes.counters[_PEAK_HELD], nodes.counters[_N_HELD])
    for k in range(nodes.frontier.shape[1]):
        nodes.frontier[child, k] = choice if k == chain else nodes.frontier[node, k]
    nodes.var[child], nodes.f[child], nodes.priority[child] = var, f, priority
    nodes.parent[child], nodes.children[child] = node, 0
    nodes.children[node] += 1
    if nodes.counters[_N_HELD] > nodes.counters[_N_BUCKETS]:
        _double_buckets(nodes)
    bucket = _bucket_of(nodes, child)
    nodes.next_in_bucket[child] = nodes.first_in_bucket[bucket]
    nodes.first_in_bucket[bucket] = child
    _open(nodes, child)


@jit
def _free_node(nodes: _Nodes, node: int) -> None:
    """Remove a closed node without children from the hash table and free it."""
    bucket = _bucket_of(nodes, node)
    if nodes.first_in_bucket[bucket] == node:
        nodes.first_in_bucket[bucket] = nodes.next_in_bucket[node]
    else:
        earlier = nodes.first_in_bucket[bucket]
        while nodes.next_in_bucket[earlier] != node:
            earlier = nodes.next_in_bucket[earlier]
        nodes.next_in_bucket[earlier] = nodes.next_in_bucket[node]
    nodes.children[nodes.parent[node]] -= 1
    nodes.free[nodes.counters[_N_FREE]] = node
    nodes.counters[_N_FREE] += 1
    nodes.counters[_N_HELD] -= 1


# --- the open list: a binary heap that tracks the index of each node --------------------------------------------------


@jit
def _precedes(nodes: _Nodes, a: int, b: int) -> bool:
    """Order nodes by priority, then depth (deeper first), then f, then number, so that ties are deterministic."""
    if nodes.priority[a] != nodes.priority[b]:
        return bool(nodes.priority[a] < nodes.priority[b])
    if nodes.var[a] != nodes.var[b]:
        return bool(nodes.var[a] > nodes.var[b])
    if nodes.f[a] != nodes.f[b]:
        return bool(nodes.f[a] < nodes.f[b])
    return a < b


@jit
def _open(nodes: _Nodes, node: int) -> None:
    """Put a node on the open list."""
    k = nodes.counters[_N_OPEN]
    nodes.counters[_N_OPEN] += 1
    nodes.heap[k], nodes.heap_index[node] = node, k
    _sift_up(nodes, k)


@jit
def _close(nodes: _Nodes, node: int) -> None:
    """Take a node off the open list."""
    nodes.counters[_N_OPEN] -= 1
    k, last = int(np.int64(nodes.heap_index[node])), nodes.heap[nodes.counters[_N_OPEN]]
    nodes.heap_index[node] = -1
    if last != node:
        nodes.heap[k], nodes.heap_index[last] = last, k
        _sift_up(nodes, k)
        _sift_down(nodes, int(np.int64(nodes.heap_index[last])))


@jit
def _sift_up(nodes: _Nodes, k: int) -> None:
    """Move the node at index k of the heap up to its place."""
    node = nodes.heap[k]
    while k > 0 and _precedes(nodes, node, nodes.heap[(k - 1) // 2]):
        nodes.heap[k] = nodes.heap[(k - 1) // 2]
        nodes.heap_index[nodes.heap[k]] = k
        k = (k - 1) // 2
    nodes.heap[k], nodes.heap_index[node] = node, k


@jit
def _sift_down(nodes: _Nodes, k: int) -> None:
    """Move the node at index k of the heap down to its place."""
    node, size = nodes.heap[k], nodes.counters[_N_OPEN]
    while 2 * k + 1 < size:
        child = 2 * k + 1
        if child + 1 < size and _precedes(nodes, nodes.heap[child + 1], nodes.heap[child]):
            child += 1
        if not _precedes(nodes, nodes.heap[child], node):
            break
        nodes.heap[k] = nodes.heap[child]
        nodes.heap_index[nodes.heap[k]] = k
        k = child
    nodes.heap[k], nodes.heap_index[node] = node, k
