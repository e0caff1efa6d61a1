"""Solve a problem over all numbers of moves by A*, with a certificate that bounds the optimality gap."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from motionmind._typing import Int32s
from motionmind.errors import InfeasibleError
from motionmind.search import bounding, parts, trws
from motionmind.search.bounding import Bounded, tighten
from motionmind.search.heuristic import Heuristic
from motionmind.search.length import LengthChoice, choose_length
from motionmind.search.pieces import Pieces
from motionmind.search.problem import Problem, Rules, Via
from motionmind.search.segments import Piece, Segments
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS, ROUNDING_NATS
from motionmind.search.watcher import Stopwatch, Watcher

MAX_CHAIN_STATES = 1 << 16  # A* stores the states of a chain in 16 bits

Status = Literal["optimal", "bounded", "interrupted", "sampled"]


class Progress(NamedTuple):
    """Progress of a search.

    Attributes:
        cost: cost of the best path so far, nats; infinite before there is any.
        lower_bound: proven bound on all paths, nats.
        expansions: nodes that A* has expanded.
    """

    cost: float
    lower_bound: float
    expansions: int


Watch = Callable[[Progress], bool | None]


@dataclass(frozen=True, eq=False)
class Certificate:
    """The best path found, with the proof of its quality.

    Attributes:
        path: states [T + 1, L].
        cost: its cost, nats.
        lower_bound: no path within the rules costs less than this, nats.
        status: "optimal" if the two agree to 1e-6 nats, else "interrupted" or "bounded"; "sampled" for a path that was
            sampled.
        expansions: nodes expanded by A*.
        peak_nodes: the greatest number of nodes held at once.
        seconds: measured time for "problem", "bound" and "search"; not part of the proof.
        passed: the moves at which the path passes its vias [K].
        length: how the number of moves was chosen, given tolls or a guide; None if the number was given.
    """

    path: Int32s
    cost: float
    lower_bound: float
    status: Status
    expansions: int
    peak_nodes: int
    seconds: dict[str, float]
    passed: tuple[int, ...] = ()
    length: LengthChoice | None = None


def solve(problem: Problem, watch: Watch | None = None) -> Certificate:
    """Find the cheapest path over all numbers of moves, and bound its optimality gap.

    First bound each number of moves, in order of the sum of the chains' independent costs, until that sum reaches the
    cost of the best path found. A* then searches the undecided numbers of moves, and always that of the best path; its
    result is the answer, unless its nodes run out. The proven lower bound is the least of all bounds.

    Vias divide the path into segments of at least one move, each with its own numbers of moves. The search of a segment
    looks only for paths that cost less than the best path minus the lower bounds of the other segments.

    A guide determines how to move in a number of moves, not how many to make. So if the rules leave a choice, take the
    number of moves of the cheapest path without the guide, and certify the guided problem with that number. With tolls,
    choose it by tolls and haste (`motionmind.search.length`), together with the moves at which to pass the vias.

    Args:
        problem: what to solve.
        watch: called with the progress about every 0.1 s; if it returns True, the search stops as soon as it knows any
            path, with the bound proven by then. While the number of moves is chosen, costs are those without a guide.

    Raises:
        InfeasibleError: no path satisfies the problem.
        ValueError: a chain has too many states, or the guide has costs that the problem cannot take.
    """
    states = int(np.diff(problem.model.starts).max())
    if states > MAX_CHAIN_STATES:
        raise ValueError(f"a chain has {states} states; the search takes up to {MAX_CHAIN_STATES}")
    solver, rules, length = _Solver(watch), problem.rules, None
    if rules.shortest < rules.longest and problem.tolls is not None:
        length = choose_length(problem)
        vias = [Via(via.states, move) for via, move in zip(problem.vias, length.passed, strict=True)]
        problem = replace(problem, vias=vias)
    elif rules.shortest < rules.longest and problem.guide is not None:
        solver.start(replace(problem, guide=None))
        length = solver.choose_length()
    if length is not None:
        problem = replace(problem, rules=replace(rules, shortest=length.moves, longest=length.moves))
    solver.start(problem)
    solver.run()
    return solver.certificate(length)


def feasible(problem: Problem) -> bool:
    """Return whether any path satisfies the problem; a guide forbids none."""
    return bool(np.isfinite(Pieces(replace(problem, guide=None)).segments().lower_bound()))


class _Solver:
    """The state of one search: `start` a problem, then `choose_length` or `run`, then ask for the `certificate`."""

    rules: Rules
    pieces: Pieces
    segments: Segments
    kept: dict[Piece, Bounded]  # bounded pieces that A* may have to search
    searched: set[Piece]
    expansions: int
    peak_nodes: int

    def __init__(self, watch: Watch | None) -> None:
        self.stopwatch = Stopwatch("problem", "bound", "search")
        self.watcher = Watcher(None if watch is None else lambda: bool(watch(self.progress())))

    def start(self, problem: Problem) -> None:
        """Begin with a problem."""
        self.rules, self.expansions, self.peak_nodes = problem.rules, 0, 0
        self.kept, self.searched = {}, set()
        self.pieces = Pieces(problem)
        self.segments = self.pieces.segments()
        self.stopwatch.lap("problem")

    def progress(self) -> Progress:
        return Progress(self.segments.best, self.segments.lower_bound(), self.expansions)

    def run(self) -> None:
        """Search until the best path is proven, the budget is spent or the watcher stops; then A* on its pieces."""
        self._bound(lambda: False)
        self._search(lambda: False)
        for piece in self.segments.best_pieces():
            if piece not in self.searched:
                self._search_piece(piece, self.segments.cost(piece) + 2.0 * ROUNDING_NATS)

    def choose_length(self) -> LengthChoice:
        """Search until the number of moves of the best path is proven, and return it: the choice without tolls."""
        self._bound(self._length_is_proven)
        self._search(self._length_is_proven)
        cost, lower_bound = self._result()
        segments = self.segments
        return LengthChoice(segments.moves, cost, lower_bound, segments.lower_bound_elsewhere(), self.expansions)

    def _length_is_proven(self) -> bool:
        return (
            np.isfinite(self.segments.best)
            and self.segments.lower_bound_elsewhere() > self.segments.best - OPTIMAL_WITHIN_NATS
        )

    def _bound(self, enough: Callable[[], bool]) -> None:
        """Bound pieces, and find paths, until the best is proven or only a search can improve further."""
        pairs = 0  # in the pair chains that are kept
        while True:
            piece, least, below = self.segments.most_promising()
            if not least < self.segments.best - OPTIMAL_WITHIN_NATS or enough():
                return
            if self.watcher.wants_stop() and np.isfinite(self.segments.best):
                return
            state = self._bounded(piece, below)
            more = len(state.heuristic.tables.pair_cost)
            if (state.found or not state.closed) and pairs + more <= bounding.MAX_STATE_PAIRS:
                self.kept[piece] = state
                pairs += more
            self._update(piece, state)
            self.stopwatch.lap("bound")

    def _bounded(self, piece: Piece, below: float) -> Bounded:
        """Return bounds on a piece, restricted to paths cheaper than `below` nats."""
        below -= self.rules.per_move * piece.moves
        trellis = self.pieces.trellis(piece, below)
        state = Bounded(trellis, Heuristic.of_messages(trws.no_messages(trellis)), below)
        self.stopwatch.lap("problem")
        tighten(state, self.rules.sweeps, self.watcher)
        return state

    def _search(self, enough: Callable[[], bool]) -> None:
        """Search by A* the pieces that their bounds leave open, the most promising first."""
        self.segments.reopen()
        while True:
            piece, least, below = self.segments.most_promising()
            spent = self.expansions >= self.rules.node_budget
            if not least < self.segments.best - OPTIMAL_WITHIN_NATS or enough() or spent or self.watcher.wants_stop():
                return
            self._search_piece(piece, below)

    def _search_piece(self, piece: Piece, below: float) -> None:
        """Search a piece by A* for a path that costs less than `below` nats."""
        state = self.kept.pop(piece, None) or self._bounded(piece, below)
        state.undercut(below - self.rules.per_move * piece.moves)
        nodes = self.rules.node_budget
        effort = parts.search(state, nodes, nodes - self.expansions, self.watcher)
        self._update(piece, state)
        self.searched.add(piece)
        self.expansions += effort.expansions
        self.peak_nodes = max(self.peak_nodes, effort.peak_nodes)
        self.stopwatch.lap("search")

    def _update(self, piece: Piece, state: Bounded) -> None:
        toll = self.rules.per_move * piece.moves
        self.segments.update(piece, state.lower_bound + toll, state.cost + toll, state.states)

    def certificate(self, length: LengthChoice | None) -> Certificate:
        """Return the best path and the proof."""
        (cost, lower_bound), (path, passed) = self._result(), self.segments.path()
        status: Status = "bounded"
        if cost - lower_bound <= OPTIMAL_WITHIN_NATS:
            status = "optimal"
        elif self.watcher.stopped[0]:
            status = "interrupted"
        return Certificate(
            path, cost, lower_bound, status, self.expansions, self.peak_nodes, self.stopwatch.seconds, passed, length
        )

    def _result(self) -> tuple[float, float]:
        """Return the best cost and the lower bound on all, in nats."""
        if not np.isfinite(self.segments.best):
            raise InfeasibleError("no path satisfies the problem")
        return self.segments.best, self.segments.lower_bound()
