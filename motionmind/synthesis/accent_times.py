"""Accents that a request asks for: their times and their kind."""

from __future__ import annotations

from typing import Literal, NamedTuple

AccentKind = Literal["fast", "still"]


class Accents(NamedTuple):
    """Accents of a movement.

    Attributes:
        seconds: their times [K], from the first frame.
        kind: "fast", the greatest speed, or "still", the least.
    """

    seconds: tuple[float, ...]
    kind: AccentKind
