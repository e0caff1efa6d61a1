"""Building a model from a grammar: every edge and coupling of the search with its cost in nats, and its kind."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.schemes import Weights
from motionmind.search.cfn import Ingredients
from motionmind.search.problem import Model, Problem

KINDS = ("transition", "bridge", "wait")  # of moves
TRANSITION, BRIDGE, WAIT = range(3)


def build_model(
    grammar: Grammar, weights: Weights, coordination: float, bridge_price: float | None, novelty: float = 0.0
) -> Model:
    """Build the costs of a grammar.

    Args:
        grammar: the learned grammar.
        weights: scheme of the transitions' costs.
        coordination: lambda, the factor of the network's -log P.
        bridge_price: nats for each degree that a bridge spans; None leaves bridges out.
        novelty: from 0 (frequent transitions are cheap) to 1 (all transitions attested from a state cost the same).
    """
    graph, bridges, net = grammar.transitions, grammar.bridges, grammar.coordination
    rows, targets, costs = graph.sources, graph.targets, graph.weights(weights, novelty)
    if bridge_price is not None:
        bridged = np.repeat(np.arange(len(bridges.indptr) - 1), np.diff(bridges.indptr))
        rows = np.concatenate([rows, bridged])
        targets = np.concatenate([targets, bridges.targets])
        costs = np.concatenate([costs, bridge_price * bridges.degrees])
        order = np.lexsort((targets, rows))
        rows, targets, costs = rows[order], targets[order], costs[order]
    indptr = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=len(graph.visits)))]).astype(np.int64)

    return Model(
        starts=np.array(graph.starts),  # a copy: a loaded array is read-only, which Numba compiles for separately
        **couplings(net, graph.starts, coordination)._asdict(),
        indptr=indptr,
        targets=targets,
        costs=costs,
        allowed=np.ones(len(graph.visits), dtype=bool),
        place=np.concatenate([np.arange(size) for size in graph.sizes()]).astype(np.int32),
    )


class Couplings(NamedTuple):
    """The couplings between the chains of a Model, with the same attributes."""

    parents: Ints
    unary: Floats
    alone: Floats
    pair_starts: Ints
    pair_ptr: Ints
    pair_states: Int32s
    pair_costs: Floats


def couplings(net: Coordination, starts: Ints, factor: float) -> Couplings:
    """Build the couplings of a network times a factor.

    Args:
        net: the network, over states of the chains.
        starts: first row of each chain's states [L + 1].
        factor: factor of the network's -log P.
    """
    unary, alone = factor * net.child_costs, np.zeros(starts[-1])
    corrections = np.zeros(len(net.pair_costs))
    for chain, parent in enumerate(net.parents):
        if parent < 0:
            continue
        mine, above = (slice(starts[k], starts[k + 1]) for k in (chain, parent))
        rows = slice(net.pair_starts[chain], net.pair_starts[chain + 1])
        unary[above] += factor * net.parent_costs[rows]
        pairs = slice(net.pair_ptr[rows.start], net.pair_ptr[rows.stop])
        row_of_pair = np.repeat(net.parent_costs[rows], np.diff(net.pair_ptr[rows.start : rows.stop + 1]))
        separable = net.child_costs[mine][net.pair_states[pairs]] + row_of_pair
        corrections[pairs] = factor * (net.pair_costs[pairs] - separable)
        least = net.child_costs[mine] + net.parent_costs[rows].min()
        np.minimum.at(least, net.pair_states[pairs], net.pair_costs[pairs])
        alone[mine] = factor * least
    pair_starts, pair_ptr, parents = (np.array(part) for part in (net.pair_starts, net.pair_ptr, net.parents))
    return Couplings(parents, unary, alone, pair_starts, pair_ptr, np.array(net.pair_states), corrections)


def kinds_of(edges: Ints, is_at_goal: Bools, weights: Floats, wait: float) -> Ints:
    """Return the kind of each move, an index of `KINDS`; at its goal a chain waits if that is cheaper than an edge.

    Args:
        edges: index of the transition that attests each move, of any shape; -1 where none does.
        is_at_goal: whether the move stays in the goal's state, in the same shape.
        weights: weight of each transition in the scheme of the search, nats [E].
        wait: nats for each move that a chain waits at its goal.
    """
    attested = np.append(weights, np.inf)[edges]  # infinite where nothing attests the move
    return np.where(is_at_goal & (wait < attested), WAIT, np.where(edges >= 0, TRANSITION, BRIDGE))


def ingredients_of(
    problem: Problem,
    grammar: Grammar,
    weights: Weights,
    network: Coordination,
    factor: float,
    wait: float,
    novelty: float = 0.0,
) -> Ingredients:
    """Return the ingredients of a problem's costs: the kind of each edge, and the parts of the network.

    Args:
        problem: the problem to search; its states are the grammar's, or moves between these.
        grammar: the learned grammar.
        weights: scheme of the transitions' costs.
        network: the coordination network over the problem's states.
        factor: factor of the network's -log P in the problem's costs.
        wait: nats for each move that a chain waits at its goal.
        novelty: as for `build_model`.
    """
    model, graph = problem.model_with_waits(), grammar.transitions
    sizes = np.diff(model.starts)
    first = np.repeat(model.starts[:-1], sizes)  # row of the first state of each state's chain
    rows = np.repeat(graph.starts[:-1], sizes) + model.place  # of each state, among the grammar's
    is_goal = model.place == np.repeat(problem.goal, sizes)
    sources = np.repeat(np.arange(len(first)), np.diff(model.indptr))
    targets = first[sources] + model.targets
    edges = graph.find(rows[sources], model.place[targets])
    is_at_goal = (rows[sources] == rows[targets]) & is_goal[targets]
    kind = kinds_of(edges, is_at_goal, graph.weights(weights, novelty), wait)
    return Ingredients(KINDS, kind, factor * network.child_costs, factor * network.parent_costs)


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
