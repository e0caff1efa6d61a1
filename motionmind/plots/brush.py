"""The brush that draws PNGs: on a picture of `N_SUBSAMPLES`, whose samples are averaged at the end."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Literal

from motionmind._typing import Floats, Pixels
from motionmind.body.palette import Colour
from motionmind.render.lettering import font
from motionmind.render.palette import PAPER

if TYPE_CHECKING:
    from PIL import Image

Point = tuple[float, float]  # x to the right and y down, pixels of the finished picture
Anchor = Literal["start", "middle", "end"]

N_SUBSAMPLES = 3  # along each side


class Brush:
    """Draws on an empty sheet of paper; coordinates and sizes are pixels of the finished picture."""

    def __init__(self, width: int, height: int) -> None:
        """Make a sheet of `width` by `height` pixels."""
        from PIL import Image, ImageDraw

        self._size = width, height
        self._image = Image.new("RGB", (N_SUBSAMPLES * width, N_SUBSAMPLES * height), PAPER)
        self._pen = ImageDraw.Draw(self._image)

    def line(self, points: Floats, ink: Colour, width: float, *, round_joints: bool = True) -> None:
        """Draw a line through points [N, 2]."""
        joint = "curve" if round_joints else None
        self._pen.line((N_SUBSAMPLES * points).ravel().tolist(), ink, max(1, round(N_SUBSAMPLES * width)), joint=joint)

    def polygon(self, corners: Floats, fill: Colour) -> None:
        """Fill a polygon [N, 2]."""
        self._pen.polygon((N_SUBSAMPLES * corners).ravel().tolist(), fill)

    def disc(self, at: Point, radius: float, fill: Colour, rim: Colour, width: float) -> None:
        """Draw a disc with a rim of some width within its radius."""
        x, y = at
        for r, ink in ((radius, rim), (radius - width, fill)):
            self._pen.ellipse(
                (
                    N_SUBSAMPLES * (x - r),
                    N_SUBSAMPLES * (y - r),
                    N_SUBSAMPLES * (x + r),
                    N_SUBSAMPLES * (y + r),
                ),
                ink,
            )

    def text(self, at: Point, text: str, size: float, ink: Colour, halo: float, anchor: Anchor = "start") -> None:
        """Write a line of text, the middle of its height at `at`, with a halo of paper."""
        self._pen.text(
            (N_SUBSAMPLES * at[0], N_SUBSAMPLES * at[1]),
            text,
            ink,
            font(round(N_SUBSAMPLES * size)),
            anchor={"start": "lm", "middle": "mm", "end": "rm"}[anchor],
            stroke_width=round(N_SUBSAMPLES * halo),
            stroke_fill=PAPER,
        )

    def paste(self, at: Point, pixels: Pixels) -> None:
        """Paste a picture [N_SUBSAMPLES h, N_SUBSAMPLES w, 4], RGBA, its upper left corner at `at`."""
        from PIL import Image

        inset = Image.fromarray(pixels)
        self._image.paste(inset, (round(N_SUBSAMPLES * at[0]), round(N_SUBSAMPLES * at[1])), inset)

    def picture(self, scale: int = 1) -> Image.Image:
        """Average the samples to `scale` pixels for each pixel of the finished picture."""
        from PIL import Image

        width, height = self._size
        return self._image.resize((scale * width, scale * height), Image.Resampling.BOX)

    def png(self) -> bytes:
        """Average the samples to pixels, and encode them as PNG."""
        data = BytesIO()
        self.picture().save(data, "PNG")
        return data.getvalue()


def as_point(at: Floats) -> Point:
    """Return a point [2] as a tuple."""
    return float(at[0]), float(at[1])


def mixed(ink: Sequence[int], opacity: float, paper: Sequence[int] = PAPER) -> Colour:
    """Return the colour of an ink of some opacity, 0 to 1, on paper."""
    r, g, b = (round(opacity * i + (1.0 - opacity) * p) for i, p in zip(ink, paper, strict=True))
    return r, g, b
