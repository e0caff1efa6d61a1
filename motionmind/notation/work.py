"""The work of playing phrases: its limit, and a cache of repeated work."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from motionmind.notation.score import Where

MAX_WORK = 600_000  # lines and postures per score; a long score takes 4 per posture
N_WORK_PER_CALL = 2  # deep calls take several times as long as lines
N_CHARS_PER_WORK = 64  # long lines count as several

_T = TypeVar("_T")


class Work:
    """The work of playing phrases, and a cache of it.

    Attributes:
        done: lines read, postures made and phrases called, weighted.
    """

    def __init__(self) -> None:
        self.done = 0
        self._known: dict[Hashable, Any] = {}
        self._images: dict[tuple[str, int], tuple[Any, Any]] = {}  # by layer and identity, each with its original

    def add(self, amount: int, where: Where) -> None:
        """Add the work of a line; FormatError if it exceeds the limit."""
        self.done += amount
        if self.done > MAX_WORK:
            raise where.error(f"more than {MAX_WORK} lines and postures to play; repeat less")

    def once(self, key: Hashable, compute: Callable[[], _T]) -> _T:
        """Return the cached result of `compute` for a key; compute it if missing."""
        if key not in self._known:
            self._known[key] = compute()
        found: _T = self._known[key]
        return found

    def image(self, layer: str, original: _T, mirror: Callable[[str, _T], _T]) -> _T:
        """Return the mirror image of a layer's settings, or of their names; the same object each time."""
        key = layer, id(original)
        if key not in self._images:
            image = mirror(layer, original)
            self._images[key] = original, image  # the reference keeps the id valid
            self._images[layer, id(image)] = image, original
        found: _T = self._images[key][1]
        return found
