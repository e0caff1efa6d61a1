"""A movement's joint angles as curves over time, one below the other, all at one scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
from motionmind.plots.canvas import Plate
from motionmind.plots.marks import Dot, Line, Mark, Words
from motionmind.plots.symbols import LETTERS, SMALL
from motionmind.render.palette import BRIDGED, EDGE, GRID, INK, PAPER, PIECE, PLOT_PALE, VIOLET

CHOSEN = 8  # joints that are drawn unless some are asked for

# In pixels:
_WIDTH, _LEFT, _RIGHT = 900, 200.0, 30.0
_TITLE, _TOP, _BOTTOM = 18, 92.0, 46.0
_CURVES = 520.0  # height of all curves together, unless they would be too low
_LOWEST, _APART = 26.0, 20.0
_ROUND = 10.0  # degrees, to whose multiples each curve's range is widened


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
    >>> tween = engine.tween("ballet/arabesque", "ballet/fifth")
    >>> draw_angles(tween.motion, ["left_knee", "right_knee"]).save("knees.svg")
    """
    check_type("motion", motion, Motion)
    if joints is not None:
        check_items("joints", joints, "joints' names", str)
    if len(motion) < 2:
        raise MotionMindError(f"{motion.name or 'the motion'} has one frame, which draws no curve: two at least")
    degrees = turned_degrees(motion.rotations)
    chosen = _most_turned(degrees) if joints is None else [motion.skeleton.index(joint) for joint in joints]
    if not chosen:
        raise MotionMindError("an angle chart draws one joint at least")
    ranges = [_widened(degrees[:, joint]) for joint in chosen]
    scale = max(_CURVES / sum(high - low for low, high in ranges), _LOWEST / min(high - low for low, high in ranges))
    marks: list[Mark] = []
    top, bridged = _TOP, motion.bridged()
    for joint, (low, high) in zip(chosen, ranges, strict=True):
        panel = _Panel(
            motion, degrees[:, joint], bridged[:, joint], motion.skeleton.names[joint], top, low, high, scale
        )
        marks += panel.marks()
        top += scale * (high - low) + _APART
    bottom = top - _APART
    title = f"{displayed(motion.name) or 'Movement'}: how far joints are turned from rest"
    frame = [*_heading(motion, title), *_times(motion, bottom)]
    return Plate(_WIDTH, ceil(bottom + _BOTTOM), title, (*frame, *marks))


def _most_turned(degrees: Floats) -> list[int]:
    """Return the joints whose angles [T, J] change most, in order."""
    spans = np.ptp(degrees, axis=0)
    return sorted(np.argsort(-spans, kind="stable")[:CHOSEN].tolist())


def _widened(degrees: Floats) -> tuple[float, float]:
    """Return the range of angles [T], widened to multiples of `_ROUND`."""
    low = _ROUND * floor(degrees.min() / _ROUND)
    return low, max(_ROUND * ceil(degrees.max() / _ROUND), low + _ROUND)


def _x(motion: Motion, times: Floats) -> Floats:
    """Return where times [N] stand along the picture."""
    first, last = motion.times[[0, -1]]
    return np.asarray(_LEFT + (times - first) / (last - first) * (_WIDTH - _LEFT - _RIGHT))


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
        """Return places [N, 2] of angles at some times."""
        return np.stack([_x(self.motion, times), self.top + self.scale * (self.high - degrees)], axis=-1)

    def marks(self) -> Iterator[Mark]:
        """Yield the name, the range, and the curve with its moves."""
        middle = self.top + 0.5 * self.scale * (self.high - self.low)
        yield Words((_LEFT - 42.0, middle), displayed(self.name, 24), LETTERS, INK, "end")
        for value in (self.low, self.high):
            y = self.top + self.scale * (self.high - value)
            yield Line(np.array([[_LEFT, y], [_WIDTH - _RIGHT, y]]), GRID, 0.8)
            yield Words((_LEFT - 8.0, y), f"{value:g}°", SMALL, PLOT_PALE, "end")
        points, made = self._at(self.motion.times, self.degrees), _made(self.motion)
        for part, ink, width in (
            (~made, PIECE, 1.8),
            (made, VIOLET, 1.8),
            (self.bridged[:-1] | self.bridged[1:], BRIDGED, 3.0),
        ):
            for first, last in _stretches(part):
                yield Line(points[first : last + 1], ink, width, title=displayed(self.name))
        for insertion in self.motion.insertions:
            values = np.interp(insertion.times, self.motion.times, self.degrees)
            for move, place in enumerate(self._at(insertion.times, values)):
                seen = f"{displayed(self.name)}, move {move}: {values[move]:.0f}° at {insertion.times[move]:.2f} s"
                yield Dot(symbols.pair(place), 2.6, VIOLET, PAPER, 0.8, seen)


def _made(motion: Motion) -> Bools:
    """Return which pieces between two frames [T - 1] the engine made; an insertion begins and ends in given ones."""
    inserted = motion.inserted()
    return np.asarray(inserted[:-1] | inserted[1:])


def _stretches(part: Bools) -> Iterator[tuple[int, int]]:
    """Yield the first and the last frame of each run of pieces [T - 1] that are part of it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], part, [False]]).astype(int)))
    for first, last in pairwise(edges):
        if part[first]:
            yield int(first), int(last)


def _heading(motion: Motion, title: str) -> Iterator[Mark]:
    """Yield the title and the meanings of the colours that are seen."""
    yield Words((_RIGHT, 32.0), title, _TITLE, INK)
    legend: list[tuple[Colour, str]] = []
    if not _made(motion).all():
        legend.append((PIECE, "as given"))
    if motion.insertions:
        legend.append((VIOLET, "inserted, a dot a move"))
    if motion.bridged().any():
        legend.append((BRIDGED, "a move that the corpus does not attest"))
    x = _RIGHT
    for ink, words in legend:
        yield Line(np.array([[x, 62.0], [x + 22.0, 62.0]]), ink, 2.4)
        yield Words((x + 29.0, 62.0), words, LETTERS, PLOT_PALE)
        x += 60.0 + 7.2 * len(words)


def _times(motion: Motion, bottom: float) -> Iterator[Mark]:
    """Yield the axis of time, with a faint line at each round number of seconds."""
    first, last = map(float, motion.times[[0, -1]])
    ticks = symbols.round_numbers(first, last)
    for tick, x in zip(ticks.tolist(), _x(motion, ticks).tolist(), strict=True):
        yield Line(np.array([[x, _TOP], [x, bottom]]), GRID, 0.8)
        yield Words((x, bottom + 16.0), f"{tick:g}", SMALL, PLOT_PALE, "middle")
    yield Line(np.array([[_LEFT, bottom], [_WIDTH - _RIGHT, bottom]]), EDGE, 0.8)
    yield Words((_WIDTH - _RIGHT, bottom + 34.0), "seconds", LETTERS, PLOT_PALE, "end")
