"""Contact sheets: every posture of a clip from the front, from the side, and its feet on the floor from above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from math import ceil, sqrt
from typing import Literal

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from motionmind._typing import Floats, Pixels
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.render.body_shape import BodyShape, shape_of
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import (
    ABOVE,
    BRIDGED,
    COLOURS,
    FRONT,
    INSERTED,
    STAGE_LEFT,
    STAGE_RIGHT,
    View,
    bridge_balls,
    colour,
    draw,
    halved,
    inserted,
    plain,
    seen,
)
from motionmind.render.solids import EMPTY, Cones, Ellipsoids

Side = Literal["right", "left"]

MOST = 400  # postures on a sheet: nobody looks through more
_PIXELS = 60e6  # of a sheet: more make a picture that viewers refuse
_NARROW = 100.0  # pixels that the side view is wide at least, for the words under it
_TALL = 200.0  # pixels of a body's height
_LARGEST = 480.0  # pixels that one view may be wide or high, where a body leaps or lies
_SMOOTH = 2  # samples a pixel, each way, which `halved` brings together
_MARGIN = 6  # pixels
_CAPTION, _LINE = 24, 17  # pixels
_PAPER, _FLOOR, _GROUND, _FRAME = (255, 255, 255), (120, 116, 112), (240, 237, 233), (214, 210, 206)
_PLUMB, _SUNK, _WORDS, _PALE = (30, 140, 90), (214, 0, 132), (40, 38, 40), (118, 114, 112)
_Words = tuple[float, str, tuple[int, int, int]]  # place in pixels, words, colour
_STANDS = 0.03  # share of the body's height within which a foot is on the floor
_SINKS = 0.006  # share of the body's height by which it may be under the floor without a mark


def contact_sheet(
    motion: Motion,
    frames: Sequence[int] | None = None,
    *,
    columns: int | None = None,
    side: Side = "right",
    first: int = 0,
) -> Image.Image:
    """A picture of postures of a motion, in rows from left to right, each numbered with its frame and its time.

    Each is drawn twice on the same floor and at the same scale, from the front, as the audience sees it, and from one
    side of the stage; under the front view, the feet that stand on the floor are drawn from above. The pictures follow
    the root sideways. A dot is the body's centre of mass, a dashed line leads from it to the floor; what is under the
    floor is marked. What the engine inserted is violet, with balls around joints amid a move that no corpus attests.

    Args:
        motion: movement on any skeleton.
        frames: numbers of the frames that are drawn; all by default.
        columns: postures in a row; by default as many as make the sheet about as wide as a screen.
        side: the side of the stage, "right" or "left" for the performer who faces the audience, from which the side
            view is taken.
        first: the number of the motion's first frame, where it is a part of something longer.

    Raises:
        MotionMindError: there are more than 400 frames to draw, or none, or one that the motion has not; or there is no
            such side, or no column.
    """
    if side not in ("right", "left") or (columns is not None and columns < 1):
        raise MotionMindError(f"a sheet has one column at least, and is seen from the right or left, not {side!r}")
    chosen = list(range(len(motion))) if frames is None else list(frames)
    check_frames(motion, chosen)
    sheet = _Sheet(motion, chosen, STAGE_RIGHT if side == "right" else STAGE_LEFT, first)
    return sheet.picture(columns)


def png(picture: Image.Image) -> bytes:
    """A contact sheet as a file."""
    data = BytesIO()
    # A third of the bytes, and to the eye the same. Of the ways to choose 256 colours, median cut loses those that are
    # rare, as what is under the floor, and maximum coverage tints the ground; an octree keeps both. A quarter of the
    # pixels are enough to choose by.
    quarter = picture.resize((ceil(picture.width / 2), ceil(picture.height / 2)), Image.Resampling.NEAREST)
    palette = quarter.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    picture.quantize(palette=palette, dither=Image.Dither.NONE).save(data, "PNG", compress_level=4)
    return data.getvalue()


def evenly(frames: range, most: int) -> Sequence[int]:
    """So many of the frames, from the first to the last; all of them where there are no more."""
    if most >= len(frames):
        return frames
    return [frames[round(at * (len(frames) - 1) / max(most - 1, 1))] for at in range(most)]


def check_frames(motion: Motion, frames: Sequence[int]) -> None:
    """MotionMindError where a contact sheet cannot show these frames of a motion: too many, none, or not there."""
    name = motion.name or "the motion"
    if not frames:
        raise MotionMindError(f"{name}: no frame to draw")
    if len(frames) > MOST:
        every = ceil(len(frames) / MOST)
        raise MotionMindError(
            f"{name}: a sheet holds {MOST} postures, not {len(frames)}; take fewer, as with --every {every}"
        )
    for frame in frames:
        if not 0 <= frame < len(motion):
            raise MotionMindError(f"{name} has frames 0 to {len(motion) - 1}, no frame {frame}")


@dataclass(frozen=True)
class _Window:
    """What one view shows: metres about the root, and pixels.

    `half` is half its width, `top` its upper edge's height above the view's origin, in metres; `width` and `height` are
    pixels of the finished picture, `scale` of them to a metre.
    """

    view: View
    half: float
    top: float
    width: int
    height: int
    scale: float

    @property
    def floor(self) -> int:
        """The first row of samples under the floor; the last of the window where the floor is far from it."""
        row, last = round(self.pixel(0.0, 0.0)[1]), _SMOOTH * self.height
        return row if 0 <= row <= last else last

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Where a point of the view, metres, is in its picture, in samples."""
        return (x + self.half) * self.scale * _SMOOTH, (self.top - y) * self.scale * _SMOOTH


