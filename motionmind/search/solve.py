"""Solve a problem over all numbers of moves, with a certificate of how close to optimal the path is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from motionmind._typing import Int32s, Ints
from motionmind.errors import InfeasibleError
from motionmind.search import astar, pair_chains, trws
from motionmind.search.attention import Attention, Clock
from motionmind.search.costs import path_cost
from motionmind.search.pair_chain_tables import PairChains, count_pairs
from motionmind.search.pieces import Pieces
from motionmind.search.polish import polish
from motionmind.search.problem import Problem, Rules
from motionmind.search.segments import Piece, Segments
from motionmind.search.trellis import Trellis
from motionmind.search.trws import Messages

SWEEPS_AT_ONCE = 2  # few, since pruning pays at once: 2 is fastest of 1 to 8 on real ballet
STALLED = (
    0.9  # message sweeps that leave more than this share of the gap, and of the positions, give way to pair chains
)
PAIR_CHAIN_SWEEPS = 100  # at most, for each number of moves
PAIR_CHAINS_STALLED = 0.98  # as STALLED; then A* takes over
WORTH_POLISHING = 0.1  # paths that cost more than this share above the best are not polished
MOST_STATES_OF_CHAIN = 1 << 16  # A* numbers the states of a chain in 16 bits
MOST_PAIRS = 1 << 23  # pairs of states in pair chains, 32 bytes each; more are not built, nor kept for A*
PROVEN = 1e-6  # nats: a path within this of its lower bound is reported as optimal

Status = Literal["optimal", "bounded", "interrupted", "sampled"]


class Progress(NamedTuple):
    """Progress of a search.

    Attributes:
        cost: of the best path so far, nats; infinite before there is any.
        lower_bound: proven of all paths, nats.
        expansions: nodes that A* has expanded.
    """

    cost: float
    lower_bound: float
    expansions: int


Watch = Callable[[Progress], bool | None]


@dataclass(frozen=True)
class LengthChoice:
    """The choice of a number of moves, by what paths cost without the guide.

    Attributes:
        moves: the number of moves of the cheapest path known without the guide.
        cost: its cost, nats.
        lower_bound: no path costs less than this without the guide, nats.
        lower_bound_elsewhere: no path of another number of moves does, nats; the choice is proven where this is no less
            than `cost`, to 1e-6 nats.
        expansions: nodes that A* expanded for the choice.
    """

    moves: int
    cost: float
    lower_bound: float
    lower_bound_elsewhere: float
    expansions: int


@dataclass(frozen=True, eq=False)
class Certificate:
    """The best path found, and how close to optimal it provably is.

    Attributes:
        path: states [T + 1, L].
        cost: its cost, nats.
        lower_bound: no path within the rules costs less than this, nats.
        status: "optimal" if the two agree to 1e-6 nats, else "interrupted" or "bounded"; "sampled" for a path that was
            sampled.
        expansions: nodes expanded by A*.
        peak_nodes: the greatest number of nodes held at once.
        seconds: time spent on "problem", "bound" and "search"; a measurement, and no part of the proof.
        passed: the moves at which the path passes its vias [K].
        length: how its number of moves was chosen, where a guide led the search; None where the number was given.
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
    """Find the cheapest path over all numbers of moves, and prove how good it is.

    Numbers of moves are bounded in the order of what the chains cost on their own, as long as that is below the cost of
    the best path found; those that this leaves undecided are searched by A*. The least of all bounds is what is proven.

    Vias divide the path into segments of at least one move. Then the numbers of moves are those of a segment, each
    bounded below what the best path leaves when the other segments cost as little as is proven.

    A guide says how to move in a number of moves, not how many to make. So where the rules leave a choice the number
    of moves is that of the cheapest path without the guide, and the certificate is that of the guided problem in it.

    Args:
        problem: what to solve.
        watch: called with the progress between pieces of work; if it returns True the search ends as soon as any path
            is known, with what is proven by then. While the number of moves is chosen, costs are those without a guide.

    Raises:
        InfeasibleError: no path satisfies the problem.
        ValueError: a chain has too many states, or the guide has costs that the problem cannot take.
    """
    states = int(np.diff(problem.model.starts).max())
    if states > MOST_STATES_OF_CHAIN:
        raise ValueError(f"a chain has {states} states; the search takes up to {MOST_STATES_OF_CHAIN}")
    solver, rules, length = _Solver(watch), problem.rules, None
    if problem.guide is not None and rules.shortest < rules.longest:
        solver.start(replace(problem, guide=None))
        length = solver.choose_length()
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
    expansions: int
    peak_nodes: int

    def __init__(self, watch: Watch | None) -> None:
        self.clock = Clock("problem", "bound", "search")
        self.attention = Attention(None if watch is None else lambda: bool(watch(self.progress())))

    def start(self, problem: Problem) -> None:
        """Begin with a problem."""
        self.rules, self.expansions, self.peak_nodes = problem.rules, 0, 0
        self.pieces = Pieces(problem)
        self.segments = self.pieces.segments()
        self.clock.lap("problem")

    def progress(self) -> Progress:
        return Progress(self.segments.best, self.segments.lower_bound(), self.expansions)

    def run(self) -> None:
        """Search until the best path is proven, the budget spent, or the search is to end."""
        self._search(self._bound(lambda: False), lambda: False)

    def choose_length(self) -> LengthChoice:
        """Search until the number of moves of the best path is proven, and return it."""
        self._search(self._bound(self._length_is_proven), self._length_is_proven)
        cost, lower_bound = self._result()
        segments = self.segments
        return LengthChoice(segments.moves, cost, lower_bound, segments.lower_bound_elsewhere(), self.expansions)

    def _length_is_proven(self) -> bool:
        return np.isfinite(self.segments.best) and self.segments.lower_bound_elsewhere() > self.segments.best - PROVEN

    def _bound(self, enough: Callable[[], bool]) -> dict[Piece, tuple[Trellis, PairChains]]:
        """Bound pieces, and find paths; return those left for A*."""
        left: dict[Piece, tuple[Trellis, PairChains]] = {}
        kept = 0  # pairs in them
        while True:
            piece, least, below = self.segments.most_promising()
            if not least < self.segments.best - PROVEN or enough():
                return left
            if self.attention.ends() and np.isfinite(self.segments.best):
                return left
            toll = self.rules.per_move * piece.moves
            trellis = self.pieces.trellis(piece, below - toll)
            state = _Bounded(trellis, below - toll)
            self.clock.lap("problem")
            messages = _tighten_by_messages(state, self.rules.sweeps, self.attention)
            if (
                not (state.closed or self.attention.ends())
                and trellis.chains > 1
                and count_pairs(state.trellis) <= MOST_PAIRS
            ):
                tables = _tighten_by_pair_chains(state, pair_chains.build(state.trellis, messages), self.attention)
                if not state.closed and kept + len(tables.pair_cost) <= MOST_PAIRS:
                    left[piece] = state.trellis, tables
                    kept += len(tables.pair_cost)
            self.segments.update(piece, state.lower_bound + toll, state.cost + toll, state.states)
            self.clock.lap("bound")

    def _search(self, left: dict[Piece, tuple[Trellis, PairChains]], enough: Callable[[], bool]) -> None:
        """Search by A* what is left."""
        self.segments.reopen(left)
        while True:
            piece, least, below = self.segments.most_promising()
            if not least < self.segments.best - PROVEN or enough() or self.attention.ends():
                return
            toll, budget = self.rules.per_move * piece.moves, self.rules.node_budget - self.expansions
            trellis, tables = left.pop(piece)
            found = _search(trellis, tables, below - toll, self.rules.node_budget, budget, self.attention)
            self.segments.update(piece, found.lower_bound + toll, found.cost + toll, found.states)
            self.expansions += found.expansions
            self.peak_nodes = max(self.peak_nodes, found.peak_nodes)
            self.clock.lap("search")

    def certificate(self, length: LengthChoice | None) -> Certificate:
        """Return what was found and proven."""
        (cost, lower_bound), (path, passed) = self._result(), self.segments.path()
        status: Status = "bounded"
        if cost - lower_bound <= PROVEN:
            status = "optimal"
        elif self.attention.ended[0]:
            status = "interrupted"
        return Certificate(
            path, cost, lower_bound, status, self.expansions, self.peak_nodes, self.clock.seconds, passed, length
        )

    def _result(self) -> tuple[float, float]:
        """Return the best cost and the lower bound on all, in nats."""
        if not np.isfinite(self.segments.best):
            raise InfeasibleError("no path satisfies the problem")
        return self.segments.best, self.segments.lower_bound()


