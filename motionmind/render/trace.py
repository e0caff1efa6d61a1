"""From a picture's samples to curves: the outlines of its regions, smooth, and as few numbers as draw them.

An outline first runs along the edges of samples, and is exact. An edge lies between two samples, and that is all that
is known of where the line passes; so, of the lines that pass each edge no farther than half a sample away, a smooth one
is taken (the constraint of Gibson's "Constrained elastic surface nets", MICCAI 1998). It becomes a quadratic
B-spline, which SVG can write as the middles of its control polygon's sides alone: each control point is the one before
mirrored at the middle between them, which is what the command `t` stands for.

Points are x, y in samples, y down; a region lies to the right of its outline, so that the area within counts above 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Bools, Floats, Indices, Int16s, Singles
from motionmind.jit import jit
from motionmind.render.solids import EMPTY

_FAINT = 0.5  # of a step: lines end where what they run along stands out by less
_SLACK = 0.5  # samples: how far a smooth line may pass from the middle of an edge
_PASSES = 30  # of smoothing
_STRAIGHT = 40.0  # samples between the points of a spline where it is straight
_CURVED, _BENT = 0.06, 0.2  # and where it bends: points a sample, squared, for its curvature and for that squared
_AROUND = 6  # samples before and after a place that tell how it bends there
_SWEEPS = 4  # after as many the control points are right to a hundredth


@dataclass(frozen=True, eq=False)
class Lines:
    """K lines, one after another.

    Attributes:
        points: their points [N, 2].
        starts: where among them each begins, and N [K + 1].
        labels: which region each one bounds [K].
        closed: whether each returns to its first point, which is not repeated [K].
    """

    points: Floats
    starts: Indices
    labels: Indices
    closed: Bools

    def areas(self) -> Floats:
        """The area within each [K]; below 0 for a hole, 0 for a line that is not closed."""
        after = np.arange(1, len(self.points) + 1)
        after[self.starts[1:] - 1] = self.starts[:-1]
        x, y = self.points.T
        twice = np.add.reduceat(x * y[after] - x[after] * y, self.starts[:-1]) if len(self.labels) else np.zeros(0)
        return np.asarray(np.where(self.closed, 0.5 * twice, 0.0))

    def lengths(self) -> Indices:
        """How many points each has [K]."""
        return np.diff(self.starts)

    def only(self, which: Bools) -> Lines:
        """Those of them that are flagged [K]."""
        lengths = self.lengths()
        starts = np.concatenate([[0], np.cumsum(lengths[which])])
        return Lines(self.points[np.repeat(which, lengths)], starts, self.labels[which], self.closed[which])


def outlines(labels: Int16s) -> Lines:
    """The outlines of the regions of samples [H, W] of one label, but for EMPTY, along the edges of samples."""
    return Lines(*_outlines(np.pad(labels, 1, constant_values=EMPTY)))


def ridges(parts: Int16s, depth: Singles, step: float) -> Lines:
    """Where samples [H, W] stand before those of another part by more than `step`, along their edges.

    A line goes on where they stand before them by less, down to half of it: so it does not break up where a limb comes
    out of a body. Its label is the part that it begins with.

    Args:
        parts: which part each shows; EMPTY where there is nothing, before which all else stands.
        depth: how near each is.
        step: in the unit of `depth`.
    """
    parts, depth = np.pad(parts, 1, constant_values=EMPTY), np.pad(depth, 1, constant_values=-np.inf)
    return Lines(*_ridges(parts, depth, step))


def smooth(lines: Lines) -> Lines:
    """Lines along the edges of samples, drawn smooth, half a sample off them at most.

    Lines that are not closed keep their ends.
    """
    firsts, ends = lines.starts[:-1], lines.starts[1:] - 1
    after = np.arange(1, len(lines.points) + 1)
    after[ends] = np.where(lines.closed, firsts, ends)
    middles = 0.5 * (lines.points + lines.points[after])
    loose = firsts[~lines.closed]
    middles[loose] = lines.points[loose]
    points = middles.copy()
    _relax(points, lines.starts, lines.closed)
    lost = middles - points  # the steps, and what was round and has shrunk; smooth, it is the latter
    _relax(lost, lines.starts, lines.closed)
    return replace(lines, points=np.clip(points + lost, middles - _SLACK, middles + _SLACK))


def path(lines: Lines, scale: float, start: NDArray[np.integer] | tuple[int, int] = (0, 0)) -> str:
    """Smooth lines as the data of one of SVG's paths, in whole numbers: `scale` to a sample, from `start` (x, y) on."""
    knots, starts = _knots(lines.points, lines.starts, lines.closed)
    points = np.rint(knots * (0.5 * scale)).astype(np.intp) * 2  # even, so that their middles are whole
    text, pen = [], -np.asarray(start, dtype=np.intp)
    for first, end, closed in zip(starts[:-1], starts[1:], lines.closed, strict=True):
        control = points[first:end]
        middles = (control + np.roll(control, -1, axis=0)) // 2
        on = middles[np.r_[-1, : len(middles)]] if closed else np.r_[control[:1], middles[1:-2], control[-1:]]
        steps = np.diff(on, axis=0, prepend=pen[None]).ravel().tolist()
        turn = (control[0 if closed else 1] - on[0]).tolist()
        more = "t" + "%+d" * (len(steps) - 4) if len(steps) > 4 else ""
        text.append(("m%+d%+dq%+d%+d%+d%+d" + more) % (*steps[:2], *turn, *steps[2:]))
        pen = on[-1]
    return "".join(text)


