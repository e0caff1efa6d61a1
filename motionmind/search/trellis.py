"""The trellis: the problem for a fixed number of moves, as flat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.jit import jit
from motionmind.search.csr import keep_entries, select_entries
from motionmind.search.problem import Model, Problem, costs_to_go


class Trellis(NamedTuple):
    """The problem for a fixed number of moves, as flat arrays; costs in nats.

    There are n = (T + 1) L variables, i = t * L + chain. A position is one state of one variable's domain, numbered
    through all variables.

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


def segment_trellises(problem: Problem, moves: Sequence[int]) -> list[Trellis]:
    """Build a trellis for each segment of a problem, with every state that is allowed in the domains.

    Args:
        problem: a problem with K - 1 vias.
        moves: the moves of its stops: 0, those at which the vias are passed, and the last move [K + 1].

    Returns:
        K trellises.
    """
    model, timed = problem.model_with_waits(), problem.timed_costs(moves[-1])
    out = []
    for (leaving, arriving), (first, last) in zip(pairwise(problem.stops), pairwise(moves), strict=True):
        here = None if timed is None else timed[first : last + 1]
        to_go = costs_to_go(model, arriving, last - first, here)
        out.append(build_trellis(model, leaving, last - first, to_go, np.inf, here))
    return out


def build_trellis(
    model: Model, start: Ints, moves: int, to_go: Floats, below: float, timed: Floats | None = None
) -> Trellis:
    """Build the trellis of exactly `moves` moves from a start to a goal.

    A state is in a domain if it is allowed there, some walk of exactly T moves passes through it then, and the cheapest
    such walk, beside the other chains' cheapest, costs less than `below`. So no path cheaper than `below` is lost.

    Args:
        model: the costs, waits included.
        start: states to start from [L].
        moves: number of moves T.
        to_go: `costs_to_go` to the goal, for at least T moves and with the same timed costs, nats [T + 1 or more, G].
        below: cost of a path already known, nats, or infinity.
        timed: further costs of being in each state after each move, nats [T + 1, G]; None for none. At the start
            nothing is paid.
    """
    return _build(model, start, moves, to_go, below, np.zeros((0, 0)) if timed is None else timed)


@jit
def correction(trellis: Trellis, u: int, x: int) -> float:
    """Return the correction in nats of position `x` in coupling row `u`; 0 for a pair that is not listed."""
    low, high = trellis.col_ptr[u], trellis.col_ptr[u + 1]
    while low < high:
        middle = (low + high) // 2
        if trellis.col_to[middle] < x:
            low = middle + 1
        else:
            high = middle
    return float(trellis.col_cost[low]) if low < trellis.col_ptr[u + 1] and trellis.col_to[low] == x else 0.0


def states_of(trellis: Trellis, chosen: Ints) -> Int32s:
    """Return the states [T + 1, L] of a path of positions [n]."""
    return trellis.dom[chosen].reshape(trellis.moves + 1, trellis.chains)


