"""Free room in plots: for figures, with the leaders that join them to their sites, and for labels."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, floor

import numpy as np

from motionmind._typing import Floats, Int16s, Ints
from motionmind.plots.brush import Point
from motionmind.render.solids import EMPTY_CODE

_SQUARE_PX = 4  # side of the squares in which room is counted


class Room:
    """The free room of a picture, in squares of _SQUARE_PX pixels.

    Outside the attractor, a square is free for any figure; in a cell, off the trajectories, for that of its posture.

    Attributes:
        taken: squares that are not free for all figures [h, w].
        cells: the posture whose figure may still use a taken square [h, w]; EMPTY if none.
        figures: squares that figures cover [h, w].
        leaders: the ends of leaders, [2, 2] each, pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self.taken = np.zeros((height // _SQUARE_PX, width // _SQUARE_PX), dtype=np.bool_)
        self.cells = np.full(self.taken.shape, EMPTY_CODE, dtype=np.int16)
        self.figures = np.zeros_like(self.taken)
        self.leaders: list[Floats] = []

    def take(self, left: float, top: float, right: float, bottom: float) -> None:
        """Take a box, pixels."""
        self.taken[self._box(left, top, right, bottom)] = True

    def cover(self, corner: Point, cells: Int16s) -> None:
        """Take the attractor's cells [h, w], one posture a pixel, from a corner on; each stays free for its posture."""
        rows, columns = np.nonzero(cells != EMPTY_CODE)
        squares = (rows + int(corner[1])) // _SQUARE_PX, (columns + int(corner[0])) // _SQUARE_PX
        self.taken[squares] = True
        self.cells[squares] = cells[rows, columns]

    def trace(self, points: Floats) -> None:
        """Take the squares along a trajectory [N, 2], pixels."""
        for a, b in pairwise(points):
            squares = self._along(a, b)
            self.taken[squares], self.cells[squares] = True, EMPTY_CODE

    def join(self, corner: Point, width: float, height: float, leader: Floats) -> None:
        """Take a box for a figure, and a leader [2, 2] from it to its site, pixels."""
        for squares in (self._box(*corner, corner[0] + width, corner[1] + height), self._along(*leader)):
            self.taken[squares], self.cells[squares] = True, EMPTY_CODE
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
        wide, high = ceil(width / _SQUARE_PX), ceil(height / _SQUARE_PX)
        sums = np.pad(np.cumsum(np.cumsum(taken, axis=0), axis=1), ((1, 0), (1, 0)))
        free = sums[high:, wide:] - sums[:-high, wide:] - sums[high:, :-wide] + sums[:-high, :-wide] == 0
        rows, columns = np.nonzero(free)
        corners = _SQUARE_PX * np.stack([columns, rows], axis=1).astype(np.float64)
        size = np.array([width, height])
        middles = corners + 0.5 * size
        away = np.linalg.norm(np.clip(site, corners, corners + size) - site, axis=1)
        for n in np.argsort(away, kind="stable")[:1000]:
            if away[n] > 230.0:  # pixels
                break
            if self.figures[self._along(middles[n], site)].any():
                continue
            if not any(_cross(middles[n], site, *leader) for leader in self.leaders):
                return float(corners[n][0]), float(corners[n][1])
        return None

    def _box(self, left: float, top: float, right: float, bottom: float) -> tuple[slice, slice]:
        rows = slice(max(floor(top / _SQUARE_PX), 0), ceil(bottom / _SQUARE_PX))
        return rows, slice(max(floor(left / _SQUARE_PX), 0), ceil(right / _SQUARE_PX))

    def _along(self, a: Floats, b: Floats) -> tuple[Ints, Ints]:
        """Return the rows and columns of the squares between two points."""
        share = np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(b - a) / _SQUARE_PX))[:, None]
        columns, rows = np.floor((a + share * (b - a)) / _SQUARE_PX).astype(np.int64).T
        return rows, columns


class Labels:
    """Room for labels among circles: no label covers a circle or another label."""

    def __init__(self, centres: Floats, radii: Floats | float) -> None:
        """Place no label yet.

        Args:
            centres: centres of the circles [N, 2], pixels.
            radii: their radii [N, 1], or the one of all, pixels.
        """
        self._boxes = np.concatenate([centres - radii, centres + radii], axis=1)  # left, top, right, bottom

    def place(self, candidates: Sequence[Point], width: float, half: float) -> Point | None:
        """Take the first free place for a label.

        Args:
            candidates: places to try, each the middle of the label's left edge, pixels.
            width, half: width and half the height of the label, pixels.

        Returns:
            The place; None if none is free.
        """
        for left, middle in candidates:
            box = np.array([left, middle - half, left + width, middle + half])
            covered = (self._boxes[:, :2] < box[2:]).all(axis=1) & (self._boxes[:, 2:] > box[:2]).all(axis=1)
            if not covered.any():
                self._boxes = np.concatenate([self._boxes, box[None]])
                return float(left), float(middle)
        return None


def _cross(a: Floats, b: Floats, c: Floats, d: Floats) -> bool:
    """Return whether the segments from a to b and from c to d cross."""

    def side(p: Floats, q: Floats, r: Floats) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0
