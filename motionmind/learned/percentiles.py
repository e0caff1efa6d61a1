"""Exact percentiles of more numbers than memory holds: only the tail that decides them is kept."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats


class Percentile:
    """A percentile of each column of rows added in any order; equal to `numpy.percentile` of all rows.

    Args:
        percent: the percentile, 0 to 100; the nearer to either end, the less memory it takes.
        total: number of rows to be added in all.
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
        """Return the percentile of each column [columns], once all rows have been added."""
        self._thin()
        tail = np.sort(self._sign * self._rows[0], axis=0)
        first = 0 if self._sign > 0.0 else self._below
        a, b = tail[first], tail[min(first + 1, len(tail) - 1)]
        # Rounds as numpy does.
        return np.asarray(a + (b - a) * self._share if self._share < 0.5 else b - (b - a) * (1 - self._share))

    def _thin(self) -> None:
        """Drop values that are not among the greatest of their column."""
        rows = np.concatenate(self._rows)
        if len(rows) > self._keep:
            rows = np.partition(rows, len(rows) - self._keep, axis=0)[len(rows) - self._keep :].copy()
        self._rows, self._held = [rows], len(rows)
