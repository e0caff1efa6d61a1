"""The same problem with moves for states, for a coordination that is about moves: [C98]'s progressions.

A chain's states are then the moves of its joint graph, each of which leads on to those that leave where it ends. What a
move weighs is what the edge into it costs, and how it goes with the parent's move is a coupling between two states, as
it is between postures; so all that searches a model searches this one. For each state of the joint graph there is one
more, without edges into it: being there before any move, where a path starts.
"""

from __future__ import annotations

import numpy as np

from motionmind.grammar.coordination import Coordination
from motionmind.search.problem import Model
from motionmind.tween.problem import couplings


def lift_to_moves(model: Model, net: Coordination, lambda_: float) -> Model:
    """The model whose states are moves of `model`, coupled by `net` with the factor `lambda_`.

    State s of a chain is being at s before any move; state S + k is the k-th of the chain's moves. What a path's states
    are in `model` is the `place` of each.
    """
    sizes, first_moves = np.diff(model.starts), model.indptr[model.starts]
    starts = model.starts + first_moves
    chain_of_state = np.repeat(np.arange(len(sizes)), sizes)
    chain_of_move = np.repeat(np.arange(len(sizes)), np.diff(first_moves))
    rows = np.arange(model.starts[-1]) + first_moves[chain_of_state]  # of the states before any move
    moves = np.arange(len(model.targets)) + model.starts[chain_of_move + 1]  # and of the moves
    place = np.empty(starts[-1], dtype=np.int32)
    place[rows] = np.arange(model.starts[-1]) - model.starts[chain_of_state]
    place[moves] = model.targets

    at = model.starts[np.repeat(np.arange(len(sizes)), np.diff(starts))] + place  # row in `model` [states here]
    count = np.diff(model.indptr)[at]
    indptr = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    taken = np.arange(indptr[-1]) - np.repeat(indptr[:-1] - model.indptr[at], count)  # the move that each edge takes
    return Model(
        starts=starts,
        **couplings(net, starts, lambda_)._asdict(),
        indptr=indptr,
        targets=(moves[taken] - starts[chain_of_move[taken]]).astype(np.int32),
        costs=model.costs[taken],
        allowed=model.allowed[at],
        place=place,
    )
