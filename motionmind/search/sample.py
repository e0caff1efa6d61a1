"""A path drawn at random, with probability in proportion to exp(-cost), among those of a fixed number of moves.

By Gibbs sampling in blocks that are drawn exactly: each lane given the others is a chain in time, and each moment given
those before and after it a tree. A lane alone could reach each of its paths, whatever the others do, for no coupling is
infinite; so the rounds converge to the distribution from any path that is possible. A number of rounds comes close to
it and no more; where nothing couples the lanes one round draws from it exactly. On real ballet, from 5 Hz and 15
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
from motionmind.search.trellis import Grid, leg_grids
from motionmind.search.trws import correction

ROUNDS = 100  # each draws every lane and every moment once


def drawn(
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
    for grid, (first, _), (last, _) in zip(leg_grids(model, goal, rules.wait, stops), stops, stops[1:], strict=False):
        leg, chosen = path[first + 1 : last + 1], grid.dom_ptr[:-1].copy()
        domains = [grid.dom[slice(*span)] for span in pairwise(grid.dom_ptr[grid.lanes :])]
        chosen[grid.lanes :] += [np.searchsorted(domain, s) for domain, s in zip(domains, leg.ravel(), strict=True)]
        cost += float(sample(grid, chosen, ROUNDS, rng))
        leg[:] = grid.dom[chosen[grid.lanes :]].reshape(leg.shape)
    return replace(best, path=path, cost=cost + rules.per_move * (len(path) - 1), status="sampled")


@jit
def sample(grid: Grid, path: Ints, rounds: int, rng: np.random.Generator) -> float:
    """Draw a path [n] (positions) in place, starting from the one there, in so many rounds; its cost."""
    for _ in range(rounds):
        for t in range(1, grid.moves + 1):
            _draw_moment(grid, path, t, rng)
        for lane in range(grid.lanes):
            _draw_lane(grid, path, lane, rng)
    return path_cost(grid, path)


@jit
def _draw_lane(grid: Grid, path: Ints, lane: int, rng: np.random.Generator) -> None:
    """value[p]: -log of the sum, over a lane's ways on from position p, of exp(-cost), the other lanes as they are."""
    lanes = grid.lanes
    value = np.empty(grid.dom_ptr[grid.moves * lanes + lane + 1])
    for t in range(grid.moves, 0, -1):
        i = t * lanes + lane
        for p in range(grid.dom_ptr[i], grid.dom_ptr[i + 1]):
            value[p] = grid.unary[p] + coupling(grid, path, i, p)
            for child in range(lane + 1, lanes):
                below = i - lane + child
                if grid.parents[child] == lane:
                    value[p] += correction(grid, grid.up_ptr[below] + p - grid.dom_ptr[i], path[below])
            if t < grid.moves:
                edges = slice(grid.row_ptr[p], grid.row_ptr[p + 1])
                value[p] += _soft_least(grid.row_cost[edges] + value[grid.row_to[edges]])
    for i in range(lane + lanes, len(path), lanes):
        edges = slice(grid.row_ptr[path[i - lanes]], grid.row_ptr[path[i - lanes] + 1])
        drawn = _draw(grid.row_cost[edges] + value[grid.row_to[edges]], rng)
        path[i] = grid.row_to[edges][drawn]


@jit
def _draw_moment(grid: Grid, path: Ints, t: int, rng: np.random.Generator) -> None:
    """value[p]: -log of the sum, over what the lanes below in the tree may do at move t, of exp(-cost)."""
    lanes = grid.lanes
    first = grid.dom_ptr[t * lanes]
    value = np.full(grid.dom_ptr[(t + 1) * lanes] - first, np.inf)
    for lane in range(lanes - 1, -1, -1):
        i = t * lanes + lane
        before = path[i - lanes]
        for e in range(grid.row_ptr[before], grid.row_ptr[before + 1]):
            p = grid.row_to[e]
            value[p - first] = grid.row_cost[e] + grid.unary[p]
            if t < grid.moves:
                value[p - first] += edge_cost(grid, p, path[i + lanes])
        for child in range(lane + 1, lanes):
            if grid.parents[child] == lane:
                below = i - lane + child
                own = value[grid.dom_ptr[below] - first : grid.dom_ptr[below + 1] - first]
                alike = _soft_least(own)
                for p in range(grid.dom_ptr[i], grid.dom_ptr[i + 1]):
                    if value[p - first] < np.inf:
                        u = grid.up_ptr[below] + p - grid.dom_ptr[i]
                        pairs = slice(grid.col_ptr[u], grid.col_ptr[u + 1])
                        # The sum of all alike, 1, and what the listed pairs change in it: exp(-(v + d)) - exp(-v).
                        listed = np.exp(alike - value[grid.col_to[pairs] - first])
                        value[p - first] += alike - np.log1p(np.sum(listed * np.expm1(-grid.col_cost[pairs])))
    for lane in range(lanes):
        i, parent = t * lanes + lane, grid.parents[lane]
        costs = value[grid.dom_ptr[i] - first : grid.dom_ptr[i + 1] - first].copy()
        if parent >= 0:
            above = i - lane + parent
            u = grid.up_ptr[i] + path[above] - grid.dom_ptr[above]
            for q in range(grid.col_ptr[u], grid.col_ptr[u + 1]):
                costs[grid.col_to[q] - grid.dom_ptr[i]] += grid.col_cost[q]
        path[i] = grid.dom_ptr[i] + _draw(costs, rng)


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
    left, drawn = rng.random(), 0
    for k in range(len(costs)):
        if costs[k] < np.inf:
            drawn = k
            left -= np.exp(whole - costs[k])
            if left < 0.0:
                break
    return drawn
