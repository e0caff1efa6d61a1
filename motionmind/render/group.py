"""The stage of several dancers: one camera and one floor, and each dancer's own figure and shadow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from PIL import Image, ImageDraw

from motionmind._typing import Pixels
from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.render.ground import darken
from motionmind.render.lettering import font
from motionmind.render.palette import STAGE, dancer_ink
from motionmind.render.stage import Stage, look
from motionmind.render.view import VIEWS, View


class GroupStage:
    """The scene of several motions on one clock; `motionmind.render.film` films it like a `Stage`.

    Attributes:
        stages: a stage for each dancer, all with one camera.
        motion: the first dancer's motion, whose times are those of all.
        camera: the camera.
    """

    def __init__(self, motions: Sequence[Motion], *, view: str | View = "quarter", size: int = 480) -> None:
        """Set the stage for motions of one clock; arguments and errors as of `Stage`."""
        self.stages = [Stage(motion, view=view, size=size) for motion in motions]
        first = self.stages[0]
        self.motion = first.motion
        direction = VIEWS[view] if isinstance(view, str) else view
        self.camera, ground = look([stage.extent for stage in self.stages], direction, size, first.strip)
        for number, stage in enumerate(self.stages):
            stage.camera, stage.ground = self.camera, ground
            stage.dress(dancer_ink(number))
        self._towards = np.array(self.camera.view.towards)

    def __len__(self) -> int:
        return len(self.motion)

    def frames(self, numbers: Iterable[int] | None = None) -> Iterator[Pixels]:
        """Yield the pictures [H, W, 3], RGB, of the frames with these numbers, by default of all."""
        for number in range(len(self)) if numbers is None else numbers:
            yield self.picture(number)

    def picture(self, number: int) -> Pixels:
        """Draw the picture [H, W, 3], RGB, of a frame: the farther a dancer, the earlier."""
        picture = self.stages[0].empty().copy()
        bare = np.ones(picture.shape[:2], dtype=np.float32)
        for stage in self.stages:
            shadow = stage.shadow(number)
            if shadow is not None:
                darken(picture, shadow, bare)
        for stage in sorted(self.stages, key=lambda stage: float(self._towards @ stage.motion.root[number])):
            stage.paint(picture, number)
        self._write(picture, number)
        return picture

    def _write(self, picture: Pixels, number: int) -> None:
        """Write each dancer's name over the head, in the dancer's colour, and the time below."""
        image = Image.fromarray(picture)
        first = self.stages[0]
        pen, letters = ImageDraw.Draw(image), font(first.letters)
        for stage, ink in zip(self.stages, map(dancer_ink, range(len(self.stages))), strict=False):
            top = stage.motion.root[number] + [0.0, 0.62 * stage.body.height, 0.0]
            x, y = self.camera.to_pixels(top).tolist()
            pen.text(
                (x, y),
                displayed(stage.motion.name, 24),
                ink,
                letters,
                anchor="mb",
                stroke_width=2,
                stroke_fill=STAGE.ground,
            )
        pen.text(
            (self.camera.margin, first.line_of_words),
            f"{self.motion.times[number]:.2f} s",
            STAGE.text,
            letters,
            anchor="lm",
        )
        picture[:] = np.asarray(image)
