"""The attractor in a picture: the postures' cells, both trajectories through them, and some of the postures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil

import numpy as np

from motionmind._typing import Floats, Int16s, Pixels
from motionmind.body.motion import Posture
from motionmind.plots import symbols
from motionmind.plots.brush import N_SUBSAMPLES, as_point
from motionmind.plots.marks import LETTER_WIDTH_RATIO, Dot, Inset, Line, Mark, Region, Words
from motionmind.plots.portrait import Portrait
from motionmind.plots.scene import Labels, Room
from motionmind.plots.symbols import TEXT_PX, TICK_PX
from motionmind.render.body_shape import shape_of
from motionmind.render.body_solids import BodyShape
from motionmind.render.camera import SAMPLES_PER_PX
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import colour, draw, halved
from motionmind.render.palette import INK, PAPER, PLOT
from motionmind.render.solids import bounding_box
from motionmind.render.trace import outlines, smooth
from motionmind.render.view import VIEWS, to_view


@dataclass(frozen=True)
class PageLengths:
    """Lengths of the picture, pixels.

    Attributes:
        width: its width.
        top, height: the field's upper edge and its height.
        attractor: greatest width and height of the attractor.
        air: free edge around the attractor.
        to_axes: from the attractor to the axes.
        figure: height of a body at rest.
        to_leader: from a figure to its leader.
    """

    width: int = 1400
    top: float = 150.0
    height: float = 900.0
    attractor: tuple[float, float] = (960.0, 820.0)
    air: int = 6
    to_axes: float = 22.0
    figure: float = 104.0
    to_leader: float = 4.0


PAGE_PX = PageLengths()
_MAX_FIGURES = 16


class Field:
    """The attractor in the picture, and the marks on it.

    Attributes:
        portrait: the variation on its attractor.
        low, high: least and greatest values [2] of the two coordinates shown.
        scale: pixels to a unit of these.
        width, height: size of the attractor with some air around it, pixels.
        corner: its upper left corner in the picture, x and y in pixels.
        visits: how often the variation visits each cell [N].
    """

    def __init__(self, portrait: Portrait) -> None:
        self.portrait = portrait
        places = portrait.seen(np.concatenate([portrait.sheets, portrait.other]))
        self.low, self.high = places.min(axis=0), places.max(axis=0)
        self.scale = float(min(PAGE_PX.attractor / np.maximum(self.high - self.low, 1e-12)))
        size = self.scale * (self.high - self.low)
        self.width, self.height = (ceil(length) + 2 * PAGE_PX.air for length in size)
        self.corner = (
            float(round(0.5 * (PAGE_PX.width - self.width))),
            PAGE_PX.top + round(0.5 * (PAGE_PX.height - self.height)),
        )
        self.visits = np.bincount(portrait.order, minlength=len(portrait.sites))

    def at(self, points: Floats) -> Floats:
        """Project points [..., d] of the flow to the picture [..., 2], pixels."""
        return self._in_picture(self.portrait.seen(points))

    def _in_picture(self, places: Floats) -> Floats:
        """Convert the two coordinates shown [..., 2] to pixels [..., 2]."""
        shown = (places - [self.low[0], self.high[1]]) * [self.scale, -self.scale]
        return np.asarray(shown + self.corner + PAGE_PX.air)

    @cached_property
    def cells(self) -> Int16s:
        """The posture whose cell each pixel is in [height, width], from `corner` on; EMPTY beside the attractor."""
        corner = np.array([self.low[0] - PAGE_PX.air / self.scale, self.high[1] + PAGE_PX.air / self.scale])
        return self.portrait.cells(corner, self.scale, self.width, self.height)

    def marks(self) -> Iterator[Mark]:
        """Yield all marks."""
        yield from self._cells()
        yield from self._frame()
        yield from self._trajectories()
        yield from self._figures_and_numbers()

    def _cells(self) -> Iterator[Mark]:
        regions = smooth(outlines(self.cells))
        areas = regions.areas()
        for n in np.argsort(-np.abs(areas), kind="stable"):  # regions in a hole lie over it
            outline, posture = regions.one(n), int(regions.labels[n])
            hole = areas[n] < 0.0
            yield Region(
                outline,
                self.corner,
                PAPER if hole else symbols.tint(int(self.visits[posture])),
                PLOT.edge,
                0.7,
                "" if hole else self._describe_posture(posture),
            )

    def _frame(self) -> Iterator[Mark]:
        """Yield both axes, as far as the attractor reaches, with round numbers."""
        across, up, _ = self.portrait.axes
        names = [self.portrait.flow.dimensions[i] for i in (across, up)]
        for axis, outwards in ((0, (0.0, 1.0)), (1, (-1.0, 0.0))):
            out = np.array(outwards)
            ends = self._on_axis(axis, np.array([self.low[axis], self.high[axis]])) + PAGE_PX.to_axes * out
            ticks = symbols.round_numbers(self.low[axis], self.high[axis])
            yield Line(ends, PLOT.pale, 0.8)
            for tick, at in zip(ticks, self._on_axis(axis, ticks) + PAGE_PX.to_axes * out, strict=True):
                yield Line(np.stack([at, at + 5.0 * out]), PLOT.pale, 0.8)
                yield Words(
                    as_point(at + 12.0 * out), f"{tick:g}", TICK_PX, PLOT.pale, "middle" if axis == 0 else "end"
                )
            yield Words(
                as_point(ends[1] + 14.0 * np.abs(out[::-1]) * [1.0, -1.0]),
                names[axis],
                TEXT_PX,
                PLOT.pale,
                "middle",
            )

    def _on_axis(self, axis: int, values: Floats) -> Floats:
        """Project values [N] of a coordinate to the attractor's lower or left edge [N, 2], pixels."""
        places = np.tile(self.low, (len(values), 1))
        places[:, axis] = values
        return self._in_picture(places)

    @cached_property
    def size(self) -> float:
        """The radius of a site, pixels: smaller the more there are."""
        return float(np.clip(40.0 / np.sqrt(len(self.portrait.sites)), 1.0, 4.0))

    def _trajectories(self) -> Iterator[Mark]:
        portrait, size = self.portrait, self.size
        yield Line(self.at(portrait.piece), PLOT.piece, 0.75 * size)
        yield Line(self.at(portrait.other), PLOT.variation, 0.36 * size)
        for posture, at in enumerate(self.at(portrait.sites)):
            yield symbols.site(as_point(at), size, self._describe_posture(posture))
        for n, at in enumerate(self.at(portrait.points)):
            if n in portrait.jumps:
                yield symbols.jump(as_point(at), 1.2 * size, self._describe_point(n))
            else:
                yield symbols.point(as_point(at), 0.65 * size, self._describe_point(n))
        if portrait.parting is not None:
            yield from symbols.parting(as_point(self.at(portrait.points[portrait.parting])), 6.0)

    def _describe_posture(self, posture: int) -> str:
        """Describe a posture: its time in the piece, and its places in the variation."""
        piece = self.portrait.variation.piece
        time = float(piece.motion.times[piece.frames[posture]])
        places = np.flatnonzero(self.portrait.order == posture).tolist()
        listed = ", ".join(map(str, places[:12])) + (", ..." if len(places) > 12 else "")
        return (
            f"posture {posture} of the piece, {time:.2f} s\nin the variation: {f'at {listed}' if places else 'never'}"
        )

    def _describe_point(self, n: int) -> str:
        """Describe a point of the variation."""
        text = f"at {n} in the variation: posture {self.portrait.order[n]}"
        if n in self.portrait.jumps:
            seam = self.portrait.jumps[n]
            text += f"\njump from posture {seam.start} to {seam.end}, seam {seam.number}"
        return text

    def _figures_and_numbers(self) -> Iterator[Mark]:
        """Yield figures of some postures, joined to their sites, and the numbers of others."""
        portrait = self.portrait
        sites, size = self.at(portrait.sites), self.size
        room = Room(PAGE_PX.width, ceil(PAGE_PX.top + PAGE_PX.height))
        room.take(0.0, 0.0, PAGE_PX.width, PAGE_PX.top - 10.0)
        room.take(
            self.corner[0] - 44.0, self.corner[1] - 20.0, self.corner[0] - 10.0, PAGE_PX.top + PAGE_PX.height
        )  # the axes
        room.take(0.0, self.corner[1] + self.height + 10.0, PAGE_PX.width, PAGE_PX.top + PAGE_PX.height)
        room.cover(self.corner, self.cells)
        room.trace(self.at(portrait.piece))
        room.trace(self.at(portrait.other))
        marked: set[int] = set()
        piece = portrait.variation.piece
        body = shape_of(piece.motion.skeleton)
        for posture in self._far_apart():
            pixels = _figure(body, piece.ends(posture, posture)[0])
            figure = Inset((0.0, 0.0), pixels, self._describe_posture(posture))
            wide, high = figure.size
            place = room.near(posture, sites[posture], wide + 2 * PAGE_PX.to_leader, high + 1.6 * TEXT_PX)
            if place is None:
                continue
            left, top = place[0] + PAGE_PX.to_leader, place[1]
            leader = np.stack([_edge(pixels, np.array([left, top]), sites[posture]), sites[posture]])
            room.join(place, wide + 2 * PAGE_PX.to_leader, high + 1.6 * TEXT_PX, leader)
            marked.add(posture)
            yield Line(leader, INK, 0.8)
            yield Dot(
                as_point(sites[posture]),
                max(1.25 * size, 3.0),
                PLOT.piece,
                INK,
                1.2,
                self._describe_posture(posture),
            )
            yield replace(figure, at=(left, top))
            yield Words((left + 0.5 * wide, top + high + 0.8 * TEXT_PX), str(posture), TEXT_PX, INK, "middle")
            if len(marked) == _MAX_FIGURES:
                break
        yield from self._numbers(sites, marked)

    def _far_apart(self) -> Iterator[int]:
        """Yield postures to show as figures: the first, that of the parting, then each the farthest from all before."""
        portrait = self.portrait
        sites = self.at(portrait.sites)
        first = [0] + ([int(portrait.order[portrait.parting])] if portrait.parting is not None else [])
        far = np.full(len(sites), np.inf)
        for _ in range(min(len(sites), 8 * _MAX_FIGURES)):
            posture = first.pop(0) if first else int(np.argmax(far))
            if far[posture] > 0.0:
                yield posture
            far = np.minimum(far, np.linalg.norm(sites - sites[posture], axis=1))

    def _numbers(self, sites: Floats, marked: set[int]) -> Iterator[Mark]:
        """Yield numbers beside sites where there is room, the roundest first."""
        size, left_over = self.size, 160
        labels = Labels(sites, size)
        for posture in sorted(range(len(sites)), key=lambda n: (-_roundness(n), n)):
            if posture in marked or not left_over:
                continue
            text, (x, y) = str(posture), sites[posture]
            width, half, off = LETTER_WIDTH_RATIO * TICK_PX * len(text) + 2.0, 0.5 * TICK_PX, size + 2.0
            beside = (x + off, y), (x - off - width, y)
            above_and_below = (x - 0.5 * width, y - off - half), (x - 0.5 * width, y + off + half)
            place = labels.place([*beside, *above_and_below], width, half)
            if place:
                left_over -= 1
                yield Words(place, text, TICK_PX, INK)


