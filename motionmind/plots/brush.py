"""The brush that draws PNGs: on a picture of `FINE` samples a pixel, which is averaged at the end."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from io import BytesIO
from typing import TYPE_CHECKING, Literal

from motionmind._typing import Floats, Pixels
from motionmind.body.palette import Colour
from motionmind.render.palette import PAPER

if TYPE_CHECKING:
    from PIL import ImageFont

Point = tuple[float, float]  # x to the right and y down, pixels of the finished picture
Anchor = Literal["start", "middle", "end"]

FINE = 3  # samples to a pixel, along each side
_ANCHORS = {"start": "lm", "middle": "mm", "end": "rm"}


class Brush:
    """Draws on an empty sheet of paper; coordinates and sizes are pixels of the finished picture."""

    def __init__(self, width: int, height: int) -> None:
        """A sheet of `width` by `height` pixels."""
        from PIL import Image, ImageDraw

        self._size = width, height
        self._image = Image.new("RGB", (FINE * width, FINE * height), PAPER)
        self._pen = ImageDraw.Draw(self._image)

    def line(self, points: Floats, ink: Colour, width: float, *, round_joints: bool = True) -> None:
        """Draw a line through points [N, 2]."""
        joint = "curve" if round_joints else None
        self._pen.line((FINE * points).ravel().tolist(), ink, max(1, round(FINE * width)), joint=joint)

    def polygon(self, corners: Floats, fill: Colour) -> None:
        """Fill a polygon [N, 2]."""
        self._pen.polygon((FINE * corners).ravel().tolist(), fill)

    def disc(self, at: Point, radius: float, fill: Colour, rim: Colour, width: float) -> None:
        """Draw a disc with a rim of some width within its radius."""
        x, y = at
        for r, ink in ((radius, rim), (radius - width, fill)):
            self._pen.ellipse((FINE * (x - r), FINE * (y - r), FINE * (x + r), FINE * (y + r)), ink)

    def text(self, at: Point, text: str, size: float, ink: Colour, halo: float, anchor: Anchor = "start") -> None:
        """Write a line of text, the middle of its height at `at`, with a halo of paper."""
        self._pen.text(
            (FINE * at[0], FINE * at[1]),
            text,
            ink,
            font(round(FINE * size)),
            anchor=_ANCHORS[anchor],
            stroke_width=round(FINE * halo),
            stroke_fill=PAPER,
        )

    def paste(self, at: Point, pixels: Pixels) -> None:
        """Paste a picture [FINE h, FINE w, 4], RGBA, its upper left corner at `at`."""
        from PIL import Image

        inset = Image.fromarray(pixels)
        self._image.paste(inset, (round(FINE * at[0]), round(FINE * at[1])), inset)

    def png(self) -> bytes:
        """Average the samples to pixels, and encode them as PNG."""
        from PIL import Image

        data = BytesIO()
        self._image.resize(self._size, Image.Resampling.BOX).save(data, "PNG")
        return data.getvalue()


def mixed(ink: Sequence[int], opacity: float, paper: Sequence[int] = PAPER) -> Colour:
    """Return the colour of an ink of some opacity, 0 to 1, on paper."""
    r, g, b = (round(opacity * i + (1.0 - opacity) * p) for i, p in zip(ink, paper, strict=True))
    return r, g, b


@cache
def font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Load the font of PNGs at a size in samples."""
    from PIL import ImageFont

    return ImageFont.load_default(size)
