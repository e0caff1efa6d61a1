"""Progressions: P(where a joint goes | where it is, and the move that its parent makes).

Source: Bradley and Stuart, "Using chaos to generate variations on movement sequences", Chaos 8:800 (1998). Their
Bayesian network of the two postures of a move has x_j(t+1) given x_j(t), x_parent(t) and x_parent(t+1). Full tables
would hold the square of a joint's states by the square of its parent's. These are sparse, indexed by *moves*:
m = (s, s') of the joint and n of its parent. With C the corpus's counts, each move by its weight,

    P(m | s, n) = (C(m, n) + a P(m | s)) / (C(s, n) + a),   C(s, n) the sum of C(m, n) over the moves m that leave s
    P(m | s) = C(m) / (C(s) + a),  and a / (C(s) + a) for any move that the corpus does not attest

For every move of the parent, the probabilities of leaving a state add up to 1. A move that was never seen with the
parent's backs off to the joint's own moves, and from there to the unattested moves, which together have the
pseudo-count a. This is escape method A of Cleary and Witten, "Data compression using adaptive coding and partial string
matching", IEEE Transactions on Communications 32(4), 1984, mixed rather than excluded.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.grammar.coordination import PRIOR_WEIGHT, Coordination


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
    """Fit the progressions of all chains, in the form of a network whose states are moves.

    Chain j has S_j + E_j states in it: first one for each state of its joint graph, which means being there before any
    move and has no coordination, then its moves in the order of `targets`.

    Args:
        parents: parent chain [L], or -1.
        starts: first row of each chain [L + 1].
        indptr: moves that leave each state [G + 1].
        targets: the state that each move leads to, increasing within a row [E]; all moves of the corpus are among them.
        states: states of the corpus's postures [N, L].
        begins: the posture that each of the corpus's moves leads from [M].
        ends: the posture that it leads to [M].
        weights: its weight [M].
    """
    sizes, first_moves = np.diff(starts), indptr[starts]
    shifted = starts + first_moves  # rows of the chains where states are moves
    sources = np.repeat(np.arange(len(indptr) - 1), np.diff(indptr))
    keys = sources * (1 + np.max(sizes, initial=0)) + targets
    made = {}  # by chain: index in the joint graph of each of the corpus's moves
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
        below, above = made[chain] - first, made[parent] - first_moves[parent]
        source = sources[first:last] - starts[chain]
        alone = _own_probabilities(source, stood, below, weights)
        child_costs[shifted[chain] + stood : shifted[chain + 1]] = -np.log(alone)
        move, beside, costs = _pair_costs(
            source, indptr[starts[chain] : starts[chain + 1] + 1], alone, above, below, weights
        )

        pair_states.append(stood + move)
        pair_costs.append(costs)
        above_moves = first_moves[parent + 1] - first_moves[parent]
        pair_counts += [np.zeros(sizes[parent], np.int64), np.bincount(beside, minlength=above_moves)]
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


def _own_probabilities(source: Ints, size: int, below: Ints, weights: Floats) -> Floats:
    """Return P(m | s) of each move m of a chain with `size` states [E_j].

    For an unattested move, this is the probability of all unattested moves together.

    Args:
        source: state that each move of the chain leaves [E_j].
        size: number of states of the chain.
        below: the chain's move in each of the corpus's moves [M].
        weights: weight of each of the corpus's moves [M].
    """
    seen = np.bincount(below, weights, len(source))
    alone = np.where(seen > 0.0, seen, PRIOR_WEIGHT)
    alone /= np.bincount(source, seen, size)[source] + PRIOR_WEIGHT
    return alone


def _pair_costs(
    source: Ints, rows: Ints, alone: Floats, above: Ints, below: Ints, weights: Floats
) -> tuple[Ints, Ints, Floats]:
    """Return -log P(m | s, n), nats, of all moves m from s, for each pair of n and s in the corpus.

    Args:
        source: state that each move of the chain leaves [E_j].
        rows: moves that leave each state of the chain, as in `indptr` [S_j + 1].
        alone: P(m | s) of each move of the chain [E_j].
        above: the parent's move n in each of the corpus's moves [M].
        below: the chain's move m in each of the corpus's moves [M].
        weights: weight of each of the corpus's moves [M].

    Returns:
        The move m, the parent's move n and the cost of each pair, in the order of n, then m.
    """
    size, first = len(rows) - 1, rows[0]
    contexts, which = np.unique(above * size + source[below], return_inverse=True)  # a context is a pair (n, s)
    seen = np.bincount(which, weights, len(contexts))
    begin = rows[contexts % size] - first
    count = rows[contexts % size + 1] - first - begin
    context = np.repeat(np.arange(len(contexts)), count)
    within = np.arange(len(context)) - np.repeat(np.cumsum(count) - count, count)
    move = begin[context] + within
    together = np.zeros(len(context))
    np.add.at(together, (np.cumsum(count) - count)[which] + below - begin[which], weights)
    costs = np.log(seen[context] + PRIOR_WEIGHT) - np.log(together + PRIOR_WEIGHT * alone[move])
    return move, (contexts // size)[context], costs
