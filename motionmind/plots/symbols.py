"""The symbols of an attractor's picture, and the numbers on axes."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor, log10

import numpy as np

from motionmind._typing import Floats
from motionmind.body.palette import Colour
from motionmind.plots.brush import Point, mixed
from motionmind.plots.marks import Dot, Mark
from motionmind.render.palette import INK, PAPER, PLOT

TEXT_PX, TICK_PX = 13, 10  # heights of letters: of text, and of numbers on axes


def tint(times: int) -> Colour:
    """Return the colour of a cell that the variation visits `times` times."""
    return mixed(PLOT.variation, min(0.07 + 0.08 * times, 0.4), PLOT.cell) if times else PLOT.cell


def site(at: Point, radius: float, title: str = "") -> Dot:
    """Mark a site, the point of one of the piece's postures."""
    return Dot(at, radius, PLOT.piece, PAPER, 0.3 * radius, title)


def point(at: Point, radius: float, title: str = "") -> Dot:
    """Mark a point of the variation at which it continues as the piece does."""
    return Dot(at, radius, PLOT.variation, PAPER, 0.2 * radius, title)


def jump(at: Point, radius: float, title: str = "") -> Dot:
    """Mark a point of the variation to which it jumps."""
    return Dot(at, radius, PAPER, PLOT.variation, 0.4 * radius, title)


def parting(at: Point, radius: float) -> Iterator[Mark]:
    """Mark the point where the variation parts from the piece."""
    yield Dot(at, radius, PAPER, INK, 1.6)
    yield Dot(at, 0.4 * radius, PLOT.variation, PLOT.variation)


def round_numbers(low: float, high: float) -> Floats:
    """Choose about six round numbers [N] from low to high: multiples of 1, 2 or 5 times a power of ten."""
    rough = (high - low) / 6.0
    power = 10.0 ** floor(log10(rough))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= rough)
    return np.asarray(step * np.arange(ceil(low / step), floor(high / step) + 1))
