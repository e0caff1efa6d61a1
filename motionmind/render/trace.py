"""From samples to lines: outlines of regions and ridges of depth, smoothed.

A line first runs exactly along the edges of samples. An edge shows only that the line passes between two samples, so
the smooth line passes within half a sample of each edge (the constraint of Gibson, "Constrained elastic surface nets",
MICCAI 1998).

Points are x, y in samples, y down. A region lies to the right of its outline, so areas of regions are positive.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from motionmind._typing import Bools, Floats, Indices, Int16s, Singles
from motionmind.jit import jit
from motionmind.render.solids import EMPTY_CODE

_FAINT_RATIO = 0.5  # of the step at which a ridge begins: it ends where it stands out by less
_N_SLACK_SAMPLES = 0.5  # greatest distance of a smooth line from the middle of an edge


@dataclass(frozen=True, eq=False)
class Lines:
    """K lines with N points in all.

    Attributes:
        points: x and y of the points of all lines, one line after another [N, 2], samples.
        starts: index of the first point of each line, and N [K + 1].
        labels: label of the region that each line bounds [K].
        closed: whether each line returns to its first point, which is not repeated [K].
    """

    points: Floats
    starts: Indices
    labels: Indices
    closed: Bools

    def areas(self) -> Floats:
        """Compute the area within each line [K], square samples; negative for a hole, 0 for an open line."""
        after = np.arange(1, len(self.points) + 1)
        after[self.starts[1:] - 1] = self.starts[:-1]
        x, y = self.points.T
        twice = np.add.reduceat(x * y[after] - x[after] * y, self.starts[:-1]) if len(self.labels) else np.zeros(0)
        return np.asarray(np.where(self.closed, 0.5 * twice, 0.0))

    def lengths(self) -> Indices:
        """Count the points of each line [K]."""
        return np.diff(self.starts)

    def one(self, number: int) -> Lines:
        """Select one line by its number."""
        first, end = self.starts[number : number + 2]
        alone = slice(number, number + 1)
        return Lines(self.points[first:end], np.array([0, end - first]), self.labels[alone], self.closed[alone])

    def only(self, which: Bools) -> Lines:
        """Select the lines flagged in `which` [K]."""
        lengths = self.lengths()
        starts = np.concatenate([[0], np.cumsum(lengths[which])])
        return Lines(self.points[np.repeat(which, lengths)], starts, self.labels[which], self.closed[which])


def outlines(labels: Int16s) -> Lines:
    """Trace the regions of equal labels [H, W], except EMPTY, along the edges of samples."""
    return Lines(*_outlines(np.pad(labels, 1, constant_values=EMPTY_CODE)))


def ridges(parts: Int16s, depth: Singles, step: float) -> Lines:
    """Trace the edges where samples stand before those of another body part by more than `step`.

    A line continues where they stand out by half of that, so it does not break up where a limb leaves the trunk. Its
    label is the body part at its start.

    Args:
        parts: the body part that each sample shows [H, W]; EMPTY where none, behind all parts.
        depth: how near each sample is [H, W].
        step: a difference of `depth`.
    """
    parts, depth = np.pad(parts, 1, constant_values=EMPTY_CODE), np.pad(depth, 1, constant_values=-np.inf)
    return Lines(*_ridges(parts, depth, step))


def smooth(lines: Lines) -> Lines:
    """Smooth lines along the edges of samples, by half a sample at most; open lines keep their ends."""
    firsts, ends = lines.starts[:-1], lines.starts[1:] - 1
    after = np.arange(1, len(lines.points) + 1)
    after[ends] = np.where(lines.closed, firsts, ends)
    middles = 0.5 * (lines.points + lines.points[after])
    loose = firsts[~lines.closed]
    middles[loose] = lines.points[loose]
    points = middles.copy()
    _relax(points, lines.starts, lines.closed)
    shrinkage = middles - points  # the stairs, and the shrinkage of round shapes; smoothing leaves the latter
    _relax(shrinkage, lines.starts, lines.closed)
    return replace(lines, points=np.clip(points + shrinkage, middles - _N_SLACK_SAMPLES, middles + _N_SLACK_SAMPLES))


# Directions are 0 right, 1 down, 2 left, 3 up. Side `to` of a sample is the edge that runs in that direction with the
# sample to its right: 0 is its upper edge.
_X, _Y = np.array([1, 0, -1, 0]), np.array([0, 1, 0, -1])  # a step in each direction
_CORNER_X, _CORNER_Y = np.array([0, 1, 1, 0]), np.array([0, 0, 1, 1])  # where each side begins, in its sample


# The kernels take samples with a border of one sample, so all have neighbours.


@jit
def _outlines(labels: Int16s) -> tuple[Floats, Indices, Indices, Bools]:
    """Return the fields of Lines; regions touch at sides of samples, not at corners."""
    height, width = labels.shape
    known = np.zeros((height, width), dtype=np.bool_)  # upper sides that are part of a line already
    xs, ys = [0.0 for _ in range(0)], [0.0 for _ in range(0)]
    starts, names = [0], [0 for _ in range(0)]
    for row in range(1, height - 1):
        for column in range(1, width - 1):
            label = labels[row, column]
            if label < 0 or labels[row - 1, column] == label or known[row, column]:
                continue
            x, y, to = column, row, 0
            while to != 0 or not known[y, x]:
                known[y, x] |= to == 0
                xs.append(x - 1.0 + _CORNER_X[to])
                ys.append(y - 1.0 + _CORNER_Y[to])
                if labels[y + _Y[to], x + _X[to]] != label:
                    to = (to + 1) % 4
                    continue
                x, y = x + _X[to], y + _Y[to]
                left = (to + 3) % 4
                if labels[y + _Y[left], x + _X[left]] == label:
                    x, y, to = x + _X[left], y + _Y[left], left
            starts.append(len(xs))
            names.append(int(np.intp(label)))
    return np.stack((np.array(xs), np.array(ys)), 1), np.array(starts), np.array(names), np.ones(len(names)) > 0.0


@jit
def _ridges(parts: Int16s, depth: Singles, step: float) -> tuple[Floats, Indices, Indices, Bools]:
    """Return the fields of Lines. A line continues along its own body part if it can, otherwise along any."""
    height, width = parts.shape
    rises = np.zeros((height, width, 4), dtype=np.float32)  # how far each side's sample stands before its neighbour
    number = np.empty((height, width, 4), dtype=np.int32)  # of each side that may be part of a line
    sides = [(0, 0, 0) for _ in range(0)]
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            for to in range(4):
                other = y - _X[to], x + _Y[to]
                if parts[y, x] != parts[other]:
                    rises[y, x, to] = depth[y, x] - depth[other]
                    if rises[y, x, to] > _FAINT_RATIO * step:
                        number[y, x, to] = len(sides)
                        sides.append((x, y, to))
    before, after, best = np.full(len(sides), -1), np.full(len(sides), -1), np.zeros(len(sides))
    for side, (x, y, to) in enumerate(sides):
        then_x, then_y, turned = _next(parts, rises, x, y, to, step)
        if turned >= 0:
            then = number[then_y, then_x, turned]
            score = 1 + 2 * int(rises[y, x, to] > step) + int(parts[y, x] == parts[then_y, then_x])
            if score > best[then]:
                before[then], best[then] = side, score
    for side in range(len(sides)):
        if before[side] >= 0:
            after[before[side]] = side
    known = np.zeros(len(sides), dtype=np.bool_)
    xs, ys = [0.0 for _ in range(0)], [0.0 for _ in range(0)]
    starts, names, closed = [0], [0 for _ in range(0)], [False for _ in range(0)]
    for whole in (False, True):  # first the open lines, then the closed ones
        for first in range(len(sides)):
            if known[first] or (before[first] >= 0 and not whole):
                continue
            side, most = first, 0.0
            x, y, to = sides[first]
            names.append(int(np.intp(parts[y, x])))
            while side >= 0 and not known[side]:
                known[side] = True
                x, y, to = sides[side]
                xs.append(x - 1.0 + _CORNER_X[to])
                ys.append(y - 1.0 + _CORNER_Y[to])
                most = max(most, rises[y, x, to])
                side = after[side]
            if not whole:
                xs.append(xs[-1] + _X[to])
                ys.append(ys[-1] + _Y[to])
            if most > step:
                starts.append(len(xs))
                closed.append(whole)
            else:
                del xs[starts[-1] :], ys[starts[-1] :], names[-1:]
    return np.stack((np.array(xs), np.array(ys)), 1), np.array(starts), np.array(names), np.array(closed)


@jit
def _next(parts: Int16s, rises: Singles, x: int, y: int, to: int, step: float) -> tuple[int, int, int]:
    """Find the side that continues a side, or direction -1: one of the same body part, unless only that is faint."""
    following, best, left = (x, y, -1), 0, (to + 3) % 4
    ahead_x, ahead_y = x + _X[to], y + _Y[to]
    for then in ((x, y, (to + 1) % 4), (ahead_x, ahead_y, to), (ahead_x + _X[left], ahead_y + _Y[left], left)):
        rise = rises[then[1], then[0], then[2]]
        if rise > _FAINT_RATIO * step:
            score = 1 + 2 * int(rise > step) + int(parts[then[1], then[0]] == parts[y, x])
            if score > best:
                following, best = then, score
    return following


@jit
def _relax(points: Floats, starts: Indices, closed: Bools) -> None:
    """Move each point repeatedly towards the middle of its neighbours, in place, by _SLACK_SAMPLES at most in all."""
    anchors = points.copy()
    for line in range(len(closed)):
        first, end = starts[line], starts[line + 1]
        loose = 0 if closed[line] else 1
        for _ in range(30):
            for at in range(first + loose, end - loose):
                before, after = at - 1 if at > first else end - 1, at + 1 if at + 1 < end else first
                for axis in range(2):
                    target = 0.25 * (points[before, axis] + points[after, axis]) + 0.5 * points[at, axis]
                    points[at, axis] = min(
                        max(target, anchors[at, axis] - _N_SLACK_SAMPLES), anchors[at, axis] + _N_SLACK_SAMPLES
                    )
