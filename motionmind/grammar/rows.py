"""Search in sorted rows stored one after another: row r holds `numbers[ptr[r] : ptr[r + 1]]`, increasing."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Int32s, Ints, States


def searchsorted_rows(ptr: Ints, numbers: Int32s, rows: Ints, wanted: int | States) -> Ints:
    """Return the index of the first number in each row that is not below the wanted one; the row's end if none is.

    Bisect all rows together: NumPy takes several microseconds for a row by itself.

    Args:
        ptr: rows of the numbers [R + 1].
        numbers: the numbers of all rows [E].
        rows: the rows to search, of any shape.
        wanted: the number to search for, or one for each row.
    """
    first, last = ptr[rows], ptr[rows + 1]
    while np.any(first < last):
        middle = (first + last) // 2
        below = (first < last) & (numbers[np.minimum(middle, len(numbers) - 1)] < wanted)
        first, last = np.where(below, middle + 1, first), np.where(below, last, middle)
    return first
