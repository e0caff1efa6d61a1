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
        states: of the corpus's postures [N, L]; every inner state occurs, or (a pooled facing) is simply its centre's.
        orientations: of the corpus's lanes [N, L, 4].
        a: the first posture's lanes [L, 4].
        b: the last posture's lanes [L, 4].
    """
    moves, lanes = len(path) - 1, path.shape[1]
    chosen = np.zeros((max(moves - 1, 0), lanes), dtype=np.int64)
    for lane in range(lanes):
        layers = [_observed(states[:, lane], path[t, lane]) for t in range(1, moves)]
        if layers:
            chosen[:, lane] = _smoothest(layers, [orientations[layer, lane] for layer in layers], a[lane], b[lane])
    return chosen


def _observed(states: NDArray[np.int32], state: int) -> Ints:
    """Postures in a state, thinned evenly to `MOST`."""
    found = np.flatnonzero(states == state)
    if len(found) <= MOST:
        return found
    return found[np.linspace(0, len(found) - 1, MOST).round().astype(np.int64)]


def _smoothest(layers: list[Ints], keys: list[Floats], a: Floats, b: Floats) -> list[int]:
    """cost[k] of layer t: the least sum of squared angles from `a` to its k-th sample."""
    cost = _squared_angles(a[None], keys[0])[0]
    back = []
    for before, after in pairwise(keys):
        through = cost[:, None] + _squared_angles(before, after)
        back.append(through.argmin(axis=0))
        cost = through.min(axis=0)
    k = int((cost + _squared_angles(keys[-1], b[None])[:, 0]).argmin())
    picked = [int(layers[-1][k])]
    for layer, pointer in zip(layers[-2::-1], back[::-1], strict=True):
        k = int(pointer[k])
        picked.append(int(layer[k]))
    return picked[::-1]


def _squared_angles(a: Floats, b: Floats) -> Floats:
    """Squared angles in radians between all pairs of a [m, 4] and b [n, 4]."""
    return np.asarray((2.0 * np.arccos(np.clip(np.abs(a @ b.T), 0.0, 1.0))) ** 2)
