"""A callback that may stop a search, and a stopwatch for its parts."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from time import perf_counter
from typing import TypeVar

import numpy as np

_Result = TypeVar("_Result")


class Watcher:
    """Asks a callback whether to stop a search, and remembers the answer.

    Attributes:
        stopped: set once the search should stop; compiled code reads it from another thread [1].
    """

    def __init__(self, should_stop: Callable[[], bool] | None) -> None:
        """Take the callback; without one (None) the search never stops early."""
        self.stopped = np.zeros(1, dtype=bool)
        self._should_stop = should_stop

    def wants_stop(self) -> bool:
        """Call the callback unless it has already asked for a stop; return whether the search should stop."""
        if self._should_stop is not None and not self.stopped[0]:
            self.stopped[0] = self._should_stop()
        return bool(self.stopped[0])

    def run(self, work: Callable[..., _Result], *arguments: object) -> _Result:
        """Return `work(*arguments, stopped)`: long compiled work, which should end when `stopped` is set.

        With a callback, run the work in a thread and call the callback every 0.1 s.
        """
        if self._should_stop is None:
            return work(*arguments, self.stopped)
        with ThreadPoolExecutor(1) as pool:
            result = pool.submit(work, *arguments, self.stopped)
            try:
                while not wait([result], timeout=0.1).done:
                    self.wants_stop()
            except BaseException:
                self.stopped[0] = True  # after Ctrl-C or an error of the callback, do not wait for the work
                raise
            return result.result()


class Stopwatch:
    """Adds up the seconds between laps, by part of the work."""

    def __init__(self, *parts: str) -> None:
        self.seconds = dict.fromkeys(parts, 0.0)
        self._last = perf_counter()

    def lap(self, part: str) -> None:
        """Add the seconds since the last lap to a part."""
        now = perf_counter()
        self.seconds[part] += now - self._last
        self._last = now