# Directions are 0 right, 1 down, 2 left, 3 up. The side `to` of a sample is the edge that runs in that direction with
# the sample to its right: 0 is its upper edge.
_X, _Y = np.array([1, 0, -1, 0]), np.array([0, 1, 0, -1])  # a step in each direction
_CORNER_X, _CORNER_Y = np.array([0, 1, 1, 0]), np.array([0, 0, 1, 1])  # where each side begins, in its sample


# The kernels take samples with a frame of one sample around them, so that all of them have neighbours.


@jit
def _outlines(labels: Int16s) -> tuple[Floats, Indices, Indices, Bools]:
    """The fields of Lines; regions meet at sides of samples, not at corners."""
    height, width = labels.shape
    known = np.zeros((height, width), dtype=np.bool_)  # upper sides that are on a line already
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
    """The fields of Lines. A line goes on with the part it is of where it can, and else with any."""
    height, width = parts.shape
    rises = np.zeros((height, width, 4), dtype=np.float32)  # how far each side's sample stands before that beyond it
    number = np.empty((height, width, 4), dtype=np.int32)  # of each side that may be on a line
    sides = [(0, 0, 0) for _ in range(0)]
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            for to in range(4):
                other = y - _X[to], x + _Y[to]
                if parts[y, x] != parts[other]:
                    rises[y, x, to] = depth[y, x] - depth[other]
                    if rises[y, x, to] > _FAINT * step:
                        number[y, x, to] = len(sides)
                        sides.append((x, y, to))
    before, after, best = np.full(len(sides), -1), np.full(len(sides), -1), np.zeros(len(sides))
    for side, (x, y, to) in enumerate(sides):
        then_x, then_y, turned = _next(parts, rises, x, y, to, step)
        if turned >= 0:
            then = number[then_y, then_x, turned]
            worth = 1 + 2 * int(rises[y, x, to] > step) + int(parts[y, x] == parts[then_y, then_x])
            if worth > best[then]:
                before[then], best[then] = side, worth
    for side in range(len(sides)):
        if before[side] >= 0:
            after[before[side]] = side
    known = np.zeros(len(sides), dtype=np.bool_)
    xs, ys = [0.0 for _ in range(0)], [0.0 for _ in range(0)]
    starts, names, closed = [0], [0 for _ in range(0)], [False for _ in range(0)]
    for whole in (False, True):  # first the lines that begin somewhere; the others are closed
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
    """The side that goes on where one ends, or direction -1; of the same part, unless it alone is faint."""
    found, best, left = (x, y, -1), 0, (to + 3) % 4
    ahead_x, ahead_y = x + _X[to], y + _Y[to]
    for then in ((x, y, (to + 1) % 4), (ahead_x, ahead_y, to), (ahead_x + _X[left], ahead_y + _Y[left], left)):
        rise = rises[then[1], then[0], then[2]]
        if rise > _FAINT * step:
            worth = 1 + 2 * int(rise > step) + int(parts[then[1], then[0]] == parts[y, x])
            if worth > best:
                found, best = then, worth
    return found


