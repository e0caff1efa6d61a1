"""A plate: lines, regions, dots, words and small pictures on paper, written as SVG and as PNG from the same numbers.

Places are in pixels of the finished picture, x to the right and y down; what comes later lies over what comes before.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from typing import TYPE_CHECKING, Literal
from xml.sax.saxutils import escape

import numpy as np

from motionmind._typing import Floats, Pixels
from motionmind.render.ground import PAPER
from motionmind.render.trace import Lines, path

if TYPE_CHECKING:
    from PIL import ImageFont

Point = tuple[float, float]
Colour = tuple[int, int, int]
Anchor = Literal["start", "middle", "end"]

FINE = 3  # samples to a pixel of a PNG, along each side
LETTER = 0.54  # about the width of a letter, by its height
_UNITS = 10  # of a region's whole numbers to a pixel
_ANCHORS = {"start": "lm", "middle": "mm", "end": "rm"}
_HALO = 1.5  # pixels of paper round words


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points [N, 2], so many pixels wide; one that is dashed has dashes as long as gaps."""

    points: Floats
    ink: Colour
    width: float
    dash: float = 0.0
    title: str = ""


@dataclass(frozen=True, eq=False)
class Region:
    """What smooth closed lines enclose, from a corner of the picture on: filled, with an edge."""

    outline: Lines
    corner: Point
    fill: Colour
    edge: Colour
    width: float
    title: str = ""


@dataclass(frozen=True)
class Dot:
    """A disc with a rim within its radius."""

    at: Point
    radius: float
    fill: Colour
    rim: Colour
    width: float = 0.0
    title: str = ""


@dataclass(frozen=True)
class Words:
    """A line of words in the middle of whose height `at` is; `size` is that of its letters."""

    at: Point
    text: str
    size: float
    ink: Colour
    anchor: Anchor = "start"


@dataclass(frozen=True, eq=False)
class Inset:
    """A small picture [FINE h, FINE w, 4], red, green, blue and opacity, with its upper left corner `at`."""

    at: Point
    pixels: Pixels
    title: str = ""

    @property
    def size(self) -> Point:
        """Its width and height in the finished picture."""
        height, width = self.pixels.shape[:2]
        return width / FINE, height / FINE


Mark = Line | Region | Dot | Words | Inset


@dataclass(frozen=True, eq=False)
class Plate:
    """A picture of so many pixels, and all that is on it, in the order in which it is drawn."""

    width: int
    height: int
    title: str
    marks: tuple[Mark, ...]


def svg(plate: Plate) -> str:
    """The plate as SVG; titles show under the pointer."""
    return "\n".join([*_elements(plate), "</svg>"]) + "\n"


def _elements(plate: Plate) -> Iterator[str]:
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {plate.width} {plate.height}"'
        f' width="{plate.width}" height="{plate.height}" role="img" stroke-linejoin="round" stroke-linecap="round"'
        ' font-family="system-ui,Helvetica,Arial,sans-serif">'
    )
    yield f"<title>{plain(plate.title)}</title>"
    yield f'<rect width="100%" height="100%" fill="{hexadecimal(PAPER)}"/>'
    for mark in plate.marks:
        match mark:
            case Line(points, ink, width, dash, title):
                places = " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
                dashes = f' stroke-dasharray="{dash:g}" stroke-linecap="butt"' if dash else ""
                yield (
                    f'<polyline points="{places}" fill="none" stroke="{hexadecimal(ink)}"'
                    f' stroke-width="{width:g}"{dashes}{_titled("polyline", title)}'
                )
            case Region(outline, (x, y), fill, edge, width, title):
                yield (
                    f'<path transform="translate({x:g} {y:g})scale({1 / _UNITS:g})" fill="{hexadecimal(fill)}"'
                    f' stroke="{hexadecimal(edge)}" stroke-width="{width * _UNITS:g}"'
                    f' d="{path(outline, _UNITS)}"{_titled("path", title)}'
                )
            case Dot((x, y), radius, fill, rim, width, title):
                yield (
                    f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius - 0.5 * width:g}" fill="{hexadecimal(fill)}"'
                    f' stroke="{hexadecimal(rim)}" stroke-width="{width:g}"{_titled("circle", title)}'
                )
            case Words((x, y), text, size, ink, anchor):
                yield (
                    f'<text x="{x:.1f}" y="{y:.1f}" dy=".35em" font-size="{size:g}" text-anchor="{anchor}"'
                    f' fill="{hexadecimal(ink)}" stroke="{hexadecimal(PAPER)}" stroke-width="{2 * _HALO:g}"'
                    f' paint-order="stroke" pointer-events="none">{plain(text)}</text>'
                )
            case Inset((x, y), pixels, title):
                wide, high = mark.size
                yield (
                    f'<image x="{x:.1f}" y="{y:.1f}" width="{wide:.2f}" height="{high:.2f}"'
                    f' href="data:image/png;base64,{_base64(pixels)}"{_titled("image", title)}'
                )