class _Bounded:
    """Bounds on one segment in one number of moves.

    Attributes:
        trellis: what is left of it; no path cheaper than `cost` lies outside.
        cost: cost of the best path found, or what it has to be cheaper than, nats.
        states: the best path found [T + 1, L]; empty until then.
        lower_bound: no path that is cheaper than `cost` costs less than this, nats.
    """

    def __init__(self, trellis: Trellis, cost: float) -> None:
        self.trellis, self.cost, self.lower_bound = trellis, cost, -np.inf
        self.states = np.zeros((0, trellis.chains), dtype=np.int32)

    @property
    def closed(self) -> bool:
        """Whether bound and path meet, or nothing is left that a better path could go through."""
        return self.lower_bound >= self.cost - PROVEN

    def update(self, lower_bound: float, chosen: Ints) -> None:
        """Take in a bound, and a path of positions [n], which is polished if it is near the best."""
        if path_cost(self.trellis, chosen) <= self.cost + WORTH_POLISHING * abs(self.cost):
            cost = polish(self.trellis, chosen)
            if cost < self.cost:
                self.cost, self.states = cost, _states(self.trellis, chosen)
        self.lower_bound = min(max(self.lower_bound, lower_bound), self.cost)

    def replace_trellis(self, trellis: Trellis) -> None:
        """Go on with a pruned trellis; if one of its domains is empty, nothing is left."""
        self.trellis = trellis
        if np.any(np.diff(trellis.dom_ptr) == 0):
            self.lower_bound = self.cost

    def stalls(self, gap: float, size: int, share: float) -> bool:
        """Return whether more than a share is left of an earlier gap, and of an earlier number of positions."""
        return self.cost - self.lower_bound > share * gap and len(self.trellis.dom) > share * size


