"""Moves between a corpus's postures, found from where its clips start: of millions, a tween asks for hundreds."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.corpus.entries import Columns


class Moves:
    """M moves between postures of a corpus: all that lead forwards, clip after clip; then all that lead backwards.

    Args:
        columns: of the corpus's clips.
        times: of its postures [N], seconds.
        chosen: which of all moves these are [M]; None for all.
    """

    def __init__(self, columns: Columns, times: Floats, chosen: Ints | None = None) -> None:
        self._columns, self._times, self._chosen = columns, times, chosen

    def __len__(self) -> int:
        return int(self.firsts[-1]) if self._chosen is None else len(self._chosen)

    def take(self, numbers: Ints) -> Moves:
        """Return some of these moves, by their numbers."""
        some = Moves(self._columns, self._times, numbers if self._chosen is None else self._chosen[numbers])
        some.firsts = self.firsts  # of all moves: it takes time in proportion to the clips
        return some

    @cached_property
    def begins(self) -> Ints:
        """Index of the posture that each leads from [M]."""
        return self._lower + (self._runs >= self._clips)

    @cached_property
    def ends(self) -> Ints:
        """Index of the posture that it leads to [M]: the next one, or the one before for a move backwards."""
        return self._lower + (self._runs < self._clips)

    @cached_property
    def seconds(self) -> Floats:
        """Durations [M]."""
        return np.abs(self._times[self.ends] - self._times[self.begins])

    @cached_property
    def weights(self) -> Floats:
        """Counts [M]."""
        return self._columns.weights.T.ravel()[self._runs]

    @property
    def _clips(self) -> int:
        return len(self._columns.weights)

    @cached_property
    def firsts(self) -> Ints:
        """Number of the first of all moves of each clip, then of each clip backwards [2 C + 1], and of all moves."""
        lengths = np.maximum(np.diff(self._columns.starts) - 1, 0)
        return np.concatenate([[0], np.cumsum([lengths, lengths * (self._columns.weights[:, 1] > 0.0)])])

    @property
    def _runs(self) -> Ints:
        """The clip that each is in [M]: from C on, the clip C before, backwards."""
        if self._chosen is None:
            return np.repeat(np.arange(2 * self._clips), np.diff(self.firsts))
        return np.searchsorted(self.firsts, self._chosen, side="right") - 1

    @property
    def _lower(self) -> Ints:
        """The former of the two postures that each joins [M]."""
        runs = self._runs
        numbers = np.arange(len(self)) if self._chosen is None else self._chosen
        return np.asarray(numbers + self._columns.starts[runs % self._clips] - self.firsts[runs])
