"""What is minimised: chains of states, one a chain, that run in lockstep and are coupled by a tree at every move.

A chain is one joint's joint graph (or the body's facing). For T moves there is a variable (t, chain) for t = 0 .. T,
whose domain holds the states that lie on some walk of exactly T moves from the chain's start to its goal. Along a chain
consecutive variables are coupled by the chain's edges (an absent edge is forbidden); at every t >= 1 each chain is
coupled to its parent in the tree. The search knows nothing of bodies beyond this.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.jit import jit


class Model(NamedTuple):
    """Costs in nats of moves and of standing together, for L chains with S_j states, G = sum S_j.

    State s of chain j has the row `starts[j] + s` in what is listed by state.

    The coupling of a chain to its parent costs `unary` (its part that separates into one term a state, summed over
    all couplings that a state takes part in) plus a correction for the listed pairs, 0 for all others: most often a
    discount. That is the form of a table whose unseen pairs back off to marginals, and makes a message linear in the
    pairs seen.

    A chain starts in a state and arrives at a place. Where states are those of a joint graph both are the same; a state
    may also be a move, which ends at a place (`motionmind.tween.progression`).

    Attributes:
        starts: first row of each chain [L + 1].
        parents: parent chain [L], smaller than the chain, or -1.
        indptr: edges of each state [G + 1]; `targets` and `costs` from `indptr[row]` to `indptr[row + 1]`.
        targets: state that an edge leads to [E], increasing within a row.
        costs: cost of the edge [E].
        unary: cost of being in a state at any t >= 1 [G].
        alone: a lower bound on a state's share of the couplings, when nothing is known of the other chains [G]:
            the least that the coupling to its parent can cost.
        pair_starts: first pair row of each chain [L + 1]; a chain has one pair row for each state of its parent.
        pair_ptr: pairs of each pair row [sum + 1].
        pair_states: the chain's state in a listed pair [Q], increasing within a pair row.
        pair_costs: its correction [Q].
        allowed: whether a chain may be in a state on the way, at moves after the first posture and before the last [G].
        place: where a chain is in a state, the goal being one of these [G].
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


def with_waits(model: Model, goal: Ints, wait: float) -> Model:
    """The model in which every chain may wait at its goal for `wait` a move, or hold there if that is cheaper.

    It is the model itself where `wait` is infinite.
    """
    if wait == np.inf:
        return model
    rows = model.starts[:-1] + goal
    at = np.array([_insertion(model, row, state) for row, state in zip(rows, goal, strict=True)], dtype=np.int64)
    held = np.zeros(len(rows), dtype=bool)
    listed = at < model.indptr[rows + 1]
    held[listed] = model.targets[at[listed]] == goal[listed]
    costs = model.costs.copy()
    costs[at[held]] = np.minimum(costs[at[held]], wait)
    added = np.zeros(len(model.indptr), dtype=np.int64)
    added[rows[~held] + 1] = 1
    return model._replace(
        indptr=model.indptr + np.cumsum(added),
        targets=np.insert(model.targets, at[~held], goal[~held].astype(np.int32)),
        costs=np.insert(costs, at[~held], wait),
    )


def places(model: Model, path: Int32s) -> Int32s:
    """Where the chains are along a path of states [T + 1, L]."""
    return np.asarray(model.place[model.starts[:-1] + path])


def _insertion(model: Model, row: int, state: int) -> int:
    first, last = model.indptr[row], model.indptr[row + 1]
    return int(first + np.searchsorted(model.targets[first:last], state))


@jit
def costs_to_go(model: Model, goal: Ints, moves: int) -> Floats:
    """V[k, row]: the least that exactly k moves from a state to its chain's goal cost a chain on its own [moves + 1,
    G].

        V[0, s at goal] = 0,   V[k, s] = min over edges s -> s' of  cost(s, s') + alone(s') + V[k - 1, s']

    over states s' that are allowed on the way, and those at the goal with the last move. Infinite where no such walk
    exists. Summed over chains it bounds the cost of T moves from below, since each coupling is counted once, at the
    least it can cost its chain.
    """
    value = np.full((moves + 1, model.starts[-1]), np.inf)
    for chain in range(len(model.parents)):
        first, last = model.starts[chain], model.starts[chain + 1]
        for row in range(first, last):
            if model.place[row] == goal[chain]:
                value[0, row] = 0.0
        for k in range(1, moves + 1):
            for row in range(first, last):
                best = np.inf
                for e in range(model.indptr[row], model.indptr[row + 1]):
                    target = first + model.targets[e]
                    if k == 1 or model.allowed[target]:
                        best = min(best, model.costs[e] + model.alone[target] + value[k - 1, target])
                value[k, row] = best
    return value


class Via(NamedTuple):
    """States [L] to pass through between start and goal, at a certain move or, for None, at any."""

    states: Ints
    move: int | None = None


@dataclass(frozen=True)
class Rules:
    """What the search may do and what that costs beside the model's own costs.

    Attributes:
        wait: beta, nats for each move that a chain waits at its goal.
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


@dataclass(frozen=True, eq=False)
class Problem:
    """The problem as the search was given it: the costs, start and goal states [L], the rules, and the vias."""

    model: Model
    start: Ints
    goal: Ints
    rules: Rules
    vias: tuple[Via, ...] = ()
