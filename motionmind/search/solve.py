"""The search over all numbers of moves, and the certificate."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionmind.search import astar, bound
from motionmind.search.polish import polish
from motionmind.search.probe import probe
from motionmind.search.problem import Grid, Ints, Model, build_grid, costs_to_go, with_waits

SWEEPS_AT_ONCE = 2  # few, for fixing pays at once: 2 is fastest of 1 to 8 on real ballet
CASES = 1000  # that the bound is split into at most, for each number of moves
MOST_STATES = 1 << 16  # of a lane: A* numbers them in 16 bits
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
        sweeps: pairs of sweeps of the bound at most, for each number of moves; at least 1.
    """

    wait: float
    per_move: float
    shortest: int
    longest: int
    node_budget: int
    sweeps: int = 160


def solve(model: Model, start: Ints, goal: Ints, rules: Rules) -> Certificate | None:
    """The best path from states `start` [L] to `goal` [L] over all numbers of moves; None where there is none.

    Numbers of moves are looked at in the order of what the lanes cost on their own. Each is bounded, then searched, and
    only as long as its bound is below the best path found; so the least bound of all proves the answer.
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
    for moves in np.argsort(lower, kind="stable"):
        if not lower[moves] < best - PROVEN:
            break
        toll = rules.per_move * int(moves)
        grid = build_grid(held, start, int(moves), to_go, best - toll)
        clock.lap("problem")
        proven, found, states, grid, messages = _bound(grid, rules.sweeps, best - toll)
        known = min(found, best - toll)
        if found < best - toll:
            best, path = found + toll, states
        clock.lap("bound")
        if proven < known - PROVEN and expansions < rules.node_budget:
            chosen = np.zeros(len(grid.dom_ptr) - 1, dtype=np.int64)
            # f grows from what the messages prove by themselves; cases may have proven more.
            found, searched, expanded, held_nodes = astar.search(
                grid, messages, float(messages.constants.sum()), known, chosen, rules.node_budget,
                rules.node_budget - expansions,
            )  # fmt: skip
            proven = max(proven, searched)
            if found < known:
                best, path = found + toll, _states(grid, chosen)
            expansions, peak = expansions + expanded, max(peak, held_nodes)
            clock.lap("search")
        lower[moves] = max(lower[moves], proven + toll)
    if not np.isfinite(best):
        return None
    least = min(float(lower.min()), best)
    proven_best = best - least <= PROVEN
    return Certificate(path, best, least, "optimal" if proven_best else "bounded", expansions, peak, clock.seconds)


def _bound(grid: Grid, sweeps: int, below: float) -> tuple[float, float, NDArray[np.int32], Grid, bound.Messages]:
    """A lower bound on all paths cheaper than `below`, the best path found meanwhile, and what is left to search.

    Every few sweeps the path that they met, if better than those before, is polished, and positions that no better
    path goes through are taken out of the grid; until both meet, or what separates them no longer shrinks.
    """
    messages = bound.no_messages(grid)
    proven, rough, cost, states = -np.inf, np.inf, np.inf, np.zeros((0, grid.lanes), dtype=np.int32)
    for done in range(0, sweeps, SWEEPS_AT_ONCE):
        gap, size = min(cost, below) - proven, len(grid.dom)
        chosen = np.zeros(len(grid.dom_ptr) - 1, dtype=np.int64)
        latest, met = bound.tighten(grid, messages, chosen, min(SWEEPS_AT_ONCE, sweeps - done), min(cost, below))
        proven = max(proven, latest)
        if met < rough:
            rough, found = met, polish(grid, chosen)
            if found < cost:
                cost, states = found, _states(grid, chosen)
        known = min(cost, below)
        if proven >= known - PROVEN:
            break
        grid, messages = bound.narrow(grid, messages, known - astar.SAME)
        if np.any(np.diff(grid.dom_ptr) == 0):
            proven = known
            break
        if done and known - proven > 0.98 * gap and len(grid.dom) > 0.98 * size:
            break
    if proven < min(cost, below) - PROVEN:
        flat = states.ravel().copy()
        fewest_first = np.argsort(np.diff(grid.dom_ptr), kind="stable")
        proven, cost, grid, messages = probe(grid, messages, fewest_first, proven, cost, below, flat, CASES)
        states = flat.reshape(-1, grid.lanes)
    return min(proven, cost, below), cost, states, grid, messages


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
