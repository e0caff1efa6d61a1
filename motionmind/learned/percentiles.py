"""Percentiles of more numbers than memory holds: only the tail that decides is kept, so they are exact."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats


class Percentile:
    """A percentile of each column of rows that come bit by bit, in any order; as `numpy.percentile` of all at once.

    Args:
        percent: which, 0 to 100; the nearer to either, the less memory it takes.
        total: how many rows will come in all.
    """

    def __init__(self, percent: float, total: int) -> None:
        place = (total - 1) * (percent / 100)
        self._below = int(np.floor(place))
        self._share = place - self._below
        self._sign = 1.0 if 2 * self._below >= total else -1.0
        self._keep = total - self._below if self._sign > 0.0 else min(self._below + 2, total)
        self._rows: list[Floats] = []
        self._held = 0

    def add(self, rows: Floats) -> None:
        """Add rows [n, columns]."""
        self._rows.append(self._sign * rows)
        self._held += len(rows)
        if self._held > 2 * self._keep:
            self._thin()

    def value(self) -> Floats:
        """Return the percentile of each column [columns]; all rows must have come."""
        self._thin()
        tail = np.sort(self._sign * self._rows[0], axis=0)
        first = 0 if self._sign > 0.0 else self._below
        a, b = tail[first], tail[min(first + 1, len(tail) - 1)]
        # The rounding is numpy's.
        return np.asarray(a + (b - a) * self._share if self._share < 0.5 else b - (b - a) * (1 - self._share))

    def _thin(self) -> None:
        """Drop what is not among the greatest of its column."""
        rows = np.concatenate(self._rows)
        if len(rows) > self._keep:
            rows = np.partition(rows, len(rows) - self._keep, axis=0)[len(rows) - self._keep :].copy()
        self._rows, self._held = [rows], len(rows)
