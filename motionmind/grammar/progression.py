"""How joints move together: P(where a joint goes | where it is, and the move that its parent makes), as [C98] has it.

The Bayesian network of the two postures of a move is x_j(t+1) given x_j(t), x_parent(t) and x_parent(t+1). Its tables
would have the square of a joint's states by the square of its parent's, so they are kept for what was seen, by
*moves*: m = (s, s') of the joint and n of its parent. With C the corpus's counts, each move by its weight,

    P(m | s, n) = (C(m, n) + a P(m | s)) / (C(s, n) + a),   C(s, n) the sum of C(m, n) over the moves m that leave s
    P(m | s) = C(m) / (C(s) + a),  and a / (C(s) + a) for any move that the corpus does not attest

so that for every move of the parent the probabilities of leaving a state add up to 1. What was never seen beside the
parent's move backs off to how the joint moves on its own, and from there to the unattested moves, taken together as
one: a is what they are held to have been seen. (Escape method A of Cleary and Witten, "Data compression using adaptive
coding and partial string matching", IEEE Transactions on Communications 32(4), 1984, mixed rather than excluded.)
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.grammar.coordination import PSEUDO_COUNT, Coordination


def fit_progression(
    parents: Ints,
    starts: Ints,
    indptr: Ints,
    targets: Int32s,
    states: Int32s,
    begins: Ints,
    ends: Ints,
    weights: Floats,
) -> Coordination:
    """The same for every move that a chain may make, in the form of a network whose states are moves.

    Chain j has S_j + E_j states there: first one for each state of its joint graph, which stands for being there before
    any move and is coupled to nothing, then its moves in the order of `targets`.

    Args:
        parents: parent chain [L], or -1.
        starts: first row of each chain [L + 1].
        indptr: moves that leave each state [G + 1].
        targets: where they lead, increasing within a row [E]; all moves of the corpus are among them.
        states: of the corpus's postures [N, L].
        begins: postures from which a move leads [M].
        ends: the posture that it leads to [M].
        weights: what it counts [M].
    """
    sizes, first_moves = np.diff(starts), indptr[starts]
    shifted = starts + first_moves  # rows of the chains where states are moves
    sources = np.repeat(np.arange(len(indptr) - 1), np.diff(indptr))
    keys = sources * (1 + np.max(sizes, initial=0)) + targets
    made = {}  # by chain, the move that each of the corpus's is
    for chain in {*range(len(parents))} - {*np.flatnonzero(parents < 0)} | {*parents[parents >= 0]}:
        rows = starts[chain] + states[begins, chain].astype(np.int64)
        made[chain] = np.searchsorted(keys, rows * (1 + np.max(sizes)) + states[ends, chain])

    child_costs, pair_starts = np.zeros(shifted[-1]), [0]
    pair_counts, pair_states, pair_costs = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0)]
    for chain, parent in enumerate(parents):
        if parent < 0:
            pair_starts.append(pair_starts[-1])
            continue
        first, last, stood = first_moves[chain], first_moves[chain + 1], sizes[chain]
        source = sources[first:last] - starts[chain]
        seen = np.bincount(made[chain] - first, weights, last - first)
        alone = np.where(seen > 0.0, seen, PSEUDO_COUNT)
        alone /= np.bincount(source, seen, stood)[source] + PSEUDO_COUNT
        child_costs[shifted[chain] + stood : shifted[chain + 1]] = -np.log(alone)

        # Every move that leaves a state in which the chain was seen beside a move of its parent, and how often it was.
        above, below = made[parent] - first_moves[parent], made[chain] - first
        contexts, which = np.unique(above * stood + source[below], return_inverse=True)
        beside = np.bincount(which, weights, len(contexts))
        begin = indptr[starts[chain] + contexts % stood] - first
        count = indptr[starts[chain] + contexts % stood + 1] - first - begin
        context = np.repeat(np.arange(len(contexts)), count)
        within = np.arange(len(context)) - np.repeat(np.cumsum(count) - count, count)
        move = begin[context] + within
        together = np.zeros(len(context))
        np.add.at(together, (np.cumsum(count) - count)[which] + below - begin[which], weights)

        pair_states.append(stood + move)
        pair_costs.append(np.log(beside[context] + PSEUDO_COUNT) - np.log(together + PSEUDO_COUNT * alone[move]))
        above_moves = first_moves[parent + 1] - first_moves[parent]
        pair_counts += [
            np.zeros(sizes[parent], np.int64),
            np.bincount((contexts // stood)[context], minlength=above_moves),
        ]
        pair_starts.append(pair_starts[-1] + int(sizes[parent] + above_moves))
    return Coordination(
        parents,
        np.array(pair_starts, dtype=np.int64),
        np.concatenate([[0], np.cumsum(np.concatenate(pair_counts))]).astype(np.int64),
        np.concatenate(pair_states).astype(np.int32),
        np.concatenate(pair_costs),
        child_costs,
        np.zeros(pair_starts[-1]),
    )
