"""The picture of a variation on its attractor, after figures 3 and 4 of Bradley and Stuart, Chaos 8:800 (1998).

Above, the attractor with the cell of each posture, both trajectories, and some of the postures; below, both
itineraries: which posture comes when, where they part, and where the variation jumps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from math import ceil, floor, log10
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionmind.errors import MotionMindError
from motionmind.formats.files import FilePath, write_atomically
from motionmind.motion import Posture
from motionmind.render.anatomy import body_of
from motionmind.render.camera import SMOOTH, VIEWS
from motionmind.render.figure import Pixels, colour, draw, halved, seen
from motionmind.render.ground import PAPER
from motionmind.render.plate import (
    FINE,
    LETTER,
    Colour,
    Dot,
    Inset,
    Line,
    Mark,
    Plate,
    Point,
    Region,
    Words,
    font,
    mixed,
)
from motionmind.render.plate import png as plate_png
from motionmind.render.plate import svg as plate_svg
from motionmind.render.portrait import Portrait, portrait_of
from motionmind.render.solids import EMPTY, Canvas, Indices
from motionmind.render.trace import Lines, outlines, smooth
from motionmind.variation.variation import Variation

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

ATTRACTORS = (".png", ".svg", ".html")  # how the files end that `write_attractor` writes

PIECE: Colour = (0, 112, 120)
OTHER: Colour = (206, 112, 0)
_INK: Colour = (34, 30, 34)
_PALE: Colour = (110, 106, 104)
_CELL: Colour = (240, 237, 232)
_EDGE: Colour = (158, 151, 144)

_WIDTH = 1400  # of the picture, pixels
_MARGIN = 44.0
_TOP = 150.0  # where the field of the attractor begins, and how high it is
_FIELD = 900.0
_WIDE, _HIGH = 960.0, 820.0  # the most that the attractor may take of it
_AIR = 6  # pixels around the attractor
_GRAPH = 330.0  # height of the itineraries
_UNDER = 80.0  # between the two
_TITLE, _LETTERS, _SMALL = 24, 13, 10  # heights of letters
_FIGURE = 104.0  # height of a body at rest, pixels
_FIGURES = 16  # at most
_NUMBERS = 160  # beside sites, at most
_FAR = 230.0  # pixels from a figure to its site, at most
_TRIED = 1000  # places for a figure
_CLEAR = 4.0  # pixels between a figure and its leader
_GRAIN = 4  # pixels: where there is room is looked for on squares of this size


def write_attractor(path: FilePath, variation: Variation) -> None:
    """Draw a variation on its attractor, as `.png`, as `.svg`, or as `.html`, a page in which it turns and dances.

    Raises:
        MotionMindError: the suffix is none of these, the attractor cannot be found again (see `portrait_of`), or the
            file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in ATTRACTORS:
        raise MotionMindError(f"{path}: an attractor is written as one of {', '.join(ATTRACTORS)}")
    portrait = portrait_of(variation)
    plate = attractor(portrait)
    write_atomically(path, plate_svg(plate).encode() if suffix == ".svg" else plate_png(plate))


def attractor(portrait: Portrait) -> Plate:
    """All that is in the picture of a variation on its attractor."""
    field = _Field(portrait)
    marks = [*_heading(portrait), *field.marks(), *_itineraries(portrait, _TOP + _FIELD + _UNDER)]
    height = ceil(_TOP + _FIELD + _UNDER + _GRAPH + 2 * _MARGIN)
    return Plate(_WIDTH, height, _title(portrait), tuple(marks))


# --- words ------------------------------------------------------------------------------------------------------------


def _title(portrait: Portrait) -> str:
    name = portrait.variation.piece.motion.name or "A piece"
    return f"{name} on the attractor of {portrait.flow.label}"


