"""Smooth lines as quadratic B-splines with few control points, and as the data of SVG paths.

SVG needs only the midpoints of the control polygon's sides: its command `t` mirrors the previous control point at the
midpoint to get the next one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Bools, Floats, Indices
from motionmind.jit import jit
from motionmind.render.trace import Lines

UNITS_PER_PX = 10  # of the whole numbers in the paths of files

_N_AROUND = 6  # points before and after a point, from which its bend is measured


def path(lines: Lines, scale: float, start: NDArray[np.integer] | tuple[int, int] = (0, 0)) -> str:
    """Write smooth lines as the data of one SVG path, in whole numbers.

    Args:
        lines: the lines, points in samples.
        scale: units of the path to a sample.
        start: x and y of the samples' origin, in those units.
    """
    knots, starts = _knots(lines.points, lines.starts, lines.closed)
    points = np.rint(knots * (0.5 * scale)).astype(np.intp) * 2  # even, so that their middles are whole numbers
    text, pen = [], -np.asarray(start, dtype=np.intp)
    for first, end, closed in zip(starts[:-1], starts[1:], lines.closed, strict=True):
        control = points[first:end]
        middles = (control + np.roll(control, -1, axis=0)) // 2
        on = middles[np.r_[-1, : len(middles)]] if closed else np.r_[control[:1], middles[1:-2], control[-1:]]
        steps = np.diff(on, axis=0, prepend=pen[None]).ravel().tolist()
        turn = (control[0 if closed else 1] - on[0]).tolist()
        rest = "t" + "%+d" * (len(steps) - 4) if len(steps) > 4 else ""
        text.append(("m%+d%+dq%+d%+d%+d%+d" + rest) % (*steps[:2], *turn, *steps[2:]))
        pen = on[-1]
    return "".join(text)


@jit
def _knots(points: Floats, starts: Indices, closed: Bools) -> tuple[Floats, Indices]:
    """Fit quadratic B-splines to lines, with more control points where a line bends more.

    Returns:
        Control points [M, 2]; the index of the first one of each line, and M [K + 1].
    """
    knots = np.empty((2 * len(points) + 6 * len(closed), 2))
    firsts = np.zeros(len(starts), dtype=np.intp)
    for line in range(len(closed)):
        one = points[starts[line] : starts[line + 1]]
        whole = closed[line]
        needed = _points_needed(one, whole)
        intervals = max(int(np.ceil(needed[-1])), 6 if whole else 1)
        count = intervals if whole else intervals + 1
        through = np.empty((count, 2))
        at = 0
        for number in range(count):
            target = needed[-1] * number / intervals
            while at + 2 < len(needed) and needed[at + 1] < target:
                at += 1
            share = min((target - needed[at]) / max(needed[at + 1] - needed[at], 1e-12), 1.0)
            through[number] = one[at] + share * (one[(at + 1) % len(one)] - one[at])
        control = through.copy()
        # Solves (before + 6 control + after) / 8 = through, where the spline passes: 4 sweeps, to 1 % of a sample.
        for _ in range(4):
            for number in range(0 if whole else 1, count if whole else count - 1):
                before, after = control[number - 1], control[(number + 1) % count]
                control[number] = (8.0 * through[number] - before - after) / 6.0
        firsts[line + 1] = firsts[line] + count
        knots[firsts[line] : firsts[line + 1]] = control
    return knots[: firsts[-1]], firsts


@jit
def _points_needed(one: Floats, whole: bool) -> Floats:
    """Return how many spline points (not whole) a line needs from its start to each of its points, and to its end.

    `whole` tells whether the line [N, 2] is closed.
    """
    count = len(one)
    sides = count if whole else count - 1
    bends = np.empty(sides)
    for at in range(sides):
        a, b, c = at - _N_AROUND, at, at + _N_AROUND
        if whole:
            a, c = a % count, c % count
        else:
            a, b, c = max(a, 0), at, min(c, count - 1)
        first, second = one[b] - one[a], one[c] - one[b]
        turn = abs(np.arctan2(first[0] * second[1] - first[1] * second[0], first[0] * second[0] + first[1] * second[1]))
        length = 0.5 * (np.hypot(first[0], first[1]) + np.hypot(second[0], second[1]))
        bend = turn / max(length, 1e-12)
        # Spline points a sample: one in 40 where the line is straight; their square grows with the bend.
        bends[at] = np.sqrt(0.2 * bend * bend + 0.06 * bend + 1.0 / 40.0**2)
    needed = np.zeros(sides + 1)
    for at in range(sides):
        density = 0.0
        for near in range(at - _N_AROUND, at + _N_AROUND + 1):
            density += bends[near % sides if whole else min(max(near, 0), sides - 1)] / (2 * _N_AROUND + 1)
        ahead = one[(at + 1) % count] - one[at]
        needed[at + 1] = needed[at] + density * np.hypot(ahead[0], ahead[1])
    return needed
