"""Steps between a corpus's moments, found from some of them without a look at the others.

A corpus with N postures and M moves has N + M moments, the postures and then the middles of its moves, and 2 M steps:
those from postures to middles, then those from middles to postures. Moves that lead on in their clips come first, and
then those that lead back; in either the postures that they leave, and those that they lead to, rise.
"""

from __future__ import annotations

from bisect import bisect_left

import numpy as np

from motionmind._typing import Ints


def follow(moments: Ints, ahead: bool, steps: int, begins: Ints, ends: Ints, postures: int) -> Ints:
    """Return moments to which so many steps, or fewer, lead from others, or from which they lead there if not `ahead`;
    some of them repeatedly [n]."""
    out = [moments[:0]]
    for _ in range(steps):
        moments = np.unique(steps_at(moments, ahead, begins, ends, postures)[1])
        out.append(moments)
    return np.concatenate(out)


def steps_at(moments: Ints, ahead: bool, begins: Ints, ends: Ints, postures: int) -> tuple[Ints, Ints, Ints]:
    """Return the steps that leave moments, or that lead to them if not `ahead`: at which of the moments [m], the moment
    at each one's other end [m], and its number [m]."""
    moves = len(begins) // 2
    turns = bisect_left(range(moves), True, key=lambda move: ends[moves + move] <= begins[move])
    leaves, first = (begins, 0) if ahead else (ends, moves)  # steps from postures, or to them
    steps = np.full((len(moments), 2), -1)
    steps[:, 0] = np.where(moments >= postures, moments - postures + moves - first, -1)
    for way, (start, stop) in enumerate(((first, first + turns), (first + turns, first + moves))):
        places = start + np.searchsorted(leaves[start:stop], moments)
        found = np.flatnonzero(places < stop)
        found = found[leaves[places[found]] == moments[found]]
        steps[found, way] = places[found]
    at, numbers = np.nonzero(steps >= 0)[0], steps[steps >= 0]
    return at, (ends if ahead else begins)[numbers], numbers