def _tighten_by_messages(state: _Bounded, sweeps: int, attention: Attention) -> Messages:
    """Tighten the bound by messages, and return the last.

    Every few sweeps the path that they met is polished, and positions that no better path goes through are pruned. It
    ends when bound and path meet, when the gap between them hardly shrinks, or when the search is to end.
    """
    messages = trws.no_messages(state.trellis)
    for done in range(0, sweeps, SWEEPS_AT_ONCE):
        gap, size = state.cost - state.lower_bound, len(state.trellis.dom)
        chosen = np.zeros(len(state.trellis.dom_ptr) - 1, dtype=np.int64)
        lower_bound, _ = trws.tighten(state.trellis, messages, chosen, min(SWEEPS_AT_ONCE, sweeps - done), state.cost)
        state.update(lower_bound, chosen)
        if state.closed:
            break
        trellis, messages = trws.prune(state.trellis, messages, state.cost - astar.SAME)
        state.replace_trellis(trellis)
        if state.closed or attention.ends() or (done and state.stalls(gap, size, STALLED)):
            break
    return messages


def _tighten_by_pair_chains(state: _Bounded, tables: PairChains, attention: Attention) -> PairChains:
    """Tighten the bound further by pair chains, in the same way, and return the last."""
    state.lower_bound = max(state.lower_bound, min(pair_chains.lower_bound(tables), state.cost))
    for done in range(PAIR_CHAIN_SWEEPS):
        if state.closed:
            break
        gap, size = state.cost - state.lower_bound, len(state.trellis.dom)
        chosen, through = np.zeros(len(state.trellis.dom_ptr) - 1, dtype=np.int64), np.zeros(size)
        lower_bound = pair_chains.sweep(state.trellis, tables, through)
        pair_chains.descend(state.trellis, tables, chosen)
        state.update(lower_bound, chosen)
        if not state.closed:
            trellis, tables = pair_chains.prune(state.trellis, tables, through, state.cost - astar.SAME)
            state.replace_trellis(trellis)
        if attention.ends() or (done and state.stalls(gap, size, PAIR_CHAINS_STALLED)):
            break
    return tables


