"""Smooth lines as quadratic B-splines with few control points, and as the data of SVG paths.

SVG can write such a spline as the middles of its control polygon's sides alone: each control point is the one before
mirrored at the middle between them, as the command `t` means.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Bools, Floats, Indices
from motionmind.jit import jit
from motionmind.render.trace import Lines

_STRAIGHT = 40.0  # samples between a spline's points where it is straight
_CURVED, _BENT = 0.06, 0.2  # squared points a sample where it bends, per curvature and per its square
_AROUND = 6  # samples before and after a point from which its bend is measured
_SWEEPS = 4  # after which the control points are right to a hundredth


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
    """Fit quadratic B-splines to lines; return control points [M, 2] and the first one of each line, and M [K + 1].

    The more a line bends, the denser they are.
    """
    knots = np.empty((2 * len(points) + 6 * len(closed), 2))
    firsts = np.zeros(len(starts), dtype=np.intp)
    for line in range(len(closed)):
        one = points[starts[line] : starts[line + 1]]
        whole = closed[line]
        spread = _spread(one, whole)
        intervals = max(int(np.ceil(spread[-1])), 6 if whole else 1)
        count = intervals if whole else intervals + 1
        through = np.empty((count, 2))
        at = 0
        for number in range(count):
            target = spread[-1] * number / intervals
            while at + 2 < len(spread) and spread[at + 1] < target:
                at += 1
            share = min((target - spread[at]) / max(spread[at + 1] - spread[at], 1e-12), 1.0)
            through[number] = one[at] + share * (one[(at + 1) % len(one)] - one[at])
        control = through.copy()
        for _ in range(_SWEEPS):  # solves (before + 6 control + after) / 8 = through, where the spline passes
            for number in range(0 if whole else 1, count if whole else count - 1):
                before, after = control[number - 1], control[(number + 1) % count]
                control[number] = (8.0 * through[number] - before - after) / 6.0
        firsts[line + 1] = firsts[line] + count
        knots[firsts[line] : firsts[line + 1]] = control
    return knots[: firsts[-1]], firsts


@jit
def _spread(one: Floats, whole: bool) -> Floats:
    """Count the spline points that a line needs from its start to each of its points, and to its end, as fractions."""
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