def _heading(portrait: Portrait) -> Iterator[Mark]:
    """What it is, and what is what."""
    course, count = portrait.variation.course, len(portrait.sites)
    yield Words((_MARGIN, _MARGIN), _title(portrait), _TITLE, _INK)
    nudge = ", ".join(f"{value:.4g}" for value in course.nudge)
    told = f"{_many(count, 'posture')}, a site each, {portrait.every} steps of {course.step:g} apart. "
    if portrait.parting is None:
        told += f"The variation begins ({nudge}) beside the piece and never leaves it."
    else:
        told += (
            f"The variation begins ({nudge}) beside the piece, parts from it after "
            f"{_many(portrait.parting, 'posture')} of {len(portrait.points)}, "
            f"and jumps {_many(len(portrait.jumps), 'time')}."
        )
    yield Words((_MARGIN, _MARGIN + 30), told, _LETTERS, _INK)
    x, y = _MARGIN, _MARGIN + 60
    for swatch, words in (
        ("piece", "the piece, a site for each posture"),
        ("other", "the variation: at each point the posture in whose cell it is"),
        ("jump", "where it jumps"),
        ("part", "where they part"),
        ("cell", "cells that it visits, the darker the more often"),
    ):
        line = np.array([[x, y], [x + 26, y]])
        if swatch == "piece":
            yield Line(line, PIECE, 2.6)
            yield _site((x + 13, y), 3.0)
        elif swatch == "other":
            yield Line(line, OTHER, 1.3)
            yield _point((x + 13, y), 2.4)
        elif swatch == "jump":
            yield _jump((x + 13, y), 4.2)
        elif swatch == "part":
            yield from _parting((x + 13, y), 6.0)
        else:
            for n, times in enumerate((0, 1, 3)):
                box = np.array([[x + 9 * n, y - 5], [x + 9 * n + 8, y - 5], [x + 9 * n + 8, y + 5], [x + 9 * n, y + 5]])
                yield Region(_ring(box), (0.0, 0.0), _tint(times), _EDGE, 0.6)
        yield Words((x + 33, y), words, _LETTERS, _PALE)
        x += 33 + font(_LETTERS).getlength(words) + 26
    yield Words(
        (_MARGIN, _MARGIN + 84),
        "The cells are those of the map, in all coordinates, where they cut the attractor; of its sheets that lie "
        "behind one another the one nearest to the viewer is drawn. Coordinates have no unit.",
        _LETTERS,
        _PALE,
    )


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _ring(corners: Array) -> Lines:
    """A closed line through corners [N, 2]."""
    return Lines(corners, np.array([0, len(corners)]), np.zeros(1, dtype=np.intp), np.ones(1, dtype=np.bool_))


def _tint(times: int) -> Colour:
    """The colour of a cell that the variation visits so many times."""
    return mixed(OTHER, min(0.07 + 0.08 * times, 0.4), _CELL) if times else _CELL


def _site(at: Point, radius: float, title: str = "") -> Dot:
    return Dot(at, radius, PIECE, PAPER, 0.3 * radius, title)


def _point(at: Point, radius: float, title: str = "") -> Dot:
    return Dot(at, radius, OTHER, PAPER, 0.2 * radius, title)


def _jump(at: Point, radius: float, title: str = "") -> Dot:
    return Dot(at, radius, PAPER, OTHER, 0.4 * radius, title)


def _parting(at: Point, radius: float) -> Iterator[Mark]:
    yield Dot(at, radius, PAPER, _INK, 1.6)
    yield Dot(at, 0.4 * radius, OTHER, OTHER)


# --- the attractor ----------------------------------------------------------------------------------------------------


