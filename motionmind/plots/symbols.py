"""The colours and the signs of a picture of an attractor, and the numbers on its axes."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor, log10

import numpy as np

from motionmind._typing import Floats
from motionmind.plots.canvas import Colour, Dot, Mark, Point, mixed
from motionmind.render.ground import PAPER

# Far from each other to every eye, and none of the body's own or of what marks insertions.
PIECE: Colour = (0, 112, 120)
OTHER: Colour = (206, 112, 0)
INK: Colour = (34, 30, 34)
PALE: Colour = (110, 106, 104)
EDGE: Colour = (158, 151, 144)
LETTERS, SMALL = 13, 10  # heights of letters, pixels
_CELL: Colour = (240, 237, 232)


def tint(times: int) -> Colour:
    """The colour of a cell that the variation visits so many times."""
    return mixed(OTHER, min(0.07 + 0.08 * times, 0.4), _CELL) if times else _CELL


def site(at: Point, radius: float, title: str = "") -> Dot:
    """Where a posture of the piece lies."""
    return Dot(at, radius, PIECE, PAPER, 0.3 * radius, title)


def reading(at: Point, radius: float, title: str = "") -> Dot:
    """Where the variation is read, and goes on as the piece does."""
    return Dot(at, radius, OTHER, PAPER, 0.2 * radius, title)


def jump(at: Point, radius: float, title: str = "") -> Dot:
    """Where it is read after a jump."""
    return Dot(at, radius, PAPER, OTHER, 0.4 * radius, title)


def parting(at: Point, radius: float) -> Iterator[Mark]:
    """Where it is no longer the piece."""
    yield Dot(at, radius, PAPER, INK, 1.6)
    yield Dot(at, 0.4 * radius, OTHER, OTHER)


def round_numbers(low: float, high: float) -> Floats:
    """About six multiples of 1, 2 or 5 and a power of ten, from low to high."""
    rough = (high - low) / 6.0
    power = 10.0 ** floor(log10(rough))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= rough)
    return np.asarray(step * np.arange(ceil(low / step), floor(high / step) + 1))


def pair(at: Floats) -> Point:
    """A place as a plate has it."""
    return float(at[0]), float(at[1])