def _window(view: View, half: float, low: float, high: float, scale: float) -> _Window:
    """The window on `half` metres to either side and from `low` to `high`, with a margin, in whole pixels.

    The origin lies on a pixel's edge, so that the line of the floor is sharp.
    """
    width = 2 * (ceil(half * scale) + _MARGIN)
    above, below = ceil(high * scale) + _MARGIN, ceil(-low * scale) + _MARGIN
    return _Window(view, 0.5 * width / scale, above / scale, width, above + below, scale)


class _Sheet:
    """The postures to draw, placed, and the windows that they are seen through: the same for all of them."""

    def __init__(self, motion: Motion, frames: list[int], side: View, first: int = 0) -> None:
        self.motion, self.frames, self.first = motion, frames, first
        self.body: BodyShape = shape_of(motion.skeleton)
        root = motion.root[frames]
        self.cones, self.balls = self.body.solids(motion.rotations[frames], root)
        self.joints = motion.skeleton.positions(motion.rotations[frames], root)
        self.inserted, self.bridged = motion.inserted()[frames], motion.bridged()[frames]
        self.paints = [plain(self.body), inserted(self.body)]
        self.middle = self.body.centre_of_mass(self.cones, self.balls)
        self.origin = root * [1.0, 0.0, 1.0]  # the floor under the root
        self.standing = self._standing()

        front, beside = self._reach(FRONT), self._reach(side)
        low, high = float(front[0, ..., 1].min()), float(front[1, ..., 1].max())
        if abs(low) < high - low:  # else the floor is so far off that it would leave no room for the body
            low, high = min(low, 0.0), max(high, 0.0)
        halves = [float(np.abs(reach[..., 0]).max()) for reach in (front, beside)]
        near, far = self._feet_reach()
        scale = min(
            _TALL / self.body.height,
            _LARGEST / max(high - low, *(2.0 * half for half in halves)),
            sqrt(_PIXELS / len(frames) / (2.0 * sum(halves) * (high - low + far - near))),
        )
        halves[1] = max(halves[1], 0.5 * _NARROW / scale)
        self.windows = [_window(view, half, low, high, scale) for view, half in zip((FRONT, side), halves, strict=True)]
        self.easels: dict[_Window, tuple[DepthBuffer, Pixels]] = {}
        self.plan = _window(ABOVE, halves[0], near, far, scale) if far > near else None

    def picture(self, columns: int | None) -> Image.Image:
        """The whole sheet."""
        count = len(self.frames)
        wide = sum(window.width for window in self.windows)
        tall = self.windows[0].height + max(self.plan.height if self.plan else 0, _CAPTION)
        columns = min(columns or max(1, round(sqrt(1.5 * count * tall / wide))), count)
        lines = self._legend(columns * wide)
        header = _LINE * (len(lines) + 2)
        sheet = Image.new("RGB", (columns * wide + 1, header + ceil(count / columns) * tall + 1), _PAPER)
        pen = ImageDraw.Draw(sheet)
        pen.text((6, 4), self.motion.name or self.motion.skeleton.name, _WORDS, ImageFont.load_default(15))
        for number, line in enumerate(lines):
            for x, words, ink in line:
                pen.text((x, _LINE * (number + 1) + 9), words, ink, _small())
        for at in range(count):
            corner = at % columns * wide, header + at // columns * tall
            self._tile(sheet, pen, at, corner)
            pen.rectangle((*corner, corner[0] + wide, corner[1] + tall), outline=_FRAME)
        return sheet

    def _tile(self, sheet: Image.Image, pen: ImageDraw.ImageDraw, at: int, corner: tuple[int, int]) -> None:
        x, y = corner
        for window in self.windows:
            sheet.paste(self._view(at, window), (x, y))
            x += window.width
        y += self.windows[0].height
        if self.plan:
            pen.rectangle((corner[0], y, x, y + self.plan.height), _GROUND)
            sheet.paste(self._above(at, self.plan), (corner[0], y))
        x = corner[0] + self.windows[0].width
        frame = self.frames[at]
        pen.text((x + 4, y + 3), f"{self.first + frame}", _WORDS, ImageFont.load_default(15))
        right = x + self.windows[1].width - 5
        pen.text((right, y + 6), f"{self.motion.times[frame]:.2f} s", _PALE, _small(), anchor="ra")

    def _view(self, at: int, window: _Window) -> Image.Image:
        """One posture from the front or from the side, on the floor."""
        canvas, background = self._easel(window)
        draw(canvas, *self._solids(at, window.view))
        picture = self._colour(canvas, at, background)
        floor = window.floor
        sunk = floor + ceil(_SINKS * self.body.height * window.scale * _SMOOTH)
        under = canvas.solid[sunk:]
        picture[sunk:][(under != EMPTY) & (under < len(self.body.parts))] = _SUNK  # and not the balls of bridges
        image = Image.fromarray(picture)
        self._plumb(ImageDraw.Draw(image), at, window, floor)
        return _smooth(image)

    def _above(self, at: int, window: _Window) -> Image.Image:
        """The feet of one posture that are on the floor, and the centre of mass, from above."""
        canvas, background = self._easel(window)
        draw(canvas, *self._solids(at, ABOVE), self.standing[at])
        image = Image.fromarray(self._colour(canvas, at, background))
        pen = ImageDraw.Draw(image)
        x, y = window.pixel(*self._middle(at, ABOVE))
        arm = 4 * _SMOOTH
        pen.line((x - arm, y, x + arm, y), _PLUMB, _SMOOTH)
        pen.line((x, y - arm, x, y + arm), _PLUMB, _SMOOTH)
        return _smooth(image)

    def _colour(self, canvas: DepthBuffer, at: int, background: Pixels) -> Pixels:
        return colour(canvas, self.body, background, paints=self.paints[int(self.inserted[at])])

    def _easel(self, window: _Window) -> tuple[DepthBuffer, Pixels]:
        """A canvas with nothing on it, the same one for all postures, and what is behind it."""
        if window not in self.easels:
            self.easels[window] = _canvas(window), _background(window)
        canvas, background = self.easels[window]
        canvas.clear()
        return canvas, background

    def _plumb(self, pen: ImageDraw.ImageDraw, at: int, window: _Window, floor: int) -> None:
        x, y = window.pixel(*self._middle(at, window.view))
        dash = 4 * _SMOOTH
        for start in np.arange(y, floor, 2 * dash):
            pen.line((x, start, x, min(start + dash, floor)), _PLUMB, _SMOOTH)
        dot = 2.5 * _SMOOTH
        pen.ellipse((x - dot, y - dot, x + dot, y + dot), _PLUMB, _PAPER, 1)

    def _legend(self, width: int) -> list[list[_Words]]:
        """What the picture shows, in lines that fit its width: words with their place in pixels and their colour."""
        words = [(window.view.name, _PALE) for window in self.windows]
        words += [("below: feet on the floor, from above, the audience below", _PALE)] * bool(self.plan)
        words += [("performer's left", COLOURS["left"]), ("performer's right", COLOURS["right"])]
        words += [("dot: centre of mass", _PLUMB), ("under the floor", _SUNK)]
        words += [("violet: inserted", INSERTED["middle"])] * bool(self.inserted.any())
        words += [("ball: bridged, no corpus has this move", BRIDGED)] * bool(self.bridged.any())
        lines: list[list[_Words]] = [[]]
        x = 6.0
        for phrase, ink in words:
            length = _small().getlength(phrase)
            if lines[-1] and x + length > width:
                lines.append([])
                x = 6.0
            lines[-1].append((x, phrase, ink))
            x += length + 14.0
        return lines

    def _reach(self, view: View) -> Floats:
        """Least and greatest coordinates [2, F, N, 3] in a view's axes, metres, of the solids and of bridges' balls."""
        bridges = bridge_balls(self.body, self.joints, np.asarray(self.bridged.any(axis=0)))
        cones, balls = seen(self.cones, self.balls, view, self.origin)
        return np.concatenate(
            [cones.reach(), balls.reach(), seen(cones, bridges, view, self.origin)[1].reach()], axis=-2
        )

    def _solids(self, at: int, view: View) -> tuple[Cones, Ellipsoids]:
        cones, balls = self.cones, self.balls
        one = Cones(cones.a[at], cones.b[at], cones.a_radius, cones.b_radius)
        own = Ellipsoids(balls.centre[at], balls.axes[at])
        return seen(one, own.joined(bridge_balls(self.body, self.joints[at], self.bridged[at])), view, self.origin[at])

    def _middle(self, at: int, view: View) -> tuple[float, float]:
        x, y, _ = view.axes @ (self.middle[at] - self.origin[at])
        return float(x), float(y)

    def _standing(self) -> list[frozenset[int]]:
        """For each posture, the solids of the feet that are on the floor."""
        low = self._reach(FRONT)[0, ..., 1]
        feet: dict[str, list[int]] = {}
        for solid, part in enumerate(self.body.parts):
            if part.endswith("_foot"):
                feet.setdefault(part, []).append(solid)
        limit = _STANDS * self.body.height
        return [frozenset(i for foot in feet.values() if row[foot].min() < limit for i in foot) for row in low]

    def _feet_reach(self) -> tuple[float, float]:
        """The least and greatest y of the view from above, metres, of the feet on the floor and the centre of mass."""
        if not any(self.standing):
            return 0.0, 0.0
        low, high = self._reach(ABOVE)[..., 1]
        ys = [(low[at, solid], high[at, solid]) for at, solids in enumerate(self.standing) for solid in solids]
        ys += [(y, y) for _, y in (self._middle(at, ABOVE) for at in range(len(self.frames)))]
        return float(np.min(ys)), float(np.max(ys))


def _canvas(window: _Window) -> DepthBuffer:
    rows, columns = _SMOOTH * window.height, _SMOOTH * window.width
    return DepthBuffer(-window.half, window.top, columns, rows, _SMOOTH * window.scale)


def _background(window: _Window) -> Pixels:
    """Paper above the floor, and the ground under it; from above, the ground alone."""
    picture = np.full((_SMOOTH * window.height, _SMOOTH * window.width, 3), _GROUND, dtype=np.uint8)
    if window.view is not ABOVE:
        picture[: window.floor] = _PAPER
        picture[window.floor : window.floor + _SMOOTH] = _FLOOR
    return picture


def _smooth(image: Image.Image) -> Image.Image:
    """A picture of samples as one of pixels."""
    return Image.fromarray(halved(np.array(image)))


@cache
def _small() -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(12)
