"""Steps between a corpus's samples, looked up from given samples without a scan of the others.

A corpus with N postures and M moves has N + M samples, the postures and then the middles of the moves, and 2 M steps:
those from postures to middles, then those from middles to postures. Moves forward in their clips come first, then
moves backward; within each group, the postures at both ends of the moves increase.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence

import numpy as np

from motionmind._typing import Ints


def follow(moments: Ints, ahead: bool, steps: int, begins: Ints, ends: Ints, postures: int) -> Ints:
    """Return the samples [n] that at most `steps` steps reach from `moments` or, if not `ahead`, that reach `moments`.

    Samples may repeat.
    """
    out, ranges = [moments[:0]], _step_ranges(ahead, begins, ends)
    for _ in range(steps):
        numbers = _steps(moments, ahead, begins, ends, postures, ranges)
        reached = (ends if ahead else begins)[numbers[numbers >= 0]]
        moments = np.unique(reached) if len(reached) > len(moments) else reached  # or they could double each move
        out.append(moments)
    return np.concatenate(out)


def steps_at(moments: Ints, ahead: bool, begins: Ints, ends: Ints, postures: int) -> tuple[Ints, Ints, Ints]:
    """Return the steps that leave `moments`, or lead to them if not `ahead`.

    Returns:
        The position in `moments` of each step [m], the sample at its other end [m], and its index [m].
    """
    steps = _steps(moments, ahead, begins, ends, postures, _step_ranges(ahead, begins, ends))
    at, numbers = np.flatnonzero(steps >= 0) // 2, steps[steps >= 0]
    return at, (ends if ahead else begins)[numbers], numbers


def _steps(
    moments: Ints, ahead: bool, begins: Ints, ends: Ints, postures: int, ranges: Sequence[tuple[int, int]]
) -> Ints:
    """Return the steps at each sample [n, 2]: one forward in its clip and one backward; -1 for none."""
    leaves, moves = begins if ahead else ends, len(begins) // 2
    out = np.full((len(moments), 2), -1)
    out[:, 0] = np.where(moments >= postures, moments - postures + ahead * moves, -1)
    for column, (start, stop) in enumerate(ranges):
        places = start + leaves[start:stop].searchsorted(moments)
        found = np.flatnonzero(places < stop)
        found = found[leaves[places[found]] == moments[found]]
        out[found, column] = places[found]
    return out


def _step_ranges(ahead: bool, begins: Ints, ends: Ints) -> list[tuple[int, int]]:
    """Return the non-empty index ranges of the forward and the backward steps that leave postures.

    If not `ahead`, return the ranges of the steps that lead to postures.
    """
    moves = len(begins) // 2
    first = 0 if ahead else moves
    turns = bisect_left(range(moves), True, key=lambda move: ends[moves + move] <= begins[move])
    return [span for span in ((first, first + turns), (first + turns, first + moves)) if span[0] < span[1]]