@jit
def locate(trellis: Trellis, states: Int32s) -> Ints:
    """Return the positions [n] of a path of states [T + 1, L]; -1 for a state that is not in its domain."""
    out = np.full(len(trellis.dom_ptr) - 1, -1, np.int64)
    for i in range(len(out)):
        state = states[i // trellis.chains, i % trellis.chains]
        for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
            if trellis.dom[p] == state:
                out[i] = p
    return out


@jit
def reachable(trellis: Trellis, through: Floats, below: float) -> Bools:
    """Return which positions [P] a path cheaper than `below` may go through, each leading on and led to.

    Args:
        trellis: the problem.
        through: a lower bound on the cost of all paths through each position, nats [P].
        below: nats.
    """
    kept = through < below
    for i in range(len(trellis.dom_ptr) - 2 - trellis.chains, -1, -1):  # what leads nowhere
        for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
            leads, e = False, trellis.row_ptr[p]
            while kept[p] and not leads and e < trellis.row_ptr[p + 1]:
                leads = kept[np.uint64(trellis.row_to[e])]
                e += 1
            kept[p] = leads
    led_to = np.zeros(len(kept), np.bool_)
    led_to[: trellis.dom_ptr[trellis.chains]] = True
    for p in range(len(kept)):  # what nothing leads to
        kept[p] = kept[p] and led_to[p]
        if kept[p]:
            for e in range(np.uint64(trellis.row_ptr[p]), np.uint64(trellis.row_ptr[p + 1])):
                led_to[np.uint64(trellis.row_to[e])] = True
    return kept


@jit
def subset(trellis: Trellis, kept: Bools, in_place: bool) -> Trellis:
    """Build the trellis of the positions that are kept [P].

    Args:
        trellis: the whole.
        kept: which positions to keep.
        in_place: whether in the memory of the whole, which is lost.
    """
    chains, variables = trellis.chains, len(trellis.dom_ptr) - 1
    held, rows = np.flatnonzero(kept), coupling_rows(trellis, kept)
    numbers = np.full(len(kept), -1, np.int32)  # of each kept position among them
    numbers[held] = np.arange(len(held)).astype(np.int32)
    dom_ptr = np.zeros(variables + 1, np.int64)
    up_ptr = np.zeros(variables + 1, np.int64)
    for i in range(variables):
        dom_ptr[i + 1] = dom_ptr[i] + np.sum(kept[trellis.dom_ptr[i] : trellis.dom_ptr[i + 1]])
        up_ptr[i + 1] = up_ptr[i]
        if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
            above = i - i % chains + trellis.parents[i % chains]
            up_ptr[i + 1] += dom_ptr[above + 1] - dom_ptr[above]
    row, col = (trellis.row_ptr, trellis.row_to, trellis.row_cost), (trellis.col_ptr, trellis.col_to, trellis.col_cost)
    if in_place:
        row_ptr, row_to, row_cost = keep_entries(*row, held, numbers)
        col_ptr, col_to, col_cost = keep_entries(*col, rows, numbers)
    else:
        row_ptr, row_to, row_cost = select_entries(*row, held, numbers, np.zeros(len(held), np.int64))
        col_ptr, col_to, col_cost = select_entries(*col, rows, numbers, np.zeros(len(rows), np.int64))
    return Trellis(
        chains, trellis.moves, trellis.parents, dom_ptr, trellis.dom[held], trellis.unary[held],
        row_ptr, row_to, row_cost, up_ptr, col_ptr, col_to, col_cost,
    )  # fmt: skip


@jit
def coupling_rows(trellis: Trellis, kept: Bools) -> Ints:
    """Return the coupling rows [U'] of the positions that are kept [P]."""
    coupled = np.zeros(trellis.up_ptr[-1], np.bool_)
    for i in range(len(trellis.dom_ptr) - 1):
        if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
            above = i - i % trellis.chains + trellis.parents[i % trellis.chains]
            coupled[trellis.up_ptr[i] : trellis.up_ptr[i + 1]] = kept[
                trellis.dom_ptr[above] : trellis.dom_ptr[above + 1]
            ]
    return np.flatnonzero(coupled)


# --- building --------------------------------------------------------------------------------------------------------


@jit
def _build(model: Model, start: Ints, moves: int, to_go: Floats, below: float, timed: Floats) -> Trellis:
    """Build as `build_trellis` does; `timed` has no rows where it holds no costs."""
    chains = len(model.parents)
    dom_ptr, dom, place = _domains(model, start, moves, to_go, below, timed)
    row_ptr, row_to, row_cost = _edges(model, dom_ptr, dom, place)
    up_ptr, col_ptr, col_to, col_cost = _couplings(model, dom_ptr, dom, place)
    unary = np.zeros(len(dom))
    for i in range(chains, (moves + 1) * chains):
        for p in range(dom_ptr[i], dom_ptr[i + 1]):
            row = model.starts[i % chains] + dom[p]
            unary[p] = model.unary[row] + (timed[i // chains, row] if len(timed) > 0 else 0.0)
    return Trellis(
        chains, moves, model.parents, dom_ptr, dom, unary, row_ptr, row_to, row_cost, up_ptr, col_ptr, col_to, col_cost
    )


@jit
def _costs_so_far(model: Model, start: Ints, moves: int, timed: Floats) -> Floats:
    """Return the least cost of exactly t moves from a chain's start to each state, the chain on its own [T + 1, G]."""
    value = np.full((moves + 1, model.starts[-1]), np.inf)
    for chain in range(len(model.parents)):
        first, last = model.starts[chain], model.starts[chain + 1]
        value[0, first + start[chain]] = 0.0
        for t in range(moves):
            for row in range(first, last):
                if value[t, row] < np.inf and (t == 0 or model.allowed[row]):
                    for e in range(np.uint64(model.indptr[row]), np.uint64(model.indptr[row + 1])):
                        target = np.uint64(first) + np.uint64(model.targets[e])
                        cost = value[t, row] + model.costs[e] + model.alone[target]
                        value[t + 1, target] = min(value[t + 1, target], cost)
            if len(timed) > 0:
                value[t + 1, first:last] += timed[t + 1, first:last]
    return value


@jit
def _domains(
    model: Model, start: Ints, moves: int, to_go: Floats, below: float, timed: Floats
) -> tuple[Ints, Int32s, Int32s]:
    """Return `dom_ptr`, `dom`, and the position of each state at each move [T + 1, G], -1 where it has none."""
    chains, rows = len(model.parents), model.starts[-1]
    so_far = _costs_so_far(model, start, moves, timed)
    spare = below
    for chain in range(chains):
        spare -= to_go[moves, model.starts[chain] + start[chain]]
    place = np.full((moves + 1, rows), -1, np.int32)
    dom_ptr = np.zeros((moves + 1) * chains + 1, np.int64)
    count = 0
    for i in range((moves + 1) * chains):
        t, chain = i // chains, i % chains
        first, least = model.starts[chain], to_go[moves, model.starts[chain] + start[chain]]
        # Only what kept states lead to is kept. The margin grows with t, by more than the sums can be off: rounding
        # cannot keep a state and drop all that follow it.
        margin = (t + 1) * (1e-9 + 1e-14 * (abs(least) + abs(spare)))
        led_to = np.zeros(model.starts[chain + 1] - first, np.bool_)
        if t == 0:
            led_to[start[chain]] = True
        for row in range(first, model.starts[chain + 1]):
            if t > 0 and place[t - 1, row] >= 0:
                for e in range(np.uint64(model.indptr[row]), np.uint64(model.indptr[row + 1])):
                    led_to[np.uint64(model.targets[e])] = True
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
def _edges(model: Model, dom_ptr: Ints, dom: Int32s, place: Int32s) -> tuple[Ints, Int32s, Floats]:
    """Return the edges from each position to those of the same chain at the next move, as compressed rows."""
    chains, variables, states = len(model.parents), len(dom_ptr) - 1, model.starts[-1]
    rows, shifts = np.zeros(len(dom), np.int64), np.zeros(len(dom), np.int64)
    for i in range(variables - chains):
        first = model.starts[i % chains]
        for p in range(dom_ptr[i], dom_ptr[i + 1]):
            rows[p], shifts[p] = first + dom[p], (i // chains + 1) * states + first
    last = dom_ptr[variables - chains]  # from here on no edges lead
    ptr, to, cost = select_entries(model.indptr, model.targets, model.costs, rows[:last], place.ravel(), shifts[:last])
    return np.append(ptr, np.full(len(dom) - last, len(to))), to, cost


@jit
def _couplings(model: Model, dom_ptr: Ints, dom: Int32s, place: Int32s) -> tuple[Ints, Ints, Int32s, Floats]:
    """Return the first coupling row of each variable, and the listed pairs as compressed rows."""
    chains, variables, states = len(model.parents), len(dom_ptr) - 1, model.starts[-1]
    up_ptr = np.zeros(variables + 1, np.int64)
    for i in range(variables):
        above = i - i % chains + model.parents[i % chains]
        coupled = i >= chains and model.parents[i % chains] >= 0
        up_ptr[i + 1] = up_ptr[i] + (dom_ptr[above + 1] - dom_ptr[above] if coupled else 0)
    rows, shifts = np.empty(up_ptr[-1], np.int64), np.empty(up_ptr[-1], np.int64)
    for i in range(chains, variables):
        chain, t = i % chains, i // chains
        first = dom_ptr[i - chain + model.parents[chain]]
        for u in range(up_ptr[i], up_ptr[i + 1]):
            rows[u] = model.pair_starts[chain] + dom[first + u - up_ptr[i]]
            shifts[u] = t * states + model.starts[chain]
    ptr, to, cost = select_entries(model.pair_ptr, model.pair_states, model.pair_costs, rows, place.ravel(), shifts)
    return up_ptr, ptr, to, cost
