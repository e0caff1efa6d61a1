"""Windows to fill: a bounded number of each family of takes and length, the same for all methods."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from experiments.inbetween.run import GIVEN, MOVING_EVERY, STRIDE, Window, windows_of
from experiments.material import FPS, movement

POSTURES, MOVING = GIVEN[0], GIVEN[2]
T = TypeVar("T")


class Case(NamedTuple):
    """A window, and what is known of it.

    Attributes:
        given: "two postures" or "moving ends".
        family: the first take of its family.
        take: its take.
        piece: the number of the unbroken piece of the take.
        start: its first frame in that piece.
        frames: steps from its first frame to its last.
    """

    given: str
    family: str
    take: str
    piece: int
    start: int
    frames: int

    @property
    def seconds(self) -> float:
        return self.frames / FPS


def cases_of(
    data: str | None, name: str, families: Iterable[Sequence[str]], gaps: Sequence[float], count: int
) -> list[Case]:
    """Choose at most `count` windows of each family and length, evenly spread over all that begin 0.2 s apart.

    Every second window that has frames enough on both sides is filled again with moving ends.
    """
    out = []
    for takes in families:
        for gap in gaps:
            frames = round(gap * FPS)
            places = spread(windows_of(data, name, takes, frames, STRIDE), count)
            cases = [Case(POSTURES, takes[0], *place, frames) for place in places]
            surrounded = [case for case in cases if window_of(data, name, case).surrounded]
            out += cases + [case._replace(given=MOVING) for case in surrounded[::MOVING_EVERY]]
    return out


def spread(items: Sequence[T], count: int) -> list[T]:
    """Choose `count` items at even distances, or all if there are fewer."""
    if len(items) <= count:
        return list(items)
    return [items[k] for k in np.linspace(0, len(items) - 1, count).round().astype(int)]


def window_of(data: str | None, name: str, case: Case) -> Window:
    pieces = movement(data, name, case.frames)[case.take]
    return Window(pieces[case.piece], case.start, case.frames)


def key_of(cases: Sequence[Case]) -> str:
    """Name a set of cases, so that only results for the same windows are compared."""
    return hashlib.sha256(repr([tuple(case) for case in cases]).encode()).hexdigest()[:10]
