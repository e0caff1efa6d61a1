"""The memory that a process takes for itself, as it goes up and down."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from types import TracebackType

_EVERY = 0.02  # seconds


class Memory:
    """Watches how much memory this process takes for itself; the pages of files that it maps do not count.

    Attributes:
        most: the most since the context began, MB.
    """

    def __init__(self) -> None:
        self.most = 0.0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Memory:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.most = max(self.most, own_memory())
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while True:
            self.most = max(self.most, own_memory())
            if self._ended.wait(_EVERY):
                return


def own_memory() -> float:
    """Return how much memory this process takes for itself now, MB."""
    found = re.search(r"RssAnon:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return float(found[1]) / 1024.0 if found else 0.0
