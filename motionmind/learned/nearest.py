"""Nearest: few moments of a corpus that are near a posture, found by the tree of a part of the body.

Bodies have so many joints that balls overlap, and a search that is to be certain of the nearest moment looks at most of
them. This one looks at a fixed number of leaves, those first whose nearest moment is likely to be nearest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int8s, Int32s, Ints, Singles
from motionmind.geometry.distances import squared_distance, squared_turn
from motionmind.jit import jit, read_only
from motionmind.learned.neighbours import LEAF, WHOLE, Neighbours

LEAVES = 48  # of a tree that are searched for near moments
INSIDE = 0.6  # of a ball's radius: how much nearer than its centre its nearest moment is likely to be


def find_near(
    trees: Neighbours, number: int, orientations: Floats, postures: Floats, count: int, leaves: int = LEAVES
) -> Ints:
    """Return moments near each of some postures in one part of the body [K, n].

    They are the `count` nearest moments of the leaves that promise most, the nearest first, or all of these leaves.

    Args:
        trees: of the corpus.
        number: of the part.
        orientations: of the corpus's moments [N, L, 4].
        postures: orientations of the chains, the joints' first [K, J, 4].
        count: how many moments for each posture.
        leaves: how many to search.
    """
    tree, shown = _tree_of(trees, number), read_only(orientations)
    leaf = (len(tree.bounds) + 1) // 2
    least = np.diff(tree.bounds[-leaf:]).min()  # so that each posture has as many
    count = min(count, leaves * least if leaves < leaf else len(tree.order))
    sought = np.ascontiguousarray(postures[:, tree.part])
    return np.stack([_nearest(*_leaves(shown, tree, posture, leaves), count) for posture in sought])


def postures_near(
    trees: Neighbours, orientations: Floats, posture: Floats, count: int, below: int, leaves: int = LEAVES
) -> Ints:
    """Return so many of the corpus's postures near to one, the nearest first, by the whole body.

    Args:
        trees: of the corpus.
        orientations: of the corpus's moments [N, L, 4]; the postures come before the middles of its moves.
        posture: orientations of the chains [L, 4].
        count: how many, or as many as are found.
        below: number of the corpus's postures.
        leaves: how many to search.
    """
    tree = _tree_of(trees, 0)
    moments, off = _leaves(read_only(orientations), tree, np.ascontiguousarray(posture[tree.part]), leaves)
    return _nearest(moments[moments < below], off[moments < below], count)


class _Tree(NamedTuple):
    """The tree of one part, as loops take it.

    Attributes:
        part: the chains of the part [m].
        codes, order, bounds, centres, radii: of `Neighbours`, those of the part.
    """

    part: Ints
    codes: Int8s
    order: Int32s
    bounds: Int32s
    centres: Singles
    radii: Floats


def _tree_of(trees: Neighbours, number: int) -> _Tree:
    """Return the tree of one part."""
    return _Tree(
        trees.parts[number],
        read_only(trees.codes_of(number)),
        trees.order[number],
        trees.bounds,
        trees.centres_apart[number],
        trees.radii[number],
    )


def _nearest(moments: Int32s, off: Singles, count: int) -> Ints:
    """Return so many of some moments, or all, those that are least off, the nearest first [n]."""
    return moments[np.argsort(off, kind="stable")[:count]].astype(np.int64)


@jit
def _search(posture: Floats, bounds: Int32s, centres: Singles, radii: Floats, leaves: int) -> Ints:
    """Return the leaves that promise most for a posture of the part [m, 4].

    Nodes wait in a heap, those that promise more first; of equals, the first. With `heapq` it takes a quarter longer.
    """
    found, many = np.empty(leaves, np.int64), 0
    promises, nodes, waiting = (
        np.empty((len(bounds) + 1) // 2),
        np.empty((len(bounds) + 1) // 2, np.int64),
        min(leaves, 1),
    )
    promises[0], nodes[0] = 0.0, 0
    while waiting and many < leaves:
        node = nodes[0]
        if 2 * node + 2 >= len(bounds):
            found[many] = node
            many += 1
            waiting -= 1
            _sink(promises, nodes, waiting, promises[waiting], nodes[waiting])
            continue
        for child in (2 * node + 1, 2 * node + 2):
            away = np.sqrt(squared_distance(centres[child], posture) / len(posture))
            promise = away - INSIDE * radii[child]
            if child % 2:
                _sink(promises, nodes, waiting, promise, child)  # in the node's own place
            else:
                _rise(promises, nodes, waiting, promise, child)
                waiting += 1
    return found[:many]


@jit
def _sink(promises: Floats, nodes: Ints, size: int, promise: float, node: int) -> None:
    """Put a node in the place of the first of a heap of that size."""
    at, below = 0, 1
    while below < size:
        if below + 1 < size and _is_before(promises[below + 1], nodes[below + 1], promises[below], nodes[below]):
            below += 1
        if _is_before(promise, node, promises[below], nodes[below]):
            break
        promises[at], nodes[at] = promises[below], nodes[below]
        at, below = below, 2 * below + 1
    promises[at], nodes[at] = promise, node


@jit
def _rise(promises: Floats, nodes: Ints, size: int, promise: float, node: int) -> None:
    """Add a node to a heap of that size."""
    at = size
    while at > 0 and _is_before(promise, node, promises[(at - 1) // 2], nodes[(at - 1) // 2]):
        promises[at], nodes[at] = promises[(at - 1) // 2], nodes[(at - 1) // 2]
        at = (at - 1) // 2
    promises[at], nodes[at] = promise, node


@jit
def _is_before(promise: float, node: int, other: float, its: int) -> bool:
    """Return whether a node that promises so much comes before another."""
    return promise < other or (promise == other and node < its)


@jit
def _leaves(orientations: Floats, tree: _Tree, posture: Floats, leaves: int) -> tuple[Int32s, Singles]:
    """Return the moments of so many leaves, those that promise most for a posture of the part [m, 4], and their squared
    distances from it, in any unit."""
    best, many = _search(posture, tree.bounds, tree.centres, tree.radii, leaves), 0
    found, squared = np.empty(len(best) * LEAF, np.int32), np.empty(len(best) * LEAF, np.float32)
    sought, width = (WHOLE * posture).astype(np.float32), 4 * len(tree.part)
    for node in best:
        start, stop = tree.bounds[node]
        off = squared[many : many + stop - start]
        if len(tree.codes):
            _measure(tree.codes[width * start : width * stop].reshape(width, stop - start), sought, off)
        else:
            _measure_apart(orientations, tree.part, posture, tree.order[start:stop], off)
        found[many : many + stop - start] = tree.order[start:stop]
        many += stop - start
    return found[:many], squared[:many]


@jit
def _measure(codes: Int8s, posture: Singles, out: Singles) -> None:
    """Write the squared differences of the moments of a leaf [4 m, n] from a posture of the part [m, 4], both in
    127ths, each joint's to the nearer sign, sums over joints [n]."""
    out[:] = 0.0
    whole = np.float32(WHOLE * WHOLE)
    for j in range(len(posture)):
        a, b, c, d = posture[j]
        for k in range(len(out)):  # side by side, so that several are measured at once
            x, y = np.float32(codes[4 * j, k]), np.float32(codes[4 * j + 1, k])
            z, w = np.float32(codes[4 * j + 2, k]), np.float32(codes[4 * j + 3, k])
            along = abs(a * x + b * y + c * z + d * w)
            out[k] += x * x + y * y + z * z + w * w + whole - along - along


@jit
def _measure_apart(orientations: Floats, part: Ints, posture: Floats, moments: Int32s, out: Singles) -> None:
    """Write the squared distances of moments [n] of all [N, L, 4] from a posture of the part [m, 4], sums [n]."""
    for k in range(len(moments)):  # so that the memory of all is on its way before that of the first is waited for
        touched = 0.0
        for j in range(0, len(part), 2):
            touched += orientations[moments[k], part[j], 0]
        out[k] = touched
    for k in range(len(moments)):
        total = 0.0
        for j in range(len(part)):
            total += squared_turn(orientations[moments[k], part[j]], posture[j])
        out[k] = total
