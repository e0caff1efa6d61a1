"""Sample a path with probability proportional to exp(-cost), among those with a given number of moves.

Blocked Gibbs sampling: each chain given the other chains is a chain in time, each move given those before and after it
is a tree, and both can be sampled exactly. No coupling is infinite, so a chain can reach each of its paths whatever the
others do, and the rounds converge to the distribution from any path. A hundred rounds only approximate it; for
uncoupled chains, one round samples exactly. On ballet, at 5 Hz and 15 degrees as at 10 Hz and 5 degrees, costs of paths
10 rounds apart are uncorrelated (0.04 and less).

Sources: Carter and Kohn, "On Gibbs sampling for state space models", Biometrika 81(3), 1994 (forward filtering,
backward sampling; here in the other direction of time); Jensen, Kjaerulff and Kong, "Blocking Gibbs sampling in very
large probabilistic expert systems", IJHCS 42(6), 1995 (blocks that are trees).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.costs import coupling, edge_cost, path_cost
from motionmind.search.problem import Problem
from motionmind.search.solve import Certificate
from motionmind.search.trellis import Trellis, correction, locate, segment_trellises, states_of


def sample_path(problem: Problem, certificate: Certificate, seed: int) -> Certificate:
    """Sample a path in place of the best one.

    Args:
        problem: the problem that was solved.
        certificate: its solution; the sampled path has as many moves, and passes the vias at the same moves.
        seed: seeds the random numbers.

    Returns:
        The certificate with the sampled path, its cost and the status "sampled"; the lower bound stays.
    """
    rng, cost = np.random.default_rng(seed), 0.0
    path = certificate.path.copy()
    moves = [0, *certificate.passed, len(path) - 1]
    for trellis, (first, last) in zip(segment_trellises(problem, moves), pairwise(moves), strict=True):
        chosen = locate(trellis, path[first : last + 1])
        chosen[: trellis.chains] = trellis.dom_ptr[: trellis.chains]  # a via, at which the segment before may arrive
        cost += float(gibbs_sample(trellis, chosen, 100, rng))
        path[first + 1 : last + 1] = states_of(trellis, chosen)[1:]
    return replace(certificate, path=path, cost=cost + problem.rules.per_move * (len(path) - 1), status="sampled")


@jit
def gibbs_sample(trellis: Trellis, path: Ints, rounds: int, rng: np.random.Generator) -> float:
    """Resample a path [n] of positions in place, `rounds` times, and return its cost in nats."""
    for _ in range(rounds):
        for t in range(1, trellis.moves + 1):
            _sample_move(trellis, path, t, rng)
        for chain in range(trellis.chains):
            _sample_chain(trellis, path, chain, rng)
    return path_cost(trellis, path)


@jit
def _sample_chain(trellis: Trellis, path: Ints, chain: int, rng: np.random.Generator) -> None:
    """Resample a chain given the others.

    value[p] is -log of the sum of exp(-cost) over the chain's walks on from position p.
    """
    chains = trellis.chains
    value = np.empty(trellis.dom_ptr[trellis.moves * chains + chain + 1])
    for t in range(trellis.moves, 0, -1):
        i = t * chains + chain
        for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
            value[p] = trellis.unary[p] + coupling(trellis, path, i, p)
            for child in range(chain + 1, chains):
                below = i - chain + child
                if trellis.parents[child] == chain:
                    value[p] += correction(trellis, trellis.up_ptr[below] + p - trellis.dom_ptr[i], path[below])
            if t < trellis.moves:
                edges = slice(trellis.row_ptr[p], trellis.row_ptr[p + 1])
                value[p] += _soft_min(trellis.row_cost[edges] + value[trellis.row_to[edges]])
    for i in range(chain + chains, len(path), chains):
        edges = slice(trellis.row_ptr[path[i - chains]], trellis.row_ptr[path[i - chains] + 1])
        path[i] = trellis.row_to[edges][_sample_index(trellis.row_cost[edges] + value[trellis.row_to[edges]], rng)]


@jit
def _sample_move(trellis: Trellis, path: Ints, t: int, rng: np.random.Generator) -> None:
    """Resample all positions at move t given the other moves.

    value[p] is -log of the sum of exp(-cost) over the choices at this move of the chains below p's in the tree.
    """
    chains = trellis.chains
    first = trellis.dom_ptr[t * chains]
    value = np.full(trellis.dom_ptr[(t + 1) * chains] - first, np.inf)
    for chain in range(chains - 1, -1, -1):
        i = t * chains + chain
        before = path[i - chains]
        for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
            p = trellis.row_to[e]
            value[p - first] = trellis.row_cost[e] + trellis.unary[p]
            if t < trellis.moves:
                value[p - first] += edge_cost(trellis, p, path[i + chains])
        for child in range(chain + 1, chains):
            if trellis.parents[child] == chain:
                below = i - chain + child
                alone = _soft_min(value[trellis.dom_ptr[below] - first : trellis.dom_ptr[below + 1] - first])
                for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
                    if value[p - first] < np.inf:
                        u = trellis.up_ptr[below] + p - trellis.dom_ptr[i]
                        pairs = slice(trellis.col_ptr[u], trellis.col_ptr[u + 1])
                        # Without corrections the sum is 1; a listed pair changes it by exp(-(v + d)) - exp(-v).
                        listed = np.exp(alone - value[trellis.col_to[pairs] - first])
                        value[p - first] += alone - np.log1p(np.sum(listed * np.expm1(-trellis.col_cost[pairs])))
    for chain in range(chains):
        i, parent = t * chains + chain, trellis.parents[chain]
        costs = value[trellis.dom_ptr[i] - first : trellis.dom_ptr[i + 1] - first].copy()
        if parent >= 0:
            above = i - chain + parent
            u = trellis.up_ptr[i] + path[above] - trellis.dom_ptr[above]
            for q in range(trellis.col_ptr[u], trellis.col_ptr[u + 1]):
                costs[trellis.col_to[q] - trellis.dom_ptr[i]] += trellis.col_cost[q]
        path[i] = trellis.dom_ptr[i] + _sample_index(costs, rng)


@jit
def _soft_min(costs: Floats) -> float:
    """Return -log of the sum of exp(-cost)."""
    least = np.inf
    for cost in costs:
        least = min(least, cost)
    if least == np.inf:
        return np.inf
    total = 0.0
    for cost in costs:
        total += np.exp(least - cost)
    return float(least - np.log(total))


@jit
def _sample_index(costs: Floats, rng: np.random.Generator) -> int:
    """Sample an index with probability proportional to exp(-cost)."""
    whole = _soft_min(costs)
    left, index = rng.random(), 0
    for k in range(len(costs)):
        if costs[k] < np.inf:
            index = k
            left -= np.exp(whole - costs[k])
            if left < 0.0:
                break
    return index
