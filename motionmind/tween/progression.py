"""Lifting a problem from states to moves, for coordination by moves: the progressions of [C98].

In the lifted model, a chain's states are the moves of its joint graph, and each leads to the moves that start where it
ends. The weight of a move is the cost of the edge into it; its coordination with the parent's move is a coupling
between two states, as between postures. So any search of a model works on this one. Each state of the joint graph adds
one more state without incoming edges: the position before any move, where a path starts.
"""

from __future__ import annotations

import numpy as np

from motionmind.grammar.coordination import Coordination
from motionmind.search.problem import Model
from motionmind.tween.problem import couplings


def lift_to_moves(model: Model, net: Coordination, lambda_: float) -> Model:
    """Return the model whose states are moves of `model`.

    State s of a chain means being at s before any move; state S + k is the chain's k-th move. `place` maps each of
    them to its state of `model`.

    Args:
        model: the costs over states.
        net: the network that couples moves.
        lambda_: factor of the network's -log P.
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
