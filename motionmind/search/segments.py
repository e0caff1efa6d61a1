"""Bounds and best paths of a path's segments, from stop to stop, put together to those of the whole.

All chains are known at every stop, so what a segment costs depends on its own moves alone. A path of N moves in K
segments costs the sum over k of what segment k costs in n_k moves, with n_1 + ... + n_K = N. The least costs over all
splits are min-plus convolutions.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from motionmind._typing import Floats, States


class Segments:
    """Bounds and best paths of K segments at each number of moves up to N; costs in nats.

    Attributes:
        lower: no path of segment k with n moves costs less [K, N + 1].
        best: least cost of a whole path that is known; infinite before there is one.
    """

    def __init__(self, lower: Floats, shortest: int, at: Sequence[int | None]) -> None:
        """Begin with bounds, and no paths.

        Args:
            lower: the bounds [K, N + 1], infinite where a segment cannot have as many moves.
            shortest: least number of moves of the whole; N is the greatest.
            at: the moves at which the K - 1 vias are passed, None for any.
        """
        self.lower, self.best = lower, np.inf
        moves = np.arange(lower.shape[1])
        self._total = np.where(moves >= shortest, 0.0, np.inf)
        self._at = [np.zeros(len(moves)) if move is None else np.where(moves == move, 0.0, np.inf) for move in at]
        self._cost = np.full_like(lower, np.inf)
        self._paths: dict[tuple[int, int], States] = {}
        self._unseen = np.isfinite(lower)

    def lower_bound(self) -> float:
        """Return a lower bound on the cost of every whole path, in nats."""
        return min(float((self.lower + self._others(self.lower)).min()), self.best)

    def most_promising(self) -> tuple[int, int, float, float]:
        """Return the unseen segment and number of moves that may be part of the cheapest path.

        With them come the least that such a path may cost, and the cost below which the segment improves on its own
        best and on the best whole path, in nats.
        """
        others = self._others(self.lower)
        through = np.where(self._unseen, self.lower + others, np.inf)
        segment, moves = map(int, np.unravel_index(through.argmin(), through.shape))
        below = min(self.best - float(others[segment, moves]), float(self._cost[segment, moves]))
        return segment, moves, float(through[segment, moves]), below

    def reopen(self, left: Iterable[tuple[int, int]]) -> None:
        """Mark just these segments and numbers of moves as unseen."""
        self._unseen[:] = False
        for segment, moves in left:
            self._unseen[segment, moves] = True

    def update(self, segment: int, moves: int, lower: float, cost: float, path: States) -> None:
        """Take in a segment's bound, and a path of it [n + 1, L] with its cost, or an empty one; mark it as seen."""
        self._unseen[segment, moves] = False
        self.lower[segment, moves] = max(self.lower[segment, moves], lower)
        if len(path) > 0 and cost < self._cost[segment, moves]:
            self._cost[segment, moves], self._paths[segment, moves] = cost, path
            self.best = min(self.best, float((self._cost + self._others(self._cost)).min()))

    def path(self) -> tuple[States, tuple[int, ...]]:
        """Return the best path [N + 1, L], and the moves at which it passes its vias."""
        cost, pieces = self._cost.copy(), []
        for segment in range(len(cost)):
            moves = int((cost + self._others(cost))[segment].argmin())
            cost[segment, np.arange(cost.shape[1]) != moves] = np.inf
            pieces.append(self._paths[segment, moves])
        stops = np.cumsum([len(piece) - 1 for piece in pieces[:-1]])
        return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])]), tuple(map(int, stops))

    def _others(self, table: Floats) -> Floats:
        """Return the least cost of all other segments together, by the segment's number of moves [K, N + 1]."""
        before = [np.where(np.arange(table.shape[1]) == 0, 0.0, np.inf)]
        for costs, at in zip(table[:-1], self._at, strict=True):
            before.append(_min_plus(before[-1], costs) + at)
        after, out = self._total, np.empty_like(table)
        for segment in range(len(table) - 1, -1, -1):
            out[segment] = _min_plus(before[segment], after[::-1])[::-1]
            if segment:
                after = _min_plus(table[segment], after[::-1])[::-1] + self._at[segment - 1]
        return out


def _min_plus(a: Floats, b: Floats) -> Floats:
    """Return the min-plus convolution c[n] = min over m of a[m] + b[n - m]."""
    out = np.full(len(a), np.inf)
    for m in np.flatnonzero(np.isfinite(a)):
        np.minimum(out[m:], a[m] + b[: len(b) - m], out=out[m:])
    return out
