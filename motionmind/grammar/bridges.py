"""Bridges: unattested moves between states that lie close together on SO(3), for corpora that have no path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.grammar.transitions import Transitions

NEAREST = 3  # nearest states to which bridges lead from each state
WITHIN = 45.0  # degrees that such a bridge spans at most


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


def find_bridges(centres: Floats, transitions: Transitions) -> Bridges:
    """Find the bridges between the states of each chain.

    Bridges lead from every state to its three nearest within 45 degrees and, both ways, along a minimum spanning tree
    of the chain's states by angle; so every state can be reached from every other. Attested moves are left out.

    Args:
        centres: orientation of each state of each chain [G, 4].
        transitions: the joint graphs.
    """
    indptr, targets, degrees = [np.zeros(1, np.int64)], [], []
    for chain, size in enumerate(transitions.sizes()):
        first = transitions.starts[chain]
        # Rounded: the order of equally near states must not depend on the last bit.
        angles = np.asarray(np.degrees(_angles(centres[first : first + size])).round(9), dtype=np.float64)
        near = _nearest(angles) | _spanning_tree(angles)
        rows = transitions.indptr[first : first + size + 1]
        attested = transitions.targets[rows[0] : rows[-1]]
        near[np.repeat(np.arange(size), np.diff(rows)), attested] = False
        source, target = np.nonzero(near)
        indptr.append(np.cumsum(np.bincount(source, minlength=size)) + indptr[-1][-1])
        targets.append(target.astype(np.int32))
        degrees.append(angles[source, target])
    return Bridges(np.concatenate(indptr), np.concatenate(targets), np.concatenate(degrees))


def _angles(centres: Floats) -> Floats:
    """Angles between all pairs of orientations [S, S], radians; arccos is accurate enough for states degrees apart."""
    return np.asarray(2.0 * np.arccos(np.clip(np.abs(centres @ centres.T), 0.0, 1.0)))


def _nearest(angles: Floats) -> Bools:
    """Return whether a state is among the nearest of another, given the angles between them in degrees [S, S]."""
    near = np.zeros(angles.shape, dtype=bool)
    others = angles + np.where(np.eye(len(angles), dtype=bool), np.inf, 0.0)
    order = np.argsort(others, axis=1, kind="stable")[:, :NEAREST]
    np.put_along_axis(near, order, np.take_along_axis(others, order, 1) <= WITHIN, axis=1)
    return near


def _spanning_tree(angles: Floats) -> Bools:
    """The adjacency matrix of a minimum spanning tree by angle [S, S], symmetric."""
    from scipy.sparse.csgraph import minimum_spanning_tree

    # The offset keeps edges of zero length, which a sparse matrix would drop, and leaves the tree what it is.
    tree = minimum_spanning_tree(angles + 1.0).toarray() > 0.0
    return np.asarray(tree | tree.T)
