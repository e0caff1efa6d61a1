"""Contact sheets: every posture of a clip from the front, from the side, and its feet on the floor from above."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from io import BytesIO
from math import ceil, sqrt
from numbers import Integral
from typing import Literal, NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from motionmind._typing import Floats, Pixels
from motionmind.arguments import check_integer, check_items, check_text, check_type
from motionmind.body.motion import Motion
from motionmind.body.palette import Colour
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.render.body_shape import shape_of
from motionmind.render.body_solids import BodyShape
from motionmind.render.camera import SAMPLES_PER_PX
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import bridge_balls, colour, draw, given_colours, halved, inserted_colours
from motionmind.render.lettering import font
from motionmind.render.palette import BRIDGED, COLOURS, SHEET, VIOLET
from motionmind.render.sheet_window import Window, window_around
from motionmind.render.solids import EMPTY_CODE, Cones, Ellipsoids, posture_solids
from motionmind.render.view import ABOVE, FRONT, STAGE_LEFT, STAGE_RIGHT, View, to_view

Side = Literal["right", "left"]

MAX_SHEET_POSTURES = 400  # on a sheet
_MAX_PIXELS = 60e6  # of a sheet: viewers refuse larger pictures
_CAPTION_PX, _LINE_PX = 24, 17  # heights of a caption and of a line of the legend
_Phrase = tuple[float, str, Colour]  # x in pixels, text, colour


def draw_sheet(
    motion: Motion,
    frames: Sequence[int] | None = None,
    *,
    columns: int | None = None,
    side: Side = "right",
    first: int = 0,
    captions: Sequence[str] | None = None,
) -> Image.Image:
    """Draw postures of a motion side by side, in rows, each with its frame number and time.

    All views have the same floor and scale: from the front, as the audience sees the posture, from one side of the
    stage, and, below the front view, the feet from above. The views follow the root horizontally. A dot marks the
    body's centre of mass, with a dashed line down to the floor; points under the floor are marked. Inserted movement is
    violet, with balls around joints amid a move that no corpus attests.

    Args:
        motion: the motion, on any skeleton.
        frames: numbers of the frames to draw, from 0; all by default.
        columns: postures a row; by default the sheet has about a screen's shape.
        side: the side of the stage for the side view, "right" or "left" as of the performer facing the audience.
        first: number of the motion's first frame in the longer motion that it is a part of.
        captions: a caption for each frame to draw, in place of its number and its time.

    Returns:
        The picture, RGB; `picture.save(path)` writes it.

    Raises:
        MotionMindError: there are no frames to draw, more than 400, or one that the motion does not have; there are
            more or fewer captions than frames; or the side or the number of columns is invalid.

    >>> import numpy as np
    >>> from motionmind import Posture, draw_sheet, human23
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> draw_sheet(posture.as_motion()).mode
    'RGB'
    """
    check_type("motion", motion, Motion)
    check_integer("columns", columns, or_none=True)
    check_text("side", side)
    check_integer("first", first)
    if frames is not None:
        check_items("frames", frames, "whole numbers", Integral)
    if captions is not None:
        check_items("captions", captions, "words", str)
    if side not in ("right", "left"):
        raise MotionMindError(f"side must be 'right' or 'left', not {side!r}")
    if columns is not None and columns < 1:
        raise MotionMindError(f"columns must be 1 or more, not {columns}")
    chosen = list(range(len(motion))) if frames is None else list(frames)
    check_frames(motion, chosen)
    if captions is not None and len(captions) != len(chosen):
        raise MotionMindError(f"a sheet of {len(chosen)} postures needs as many captions, not {len(captions)}")
    sheet = _Sheet(motion, chosen, STAGE_RIGHT if side == "right" else STAGE_LEFT, first, captions)
    return sheet.picture(columns)


class Row(NamedTuple):
    """A row of a sheet: a heading, the numbers of frames (None leaves a gap), and a caption for each."""

    heading: str
    frames: Sequence[int | None]
    captions: Sequence[str]


def row_sheet(motion: Motion, rows: Sequence[Row]) -> Image.Image:
    """Draw rows of postures of a motion, all as long as the first, each under its heading; see `draw_sheet`."""
    drawn = [
        (frame, caption)
        for row in rows
        for frame, caption in zip(row.frames, row.captions, strict=True)
        if frame is not None
    ]
    sheet = _Sheet(motion, [frame for frame, _ in drawn], STAGE_RIGHT, 0, [caption for _, caption in drawn])
    return sheet.rows(rows)


def tiles(motion: Motion) -> Iterator[Image.Image]:
    """Yield each posture of a motion as `draw_sheet` draws it, without a caption, all of one size."""
    check_frames(motion, range(len(motion)))
    sheet = _Sheet(motion, list(range(len(motion))), STAGE_RIGHT)
    sheet.notes = [("", "")] * len(motion)
    for at in range(len(motion)):
        wide, tall = sheet.size()
        picture = Image.new("RGB", (wide, tall), SHEET.paper)
        sheet.tile(picture, ImageDraw.Draw(picture), at, (0, 0))
        yield picture


def png(picture: Image.Image) -> bytes:
    """Encode a contact sheet as PNG, in 256 colours."""
    data = BytesIO()
    # 256 colours take a third of the bytes and look the same. Median cut loses rare colours, such as those of feet
    # under the floor, and maximum coverage tints the ground; an octree keeps both. A quarter of the pixels suffices
    # to choose the colours.
    quarter = picture.resize((ceil(picture.width / 2), ceil(picture.height / 2)), Image.Resampling.NEAREST)
    palette = quarter.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    picture.quantize(palette=palette, dither=Image.Dither.NONE).save(data, "PNG", compress_level=4)
    return data.getvalue()


def evenly(frames: range, most: int) -> Sequence[int]:
    """Choose up to `most` of the frames, evenly spread from the first to the last."""
    if most >= len(frames):
        return frames
    return [frames[round(at * (len(frames) - 1) / max(most - 1, 1))] for at in range(most)]


def check_frames(motion: Motion, frames: Sequence[int]) -> None:
    """Check that a contact sheet can show these frames of a motion.

    Raises:
        MotionMindError: there are no frames, more than 400, or one that the motion does not have.
    """
    name = motion.name or "the motion"
    if not frames:
        raise MotionMindError(f"{name}: no frame to draw")
    if len(frames) > MAX_SHEET_POSTURES:
        every = ceil(len(frames) / MAX_SHEET_POSTURES)
        raise MotionMindError(
            f"{name}: a sheet holds {MAX_SHEET_POSTURES} postures, not {len(frames)}; "
            f"take fewer, as with --every {every}"
        )
    for frame in frames:
        if not 0 <= frame < len(motion):
            raise MotionMindError(f"{name} has frames 0 to {len(motion) - 1}, no frame {frame}")


class _Sheet:
    """The postures to draw, placed in the world, and the windows that they share."""

    def __init__(
        self, motion: Motion, frames: list[int], side: View, first: int = 0, captions: Sequence[str] | None = None
    ) -> None:
        self.motion, self.frames = motion, frames
        # The captions of each posture, on the left and on the right.
        self.notes = [(f"{first + frame}", f"{motion.times[frame]:.2f} s") for frame in frames]
        if captions is not None:
            self.notes = [(displayed(caption, 16), "") for caption in captions]
        self.body: BodyShape = shape_of(motion.skeleton)
        root = motion.root[frames]
        self.cones, self.balls = self.body.solids(motion.rotations[frames], root)
        self.joints = motion.skeleton.positions(motion.rotations[frames], root)
        self.inserted, self.bridged = motion.inserted()[frames], motion.bridged()[frames]
        self.paints = [given_colours(self.body), inserted_colours(self.body)]
        self.centres = self.body.centre_of_mass(self.cones, self.balls)
        self.origin = root * [1.0, 0.0, 1.0]  # the floor under the root
        self.standing = self._standing()

        front, beside = self._bounds(FRONT), self._bounds(side)
        low, high = float(front[0, ..., 1].min()), float(front[1, ..., 1].max())
        if abs(low) < high - low:  # a floor farther away would leave no room for the body
            low, high = min(low, 0.0), max(high, 0.0)
        halves = [float(np.abs(bounds[..., 0]).max()) for bounds in (front, beside)]
        near, far = self._feet_bounds()
        scale = min(
            200.0 / self.body.height,  # a body has 200 pixels; a view at most 480, where a body leaps or lies
            480.0 / max(high - low, *(2.0 * half for half in halves)),
            sqrt(_MAX_PIXELS / len(frames) / (2.0 * sum(halves) * (high - low + far - near))),
        )
        halves[1] = max(halves[1], 0.5 * 100.0 / scale)  # 100 pixels at least, for the caption
        views = zip((FRONT, side), halves, strict=True)
        self.windows = [window_around(view, half, low, high, scale) for view, half in views]
        self.backdrops: dict[Window, tuple[DepthBuffer, Pixels]] = {}
        self.plan = window_around(ABOVE, halves[0], near, far, scale) if far > near else None

    def picture(self, columns: int | None) -> Image.Image:
        """Draw the whole sheet, `columns` postures a row, or about a screen's shape."""
        count = len(self.frames)
        wide, tall = self.size()
        columns = min(columns or max(1, round(sqrt(1.5 * count * tall / wide))), count)
        sheet, pen, header = self._paper(columns * wide, ceil(count / columns) * tall)
        for at in range(count):
            corner = at % columns * wide, header + at // columns * tall
            self.tile(sheet, pen, at, corner)
            pen.rectangle((*corner, corner[0] + wide, corner[1] + tall), outline=SHEET.frame)
        return sheet

    def rows(self, rows: Sequence[Row]) -> Image.Image:
        """Draw the sheet in rows with headings, side by side so that it has about a screen's shape."""
        wide, tall = self.size()
        width, height = len(rows[0].frames) * wide, tall + _CAPTION_PX
        columns = min(max(1, round(sqrt(1.5 * len(rows) * height / width))), len(rows))
        sheet, pen, header = self._paper(columns * width, ceil(len(rows) / columns) * height)
        at = 0
        for number, row in enumerate(rows):
            x, y = number % columns * width, header + number // columns * height
            heading, large = displayed(row.heading, 120), font(15)
            is_long = large.getlength(heading) > width - 9
            pen.text((x + 6, y + 4), heading, SHEET.text, font(12) if is_long else large)
            for place, frame in enumerate(row.frames):
                if frame is not None:
                    self.tile(sheet, pen, at, (x + place * wide, y + _CAPTION_PX))
                    at += 1
            pen.rectangle((x, y, x + width, y + height), outline=SHEET.frame)
        return sheet

    def size(self) -> tuple[int, int]:
        """Return the width and the height of a posture's views, pixels."""
        tall = self.windows[0].height + max(self.plan.height if self.plan else 0, _CAPTION_PX)
        return sum(window.width for window in self.windows), tall

    def _paper(self, width: int, height: int) -> tuple[Image.Image, ImageDraw.ImageDraw, int]:
        """Return a sheet with this room below its title and legend, its pen, and the height of title and legend."""
        lines = self._legend(width)
        header = _LINE_PX * (len(lines) + 2)
        sheet = Image.new("RGB", (width + 1, header + height + 1), SHEET.paper)
        pen = ImageDraw.Draw(sheet)
        pen.text((6, 4), displayed(self.motion.name or self.motion.skeleton.name), SHEET.text, font(15))
        for number, line in enumerate(lines):
            for x, words, ink in line:
                pen.text((x, _LINE_PX * (number + 1) + 9), words, ink, font(12))
        return sheet, pen, header

    def tile(self, sheet: Image.Image, pen: ImageDraw.ImageDraw, at: int, corner: tuple[int, int]) -> None:
        """Draw one posture, its views and its caption; `corner` is the upper left one, pixels."""
        x, y = corner
        for window in self.windows:
            sheet.paste(self._view(at, window), (x, y))
            x += window.width
        y += self.windows[0].height
        if self.plan:
            pen.rectangle((corner[0], y, x, y + self.plan.height), SHEET.ground)
            sheet.paste(self._above(at, self.plan), (corner[0], y))
        x = corner[0] + self.windows[0].width
        caption, time = self.notes[at]
        large = font(15)
        is_long = large.getlength(caption) > self.windows[1].width - 9
        pen.text((x + 4, y + 3), caption, SHEET.text, font(12) if is_long else large)
        pen.text((x + self.windows[1].width - 5, y + 6), time, SHEET.pale, font(12), anchor="ra")

    def _view(self, at: int, window: Window) -> Image.Image:
        """Draw one posture from the front or from the side, on the floor."""
        buffer, background = self._backdrop(window)
        draw(buffer, *self._solids(at, window.view))
        picture = self._colour(buffer, at, background)
        floor = window.floor
        sunk = floor + ceil(0.006 * self.body.height * window.scale * SAMPLES_PER_PX)  # less than 1 cm is not marked
        under = buffer.solid[sunk:]
        picture[sunk:][(under != EMPTY_CODE) & (under < len(self.body.parts))] = SHEET.sunk  # but no bridge balls
        image = Image.fromarray(picture)
        self._plumb(ImageDraw.Draw(image), at, window, floor)
        return _smooth(image)

    def _above(self, at: int, window: Window) -> Image.Image:
        """Draw one posture's feet on the floor, and its centre of mass, from above."""
        buffer, background = self._backdrop(window)
        draw(buffer, *self._solids(at, ABOVE), self.standing[at])
        image = Image.fromarray(self._colour(buffer, at, background))
        pen = ImageDraw.Draw(image)
        x, y = window.to_samples(*self._middle(at, ABOVE))
        arm = 4 * SAMPLES_PER_PX
        pen.line((x - arm, y, x + arm, y), SHEET.plumb, SAMPLES_PER_PX)
        pen.line((x, y - arm, x, y + arm), SHEET.plumb, SAMPLES_PER_PX)
        return _smooth(image)

    def _colour(self, buffer: DepthBuffer, at: int, background: Pixels) -> Pixels:
        return colour(buffer, self.body, background, paints=self.paints[int(self.inserted[at])])

    def _backdrop(self, window: Window) -> tuple[DepthBuffer, Pixels]:
        """Return a window's depth buffer, emptied, and its background; all postures share both."""
        if window not in self.backdrops:
            self.backdrops[window] = window.buffer(), window.background()
        buffer, background = self.backdrops[window]
        buffer.clear()
        return buffer, background

    def _plumb(self, pen: ImageDraw.ImageDraw, at: int, window: Window, floor: int) -> None:
        """Draw the centre of mass, and a dashed line from it down to the floor."""
        x, y = window.to_samples(*self._middle(at, window.view))
        dash = 4 * SAMPLES_PER_PX
        for start in np.arange(y, floor, 2 * dash):
            pen.line((x, start, x, min(start + dash, floor)), SHEET.plumb, SAMPLES_PER_PX)
        dot = 2.5 * SAMPLES_PER_PX
        pen.ellipse((x - dot, y - dot, x + dot, y + dot), SHEET.plumb, SHEET.paper, 1)

    def _legend(self, width: int) -> list[list[_Phrase]]:
        """Break the legend into lines that fit a width in pixels."""
        words = [(window.view.name, SHEET.pale) for window in self.windows]
        words += [("below: feet on the floor, from above, the audience below", SHEET.pale)] * bool(self.plan)
        words += [("performer's left", COLOURS["left"]), ("performer's right", COLOURS["right"])]
        words += [("dot: centre of mass", SHEET.plumb), ("under the floor", SHEET.sunk)]
        words += [("violet: inserted", VIOLET)] * bool(self.inserted.any())
        words += [("ball: bridged, no corpus has this move", BRIDGED)] * bool(self.bridged.any())
        lines: list[list[_Phrase]] = [[]]
        x = 6.0
        for phrase, ink in words:
            length = font(12).getlength(phrase)
            if lines[-1] and x + length > width:
                lines.append([])
                x = 6.0
            lines[-1].append((x, phrase, ink))
            x += length + 14.0
        return lines

    def _bounds(self, view: View) -> Floats:
        """Compute the least and greatest coordinates [2, F, N, 3] in a view's axes, metres, bridge balls included."""
        bridges = bridge_balls(self.body, self.joints, np.asarray(self.bridged.any(axis=0)))
        cones, balls = to_view(self.cones, self.balls, view, self.origin)
        return np.concatenate(
            [cones.bounds(), balls.bounds(), to_view(cones, bridges, view, self.origin)[1].bounds()], axis=-2
        )

    def _solids(self, at: int, view: View) -> tuple[Cones, Ellipsoids]:
        """Place one posture's solids, bridge balls included, in a view's axes."""
        cones, balls = posture_solids(self.cones, self.balls, at)
        balls = balls.joined(bridge_balls(self.body, self.joints[at], self.bridged[at]))
        return to_view(cones, balls, view, self.origin[at])

    def _middle(self, at: int, view: View) -> tuple[float, float]:
        """Return x and y of one posture's centre of mass in a view's axes, metres."""
        x, y, _ = view.axes @ (self.centres[at] - self.origin[at])
        return float(x), float(y)

    def _standing(self) -> list[frozenset[int]]:
        """Find, for each posture, the solids of the feet on the floor."""
        low = self._bounds(FRONT)[0, ..., 1]
        feet: dict[str, list[int]] = {}
        for solid, part in enumerate(self.body.parts):
            if part.endswith("_foot"):
                feet.setdefault(part, []).append(solid)
        limit = 0.03 * self.body.height  # 5 cm on a person
        return [frozenset(i for foot in feet.values() if row[foot].min() < limit for i in foot) for row in low]

    def _feet_bounds(self) -> tuple[float, float]:
        """Return the least and greatest y, seen from above, metres, of feet on the floor and of centres of mass."""
        if not any(self.standing):
            return 0.0, 0.0
        low, high = self._bounds(ABOVE)[..., 1]
        ys = [(low[at, solid], high[at, solid]) for at, solids in enumerate(self.standing) for solid in solids]
        ys += [(y, y) for _, y in (self._middle(at, ABOVE) for at in range(len(self.frames)))]
        return float(np.min(ys)), float(np.max(ys))


def _smooth(image: Image.Image) -> Image.Image:
    """Average a picture's samples to pixels."""
    return Image.fromarray(halved(np.array(image)))