@jit
def _relax(points: Floats, starts: Indices, closed: Bools) -> None:
    """Move each point towards the middle of its neighbours, again and again, but by _SLACK at most."""
    tied = points.copy()
    for line in range(len(closed)):
        first, end = starts[line], starts[line + 1]
        loose = 0 if closed[line] else 1
        for _ in range(_PASSES):
            for at in range(first + loose, end - loose):
                before, after = at - 1 if at > first else end - 1, at + 1 if at + 1 < end else first
                for axis in range(2):
                    wish = 0.25 * (points[before, axis] + points[after, axis]) + 0.5 * points[at, axis]
                    points[at, axis] = min(max(wish, tied[at, axis] - _SLACK), tied[at, axis] + _SLACK)


@jit
def _knots(points: Floats, starts: Indices, closed: Bools) -> tuple[Floats, Indices]:
    """Control points of quadratic B-splines through points of lines, and where those of each line begin.

    The more a line bends, the closer they are.
    """
    knots = np.empty((2 * len(points) + 6 * len(closed), 2))
    firsts = np.zeros(len(starts), dtype=np.intp)
    for line in range(len(closed)):
        one = points[starts[line] : starts[line + 1]]
        whole = closed[line]
        spread = _spread(one, whole)
        many = max(int(np.ceil(spread[-1])), 6 if whole else 1)
        count = many if whole else many + 1
        through = np.empty((count, 2))
        at = 0
        for number in range(count):
            wanted = spread[-1] * number / many
            while at + 2 < len(spread) and spread[at + 1] < wanted:
                at += 1
            share = min((wanted - spread[at]) / max(spread[at + 1] - spread[at], 1e-12), 1.0)
            through[number] = one[at] + share * (one[(at + 1) % len(one)] - one[at])
        control = through.copy()
        for _ in range(_SWEEPS):  # towards (before + 6 control + after) / 8 = through, which is where the spline passes
            for number in range(0 if whole else 1, count if whole else count - 1):
                before, after = control[number - 1], control[(number + 1) % count]
                control[number] = (8.0 * through[number] - before - after) / 6.0
        firsts[line + 1] = firsts[line] + count
        knots[firsts[line] : firsts[line + 1]] = control
    return knots[: firsts[-1]], firsts


@jit
def _spread(one: Floats, whole: bool) -> Floats:
    """How many points of a spline a line takes from its beginning to each of its points, and to its end."""
    count = len(one)
    sides = count if whole else count - 1
    bends = np.empty(sides)
    for at in range(sides):
        a, b, c = at - _AROUND, at, at + _AROUND
        if whole:
            a, c = a % count, c % count
        else:
            a, b, c = max(a, 0), at, min(c, count - 1)
        first, second = one[b] - one[a], one[c] - one[b]
        turn = abs(np.arctan2(first[0] * second[1] - first[1] * second[0], first[0] * second[0] + first[1] * second[1]))
        length = 0.5 * (np.hypot(first[0], first[1]) + np.hypot(second[0], second[1]))
        bend = turn / max(length, 1e-12)
        bends[at] = np.sqrt(_BENT * bend * bend + _CURVED * bend + 1.0 / _STRAIGHT**2)
    spread = np.zeros(sides + 1)
    for at in range(sides):
        density = 0.0
        for near in range(at - _AROUND, at + _AROUND + 1):
            density += bends[near % sides if whole else min(max(near, 0), sides - 1)] / (2 * _AROUND + 1)
        ahead = one[(at + 1) % count] - one[at]
        spread[at + 1] = spread[at] + density * np.hypot(ahead[0], ahead[1])
    return spread
