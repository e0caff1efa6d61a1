"""A floor plan: a movement's path from above, its facings, where feet stand, and the edge of the stage.

The audience is below the plan, as on contact sheets: z points down, and the left of a body that faces the audience is
on the right.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_items, check_real, check_text, check_type
from motionmind.body.mirror import sides_of
from motionmind.body.motion import Motion
from motionmind.body.palette import SIDE_COLOURS, Colour
from motionmind.body.stage import check_stage, find_overstep
from motionmind.body.support import size_of
from motionmind.body.tempo import runs_of
from motionmind.clean.stances import find_foot_stances
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.music.beats import Beats, beats_of_tempo
from motionmind.plots.brush import mixed
from motionmind.plots.canvas import Plate
from motionmind.plots.marks import LETTER_WIDTH_RATIO, Dot, Line, Mark, Words
from motionmind.plots.scene import Labels
from motionmind.plots.symbols import TEXT_PX, TICK_PX, round_numbers
from motionmind.render.palette import INK, PAPER, PLOT, SHEET, VIOLET, dancer_ink
from motionmind.tween.counts import TEMPO_RANGE_BPM

__all__ = ["draw_floor_plan", "find_overstep"]

_RATE_HZ = 30.0  # least rate at which paths and stances are found: a score has a posture or two a second
_FOOT_LEVEL_M = 0.04  # points of a standing foot that are higher than its lowest by more do not touch the floor
_FOOT_WIDTH_M = 0.08
_SQUARE_SHARE = 0.6  # least share of the longer side of the drawn floor that the shorter has
_ARROW_M = 0.22  # from the body to the tip of the arrow that shows its facing
_SAME_PLACE_M, _SAME_FACING_DEG = 0.1, 15.0  # within which a body stays where it is
MAX_ARROWS = 40  # on a plan, unless `every` is given


@dataclass(frozen=True)
class _Lengths:
    """Lengths of the picture, pixels: the longer side of the floor, and the margins around the floor."""

    floor: float = 760.0
    left: float = 56.0
    right: float = 56.0
    top: float = 100.0
    bottom: float = 76.0


_PX = _Lengths()


def draw_floor_plan(
    motion: Motion | Sequence[Motion],
    *,
    stage: tuple[float, float] | None = None,
    tempo: float | None = None,
    beats: Beats | None = None,
    every: float | None = None,
    name: str = "",
) -> Plate:
    """Draw the path of a movement from above, where its feet stand, and where the body faces at counts or seconds.

    Inserted movement is violet. Footprints have the colours of the body's sides; on half-pointe they are short. Of
    several dancers, each has a colour of its own.

    Args:
        motion: the motion, on any skeleton, y up; or those of several dancers on one clock.
        stage: width and depth of the stage around the origin, metres; None to draw none.
        tempo: counts a minute, to write counts from 1 instead of seconds; None for seconds.
        beats: the beats of music, to write their counts; count 1 comes at the first frame. In place of `tempo`.
        every: interval between facings, in counts or seconds; None for one that suits the length.
        name: the name in the title; by default that of the motion.

    Returns:
        The picture, which a notebook shows; `picture.save(path)` writes it, as `.svg` or `.png`.

    Raises:
        MotionMindError: an argument is out of its range.

    >>> from motionmind import Engine
    >>> from motionmind.plots import draw_floor_plan
    >>> engine = Engine.load("ballet")
    >>> adagio = engine.corpus.motion(next(clip for clip in engine.corpus.clips if clip.name == "adagio"))
    >>> draw_floor_plan(adagio, stage=(8, 6), tempo=60).save("adagio.svg")
    """
    motions = [motion] if isinstance(motion, Motion) else motion
    check_items("motion", motions, "motions", Motion)
    if not motions:
        raise MotionMindError("a floor plan needs one motion or more")
    check_text("name", name)
    check_real("tempo", tempo, or_none=True)
    check_type("beats", beats, Beats, or_none=True)
    check_real("every", every, or_none=True)
    if tempo is not None and beats is not None:
        raise MotionMindError("tempo and beats both set the counts; give one of them")
    if tempo is not None and not TEMPO_RANGE_BPM[0] <= tempo <= TEMPO_RANGE_BPM[1]:
        raise MotionMindError(f"tempo must be a number of counts a minute from 1 to 6000, not {tempo:g}")
    if every is not None and not 0.0 < every < np.inf:
        raise MotionMindError(f"every must be a number of counts or seconds above 0, not {every:g}")
    stage = None if stage is None else check_stage(stage)
    dense = [one if len(one) < 2 or one.fps >= _RATE_HZ else one.resample(_RATE_HZ) for one in motions]
    path = np.concatenate([one.root[:, [0, 2]] for one in dense])
    floor = _Floor.around(path, stage, 0.35 * max(size_of(one.skeleton) for one in motions))
    counts = beats if tempo is None else beats_of_tempo(tempo)
    marks = [*_grid(floor), *_stage(floor, stage)]
    dancers = [(one.name, dancer_ink(number)) for number, one in enumerate(motions)] if len(motions) > 1 else []
    for number, one in enumerate(dense):
        ink = dancers[number][1] if dancers else None
        marks += [
            *_footprints(floor, one, ink),
            *_path(floor, one, ink or INK),
            *_facings(floor, one, counts, every, ink or SHEET.plumb),
        ]
    title = f"{displayed(name or motions[0].name) or 'Movement'}: floor plan"
    heading = _heading(title, any(one.insertions for one in motions), tempo, beats, dancers)
    return Plate(floor.width, floor.height, title, tuple(marks), tuple(heading))


@dataclass(frozen=True, eq=False)
class _Floor:
    """The drawn part of the floor.

    Attributes:
        low, high: least and greatest x and z [2], metres.
        scale: pixels a metre.
    """

    low: Floats
    high: Floats
    scale: float

    @classmethod
    def around(cls, path: Floats, stage: tuple[float, float] | None, margin: float) -> _Floor:
        """Return the floor around a path [T, 2] and a stage, with a margin, metres."""
        low, high = path.min(axis=0) - margin, path.max(axis=0) + margin
        if stage is not None:
            half = 0.5 * np.array(stage)
            low, high = np.minimum(low, -half), np.maximum(high, half)
        spare = np.maximum(_SQUARE_SHARE * (high - low).max() - (high - low), 0.0)
        low, high = low - 0.5 * spare, high + 0.5 * spare
        return cls(low, high, _PX.floor / float((high - low).max()))

    @property
    def width(self) -> int:
        """Width of the picture, pixels."""
        return ceil(self.scale * float(self.high[0] - self.low[0]) + _PX.left + _PX.right)

    @property
    def height(self) -> int:
        """Height of the picture, pixels."""
        return ceil(self.scale * float(self.high[1] - self.low[1]) + _PX.top + _PX.bottom)

    def at(self, places: Floats) -> Floats:
        """Return the points [..., 2], pixels, of places x, z [..., 2], metres."""
        return np.asarray([_PX.left, _PX.top] + self.scale * (places - self.low))


def _grid(floor: _Floor) -> Iterator[Mark]:
    """Yield lines at round numbers of metres, and the numbers."""
    (left, top), (right, bottom) = floor.at(floor.low), floor.at(floor.high)
    yield Line(np.array([[left, top], [right, top], [right, bottom], [left, bottom], [left, top]]), PLOT.edge, 0.8)
    for axis in (0, 1):
        for value in _round_metres(floor, axis):
            place = floor.low.copy()
            place[axis] = value
            x, y = floor.at(place)
            ends = [[x, top], [x, bottom]] if axis == 0 else [[left, y], [right, y]]
            yield Line(np.array(ends), PLOT.grid, 0.8)
            at = (float(x), float(bottom) + 14.0) if axis == 0 else (float(left) - 8.0, float(y))
            yield Words(at, f"{value:g}", TICK_PX, PLOT.pale, "middle" if axis == 0 else "end")
    yield Words((0.5 * float(left + right), float(bottom) + 40.0), "audience", TEXT_PX, PLOT.pale, "middle")
    yield Words((float(right), float(bottom) + 40.0), "metres", TEXT_PX, PLOT.pale, "end")


def _round_metres(floor: _Floor, axis: int) -> list[float]:
    """Return round numbers of metres within the floor; both axes have one interval."""
    spans = floor.high - floor.low
    step = np.diff(round_numbers(0.0, float(spans.max())))[0]
    numbers = step * np.arange(ceil(floor.low[axis] / step), floor.high[axis] // step + 1)
    return [float(number) for number in np.round(numbers, 9)]


def _stage(floor: _Floor, stage: tuple[float, float] | None) -> Iterator[Mark]:
    """Yield the edge of the stage."""
    if stage is not None:
        x, z = 0.5 * stage[0], 0.5 * stage[1]
        corners = floor.at(np.array([[-x, -z], [x, -z], [x, z], [-x, z], [-x, -z]]))
        yield Line(corners, INK, 2.0, title=f"stage, {stage[0]:g} x {stage[1]:g} m")


def _footprints(floor: _Floor, motion: Motion, dancer: Colour | None) -> Iterator[Mark]:
    """Yield a print for each stance: from the points that touch the floor in its middle, heel to tip."""
    size, times = size_of(motion.skeleton), motion.times - motion.times[0]
    posed, feet = find_foot_stances(motion)
    sides = sides_of(motion.skeleton)
    for one in feet:
        side = sides[one.foot.leg[-1]]
        ink = mixed(SIDE_COLOURS[side], 0.55) if dancer is None else mixed(dancer, 0.3)
        for start, stop in one.stances:
            places = posed.places[(start + stop) // 2, one.points]
            level = places[places[:, 1] <= places[:, 1].min() + _FOOT_LEVEL_M * size][:, [0, 2]]
            title = f"{side} foot, {times[start]:.1f} to {times[stop - 1]:.1f} s"
            yield from _print(floor, _longest(level), _FOOT_WIDTH_M * size, ink, title)


def _longest(points: Floats) -> Floats:
    """Return the two of some points [Q, 2] that are farthest apart [2, 2]."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    return points[list(np.unravel_index(int(apart.argmax()), apart.shape))]


