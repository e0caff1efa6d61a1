"""Solve a problem over all numbers of moves, with a certificate of how close to optimal the path is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.errors import InfeasibleError
from motionmind.search import astar, pair_chains, trws
from motionmind.search.attention import Attention, Clock
from motionmind.search.costs import path_cost
from motionmind.search.pair_chain_tables import PairChains, count_pairs
from motionmind.search.polish import polish
from motionmind.search.problem import Model, Problem, costs_to_go
from motionmind.search.segments import Segments
from motionmind.search.trellis import Trellis, build_trellis
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
    """

    path: Int32s
    cost: float
    lower_bound: float
    status: Status
    expansions: int
    peak_nodes: int
    seconds: dict[str, float]
    passed: tuple[int, ...] = ()


def solve(problem: Problem, watch: Watch | None = None) -> Certificate:
    """Find the cheapest path over all numbers of moves, and prove how good it is.

    Numbers of moves are bounded in the order of what the chains cost on their own, as long as that is below the cost of
    the best path found; those that this leaves undecided are searched by A*. The least of all bounds is what is proven.

    Vias divide the path into segments of at least one move. Then the numbers of moves are those of a segment, each
    bounded below what the best path leaves when the other segments cost as little as is proven.

    Args:
        problem: what to solve.
        watch: called with the progress between pieces of work; if it returns True the search ends as soon as any path
            is known, with what is proven by then.

    Raises:
        InfeasibleError: no path satisfies the problem.
        ValueError: a chain has too many states.
    """
    states = int(np.diff(problem.model.starts).max())
    if states > MOST_STATES_OF_CHAIN:
        raise ValueError(f"a chain has {states} states; the search takes up to {MOST_STATES_OF_CHAIN}")
    solver = _Solver(problem, watch)
    solver.search(solver.bound())
    return solver.certificate()


def feasible(problem: Problem) -> bool:
    """Return whether any path satisfies the problem."""
    return bool(np.isfinite(_divide(problem)[2].lower_bound()))


def _divide(problem: Problem) -> tuple[Model, list[Floats], Segments]:
    """Return the model with waits, the costs to go to each stop but the first, and bounds on the segments between."""
    rules, stops, model = problem.rules, problem.stops, problem.model_with_waits()
    to_go = [costs_to_go(model, stop, rules.longest) for stop in stops[1:]]
    lower = _separate_costs(problem, model, to_go)
    return model, to_go, Segments(lower, rules.shortest, [via.move for via in problem.vias])


def _separate_costs(problem: Problem, model: Model, to_go: list[Floats]) -> Floats:
    """Return the least cost of each of K segments, its chains on their own, by number of moves [K, longest + 1], nats.

    It is finite exactly where the segment can have as many moves.
    """
    rules, stops = problem.rules, problem.stops
    moves = np.arange(rules.longest + 1)
    out = np.array(
        [
            costs[:, model.starts[:-1] + stop].sum(axis=1) + rules.per_move * moves
            for stop, costs in zip(stops[:-1], to_go, strict=True)
        ]
    )
    if len(out) > 1:
        out[:, 0] = np.inf
    if not all(model.allowed[model.starts[:-1] + stop].all() for stop in stops[1:-1]):
        out[:] = np.inf
    return out


class _Solver:
    """The state of one search: first `bound`, then `search`, then `certificate`."""

    def __init__(self, problem: Problem, watch: Watch | None) -> None:
        self.problem, self.rules = problem, problem.rules
        self.expansions = self.peak_nodes = 0
        self.clock = Clock("problem", "bound", "search")
        self.model, self.to_go, self.segments = _divide(problem)
        self.attention = Attention(None if watch is None else lambda: bool(watch(self.progress())))
        self.clock.lap("problem")

    def progress(self) -> Progress:
        return Progress(self.segments.best, self.segments.lower_bound(), self.expansions)

    def bound(self) -> dict[tuple[int, int], tuple[Trellis, PairChains]]:
        """Bound segments, each in a number of moves, and find paths; return those left for A*."""
        left: dict[tuple[int, int], tuple[Trellis, PairChains]] = {}
        kept = 0  # pairs in them
        while True:
            segment, moves, least, below = self.segments.most_promising()
            if not least < self.segments.best - PROVEN or (self.attention.ends() and np.isfinite(self.segments.best)):
                return left
            toll, start = self.rules.per_move * moves, self.problem.stops[segment]
            trellis = build_trellis(self.model, start, moves, self.to_go[segment], below - toll)
            state = _Bounded(trellis, below - toll)
            self.clock.lap("problem")
            messages = _tighten_by_messages(state, self.rules.sweeps, self.attention)
            if (
                not (state.closed or self.attention.ends())
                and len(start) > 1
                and count_pairs(state.trellis) <= MOST_PAIRS
            ):
                tables = _tighten_by_pair_chains(state, pair_chains.build(state.trellis, messages), self.attention)
                if not state.closed and kept + len(tables.pair_cost) <= MOST_PAIRS:
                    left[segment, moves] = state.trellis, tables
                    kept += len(tables.pair_cost)
            self.segments.update(segment, moves, state.lower_bound + toll, state.cost + toll, state.states)
            self.clock.lap("bound")

    def search(self, left: dict[tuple[int, int], tuple[Trellis, PairChains]]) -> None:
        """Search by A* what is left, until the best path is proven, the budget spent, or the search is to end."""
        self.segments.reopen(left)
        while True:
            segment, moves, least, below = self.segments.most_promising()
            if not least < self.segments.best - PROVEN or self.attention.ends():
                return
            toll, budget = self.rules.per_move * moves, self.rules.node_budget - self.expansions
            trellis, tables = left.pop((segment, moves))
            found = _search(trellis, tables, below - toll, self.rules.node_budget, budget, self.attention)
            self.segments.update(segment, moves, found.lower_bound + toll, found.cost + toll, found.states)
            self.expansions += found.expansions
            self.peak_nodes = max(self.peak_nodes, found.peak_nodes)
            self.clock.lap("search")

    def certificate(self) -> Certificate:
        """Return what was found and proven."""
        cost = self.segments.best
        if not np.isfinite(cost):
            raise InfeasibleError("no path satisfies the problem")
        lower_bound, (path, passed) = self.segments.lower_bound(), self.segments.path()
        status: Status = "bounded"
        if cost - lower_bound <= PROVEN:
            status = "optimal"
        elif self.attention.ended[0]:
            status = "interrupted"
        return Certificate(
            path, cost, lower_bound, status, self.expansions, self.peak_nodes, self.clock.seconds, passed
        )


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
