"""A movement's joint angles as curves over time, one below the other, all at one scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.arguments import check_items, check_type
from motionmind.body.motion import Motion
from motionmind.body.palette import Colour
from motionmind.body.tables import turned_degrees
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.plots import symbols
from motionmind.plots.brush import as_point
from motionmind.plots.canvas import Plate
from motionmind.plots.marks import Dot, Line, Mark, Words
from motionmind.plots.symbols import TEXT_PX, TICK_PX
from motionmind.render.palette import BRIDGED, INK, PAPER, PLOT, VIOLET


@dataclass(frozen=True)
class _ChartLengths:
    """Lengths of the chart, pixels.

    Attributes:
        width: its width.
        left, right, top, bottom: its margins beside the curves.
        curves: height of all curves together, unless one would be lower than `lowest`.
        apart: gap between two curves.
    """

    width: int = 900
    left: float = 200.0
    right: float = 30.0
    top: float = 92.0
    bottom: float = 46.0
    curves: float = 520.0
    lowest: float = 26.0
    apart: float = 20.0


_CHART_PX = _ChartLengths()


def draw_angles(motion: Motion, joints: Sequence[str] | None = None) -> Plate:
    """Draw how far joints are turned from rest, over time: a curve for each, all at one scale.

    Inserted movement is violet, with a dot at each of its moves, and green where no corpus attests a joint's move.

    Args:
        motion: the motion, on any skeleton; of two frames at least.
        joints: names of the joints to draw; by default the eight that turn most, in the skeleton's order.

    Returns:
        The picture, which a notebook shows; `picture.save(path)` writes it, as `.svg` or `.png`.

    Raises:
        SkeletonError: the skeleton has no such joint.
        MotionMindError: the motion has one frame, or no joint is to be drawn.

    >>> from motionmind import Engine
    >>> from motionmind.plots import draw_angles
    >>> engine = Engine.load("ballet")
    >>> tween = engine.tween(engine.posture("ballet/arabesque"), engine.posture("ballet/fifth"))
    >>> draw_angles(tween.motion, ["left_knee", "right_knee"]).save("knees.svg")
    """
    check_type("motion", motion, Motion)
    if joints is not None:
        check_items("joints", joints, "joints' names", str)
    if len(motion) < 2:
        raise MotionMindError(f"{motion.name or 'the motion'} has one frame; a curve needs two or more")
    degrees = turned_degrees(motion.rotations)
    chosen = _most_turned(degrees) if joints is None else [motion.skeleton.index(joint) for joint in joints]
    if not chosen:
        raise MotionMindError("an angle chart needs one joint or more")
    ranges = [_widened(degrees[:, joint]) for joint in chosen]
    scale = max(
        _CHART_PX.curves / sum(high - low for low, high in ranges),
        _CHART_PX.lowest / min(high - low for low, high in ranges),
    )
    marks: list[Mark] = []
    top, bridged = _CHART_PX.top, motion.bridged()
    for joint, (low, high) in zip(chosen, ranges, strict=True):
        panel = _Panel(
            motion, degrees[:, joint], bridged[:, joint], motion.skeleton.names[joint], top, low, high, scale
        )
        marks += panel.marks()
        top += scale * (high - low) + _CHART_PX.apart
    bottom = top - _CHART_PX.apart
    title = f"{displayed(motion.name) or 'Movement'}: how far joints are turned from rest"
    frame = [*_heading(motion, title), *_times(motion, bottom)]
    return Plate(_CHART_PX.width, ceil(bottom + _CHART_PX.bottom), title, (*frame, *marks))


def _most_turned(degrees: Floats) -> list[int]:
    """Return the eight joints whose angles [T, J] change most, in order."""
    spans = np.ptp(degrees, axis=0)
    return sorted(np.argsort(-spans, kind="stable")[:8].tolist())


def _widened(degrees: Floats) -> tuple[float, float]:
    """Return the range of angles [T], widened to multiples of 10."""
    step = 10.0
    low = step * floor(degrees.min() / step)
    return low, max(step * ceil(degrees.max() / step), low + step)


def _x(motion: Motion, times: Floats) -> Floats:
    """Return the x of times [N], pixels."""
    first, last = motion.times[[0, -1]]
    return np.asarray(
        _CHART_PX.left + (times - first) / (last - first) * (_CHART_PX.width - _CHART_PX.left - _CHART_PX.right)
    )


class _Panel:
    """The curve of a joint."""

    def __init__(
        self,
        motion: Motion,
        degrees: Floats,
        bridged: Bools,
        name: str,
        top: float,
        low: float,
        high: float,
        scale: float,
    ) -> None:
        self.motion, self.degrees, self.bridged, self.name = motion, degrees, bridged, name
        self.top, self.low, self.high, self.scale = top, low, high, scale

    def _at(self, times: Floats, degrees: Floats) -> Floats:
        """Return the points [N, 2], pixels, of angles at some times."""
        return np.stack([_x(self.motion, times), self.top + self.scale * (self.high - degrees)], axis=-1)

    def marks(self) -> Iterator[Mark]:
        """Yield the name, the range, and the curve with its moves."""
        middle = self.top + 0.5 * self.scale * (self.high - self.low)
        yield Words((_CHART_PX.left - 42.0, middle), displayed(self.name, 24), TEXT_PX, INK, "end")
        for value in (self.low, self.high):
            y = self.top + self.scale * (self.high - value)
            yield Line(np.array([[_CHART_PX.left, y], [_CHART_PX.width - _CHART_PX.right, y]]), PLOT.grid, 0.8)
            yield Words((_CHART_PX.left - 8.0, y), f"{value:g}°", TICK_PX, PLOT.pale, "end")
        points, inserted = self._at(self.motion.times, self.degrees), _inserted(self.motion)
        for part, ink, width in (
            (~inserted, PLOT.piece, 1.8),
            (inserted, VIOLET, 1.8),
            (self.bridged[:-1] | self.bridged[1:], BRIDGED, 3.0),
        ):
            for first, last in _runs(part):
                yield Line(points[first : last + 1], ink, width, title=displayed(self.name))
        for insertion in self.motion.insertions:
            values = np.interp(insertion.times, self.motion.times, self.degrees)
            for move, place in enumerate(self._at(insertion.times, values)):
                seen = f"{displayed(self.name)} after move {move}: {values[move]:.0f}° at {insertion.times[move]:.2f} s"
                yield Dot(as_point(place), 2.6, VIOLET, PAPER, 0.8, seen)


def _inserted(motion: Motion) -> Bools:
    """Return which intervals between frames [T - 1] are inserted; an insertion begins and ends in given frames."""
    inserted = motion.inserted()
    return np.asarray(inserted[:-1] | inserted[1:])


def _runs(flags: Bools) -> Iterator[tuple[int, int]]:
    """Yield the first and the last frame of each run of flagged intervals [T - 1]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    for first, last in pairwise(edges):
        if flags[first]:
            yield int(first), int(last)


