"""Bridges: unattested moves between states that lie close together on SO(3), for corpora that have no path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.executors.here import this_process
from motionmind.executors.team import Team
from motionmind.grammar.transitions import Transitions

N_BRIDGES_PER_STATE = 3  # nearest states to which bridges lead from each state
MAX_BRIDGE_DEG = 45.0  # degrees that such a bridge spans at most
MAX_STATES_COMPARED = 1024  # states of a chain that are all compared in pairs: 8 MB a table


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
        team: threads, for which each chain is a job; None for this one.
    """
    sizes = transitions.sizes()

    def find(chain: int) -> tuple[Ints, Int32s, Floats]:
        first, size = transitions.starts[chain], sizes[chain]
        own = centres[first : first + size]
        keys, angles = _of_all_pairs(own) if size <= MAX_STATES_COMPARED else _of_near_pairs(own)
        rows = transitions.indptr[first : first + size + 1]
        attested = np.repeat(np.arange(size), np.diff(rows)) * size + transitions.targets[rows[0] : rows[-1]]
        new = ~np.isin(keys, attested)
        leaving = np.bincount(keys[new] // size, minlength=size)
        return leaving, (keys[new] % size).astype(np.int32), angles[new]

    found = (team or this_process()).map(find, range(len(sizes)))
    leaving, targets, degrees = map(np.concatenate, zip(*found, strict=True))
    return Bridges(np.concatenate([[0], np.cumsum(leaving)]), targets, degrees)


def _of_all_pairs(centres: Floats) -> tuple[Ints, Floats]:
    """Return the bridges between states [S, 4], attested or not: s * S + s' for s -> s', increasing [B], and their
    angles in degrees [B]."""
    # Rounded: the order of equally near states must not depend on the last bit.
    angles = np.asarray(np.degrees(_angles(centres)).round(9), dtype=np.float64)
    keys = np.flatnonzero(_nearest(angles) | _spanning_tree(angles))
    return keys, angles.ravel()[keys]


def _of_near_pairs(centres: Floats) -> tuple[Ints, Floats]:
    """Return the same as `_of_all_pairs` but for the order of equal angles, from pairs that a k-d tree finds near."""
    size, tree = len(centres), _Neighbours(centres)
    source, target, angle = tree.of(np.arange(size), 0, 2 * (N_BRIDGES_PER_STATE + 1))
    order = np.lexsort((target, angle, source))
    source, target, angle = source[order], target[order], angle[order]
    rank = np.arange(len(source)) - np.searchsorted(source, source)
    near = (rank < N_BRIDGES_PER_STATE) & (angle <= MAX_BRIDGE_DEG)
    one, other = _least_spanning_edges(tree, size)
    keys = np.unique(np.concatenate([source[near] * size + target[near], one * size + other, other * size + one]))
    return keys, tree.angles(keys // size, keys % size)


class _Neighbours:
    """The neighbours of states by angle: each orientation is two opposite points on the sphere of quaternions."""

    def __init__(self, centres: Floats) -> None:
        from scipy.spatial import cKDTree  # slow to import

        self._centres = centres
        self._tree = cKDTree(np.concatenate([centres, -centres]))

    def of(self, states: Ints, known: int, count: int) -> tuple[Ints, Ints, Floats]:
        """Return pairs of some states with their neighbours from the `known`th on to the `count`th: states, other
        states, and angles in degrees, each [P]. A state is twice a neighbour, and never its own."""
        count = min(count, 2 * len(self._centres))
        _, near = self._tree.query(self._centres[states], k=np.arange(known + 1, count + 1))
        source, target = np.repeat(states, near.shape[1]), near.ravel() % len(self._centres)
        others = source != target
        return source[others], target[others], self.angles(source[others], target[others])

    def angles(self, one: Ints, other: Ints) -> Floats:
        """Return the angles between states and others, degrees [P]."""
        cosines = np.abs(np.sum(self._centres[one] * self._centres[other], axis=1))
        return np.asarray(np.degrees(2.0 * np.arccos(np.clip(cosines, 0.0, 1.0))).round(9))


def _least_spanning_edges(tree: _Neighbours, size: int) -> tuple[Ints, Ints]:
    """Return the ends of the edges [S - 1] of a minimum spanning tree by angle.

    Of each component the least edge that leaves it is in the tree, round by round. Source: Boruvka's algorithm, as in
    March, Ram and Gray, "Fast Euclidean minimum spanning tree", KDD (2010), but for their bounds on whole subtrees.
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
        # Equal angles in one order for all components: so the edges close no cycle.
        order = np.lexsort((np.maximum(source, target), np.minimum(source, target), angle, component[source]))
        first = np.unique(component[source[order]], return_index=True)[1]
        chosen = order[first]
        ends = np.minimum(source[chosen], target[chosen]), np.maximum(source[chosen], target[chosen])
        edges = np.union1d(edges, ends[0] * size + ends[1])
        graph = coo_array((np.ones(len(edges)), (edges // size, edges % size)), shape=(size, size))
        count, component = connected_components(graph, directed=False)
    return edges // size, edges % size


def _angles(centres: Floats) -> Floats:
    """Angles between all pairs of orientations [S, S], radians; arccos is accurate enough for states degrees apart."""
    return np.asarray(2.0 * np.arccos(np.clip(np.abs(centres @ centres.T), 0.0, 1.0)))


def _nearest(angles: Floats) -> Bools:
    """Return whether a state is among the nearest of another, given the angles between them in degrees [S, S]."""
    near = np.zeros(angles.shape, dtype=bool)
    others = angles + np.where(np.eye(len(angles), dtype=bool), np.inf, 0.0)
    order = np.argsort(others, axis=1, kind="stable")[:, :N_BRIDGES_PER_STATE]
    np.put_along_axis(near, order, np.take_along_axis(others, order, 1) <= MAX_BRIDGE_DEG, axis=1)
    return near


def _spanning_tree(angles: Floats) -> Bools:
    """The adjacency matrix of a minimum spanning tree by angle [S, S], symmetric."""
    from scipy.sparse.csgraph import minimum_spanning_tree

    # The offset keeps edges of zero length, which a sparse matrix would drop, and leaves the tree what it is.
    tree = minimum_spanning_tree(angles + 1.0).toarray() > 0.0
    return np.asarray(tree | tree.T)
