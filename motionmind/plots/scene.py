"""Where there is room in a picture of an attractor for figures, and how they are joined to what they show."""

from __future__ import annotations

from itertools import pairwise
from math import ceil, floor

import numpy as np

from motionmind._typing import Floats, Int16s, Ints
from motionmind.plots.canvas import Point
from motionmind.render.solids import EMPTY

_GRAIN = 4  # pixels: where there is room is looked for on squares of this size
_FAR = 230.0  # pixels from a figure to what it shows, at most
_TRIED = 1000  # places for a figure


class Room:
    """What is free of a picture, in squares of _GRAIN pixels, and the figures that took some of it.

    Outside the attractor a square is free for all figures; in a cell, beside the trajectories, for that of its posture.
    """

    def __init__(self, width: int, height: int) -> None:
        self.taken = np.zeros((height // _GRAIN, width // _GRAIN), dtype=np.bool_)
        self.cells = np.full(self.taken.shape, EMPTY, dtype=np.int16)
        self.figures = np.zeros_like(self.taken)
        self.leaders: list[Floats] = []

    def take(self, left: float, top: float, right: float, bottom: float) -> None:
        """A box is not free any more."""
        self.taken[self._box(left, top, right, bottom)] = True

    def cover(self, corner: Point, cells: Int16s) -> None:
        """Cells [h, w] are there from a corner on."""
        rows, columns = np.nonzero(cells != EMPTY)
        squares = (rows + int(corner[1])) // _GRAIN, (columns + int(corner[0])) // _GRAIN
        self.taken[squares] = True
        self.cells[squares] = cells[rows, columns]

    def trace(self, points: Floats) -> None:
        """A trajectory passes these points [N, 2]."""
        for a, b in pairwise(points):
            squares = self._along(a, b)
            self.taken[squares], self.cells[squares] = True, EMPTY

    def join(self, corner: Point, width: float, height: float, leader: Floats) -> None:
        """A figure stands in a box, and a leader [2, 2] goes from it to its site."""
        for squares in (self._box(*corner, corner[0] + width, corner[1] + height), self._along(*leader)):
            self.taken[squares], self.cells[squares] = True, EMPTY
        self.figures[self._box(*corner, corner[0] + width, corner[1] + height)] = True
        self.leaders.append(leader)

    def near(self, posture: int, site: Floats, width: float, height: float) -> Point | None:
        """The upper left corner of the box nearest to a posture's site that is free for its figure, and from which a
        leader passes no other figure and crosses no other leader; None where there is none."""
        taken = self.taken & (self.cells != posture)
        wide, high = ceil(width / _GRAIN), ceil(height / _GRAIN)
        sums = np.pad(np.cumsum(np.cumsum(taken, axis=0), axis=1), ((1, 0), (1, 0)))
        free = sums[high:, wide:] - sums[:-high, wide:] - sums[high:, :-wide] + sums[:-high, :-wide] == 0
        rows, columns = np.nonzero(free)
        corners = _GRAIN * np.stack([columns, rows], axis=1).astype(np.float64)
        size = np.array([width, height])
        middles = corners + 0.5 * size
        away = np.linalg.norm(np.clip(site, corners, corners + size) - site, axis=1)
        for n in np.argsort(away, kind="stable")[:_TRIED]:
            if away[n] > _FAR:
                break
            if self.figures[self._along(middles[n], site)].any():
                continue
            if not any(_cross(middles[n], site, *leader) for leader in self.leaders):
                return float(corners[n][0]), float(corners[n][1])
        return None

    def _box(self, left: float, top: float, right: float, bottom: float) -> tuple[slice, slice]:
        rows = slice(max(floor(top / _GRAIN), 0), ceil(bottom / _GRAIN))
        return rows, slice(max(floor(left / _GRAIN), 0), ceil(right / _GRAIN))

    def _along(self, a: Floats, b: Floats) -> tuple[Ints, Ints]:
        """The squares between two points, as rows and columns."""
        share = np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(b - a) / _GRAIN))[:, None]
        columns, rows = np.floor((a + share * (b - a)) / _GRAIN).astype(np.int64).T
        return rows, columns


def _cross(a: Floats, b: Floats, c: Floats, d: Floats) -> bool:
    """Whether the segments from a to b and from c to d cross."""

    def side(p: Floats, q: Floats, r: Floats) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0
