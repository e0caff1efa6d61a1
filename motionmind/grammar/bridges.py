"""Bridges: unattested moves between nearby orientations, for searches without a path of attested moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.executors.here import this_process
from motionmind.executors.team import Team
from motionmind.grammar.transitions import Transitions

N_BRIDGES_PER_STATE = 3  # to its nearest states
MAX_BRIDGE_DEG = 45.0  # does not apply to bridges of the spanning tree
MAX_STATES_COMPARED = 1024  # in a full table of angles, 8 MB; larger chains use a k-d tree


@dataclass(frozen=True, eq=False)
class Bridges:
    """The B bridges of all chains in flat arrays, as in `Transitions`; G states in all.

    Attributes:
        indptr: bridges of each state [G + 1].
        targets: the state that each bridge leads to, increasing within a row [B].
        degrees: the angle that each bridge spans [B].
    """

    indptr: Ints
    targets: Int32s
    degrees: Floats

    def span(self, row: int, target: int) -> float:
        """Return the angle, in degrees, of the bridge from the state of `row` to the state `target` of its chain."""
        first, last = self.indptr[row], self.indptr[row + 1]
        return float(self.degrees[first + np.searchsorted(self.targets[first:last], target)])


def find_bridges(centres: Floats, transitions: Transitions, team: Team | None = None) -> Bridges:
    """Find the bridges between the states of each chain.

    Bridges lead from every state to its three nearest within 45 degrees and, both ways, along a minimum spanning tree
    of the chain's states by angle; so every state can be reached from every other. Attested moves are left out.

    Args:
        centres: orientation of each state of each chain [G, 4].
        transitions: the joint graphs.
        team: threads, one job per chain; None for the current thread.
    """
    sizes = transitions.sizes()

    def find(chain: int) -> tuple[Ints, Int32s, Floats]:
        first, size = transitions.starts[chain], sizes[chain]
        own = centres[first : first + size]
        keys, angles = _bridges_of_all_pairs(own) if size <= MAX_STATES_COMPARED else _bridges_of_near_pairs(own)
        rows = transitions.indptr[first : first + size + 1]
        attested = np.repeat(np.arange(size), np.diff(rows)) * size + transitions.targets[rows[0] : rows[-1]]
        new = ~np.isin(keys, attested)
        leaving = np.bincount(keys[new] // size, minlength=size)
        return leaving, (keys[new] % size).astype(np.int32), angles[new]

    found = (team or this_process()).map(find, range(len(sizes)))
    leaving, targets, degrees = map(np.concatenate, zip(*found, strict=True))
    return Bridges(np.concatenate([[0], np.cumsum(leaving)]), targets, degrees)


def _bridges_of_all_pairs(centres: Floats) -> tuple[Ints, Floats]:
    """Return the bridges between states [S, 4], attested or not.

    Returns:
        Keys s * S + s' of the bridges s -> s', increasing [B], and their angles in degrees [B].
    """
    # Rounded: the order of equally near states must not depend on the last bit.
    angles = np.asarray(np.degrees(_angles(centres)).round(9), dtype=np.float64)
    keys = np.flatnonzero(_nearest(angles) | _spanning_tree(angles))
    return keys, angles.ravel()[keys]


def _bridges_of_near_pairs(centres: Floats) -> tuple[Ints, Floats]:
    """Return the result of `_bridges_of_all_pairs`, up to the order of equal angles, by means of a k-d tree."""
    size, tree = len(centres), _Neighbours(centres)
    source, target, angle = tree.of(np.arange(size), 0, 2 * (N_BRIDGES_PER_STATE + 1))
    order = np.lexsort((target, angle, source))
    source, target, angle = source[order], target[order], angle[order]
    rank = np.arange(len(source)) - np.searchsorted(source, source)
    near = (rank < N_BRIDGES_PER_STATE) & (angle <= MAX_BRIDGE_DEG)
    one, other = _spanning_edges(tree, size)
    keys = np.unique(np.concatenate([source[near] * size + target[near], one * size + other, other * size + one]))
    return keys, tree.angles(keys // size, keys % size)


class _Neighbours:
    """The neighbours of states by angle: each orientation is two opposite points on the sphere of quaternions."""

    def __init__(self, centres: Floats) -> None:
        from scipy.spatial import cKDTree  # slow to import

        self._centres = centres
        self._tree = cKDTree(np.concatenate([centres, -centres]))

    def of(self, states: Ints, known: int, count: int) -> tuple[Ints, Ints, Floats]:
        """Return pairs of states with their neighbours of the ranks `known` + 1 to `count`.

        A state may be a neighbour twice, but is never its own.

        Returns:
            The states, the other states, and the angles in degrees, each [P].
        """
        count = min(count, 2 * len(self._centres))
        _, near = self._tree.query(self._centres[states], k=np.arange(known + 1, count + 1))
        source, target = np.repeat(states, near.shape[1]), near.ravel() % len(self._centres)
        others = source != target
        return source[others], target[others], self.angles(source[others], target[others])

    def angles(self, one: Ints, other: Ints) -> Floats:
        """Return the angles between pairs of states, degrees [P]."""
        cosines = np.abs(np.sum(self._centres[one] * self._centres[other], axis=1))
        return np.asarray(np.degrees(2.0 * np.arccos(np.clip(cosines, 0.0, 1.0))).round(9))


def _spanning_edges(tree: _Neighbours, size: int) -> tuple[Ints, Ints]:
    """Return the ends of the edges [S - 1] of a minimum spanning tree by angle.

    In each round, add the least edge that leaves each component. Source: Boruvka's algorithm, as in March, Ram and
    Gray, "Fast Euclidean minimum spanning tree", KDD (2010), without their bounds on whole subtrees.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    component, count = np.arange(size), size
    edges = np.zeros(0, dtype=np.int64)
    while count > 1:
        left, known, most = np.arange(size), 0, 4
        best = np.full(count, np.inf)
        found = [(np.zeros(0, dtype=np.int64),) * 2 + (np.zeros(0),)]
        while len(left):
            source, target, angle = tree.of(left, known, most)
            farthest = np.zeros(size)
            np.maximum.at(farthest, source, angle)
            leaving = component[source] != component[target]
            found.append((source[leaving], target[leaving], angle[leaving]))
            np.minimum.at(best, component[source[leaving]], angle[leaving])
            done = np.zeros(size, dtype=np.bool_)
            done[source[leaving]] = True
            left = left[~done[left] & (farthest[left] <= best[component[left]]) & (most < 2 * size)]
            known, most = most, 4 * most
        source, target, angle = map(np.concatenate, zip(*found, strict=True))
        # Break ties of equal angles in one order for all components, so that the edges close no cycle.
        order = np.lexsort((np.maximum(source, target), np.minimum(source, target), angle, component[source]))
        first = np.unique(component[source[order]], return_index=True)[1]
        chosen = order[first]
        ends = np.minimum(source[chosen], target[chosen]), np.maximum(source[chosen], target[chosen])
        edges = np.union1d(edges, ends[0] * size + ends[1])
        graph = coo_array((np.ones(len(edges)), (edges // size, edges % size)), shape=(size, size))
        count, component = connected_components(graph, directed=False)
    return edges // size, edges % size


def _angles(centres: Floats) -> Floats:
    """Return the angles between all pairs of orientations [S, S], radians."""
    return np.asarray(2.0 * np.arccos(np.clip(np.abs(centres @ centres.T), 0.0, 1.0)))


def _nearest(angles: Floats) -> Bools:
    """Return whether each state is among the nearest of another [S, S], given all angles in degrees [S, S]."""
    near = np.zeros(angles.shape, dtype=bool)
    others = angles + np.where(np.eye(len(angles), dtype=bool), np.inf, 0.0)
    order = np.argsort(others, axis=1, kind="stable")[:, :N_BRIDGES_PER_STATE]
    np.put_along_axis(near, order, np.take_along_axis(others, order, 1) <= MAX_BRIDGE_DEG, axis=1)
    return near


def _spanning_tree(angles: Floats) -> Bools:
    """Return the symmetric adjacency matrix [S, S] of a minimum spanning tree by angle."""
    from scipy.sparse.csgraph import minimum_spanning_tree

    # The offset keeps edges of zero length, which a sparse matrix would drop, and does not change the tree.
    tree = minimum_spanning_tree(angles + 1.0).toarray() > 0.0
    return np.asarray(tree | tree.T)