class _Field:
    """Where the attractor is in the picture, and what is on it."""

    def __init__(self, portrait: Portrait) -> None:
        self.portrait = portrait
        places = portrait.seen(np.concatenate([portrait.sheets, portrait.other]))
        self.low, self.high = places.min(axis=0), places.max(axis=0)
        self.scale = float(min([_WIDE, _HIGH] / np.maximum(self.high - self.low, 1e-12)))
        size = self.scale * (self.high - self.low)
        self.width, self.height = (ceil(length) + 2 * _AIR for length in size)
        self.corner = float(round(0.5 * (_WIDTH - self.width))), _TOP + round(0.5 * (_FIELD - self.height))
        self.visits = np.bincount(portrait.order, minlength=len(portrait.sites))

    def at(self, points: Array) -> Array:
        """Where points [..., d] are in the picture [..., 2], pixels."""
        shown = (self.portrait.seen(points) - [self.low[0], self.high[1]]) * [self.scale, -self.scale]
        return np.asarray(shown + self.corner + _AIR)

    @cached_property
    def cells(self) -> Indices:
        """The posture whose cell each pixel is in, from `corner` on."""
        corner = np.array([self.low[0] - _AIR / self.scale, self.high[1] + _AIR / self.scale])
        return self.portrait.cells(corner, self.scale, self.width, self.height)

    def marks(self) -> Iterator[Mark]:
        """All of it."""
        yield from self._cells()
        yield from self._frame()
        yield from self._trajectories()
        yield from self._figures_and_numbers()

    def _cells(self) -> Iterator[Mark]:
        found = smooth(outlines(self.cells))
        areas = found.areas()
        for n in np.argsort(-np.abs(areas), kind="stable"):  # what lies in a hole lies over it
            one, posture = found.only(np.arange(len(areas)) == n), int(found.labels[n])
            hole = areas[n] < 0.0
            yield Region(
                one,
                self.corner,
                PAPER if hole else _tint(int(self.visits[posture])),
                _EDGE,
                0.7,
                "" if hole else self._told(posture),
            )

    def _frame(self) -> Iterator[Mark]:
        """Both axes, as far as the attractor reaches, with round numbers."""
        names = [self.portrait.flow.dimensions[i] for i in self.portrait.axes[:2]]
        left, bottom = self.corner[0] - 16.0, self.corner[1] + self.height + 16.0
        for axis in (0, 1):
            ticks = _round_numbers(self.low[axis], self.high[axis])
            ends = np.array([self.low[axis], self.high[axis]])
            along = (
                (self.scale * (ends - self.low[0]) + self.corner[0] + _AIR)
                if axis == 0
                else (self.corner[1] + _AIR + self.scale * (self.high[1] - ends))
            )
            line = [(x, bottom) for x in along] if axis == 0 else [(left, y) for y in along]
            yield Line(np.array(line), _PALE, 0.8)
            for tick in ticks:
                if axis == 0:
                    x = self.scale * (tick - self.low[0]) + self.corner[0] + _AIR
                    yield Line(np.array([(x, bottom), (x, bottom + 5.0)]), _PALE, 0.8)
                    yield Words((x, bottom + 13.0), f"{tick:g}", _SMALL, _PALE, "middle")
                else:
                    y = self.corner[1] + _AIR + self.scale * (self.high[1] - tick)
                    yield Line(np.array([(left, y), (left - 5.0, y)]), _PALE, 0.8)
                    yield Words((left - 9.0, y), f"{tick:g}", _SMALL, _PALE, "end")
            if axis == 0:
                yield Words((float(along[1]) + 12.0, bottom), names[0], _LETTERS, _PALE)
            else:
                yield Words((left, float(along[1]) - 12.0), names[1], _LETTERS, _PALE, "middle")

    @cached_property
    def size(self) -> float:
        """The radius of a site, pixels: as there is room."""
        return float(np.clip(40.0 / np.sqrt(len(self.portrait.sites)), 1.0, 4.0))

    def _trajectories(self) -> Iterator[Mark]:
        portrait, size = self.portrait, self.size
        yield Line(self.at(portrait.piece), PIECE, 0.75 * size)
        yield Line(self.at(portrait.other), OTHER, 0.36 * size)
        for posture, at in enumerate(self.at(portrait.sites)):
            yield _site(_pair(at), size, self._told(posture))
        for n, at in enumerate(self.at(portrait.points)):
            if n in portrait.jumps:
                yield _jump(_pair(at), 1.2 * size, self._read(n))
            else:
                yield _point(_pair(at), 0.65 * size, self._read(n))
        if portrait.parting is not None:
            yield from _parting(_pair(self.at(portrait.points[portrait.parting])), 6.0)

    def _told(self, posture: int) -> str:
        """What is known of a posture: when it comes in the piece, and where in the variation."""
        piece = self.portrait.variation.piece
        time = float(piece.motion.times[piece.frames[posture]])
        places = np.flatnonzero(self.portrait.order == posture).tolist()
        listed = ", ".join(map(str, places[:12])) + (", ..." if len(places) > 12 else "")
        return (
            f"posture {posture} of the piece, {time:.2f} s\nin the variation: {f'at {listed}' if places else 'never'}"
        )

    def _read(self, n: int) -> str:
        """What is known of a point of the variation."""
        text = f"at {n} in the variation: posture {self.portrait.order[n]}"
        if n in self.portrait.jumps:
            seam = self.portrait.jumps[n]
            text += f"\njump from posture {seam.start} to {seam.end}, seam {seam.number}"
        return text

    # --- where there is room ----------------------------------------------------------------------------------------

    def _figures_and_numbers(self) -> Iterator[Mark]:
        portrait = self.portrait
        sites, size = self.at(portrait.sites), self.size
        room = _Room(_WIDTH, ceil(_TOP + _FIELD))
        room.take(0.0, 0.0, _WIDTH, _TOP - 10.0)
        room.take(self.corner[0] - 44.0, self.corner[1] - 20.0, self.corner[0] - 10.0, _TOP + _FIELD)  # the axes
        room.take(0.0, self.corner[1] + self.height + 10.0, _WIDTH, _TOP + _FIELD)
        room.cover(self.corner, self.cells)
        room.trace(self.at(portrait.piece))
        room.trace(self.at(portrait.other))
        marked: set[int] = set()
        for posture in self._far_apart():
            pixels = _figure(portrait.variation.piece.ends(posture, posture)[0])
            figure = Inset((0.0, 0.0), pixels, self._told(posture))
            wide, high = figure.size
            place = room.near(posture, sites[posture], wide + 2 * _CLEAR, high + 1.6 * _LETTERS)
            if place is None:
                continue
            left, top = place[0] + _CLEAR, place[1]
            leader = np.stack([_edge(pixels, np.array([left, top]), sites[posture]), sites[posture]])
            room.join(place, wide + 2 * _CLEAR, high + 1.6 * _LETTERS, leader)
            marked.add(posture)
            yield Line(leader, _INK, 0.8)
            yield Dot(_pair(sites[posture]), max(1.25 * size, 3.0), PIECE, _INK, 1.2, self._told(posture))
            yield replace(figure, at=(left, top))
            yield Words((left + 0.5 * wide, top + high + 0.8 * _LETTERS), str(posture), _LETTERS, _INK, "middle")
            if len(marked) == _FIGURES:
                break
        yield from self._numbers(sites, marked)

    def _far_apart(self) -> Iterator[int]:
        """Postures whose figures are to be shown: the first, that at which they part, then far from one another."""
        portrait = self.portrait
        sites = self.at(portrait.sites)
        first = [0] + ([int(portrait.order[portrait.parting])] if portrait.parting is not None else [])
        far = np.full(len(sites), np.inf)
        for _ in range(min(len(sites), 8 * _FIGURES)):
            posture = first.pop(0) if first else int(np.argmax(far))
            if far[posture] > 0.0:
                yield posture
            far = np.minimum(far, np.linalg.norm(sites - sites[posture], axis=1))

    def _numbers(self, sites: Array, marked: set[int]) -> Iterator[Mark]:
        """Numbers beside sites where there is room, the roundest first."""
        size, left_over = self.size, _NUMBERS
        boxes = np.concatenate([sites - size, sites + size], axis=1)
        for posture in sorted(range(len(sites)), key=lambda n: (-_roundness(n), n)):
            if posture in marked or not left_over:
                continue
            text, (x, y) = str(posture), sites[posture]
            long, half, off = LETTER * _SMALL * len(text) + 2.0, 0.5 * _SMALL, size + 2.0
            for left, middle in (
                (x + off, y), (x - off - long, y), (x - 0.5 * long, y - off - half), (x - 0.5 * long, y + off + half)
            ):  # fmt: skip
                box = np.array([left, middle - half, left + long, middle + half])
                covers = (boxes[:, :2] < box[2:]).all(axis=1) & (boxes[:, 2:] > box[:2]).all(axis=1)
                if not covers.any():
                    boxes = np.concatenate([boxes, box[None]])
                    left_over -= 1
                    yield Words((float(left), float(middle)), text, _SMALL, _INK)
                    break


