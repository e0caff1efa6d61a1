"""The trellis: the problem for a fixed number of moves, as flat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.jit import jit
from motionmind.search.problem import Model, costs_to_go, with_waits


class Trellis(NamedTuple):
    """The problem for a fixed number of moves, as flat arrays.

    Variable i = t * L + chain; a position is one state of one variable's domain, numbered through all variables.

    Attributes:
        chains: L.
        moves: T.
        parents: parent chain [L] or -1.
        dom_ptr: positions of variable i are `dom_ptr[i]` to `dom_ptr[i + 1]` [(T + 1) L + 1].
        dom: the state at each position [P].
        unary: cost of each position [P].
        row_ptr: edges from each position to the next move's variable [P + 1].
        row_to: position that an edge leads to [R].
        row_cost: cost of the edge [R].
        up_ptr: first coupling row of variable i [(T + 1) L + 1]; it has one for each position of its parent variable.
        col_ptr: listed pairs of each coupling row [U + 1].
        col_to: the variable's position in a listed pair [Q], increasing within a row.
        col_cost: its correction [Q].
    """

    chains: int
    moves: int
    parents: Ints
    dom_ptr: Ints
    dom: Int32s
    unary: Floats
    row_ptr: Ints
    row_to: Int32s
    row_cost: Floats
    up_ptr: Ints
    col_ptr: Ints
    col_to: Int32s
    col_cost: Floats


def segment_trellises(model: Model, goal: Ints, wait: float, stops: Sequence[tuple[int, Ints]]) -> list[Trellis]:
    """The problems between stops, each the move at which it is passed and its states [L]; all that is allowed is in
    their domains, and waits at `goal`."""
    held = with_waits(model, goal, wait)
    return [
        build_trellis(held, leaving, last - first, costs_to_go(held, arriving, last - first), np.inf)
        for (first, leaving), (last, arriving) in pairwise(stops)
    ]


@jit
def _costs_so_far(model: Model, start: Ints, moves: int) -> Floats:
    """U[t, row]: the least that exactly t moves from its chain's start to a state cost a chain on its own [T + 1,
    G]."""
    value = np.full((moves + 1, model.starts[-1]), np.inf)
    for chain in range(len(model.parents)):
        first, last = model.starts[chain], model.starts[chain + 1]
        value[0, first + start[chain]] = 0.0
        for t in range(moves):
            for row in range(first, last):
                if value[t, row] < np.inf and (t == 0 or model.allowed[row]):
                    for e in range(model.indptr[row], model.indptr[row + 1]):
                        target = first + model.targets[e]
                        cost = value[t, row] + model.costs[e] + model.alone[target]
                        value[t + 1, target] = min(value[t + 1, target], cost)
    return value


@jit
def build_trellis(model: Model, start: Ints, moves: int, to_go: Floats, below: float) -> Trellis:
    """The problem of exactly `moves` moves from `start` [L] to the goal that `to_go` leads to.

    A state is in a domain if it is allowed there, some walk of exactly T moves passes through it then, and the cheapest
    such walk, beside the other chains' cheapest, costs less than `below` (a path's cost already known, or infinity): no
    better path is lost. `to_go` is `costs_to_go` for at least T moves.
    """
    chains = len(model.parents)
    dom_ptr, dom, place = _domains(model, start, moves, to_go, below)
    row_ptr, row_to, row_cost = _rows(model, dom_ptr, dom, place)
    up_ptr, col_ptr, col_to, col_cost = _columns(model, dom_ptr, dom, place)
    unary = np.zeros(len(dom))
    for i in range(chains, (moves + 1) * chains):
        for p in range(dom_ptr[i], dom_ptr[i + 1]):
            unary[p] = model.unary[model.starts[i % chains] + dom[p]]
    return Trellis(
        chains, moves, model.parents, dom_ptr, dom, unary, row_ptr, row_to, row_cost, up_ptr, col_ptr, col_to, col_cost
    )


@jit
def _domains(model: Model, start: Ints, moves: int, to_go: Floats, below: float) -> tuple[Ints, Int32s, Int32s]:
    """The states of each variable, and the position [T + 1, G] of each state at each move, -1 where it has none."""
    chains, rows = len(model.parents), model.starts[-1]
    so_far = _costs_so_far(model, start, moves)
    spare = below
    for chain in range(chains):
        spare -= to_go[moves, model.starts[chain] + start[chain]]
    place = np.full((moves + 1, rows), -1, np.int32)
    dom_ptr = np.zeros((moves + 1) * chains + 1, np.int64)
    count = 0
    for i in range((moves + 1) * chains):
        t, chain = i // chains, i % chains
        first, least = model.starts[chain], to_go[moves, model.starts[chain] + start[chain]]
        # Of what the kept states before lead to. The margin grows with t, by more than the sums can be off, so that
        # rounding cannot keep a state and drop all that follow it.
        margin = (t + 1) * (1e-9 + 1e-14 * (abs(least) + abs(spare)))
        led_to = np.zeros(model.starts[chain + 1] - first, np.bool_)
        if t == 0:
            led_to[start[chain]] = True
        for row in range(first, model.starts[chain + 1]):
            if t > 0 and place[t - 1, row] >= 0:
                for e in range(model.indptr[row], model.indptr[row + 1]):
                    led_to[model.targets[e]] = True
        for state in range(len(led_to)):
            if led_to[state] and (t in (0, moves) or model.allowed[first + state]):
                through = so_far[t, first + state] + to_go[moves - t, first + state]
                if through < np.inf and through - least <= spare + margin:
                    place[t, first + state] = count
                    count += 1
        dom_ptr[i + 1] = count
    dom = np.empty(count, np.int32)
    for t in range(moves + 1):
        for chain in range(chains):
            for row in range(model.starts[chain], model.starts[chain + 1]):
                if place[t, row] >= 0:
                    dom[place[t, row]] = row - model.starts[chain]
    return dom_ptr, dom, place


@jit
def _rows(model: Model, dom_ptr: Ints, dom: Int32s, place: Int32s) -> tuple[Ints, Int32s, Floats]:
    """The edges from each position to those of the same chain at the next move."""
    chains, variables = len(model.parents), len(dom_ptr) - 1
    ptr = np.zeros(len(dom) + 1, np.int64)
    to, cost = np.empty(0, np.int32), np.empty(0)
    for fill in range(2):
        for i in range(variables - chains):
            first = model.starts[i % chains]
            for p in range(dom_ptr[i], dom_ptr[i + 1]):
                count = 0
                for e in range(model.indptr[first + dom[p]], model.indptr[first + dom[p] + 1]):
                    x = place[i // chains + 1, first + model.targets[e]]
                    if x >= 0:
                        if fill:
                            to[ptr[p] + count], cost[ptr[p] + count] = x, model.costs[e]
                        count += 1
                if not fill:
                    ptr[p + 1] = count
        if not fill:
            ptr = np.cumsum(ptr)
            to, cost = np.empty(ptr[-1], np.int32), np.empty(ptr[-1])
    return ptr, to, cost


@jit
def _columns(model: Model, dom_ptr: Ints, dom: Int32s, place: Int32s) -> tuple[Ints, Ints, Int32s, Floats]:
    """The listed pairs that couple each variable to its parent variable, by the parent's position."""
    chains, variables = len(model.parents), len(dom_ptr) - 1
    up_ptr = np.zeros(variables + 1, np.int64)
    for i in range(variables):
        above = i - i % chains + model.parents[i % chains]
        coupled = i >= chains and model.parents[i % chains] >= 0
        up_ptr[i + 1] = up_ptr[i] + (dom_ptr[above + 1] - dom_ptr[above] if coupled else 0)
    ptr = np.zeros(up_ptr[-1] + 1, np.int64)
    to, cost = np.empty(0, np.int32), np.empty(0)
    for fill in range(2):
        for i in range(chains, variables):
            chain, t = i % chains, i // chains
            first = dom_ptr[i - chain + model.parents[chain]]
            for u in range(up_ptr[i], up_ptr[i + 1]):
                row = model.pair_starts[chain] + dom[first + u - up_ptr[i]]
                count = 0
                for q in range(model.pair_ptr[row], model.pair_ptr[row + 1]):
                    x = place[t, model.starts[chain] + model.pair_states[q]]
                    if x >= 0:
                        if fill:
                            to[ptr[u] + count], cost[ptr[u] + count] = x, model.pair_costs[q]
                        count += 1
                if not fill:
                    ptr[u + 1] = count
        if not fill:
            ptr = np.cumsum(ptr)
            to, cost = np.empty(ptr[-1], np.int32), np.empty(ptr[-1])
    return up_ptr, ptr, to, cost
