"""Steps between a corpus's moments, found from some of them without a look at the others.

A corpus with N postures and M moves has N + M moments, the postures and then the middles of its moves, and 2 M steps:
those from postures to middles, then those from middles to postures. Moves that lead on in their clips come first, and
then those that lead back; in either the postures that they leave, and those that they lead to, rise.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence

import numpy as np

from motionmind._typing import Ints


def follow(moments: Ints, ahead: bool, steps: int, begins: Ints, ends: Ints, postures: int) -> Ints:
    """Return moments to which so many steps, or fewer, lead from others, or from which they lead there if not `ahead`;
    some of them repeatedly [n]."""
    out, ways = [moments[:0]], _ways(ahead, begins, ends)
    for _ in range(steps):
        numbers = _steps(moments, ahead, begins, ends, postures, ways)
        reached = (ends if ahead else begins)[numbers[numbers >= 0]]
        moments = np.unique(reached) if len(reached) > len(moments) else reached  # they could double with each move
        out.append(moments)
    return np.concatenate(out)


def steps_at(moments: Ints, ahead: bool, begins: Ints, ends: Ints, postures: int) -> tuple[Ints, Ints, Ints]:
    """Return the steps that leave moments, or that lead to them if not `ahead`: at which of the moments [m], the moment
    at each one's other end [m], and its number [m]."""
    steps = _steps(moments, ahead, begins, ends, postures, _ways(ahead, begins, ends))
    at, numbers = np.flatnonzero(steps >= 0) // 2, steps[steps >= 0]
    return at, (ends if ahead else begins)[numbers], numbers


def _steps(
    moments: Ints, ahead: bool, begins: Ints, ends: Ints, postures: int, ways: Sequence[tuple[int, int]]
) -> Ints:
    """Return the steps at each moment [n, 2], at most one forward in its clip and one backward; -1 for none."""
    leaves, moves = begins if ahead else ends, len(begins) // 2
    out = np.full((len(moments), 2), -1)
    out[:, 0] = np.where(moments >= postures, moments - postures + ahead * moves, -1)
    for column, (start, stop) in enumerate(ways):
        places = start + leaves[start:stop].searchsorted(moments)
        found = np.flatnonzero(places < stop)
        found = found[leaves[places[found]] == moments[found]]
        out[found, column] = places[found]
    return out


def _ways(ahead: bool, begins: Ints, ends: Ints) -> list[tuple[int, int]]:
    """Return where the steps from postures, or to them if not `ahead`, that are forward in their clips begin and end,
    and those that are backward, if there are any."""
    moves = len(begins) // 2
    first = 0 if ahead else moves
    turns = bisect_left(range(moves), True, key=lambda move: ends[moves + move] <= begins[move])
    return [way for way in ((first, first + turns), (first + turns, first + moves)) if way[0] < way[1]]
