"""Sheets to print: postures in rows under the names of sections, with notes, on pages or as one long picture."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO

from PIL import Image, ImageDraw

from motionmind.display import displayed
from motionmind.render.lettering import font
from motionmind.render.palette import SHEET, VIOLET

PAGE_WIDTH_PX, PAGE_HEIGHT_PX = 2806, 1984  # A4, lying, 240 to an inch
_EDGE_PX, _TITLE_PX, _SECTION_PX, _NOTE_LINE_PX = 90, 70, 50, 27
ROOM_PX = PAGE_WIDTH_PX - 2 * _EDGE_PX  # across a page, for pictures
NOTE_LETTERS_PX = 21
_MAX_NOTE_LINES = 8  # under a posture


@dataclass(frozen=True)
class PrintPosture:
    """A posture of a sheet.

    Attributes:
        count: its caption, such as a count.
        time: its time in words.
        heading: the name of the section that begins with it; "" for none.
        notes: texts under it.
    """

    count: str
    time: str
    heading: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Row:
    """Postures side by side, below a heading if there is one: their pictures, and the lines under each."""

    heading: str
    postures: list[tuple[Image.Image, list[str]]]

    @property
    def height(self) -> int:
        lines = max(len(lines) for _, lines in self.postures)
        return (_SECTION_PX if self.heading else 0) + self.postures[0][0].height + _NOTE_LINE_PX * lines + 14


def print_pages(pictures: Iterable[Image.Image], postures: Sequence[PrintPosture], title: str) -> list[Image.Image]:
    """Put pictures, one of each posture and all of one size, on pages of A4."""
    pages: list[list[_Row]] = [[]]
    room = PAGE_HEIGHT_PX - 2 * _EDGE_PX - _TITLE_PX
    for row in _rows(pictures, postures):
        if pages[-1] and sum(one.height for one in pages[-1]) + row.height > room:
            pages.append([])
        pages[-1].append(row)
    height = max(PAGE_HEIGHT_PX, *(sum(row.height for row in rows) + PAGE_HEIGHT_PX - room for rows in pages))
    count = len(pages)
    return [_page(rows, title, f"{number} of {count}", height) for number, rows in enumerate(pages, start=1)]


def print_picture(pictures: Iterable[Image.Image], postures: Sequence[PrintPosture], title: str) -> Image.Image:
    """Put the pictures on one sheet of a page's width; arguments as of `print_pages`."""
    rows = [*_rows(pictures, postures)]
    return _page(rows, title, "", sum(row.height for row in rows) + 2 * _EDGE_PX + _TITLE_PX)


def pdf(pages: Sequence[Image.Image], title: str) -> bytes:
    """Encode pages as PDF."""
    data = BytesIO()
    first, *others = pages
    first.save(data, "PDF", save_all=True, append_images=others, resolution=240, title=title, quality=90)
    return data.getvalue()


def _rows(pictures: Iterable[Image.Image], postures: Sequence[PrintPosture]) -> Iterator[_Row]:
    """Yield the rows; a section begins a new one."""
    row: _Row | None = None
    for posture, picture in zip(postures, pictures, strict=True):
        _caption(picture, posture)
        is_full = row is not None and (len(row.postures) + 1) * picture.width > ROOM_PX
        if row is not None and (is_full or posture.heading):
            yield row
            row = None
        if row is None:
            row = _Row(posture.heading, [])
        lines = [line for note in posture.notes for line in _wrapped(f"- {displayed(note)}", picture.width - 10)]
        if len(lines) > _MAX_NOTE_LINES:
            lines = [*lines[: _MAX_NOTE_LINES - 1], "…"]
        row.postures.append((picture, lines))
    if row is not None:
        yield row


def _caption(picture: Image.Image, posture: PrintPosture) -> None:
    """Write a posture's count and time at the lower edge of its picture, on the ground."""
    pen, bottom = ImageDraw.Draw(picture), picture.height - 6
    pen.text((picture.width // 2 + 4, bottom), displayed(posture.count, 16), SHEET.text, font(32), anchor="ls")
    pen.text((picture.width - 6, bottom), posture.time, SHEET.pale, font(21), anchor="rs")


def _wrapped(text: str, width: int) -> list[str]:
    """Break a text into lines that fit a width, pixels."""
    letters, lines = font(NOTE_LETTERS_PX), [""]
    for word in text.split():
        rest = word
        while rest:
            line = f"{lines[-1]} {rest}".strip()
            if letters.getlength(line) <= width:
                lines[-1], rest = line, ""
            elif lines[-1]:
                lines.append("")
            else:  # longer than a line
                end = next(n for n in range(len(rest), 0, -1) if n == 1 or letters.getlength(rest[:n]) <= width)
                lines[-1], rest = rest[:end], rest[end:]
                lines += [""] * bool(rest)
    return lines


def _page(rows: Sequence[_Row], title: str, number: str, height: int) -> Image.Image:
    page = Image.new("RGB", (PAGE_WIDTH_PX, height), SHEET.paper)
    pen = ImageDraw.Draw(page)
    x, y = _EDGE_PX, _EDGE_PX
    pen.text((x, y), displayed(title, 100), SHEET.text, font(38))
    pen.text((PAGE_WIDTH_PX - x, y + 6), number, SHEET.pale, font(24), anchor="ra")
    y += _TITLE_PX
    for row in rows:
        top = y
        if row.heading:
            pen.text((x, y + 6), displayed(row.heading, 100), VIOLET, font(30))
            top += _SECTION_PX
        for place, (picture, lines) in enumerate(row.postures):
            left = x + place * picture.width
            page.paste(picture, (left, top))
            pen.rectangle((left, top, left + picture.width, top + picture.height), outline=SHEET.frame)
            for at, line in enumerate(lines):
                pen.text(
                    (left + 5, top + picture.height + 4 + at * _NOTE_LINE_PX), line, SHEET.text, font(NOTE_LETTERS_PX)
                )
        y += row.height
    return page
