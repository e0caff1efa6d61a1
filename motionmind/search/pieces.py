"""The pieces of a problem: segments of the path, each with a number of moves and its own trellis and bounds."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.search.problem import Problem, costs_to_go
from motionmind.search.segments import Piece, Segments
from motionmind.search.trellis import Trellis, build_trellis


class Pieces:
    """The pieces of a problem; with a guide, the number of moves is fixed."""

    def __init__(self, problem: Problem) -> None:
        self._problem, self._stops = problem, problem.stops
        self._model, self._timed = problem.model_with_waits(), problem.timed_costs(problem.rules.longest)
        self._kept: dict[int, tuple[int, Floats]] = {}

    def segments(self) -> Segments:
        """Return bounds on all pieces, their chains on their own, finite exactly where a piece has a path."""
        rules, model, longest = self._problem.rules, self._model, self._problem.rules.longest
        count = len(self._stops) - 1
        lower = np.full((count, 1 if self._timed is None or count == 1 else longest + 1, longest + 1), np.inf)
        for segment, stop in enumerate(self._stops[:-1]):
            for last in self._lasts(segment):
                moves = np.arange(last + 1)
                alone = self._to_go(segment, last)[:, model.starts[:-1] + stop].sum(axis=1)
                lower[segment, (last - moves) % lower.shape[1], moves] = alone + rules.per_move * moves
        if count > 1:
            lower[:, :, 0] = np.inf
        if not all(model.allowed[model.starts[:-1] + stop].all() for stop in self._stops[1:-1]):
            lower[:] = np.inf
        return Segments(lower, rules.shortest, [via.move for via in self._problem.vias])

    def trellis(self, piece: Piece, below: float) -> Trellis:
        """Build the trellis of a piece that holds all its paths cheaper than `below` nats, moves not counted."""
        segment, first, moves = piece
        last = self._problem.rules.longest if self._timed is None else first + moves
        timed = None if self._timed is None else self._timed[first : last + 1]
        return build_trellis(self._model, self._stops[segment], moves, self._to_go(segment, last), below, timed)

    def _lasts(self, segment: int) -> range:
        """Return the moves after which a segment may end; only the last one if costs do not depend on the move."""
        longest, left = self._problem.rules.longest, len(self._problem.vias) - segment
        if self._timed is None or left == 0:
            return range(longest, longest + 1)
        move = self._problem.vias[segment].move
        return range(segment + 1, longest - left + 1) if move is None else range(move, min(move, longest) + 1)

    def _to_go(self, segment: int, last: int) -> Floats:
        """Return the costs to go to a segment's end, which the path reaches after move `last` [last + 1, G]."""
        if segment not in self._kept or self._kept[segment][0] != last:
            timed = None if self._timed is None else self._timed[: last + 1]
            self._kept[segment] = last, costs_to_go(self._model, self._stops[segment + 1], last, timed)
        return self._kept[segment][1]
