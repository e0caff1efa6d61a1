"""Nearest: approximate nearest neighbours of a posture among a corpus's samples, by the tree of a body part.

In so many dimensions balls overlap, and an exact search would visit most samples. This one visits a fixed number of
leaves, most promising first.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int8s, Int32s, Ints, Singles
from motionmind.geometry.distances import squared_distance, squared_turn
from motionmind.jit import jit, read_only
from motionmind.learned.neighbours import CODE_SCALE, MAX_LEAF_SAMPLES, Neighbours

N_LEAVES_VISITED = 48  # per search
NEARER_THAN_CENTRE_RATIO = 0.6  # radii by which a ball's nearest sample is likely to be nearer than its centre


def find_near(
    trees: Neighbours, number: int, orientations: Floats, postures: Floats, count: int, leaves: int = N_LEAVES_VISITED
) -> Ints:
    """Return samples near each of K postures in one body part [K, n], nearest first.

    They are the `count` nearest in the most promising leaves, or all samples in these leaves if fewer.

    Args:
        trees: of the corpus.
        number: index of the part.
        orientations: of the corpus's samples [N, L, 4].
        postures: orientations of the joint chains, joints first [K, J, 4].
        count: number of samples per posture.
        leaves: number of leaves to visit.
    """
    tree, shown = _tree_of(trees, number), read_only(orientations)
    leaf = (len(tree.bounds) + 1) // 2
    least = np.diff(tree.bounds[-leaf:]).min()  # so that each posture gets equally many
    count = min(count, leaves * least if leaves < leaf else len(tree.order))
    sought = np.ascontiguousarray(postures[:, tree.part])
    return np.stack([_nearest(*_leaves(shown, tree, posture, leaves), count) for posture in sought])


def postures_near(
    trees: Neighbours, orientations: Floats, posture: Floats, count: int, below: int, leaves: int = N_LEAVES_VISITED
) -> Ints:
    """Return the corpus's postures near a given one in the whole body, nearest first.

    Args:
        trees: of the corpus.
        orientations: of the corpus's samples [N, L, 4]: postures, then middles of moves.
        posture: orientations of the joint chains [L, 4].
        count: number of postures to return, at most.
        below: number of the corpus's postures.
        leaves: number of leaves to visit.
    """
    tree = _tree_of(trees, 0)
    samples, off = _leaves(read_only(orientations), tree, np.ascontiguousarray(posture[tree.part]), leaves)
    return _nearest(samples[samples < below], off[samples < below], count)


class _Tree(NamedTuple):
    """The tree of one part, in the form that compiled loops take.

    Attributes:
        part: the joint chains of the part [m].
        codes, order, bounds, centres, radii: as in `Neighbours`, for this part.
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


def _nearest(samples: Int32s, off: Singles, count: int) -> Ints:
    """Return the `count` samples of least distance `off`, or all if fewer, nearest first [n]."""
    return samples[np.argsort(off, kind="stable")[:count]].astype(np.int64)


@jit
def _search(posture: Floats, bounds: Int32s, centres: Singles, radii: Floats, leaves: int) -> Ints:
    """Return the most promising leaves for a posture of the part [m, 4].

    Nodes wait in a heap, most promising first; ties go by index. With `heapq` it takes a quarter longer.
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
            promise = away - NEARER_THAN_CENTRE_RATIO * radii[child]
            if child % 2:
                _sink(promises, nodes, waiting, promise, child)  # in the node's own place
            else:
                _rise(promises, nodes, waiting, promise, child)
                waiting += 1
    return found[:many]


@jit
def _sink(promises: Floats, nodes: Ints, size: int, promise: float, node: int) -> None:
    """Replace the first node of a heap of `size` nodes."""
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
    """Add a node to a heap of `size` nodes."""
    at = size
    while at > 0 and _is_before(promise, node, promises[(at - 1) // 2], nodes[(at - 1) // 2]):
        promises[at], nodes[at] = promises[(at - 1) // 2], nodes[(at - 1) // 2]
        at = (at - 1) // 2
    promises[at], nodes[at] = promise, node


@jit
def _is_before(promise: float, node: int, other: float, its: int) -> bool:
    """Return whether a node comes before another in the heap."""
    return promise < other or (promise == other and node < its)


@jit
def _leaves(orientations: Floats, tree: _Tree, posture: Floats, leaves: int) -> tuple[Int32s, Singles]:
    """Return the samples in the `leaves` most promising leaves for a posture of the part [m, 4], and their squared
    distances from it, in arbitrary units."""
    best, many = _search(posture, tree.bounds, tree.centres, tree.radii, leaves), 0
    found, squared = (
        np.empty(len(best) * MAX_LEAF_SAMPLES, np.int32),
        np.empty(len(best) * MAX_LEAF_SAMPLES, np.float32),
    )
    sought, width = (CODE_SCALE * posture).astype(np.float32), 4 * len(tree.part)
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
    """Write squared differences between a leaf's codes [4 m, n] and a posture of the part [m, 4], both in 127ths:
    sums over joints [n], each with the nearer sign of the quaternion."""
    out[:] = 0.0
    whole = np.float32(CODE_SCALE * CODE_SCALE)
    for j in range(len(posture)):
        a, b, c, d = posture[j]
        for k in range(len(out)):  # contiguous, for vector instructions
            x, y = np.float32(codes[4 * j, k]), np.float32(codes[4 * j + 1, k])
            z, w = np.float32(codes[4 * j + 2, k]), np.float32(codes[4 * j + 3, k])
            along = abs(a * x + b * y + c * z + d * w)
            out[k] += x * x + y * y + z * z + w * w + whole - along - along


@jit
def _measure_apart(orientations: Floats, part: Ints, posture: Floats, samples: Int32s, out: Singles) -> None:
    """Write squared distances between samples [n], of all [N, L, 4], and a posture of the part [m, 4]: sums [n]."""
    for k in range(len(samples)):  # prefetch: request the memory of all before waiting for the first
        touched = 0.0
        for j in range(0, len(part), 2):
            touched += orientations[samples[k], part[j], 0]
        out[k] = touched
    for k in range(len(samples)):
        total = 0.0
        for j in range(len(part)):
            total += squared_turn(orientations[samples[k], part[j]], posture[j])
        out[k] = total
