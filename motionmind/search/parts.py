"""Search a bounded trellis by A*, separately for each group of chains that is no longer coupled to the others.

A path's difference in cost from a reference path is the sum of the differences in each group (a *part*), so the bounds
of the parts, each with all others fixed to the reference, add up. A part is searched only below the cost at which it
could still improve on the best path, given the most that the others may save. A joint search would combine every
near-best path of one part with those of all others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Ints
from motionmind.search import astar, heuristic, pair_chains
from motionmind.search.bounding import Bounded, tighten_by_pair_chains
from motionmind.search.costs import path_cost
from motionmind.search.heuristic import Heuristic
from motionmind.search.polish import polish
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS, ROUNDING_NATS, SAME_COST_NATS
from motionmind.search.trellis import Trellis, locate, states_of
from motionmind.search.watcher import Watcher


class Effort(NamedTuple):
    """The numbers of nodes that A* expanded, and that it held at most."""

    expansions: int = 0
    peak_nodes: int = 0


def search(state: Bounded, nodes: int, budget: int, watcher: Watcher) -> Effort:
    """Search a trellis for the best path, and update its bounds with the result.

    Where bound and path meet already, A* follows the bound to the best path.

    Args:
        state: the trellis and its bounds.
        nodes: nodes that A* may hold at once.
        budget: nodes that it may expand.
        watcher: may stop the search.
    """
    part, free = _parts(state.trellis)
    names = np.unique(part[free])
    if state.closed or len(names) < 2 or not state.heuristic.is_of_pair_chains:
        return _search_jointly(state, nodes, budget, watcher)
    chosen = locate(state.trellis, state.states) if state.found else _descend(state)
    cost, states = path_cost(state.trellis, chosen), states_of(state.trellis, chosen)
    left = {name: _fix_all_but(state, chosen, part == name) for name in names}
    may_save = {name: max(cost - heuristic.from_start(smaller[1]), 0.0) for name, smaller in left.items()}
    saved, effort = 0.0, Effort()
    for name in sorted(may_save, key=lambda name: may_save[name]):
        limit = state.cost + sum(may_save.values()) - may_save[name]
        mine = Bounded(*left.pop(name), min(cost, limit), states if cost <= limit else None)
        tighten_by_pair_chains(mine, watcher)
        spent = _search_jointly(mine, nodes, budget - effort.expansions, watcher)
        effort = Effort(effort.expansions + spent.expansions, max(effort.peak_nodes, spent.peak_nodes))
        may_save[name] = cost - mine.lower_bound
        if mine.found:
            saved += cost - mine.cost
            states[:, part == name] = mine.states[:, part == name]
    state.accept(cost - saved, states, cost - sum(may_save.values()))
    return effort


def _search_jointly(state: Bounded, nodes: int, budget: int, watcher: Watcher) -> Effort:
    """Search a trellis, all chains together."""
    if budget <= 0 or (state.closed and not state.found):
        return Effort()
    chosen = np.zeros(len(state.trellis.dom_ptr) - 1, dtype=np.int64)
    slack = OPTIMAL_WITHIN_NATS + 2.0 * ROUNDING_NATS if state.closed else SAME_COST_NATS
    found = watcher.run(astar.search, state.trellis, state.heuristic, state.limit, slack, chosen, nodes, budget)
    if found.cost < state.limit:
        state.accept(path_cost(state.trellis, chosen), states_of(state.trellis, chosen), found.lower_bound)
    else:
        state.lower_bound = min(max(state.lower_bound, found.lower_bound), state.cost)
    return Effort(found.expansions, found.peak_nodes)


def _descend(state: Bounded) -> Ints:
    """Return a path of positions [n]: greedy descent along the bound, polished."""
    chosen = np.zeros(len(state.trellis.dom_ptr) - 1, dtype=np.int64)
    heuristic.descend(state.trellis, state.heuristic, chosen)
    polish(state.trellis, chosen, np.full(len(state.trellis.dom), -np.inf))
    return chosen


def _fix_all_but(state: Bounded, chosen: Ints, mine: Bools) -> tuple[Trellis, Heuristic]:
    """Return the trellis and heuristic with all chains but `mine` [L] fixed to a path of positions [n]."""
    free = np.repeat(np.resize(mine, len(chosen)), np.diff(state.trellis.dom_ptr))
    free[chosen] = True
    through = np.where(free, 0.0, np.inf)
    trellis, tables = pair_chains.prune(state.trellis, state.heuristic.tables, through, 1.0)
    return trellis, Heuristic.of_pair_chains(tables)


def _parts(trellis: Trellis) -> tuple[Ints, Bools]:
    """Return the first chain of each chain's part [L], and whether the chain has any choice [L].

    A coupling joins two chains only where there is a move at which both have more than one position left.
    """
    part: Ints = np.arange(trellis.chains)
    many: Bools = np.diff(trellis.dom_ptr).reshape(-1, trellis.chains) > 1
    for chain, parent in enumerate(trellis.parents):
        if parent >= 0 and np.any(many[:, chain] & many[:, parent]):
            part[chain] = part[parent]
    return part, np.asarray(many.any(axis=0))
