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
    """Build a trellis for each segment of a problem, with every allowed state in the domains.

    Args:
        problem: a problem with K - 1 vias.
        moves: the moves of its stops: 0, those of the vias, and the last move [K + 1].

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
    such walk plus the other chains' cheapest costs less than `below`. So no path cheaper than `below` is lost.

    Args:
        model: the costs, waits included.
        start: states to start from [L].
        moves: number of moves T.
        to_go: `costs_to_go` to the goal, for at least T moves and with the same timed costs, nats [T + 1 or more, G].
        below: cost of a path already known, nats, or infinity.
        timed: further costs of being in each state after each move, nats [T + 1, G]; None for none. The start costs
            nothing.
    """
    timed = np.zeros((0, 0)) if timed is None else timed
    dom_ptr, place = _domains(model, start, moves, to_go, below, timed)
    chains, states, lengths = len(model.parents), model.starts[-1], np.diff(dom_ptr)
    variable = np.repeat(np.arange(len(lengths)), lengths)
    move, first, rows = variable // chains, model.starts[variable % chains], np.flatnonzero(place >= 0) % states
    dom, last = (rows - first).astype(np.int32), dom_ptr[moves * chains]  # no edges leave the last move
    edges = model.indptr, model.targets, model.costs
    shifts = (move[:last] + 1) * states + first[:last]
    row_ptr, row_to, row_cost = select_entries(*edges, rows[:last], place.ravel(), shifts)
    row_ptr = np.append(row_ptr, np.full(len(dom) - last, len(row_to)))
    unary, on = np.zeros(len(dom)), dom_ptr[chains]
    unary[on:] = model.unary[rows[on:]] + (timed[move[on:], rows[on:]] if len(timed) else 0.0)

    above = np.arange(len(lengths)).reshape(-1, chains) + model.parents - np.arange(chains)
    coupled = (model.parents >= 0) & (np.arange(moves + 1) > 0)[:, None]
    up_ptr = np.concatenate([[0], np.cumsum(np.where(coupled, lengths[above], 0))])
    up, child = positions_above(chains, model.parents, dom_ptr, up_ptr)
    pairs = model.pair_ptr, model.pair_states, model.pair_costs
    shifts = child // chains * states + model.starts[child % chains]
    couplings = select_entries(*pairs, model.pair_starts[child % chains] + dom[up], place.ravel(), shifts)
    return Trellis(chains, moves, model.parents, dom_ptr, dom, unary, row_ptr, row_to, row_cost, up_ptr, *couplings)


def positions_above(chains: int, parents: Ints, dom_ptr: Ints, up_ptr: Ints) -> tuple[Ints, Ints]:
    """Return, for each coupling row, the position of the parent variable, and the variable, [U] each."""
    child = np.repeat(np.arange(len(up_ptr) - 1), np.diff(up_ptr))
    above = child + (parents - np.arange(chains))[child % chains]
    return dom_ptr[above] + np.arange(len(child)) - up_ptr[child], child


@jit
def correction(trellis: Trellis, u: int, x: int) -> float:
    """Return the correction in nats of position `x` in coupling row `u`; 0 for an unlisted pair."""
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


def locate(trellis: Trellis, states: Int32s) -> Ints:
    """Return the positions [n] of a path of states [T + 1, L]; -1 for a state that is not in its domain."""
    out, lengths = np.full(len(trellis.dom_ptr) - 1, -1), np.diff(trellis.dom_ptr)
    found = np.flatnonzero(trellis.dom == np.repeat(states.ravel(), lengths))
    out[np.repeat(np.arange(len(out)), lengths)[found]] = found
    return out


@jit
def reachable(trellis: Trellis, through: Floats, below: float) -> Bools:
    """Return which positions [P] a path cheaper than `below` may go through; each has a successor and a predecessor.

    Args:
        trellis: the problem.
        through: a lower bound on the cost of all paths through each position, nats [P].
        below: nats.
    """
    kept = through < below
    for i in range(len(trellis.dom_ptr) - 2 - trellis.chains, -1, -1):  # drop positions without a successor
        for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
            leads, e = False, trellis.row_ptr[p]
            while kept[p] and not leads and e < trellis.row_ptr[p + 1]:
                leads = kept[np.uint64(trellis.row_to[e])]
                e += 1
            kept[p] = leads
    led_to = np.zeros(len(kept), np.bool_)
    led_to[: trellis.dom_ptr[trellis.chains]] = True
    for p in range(len(kept)):  # drop positions without a predecessor
        kept[p] = kept[p] and led_to[p]
        if kept[p]:
            for e in range(np.uint64(trellis.row_ptr[p]), np.uint64(trellis.row_ptr[p + 1])):
                led_to[np.uint64(trellis.row_to[e])] = True
    return kept


def subset(trellis: Trellis, kept: Bools, rows: Ints, in_place: bool) -> Trellis:
    """Build the trellis of the kept positions [P].

    Args:
        trellis: the whole trellis.
        kept: which positions to keep.
        rows: their `coupling_rows`.
        in_place: whether to overwrite the memory of the whole.
    """
    held = np.flatnonzero(kept)
    before = np.concatenate([[0], np.cumsum(kept)])  # number of kept positions before each
    numbers = np.where(kept, before[:-1], -1).astype(np.int32)
    dom_ptr, up_ptr = before[trellis.dom_ptr], np.searchsorted(rows, trellis.up_ptr)
    row, col = (trellis.row_ptr, trellis.row_to, trellis.row_cost), (trellis.col_ptr, trellis.col_to, trellis.col_cost)
    if in_place:
        row_ptr, row_to, row_cost = keep_entries(*row, held, numbers)
        col_ptr, col_to, col_cost = keep_entries(*col, rows, numbers)
    else:
        row_ptr, row_to, row_cost = select_entries(*row, held, numbers, np.zeros(len(held), np.int64))
        col_ptr, col_to, col_cost = select_entries(*col, rows, numbers, np.zeros(len(rows), np.int64))
    return Trellis(
        trellis.chains, trellis.moves, trellis.parents, dom_ptr, trellis.dom[held], trellis.unary[held],
        row_ptr, row_to, row_cost, up_ptr, col_ptr, col_to, col_cost,
    )  # fmt: skip


def coupling_rows(trellis: Trellis, kept: Bools) -> Ints:
    """Return the coupling rows [U'] of the kept positions [P]."""
    above, _ = positions_above(trellis.chains, trellis.parents, trellis.dom_ptr, trellis.up_ptr)
    return np.flatnonzero(kept[above])


# --- building --------------------------------------------------------------------------------------------------------


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
                for row in range(first, last):
                    value[t + 1, row] += timed[t + 1, row]
    return value


@jit
def _domains(model: Model, start: Ints, moves: int, to_go: Floats, below: float, timed: Floats) -> tuple[Ints, Int32s]:
    """Return `dom_ptr`, and the position of each state at each move [T + 1, G], -1 for none."""
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
        # Keep only successors of kept states. The margin grows with t, by more than the rounding of the sums: rounding
        # cannot keep a state and drop all its successors.
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
    return dom_ptr, place