def _print(floor: _Floor, ends: Floats, width: float, ink: Colour, title: str) -> Iterator[Mark]:
    """Yield a line with round ends, `width` metres wide, between two points of the floor [2, 2]."""
    points, wide = floor.at(ends), max(floor.scale * width, 3.0)
    yield Line(points, ink, wide, title=title)
    for x, y in points.tolist():  # PNGs have no round ends
        yield Dot((x, y), 0.5 * wide, ink, ink, title=title)


def _path(floor: _Floor, motion: Motion, ink: Colour) -> Iterator[Mark]:
    """Yield the root's path, with its first and last point; inserted movement is violet."""
    points, inserted = floor.at(motion.root[:, [0, 2]]), motion.inserted()
    if len(motion) > 1:
        yield Line(points, ink, 1.6, title="path of the pelvis")
    for start, stop in runs_of(inserted):
        if stop > start + 1:
            yield Line(points[start:stop], VIOLET, 2.2, title="inserted")
    (x, y), (end_x, end_y) = points[0].tolist(), points[-1].tolist()
    yield Dot((x, y), 6.0, PAPER, ink, 2.0, "start")
    yield Dot((end_x, end_y), 4.5, ink, ink, 0.0, "end")


def _facings(floor: _Floor, motion: Motion, counts: Beats | None, every: float | None, ink: Colour) -> Iterator[Mark]:
    """Yield an arrow for the facing at every so many counts, with the counts or the seconds where there is room.

    A body that stays where it is and faces the same way has one arrow, for instance with "3-8".

    Args:
        floor: the floor.
        motion: the motion.
        counts: when counts, which begin with 1, come; None for seconds.
        every: interval in counts or seconds; None to choose it.
        ink: colour of the arrows.
    """
    times = motion.times - motion.times[0]
    length = float(times[-1]) if counts is None else _counts_in(counts, float(times[-1]))
    if every is None:
        every = next(step for step in (2.0**k for k in range(40)) if length <= MAX_ARROWS * step)
    numbers = every * np.arange(int(length / every + 1e-6) + 1)
    at = numbers if counts is None else np.array([counts.seconds(1.0 + number) for number in numbers.tolist()])
    frames = np.minimum(np.searchsorted(times, at - 1e-6), len(times) - 1)
    places = motion.root[frames][:, [0, 2]]
    headings = rot.heading(motion.skeleton.global_rotations(motion.rotations[frames])[:, 0])
    towards = np.stack([np.sin(headings), np.cos(headings)], axis=-1)  # a body at rest faces +z
    size = size_of(motion.skeleton)
    tips, starts = floor.at(places + _ARROW_M * size * towards), floor.at(places)
    labels = Labels(tips, 4.0)
    for first, last in _stays(places / (_SAME_PLACE_M * size), towards / np.radians(_SAME_FACING_DEG)):
        ends = [f"{number + (counts is not None):g}" for number in numbers[[first, last]].tolist()]
        text = "-".join(dict.fromkeys(ends))
        title = f"{text} s" if counts is None else f"counts {text}"
        yield Line(np.stack([starts[first], tips[first]]), ink, 1.2, title=title)
        yield Line(_barbs(starts[first], tips[first]), ink, 1.8, title=title)
        width = LETTER_WIDTH_RATIO * TICK_PX * len(text)
        x, y = tips[first].tolist()
        around = [(x + 5.0, y), (x - 5.0 - width, y), (x - 0.5 * width, y - 10.0), (x - 0.5 * width, y + 10.0)]
        free = labels.place(around, width, 0.5 * TICK_PX)
        if free is not None:
            yield Words(free, text, TICK_PX, INK)


