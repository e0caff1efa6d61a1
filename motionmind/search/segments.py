"""Bounds and best paths of a path's segments, from stop to stop, combined into those of the whole path.

All chains are known at every stop, so a segment's cost depends on its own moves alone: on their number, and, where
costs depend on the move, on its first move as well. A whole path is then a path through a small graph: its nodes are
(stop, move at which the path passes it), its edges are segments. The least costs from the start to each node and from
each node to the end give the cost of the best whole path through each edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, States
from motionmind.search.tolerances import SAME_COST_NATS


class Piece(NamedTuple):
    """A segment with its first move (0 where costs do not depend on the move) and its number of moves."""

    segment: int
    first: int
    moves: int


class Segments:
    """Bounds and best paths of K segments in each number of moves up to N; costs in nats.

    Tables are [K, F, N + 1], by segment, first move and number of moves. F is N + 1, or 1 if the first move makes no
    difference.

    Attributes:
        lower: no path of segment k that begins at a move and has n moves costs less [K, F, N + 1].
        best: least cost of a whole path that is known; infinite before there is one.
    """

    def __init__(self, lower: Floats, shortest: int, at: Sequence[int | None]) -> None:
        """Begin with bounds, and no paths.

        Args:
            lower: the bounds [K, F, N + 1], infinite where a segment cannot have as many moves.
            shortest: least number of moves of the whole; N is the greatest.
            at: the move at which to pass each of the K - 1 vias, None for any.
        """
        self.lower, self.best = lower, np.inf
        moves = np.arange(lower.shape[2])
        self._open = [np.where(moves == 0, 0.0, np.inf)]  # 0 at the moves at which each stop may be passed
        self._open += [np.zeros(len(moves)) if move is None else np.where(moves == move, 0.0, np.inf) for move in at]
        self._open.append(np.where(moves >= shortest, 0.0, np.inf))
        self._cost = np.full_like(lower, np.inf)
        self._paths: dict[Piece, States] = {}
        self._unseen = np.isfinite(lower)

    @property
    def moves(self) -> int:
        """The number of moves of the best path."""
        return int(self._least_costs(self._cost)[-1].argmin())

    def lower_bound(self) -> float:
        """Return a lower bound on the cost of every whole path, in nats."""
        return min(float(self._least_costs(self.lower)[-1].min()), self.best)

    def lower_bound_elsewhere(self) -> float:
        """Return a lower bound on the cost of every whole path of another number of moves than the best's, in nats."""
        return float(np.delete(self._least_costs(self.lower)[-1], self.moves).min(initial=np.inf))

    def most_promising(self) -> tuple[Piece, float, float]:
        """Return the unseen piece that may be part of the cheapest path.

        Also return the lower bound on such a path, and the cost below which the piece improves on its own best and on
        the best whole path, both in nats.
        """
        others = self._costs_of_others(self.lower)
        through = np.where(self._unseen, self.lower + others, np.inf)
        piece = Piece(*map(int, np.unravel_index(through.argmin(), through.shape)))
        return piece, float(through[piece]), min(self.best - float(others[piece]), float(self._cost[piece]))

    def reopen(self) -> None:
        """Mark all pieces as unseen."""
        self._unseen = np.isfinite(self.lower)

    def update(self, piece: Piece, lower: float, cost: float, path: States) -> None:
        """Update a piece's lower bound and, unless `path` [n + 1, L] is empty, its best path; mark the piece as seen.

        Of two paths with the same cost up to rounding, keep the later one.
        """
        self._unseen[piece] = False
        self.lower[piece] = max(self.lower[piece], lower)
        if len(path) > 0 and cost <= self._cost[piece] + SAME_COST_NATS:
            self._cost[piece], self._paths[piece] = cost, path
            self.best = float(self._least_costs(self._cost)[-1].min())

    def cost(self, piece: Piece) -> float:
        """Return the least known cost of a piece's paths, nats."""
        return float(self._cost[piece])

    def best_pieces(self) -> list[Piece]:
        """Return the pieces of the best path, from the start on; none before there is one."""
        pieces: list[Piece] = []
        so_far = self._least_costs(self._cost)
        if not np.isfinite(self.best):
            return pieces
        last = int(so_far[-1].argmin())
        for segment in range(len(self._cost) - 1, -1, -1):
            firsts = np.arange(last + 1)
            rows = firsts % self._cost.shape[1]
            first = int((so_far[segment][: last + 1] + self._cost[segment, rows, last - firsts]).argmin())
            pieces.insert(0, Piece(segment, int(rows[first]), last - first))
            last = first
        return pieces

    def path(self) -> tuple[States, tuple[int, ...]]:
        """Return the best path [N + 1, L], and the moves at which it passes its vias."""
        pieces = self.best_pieces()
        paths, stops = [self._paths[piece] for piece in pieces], np.cumsum([piece.moves for piece in pieces[:-1]])
        return np.concatenate([paths[0], *(path[1:] for path in paths[1:])]), tuple(map(int, stops))

    def _least_costs(self, table: Floats) -> list[Floats]:
        """Return the least cost from the start to each of the K + 1 stops, by the move it is passed at [N + 1]."""
        out = [self._open[0]]
        for costs, passing in zip(table, self._open[1:], strict=True):
            least = np.full(len(passing), np.inf)
            for first in np.flatnonzero(np.isfinite(out[-1])):
                rest = least[first:]
                np.minimum(rest, out[-1][first] + costs[first % len(costs), : len(rest)], out=rest)
            out.append(least + passing)
        return out

    def _costs_of_others(self, table: Floats) -> Floats:
        """Return the least cost of all other segments together, for each piece [K, F, N + 1]."""
        so_far, to_go, out = self._least_costs(table), self._open[-1], np.full_like(table, np.inf)
        for segment in range(len(table) - 1, -1, -1):
            costs, other, least = table[segment], out[segment], np.full(len(to_go), np.inf)
            for first in np.flatnonzero(np.isfinite(so_far[segment])):
                row, rest = first % len(costs), to_go[first:]
                mine = other[row, : len(rest)]
                np.minimum(mine, so_far[segment][first] + rest, out=mine)
                least[first] = (costs[row, : len(rest)] + rest).min()
            to_go = least + self._open[segment]
        return out
