"""Memory-bounded A* over the variables of a trellis, one at a time (operator decomposition).

A node fixes the variables up to one; its *frontier* is the last position chosen in each chain. The rest depends on
nothing else, so nodes with the same variable and frontier are the same node. f is the cost of the fixed variables plus
the heuristic's bound on the rest, and grows by `heuristic.step`. Where the bound is tight, f does not grow at all along
some path; since the deeper of two nodes with the same f goes first, the search follows it: one expansion per variable.

When the node budget is full, the search forgets the worst leaves and backs up the least f among a node's forgotten
children into it. It opens the node again with that f, so the proof loses nothing. It forgets a quarter of the memory at
a time, so that forgetting costs a few operations on the open list per node.

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
from motionmind.search.trellis import Trellis

# Costs closer than this, in nats, are the same: sums of the same numbers in another order differ by far less.
SAME_COST_RATIO = 1e-9
KEPT_MEMORY_SHARE = 0.75  # share of a full memory to keep; more costs time, less generates more nodes again
MIN_BUCKETS = 1 << 10  # of the hash table; their number grows with the nodes

_FREE, _FRESH, _HEAPED, _NODES, _PEAK, _EXPANDED, _FORGOTTEN, _BUCKETS = range(8)  # entries of the tally


class _Nodes(NamedTuple):
    """Up to N nodes, the open list and the hash table that finds nodes. `tally` holds the counters above.

    Memory is written to only as it is needed: most searches need little of it.
    Numbers of 32 bits are widened where functions take them: else these would be compiled for both widths.
    """

    var: Int32s  # the last variable that is fixed [N]
    frontier: NDArray[np.uint16]  # last choice in each chain, as an index into its domain [N, L]
    f: Floats  # cost so far + bound on the cost to go [N]
    key: Floats  # order of the open list: f but for the slack, or the greater f backed up from forgotten children [N]
    parent: Int32s  # [N]
    children: Int32s  # number of children in memory [N]
    slot: Int32s  # place in the heap, -1 where closed [N]
    following: Int32s  # next node of the same bucket, -1 at the end [N]
    bucket: Int32s  # first node of each bucket; the first _BUCKETS, a power of two, are in use
    heap: Int32s  # open nodes, a binary heap [N]
    free: Int32s  # stack of unused nodes [N]; of those never used yet, the first _FRESH, nothing is written
    tally: Ints


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
    budget: int,
    expansions: int,
    ended: Bools,
) -> Found:
    """Search for a path that costs less than `cost`.

    Args:
        trellis: the problem.
        heuristic: the bound on the cost to go.
        cost: limit that a path must stay below, nats.
        slack: nats by which the best path found may exceed the proven bound. Between nodes whose f differs by less, the
            deeper goes first; otherwise the search would try all of many equal paths for the last digit.
        path: receives the best path of positions, if one is found [n].
        budget: most nodes to hold.
        expansions: most nodes to expand.
        ended: set from another thread to stop the search after the next expansion [1].
    """
    nodes = _root(trellis, from_start(heuristic), budget)
    known = lower = cost
    while nodes.tally[_HEAPED] > 0:
        node = int(np.int64(nodes.heap[0]))
        if nodes.key[node] >= cost - (slack if cost < known else SAME_COST_RATIO):
            lower = nodes.key[node]
            break
        if nodes.tally[_EXPANDED] >= expansions or (ended[0] and nodes.tally[_EXPANDED] > 0):
            lower = nodes.key[node]
            break
        _close(nodes, node)
        nodes.tally[_EXPANDED] += 1
        cost, complete = _expand(trellis, heuristic, nodes, node, cost, slack, path)
        if not complete:
            lower = min(nodes.key[node], nodes.key[nodes.heap[0]] if nodes.tally[_HEAPED] else np.inf)
            break
        _release(nodes, node)
    tally = nodes.tally
    return Found(cost, min(lower, cost), tally[_EXPANDED], tally[_PEAK], tally[_FORGOTTEN])


@jit
def _expand(
    trellis: Trellis, heuristic: Heuristic, nodes: _Nodes, node: int, cost: float, slack: float, path: Ints
) -> tuple[float, bool]:
    """Generate the children of a node that may lead below `cost`.

    Return the best known cost, and whether there was room for all.
    """
    chains = trellis.chains
    i = nodes.var[node] + 1
    chain = i % chains
    before = trellis.dom_ptr[i - chains] + nodes.frontier[node, chain]
    floor = nodes.key[node]  # forgetting may back a greater key up into the node before its last child has come
    for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
        x = trellis.row_to[e]
        f = nodes.f[node] + step(trellis, heuristic, i, nodes.frontier[node], e)
        if max(f, floor) >= cost - SAME_COST_RATIO:
            continue
        key = f if f > floor + slack else floor
        choice = x - trellis.dom_ptr[i]
        if i == len(trellis.dom_ptr) - 2:
            cost = f
            _trace(trellis, nodes, node, path)
            path[i] = x
            continue
        twin = _find(nodes, node, i, choice, chain)
        if twin >= 0:
            # Not by the last bit: of two prefixes that cost the same, each could come to replace the other's child.
            if nodes.f[twin] <= f + SAME_COST_RATIO:
                continue
            if nodes.slot[twin] >= 0 and nodes.children[twin] == 0:
                parent = int(np.int64(nodes.parent[twin]))
                _discard(nodes, twin)
                if parent != node:
                    _release(nodes, parent)
        if nodes.tally[_FREE] == 0 and not _forget(nodes, node):
            return cost, False  # all nodes are this one and its ancestors: nothing was backed up into it
        _add(nodes, node, i, choice, chain, f, key)
    return cost, True


@jit
def _root(trellis: Trellis, bound: float, budget: int) -> _Nodes:
    """Allocate `budget` nodes, and open the one that fixes every chain at its start."""
    buckets = 1
    while buckets < budget:
        buckets *= 2
    nodes = _Nodes(
        np.empty(budget, np.int32),
        np.empty((budget, trellis.chains), np.uint16),
        np.empty(budget),
        np.empty(budget),
        np.empty(budget, np.int32),
        np.empty(budget, np.int32),
        np.empty(budget, np.int32),
        np.empty(budget, np.int32),
        np.empty(buckets, np.int32),
        np.empty(budget, np.int32),
        np.empty(budget, np.int32),
        np.zeros(8, np.int64),
    )
    nodes.tally[_BUCKETS] = min(buckets, MIN_BUCKETS)
    nodes.bucket[: nodes.tally[_BUCKETS]] = -1
    nodes.tally[_FREE] = nodes.tally[_FRESH] = budget - 1
    nodes.tally[_NODES] = nodes.tally[_PEAK] = 1
    nodes.var[0], nodes.f[0], nodes.key[0] = trellis.chains - 1, bound, bound
    nodes.frontier[0], nodes.parent[0], nodes.children[0] = 0, -1, 0
    nodes.heap[0], nodes.slot[0], nodes.tally[_HEAPED] = 0, 0, 1
    return nodes


def nodes_in(memory: int, chains: int) -> int:
    """Return how many nodes fit into `memory` bytes, counting everything that the search allocates for a node.

    A node takes 44 bytes and 2 per chain, less than 8 in the buckets (whose number is a power of two), and 1 for the
    mark that keeps it while the search forgets others.
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
    """Forget all but the best open nodes and their ancestors, as many as fit into KEPT.

    Forget leaves first, and back up their keys. Keep `current`, the node being expanded, and its ancestors. Return
    whether there was anything to forget.
    """
    kept = np.zeros(len(nodes.var), np.bool_)
    size, marked = nodes.tally[_HEAPED], _mark(nodes, kept, current)
    while nodes.tally[_HEAPED] > 0:
        node = int(np.int64(nodes.heap[0]))
        if marked + _unmarked(nodes, kept, node) > KEPT_MEMORY_SHARE * len(kept):
            break
        _close(nodes, node)
        last = nodes.tally[_HEAPED]
        nodes.heap[last], nodes.slot[node] = node, last  # after the end of the heap, where there is room now
        marked += _mark(nodes, kept, node)
    others = bool(nodes.tally[_NODES] > marked)
    nodes.tally[_HEAPED] = 0
    for k in range(size):
        node = int(np.int64(nodes.heap[k]))
        if nodes.slot[node] < 0:
            continue  # forgotten after its last child
        listed = kept[node]
        while not kept[node] and nodes.children[node] == 0:
            parent = int(np.int64(nodes.parent[node]))
            listed = nodes.slot[parent] < 0
            nodes.key[parent] = nodes.key[node] if listed else min(nodes.key[parent], nodes.key[node])
            nodes.slot[parent] = max(nodes.slot[parent], 0)
            nodes.slot[node] = -1
            _drop(nodes, node)
            nodes.tally[_FORGOTTEN] += 1
            node = parent
        if listed and kept[node]:
            nodes.heap[nodes.tally[_HEAPED]], nodes.slot[node] = node, nodes.tally[_HEAPED]
            nodes.tally[_HEAPED] += 1
    for k in range(nodes.tally[_HEAPED] // 2 - 1, -1, -1):
        _sink(nodes, k)
    return others


@jit
def _unmarked(nodes: _Nodes, kept: Bools, node: int) -> int:
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
def _release(nodes: _Nodes, node: int) -> None:
    """Free a closed node without children, since nothing below the known cost lies behind it; then its ancestors."""
    while node > 0 and nodes.slot[node] < 0 and nodes.children[node] == 0:
        parent = int(np.int64(nodes.parent[node]))
        _drop(nodes, node)
        node = parent


@jit
def _discard(nodes: _Nodes, leaf: int) -> None:
    """Free an open leaf."""
    _close(nodes, leaf)
    _drop(nodes, leaf)


# --- nodes and their hash table ---------------------------------------------------------------------------------------


@jit
def _hash(nodes: _Nodes, node: int, var: int, choice: int, chain: int) -> int:
    """Return the bucket of the frontier of `node` with `choice` in `chain`: FNV-1a over its entries."""
    h = np.uint64(14695981039346656037) ^ np.uint64(var)
    for k in range(nodes.frontier.shape[1]):
        h = (h ^ np.uint64(choice if k == chain else nodes.frontier[node, k])) * np.uint64(1099511628211)
    h ^= h >> np.uint64(32)
    return int(h & np.uint64(nodes.tally[_BUCKETS] - 1))


@jit
def _home(nodes: _Nodes, node: int) -> int:
    """Return the bucket of a node."""
    var = int(np.int64(nodes.var[node]))
    chain = var % nodes.frontier.shape[1]
    return _hash(nodes, node, var, int(np.int64(nodes.frontier[node, chain])), chain)


@jit
def _find(nodes: _Nodes, node: int, var: int, choice: int, chain: int) -> int:
    """Return the node that fixes `var` with the frontier of `node` and `choice` in `chain`; -1 if none does."""
    twin = nodes.bucket[_hash(nodes, node, var, choice, chain)]
    while twin >= 0:
        same = nodes.var[twin] == var and nodes.frontier[twin, chain] == choice
        for k in range(nodes.frontier.shape[1]):
            if not same:
                break
            same = k == chain or nodes.frontier[twin, k] == nodes.frontier[node, k]
        if same:
            return int(twin)
        twin = nodes.following[twin]
    return -1


@jit
def _widen(nodes: _Nodes) -> None:
    """Double the buckets in use; a node stays, or moves to the bucket at the same offset in the new half."""
    count = nodes.tally[_BUCKETS]
    nodes.tally[_BUCKETS] = 2 * count
    for home in range(count):
        node = nodes.bucket[home]
        nodes.bucket[home] = nodes.bucket[count + home] = -1
        while node >= 0:
            after, now = nodes.following[node], _home(nodes, int(np.int64(node)))
            nodes.following[node] = nodes.bucket[now]
            nodes.bucket[now] = node
            node = after


@jit
def _add(nodes: _Nodes, node: int, var: int, choice: int, chain: int, f: float, key: float) -> None:
    """Add an open child of `node`."""
    nodes.tally[_FREE] -= 1
    if nodes.tally[_FREE] < nodes.tally[_FRESH]:
        nodes.tally[_FRESH] = nodes.tally[_FREE]
        child = len(nodes.free) - 1 - nodes.tally[_FREE]
    else:
        child = nodes.free[nodes.tally[_FREE]]
    nodes.tally[_NODES] += 1
    nodes.tally[_PEAK] = max(nodes.tally[_PEAK], nodes.tally[_NODES])
    for k in range(nodes.frontier.shape[1]):
        nodes.frontier[child, k] = choice if k == chain else nodes.frontier[node, k]
    nodes.var[child], nodes.f[child], nodes.key[child] = var, f, key
    nodes.parent[child], nodes.children[child] = node, 0
    nodes.children[node] += 1
    if nodes.tally[_NODES] > nodes.tally[_BUCKETS]:
        _widen(nodes)
    home = _home(nodes, child)
    nodes.following[child] = nodes.bucket[home]
    nodes.bucket[home] = child
    _open(nodes, child)


@jit
def _drop(nodes: _Nodes, node: int) -> None:
    """Remove a closed node without children from memory."""
    home = _home(nodes, node)
    if nodes.bucket[home] == node:
        nodes.bucket[home] = nodes.following[node]
    else:
        earlier = nodes.bucket[home]
        while nodes.following[earlier] != node:
            earlier = nodes.following[earlier]
        nodes.following[earlier] = nodes.following[node]
    nodes.children[nodes.parent[node]] -= 1
    nodes.free[nodes.tally[_FREE]] = node
    nodes.tally[_FREE] += 1
    nodes.tally[_NODES] -= 1


# --- the open list: a binary heap that knows the slot of each node ----------------------------------------------------


@jit
def _before(nodes: _Nodes, a: int, b: int) -> bool:
    """Order nodes by key, then the deeper first, then by f, then by number: ties are deterministic."""
    if nodes.key[a] != nodes.key[b]:
        return bool(nodes.key[a] < nodes.key[b])
    if nodes.var[a] != nodes.var[b]:
        return bool(nodes.var[a] > nodes.var[b])
    if nodes.f[a] != nodes.f[b]:
        return bool(nodes.f[a] < nodes.f[b])
    return a < b


@jit
def _open(nodes: _Nodes, node: int) -> None:
    """Put a node on the open list."""
    k = nodes.tally[_HEAPED]
    nodes.tally[_HEAPED] += 1
    nodes.heap[k], nodes.slot[node] = node, k
    _rise(nodes, k)


@jit
def _close(nodes: _Nodes, node: int) -> None:
    """Take a node off the open list."""
    nodes.tally[_HEAPED] -= 1
    k, last = int(np.int64(nodes.slot[node])), nodes.heap[nodes.tally[_HEAPED]]
    nodes.slot[node] = -1
    if last != node:
        nodes.heap[k], nodes.slot[last] = last, k
        _rise(nodes, k)
        _sink(nodes, int(np.int64(nodes.slot[last])))


@jit
def _rise(nodes: _Nodes, k: int) -> None:
    """Move the node in slot k up to its place."""
    node = nodes.heap[k]
    while k > 0 and _before(nodes, node, nodes.heap[(k - 1) // 2]):
        nodes.heap[k] = nodes.heap[(k - 1) // 2]
        nodes.slot[nodes.heap[k]] = k
        k = (k - 1) // 2
    nodes.heap[k], nodes.slot[node] = node, k


@jit
def _sink(nodes: _Nodes, k: int) -> None:
    """Move the node in slot k down to its place."""
    node, size = nodes.heap[k], nodes.tally[_HEAPED]
    while 2 * k + 1 < size:
        child = 2 * k + 1
        if child + 1 < size and _before(nodes, nodes.heap[child + 1], nodes.heap[child]):
            child += 1
        if not _before(nodes, nodes.heap[child], node):
            break
        nodes.heap[k] = nodes.heap[child]
        nodes.slot[nodes.heap[k]] = k
        k = child
    nodes.heap[k], nodes.slot[node] = node, k
