"""Bridges: unattested moves between states that lie close together on SO(3), for where a corpus has no way through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.grammar.transitions import Transitions

NEAREST = 3  # states to which a bridge leads from each state
WITHIN = 45.0  # degrees that such a bridge may span


@dataclass(frozen=True, eq=False)
class Bridges:
    """Unattested moves, flat as in Transitions: B in all.

    Attributes:
        indptr: bridges of each state [G + 1].
        targets: the state that a bridge leads to, increasing within a row [B].
        degrees: the angle that it spans [B].
    """

    indptr: Ints
    targets: Int32s
    degrees: Floats

    def span(self, row: int, target: int) -> float:
        """Degrees that the bridge from the state of `row` to `target` spans."""
        first, last = self.indptr[row], self.indptr[row + 1]
        return float(self.degrees[first + np.searchsorted(self.targets[first:last], target)])


def find_bridges(centres: Floats, transitions: Transitions) -> Bridges:
    """Bridges between the states of each chain, whose orientations are `centres` [G, 4].

    From every state to its three nearest within 45 degrees, and, both ways, along a minimum spanning tree of the
    chain's states by angle, so that every state can be reached from every other. What is attested is no bridge.
    """
    indptr, targets, degrees = [np.zeros(1, np.int64)], [], []
    for chain, size in enumerate(transitions.sizes()):
        first = transitions.starts[chain]
        # Rounded, so that which of equally near states comes first does not hang on the last bit.
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
    """Angle between all pairs of orientations [S, S]; arccos serves, for states are no less than degrees apart."""
    return np.asarray(2.0 * np.arccos(np.clip(np.abs(centres @ centres.T), 0.0, 1.0)))


def _nearest(angles: Floats) -> Bools:
    near = np.zeros(angles.shape, dtype=bool)
    others = angles + np.where(np.eye(len(angles), dtype=bool), np.inf, 0.0)
    order = np.argsort(others, axis=1, kind="stable")[:, :NEAREST]
    np.put_along_axis(near, order, np.take_along_axis(others, order, 1) <= WITHIN, axis=1)
    return near


def _spanning_tree(angles: Floats) -> Bools:
    from scipy.sparse.csgraph import minimum_spanning_tree

    # The offset keeps edges of zero length, which a sparse matrix would drop, and leaves the tree what it is.
    tree = minimum_spanning_tree(angles + 1.0).toarray() > 0.0
    return np.asarray(tree | tree.T)
