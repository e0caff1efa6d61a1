"""Marks of a plate: lines, regions, dots, text and small pictures, each drawn as SVG and as PNG.

Coordinates are pixels of the finished picture, x to the right and y down.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from typing import Protocol

import numpy as np

from motionmind._typing import Floats, Pixels
from motionmind.body.palette import Colour
from motionmind.plots.brush import N_SUBSAMPLES, Anchor, Brush, Point
from motionmind.render.bspline import UNITS_PER_PX, path
from motionmind.render.markup import base64_of, hexadecimal, xml_text
from motionmind.render.palette import PAPER
from motionmind.render.trace import Lines

LETTER_WIDTH_RATIO = 0.54  # approximate width of a letter, by its height
_HALO_PX = 1.5  # width of the paper around text


class Mark(Protocol):
    """Anything that a plate can show."""

    def svg(self) -> Iterator[str]:
        """Yield its lines of SVG."""
        ...

    def paint(self, brush: Brush) -> None:
        """Draw it with a brush."""
        ...


@dataclass(frozen=True, eq=False)
class Group:
    """Marks that share attributes in SVG.

    Attributes:
        attributes: the attributes, as SVG writes them.
        marks: the marks.
    """

    attributes: str
    marks: tuple[Mark, ...]

    def svg(self) -> Iterator[str]:
        """Yield the group as SVG, a line a mark."""
        yield f"<g {self.attributes}>"
        for mark in self.marks:
            yield from mark.svg()
        yield "</g>"

    def paint(self, brush: Brush) -> None:
        """Draw its marks with a brush."""
        for mark in self.marks:
            mark.paint(brush)


@dataclass(frozen=True, eq=False)
class Line:
    """A line.

    Attributes:
        points: its points [N, 2], pixels.
        ink: its colour.
        width: its width, pixels.
        dash: length of its dashes and gaps, pixels; 0 if it is solid.
        title: what shows under the pointer.
    """

    points: Floats
    ink: Colour
    width: float
    dash: float = 0.0
    title: str = ""

    def svg(self) -> Iterator[str]:
        """Yield the line as SVG."""
        places = " ".join(f"{x:.1f},{y:.1f}" for x, y in self.points.tolist())
        dashes = f' stroke-dasharray="{self.dash:g}" stroke-linecap="butt"' if self.dash else ""
        yield (
            f'<polyline points="{places}" fill="none" stroke="{hexadecimal(self.ink)}"'
            f' stroke-width="{self.width:g}"{dashes}{_titled("polyline", self.title)}'
        )

    def paint(self, brush: Brush) -> None:
        """Draw the line with a brush."""
        for piece in self._dashes() if self.dash else [self.points]:
            brush.line(piece, self.ink, self.width)

    def _dashes(self) -> Iterator[Floats]:
        """Yield its dashes, each straight [2, 2]."""
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))])
        for start in np.arange(0.0, along[-1], 2.0 * self.dash):
            ends = [start, min(start + self.dash, along[-1])]
            yield np.stack([np.interp(ends, along, self.points[:, axis]) for axis in (0, 1)], axis=1)


@dataclass(frozen=True, eq=False)
class Region:
    """An area with an edge.

    Attributes:
        outline: smooth closed lines around it, in pixels from `corner`.
        corner: the point of the picture from which the outline counts.
        fill, edge: its colours.
        width: width of its edge, pixels.
        title: what shows under the pointer.
    """

    outline: Lines
    corner: Point
    fill: Colour
    edge: Colour
    width: float
    title: str = ""

    def svg(self) -> Iterator[str]:
        """Yield the region as SVG."""
        x, y = self.corner
        yield (
            f'<path transform="translate({x:g} {y:g})scale({1 / UNITS_PER_PX:g})" fill="{hexadecimal(self.fill)}"'
            f' stroke="{hexadecimal(self.edge)}" stroke-width="{self.width * UNITS_PER_PX:g}"'
            f' d="{path(self.outline, UNITS_PER_PX)}"{_titled("path", self.title)}'
        )

    def paint(self, brush: Brush) -> None:
        """Draw the region with a brush."""
        starts = self.outline.starts
        for first, end in pairwise(starts):
            ring = self.outline.points[first:end] + self.corner
            brush.polygon(ring, self.fill)
            brush.line(np.concatenate([ring, ring[:2]]), self.edge, self.width, round_joints=False)


@dataclass(frozen=True, eq=False)
class Polygon:
    """A filled polygon with an edge.

    Attributes:
        corners: its corners [N, 2], pixels.
        fill, edge: its colours.
        width: width of its edge, pixels.
    """

    corners: Floats
    fill: Colour
    edge: Colour
    width: float

    def svg(self) -> Iterator[str]:
        """Yield the polygon as SVG."""
        places = " ".join(f"{x:.1f},{y:.1f}" for x, y in self.corners.tolist())
        yield (
            f'<polygon points="{places}" fill="{hexadecimal(self.fill)}" stroke="{hexadecimal(self.edge)}"'
            f' stroke-width="{self.width:g}"/>'
        )

    def paint(self, brush: Brush) -> None:
        """Draw the polygon with a brush."""
        brush.polygon(self.corners, self.fill)
        brush.line(np.concatenate([self.corners, self.corners[:2]]), self.edge, self.width)


@dataclass(frozen=True)
class Dot:
    """A disc with a rim.

    Attributes:
        at: its centre.
        radius: its radius, pixels, rim included.
        fill, rim: its colours.
        width: width of its rim, pixels.
        title: what shows under the pointer.
    """

    at: Point
    radius: float
    fill: Colour
    rim: Colour
    width: float = 0.0
    title: str = ""

    def svg(self) -> Iterator[str]:
        """Yield the dot as SVG."""
        x, y = self.at
        yield (
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{self.radius - 0.5 * self.width:g}" fill="{hexadecimal(self.fill)}"'
            f' stroke="{hexadecimal(self.rim)}" stroke-width="{self.width:g}"{_titled("circle", self.title)}'
        )

    def paint(self, brush: Brush) -> None:
        """Draw the dot with a brush."""
        brush.disc(self.at, self.radius, self.fill, self.rim, self.width)


@dataclass(frozen=True)
class Words:
    """A line of text.

    Attributes:
        at: the point at the middle of its height, and at the start, middle or end of its width as `anchor` says.
        text: the text.
        size: height of its letters, pixels.
        ink: its colour.
        anchor: which part of its width `at` is.
    """

    at: Point
    text: str
    size: float
    ink: Colour
    anchor: Anchor = "start"

    def svg(self) -> Iterator[str]:
        """Yield the text as SVG."""
        x, y = self.at
        yield (
            f'<text x="{x:.1f}" y="{y:.1f}" dy=".35em" font-size="{self.size:g}" text-anchor="{self.anchor}"'
            f' fill="{hexadecimal(self.ink)}" stroke="{hexadecimal(PAPER)}" stroke-width="{2 * _HALO_PX:g}"'
            f' paint-order="stroke" pointer-events="none">{xml_text(self.text)}</text>'
        )

    def paint(self, brush: Brush) -> None:
        """Write the text with a brush."""
        brush.text(self.at, self.text, self.size, self.ink, _HALO_PX, self.anchor)


@dataclass(frozen=True, eq=False)
class Inset:
    """A small picture.

    Attributes:
        at: its upper left corner.
        pixels: RGBA [N_SUBSAMPLES h, N_SUBSAMPLES w, 4].
        title: what shows under the pointer.
    """

    at: Point
    pixels: Pixels
    title: str = ""

    @property
    def size(self) -> Point:
        """Width and height in the finished picture, pixels."""
        height, width = self.pixels.shape[:2]
        return width / N_SUBSAMPLES, height / N_SUBSAMPLES

    def svg(self) -> Iterator[str]:
        """Yield the picture as SVG."""
        (x, y), (width, height) = self.at, self.size
        yield (
            f'<image x="{x:.1f}" y="{y:.1f}" width="{width:.2f}" height="{height:.2f}"'
            f' href="data:image/png;base64,{_png_base64(self.pixels)}"{_titled("image", self.title)}'
        )

    def paint(self, brush: Brush) -> None:
        """Paste the picture with a brush."""
        brush.paste(self.at, self.pixels)


def _titled(element: str, title: str) -> str:
    """Return the end of an element, with its title if it has one."""
    return f"><title>{xml_text(title)}</title></{element}>" if title else "/>"


def _png_base64(pixels: Pixels) -> str:
    from PIL import Image

    data = BytesIO()
    Image.fromarray(pixels).save(data, "PNG", optimize=True)
    return base64_of(data.getvalue())