class _Room:
    """What is free of a picture, in squares of _GRAIN pixels, and the figures that took some of it.

    Outside the attractor a square is free for all figures; in a cell, beside the trajectories, for that of its posture.
    """

    def __init__(self, width: int, height: int) -> None:
        self.taken = np.zeros((height // _GRAIN, width // _GRAIN), dtype=np.bool_)
        self.cells = np.full(self.taken.shape, EMPTY, dtype=np.int16)
        self.figures = np.zeros_like(self.taken)
        self.leaders: list[Array] = []

    def take(self, left: float, top: float, right: float, bottom: float) -> None:
        """A box is not free any more."""
        self.taken[self._box(left, top, right, bottom)] = True

    def cover(self, corner: Point, cells: Indices) -> None:
        """Cells [h, w] are there from a corner on."""
        rows, columns = np.nonzero(cells != EMPTY)
        squares = (rows + int(corner[1])) // _GRAIN, (columns + int(corner[0])) // _GRAIN
        self.taken[squares] = True
        self.cells[squares] = cells[rows, columns]

    def trace(self, points: Array) -> None:
        """A trajectory passes these points [N, 2]."""
        for a, b in pairwise(points):
            squares = self._along(a, b)
            self.taken[squares], self.cells[squares] = True, EMPTY

    def join(self, corner: Point, width: float, height: float, leader: Array) -> None:
        """A figure stands in a box, and a leader [2, 2] goes from it to its site."""
        for squares in (self._box(*corner, corner[0] + width, corner[1] + height), self._along(*leader)):
            self.taken[squares], self.cells[squares] = True, EMPTY
        self.figures[self._box(*corner, corner[0] + width, corner[1] + height)] = True
        self.leaders.append(leader)

    def near(self, posture: int, site: Array, width: float, height: float) -> Point | None:
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
                return _pair(corners[n])
        return None

    def _box(self, left: float, top: float, right: float, bottom: float) -> tuple[slice, slice]:
        rows = slice(max(floor(top / _GRAIN), 0), ceil(bottom / _GRAIN))
        return rows, slice(max(floor(left / _GRAIN), 0), ceil(right / _GRAIN))

    def _along(self, a: Array, b: Array) -> tuple[Ints, Ints]:
        """The squares between two points, as rows and columns."""
        share = np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(b - a) / _GRAIN))[:, None]
        columns, rows = np.floor((a + share * (b - a)) / _GRAIN).astype(np.int64).T
        return rows, columns


