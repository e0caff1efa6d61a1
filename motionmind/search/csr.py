"""Matrices in compressed sparse rows: row r has the entries `ptr[r]` to `ptr[r + 1]`, with increasing columns."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.jit import jit, read_only


def select_entries(
    ptr: Ints, columns: Int32s, costs: Floats, rows: Ints, numbers: Int32s, shifts: Ints
) -> tuple[Ints, Int32s, Floats]:
    """Build a matrix from rows of another: keep the columns that have a new number, and renumber them.

    Args:
        ptr: rows of the other matrix [R + 1].
        columns: its columns [E].
        costs: its entries [E].
        rows: the row that each row of the new matrix is taken from [N].
        numbers: new number of each old column; -1 to leave it out.
        shifts: for each new row, the offset to add to an old column to index `numbers` [N].

    Returns:
        Row pointers [N + 1], columns [M] and entries [M] of the new matrix.
    """
    most = int((ptr[rows + 1] - ptr[rows]).sum())
    out_columns, out_costs = np.empty(most + 1, np.int32), np.empty(most + 1)
    old = read_only(ptr), read_only(columns), read_only(costs)
    out_ptr = _write_entries(*old, rows, numbers, shifts, out_columns, out_costs)
    return out_ptr, out_columns[: out_ptr[-1]], out_costs[: out_ptr[-1]]


def keep_entries(ptr: Ints, columns: Int32s, costs: Floats, rows: Ints, numbers: Int32s) -> tuple[Ints, Int32s, Floats]:
    """Do the same as `select_entries` for rising rows, overwriting the memory of the other matrix.

    Allocating as much memory again takes longer than writing to it.
    """
    old, shifts = (read_only(ptr), read_only(columns), read_only(costs)), np.zeros(len(rows), np.int64)
    out_ptr = _write_entries(*old, rows, numbers, shifts, columns, costs)
    return out_ptr, columns[: out_ptr[-1]], costs[: out_ptr[-1]]


@jit
def _write_entries(
    ptr: Ints,
    columns: Int32s,
    costs: Floats,
    rows: Ints,
    numbers: Int32s,
    shifts: Ints,
    out_columns: Int32s,
    out_costs: Floats,
) -> Ints:
    """Write the columns and entries of `select_entries`, and return its row pointers [N + 1]."""
    # Write every entry, but advance only past kept ones: a branch would often be mispredicted.
    out_ptr, at = np.zeros(len(rows) + 1, np.int64), np.uint64(0)
    for k in range(len(rows)):
        for e in range(np.uint64(ptr[rows[k]]), np.uint64(ptr[rows[k] + 1])):
            number = numbers[np.uint64(shifts[k] + columns[e])]
            out_columns[at], out_costs[at] = number, costs[e]
            at += np.uint64(number >= 0)
        out_ptr[k + 1] = at
    return out_ptr


def insert_entries(
    ptr: Ints, columns: Int32s, costs: Floats, rows: Ints, at: Ints, new: Int32s, cost: float
) -> tuple[Ints, Int32s, Floats]:
    """Build a matrix with further entries, all of one cost.

    Args:
        ptr: rows of the other matrix [R + 1].
        columns: its columns [E].
        costs: its entries [E].
        rows: the row of each further entry, rising [N].
        at: the entry before which to insert each, or the end of the row [N].
        new: columns of the further entries [N].
        cost: cost of each further entry.
    """
    rises = np.cumsum(np.bincount(rows, minlength=len(ptr) - 1))
    return ptr + np.concatenate([[0], rises]), np.insert(columns, at, new), np.insert(costs, at, cost)
