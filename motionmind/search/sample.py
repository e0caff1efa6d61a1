"""A path drawn at random, with probability in proportion to exp(-cost), among those of a fixed number of moves.

By Gibbs sampling in blocks that are drawn exactly: each chain given the others is a chain in time, and each moment
    given
those before and after it a tree. A chain alone could reach each of its paths, whatever the others do, for no coupling
is infinite; so the rounds converge to the distribution from any path that is possible. A number of rounds comes close
to it and no more; where nothing couples the chains one round draws from it exactly. On real ballet, from 5 Hz and 15
degrees to 10 Hz and 5 degrees, costs of paths 10 rounds apart are uncorrelated (0.04 and less).

Sources: Carter and Kohn, "On Gibbs sampling for state space models", Biometrika 81(3), 1994 (forward filtering,
backward sampling; here in the other direction of time); Jensen, Kjaerulff and Kong, "Blocking Gibbs sampling in very
large probabilistic expert systems", IJHCS 42(6), 1995 (blocks that are trees).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.polish import coupling, edge_cost, path_cost
from motionmind.search.problem import Model, Rules, Via
from motionmind.search.solve import Certificate
from motionmind.search.trellis import Trellis, segment_trellises
from motionmind.search.trws import correction

ROUNDS = 100  # each draws every chain and every moment once


def sample_path(
    model: Model, start: Ints, goal: Ints, rules: Rules, vias: Sequence[Via], best: Certificate, seed: int
) -> Certificate:
    """A path drawn at random in place of the best one, with as many moves, past the vias at the same moves.

    Its cost is its own; what the certificate proves of all paths stays.
    """
    rng, cost = np.random.default_rng(seed), 0.0
    stops = [
        (0, start),
        *((move, via.states) for move, via in zip(best.passed, vias, strict=True)),
        (len(best.path) - 1, goal),
    ]
    path = best.path.copy()
    for trellis, (first, _), (last, _) in zip(
        segment_trellises(model, goal, rules.wait, stops), stops, stops[1:], strict=False
    ):
        segment, chosen = path[first + 1 : last + 1], trellis.dom_ptr[:-1].copy()
        domains = [trellis.dom[slice(*span)] for span in pairwise(trellis.dom_ptr[trellis.chains :])]
        chosen[trellis.chains :] += [
            np.searchsorted(domain, s) for domain, s in zip(domains, segment.ravel(), strict=True)
        ]
        cost += float(gibbs_sample(trellis, chosen, ROUNDS, rng))
        segment[:] = trellis.dom[chosen[trellis.chains :]].reshape(segment.shape)
    return replace(best, path=path, cost=cost + rules.per_move * (len(path) - 1), status="sampled")


@jit
def gibbs_sample(trellis: Trellis, path: Ints, rounds: int, rng: np.random.Generator) -> float:
    """Draw a path [n] (positions) in place, starting from the one there, in so many rounds; its cost."""
    for _ in range(rounds):
        for t in range(1, trellis.moves + 1):
            _sample_moment(trellis, path, t, rng)
        for chain in range(trellis.chains):
            _sample_chain(trellis, path, chain, rng)
    return path_cost(trellis, path)


@jit
def _sample_chain(trellis: Trellis, path: Ints, chain: int, rng: np.random.Generator) -> None:
    """value[p]: -log of the sum, over a chain's ways on from position p, of exp(-cost), the other chains as they
    are."""
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
                value[p] += _soft_least(trellis.row_cost[edges] + value[trellis.row_to[edges]])
    for i in range(chain + chains, len(path), chains):
        edges = slice(trellis.row_ptr[path[i - chains]], trellis.row_ptr[path[i - chains] + 1])
        sample_path = _draw(trellis.row_cost[edges] + value[trellis.row_to[edges]], rng)
        path[i] = trellis.row_to[edges][sample_path]


@jit
def _sample_moment(trellis: Trellis, path: Ints, t: int, rng: np.random.Generator) -> None:
    """value[p]: -log of the sum, over what the chains below in the tree may do at move t, of exp(-cost)."""
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
                own = value[trellis.dom_ptr[below] - first : trellis.dom_ptr[below + 1] - first]
                alike = _soft_least(own)
                for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
                    if value[p - first] < np.inf:
                        u = trellis.up_ptr[below] + p - trellis.dom_ptr[i]
                        pairs = slice(trellis.col_ptr[u], trellis.col_ptr[u + 1])
                        # The sum of all alike, 1, and what the listed pairs change in it: exp(-(v + d)) - exp(-v).
                        listed = np.exp(alike - value[trellis.col_to[pairs] - first])
                        value[p - first] += alike - np.log1p(np.sum(listed * np.expm1(-trellis.col_cost[pairs])))
    for chain in range(chains):
        i, parent = t * chains + chain, trellis.parents[chain]
        costs = value[trellis.dom_ptr[i] - first : trellis.dom_ptr[i + 1] - first].copy()
        if parent >= 0:
            above = i - chain + parent
            u = trellis.up_ptr[i] + path[above] - trellis.dom_ptr[above]
            for q in range(trellis.col_ptr[u], trellis.col_ptr[u + 1]):
                costs[trellis.col_to[q] - trellis.dom_ptr[i]] += trellis.col_cost[q]
        path[i] = trellis.dom_ptr[i] + _draw(costs, rng)


@jit
def _soft_least(costs: Floats) -> float:
    """-log of the sum of exp(-cost)."""
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
def _draw(costs: Floats, rng: np.random.Generator) -> int:
    """An index with probability in proportion to exp(-cost)."""
    whole = _soft_least(costs)
    left, sample_path = rng.random(), 0
    for k in range(len(costs)):
        if costs[k] < np.inf:
            sample_path = k
            left -= np.exp(whole - costs[k])
            if left < 0.0:
                break
    return sample_path
