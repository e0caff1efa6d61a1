"""Draw a staff: three lines, read from the bottom up, with signs as long as their movements; on pages.

The columns, from the centre line outward, are supports and leg gestures within the staff, then the body and the arms,
and the head at the right.

Source: A. Hutchinson Guest, "Labanotation: the system of analyzing and recording movement", 4th ed., Routledge (2005).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.laban import DRAWINGS
from motionmind.laban.shapes import SIGN_EDGE_PX, Box, draw_sign
from motionmind.laban.signs import (
    COLUMNS,
    PATH,
    SUPPORTS,
    TURN,
    TWISTS,
    Direction,
    Hold,
    Sign,
    Staff,
    Turn,
    Value,
    overlapping,
)
from motionmind.plots.brush import Brush
from motionmind.plots.canvas import Plate, svg
from motionmind.plots.marks import Group, Line, Mark, Words
from motionmind.render.markup import xml_text
from motionmind.render.palette import INK, SHEET
from motionmind.render.print_sheet import PAGE_HEIGHT_PX, PAGE_WIDTH_PX, pdf

if TYPE_CHECKING:
    from PIL import Image

MAX_PAGES = 100
_MAX_PAINTED_PAGES = {".png": 10, ".pdf": 20}  # a page takes 17 MB
_PRINT_SCALE = 2  # pixels of a printed page for each of a drawing
_COLUMN_PX = 22.0
_EDGES = {  # of columns, in widths of a column right of the centre line
    "left arm": -4.0,
    "torso": -3.0,
    "left leg": -2.0,
    "left support": -1.0,
    "right support": 0.0,
    "right leg": 1.0,
    "torso turn": 2.0,
    "right arm": 3.0,
    "head": 4.0,
    "head turn": 5.0,
    PATH: 6.0,
}
_STAFF_WIDTH = (-4.0, 7.0)
_INSET_PX = 2.5  # between a sign and the edges of its column
_NUMBERS_PX = 34.0  # left of a staff, for its counts
_GAP_PX = 26.0  # between staves
_STAFF_MARGIN_PX = 36.0
_STAFF_TITLE_PX = 54.0
_LETTER_PX = 8.8  # width of a letter of the title
_START_PX = 44.0  # below a staff, for the starting position
_START_SIGN_PX = 30.0
_LABEL_PX = 44.0  # below that, for the names of the columns
_COUNT_RANGE_PX = (40.0, 170.0)  # least and greatest length of a count
_SHORT_SIGN_PX = 22.0  # length of a short sign
_LEAST_SIGN_PX = 3.0
_HOLD_PX = 12.0


_Turns = dict[Sign, tuple[float, float]]  # the left and the right edge of each, in widths of a column


@dataclass(frozen=True, eq=False)
class Drawing:
    """A staff, drawn.

    Attributes:
        pages: its pages, one after the other, of one size.
    """

    pages: tuple[Plate, ...]

    def encode(self, suffix: str) -> bytes:
        """Return the contents of a file with one of the suffixes `DRAWINGS`; pages stand below each other or follow.

        Raises:
            MotionMindError: it has more pages than such a file may.
        """
        if suffix == ".svg":
            return self._svg().encode()
        first, count, most = self.pages[0], len(self.pages), _MAX_PAINTED_PAGES[suffix]
        if count > most:
            others = " or ".join(one for one in DRAWINGS if count <= _MAX_PAINTED_PAGES.get(one, MAX_PAGES))
            raise MotionMindError(f"{count} pages, and at most {most} are drawn as {suffix}; write {others}")
        from PIL import Image

        pictures = (_painted(page) for page in self.pages)
        if suffix == ".pdf":
            return pdf([*pictures], first.title)
        whole = Image.new("RGB", (_PRINT_SCALE * first.width, _PRINT_SCALE * first.height * count))
        for number, picture in enumerate(pictures):
            whole.paste(picture, (0, number * picture.height))
        data = BytesIO()
        whole.save(data, "PNG")
        return data.getvalue()

    def _svg(self) -> str:
        if len(self.pages) == 1:
            return svg(self.pages[0])
        width, height = self.pages[0].width, self.pages[0].height
        total = height * len(self.pages)
        lines = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {total}" width="{width}" height="{total}">'
        ]
        for number, page in enumerate(self.pages):
            lines += [f'<g transform="translate(0 {number * height})">', svg(page).rstrip(), "</g>"]
        return "\n".join([*lines, "</svg>"]) + "\n"


def _painted(page: Plate) -> Image.Image:
    """Return a page as pixels."""
    brush = Brush(page.width, page.height)
    for mark in (*page.marks, *page.headings):
        mark.paint(brush)
    return brush.picture(_PRINT_SCALE)


@dataclass(frozen=True)
class _Layout:
    """Division of a staff.

    Attributes:
        count: length of a count, pixels.
        breaks: the counts where staves begin, and the end.
        per_page: staves side by side on a page.
    """

    count: float
    breaks: tuple[float, ...]
    per_page: int

    @property
    def height(self) -> float:
        """Height of the longest staff, pixels."""
        return self.count * max(float(np.diff(self.breaks).max()), 1.0)


def draw_staff(staff: Staff) -> Drawing:
    """Draw a staff.

    Raises:
        MotionMindError: it has more than 100 pages.
    """
    layout = _layout(staff)
    title = f"{displayed(staff.title, 80) or 'Movement'}: Labanotation"
    staves = len(layout.breaks) - 1
    count = ceil(staves / layout.per_page)
    if count > MAX_PAGES:
        raise MotionMindError(f"{count} pages, and at most {MAX_PAGES} are drawn; choose a shorter clip")
    width, height = PAGE_WIDTH_PX // _PRINT_SCALE, PAGE_HEIGHT_PX // _PRINT_SCALE
    if count == 1:
        width = 2 * ceil(_STAFF_MARGIN_PX) + ceil(
            max(staves * _staff_px() - _GAP_PX, _LETTER_PX * min(len(staff.title), 44))
        )
        height = ceil(_STAFF_TITLE_PX + layout.height + _START_PX + _LABEL_PX + 2 * _STAFF_MARGIN_PX)
    turns = _place_turns(staff)
    pages = []
    for page in range(count):
        marks: list[Mark] = []
        bottom = height - _STAFF_MARGIN_PX - _LABEL_PX - _START_PX
        for place in range(min(layout.per_page, staves - page * layout.per_page)):
            centre = _STAFF_MARGIN_PX + _NUMBERS_PX - _STAFF_WIDTH[0] * _COLUMN_PX + place * _staff_px()
            marks += _draw_part(staff, layout, turns, page * layout.per_page + place, centre, bottom)
        tempo = f"{staff.tempo:g} counts a minute, bars of {staff.bar}"
        pages.append(Plate(width, height, title, tuple(marks), (*_headings(staff.title, tempo, page, count, width),)))
    return Drawing(tuple(pages))


def _headings(title: str, tempo: str, page: int, count: int, width: int) -> Iterator[Mark]:
    yield Words((_STAFF_MARGIN_PX, _STAFF_MARGIN_PX), displayed(title, max(44, int(width / _LETTER_PX) - 8)), 16.0, INK)
    about = tempo if count == 1 else f"{tempo}; page {page + 1} of {count}"
    yield Words((_STAFF_MARGIN_PX, _STAFF_MARGIN_PX + 22.0), about, 12.0, SHEET.pale)


def _staff_px() -> float:
    """Return the width of a staff with its counts and the gap to the next, pixels."""
    return _NUMBERS_PX + (_STAFF_WIDTH[1] - _STAFF_WIDTH[0]) * _COLUMN_PX + _GAP_PX


def _layout(staff: Staff) -> _Layout:
    """Choose the length of a count so that most signs are long enough, and break the staff at bar lines."""
    lengths = [sign.counts for sign in staff.signs] or [1.0]
    count = float(np.clip(_SHORT_SIGN_PX / np.percentile(lengths, 10), *_COUNT_RANGE_PX))
    room = PAGE_HEIGHT_PX / _PRINT_SCALE - 2 * _STAFF_MARGIN_PX - _STAFF_TITLE_PX - _START_PX - _LABEL_PX
    bars = max(1, floor(room / (count * staff.bar)))
    count = min(count, room / (bars * staff.bar))
    step = bars * staff.bar
    breaks = [float(step * number) for number in range(max(1, ceil(round(staff.counts / step, 6))))]
    per_page = max(1, floor((PAGE_WIDTH_PX / _PRINT_SCALE - 2 * _STAFF_MARGIN_PX + _GAP_PX) / _staff_px()))
    return _Layout(count, (*breaks, staff.counts), per_page)


def _draw_part(
    staff: Staff, layout: _Layout, turns: _Turns, number: int, centre: float, bottom: float
) -> Iterator[Mark]:
    """Yield the marks of one staff, from one break to the next.

    Args:
        staff: the signs.
        layout: how they are divided.
        turns: where the turns of the body stand.
        number: which part.
        centre: place of the centre line, pixels.
        bottom: place of the staff's lower end, pixels.
    """
    first, last = layout.breaks[number], layout.breaks[number + 1]

    def y(count: float) -> float:
        return bottom - layout.count * (count - first)

    def box(edges: tuple[float, float], top: float, low: float) -> Box:
        left, right = (centre + edge * _COLUMN_PX for edge in edges)
        return Box(left + _INSET_PX, top, right - _INSET_PX, low)

    yield from _lines(staff, first, last, centre, y(first), y(last), layout.count)
    if number == 0:
        for column, value in staff.start.items():
            edges = _EDGES[column], _EDGES[column] + 1.0
            below = box(edges, bottom + 7.0, bottom + 7.0 + _START_SIGN_PX)
            yield _group(f"{column}, start: {value}", value, below, on_left=edges[0] < 0.0, css="start")
    for column in COLUMNS:
        signs = staff.column(column)
        for place in overlapping(signs, first, last):
            sign = signs[place]
            begin, edges = sign.begin, turns.get(sign, (_EDGES.get(column, -1.0), _EDGES.get(column, -1.0) + 1.0))
            if isinstance(sign.value, Hold):
                begin = _after_turns(sign, turns)
                if not first <= begin < min(sign.end, last):
                    continue
            low = y(max(begin, first))
            top = min(y(min(sign.end, last)) + 1.0, low - _LEAST_SIGN_PX)
            top = max(top, low - _HOLD_PX) if isinstance(sign.value, Hold) else top  # which stands where it begins
            title = f"{column}, counts {sign.begin:g} to {sign.end:g}: {sign.value}"
            css = "hold" if isinstance(sign.value, Hold) else "sign" if begin >= first else "continued"
            faced = _left(signs[place - 1].value if place else staff.start.get(column)) if column in TWISTS else 0
            yield _group(title, sign.value, box(edges, top, low - 0.5), on_left=edges[0] < 0.0, css=css, faces=faced)


def _left(value: Value | None) -> int:
    return value.left if isinstance(value, Turn) else 0


def _place_turns(staff: Staff) -> _Turns:
    """Return the edges of the body's turn signs, in widths of a column right of the centre line.

    They stand across the support columns; but where a step has to stand there, beside the path, at the right.
    """
    supports = [staff.column(name) for name in SUPPORTS]
    steps = [[sign for sign in signs if isinstance(sign.value, Direction)] for signs in supports]
    paths = staff.column(PATH)
    out: _Turns = {}
    for sign in staff.column(TURN):
        if any(overlapping(column, sign.begin, sign.end) for column in steps):
            out[sign] = (7.0, 8.0) if overlapping(paths, sign.begin, sign.end) else (6.0, 7.0)
        else:
            bears = [bool(overlapping(column, sign.begin, sign.end)) for column in supports]
            out[sign] = (-1.0, 1.0) if bears[0] == bears[1] else (-1.0, 0.0) if bears[0] else (0.0, 1.0)
    return out


def _after_turns(hold: Sign, turns: _Turns) -> float:
    """Return the count where a hold is drawn: after the turns on its foot, which show that it keeps its weight."""
    begin = hold.begin
    across = [turn for turn, (left, _) in turns.items() if left < 1.0]
    for place in overlapping(across, hold.begin, hold.end):
        if across[place].begin <= begin:
            begin = across[place].end
    return begin


def _group(title: str, value: Value, box: Box, *, on_left: bool, css: str, faces: int = 0) -> Group:
    """Return a sign's marks, with its words for the pointer."""
    marks = draw_sign(value, box, on_left=on_left, faces=faces)
    return Group(f'class="{css}"', (_Title(title), *marks))


