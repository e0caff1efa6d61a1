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


def follow(samples: Ints, ahead: bool, steps: int, begins: Ints, ends: Ints, postures: int) -> Ints:
    """Return the samples [n] that at most `steps` steps reach from `samples` or, if not `ahead`, that reach `samples`.

    Samples may repeat.
    """
    out, ranges = [samples[:0]], _step_ranges(ahead, begins, ends)
    for _ in range(steps):
        numbers = _steps(samples, ahead, begins, ends, postures, ranges)
        reached = (ends if ahead else begins)[numbers[numbers >= 0]]
        samples = np.unique(reached) if len(reached) > len(samples) else reached  # or they could double each move
        out.append(samples)
    return np.concatenate(out)


def steps_at(samples: Ints, ahead: bool, begins: Ints, ends: Ints, postures: int) -> tuple[Ints, Ints, Ints]:
    """Return the steps that leave `samples`, or lead to them if not `ahead`.

    Returns:
        The position in `samples` of each step [m], the sample at its other end [m], and its index [m].
    """
    steps = _steps(samples, ahead, begins, ends, postures, _step_ranges(ahead, begins, ends))
    at, numbers = np.flatnonzero(steps >= 0) // 2, steps[steps >= 0]
    return at, (ends if ahead else begins)[numbers], numbers


def _steps(
    samples: Ints, ahead: bool, begins: Ints, ends: Ints, postures: int, ranges: Sequence[tuple[int, int]]
) -> Ints:
    """Return the steps at each sample [n, 2]: one forward in its clip and one backward; -1 for none."""
    leaves, moves = begins if ahead else ends, len(begins) // 2
    out = np.full((len(samples), 2), -1)
    out[:, 0] = np.where(samples >= postures, samples - postures + ahead * moves, -1)
    for column, (start, stop) in enumerate(ranges):
        places = start + leaves[start:stop].searchsorted(samples)
        found = np.flatnonzero(places < stop)
        found = found[leaves[places[found]] == samples[found]]
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
