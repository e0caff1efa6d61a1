"""A variation on its attractor as a picture, after figures 3 and 4 of Bradley and Stuart, Chaos 8:800 (1998).

Above, the attractor with the cell of each posture, both trajectories, and some of the postures; below, both
itineraries: the posture at each time, the point where they part, and the variation's jumps.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import ceil
from pathlib import Path

import numpy as np

from motionmind.arguments import check_path, check_type
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.plots import symbols
from motionmind.plots.brush import Point, as_point, mixed
from motionmind.plots.canvas import Plate
from motionmind.plots.cells import PAGE_PX, Field
from motionmind.plots.marks import Dot, Line, Mark, Words
from motionmind.plots.portrait import Portrait, portrait_of
from motionmind.plots.symbols import TEXT_PX, TICK_PX
from motionmind.render.lettering import font
from motionmind.render.palette import INK, PLOT
from motionmind.variation.variation import Variation

ATTRACTORS = (".png", ".svg", ".html")  # suffixes that `draw_attractor` writes

_PAGE_MARGIN_PX = 44.0
_ITINERARIES_PX = 330.0  # their height


def draw_attractor(path: FilePath, variation: Variation) -> None:
    """Write a picture of a variation on its attractor (`.png`, `.svg`), or a page with both in motion (`.html`).

    A picture has both trajectories, the cell of each posture, some of the postures, and both itineraries; in `.svg`
    details show under the pointer. On the page the attractor turns in three dimensions, and a body dances beside it.

    Args:
        path: the file.
        variation: the variation, as from `vary` or `read_variation`.

    Raises:
        MotionMindError: the suffix is unknown, the trajectories cannot be computed again (see `portrait_of`), or the
            file cannot be written.

    >>> from motionmind import Engine, vary
    >>> from motionmind.plots import draw_attractor
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> draw_attractor("attractor.svg", vary(motion, nudge=1.0))
    """
    check_path("path", path)
    check_type("variation", variation, Variation)
    suffix = Path(path).suffix.lower()
    if suffix not in ATTRACTORS:
        raise MotionMindError(f"{path}: an attractor is written as one of {', '.join(ATTRACTORS)}")
    portrait = portrait_of(variation)
    if suffix == ".html":
        from motionmind.plots.attractor_page import attractor_page

        write_atomically(path, attractor_page(portrait).encode())
        return
    write_atomically(path, attractor(portrait).encode(suffix))


def attractor(portrait: Portrait) -> Plate:
    """Draw a portrait of a variation: the heading, the attractor, and the itineraries."""
    field = Field(portrait)
    top = PAGE_PX.top + PAGE_PX.height + 80.0  # of the itineraries
    marks = [*_heading(portrait), *field.marks(), *_itineraries(portrait, top)]
    height = ceil(top + _ITINERARIES_PX + 2 * _PAGE_MARGIN_PX)
    return Plate(PAGE_PX.width, height, _title(portrait), tuple(marks))


def _title(portrait: Portrait) -> str:
    name = displayed(portrait.variation.piece.motion.name) or "A piece"
    return f"{name} on the attractor of {portrait.flow.label}"


def _heading(portrait: Portrait) -> Iterator[Mark]:
    """Yield the title, a summary and the legend."""
    course, count = portrait.course, len(portrait.sites)
    yield Words((_PAGE_MARGIN_PX, _PAGE_MARGIN_PX), _title(portrait), 24, INK)
    nudge = ", ".join(f"{value:.4g}" for value in course.nudge)
    summary = f"{_count(count, 'posture')}, a site each, {portrait.every} steps of {course.step:g} apart. "
    if portrait.parting is None:
        summary += f"The variation begins ({nudge}) beside the piece and stays with it to its end"
        summary += f"; then it jumps {_count(len(portrait.jumps), 'time')}." if portrait.jumps else "."
    else:
        summary += (
            f"The variation begins ({nudge}) beside the piece, parts from it after "
            f"{_count(portrait.parting, 'posture')} of {len(portrait.points)}, "
            f"and jumps {_count(len(portrait.jumps), 'time')}."
        )
    cells = "the map, in all coordinates"
    if portrait.variation.control:
        cells = f"Dabby's mapping, in {portrait.flow.dimensions[0]} alone"
    about = (
        f"The cells are those of {cells}, where they cut the attractor; of its sheets that lie "
        "behind one another the one nearest to the viewer is drawn. Coordinates have no unit."
    )
    if portrait.variation.kept:
        summary += f" Its stretches have {_count(portrait.variation.kept.limits.stretch, 'posture')} at least."
        about += " A point may lie in a cell nearby."
    yield Words((_PAGE_MARGIN_PX, _PAGE_MARGIN_PX + 30), summary, TEXT_PX, INK)
    yield from _legend(_PAGE_MARGIN_PX, _PAGE_MARGIN_PX + 60)
    yield Words(
        (_PAGE_MARGIN_PX, _PAGE_MARGIN_PX + 84),
        about,
        TEXT_PX,
        PLOT.pale,
    )


def _legend(x: float, y: float) -> Iterator[Mark]:
    """Yield the legend, in a line from a point on."""
    for swatch, words in (
        ("piece", "the piece, a site for each posture"),
        ("other", "the variation: at each point the posture in whose cell it is"),
        ("jump", "where it jumps"),
        ("part", "where they part"),
        ("cell", "cells that it visits, the darker the more often"),
    ):
        line = np.array([[x, y], [x + 26, y]])
        if swatch == "piece":
            yield Line(line, PLOT.piece, 2.6)
            yield symbols.site((x + 13, y), 3.0)
        elif swatch == "other":
            yield Line(line, PLOT.variation, 1.3)
            yield symbols.point((x + 13, y), 2.4)
        elif swatch == "jump":
            yield symbols.jump((x + 13, y), 4.2)
        elif swatch == "part":
            yield from symbols.parting((x + 13, y), 6.0)
        else:
            for n, times in enumerate((0, 1, 3)):
                yield Dot((x + 4 + 9 * n, y), 5.5, symbols.tint(times), PLOT.edge, 0.8)
        yield Words((x + 33, y), words, TEXT_PX, PLOT.pale)
        x += 33 + 1.12 * font(TEXT_PX).getlength(words) + 20  # letters of a browser may be wider


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _itineraries(portrait: Portrait, top: float) -> Iterator[Mark]:
    """Yield the posture at each time: of the piece, one straight line; of the variation, a line for each run."""
    order, count = portrait.order, len(portrait.sites)
    long = max(len(order), count)
    left, right, bottom = _PAGE_MARGIN_PX + 40.0, PAGE_PX.width - _PAGE_MARGIN_PX, top + _ITINERARIES_PX
    x_step, y_step = (right - left) / max(long - 1, 1), _ITINERARIES_PX / max(count - 1, 1)

    def at(n: float, posture: float) -> Point:
        return left + x_step * n, bottom - y_step * posture

    size = float(np.clip(0.35 * x_step, 1.0, 3.0))
    yield Line(np.array([at(0, 0), (right, bottom)]), PLOT.edge, 0.8)
    yield Line(np.array([at(0, 0), at(0, count - 1)]), PLOT.edge, 0.8)
    for tick in symbols.round_numbers(0.0, max(long - 1.0, 1.0)):
        yield Words((at(tick, 0)[0], bottom + 14.0), f"{tick:g}", TICK_PX, PLOT.pale, "middle")
    for tick in symbols.round_numbers(0.0, max(count - 1.0, 1.0)):
        yield Words((left - 10.0, at(0, tick)[1]), f"{tick:g}", TICK_PX, PLOT.pale, "end")
    yield Words((left, top - 40.0), "posture of the piece", TEXT_PX, PLOT.pale)
    yield Words((right, bottom + 34.0), "place in the movement", TEXT_PX, PLOT.pale, "end")
    yield Line(np.array([at(0, 0), at(count - 1, count - 1)]), PLOT.piece, 2.6)
    starts = [0, *sorted(portrait.jumps), len(order)]
    for before, after in pairwise(starts):
        run = np.array([at(n, order[n]) for n in range(before, after)])
        if before:
            yield Line(np.array([at(before - 1, order[before - 1]), run[0]]), mixed(PLOT.variation, 0.45), 0.7, 2.0)
        if len(run) > 1:
            yield Line(run, PLOT.variation, 1.3)
        for n, place in enumerate(run, before):
            if n != before or not before:
                yield symbols.point(as_point(place), 0.8 * size)
        if before:
            seam = portrait.jumps[before]
            yield symbols.jump(
                as_point(run[0]), 1.3 * size, f"jump from posture {seam.start} to {seam.end}, seam {seam.number}"
            )
    if portrait.parting is not None:
        n = portrait.parting
        yield Line(np.array([(at(n, 0)[0], bottom), (at(n, 0)[0], top - 8.0)]), INK, 0.8, 3.0)
        yield from symbols.parting(at(n, float(order[n])), 5.0)
        yield Words((at(n, 0)[0], top - 18.0), f"they part at {n}", TEXT_PX, INK, "middle")
