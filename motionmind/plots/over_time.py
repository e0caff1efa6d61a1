"""Curves over time: panels one below the other on one axis of seconds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Floats
from motionmind.plots.marks import Line, Mark, Words
from motionmind.plots.symbols import TEXT_PX, TICK_PX, round_numbers
from motionmind.render.palette import PLOT

N_POINTS = 1200  # of a curve, at most: as many as the picture has columns


@dataclass(frozen=True)
class TimeAxis:
    """An axis of seconds below panels.

    Attributes:
        times: the times of the frames [T], increasing, two or more.
        width: width of the picture, pixels.
        left, right: margins beside the curves.
        top: upper edge of the first panel.
    """

    times: Floats
    width: float
    left: float
    right: float
    top: float

    @property
    def end(self) -> float:
        """The right end of the axis, pixels."""
        return self.width - self.right

    def x(self, at: Floats) -> Floats:
        """Return the x of some times [N], pixels."""
        first, last = self.times[[0, -1]]
        return np.asarray(self.left + (at - first) / (last - first) * (self.end - self.left))

    def thinned(self, values: Floats) -> tuple[Floats, Floats]:
        """Return where stretches of frames begin, N_POINTS at most, and the maximum of values [T] in each."""
        starts = np.arange(0, len(values), -(-len(values) // N_POINTS))
        return self.times[starts], np.maximum.reduceat(values, starts)

    def marks(self, bottom: float) -> Iterator[Mark]:
        """Yield the axis, with a faint line at each round number of seconds."""
        ticks = round_numbers(float(self.times[0]), float(self.times[-1]))
        for tick, x in zip(ticks.tolist(), self.x(ticks).tolist(), strict=True):
            yield Line(np.array([[x, self.top], [x, bottom]]), PLOT.grid, 0.8)
            yield Words((x, bottom + 16.0), f"{tick:g}", TICK_PX, PLOT.pale, "middle")
        yield Line(np.array([[self.left, bottom], [self.end, bottom]]), PLOT.edge, 0.8)
        yield Words((self.end, bottom + 34.0), "seconds", TEXT_PX, PLOT.pale, "end")
