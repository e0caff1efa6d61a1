"""What a path is charged for, joint by joint and move by move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.discretize import StateSpace
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.search.problem import Ints, Model, places, with_waits
from motionmind.search.solve import Rules

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Account:
    """The cost of a path of T moves of L lanes, taken apart: `moves`, `coordination` and `per_move` for each move add
    up to it.

    Attributes:
        moves: nats for each lane's move, bridge or wait [T, L].
        coordination: nats for the state that each lane arrives in, or the move that it makes, beside its parent's:
            lambda * -log P [T, L].
        per_move: tau, nats for each move.
        likelihood: P(state arrived in | state left), as the corpus counts it; 0 where it attests no such move [T, L].
        degrees: the angle between the two states [T, L].
        names: what people call the states of each posture, [T + 1][L].
    """

    moves: Floats
    coordination: Floats
    per_move: float
    likelihood: Floats
    degrees: Floats
    names: tuple[tuple[str, ...], ...]

    @property
    def total(self) -> float:
        """The cost of the path, nats."""
        return float(self.moves.sum() + self.coordination.sum()) + self.per_move * len(self.moves)


def account(
    path: NDArray[np.int32],
    model: Model,
    goal: Ints,
    rules: Rules,
    grammar: Grammar,
    space: StateSpace,
    net: Coordination,
    lambda_: float,
) -> Account:
    """What `path` [T + 1, L] costs in a model that was made of a grammar, with the factor `lambda_` of `net`."""
    held, graph, at = with_waits(model, goal, rules.wait), grammar.transitions, places(model, path)
    probability = np.exp(-graph.weights("conditional"))
    shape = (len(path) - 1, len(grammar.lanes))
    moves, together, likelihood = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for t, lane in np.ndindex(*shape):
        before, after, parent = int(path[t, lane]), int(path[t + 1, lane]), int(net.parents[lane])
        row = held.starts[lane] + before
        first, last = held.indptr[row], held.indptr[row + 1]
        moves[t, lane] = held.costs[first + np.searchsorted(held.targets[first:last], after)]
        if parent >= 0:
            together[t, lane] = lambda_ * net.cost(lane, int(path[t + 1, parent]), after, held.starts)
        edge = graph.edge(lane, int(at[t, lane]), int(at[t + 1, lane]))
        likelihood[t, lane] = probability[edge] if edge >= 0 else 0.0
    orientations = space.decode(at)
    degrees = np.degrees(rot.angle(orientations[:-1], orientations[1:]))
    names = tuple(tuple(space.label(lane, int(state)) for lane, state in enumerate(row)) for row in at)
    return Account(moves, together, rules.per_move, likelihood, degrees, names)
