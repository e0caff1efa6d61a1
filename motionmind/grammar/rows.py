"""Rows of numbers, one after another: those of row r lie at `ptr[r]` to `ptr[r + 1]`, rising."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Int32s, Ints, States


def insertion_points(ptr: Ints, numbers: Int32s, rows: Ints, wanted: int | States) -> Ints:
    """Return the index of the first number of each row that is not below the one wanted; the row's end if none is.

    All rows are halved together, for to look at one at a time takes NumPy several microseconds.

    Args:
        ptr: rows of the numbers [R + 1].
        numbers: the numbers of all rows [E].
        rows: the rows to look in, of any shape.
        wanted: what to look for in each.
    """
    first, last = ptr[rows], ptr[rows + 1]
    while np.any(first < last):
        middle = (first + last) // 2
        below = (first < last) & (numbers[np.minimum(middle, len(numbers) - 1)] < wanted)
        first, last = np.where(below, middle + 1, first), np.where(below, last, middle)
    return first