def _cross(a: Array, b: Array, c: Array, d: Array) -> bool:
    """Whether the segments from a to b and from c to d cross."""

    def side(p: Array, q: Array, r: Array) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0


def _roundness(number: int) -> int:
    """How round a number is."""
    return sum(number % step == 0 for step in (2, 5, 10, 20, 50, 100, 500, 1000))


def _round_numbers(low: float, high: float) -> Array:
    """Some multiples of 1, 2 or 5 and a power of ten, from low to high."""
    rough = (high - low) / 6.0
    power = 10.0 ** floor(log10(rough))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= rough)
    return np.asarray(step * np.arange(ceil(low / step), floor(high / step) + 1))


def _figure(posture: Posture) -> Pixels:
    """A posture as a small picture [FINE h, FINE w, 4], three quarters from the front, with nothing behind it."""
    body = body_of(posture.skeleton)
    cones, balls = seen(*body.solids(posture.rotations, posture.root), VIEWS["quarter"], posture.root)
    low, high = np.concatenate([cones.reach(), balls.reach()], axis=-2)[..., :2]
    (left, bottom), (right, top) = low.min(axis=0), high.max(axis=0)
    scale, rim = SMOOTH * FINE * _FIGURE / body.height, 2 * SMOOTH * FINE
    width, height = (SMOOTH * ceil((length * scale + 2 * rim) / SMOOTH) for length in (right - left, top - bottom))
    canvas = Canvas(left - rim / scale, top + rim / scale, width, height, scale)
    draw(canvas, cones, balls)
    paper = np.full((height, width, 3), PAPER, dtype=np.uint8)
    picture = colour(canvas, body, paper, line=3)
    drawn = 255 * (picture != paper).any(axis=-1, keepdims=True).repeat(3, axis=-1).astype(np.uint8)
    opacity = halved(drawn)[..., :1]
    share = np.maximum(opacity, 1) / 255.0
    inks = (halved(picture) - (1.0 - share) * np.array(PAPER)) / share
    return np.concatenate([np.clip(np.rint(inks), 0, 255).astype(np.uint8), opacity], axis=-1)


