"""The stage of a film: a whole motion before one camera, with floor, shadows, ghosts, and what is written underneath.

A frame is drawn in three layers: the backdrop (paper, floor, ghosts), which stays; the shadow on the floor; the body.
Body and shadow are drawn in their own boxes only, so that a frame costs what the body covers and not what the picture
does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from motionmind._typing import Floats, Pixels, Singles
from motionmind.body.motion import Insertion, Motion
from motionmind.errors import MotionMindError
from motionmind.render.body_shape import shape_of
from motionmind.render.camera import SMOOTH, VIEWS, Camera, Corner, aim
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import (
    BRIDGED,
    INSERTED,
    bridge_balls,
    colour,
    draw,
    halved,
    inserted,
    plain,
    seen,
)
from motionmind.render.ground import PAPER, Ground, Shadow, darken
from motionmind.render.solids import EMPTY, Cones, Ellipsoids

Ink = tuple[int, int, int]

SMALLEST, LARGEST = 120, 2160  # pixels of a picture's height
WORDS, PALE, TRACK, VIOLET = (40, 38, 40), (140, 135, 132), (224, 220, 215), INSERTED["middle"]
HOLD = 0.8  # seconds for which the last frame of a film stays, before it all begins again
GHOST = 0.22  # how much of a ghost's colours the backdrop takes
_STRIP = 3.4  # by the height of the letters: what is written underneath
_SMALL_BODY = 0.6  # of a body's height: one that is rolled up smaller is not made larger
SLOWEST = 0.01  # frames a second of a film
_LEAST_RATE, _RATE = 12.0, 25.0  # frames a second: movement written more sparsely than the first is drawn at the second
_MOMENT = 1e-6  # seconds: times that are no further apart are one
_BLOCK = 64  # frames whose solids are placed at once


@dataclass(frozen=True, eq=False)
class FigurePlate:
    """A body as it stands on the stage, before it is a picture.

    Attributes:
        corner: x and y, in pixels of the picture, of the canvas's upper left corner.
        canvas: its depth buffer, `SMOOTH` samples a pixel each way; solids are numbered as in `Body.parts`, and beyond
            them are balls at bridged joints.
        paints: RGB of the body's solids [N, 3].
    """

    corner: Corner
    canvas: DepthBuffer
    paints: Floats

    @property
    def box(self) -> tuple[slice, slice]:
        """The rows and columns of the picture that the canvas covers."""
        (x, y), (height, width) = self.corner, self.canvas.solid.shape
        return slice(y, y + height // SMOOTH), slice(x, x + width // SMOOTH)


@dataclass(frozen=True, eq=False)
class _Scene:
    """What stays while an insertion goes on: the backdrop, where it is bare of ghosts [H, W], and the ghosts."""

    insertion: Insertion | None
    backdrop: Pixels
    bare: Singles
    ghosts: list[FigurePlate]


def frame_rate(motion: Motion) -> float:
    """Frames a second at which a motion is filmed by default: its own, and 25 where it is written in few postures."""
    return motion.fps if motion.fps >= _LEAST_RATE else _RATE


def frame_times(motion: Motion, rate: float) -> Floats:
    """When to draw a motion, seconds: evenly from its first posture to its last, both of them among the moments.

    They are no closer than at `rate` a second; where the last posture is not on that beat, they lie a little wider.
    """
    if len(motion) == 1:
        return motion.times
    steps = max(int((motion.times[-1] - motion.times[0]) * rate + 1e-3), 1)
    return np.linspace(motion.times[0], motion.times[-1], steps + 1)


class Stage:
    """The scene of a motion on any skeleton.

    Attributes:
        motion: what is drawn, posture by posture: the motion at the moments that were asked for.
        body: its body.
        camera: what sees it, and how large the picture is.
        ground: the floor; None where it is so far from the body that it would leave no room for it.
        line: width of the lines round a body's parts, in samples.
        strip: height in pixels of the strip at the lower edge where words and the line of time are; 0 without them.
        letters: size of the words in pixels.
        thick: thickness of the line of time in pixels.
    """

    def __init__(
        self, motion: Motion, times: Floats | None = None, *, view: str = "quarter", size: int = 480, first: int = 0
    ) -> None:
        """The stage for the moments `times` of a motion (its own by default).

        Args:
            motion: the movement.
            times: when to draw it [T], seconds, increasing; `frame_times` finds them.
            view: from where: one of `VIEWS`.
            size: height of the picture in pixels; it is less high where the movement is flat.
            first: number of the motion's first frame in what it is a part of.

        Raises:
            MotionMindError: there is no such view, or the size is not one from 120 to 2160.
        """
        if view not in VIEWS:
            raise MotionMindError(f"no view {view!r}; there are {', '.join(VIEWS)}")
        if not SMALLEST <= size <= LARGEST or size != int(size):
            raise MotionMindError(f"a picture is from {SMALLEST} to {LARGEST} whole pixels high, not {size}")
        self._given, self._first = motion, first
        self.motion = motion if times is None else motion.at(times)
        self.body = shape_of(motion.skeleton)
        self._paints = plain(self.body), inserted(self.body)
        self._made, self._bridged = self.motion.inserted(), self.motion.bridged()
        self._ends = {id(one): ends for one in motion.insertions if (ends := _ends(motion, one)) is not None}
        self._placed: tuple[int, tuple[Cones, Ellipsoids]] | None = None  # the solids of one block
        self._kept: _Scene | None = None  # the scene of one insertion

        self.line = max(SMOOTH, round(SMOOTH * size / 480))
        self.letters, self.thick = max(10, round(0.026 * size)), max(2, round(size / 160))
        self.strip = round(_STRIP * self.letters) if len(self) > 1 or self.words(0) else 0
        self.camera, self.ground = self._look(view, size)

    def __len__(self) -> int:
        return len(self.motion)

    # --- pictures ---------------------------------------------------------------------------------------------------

    def frames(self, numbers: Iterable[int] | None = None) -> Iterator[Pixels]:
        """The pictures [H, W, 3] of moments, all by default, one after another; none of them is kept."""
        for number in range(len(self)) if numbers is None else numbers:
            yield self.picture(number)

    def picture(self, number: int) -> Pixels:
        """The picture [H, W, 3] of one moment."""
        scene, shadow = self._scene(number), self.shadow(number)
        picture = scene.backdrop.copy()
        if shadow is not None:
            darken(picture, shadow, scene.bare)
        self._paint(picture, self.drawing(number))
        self._write(picture, number)
        return picture

    def backdrop(self, number: int) -> Pixels:
        """Paper, floor, and the ghosts of the insertion that goes on at a moment [H, W, 3]; not to be written to."""
        return self._scene(number).backdrop

    def drawing(self, number: int) -> FigurePlate:
        """The body at a moment, in the colours of what the engine made where it made it."""
        made = bool(self._made[number])
        return self._draw(*self._solids(number), self.motion.root[number], self._paints[made])

    def shadow(self, number: int) -> Shadow | None:
        """The body's shadow on the floor at a moment; None where there is no floor."""
        return self.ground.shadow(*self._solids(number)) if self.ground else None

    def ghosts(self, number: int) -> list[FigurePlate]:
        """The postures between which the engine made the movement that goes on at a moment: A and B, or none."""
        return self._scene(number).ghosts

    def insertion(self, number: int) -> Insertion | None:
        """The insertion that goes on at a moment, its A and its B included."""
        time = self.motion.times[number]
        going = (one for one in self._given.insertions if one.times[0] - _MOMENT <= time <= one.times[-1] + _MOMENT)
        return next(going, None)

    def words(self, number: int) -> list[tuple[str, Ink]]:
        """What is written under a moment, with its colours: time, frame, and what the engine did."""
        time, words = self.motion.times[number], list[tuple[str, Ink]]()
        if len(self) > 1:
            frame = int(np.argmin(np.abs(self._given.times - time)))
            words += [(f"{time:.2f} s", WORDS), (f"frame {self._first + frame}", PALE)]
        if self._made[number]:
            words.append(("inserted", VIOLET))
        if self._bridged[number].any():
            names = (self.motion.skeleton.names[joint] for joint in np.flatnonzero(self._bridged[number]))
            words.append((f"bridged: {', '.join(names)}", BRIDGED))
        return words

    @property
    def line_of_words(self) -> float:
        """How far down the middle of what is written is, pixels."""
        return self.camera.height - 0.66 * self.strip

    @property
    def track(self) -> int:
        """How far down the upper edge of the line of time is, pixels."""
        return self.camera.height - round(0.30 * self.strip)

    def on_track(self, time: float) -> float:
        """Where a time is on the line of time, seconds to pixels from the left; what is beyond its ends is there."""
        start, end = self.motion.times[[0, -1]]
        share = min(max((time - start) / (end - start), 0.0), 1.0)
        return float(self.camera.margin + share * (self.camera.width - 2 * self.camera.margin))

    # --- the body ---------------------------------------------------------------------------------------------------

    def _look(self, view: str, size: int) -> tuple[Camera, Ground | None]:
        """The camera that sees all of the movement, ghosts and balls included, and the floor, if it does."""
        everything = [self.motion, *self._ends.values()]
        roots = np.concatenate([one.root for one in everything])
        origin = 0.5 * (roots.min(axis=0) + roots.max(axis=0)) * [1.0, 0.0, 1.0]
        world, boxes = [], []

        def see(cones: Cones, balls: Ellipsoids) -> None:
            world.append(_reach(cones, balls).reshape(-1, 2, 3))
            boxes.append(_reach(*seen(cones, balls, VIEWS[view], origin)).reshape(-1, 2, 3)[..., :2])

        for one in everything:
            for start in range(0, len(one), _BLOCK):
                see(*self.body.solids(one.rotations[start : start + _BLOCK], one.root[start : start + _BLOCK]))
        for number in np.flatnonzero(self._bridged.any(axis=1)).tolist():
            see(*self._solids(number))
        reach = np.concatenate(world)
        low, high = reach[:, 0].min(axis=0), reach[:, 1].max(axis=0)
        floor = bool(abs(low[1]) < high[1] - low[1])
        under = ((roots * [1.0, 0.0, 1.0] - origin) @ VIEWS[view].axes.T)[:, :2] if floor else np.empty((0, 2))
        least = _SMALL_BODY * self.body.height
        camera = aim(VIEWS[view], origin, np.concatenate(boxes), under, least, size, self.strip)
        return camera, Ground(camera, low[[0, 2]], high[[0, 2]], self.body.height) if floor else None

    def _solids(self, number: int) -> tuple[Cones, Ellipsoids]:
        """The solids of a moment in the world, balls at bridged joints after the body's own."""
        block = number // _BLOCK
        if self._placed is None or self._placed[0] != block:
            part = slice(block * _BLOCK, (block + 1) * _BLOCK)
            self._placed = block, self.body.solids(self.motion.rotations[part], self.motion.root[part])
        cones, balls = _one(*self._placed[1], number % _BLOCK)
        if self._bridged[number].any():
            joints = self.body.skeleton.positions(self.motion.rotations[number], self.motion.root[number])
            balls = balls.joined(bridge_balls(self.body, joints, self._bridged[number]))
        return cones, balls

    def _draw(self, cones: Cones, balls: Ellipsoids, root: Floats, paints: Floats) -> FigurePlate:
        cones, balls = self.camera.solids(cones, balls, root)
        corner, canvas = self.camera.canvas(cones, balls, self.line // SMOOTH + 1)  # room for the line round the body
        draw(canvas, cones, balls)
        return FigurePlate(corner, canvas, paints)

    def _paint(self, picture: Pixels, drawing: FigurePlate, share: float = 1.0) -> None:
        """Put a drawing, or a share of its colours, into a picture."""
        behind = picture[drawing.box]
        samples = behind.repeat(SMOOTH, axis=0).repeat(SMOOTH, axis=1)
        coloured = colour(drawing.canvas, self.body, samples, self.line, drawing.paints)
        image = halved(coloured)
        picture[drawing.box] = image if share == 1.0 else behind + share * (image.astype(np.float32) - behind)

    # --- the backdrop -----------------------------------------------------------------------------------------------

    @cached_property
    def _empty(self) -> _Scene:
        """The stage with nobody on it."""
        size = self.camera.height, self.camera.width
        paper = np.full((*size, 3), PAPER, dtype=np.uint8)
        picture = self.ground.picture(0.6 * self.line) if self.ground else paper
        return _Scene(None, picture, np.ones(size, dtype=np.float32), [])

    def _scene(self, number: int) -> _Scene:
        insertion = self.insertion(number)
        if insertion is None or id(insertion) not in self._ends:
            return self._empty
        if self._kept is None or self._kept.insertion is not insertion:
            backdrop, bare, ghosts = self._empty.backdrop.copy(), self._empty.bare.copy(), []
            ends = self._ends[id(insertion)]
            solids = self.body.solids(ends.rotations, ends.root)
            for end, root in enumerate(ends.root):
                ghosts.append(ghost := self._draw(*_one(*solids, end), root, self._paints[0]))
                self._paint(backdrop, ghost, GHOST)
                bare[ghost.box][ghost.canvas.solid[::SMOOTH, ::SMOOTH] != EMPTY] = 0.0
            self._kept = _Scene(insertion, backdrop, bare, ghosts)
        return self._kept

    # --- what is written underneath ---------------------------------------------------------------------------------

    def _write(self, picture: Pixels, number: int) -> None:
        """Words and, where there is more than one moment, the line of time, into the strip."""
        if not self.strip:
            return
        image, above = Image.fromarray(picture[-self.strip :]), self.camera.height - self.strip
        pen, font, x = ImageDraw.Draw(image), _font(self.letters), float(self.camera.margin)
        # Times and frames keep their columns while they grow.
        last = f"{self.motion.times[-1]:.2f} s", f"frame {self._first + len(self._given) - 1}"
        columns = [font.getlength(words) for words in last]
        for place, (phrase, ink) in enumerate(self.words(number)):
            text = phrase
            while text and x + font.getlength(text) > self.camera.width - self.camera.margin:
                text = text[:-2] + "…" if len(text) > 2 else ""
            pen.text((x, self.line_of_words - above), text, ink, font, anchor="lm")
            x += font.getlength(text) if len(self) == 1 or place > 1 else columns[place]
            x += 1.2 * self.letters
        if len(self) > 1:
            self._timeline(pen, self.motion.times[number], self.track - above)
        picture[-self.strip :] = np.asarray(image)

    def _timeline(self, pen: ImageDraw.ImageDraw, time: float, top: int) -> None:
        spans = [(*self.motion.times[[0, -1]], TRACK)]
        spans += [(*one.times[[0, -1]], VIOLET) for one in self._given.insertions]
        for start, end, ink in spans:
            edges = round(self.on_track(start)), top, round(self.on_track(end)), top + self.thick - 1
            pen.rectangle(edges, ink)
        left = round(self.on_track(time)) - self.thick // 2
        pen.rectangle((left, top - self.thick, left + self.thick - 1, top + 2 * self.thick - 1), WORDS)


def _ends(motion: Motion, insertion: Insertion) -> Motion | None:
    """The postures A and B of an insertion, as far as they are in a motion of more than one."""
    first, last = motion.times[[0, -1]]
    times = [time for time in insertion.times[[0, -1]] if first - _MOMENT <= time <= last + _MOMENT]
    return (
        replace(motion, insertions=()).at(np.array(times))
        if len(motion) > 1 and len(insertion.times) > 1 and times
        else None
    )


def _one(cones: Cones, balls: Ellipsoids, number: int) -> tuple[Cones, Ellipsoids]:
    """The solids of one of several postures."""
    return (
        Cones(cones.a[number], cones.b[number], cones.a_radius, cones.b_radius),
        Ellipsoids(balls.centre[number], balls.axes[number]),
    )


def _reach(cones: Cones, balls: Ellipsoids) -> Floats:
    """Least and greatest coordinates [..., 2, 3] of postures' solids [..., N]."""
    low, high = np.concatenate([cones.reach(), balls.reach()], axis=-2)
    return np.stack([low.min(axis=-2), high.max(axis=-2)], axis=-2)


@cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)