def png(plate: Plate) -> bytes:
    """The plate as PNG."""
    from PIL import Image, ImageDraw

    k = FINE
    image = Image.new("RGB", (k * plate.width, k * plate.height), PAPER)
    pen = ImageDraw.Draw(image)
    for mark in plate.marks:
        match mark:
            case Line(points, ink, width, dash):
                for piece in _dashes(points, dash) if dash else [points]:
                    pen.line((k * piece).ravel().tolist(), ink, max(1, round(k * width)), joint="curve")
            case Region(outline, corner, fill, edge, width):
                for first, end in zip(outline.starts[:-1], outline.starts[1:], strict=True):
                    ring = k * (outline.points[first:end] + corner)
                    pen.polygon(ring.ravel().tolist(), fill)
                    pen.line(np.concatenate([ring, ring[:2]]).ravel().tolist(), edge, max(1, round(k * width)))
            case Dot((x, y), radius, fill, rim, width):
                for r, ink in ((radius, rim), (radius - width, fill)):
                    pen.ellipse((k * (x - r), k * (y - r), k * (x + r), k * (y + r)), ink)
            case Words((x, y), text, size, ink, anchor):
                pen.text(
                    (k * x, k * y),
                    text,
                    ink,
                    font(round(k * size)),
                    anchor=_ANCHORS[anchor],
                    stroke_width=round(k * _HALO),
                    stroke_fill=PAPER,
                )
            case Inset((x, y), pixels):
                inset = Image.fromarray(pixels)
                image.paste(inset, (round(k * x), round(k * y)), inset)
    data = BytesIO()
    image.resize((plate.width, plate.height), Image.Resampling.BOX).save(data, "PNG", optimize=True)
    return data.getvalue()


def _dashes(points: Floats, dash: float) -> Iterator[Floats]:
    """The dashes of a line through points, each straight."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    for start in np.arange(0.0, along[-1], 2.0 * dash):
        ends = [start, min(start + dash, along[-1])]
        yield np.stack([np.interp(ends, along, points[:, axis]) for axis in (0, 1)], axis=1)


def mixed(ink: Sequence[int], opacity: float, paper: Sequence[int] = PAPER) -> Colour:
    """The ink as it looks on paper."""
    r, g, b = (round(opacity * i + (1.0 - opacity) * p) for i, p in zip(ink, paper, strict=True))
    return r, g, b


def hexadecimal(rgb: Sequence[int]) -> str:
    """A colour as SVG writes it."""
    return "#" + "".join(f"{value:02x}" for value in rgb)


def plain(text: str) -> str:
    """Text in XML, which has no way to write control characters."""
    return escape(re.sub(r"[\x00-\x09\x0b-\x1f\x7f\ud800-\udfff\ufffe\uffff]", " ", text))


def _titled(element: str, title: str) -> str:
    """The end of an element, with its title if it has one."""
    return f"><title>{plain(title)}</title></{element}>" if title else "/>"


def _base64(pixels: Pixels) -> str:
    from PIL import Image

    data = BytesIO()
    Image.fromarray(pixels).save(data, "PNG", optimize=True)
    return b64encode(data.getvalue()).decode("ascii")


@cache
def font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The letters of PNGs."""
    from PIL import ImageFont

    return ImageFont.load_default(size)
