"""Which of the orientations that a corpus shows in each state to pass through, so that they join most smoothly."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST = 24  # observed orientations considered in each state


def choose_samples(
    path: NDArray[np.int32], states: NDArray[np.int32], orientations: Floats, a: Floats, b: Floats
) -> Ints:
    """Postures [T - 1, L] whose orientations a path's inner states take, lane by lane.

    In each lane the sequence from `a` through one observed orientation in each inner state to `b` for which the sum of
    squared angles between neighbours is least: of all ways to cover the distance, the one in the evenest steps. Found
    exactly, by dynamic programming over at most `MOST` evenly spaced samples a state.

    Args:
        path: states [T + 1, L].
        states: of the corpus's postures [N, L]; every inner state occurs.
        orientations: of the corpus's postures [N, L, 4].
        a: of the first posture [L, 4].
        b: of the last posture [L, 4].
    """
    moves, lanes = len(path) - 1, path.shape[1]
    if moves < 2:
        return np.zeros((0, lanes), dtype=np.int64)
    observed = np.array(
        [[_observed(states[:, lane], path[t, lane]) for lane in range(lanes)] for t in range(1, moves)]
    )  # [T - 1, L, MOST]
    keys = orientations[observed, np.arange(lanes)[:, None]]
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


def _observed(states: NDArray[np.int32], state: int) -> Ints:
    """Postures in a state: `MOST` of them, thinned evenly, or some more than once where there are fewer."""
    found = np.flatnonzero(states == state)
    return found[np.arange(MOST) * len(found) // MOST]


def _squared_angles(a: Floats, b: Floats) -> Floats:
    """Squared angles in radians between all pairs of a [L, m, 4] and b [L, n, 4]: [L, m, n]."""
    return np.asarray((2.0 * np.arccos(np.minimum(np.abs(a @ np.swapaxes(b, -1, -2)), 1.0))) ** 2)
