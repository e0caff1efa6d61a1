"""The optimisation problem: joint chains that move in lockstep, coupled by a tree at every move.

A chain walks on one joint's joint graph (or on the facing's). For T moves there is a variable (t, chain) for
t = 0 .. T, whose domain holds the states that lie on some walk of exactly T moves from the chain's start to its goal.
The chain's edges couple consecutive variables (an absent edge is forbidden); at every t >= 1 the tree couples each
chain to its parent. For a path of a given number of moves, a guide may add costs of states that depend on the move.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.jit import jit
from motionmind.search.csr import insert_entries


class Model(NamedTuple):
    """Costs in nats of moves and of coordination, for L chains with S_j states, G = sum S_j.

    State s of chain j has row `starts[j] + s` in every array that is listed by state.

    The coupling of a chain to its parent costs a separable part plus a correction for each listed pair of states, 0 for
    all other pairs. `unary` holds the separable part: one term a state, summed over all couplings that the state takes
    part in. Corrections are mostly discounts. This is the form of a table whose unseen pairs back off to marginals; it
    makes a message linear in the number of pairs seen.

    A chain starts in a state and arrives at a place. Where states are those of a joint graph the two are the same; a
    state may also be a move, which ends at a place (`motionmind.tween.progression`).

    Attributes:
        starts: first row of each chain [L + 1].
        parents: parent chain [L], smaller than the chain, or -1.
        indptr: edges of each state [G + 1]; `targets` and `costs` from `indptr[row]` to `indptr[row + 1]`.
        targets: state that an edge leads to [E], increasing within a row.
        costs: cost of the edge, nats [E].
        unary: cost of being in a state at any t >= 1, nats [G].
        alone: the least that the coupling to its parent can cost a state, whatever the parent's state, nats [G].
        pair_starts: first pair row of each chain [L + 1]; a chain has one pair row for each state of its parent.
        pair_ptr: pairs of each pair row [sum + 1].
        pair_states: the chain's state in a listed pair [Q], increasing within a pair row.
        pair_costs: correction for the pair, nats [Q].
        allowed: whether a chain may be in a state between the first posture and the last [G].
        place: place of each state [G]; the goal is a place.
    """

    starts: Ints
    parents: Ints
    indptr: Ints
    targets: Int32s
    costs: Floats
    unary: Floats
    alone: Floats
    pair_starts: Ints
    pair_ptr: Ints
    pair_states: Int32s
    pair_costs: Floats
    allowed: Bools
    place: Int32s


class Via(NamedTuple):
    """States [L] to pass through between start and goal: at move `move`, or at any if it is None."""

    states: Ints
    move: int | None = None


@dataclass(frozen=True)
class Rules:
    """Numbers of moves and effort allowed to the search, and costs beside those of the model.

    Attributes:
        wait: beta, nats for each move that a chain waits at its goal.
        per_move: tau, nats for each move.
        shortest: least number of moves.
        longest: greatest number of moves.
        node_budget: nodes that A* may hold at once; it stops after as many expansions.
        sweeps: pairs of message sweeps at most, for each number of moves; at least 1.
    """

    wait: float
    per_move: float
    shortest: int
    longest: int
    node_budget: int
    sweeps: int = 160


@dataclass(frozen=True, eq=False)
class Problem:
    """The problem of finding a cheapest path.

    Attributes:
        model: costs and restrictions of the chains.
        start: states to start from [L].
        goal: places to arrive at [L].
        rules: numbers of moves, their costs, and the effort allowed.
        vias: states to pass through, in this order; they divide the path into segments.
        guide: returns, for a path of T moves, the cost of being in each state after moves 1 to T - 1, nats [T - 1, G];
            finite, of either sign. It affects the path, not the number of moves: `solve` compares numbers of moves by
            the costs of paths without it.
        tolls: nats for a number of moves, for each segment from stop to stop and each number up to the greatest
            [K, N + 1]; finite, of either sign. They only choose the number of moves (`motionmind.search.length`), and
            are not part of a path's cost. None for no tolls.
    """

    model: Model
    start: Ints
    goal: Ints
    rules: Rules
    vias: Sequence[Via] = ()
    guide: Callable[[int], Floats] | None = None
    tolls: Floats | None = None

    @property
    def stops(self) -> list[Ints]:
        """Start, vias and goal, states [L] each."""
        return [self.start, *(via.states for via in self.vias), self.goal]

    def model_with_waits(self) -> Model:
        """Return the model in which chains may wait at the goal, by `with_waits`."""
        return with_waits(self.model, self.goal, self.rules.wait)

    def timed_costs(self, moves: int) -> Floats | None:
        """Return the guide's costs for a path of T moves, 0 at both ends, nats [T + 1, G]; None without a guide.

        Raises:
            ValueError: the guide returned costs of another shape, or costs that are not finite.
        """
        if self.guide is None:
            return None
        out = np.zeros((moves + 1, self.model.starts[-1]))
        if moves > 1:
            costs = self.guide(moves)
            if costs.shape != out[1:-1].shape:
                raise ValueError(f"the guide of {moves} moves has the shape {costs.shape}, not {out[1:-1].shape}")
            if not np.isfinite(costs).all():
                raise ValueError(f"the guide of {moves} moves has costs that are not finite")
            out[1:-1] = costs
        return out


def with_waits(model: Model, goal: Ints, wait: float) -> Model:
    """Let every chain wait at its goal for `wait` nats a move, or less if the model has a cheaper edge there.

    Args:
        model: the costs.
        goal: goal states [L].
        wait: nats a move; infinite for no waits.

    Returns:
        The model with those edges; `model` itself where `wait` is infinite.
    """
    if wait == np.inf:
        return model
    rows = model.starts[:-1] + goal
    at = np.array(
        [
            first + np.searchsorted(model.targets[first:last], state)
            for first, last, state in zip(model.indptr[rows], model.indptr[rows + 1], goal, strict=True)
        ],
        dtype=np.int64,
    )
    held = np.zeros(len(rows), dtype=bool)
    listed = at < model.indptr[rows + 1]
    held[listed] = model.targets[at[listed]] == goal[listed]
    costs = model.costs.copy()
    costs[at[held]] = np.minimum(costs[at[held]], wait)
    indptr, targets, costs = insert_entries(
        model.indptr, model.targets, costs, rows[~held], at[~held], goal[~held].astype(np.int32), wait
    )
    return model._replace(indptr=indptr, targets=targets, costs=costs)


def places(model: Model, path: Int32s) -> Int32s:
    """Return the places of a path of states, both [T + 1, L]."""
    return np.asarray(model.place[model.starts[:-1] + path])


def costs_to_go(
    model: Model, goal: Ints, moves: int, timed: Floats | None = None, known: Floats | None = None
) -> Floats:
    """Compute the least cost of each chain on its own from each state to the goal, by number of moves.

        V[0, s at goal] = 0
        V[k, s] = min over edges s -> s' of  cost(s, s') + alone(s') + timed[T - k + 1, s'] + V[k - 1, s']

    over the allowed states s' or, for the last move, the states at the goal. Summed over chains, V bounds the cost
    of exactly k moves from below, since each coupling counts once, at the least that it can cost its chain.

    Args:
        model: the costs, waits included.
        goal: places to arrive at [L].
        moves: greatest number of moves T.
        timed: further costs of being in each state after each move, of a path that arrives after move T, nats
            [T + 1, G]; None for none.
        known: V of fewer moves, where there are no timed costs [K, G]; None for none.

    Returns:
        V, nats [T + 1, G]; infinite where no walk of exactly k moves exists.
    """
    value, fewer = np.full((moves + 1, model.starts[-1]), np.inf), 0 if known is None else len(known)
    if known is not None:
        value[:fewer] = known
    _fill_costs_to_go(model, goal, value[:0] if timed is None else timed, fewer, value)
    return value


@jit
def _fill_costs_to_go(model: Model, goal: Ints, timed: Floats, known: int, value: Floats) -> None:
    """Write the rows of V from `known` on; `timed` has no rows where it holds no costs."""
    moves, arrived = len(value) - 1, np.empty(len(model.alone))
    for chain in range(len(model.parents)):
        first, last = model.starts[chain], model.starts[chain + 1]
        for row in range(first, last):
            if model.place[row] == goal[chain]:
                value[0, row] = 0.0
        for k in range(max(1, known), moves + 1):
            for row in range(first, last):
                cost = value[k - 1, row] + model.alone[row]
                if len(timed) > 0:
                    cost += timed[moves - k + 1, row]
                arrived[row - first] = cost if k == 1 or model.allowed[row] else np.inf
            for row in range(first, last):
                least, other = np.inf, np.inf  # one for odd and one for even edges, to run in parallel
                first_edge, end = np.uint64(model.indptr[row]), np.uint64(model.indptr[row + 1])
                odd = first_edge + (end - first_edge) % np.uint64(2)
                if odd > first_edge:
                    least = model.costs[first_edge] + arrived[np.uint64(model.targets[first_edge])]
                for e in range(odd, end, np.uint64(2)):
                    least = min(least, model.costs[e] + arrived[np.uint64(model.targets[e])])
                    beside = e + np.uint64(1)
                    other = min(other, model.costs[beside] + arrived[np.uint64(model.targets[beside])])
                value[k, row] = min(least, other)
