"""The watcher of a search, and the time that a search takes."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from time import perf_counter
from typing import TypeVar

import numpy as np

WATCH_INTERVAL_S = 0.1  # between two calls of the watcher

_Result = TypeVar("_Result")


class Attention:
    """A link to the watcher of a search, who may want it to end.

    Attributes:
        ended: set once the search is to end; compiled code reads it from another thread [1].
    """

    def __init__(self, wants_end: Callable[[], bool] | None) -> None:
        """Ask `wants_end` from time to time; None means no watcher."""
        self.ended = np.zeros(1, dtype=bool)
        self._wants_end = wants_end

    def ends(self) -> bool:
        """Ask the watcher, and return whether the search should end."""
        if self._wants_end is not None and not self.ended[0]:
            self.ended[0] = self._wants_end()
        return bool(self.ended[0])

    def run(self, work: Callable[..., _Result], *arguments: object) -> _Result:
        """Do long compiled work and return its result; with a watcher, run it in a thread and keep asking.

        The work gets `ended` as its last argument, and stops when it is set.
        """
        if self._wants_end is None:
            return work(*arguments, self.ended)
        with ThreadPoolExecutor(1) as pool:
            result = pool.submit(work, *arguments, self.ended)
            try:
                while not wait([result], WATCH_INTERVAL_S).done:
                    self.ends()
            except BaseException:
                self.ended[0] = True  # do not let an error of the watcher, or Ctrl-C, wait for the work
                raise
            return result.result()


class Clock:
    """Seconds spent since the last lap, added up by part of the work."""

    def __init__(self, *parts: str) -> None:
        self.seconds = dict.fromkeys(parts, 0.0)
        self._last = perf_counter()

    def lap(self, part: str) -> None:
        """Add the seconds since the last lap to a part."""
        now = perf_counter()
        self.seconds[part] += now - self._last
        self._last = now