def _counts_in(counts: Beats, seconds: float) -> float:
    """Return how many counts pass in some seconds from count 1 on."""
    grid = counts.grid(1, seconds)
    return float(np.interp(seconds, grid, np.arange(len(grid))))


def _stays(*features: Floats) -> Iterator[tuple[int, int]]:
    """Yield the first and last of each run of moments in which no feature [N, 2] is 1 or more from its first value."""
    first, count = 0, len(features[0])
    for now in range(1, count + 1):
        if now == count or any(np.linalg.norm(one[now] - one[first]) >= 1.0 for one in features):
            yield first, now - 1
            first = now


def _barbs(start: Floats, tip: Floats) -> Floats:
    """Return the head of an arrow [3, 2], pixels."""
    along = (start - tip) / max(float(np.linalg.norm(start - tip)), 1e-9)
    across = np.array([-along[1], along[0]])
    return np.stack([tip + 6.0 * along + 3.5 * across, tip, tip + 6.0 * along - 3.5 * across])


def _heading(
    title: str,
    has_insertions: bool,
    tempo: float | None,
    beats: Beats | None,
    dancers: Sequence[tuple[str, Colour]],
) -> Iterator[Mark]:
    """Yield the title and what the marks mean."""
    yield Words((_PX.left, 30.0), title, 18, INK)
    units = "seconds" if tempo is None else f"counts at {tempo:g} a minute"
    units = units if beats is None else f"counts of music, {beats.tempo:.1f} a minute"
    seen = f"arrows: facing, with {units}; ring: start; dot: end"
    yield Words((_PX.left, 54.0), seen, TEXT_PX, PLOT.pale)
    x = _PX.left
    legend = [(ink, displayed(name, 24)) for name, ink in dancers]
    legend = legend or [(SIDE_COLOURS[side], f"{side} foot") for side in ("left", "right")]
    legend += [(VIOLET, "inserted")] if has_insertions else []
    for ink, words in legend:
        yield Line(np.array([[x, 76.0], [x + 22.0, 76.0]]), ink, 4.0)
        yield Words((x + 29.0, 76.0), words, TEXT_PX, PLOT.pale)
        x += 60.0 + 7.2 * len(words)
