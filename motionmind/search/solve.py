"""The search over all numbers of moves, and the certificate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from time import perf_counter
from typing import Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from motionmind.search import astar, bound
from motionmind.search.legs import Legs
from motionmind.search.polish import polish
from motionmind.search.probe import probe
from motionmind.search.problem import Floats, Grid, Ints, Model, build_grid, costs_to_go, with_waits

SWEEPS_AT_ONCE = 2  # few, for fixing pays at once: 2 is fastest of 1 to 8 on real ballet
CASES = 1000  # that the bound is split into at most, for each number of moves
MOST_STATES = 1 << 16  # of a lane: A* numbers them in 16 bits
SECONDS_UNWATCHED = 0.1  # that pass before whoever watches is asked again
PROVEN = 1e-6  # nats: an answer within this of its lower bound is reported as optimal

_Result = TypeVar("_Result")
Status = Literal["optimal", "bounded", "interrupted", "sampled"]


class Via(NamedTuple):
    """States [L] to pass through between start and goal, at a certain move or, for None, at any."""

    states: Ints
    move: int | None = None


class Progress(NamedTuple):
    """How far a search is: the cost of the best path so far, infinite before there is any, what is proven of all paths,
    and the nodes that A* has expanded."""

    cost: float
    lower_bound: float
    expansions: int


Watch = Callable[[Progress], bool | None]


@dataclass(frozen=True, eq=False)
class Certificate:
    """The best path found and how close to the best it provably is.

    Attributes:
        path: states [T + 1, L].
        cost: its cost in nats.
        lower_bound: no path within the rules costs less than this, in nats.
        status: "optimal" where both agree to 1e-6 nats, else "interrupted" if it was, else "bounded";
            "sampled" where the path was drawn and not sought.
        expansions: nodes expanded by A*.
        peak_nodes: the greatest number of nodes held at once.
        seconds: of the parts "problem", "bound" and "search"; a measurement, and no part of the proof.
        passed: the moves at which it passes its vias.
    """

    path: NDArray[np.int32]
    cost: float
    lower_bound: float
    status: Status
    expansions: int
    peak_nodes: int
    seconds: dict[str, float]
    passed: tuple[int, ...] = ()


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


def solve(
    model: Model, start: Ints, goal: Ints, rules: Rules, vias: Sequence[Via] = (), watch: Watch | None = None
) -> Certificate | None:
    """The best path from states `start` [L] to `goal` [L] over all numbers of moves; None where there is none.

    Numbers of moves are looked at in the order of what the lanes cost on their own. Each is bounded, then searched, and
    only as long as its bound is below the best path found; so the least bound of all proves the answer.

    It passes through `vias` in their order, which divide it into legs of at least one move; with vias it is numbers of
    moves of a leg that are looked at, each below what the best path leaves when the other legs cost as little as is
    proven.

    `watch` is told between pieces of work how far the search is; where it returns True the search ends as soon as any
    path is known, with what is proven by then.
    """
    if np.diff(model.starts).max() > MOST_STATES:
        raise ValueError(f"a lane has {np.diff(model.starts).max()} states; the search takes up to {MOST_STATES}")
    clock = _Clock()
    held = with_waits(model, goal, rules.wait)
    stops = [start, *(via.states for via in vias), goal]
    to_go = [costs_to_go(held, stop, rules.longest) for stop in stops[1:]]
    legs = Legs(alone(held, stops, to_go, rules), rules.shortest, [via.move for via in vias])
    clock.lap("problem")

    expansions, peak = 0, 0
    attention = _Attention(watch, lambda: Progress(legs.best, legs.lower_bound(), expansions))
    while True:
        leg, moves, least, below = legs.most_promising()
        if not least < legs.best - PROVEN or (attention.ends() and np.isfinite(legs.best)):
            break
        toll = rules.per_move * moves
        best, path = below - toll, np.zeros((0, len(start)), dtype=np.int32)
        grid = build_grid(held, stops[leg], moves, to_go[leg], best)
        clock.lap("problem")
        proven, found, states, grid, messages = _bound(grid, rules.sweeps, best, attention)
        if found < best:
            best, path = found, states
        clock.lap("bound")
        if proven < best - PROVEN and expansions < rules.node_budget and not attention.ends():
            chosen = np.zeros(len(grid.dom_ptr) - 1, dtype=np.int64)
            # f grows from what the messages prove by themselves; cases may have proven more.
            found, searched, expanded, held_nodes = attention.pay(
                astar.search, grid, messages, float(messages.constants.sum()), best, chosen, rules.node_budget,
                rules.node_budget - expansions,
            )  # fmt: skip
            proven = max(proven, searched)
            if found < best:
                best, path = found, _states(grid, chosen)
            expansions, peak = expansions + expanded, max(peak, held_nodes)
            clock.lap("search")
        legs.learn(leg, moves, proven + toll, best + toll if len(path) else np.inf, path)
    if not np.isfinite(legs.best):
        return None
    lower, (path, passed) = legs.lower_bound(), legs.path()
    status: Status = "optimal" if legs.best - lower <= PROVEN else "interrupted" if attention.ended[0] else "bounded"
    return Certificate(path, legs.best, lower, status, expansions, peak, clock.seconds, passed)


def feasible(model: Model, start: Ints, goal: Ints, rules: Rules, vias: Sequence[Via]) -> bool:
    """Whether there is any path from `start` to `goal` through `vias`."""
    held = with_waits(model, goal, rules.wait)
    stops = [start, *(via.states for via in vias), goal]
    to_go = [costs_to_go(held, stop, rules.longest) for stop in stops[1:]]
    legs = Legs(alone(held, stops, to_go, rules), rules.shortest, [via.move for via in vias])
    return bool(np.isfinite(legs.lower_bound()))


def alone(held: Model, stops: Sequence[Ints], to_go: Sequence[Floats], rules: Rules) -> Floats:
    """What each of K legs costs at least, its lanes on their own, at each number of moves [K, longest + 1].

    Infinite where a leg cannot have as many moves, and finite where it can. `held` has its waits, and `to_go` leads to
    each stop but the first.
    """
    moves = np.arange(rules.longest + 1)
    out = np.array(
        [
            costs[:, held.starts[:-1] + stop].sum(axis=1) + rules.per_move * moves
            for stop, costs in zip(stops[:-1], to_go, strict=True)
        ]
    )
    if len(out) > 1:
        out[:, 0] = np.inf
    if not all(held.allowed[held.starts[:-1] + stop].all() for stop in stops[1:-1]):
        out[:] = np.inf
    return out


def _bound(
    grid: Grid, sweeps: int, below: float, attention: _Attention
) -> tuple[float, float, NDArray[np.int32], Grid, bound.Messages]:
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
        if attention.ends():
            return min(proven, known), cost, states, grid, messages
        if done and known - proven > 0.98 * gap and len(grid.dom) > 0.98 * size:
            break
    if proven < min(cost, below) - PROVEN:
        flat = states.ravel().copy()
        fewest_first = np.argsort(np.diff(grid.dom_ptr), kind="stable")
        proven, cost, grid, messages = attention.pay(
            probe, grid, messages, fewest_first, proven, cost, below, flat, CASES
        )
        states = flat.reshape(-1, grid.lanes)
    return min(proven, cost, below), cost, states, grid, messages


def _states(grid: Grid, chosen: Ints) -> NDArray[np.int32]:
    """States [T + 1, L] of a path of positions."""
    return grid.dom[chosen].reshape(grid.moves + 1, grid.lanes)


class _Attention:
    """Whether the search is to end before its time: what `watch` says when it is told how far the search is.

    Attributes:
        ended: whether it said so [1].
    """

    def __init__(self, watch: Watch | None, so_far: Callable[[], Progress]) -> None:
        self.ended = np.zeros(1, dtype=bool)
        self._watch, self._so_far = watch, so_far

    def ends(self) -> bool:
        """Whether the search is to end."""
        if self._watch is not None and not self.ended[0]:
            self.ended[0] = bool(self._watch(self._so_far()))
        return bool(self.ended[0])

    def pay(self, work: Callable[..., _Result], *arguments: object) -> _Result:
        """Do long compiled work, in a thread of its own where somebody watches, who is then asked meanwhile.

        The work gets `ended` as its last argument, and stops when it is set.
        """
        if self._watch is None:
            return work(*arguments, self.ended)
        with ThreadPoolExecutor(1) as pool:
            result = pool.submit(work, *arguments, self.ended)
            try:
                while not wait([result], SECONDS_UNWATCHED).done:
                    self.ends()
            except BaseException:
                self.ended[0] = True  # what is thrown by `watch`, or by Ctrl-C, is not to wait for the work
                raise
            return result.result()


class _Clock:
    """Seconds spent since the last lap, added up by name."""

    def __init__(self) -> None:
        self.seconds = {"problem": 0.0, "bound": 0.0, "search": 0.0}
        self._last = perf_counter()

    def lap(self, name: str) -> None:
        now = perf_counter()
        self.seconds[name] += now - self._last
        self._last = now
