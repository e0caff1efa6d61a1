"""The work that goes into playing phrases: its limit, and what of it need not be done again."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from motionmind.notation.score import Where

MAX_WORK = 600_000  # lines read and postures made while the clips of a score are played; a long score takes 4 a posture
BEGINNING = 2  # what a phrase's beginning counts as: deep calls take several times as long as lines do
LONG = 64  # characters of a line that count as one piece of work

_T = TypeVar("_T")


class Work:
    """The work that goes into playing phrases, and what is remembered of it.

    Attributes:
        done: lines read and postures made, and what beginning phrases counts as.
    """

    def __init__(self) -> None:
        self.done = 0
        self._known: dict[Hashable, Any] = {}
        self._images: dict[tuple[str, int], tuple[Any, Any]] = {}  # by layer and identity, each with its original

    def add(self, amount: int, where: Where) -> None:
        """Count work that is about to be done at a line; FormatError if it is too much."""
        self.done += amount
        if self.done > MAX_WORK:
            raise where.error(f"more than {MAX_WORK} lines and postures are played; repeat less")

    def once(self, key: Hashable, work_out: Callable[[], _T]) -> _T:
        """Return what `work_out` returned for this key the first time."""
        if key not in self._known:
            self._known[key] = work_out()
        found: _T = self._known[key]
        return found

    def image(self, layer: str, what: _T, mirrored: Callable[[str, _T], _T]) -> _T:
        """Return the mirror image of a layer's settings, or of their names; the same object each time."""
        key = layer, id(what)
        if key not in self._images:
            image = mirrored(layer, what)
            self._images[key] = what, image  # what is kept keeps its identity
            self._images[layer, id(image)] = image, what
        found: _T = self._images[key][1]
        return found