def _edge(pixels: Pixels, corner: Array, site: Array) -> Array:
    """Where a leader from a site ends, just before what is drawn of a figure: x, y, pixels."""
    rows, columns = np.nonzero(pixels[..., 3])
    places = corner + np.stack([columns, rows], axis=1) / FINE
    nearest = places[np.argmin(np.linalg.norm(places - site, axis=1))]
    away = site - nearest
    return np.asarray(nearest + away * min(_CLEAR / max(float(np.linalg.norm(away)), 1e-9), 1.0))


def _pair(at: Array) -> Point:
    return float(at[0]), float(at[1])


# --- the itineraries --------------------------------------------------------------------------------------------------


def _itineraries(portrait: Portrait, top: float) -> Iterator[Mark]:
    """Which posture comes when: the piece's are a straight line, the variation's runs lie beside it."""
    order, count = portrait.order, len(portrait.sites)
    long = max(len(order), count)
    left, right, bottom = _MARGIN + 40.0, _WIDTH - _MARGIN, top + _GRAPH
    x_step, y_step = (right - left) / max(long - 1, 1), _GRAPH / max(count - 1, 1)

    def at(n: float, posture: float) -> Point:
        return left + x_step * n, bottom - y_step * posture

    size = float(np.clip(0.35 * x_step, 1.0, 3.0))
    yield Line(np.array([at(0, 0), (right, bottom)]), _EDGE, 0.8)
    yield Line(np.array([at(0, 0), at(0, count - 1)]), _EDGE, 0.8)
    for tick in _round_numbers(0.0, max(long - 1.0, 1.0)):
        yield Words((at(tick, 0)[0], bottom + 14.0), f"{tick:g}", _SMALL, _PALE, "middle")
    for tick in _round_numbers(0.0, max(count - 1.0, 1.0)):
        yield Words((left - 10.0, at(0, tick)[1]), f"{tick:g}", _SMALL, _PALE, "end")
    yield Words((left, top - 40.0), "posture of the piece", _LETTERS, _PALE)
    yield Words((right, bottom + 34.0), "place in the movement", _LETTERS, _PALE, "end")
    yield Line(np.array([at(0, 0), at(count - 1, count - 1)]), PIECE, 2.6)
    starts = [0, *sorted(portrait.jumps), len(order)]
    for before, after in pairwise(starts):
        run = np.array([at(n, order[n]) for n in range(before, after)])
        if before:
            yield Line(np.array([at(before - 1, order[before - 1]), run[0]]), mixed(OTHER, 0.45), 0.7, 2.0)
        if len(run) > 1:
            yield Line(run, OTHER, 1.3)
        for n, place in enumerate(run, before):
            if n != before or not before:
                yield _point(_pair(place), 0.8 * size)
        if before:
            seam = portrait.jumps[before]
            yield _jump(_pair(run[0]), 1.3 * size, f"jump from posture {seam.start} to {seam.end}, seam {seam.number}")
    if portrait.parting is not None:
        n = portrait.parting
        yield Line(np.array([(at(n, 0)[0], bottom), (at(n, 0)[0], top - 8.0)]), _INK, 0.8, 3.0)
        yield from _parting(at(n, float(order[n])), 5.0)
        yield Words((at(n, 0)[0], top - 18.0), f"they part at {n}", _LETTERS, _INK, "middle")
