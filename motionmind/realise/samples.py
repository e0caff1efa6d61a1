"""Which of the orientations that a corpus shows in each state to pass through, so that they join most smoothly."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST = 24  # observed orientations considered in each state


def choose_samples(observed: Ints, keys: Floats, a: Floats, b: Floats) -> Ints:
    """Postures [T - 1, L] whose orientations a path's inner states take, lane by lane.

    In each lane the sequence from `a` through one observed orientation in each inner state to `b` for which the sum of
    squared angles between neighbours is least: of all ways to cover the distance, the one in the evenest steps. Found
    exactly, by dynamic programming over the samples of each state.

    Args:
        observed: the postures to choose from [T - 1, L, M].
        keys: their orientations in the lane [T - 1, L, M, 4].
        a: of the first posture [L, 4].
        b: of the last posture [L, 4].
    """
    lanes = observed.shape[1]
    if len(observed) == 0:
        return np.zeros((0, lanes), dtype=np.int64)
    # cost[l, k]: the least sum of squared angles in lane l from `a` to its k-th sample; back: from which sample before.
    cost, back = _squared_angles(a[:, None], keys[0])[:, 0], []
    for before, after in pairwise(keys):
        through = cost[:, :, None] + _squared_angles(before, after)
        back.append(through.argmin(axis=1))
        cost = through.min(axis=1)
    cost = cost + _squared_angles(keys[-1], b[:, None])[:, :, 0]
    picked = [cost.argmin(axis=1)]
    for pointer in back[::-1]:
        picked.append(pointer[np.arange(lanes), picked[-1]])
    return np.asarray(np.take_along_axis(observed, np.stack(picked[::-1])[..., None], axis=-1)[..., 0])


def find_samples(path: NDArray[np.int32], states: NDArray[np.int32]) -> Ints:
    """Postures in the states of a path [T + 1, L] between its ends [T - 1, L, MOST], of a corpus's states [N, L].

    `MOST` of each, thinned evenly, or some more than once where there are fewer; every inner state occurs.
    """
    out = np.empty((max(len(path) - 2, 0), path.shape[1], MOST), dtype=np.int64)
    for lane in range(path.shape[1]):
        column = np.ascontiguousarray(states[:, lane])  # a corpus may be large; it is looked through once a state
        for state in np.unique(path[1:-1, lane]):
            found = np.flatnonzero(column == state)
            out[path[1:-1, lane] == state, lane] = found[np.arange(MOST) * len(found) // MOST]
    return out


def _squared_angles(a: Floats, b: Floats) -> Floats:
    """Squared angles in radians between all pairs of a [L, m, 4] and b [L, n, 4]: [L, m, n]."""
    return np.asarray((2.0 * np.arccos(np.minimum(np.abs(a @ np.swapaxes(b, -1, -2)), 1.0))) ** 2)