class _Found(NamedTuple):
    """The best path that A* found [T + 1, L], its cost and the bound in nats, and the effort."""

    cost: float
    states: Int32s
    lower_bound: float
    expansions: int
    peak_nodes: int


def _search(
    trellis: Trellis, tables: PairChains, below: float, nodes: int, budget: int, attention: Attention
) -> _Found:
    """Search the parts of the body that no coupling joins any more, each with the others fixed to one path.

    What a path costs more or less than that path is the sum of the differences in each part, so the bounds of the parts
    add up. A part needs to be searched only up to what, with the most that the others may save, would come below
    `below`. Searched all at once, every near-best path of one part would be tried with those of all others.
    """
    chosen = np.zeros(len(trellis.dom_ptr) - 1, dtype=np.int64)
    pair_chains.descend(trellis, tables, chosen)
    cost = polish(trellis, chosen)
    states, part = _states(trellis, chosen), _parts(trellis)
    left = _fix_all_but(trellis, tables, chosen, part)
    may_save = {name: max(cost - pair_chains.lower_bound(fewer), 0.0) for name, (_, fewer) in left.items()}
    saved, expansions, peak = 0.0, 0, 0
    for name in sorted(may_save, key=lambda name: may_save[name]):
        others = sum(may_save.values()) - may_save[name]
        smaller, fewer = left.pop(name)
        state = _Bounded(smaller, min(cost, below + others))
        expanded, held = _search_part(state, fewer, nodes, budget - expansions, attention)
        expansions, peak = expansions + expanded, max(peak, held)
        may_save[name] = cost - state.lower_bound
        if len(state.states) > 0:
            saved += cost - state.cost
            states[:, part == name] = state.states[:, part == name]
    return _Found(cost - saved, states, cost - sum(may_save.values()), expansions, peak)


def _fix_all_but(
    trellis: Trellis, tables: PairChains, chosen: Ints, part: Ints
) -> dict[int, tuple[Trellis, PairChains]]:
    """For each part return what is left with all other parts fixed to a path of positions [n]."""
    part_of = np.repeat(np.resize(part, len(chosen)), np.diff(trellis.dom_ptr))
    on_path = np.isin(np.arange(len(part_of)), chosen)
    return {
        name: pair_chains.prune(trellis, tables, np.where(on_path | (part_of == name), 0.0, np.inf), 1.0)
        for name in np.unique(part)
    }


def _search_part(state: _Bounded, tables: PairChains, nodes: int, budget: int, attention: Attention) -> tuple[int, int]:
    """Bound one part, then search it if that leaves a gap; return the number of expansions, and of nodes held."""
    tables = _tighten_by_pair_chains(state, tables, attention)
    if state.closed or budget <= 0 or attention.ends():
        return 0, 0
    chosen = np.zeros(len(state.trellis.dom_ptr) - 1, dtype=np.int64)
    bound = pair_chains.lower_bound(tables)
    cost, lower_bound, expansions, held = attention.run(
        astar.search, state.trellis, tables, bound, state.cost, chosen, nodes, budget
    )
    if cost < state.cost:
        state.cost, state.states = cost, _states(state.trellis, chosen)
    state.lower_bound = max(state.lower_bound, lower_bound)
    return expansions, held


def _parts(trellis: Trellis) -> Ints:
    """Return the first chain of the part that each chain belongs to [L].

    A coupling joins two chains only where there is a move at which both have more than one position left.
    """
    part, many = np.arange(trellis.chains), np.diff(trellis.dom_ptr).reshape(-1, trellis.chains) > 1
    for chain, parent in enumerate(trellis.parents):
        if parent >= 0 and np.any(many[:, chain] & many[:, parent]):
            part[chain] = part[parent]
    return part


def _states(trellis: Trellis, chosen: Ints) -> Int32s:
    """Return the states [T + 1, L] of a path of positions [n]."""
    return trellis.dom[chosen].reshape(trellis.moves + 1, trellis.chains)