def _heading(motion: Motion, title: str) -> Iterator[Mark]:
    """Yield the title and the legend of the colours in use."""
    yield Words((_CHART_PX.right, 32.0), title, 18, INK)
    legend: list[tuple[Colour, str]] = []
    if not _inserted(motion).all():
        legend.append((PLOT.piece, "as given"))
    if motion.insertions:
        legend.append((VIOLET, "inserted, a dot a move"))
    if motion.bridged().any():
        legend.append((BRIDGED, "a move that the corpus does not attest"))
    x = _CHART_PX.right
    for ink, words in legend:
        yield Line(np.array([[x, 62.0], [x + 22.0, 62.0]]), ink, 2.4)
        yield Words((x + 29.0, 62.0), words, TEXT_PX, PLOT.pale)
        x += 60.0 + 7.2 * len(words)


def _times(motion: Motion, bottom: float) -> Iterator[Mark]:
    """Yield the axis of time, with a faint line at each round number of seconds."""
    first, last = map(float, motion.times[[0, -1]])
    ticks = symbols.round_numbers(first, last)
    for tick, x in zip(ticks.tolist(), _x(motion, ticks).tolist(), strict=True):
        yield Line(np.array([[x, _CHART_PX.top], [x, bottom]]), PLOT.grid, 0.8)
        yield Words((x, bottom + 16.0), f"{tick:g}", TICK_PX, PLOT.pale, "middle")
    yield Line(np.array([[_CHART_PX.left, bottom], [_CHART_PX.width - _CHART_PX.right, bottom]]), PLOT.edge, 0.8)
    yield Words((_CHART_PX.width - _CHART_PX.right, bottom + 34.0), "seconds", TEXT_PX, PLOT.pale, "end")
