"""A tighter bound by cases: give a variable each of its values in turn, and bound each case.

A path has one of the variable's values, so the least bound of the cases bounds all paths; and a case whose bound
reaches the cost of a known path can be struck off for good. This closes gaps that no reweighting of messages can close,
for what the messages bound is a relaxation in which a variable may be half one value and half another.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionmind.jit import jit
from motionmind.search.bound import Messages, narrow, tighten
from motionmind.search.polish import polish
from motionmind.search.problem import Floats, Grid, Indices, Ints

_SWEEPS = 3  # pairs of sweeps that bound a case
_NEAR = 0.02  # a case's path is polished if it costs no more than this share above the best
_SAME = 1e-9


@jit
def probe(
    grid: Grid,
    m: Messages,
    order: Ints,
    proven: float,
    cost: float,
    below: float,
    states: Indices,
    cases: int,
    ended: NDArray[np.bool_],
) -> tuple[float, float, Grid, Messages]:
    """Go through the variables in the given order and bound up to `cases` cases.

    Stops when the bound meets the cost of the best path, and when `ended` [1] is set, from another thread. Better paths
    found in a case are written to `states` [n].
    Returns the bound (on paths cheaper than `below`), the cost of the best path, and the grid without what was struck
    off, with its messages.
    """
    done = 0
    for i in order:
        least, struck = np.inf, False
        known = min(cost, below)
        if grid.dom_ptr[i + 1] - grid.dom_ptr[i] < 2:
            continue
        for p in range(grid.dom_ptr[i], grid.dom_ptr[i + 1]):
            if ended[0]:
                return proven, cost, grid, m
            if m.through[p] < known - _SAME:
                bound, found = _bound_case(grid, m, i, p, known, cost, states)
                cost = min(cost, found)
                known = min(cost, below)
                done += 1
                if bound >= known - _SAME:
                    m.through[p], struck = np.inf, True
                else:
                    least = min(least, bound)
        proven = max(proven, min(least, known))
        if proven >= known - _SAME or done >= cases:
            break
        if struck:
            grid, m = narrow(grid, m, known - _SAME)
            if np.any(np.diff(grid.dom_ptr) == 0):
                proven = max(proven, known)
                break
            trial = np.zeros(len(grid.dom_ptr) - 1, np.int64)
            bound, _ = tighten(grid, m, trial, 1, known)
            proven = max(proven, bound)
    return proven, cost, grid, m


@jit
def _bound_case(
    grid: Grid, m: Messages, i: int, p: int, known: float, cost: float, states: Indices
) -> tuple[float, float]:
    """A lower bound on the paths through position p of variable i that cost less than `known`, and a path's cost."""
    through: Floats = m.through.copy()
    through[grid.dom_ptr[i] : grid.dom_ptr[i + 1]] = np.inf
    through[p] = m.through[p]
    case, messages = narrow(
        grid,
        Messages(m.down_row, m.up_row, m.down_col, m.up_col, m.constants, m.before, m.ahead, through),
        known - _SAME,
    )
    if np.any(np.diff(case.dom_ptr) == 0):
        return np.inf, np.inf
    chosen = np.zeros(len(case.dom_ptr) - 1, np.int64)
    bound, found = tighten(case, messages, chosen, _SWEEPS, known)
    if bound < known - _SAME and found < cost + _NEAR * abs(cost):
        found = polish(case, chosen)
    if found < cost:
        states[:] = case.dom[chosen]
    return bound, found
