"""The search over all numbers of moves, and the certificate."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind.search import astar, bound, strips
from motionmind.search.polish import path_cost, polish
from motionmind.search.problem import Grid, Ints, Model, build_grid, costs_to_go, with_waits

SWEEPS_AT_ONCE = 2  # few, for fixing pays at once: 2 is fastest of 1 to 8 on real ballet
STALLED = 0.9  # sweeps of messages that leave more than this share of the gap, and of the positions, give way to strips
STRIP_SWEEPS = 100  # at most, for each number of moves
STRIPS_STALLED = 0.98  # as STALLED; then A* takes over
NEAR = 0.1  # a path that costs no more than this share above the best is worth polishing
MOST_STATES = 1 << 16  # of a lane: A* numbers them in 16 bits
MOST_PAIRS = 1 << 23  # of states in strips, 32 bytes each: more are not made, nor kept for A*
PROVEN = 1e-6  # nats: an answer within this of its lower bound is reported as optimal


@dataclass(frozen=True, eq=False)
class Certificate:
    """The best path found and how close to the best it provably is.

    Attributes:
        path: states [T + 1, L].
        cost: its cost in nats.
        lower_bound: no path within the rules costs less than this, in nats.
        status: "optimal" where both agree to 1e-6 nats, else "bounded".
        expansions: nodes expanded by A*.
        peak_nodes: the greatest number of nodes held at once.
        seconds: of the parts "problem", "bound" and "search"; a measurement, and no part of the proof.
    """

    path: NDArray[np.int32]
    cost: float
    lower_bound: float
    status: Literal["optimal", "bounded"]
    expansions: int
    peak_nodes: int
    seconds: dict[str, float]


@dataclass(frozen=True)
class Rules:
    """What the search may do and what that costs beside the model's own costs.

    Attributes:
        wait: beta, nats for each move that a lane waits at its goal.
        per_move: tau, nats for each move.
        shortest: least number of moves.
        longest: greatest number of moves.
        node_budget: nodes that A* may hold at once; it stops after as many expansions.
        sweeps: pairs of sweeps of messages at most, for each number of moves; at least 1.
    """

    wait: float
    per_move: float
    shortest: int
    longest: int
    node_budget: int
    sweeps: int = 160


def solve(model: Model, start: Ints, goal: Ints, rules: Rules) -> Certificate | None:
    """The best path from states `start` [L] to `goal` [L] over all numbers of moves; None where there is none.

    Numbers of moves are looked at in the order of what the lanes cost on their own, as long as that is below the best
    path found, and bounded; those that this leaves undecided are searched. The least bound of all proves the answer.
    """
    if np.diff(model.starts).max() > MOST_STATES:
        raise ValueError(f"a lane has {np.diff(model.starts).max()} states; the search takes up to {MOST_STATES}")
    clock = _Clock()
    held = with_waits(model, goal, rules.wait)
    to_go = costs_to_go(held, goal, rules.longest)
    alone = to_go[:, model.starts[:-1] + start].sum(axis=1) + rules.per_move * np.arange(rules.longest + 1)
    clock.lap("problem")

    best, path, expansions, peak = np.inf, np.zeros((0, len(start)), dtype=np.int32), 0, 0
    lower = np.where(np.arange(rules.longest + 1) >= rules.shortest, alone, np.inf)
    left: dict[int, tuple[Grid, strips.Strips]] = {}  # what is left to search
    kept = 0  # pairs in it
    for moves in map(int, np.argsort(lower, kind="stable")):
        if not lower[moves] < best - PROVEN:
            break
        toll = rules.per_move * moves
        known = _Known(build_grid(held, start, moves, to_go, best - toll), best - toll)
        clock.lap("problem")
        messages = _by_messages(known, rules.sweeps)
        if not known.settled and len(start) > 1 and strips.pairs(known.grid) <= MOST_PAIRS:
            cut = _by_strips(known, strips.cut(known.grid, messages))
            if not known.settled and kept + len(cut.stand) <= MOST_PAIRS:
                left[moves] = known.grid, cut
                kept += len(cut.stand)
        lower[moves] = max(lower[moves], known.proven + toll)
        if known.cost < best - toll:
            best, path = known.cost + toll, known.states
        clock.lap("bound")
    for moves in sorted(left, key=lambda moves: lower[moves]):
        if not lower[moves] < best - PROVEN:
            break
        toll, budget = rules.per_move * moves, rules.node_budget - expansions
        found = _search(*left.pop(moves), best - toll, rules.node_budget, budget)
        if found.cost < best - toll:
            best, path = found.cost + toll, found.states
        lower[moves] = max(lower[moves], found.proven + toll)
        expansions, peak = expansions + found.expansions, max(peak, found.peak)
        clock.lap("search")
    if not np.isfinite(best):
        return None
    least = min(float(lower.min()), best)
    proven_best = best - least <= PROVEN
    return Certificate(path, best, least, "optimal" if proven_best else "bounded", expansions, peak, clock.seconds)


class _Known:
    """What is known of one number of moves.

    Attributes:
        grid: what is left of it: no path cheaper than `cost` lies outside.
        cost: of the best path found, or what it has to be cheaper than.
        states: the best path found [T + 1, L]; empty until then.
        proven: no path that is cheaper than `cost` costs less than this.
    """

    def __init__(self, grid: Grid, cost: float) -> None:
        self.grid, self.cost, self.proven = grid, cost, -np.inf
        self.states = np.zeros((0, grid.lanes), dtype=np.int32)

    @property
    def settled(self) -> bool:
        """Whether bound and path meet, or nothing is left that a better path could go through."""
        return self.proven >= self.cost - PROVEN

    def learn(self, proven: float, chosen: Ints) -> None:
        """A bound, and a path of positions [n], which is polished if it is near the best."""
        if path_cost(self.grid, chosen) <= self.cost + NEAR * abs(self.cost):
            cost = polish(self.grid, chosen)
            if cost < self.cost:
                self.cost, self.states = cost, _states(self.grid, chosen)
        self.proven = min(max(self.proven, proven), self.cost)

    def narrow(self, grid: Grid) -> None:
        """What is left of the grid: if a domain of it is empty, nothing."""
        self.grid = grid
        if np.any(np.diff(grid.dom_ptr) == 0):
            self.proven = self.cost

    def stalls(self, gap: float, size: int, share: float) -> bool:
        """Whether more than a share is left of the gap and of the number of positions that there were."""
        return self.cost - self.proven > share * gap and len(self.grid.dom) > share * size


def _by_messages(known: _Known, sweeps: int) -> bound.Messages:
    """Bound a number of moves by messages, of which the last are returned.

    Every few sweeps the path that they met is polished, and positions that no better path goes through are taken out
    of the grid; until bound and path meet, or what separates them hardly shrinks.
    """
    messages = bound.no_messages(known.grid)
    for done in range(0, sweeps, SWEEPS_AT_ONCE):
        gap, size = known.cost - known.proven, len(known.grid.dom)
        chosen = np.zeros(len(known.grid.dom_ptr) - 1, dtype=np.int64)
        proven, _ = bound.tighten(known.grid, messages, chosen, min(SWEEPS_AT_ONCE, sweeps - done), known.cost)
        known.learn(proven, chosen)
        if known.settled:
            break
        grid, messages = bound.narrow(known.grid, messages, known.cost - astar.SAME)
        known.narrow(grid)
        if known.settled or (done and known.stalls(gap, size, STALLED)):
            break
    return messages


def _by_strips(known: _Known, cut: strips.Strips) -> strips.Strips:
    """Go on by strips, in the same way; the last are returned."""
    known.proven = max(known.proven, min(strips.proven(cut), known.cost))
    for done in range(STRIP_SWEEPS):
        if known.settled:
            break
        gap, size = known.cost - known.proven, len(known.grid.dom)
        chosen, through = np.zeros(len(known.grid.dom_ptr) - 1, dtype=np.int64), np.zeros(size)
        proven = strips.sweep(known.grid, cut, through)
        strips.descend(known.grid, cut, chosen)
        known.learn(proven, chosen)
        if not known.settled:
            grid, cut = strips.narrow(known.grid, cut, through, known.cost - astar.SAME)
            known.narrow(grid)
        if done and known.stalls(gap, size, STRIPS_STALLED):
            break
    return cut


class _Searched(NamedTuple):
    """The best path that A* found, what it proved, and what it took."""

    cost: float
    states: NDArray[np.int32]
    proven: float
    expansions: int
    peak: int


def _search(grid: Grid, cut: strips.Strips, below: float, nodes: int, budget: int) -> _Searched:
    """Search the parts of the body that nothing couples any more, each with the others on one path.

    What a path costs more than that one, or less, is the sum of what it does so in each part. So what is proven of each
    part adds up; and a part needs to be searched only up to what, with the best that the others may save, would come
    below `below`. Searched all at once, every near-best way of one part would be tried with those of all others.
    """
    chosen = np.zeros(len(grid.dom_ptr) - 1, dtype=np.int64)
    strips.descend(grid, cut, chosen)
    cost = polish(grid, chosen)
    states = _states(grid, chosen)
    part = _parts(grid)
    part_of = np.repeat(np.resize(part, len(chosen)), np.diff(grid.dom_ptr))
    on_path = np.isin(np.arange(len(part_of)), chosen)
    alone = {}
    for name in np.unique(part):
        alone[name] = strips.narrow(grid, cut, np.where(on_path | (part_of == name), 0.0, np.inf), 1.0)
    may_save = {name: max(cost - strips.proven(fewer), 0.0) for name, (_, fewer) in alone.items()}
    saved, expansions, peak = 0.0, 0, 0
    for name in sorted(may_save, key=lambda name: may_save[name]):
        others = sum(may_save.values()) - may_save[name]
        smaller, fewer = alone.pop(name)
        known = _Known(smaller, min(cost, below + others))
        fewer = _by_strips(known, fewer)
        if not known.settled and expansions < budget:
            chosen = np.zeros(len(chosen), dtype=np.int64)
            found, proven, expanded, held = astar.search(
                known.grid, fewer, strips.proven(fewer), known.cost, chosen, nodes, budget - expansions
            )
            if found < known.cost:
                known.cost, known.states = found, _states(known.grid, chosen)
            known.proven, expansions, peak = max(known.proven, proven), expansions + expanded, max(peak, held)
        may_save[name] = cost - known.proven
        if len(known.states) > 0:
            saved += cost - known.cost
            states[:, part == name] = known.states[:, part == name]
    return _Searched(cost - saved, states, cost - sum(may_save.values()), expansions, peak)


def _parts(grid: Grid) -> Ints:
    """The first lane of the part that each lane belongs to [L].

    A coupling joins two lanes only where there is a move at which both have more than one position left.
    """
    part, many = np.arange(grid.lanes), np.diff(grid.dom_ptr).reshape(-1, grid.lanes) > 1
    for lane, parent in enumerate(grid.parents):
        if parent >= 0 and np.any(many[:, lane] & many[:, parent]):
            part[lane] = part[parent]
    return part


def _states(grid: Grid, chosen: Ints) -> NDArray[np.int32]:
    """States [T + 1, L] of a path of positions."""
    return grid.dom[chosen].reshape(grid.moves + 1, grid.lanes)


class _Clock:
    """Seconds spent since the last lap, added up by name."""

    def __init__(self) -> None:
        self.seconds = {"problem": 0.0, "bound": 0.0, "search": 0.0}
        self._last = perf_counter()

    def lap(self, name: str) -> None:
        now = perf_counter()
        self.seconds[name] += now - self._last
        self._last = now
