"""The stage of a film: a whole motion before one camera, with floor, shadow, ghosts and a caption.

A frame has three layers: the backdrop (paper, floor, ghosts), which is cached; the shadow on the floor; the body. Only
the boxes of body and shadow are drawn, so the cost of a frame depends on the size of the body, not of the picture.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from motionmind._typing import Floats, Pixels, Singles
from motionmind.body.motion import Insertion, Motion
from motionmind.body.palette import Colour
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.render.body_shape import shape_of
from motionmind.render.camera import SAMPLES_PER_PX, Camera, Corner, aim
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import bridge_balls, colour, draw, given_colours, halved, inserted_colours
from motionmind.render.ground import Ground, Shadow, darken
from motionmind.render.lettering import font
from motionmind.render.palette import BRIDGED, PAPER, STAGE, VIOLET
from motionmind.render.solids import EMPTY_CODE, Cones, Ellipsoids, bounding_box, posture_solids
from motionmind.render.timing import SAME_TIME_S
from motionmind.render.view import VIEWS, View, to_view

MIN_HEIGHT_PX, MAX_HEIGHT_PX = 120, 2160  # of a picture
GHOST_OPACITY_SHARE = 0.22
_FILM_BLOCK_FRAMES = 64  # whose solids are placed at once


@dataclass(frozen=True, eq=False)
class FigurePlate:
    """A body on the stage, without its colours.

    Attributes:
        corner: x and y of the buffer's upper left corner in the picture, pixels.
        buffer: its depth buffer, with `SAMPLES_PER_PX`; solids are numbered as in `BodyShape.parts`, and after them the
            balls at bridged joints.
        paints: RGB of the body's solids [N, 3], 0 to 255.
    """

    corner: Corner
    buffer: DepthBuffer
    paints: Floats

    @property
    def box(self) -> tuple[slice, slice]:
        """The rows and columns of the picture that the buffer covers."""
        (x, y), (height, width) = self.corner, self.buffer.solid.shape
        return slice(y, y + height // SAMPLES_PER_PX), slice(x, x + width // SAMPLES_PER_PX)


@dataclass(frozen=True, eq=False)
class _Scene:
    """The still parts of an insertion: the backdrop [H, W, 3], where no ghost covers it [H, W], and the ghosts."""

    insertion: Insertion | None
    backdrop: Pixels
    bare: Singles
    ghosts: list[FigurePlate]


class Extent(NamedTuple):
    """The room that a movement takes.

    Attributes:
        roots: positions of the root [R, 3], metres.
        world: least and greatest coordinates of the body in each frame [F, 2, 3], metres.
        boxes: the same in the view's axes, from the world's origin [F, 2, 2], metres.
        height: height of the body, metres.
    """

    roots: Floats
    world: Floats
    boxes: Floats
    height: float


def look(extents: Sequence[Extent], view: View, size: int, strip: int) -> tuple[Camera, Ground | None]:
    """Aim a camera at all that moves; return it and the floor, if visible.

    Args:
        extents: the extent of each movement.
        view: the direction to look from.
        size: height of the picture, pixels.
        strip: height of the caption, pixels.
    """
    roots, world, boxes = (np.concatenate(rows) for rows in zip(*(one[:3] for one in extents), strict=True))
    height, axes = max(one.height for one in extents), view.axes
    origin = 0.5 * (roots.min(axis=0) + roots.max(axis=0)) * [1.0, 0.0, 1.0]
    low, high = world[:, 0].min(axis=0), world[:, 1].max(axis=0)
    floor = bool(abs(low[1]) < high[1] - low[1])
    under = ((roots * [1.0, 0.0, 1.0] - origin) @ axes.T)[:, :2] if floor else np.empty((0, 2))
    least = 0.6 * height  # a body that curls up smaller is not magnified
    camera = aim(view, origin, boxes - (origin @ axes.T)[:2], under, least, size, strip)
    return camera, Ground(camera, low[[0, 2]], high[[0, 2]], height) if floor else None


class Stage:
    """The scene of a motion on any skeleton.

    Attributes:
        motion: the motion at the times to draw, one posture each: the frames of the film.
        body: the body.
        camera: the camera, which sets the size of the picture.
        ground: the floor; None if it is too far away to leave room for the body.
        extent: the room that the movement takes.
        line: width of the lines around a body's parts, samples.
        strip: height of the caption at the lower edge, with text and timeline, pixels; 0 without one.
        letters: size of the text, pixels.
        thick: thickness of the timeline, pixels.
    """

    def __init__(
        self,
        motion: Motion,
        times: Floats | None = None,
        *,
        view: str | View = "quarter",
        size: int = 480,
        first: int = 0,
    ) -> None:
        """Set the stage for a motion.

        Args:
            motion: the motion.
            times: the times to draw [T], seconds, increasing, as from `frame_times`; its own times by default.
            view: a view, or the name of one of `view.VIEWS`.
            size: height of the picture, pixels, from 120 to 2160; a flat movement makes it lower.
            first: number of the motion's first frame in the longer motion that it is a part of.

        Raises:
            MotionMindError: there is no such view, or the size is out of range.
        """
        if isinstance(view, str) and view not in VIEWS:
            raise MotionMindError(f"no view {view!r}; there are {', '.join(VIEWS)}")
        if not MIN_HEIGHT_PX <= size <= MAX_HEIGHT_PX or size != int(size):
            raise MotionMindError(
                f"size must be a whole number of pixels from {MIN_HEIGHT_PX} to {MAX_HEIGHT_PX}, not {size}"
            )
        self._given, self._first = motion, first
        self.motion = motion if times is None else motion.at(times)
        self.body = shape_of(motion.skeleton)
        self._paints = given_colours(self.body), inserted_colours(self.body)
        self._inserted, self._bridged = self.motion.inserted(), self.motion.bridged()
        self._ends = {
            id(insertion): ends for insertion in motion.insertions if (ends := _ends(motion, insertion)) is not None
        }
        self._block: tuple[int, tuple[Cones, Ellipsoids]] | None = None  # the last block of frames, and its solids
        self._last_scene: _Scene | None = None  # of the last insertion

        self.line = max(SAMPLES_PER_PX, round(SAMPLES_PER_PX * size / 480))
        self.letters, self.thick = max(10, round(0.026 * size)), max(2, round(size / 160))
        self.strip = round(3.4 * self.letters) if len(self) > 1 or self.words(0) else 0
        direction = VIEWS[view] if isinstance(view, str) else view
        self.extent = self._find_extent(direction)
        self.camera, self.ground = look([self.extent], direction, size, self.strip)

    def __len__(self) -> int:
        return len(self.motion)

    def dress(self, trunk: Colour) -> None:
        """Give the body's trunk a colour of its own, except in inserted movement."""
        self._paints = given_colours(self.body, trunk), self._paints[1]

    # --- pictures ---------------------------------------------------------------------------------------------------

    def frames(self, numbers: Iterable[int] | None = None) -> Iterator[Pixels]:
        """Yield the pictures [H, W, 3], RGB, of the frames with these numbers, by default of all."""
        for number in range(len(self)) if numbers is None else numbers:
            yield self.picture(number)

    def picture(self, number: int) -> Pixels:
        """Draw the picture [H, W, 3], RGB, of a frame."""
        scene, shadow = self._scene(number), self.shadow(number)
        picture = scene.backdrop.copy()
        if shadow is not None:
            darken(picture, shadow, scene.bare)
        self.paint(picture, number)
        self._write(picture, number)
        return picture

    def paint(self, picture: Pixels, number: int) -> None:
        """Paint the body of a frame over a picture [H, W, 3], RGB, in place."""
        self._paint(picture, self.drawing(number))

    def backdrop(self, number: int) -> Pixels:
        """Return paper, floor and ghosts of a frame [H, W, 3], RGB; shared, so do not write to it."""
        return self._scene(number).backdrop

    def empty(self) -> Pixels:
        """Return paper and floor [H, W, 3], RGB; shared, so do not write to it."""
        return self._empty.backdrop

    def drawing(self, number: int) -> FigurePlate:
        """Draw the body of a frame, in violet if the engine inserted it."""
        inserted = bool(self._inserted[number])
        return self._draw(*self._solids(number), self.motion.root[number], self._paints[inserted])

    def shadow(self, number: int) -> Shadow | None:
        """Cast the body's shadow on the floor in a frame; None without a floor."""
        return self.ground.shadow(*self._solids(number)) if self.ground else None

    def ghosts(self, number: int) -> list[FigurePlate]:
        """Return the end postures A and B of a frame's insertion; empty outside insertions."""
        return self._scene(number).ghosts

    def insertion(self, number: int) -> Insertion | None:
        """Return the insertion of a frame, its A and B included; None if there is none."""
        time = self.motion.times[number]
        current = (
            one for one in self._given.insertions if one.times[0] - SAME_TIME_S <= time <= one.times[-1] + SAME_TIME_S
        )
        return next(current, None)

    def words(self, number: int) -> list[tuple[str, Colour]]:
        """Return the phrases of a frame's caption and their colours: time, number, and what the engine did."""
        time, words = self.motion.times[number], list[tuple[str, Colour]]()
        if len(self) > 1:
            frame = int(np.argmin(np.abs(self._given.times - time)))
            words += [(f"{time:.2f} s", STAGE.text), (f"frame {self._first + frame}", STAGE.pale)]
        if self._inserted[number]:
            words.append(("inserted", VIOLET))
        if self._bridged[number].any():
            names = (displayed(self.motion.skeleton.names[joint]) for joint in np.flatnonzero(self._bridged[number]))
            words.append((f"bridged: {', '.join(names)}", BRIDGED))
        return words

    @property
    def line_of_words(self) -> float:
        """The y of the middle of the text, pixels from the top."""
        return self.camera.height - 0.66 * self.strip

    @property
    def track(self) -> int:
        """The y of the timeline's upper edge, pixels from the top."""
        return self.camera.height - round(0.30 * self.strip)

    def on_track(self, time: float) -> float:
        """Return the x of a time, seconds, on the timeline, pixels from the left, clamped to its ends."""
        start, end = self.motion.times[[0, -1]]
        share = min(max((time - start) / (end - start), 0.0), 1.0)
        return float(self.camera.margin + share * (self.camera.width - 2 * self.camera.margin))

    # --- the body ---------------------------------------------------------------------------------------------------

    def _find_extent(self, view: View) -> Extent:
        """Find the extent of the whole movement, ghosts and balls included."""
        motions = [self.motion, *self._ends.values()]
        roots = np.concatenate([motion.root for motion in motions])
        world, boxes = [], []

        def include(cones: Cones, balls: Ellipsoids) -> None:
            world.append(bounding_box(cones, balls).reshape(-1, 2, 3))
            boxes.append(bounding_box(*to_view(cones, balls, view, np.zeros(3))).reshape(-1, 2, 3)[..., :2])

        for motion in motions:
            for start in range(0, len(motion), _FILM_BLOCK_FRAMES):
                block = slice(start, start + _FILM_BLOCK_FRAMES)
                include(*self.body.solids(motion.rotations[block], motion.root[block]))
        for number in np.flatnonzero(self._bridged.any(axis=1)).tolist():
            include(*self._solids(number))
        return Extent(roots, np.concatenate(world), np.concatenate(boxes), self.body.height)

    def _solids(self, number: int) -> tuple[Cones, Ellipsoids]:
        """Place the solids of a frame in the world, balls at bridged joints after the body's own."""
        block = number // _FILM_BLOCK_FRAMES
        if self._block is None or self._block[0] != block:
            part = slice(block * _FILM_BLOCK_FRAMES, (block + 1) * _FILM_BLOCK_FRAMES)
            self._block = block, self.body.solids(self.motion.rotations[part], self.motion.root[part])
        cones, balls = posture_solids(*self._block[1], number % _FILM_BLOCK_FRAMES)
        if self._bridged[number].any():
            joints = self.body.skeleton.positions(self.motion.rotations[number], self.motion.root[number])
            balls = balls.joined(bridge_balls(self.body, joints, self._bridged[number]))
        return cones, balls

    def _draw(self, cones: Cones, balls: Ellipsoids, root: Floats, paints: Floats) -> FigurePlate:
        cones, balls = self.camera.solids(cones, balls, root)
        corner, buffer = self.camera.buffer(cones, balls, self.line // SAMPLES_PER_PX + 1)  # room for the outline
        draw(buffer, cones, balls)
        return FigurePlate(corner, buffer, paints)

    def _paint(self, picture: Pixels, drawing: FigurePlate, share: float = 1.0) -> None:
        """Paint a drawing over a picture, with opacity `share`."""
        behind = picture[drawing.box]
        samples = behind.repeat(SAMPLES_PER_PX, axis=0).repeat(SAMPLES_PER_PX, axis=1)
        coloured = colour(drawing.buffer, self.body, samples, self.line, drawing.paints)
        image = halved(coloured)
        picture[drawing.box] = image if share == 1.0 else behind + share * (image.astype(np.float32) - behind)

    # --- the backdrop -----------------------------------------------------------------------------------------------

    @cached_property
    def _empty(self) -> _Scene:
        """The empty stage."""
        size = self.camera.height, self.camera.width
        paper = np.full((*size, 3), PAPER, dtype=np.uint8)
        picture = self.ground.picture(0.6 * self.line) if self.ground else paper
        return _Scene(None, picture, np.ones(size, dtype=np.float32), [])

    def _scene(self, number: int) -> _Scene:
        insertion = self.insertion(number)
        if insertion is None or id(insertion) not in self._ends:
            return self._empty
        if self._last_scene is None or self._last_scene.insertion is not insertion:
            backdrop, bare, ghosts = self._empty.backdrop.copy(), self._empty.bare.copy(), []
            ends = self._ends[id(insertion)]
            solids = self.body.solids(ends.rotations, ends.root)
            for end, root in enumerate(ends.root):
                ghosts.append(ghost := self._draw(*posture_solids(*solids, end), root, self._paints[0]))
                self._paint(backdrop, ghost, GHOST_OPACITY_SHARE)
                bare[ghost.box][ghost.buffer.solid[::SAMPLES_PER_PX, ::SAMPLES_PER_PX] != EMPTY_CODE] = 0.0
            self._last_scene = _Scene(insertion, backdrop, bare, ghosts)
        return self._last_scene

    # --- the caption ------------------------------------------------------------------------------------------------

    def _write(self, picture: Pixels, number: int) -> None:
        """Write the text and, for a film, the timeline into the strip."""
        if not self.strip:
            return
        image, above = Image.fromarray(picture[-self.strip :]), self.camera.height - self.strip
        pen, letters, x = ImageDraw.Draw(image), font(self.letters), float(self.camera.margin)
        # Times and frames keep their columns as their digits grow.
        last = f"{self.motion.times[-1]:.2f} s", f"frame {self._first + len(self._given) - 1}"
        columns = [letters.getlength(words) for words in last]
        for place, (phrase, ink) in enumerate(self.words(number)):
            text = phrase
            while text and x + letters.getlength(text) > self.camera.width - self.camera.margin:
                text = text[:-2] + "…" if len(text) > 2 else ""
            pen.text((x, self.line_of_words - above), text, ink, letters, anchor="lm")
            x += letters.getlength(text) if len(self) == 1 or place > 1 else columns[place]
            x += 1.2 * self.letters
        if len(self) > 1:
            self._timeline(pen, self.motion.times[number], self.track - above)
        picture[-self.strip :] = np.asarray(image)

    def _timeline(self, pen: ImageDraw.ImageDraw, time: float, top: int) -> None:
        """Draw the timeline with its insertions, and a cursor at `time`, seconds."""
        spans = [(*self.motion.times[[0, -1]], STAGE.timeline)]
        spans += [(*one.times[[0, -1]], VIOLET) for one in self._given.insertions]
        for start, end, ink in spans:
            edges = round(self.on_track(start)), top, round(self.on_track(end)), top + self.thick - 1
            pen.rectangle(edges, ink)
        left = round(self.on_track(time)) - self.thick // 2
        pen.rectangle((left, top - self.thick, left + self.thick - 1, top + 2 * self.thick - 1), STAGE.text)


def _ends(motion: Motion, insertion: Insertion) -> Motion | None:
    """Return the end postures A and B of an insertion that the motion includes; None if there are none to show."""
    first, last = motion.times[[0, -1]]
    times = [time for time in insertion.times[[0, -1]] if first - SAME_TIME_S <= time <= last + SAME_TIME_S]
    return (
        replace(motion, insertions=()).at(np.array(times))
        if len(motion) > 1 and len(insertion.times) > 1 and times
        else None
    )