def _figure(body: BodyShape, posture: Posture) -> Pixels:
    """Draw a posture as a small picture [N_SUBSAMPLES h, N_SUBSAMPLES w, 4], RGBA, three quarters from the front."""
    cones, balls = to_view(*body.solids(posture.rotations, posture.root), VIEWS["quarter"], posture.root)
    (left, bottom), (right, top) = bounding_box(cones, balls)[:, :2]
    scale, rim = SAMPLES_PER_PX * N_SUBSAMPLES * PAGE_PX.figure / body.height, 2 * SAMPLES_PER_PX * N_SUBSAMPLES
    width, height = (
        SAMPLES_PER_PX * ceil((length * scale + 2 * rim) / SAMPLES_PER_PX) for length in (right - left, top - bottom)
    )
    buffer = DepthBuffer(left - rim / scale, top + rim / scale, width, height, scale)
    draw(buffer, cones, balls)
    paper = np.full((height, width, 3), PAPER, dtype=np.uint8)
    picture = colour(buffer, body, paper, line=3)
    drawn = 255 * (picture != paper).any(axis=-1, keepdims=True).repeat(3, axis=-1).astype(np.uint8)
    opacity = halved(drawn)[..., :1]
    share = np.maximum(opacity, 1) / 255.0
    inks = (halved(picture) - (1.0 - share) * np.array(PAPER)) / share
    return np.concatenate([np.clip(np.rint(inks), 0, 255).astype(np.uint8), opacity], axis=-1)


def _edge(pixels: Pixels, corner: Floats, site: Floats) -> Floats:
    """Return the end [2], pixels, of the leader from a site to a figure, just before the figure's nearest pixel."""
    rows, columns = np.nonzero(pixels[..., 3])
    places = corner + np.stack([columns, rows], axis=1) / N_SUBSAMPLES
    nearest = places[np.argmin(np.linalg.norm(places - site, axis=1))]
    away = site - nearest
    return np.asarray(nearest + away * min(PAGE_PX.to_leader / max(float(np.linalg.norm(away)), 1e-9), 1.0))


def _roundness(number: int) -> int:
    """Count the round numbers (2, 5, 10, ...) that divide a number."""
    return sum(number % step == 0 for step in (2, 5, 10, 20, 50, 100, 500, 1000))
