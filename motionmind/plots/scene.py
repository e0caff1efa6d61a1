"""Free room for figures in a picture of an attractor, and the leaders that join them to their sites."""

from __future__ import annotations

from itertools import pairwise
from math import ceil, floor

import numpy as np

from motionmind._typing import Floats, Int16s, Ints
from motionmind.plots.brush import Point
from motionmind.render.solids import EMPTY

_GRAIN = 4  # side of the squares in which room is counted, pixels
_FAR = 230.0  # greatest distance from a figure to its site, pixels
_TRIED = 1000  # places tried for a figure, at most


class Room:
    """The free room of a picture, in squares of _GRAIN pixels.

    Outside the attractor, a square is free for any figure; in a cell, off the trajectories, for that of its posture.

    Attributes:
        taken: squares that are not free for all figures [h, w].
        cells: the posture whose figure may still use a taken square [h, w]; EMPTY if none.
        figures: squares that figures cover [h, w].
        leaders: the ends of leaders, [2, 2] each, pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self.taken = np.zeros((height // _GRAIN, width // _GRAIN), dtype=np.bool_)
        self.cells = np.full(self.taken.shape, EMPTY, dtype=np.int16)
        self.figures = np.zeros_like(self.taken)
        self.leaders: list[Floats] = []

    def take(self, left: float, top: float, right: float, bottom: float) -> None:
        """Take a box, pixels."""
        self.taken[self._box(left, top, right, bottom)] = True

    def cover(self, corner: Point, cells: Int16s) -> None:
        """Take the attractor's cells [h, w], a posture a pixel, from a corner on, each for its own posture's figure."""
        rows, columns = np.nonzero(cells != EMPTY)
        squares = (rows + int(corner[1])) // _GRAIN, (columns + int(corner[0])) // _GRAIN
        self.taken[squares] = True
        self.cells[squares] = cells[rows, columns]

    def trace(self, points: Floats) -> None:
        """Take the squares along a trajectory [N, 2], pixels."""
        for a, b in pairwise(points):
            squares = self._along(a, b)
            self.taken[squares], self.cells[squares] = True, EMPTY

    def join(self, corner: Point, width: float, height: float, leader: Floats) -> None:
        """Take a box for a figure, and a leader [2, 2] from it to its site, pixels."""
        for squares in (self._box(*corner, corner[0] + width, corner[1] + height), self._along(*leader)):
            self.taken[squares], self.cells[squares] = True, EMPTY
        self.figures[self._box(*corner, corner[0] + width, corner[1] + height)] = True
        self.leaders.append(leader)

    def near(self, posture: int, site: Floats, width: float, height: float) -> Point | None:
        """Find the free box nearest to a posture's site whose leader meets no other figure and no other leader.

        Args:
            posture: the posture's number.
            site: its site in the picture [2], pixels.
            width, height: size of the box, pixels.

        Returns:
            The box's upper left corner, pixels; None if no box is free.
        """
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
        """Return the rows and columns of the squares between two points."""
        share = np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(b - a) / _GRAIN))[:, None]
        columns, rows = np.floor((a + share * (b - a)) / _GRAIN).astype(np.int64).T
        return rows, columns


def _cross(a: Floats, b: Floats, c: Floats, d: Floats) -> bool:
    """Return whether the segments from a to b and from c to d cross."""

    def side(p: Floats, q: Floats, r: Floats) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0