@dataclass(frozen=True)
class _Title:
    """Text that shows under the pointer."""

    text: str

    def svg(self) -> Iterator[str]:
        """Yield the title as SVG."""
        yield f"<title>{xml_text(self.text)}</title>"

    def paint(self, brush: Brush) -> None:
        """Draw nothing."""


def _lines(
    staff: Staff, first: float, last: float, centre: float, bottom: float, top: float, count: float
) -> Iterator[Mark]:
    """Yield the staff's lines, bar lines, ticks and numbers of counts, and the names of the columns."""
    left, right = centre - 2 * _COLUMN_PX, centre + 2 * _COLUMN_PX
    start = bottom + (_START_PX if first == 0.0 else 0.0)
    for x in (left, centre, right):
        yield Line(np.array([(x, start), (x, top)]), INK, SIGN_EDGE_PX)
    for y in (bottom, bottom + 3.0) if first == 0.0 else (bottom,):
        yield Line(np.array([(left, y), (right, y)]), INK, SIGN_EDGE_PX)
    if last == staff.counts:
        for y, width in ((top, SIGN_EDGE_PX), (top - 4.0, 2.5)):
            yield Line(np.array([(left, y), (right, y)]), INK, width)
    numbers = centre + _STAFF_WIDTH[0] * _COLUMN_PX - 8.0
    for number in range(ceil(first), ceil(last)):
        y = bottom - count * (number - first)
        if number % staff.bar == 0:
            yield Line(np.array([(left, y), (right, y)]), INK, SIGN_EDGE_PX)
            yield Words((numbers - 16.0, y - 8.0), str(number // staff.bar + 1), 11.0, SHEET.pale, "end")
        else:
            yield Line(np.array([(centre - 4.0, y), (centre + 4.0, y)]), INK, SIGN_EDGE_PX)
        yield Words((numbers, y - 8.0), str(number % staff.bar + 1), 11.0, INK, "end")
    for place, column in enumerate(_EDGES):
        if column not in staff.start and not any(staff.column(column)):
            continue
        x = centre + (_EDGES[column] + 0.5) * _COLUMN_PX
        words = column.removeprefix("left ").removeprefix("right ")
        yield Words((x, bottom + _START_PX + 14.0 + 12.0 * (place % 3)), words, 10.0, SHEET.pale, "middle")
