"""The choice of an open number of moves, by tolls and by the haste of the chains.

A path's cost says little about its length: from some length on, each further move costs about as much as the last. But
it reveals which lengths are too short. The chains' *haste* in n moves is the extra cost of starting where they do: with
V[n, s] the least cost of a chain on its own from state s to the goal in exactly n moves,

    haste(n) = sum over chains of  V[n, start] - min over s of V[n, s].

It is infinite where a chain cannot reach the goal, tens of nats where only rare moves or bridges reach it in time, and
about constant from some length on, whatever a move costs. The best length minimises haste plus tolls. Both are tables,
so the choice is exact and needs no path search. Vias divide a path into segments, whose numbers of moves are chosen
together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.errors import InfeasibleError
from motionmind.search.problem import Model, Problem, Via, costs_to_go


@dataclass(frozen=True)
class LengthChoice:
    """The choice of a number of moves: by haste and tolls, or, without tolls, by the costs of paths without the guide.

    Attributes:
        moves: the number of moves that costs least; without tolls, that of the cheapest path known.
        cost: cost of this number of moves, nats.
        lower_bound: no number of moves costs less than this, nats; with tolls, it is the cost.
        lower_bound_elsewhere: no other number of moves costs less than this, nats; the choice is proven if this is at
            least `cost`, to 1e-6 nats.
        expansions: nodes that A* expanded for the choice.
        haste: the part of the cost that is haste, nats; 0 without tolls.
        passed: with tolls, the moves at which to pass the vias [K].
    """

    moves: int
    cost: float
    lower_bound: float
    lower_bound_elsewhere: float
    expansions: int
    haste: float = 0.0
    passed: tuple[int, ...] = ()


def choose_length(problem: Problem) -> LengthChoice:
    """Choose the number of moves of each of a problem's segments, by haste and tolls.

    Raises:
        InfeasibleError: no path satisfies the problem.
        ValueError: the tolls do not match the problem's segments and numbers of moves, or are not finite.
    """
    tolls, rules, shape = problem.tolls, problem.rules, (len(problem.stops) - 1, problem.rules.longest + 1)
    if tolls is None or tolls.shape != shape or not np.isfinite(tolls).all():
        raise ValueError(f"there must be finite tolls of the shape {shape}")
    hastes = _hastes(problem) if problem.vias else _relevant_hastes(problem, tolls[0])
    costs = hastes + tolls
    so_far = _least_costs(problem, costs)
    so_far[-1][: rules.shortest] = np.inf
    ends = [int(so_far[-1].argmin())]
    if not np.isfinite(so_far[-1][ends[0]]):
        raise InfeasibleError("no path satisfies the problem")
    for row, least in zip(costs[::-1], so_far[-2::-1], strict=True):
        ends.insert(0, int((least[: ends[0] + 1] + row[ends[0] :: -1]).argmin()))
    cost, haste = float(so_far[-1][ends[-1]]), sum(hastes[k, b - a] for k, (a, b) in enumerate(pairwise(ends)))
    elsewhere = float(np.delete(so_far[-1], ends[-1]).min(initial=np.inf))
    return LengthChoice(ends[-1], cost, cost, elsewhere, 0, float(haste), tuple(ends[1:-1]))


def fewest_moves_between(problem: Problem) -> list[int] | None:
    """Return the least number of moves of each segment between stops; None if a segment has no path."""
    possible = np.isfinite(_hastes(replace(problem, vias=tuple(Via(via.states) for via in problem.vias))))
    return [int(row.argmax()) for row in possible] if possible.any(axis=1).all() else None


def fewest_moves(problem: Problem) -> int | None:
    """Return the least number of moves within the rules for which a path exists; None if there is none."""
    rules = problem.rules
    found = _least_costs(problem, _hastes(problem))[-1]
    possible = np.flatnonzero(np.isfinite(found[rules.shortest :]))
    return rules.shortest + int(possible[0]) if len(possible) else None


def _least_costs(problem: Problem, costs: Floats) -> list[Floats]:
    """Return the least total cost of the first 0, 1, ..., K segments, by the move after which they end [N + 1].

    Args:
        problem: the problem.
        costs: nats of each segment in each number of moves [K, N + 1].
    """
    count = costs.shape[1]
    out = [np.where(np.arange(count) == 0, 0.0, np.inf)]
    for number, row in enumerate(costs):
        least = np.full(count, np.inf)
        for first in np.flatnonzero(np.isfinite(out[-1])):
            np.minimum(least[first:], out[-1][first] + row[: count - first], out=least[first:])
        if number < len(problem.vias) and (move := problem.vias[number].move) is not None:
            least[np.arange(count) != move] = np.inf
        out.append(least)
    return out


def _hastes(problem: Problem) -> Floats:
    """Return the haste of each segment in each number of moves, nats [K, N + 1]; infinite where it has no path."""
    model, rules, stops = problem.model_with_waits(), problem.rules, problem.stops
    out = np.full((len(stops) - 1, rules.longest + 1), np.inf)
    if not all(model.allowed[model.starts[:-1] + stop].all() for stop in stops[1:-1]):
        return out
    for haste, (start, goal) in zip(out, pairwise(stops), strict=True):
        haste[:] = _haste(model, start, costs_to_go(model, goal, rules.longest))
    if len(out) > 1:
        out[:, 0] = np.inf
    return out


def _relevant_hastes(problem: Problem, tolls: Floats) -> Floats:
    """Return `_hastes` of a problem without vias [1, N + 1] for the numbers of moves that may be best; infinite beyond.

    No haste is negative, so stop where the tolls [N + 1] alone cost more than the second best number of moves.
    """
    model, rules = problem.model_with_waits(), problem.rules
    out, to_go = np.full((1, len(tolls)), np.inf), None
    last = rules.shortest + int(tolls[rules.shortest :].argmin())
    while True:
        to_go = costs_to_go(model, problem.goal, last, known=to_go)
        out[0, : last + 1] = _haste(model, problem.start, to_go)
        best = np.sort((out[0] + tolls)[rules.shortest :])[:2]
        more = int(np.flatnonzero(tolls <= best[-1])[-1])
        if more <= last:
            return out
        last = more


def _haste(model: Model, start: Ints, to_go: Floats) -> Floats:
    """Return the haste in each number of moves from a start [L], given the costs to go [N + 1, G]."""
    out, from_start = np.full(len(to_go), np.inf), to_go[:, model.starts[:-1] + start]
    possible = np.isfinite(from_start).all(axis=1)
    cheapest = np.minimum.reduceat(to_go[possible], model.starts[:-1], axis=1)
    out[possible] = (from_start[possible] - cheapest).sum(axis=1)
    return out
