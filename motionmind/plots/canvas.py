"""A plate: marks on paper, written as SVG and as PNG from the same numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from motionmind.arguments import check_path
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.plots.brush import Brush
from motionmind.plots.marks import Mark
from motionmind.render.lettering import FONT_FAMILY
from motionmind.render.markup import hexadecimal, xml_text
from motionmind.render.palette import PAPER


@dataclass(frozen=True, eq=False)
class Plate:
    """A picture and its marks, later ones over earlier ones.

    Attributes:
        width, height: size, pixels.
        title: the title in the SVG.
        marks: the marks.
        headings: marks that come first in the SVG, as they are read, but last in the PNG, over all others.
        style: attributes that all marks inherit in the SVG.

    >>> from motionmind import Engine
    >>> from motionmind.plots import Plate, draw_angles
    >>> engine = Engine.load("ballet")
    >>> motion = engine.tween(engine.posture("ballet/arabesque"), engine.posture("ballet/fifth")).motion
    >>> isinstance(draw_angles(motion), Plate)
    True
    """

    width: int
    height: int
    title: str
    marks: tuple[Mark, ...]
    headings: tuple[Mark, ...] = ()
    style: str = f'stroke-linejoin="round" stroke-linecap="round" {FONT_FAMILY}'

    def save(self, path: FilePath) -> None:
        """Write the picture; MotionMindError if the suffix is neither `.svg` nor `.png`, or it cannot be written."""
        check_path("path", path)
        suffix = Path(path).suffix.lower()
        if suffix not in (".svg", ".png"):
            raise MotionMindError(f"{path}: suffix {suffix!r} is unknown; this picture is written as .svg or .png")
        write_atomically(path, self.encode(suffix))

    def encode(self, suffix: str) -> bytes:
        """Return the contents of a file with the suffix `.svg` or `.png`."""
        return svg(self).encode() if suffix == ".svg" else png(self)

    def __repr__(self) -> str:
        return f"<Picture of {self.width} x {self.height} pixels: {self.title}>"

    def _repr_svg_(self) -> str:
        return svg(self)


def svg(plate: Plate) -> str:
    """Write a plate as SVG; the titles of marks show under the pointer."""
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {plate.width} {plate.height}"'
        f' width="{plate.width}" height="{plate.height}" role="img" {plate.style}>',
        f"<title>{xml_text(plate.title)}</title>",
        f'<rect width="100%" height="100%" fill="{hexadecimal(PAPER)}"/>',
    ]
    for mark in (*plate.headings, *plate.marks):
        lines += mark.svg()
    return "\n".join([*lines, "</svg>"]) + "\n"


def png(plate: Plate) -> bytes:
    """Write a plate as PNG."""
    brush = Brush(plate.width, plate.height)
    for mark in (*plate.marks, *plate.headings):
        mark.paint(brush)
    return brush.png()
