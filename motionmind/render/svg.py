"""Movement as animated SVG, which browsers play by themselves.

As in pictures, the depth buffer decides which limb hides which; its regions are then traced. A frame has the body's
shadow, regions in flat colours, nested translucent regions of shade on them, and lines.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, takewhile
from math import ceil, floor

import numpy as np

from motionmind._typing import Floats, Int16s, Singles
from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.render.bspline import UNITS_PER_PX, path
from motionmind.render.camera import SAMPLES_PER_PX, Corner
from motionmind.render.figure import DEPTH_STEP_M, haze
from motionmind.render.ground import Ground
from motionmind.render.lettering import FONT_FAMILY
from motionmind.render.markup import hexadecimal, xml_text
from motionmind.render.palette import BRIDGED, INK, PAPER, STAGE, VIOLET
from motionmind.render.solids import EMPTY_CODE
from motionmind.render.stage import GHOST_OPACITY_SHARE, FigurePlate, Stage
from motionmind.render.timing import HOLD_S, MIN_FPS, film_rate, frame_times
from motionmind.render.trace import Lines, outlines, ridges, smooth


def write_svg(
    path: FilePath, motion: Motion, *, fps: float | None = None, view: str = "quarter", size: int = 480, first: int = 0
) -> None:
    """Write a motion as an animated SVG, or as a still one if it has one frame.

    Args:
        path: the file.
        motion: the motion, on any skeleton.
        fps: frames a second, from 0.01 to 60; by default 12, lower if there would be more than 1,000.
        view: the name of one of `view.VIEWS`.
        size: height of the picture, pixels, from 120 to 2160; a flat movement makes it lower.
        first: number of the motion's first frame in the longer motion that it is a part of.

    Raises:
        MotionMindError: the rate, view or size is invalid, there would be more than 4,000 frames, or the file cannot be
            written.
    """
    write_atomically(path, svg(motion, fps=fps, view=view, size=size, first=first).encode())


def svg(motion: Motion, *, fps: float | None = None, view: str = "quarter", size: int = 480, first: int = 0) -> str:
    """Return the text of the file that `write_svg` writes; arguments and errors as there.

    Each frame is a group in the definitions; one animated reference shows them in turn.
    """
    if fps is not None and not MIN_FPS <= fps <= 60.0:
        raise MotionMindError(f"an SVG has from {MIN_FPS:g} to 60 frames a second, not {fps:g}")
    rate = film_rate(motion, 12.0, fps)  # by default that of drawn animation
    stage = Stage(motion, frame_times(motion, rate), view=view, size=size, first=first)
    artist = _Artist(stage)
    width, height = stage.camera.width, stage.camera.height
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
        f' role="img" {FONT_FAMILY} font-size="{stage.letters}"'
        ' stroke-linejoin="round" stroke-linecap="round">',
        f"<title>{_text(displayed(motion.name) or 'movement')}</title>",
        "<style>text{font-variant-numeric:tabular-nums}"
        "@media(prefers-reduced-motion:reduce){.play{display:none}.still{display:inline}}</style>",
        f'<rect width="100%" height="100%" fill="{hexadecimal(PAPER)}"/>',
        *(_floor(stage.ground, 0.3 * stage.line) if stage.ground else ()),
        *artist.track(),
        "<defs>",
        *artist.ghosts(),
        *(f'<g id="f{number}">{artist.frame(number)}</g>' for number in range(len(stage))),
        "</defs>",
        *_animation(stage.motion.times),
        "</svg>",
    ]
    return "\n".join(text) + "\n"


def _floor(ground: Ground, line: float) -> Iterator[str]:
    """Yield the floor, which fades along x and z, and its grid; `line` is the width of its lines, pixels."""
    camera, low, high = ground.camera, ground.low - ground.apron, ground.high + ground.apron
    zero, x, z = camera.to_pixels(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    to_pixels = " ".join(f"{value:.6g}" for value in (*(x - zero), *(z - zero), *zero))
    (left, far), (wide, deep) = low, high - low
    field = f'x="{left:.6g}" y="{far:.6g}" width="{wide:.6g}" height="{deep:.6g}" transform="matrix({to_pixels})"'
    everywhere = f'maskUnits="userSpaceOnUse" x="0" y="0" width="{camera.width}" height="{camera.height}"'
    for name, end in (("x", 'x2="1" y2="0"'), ("z", 'x2="0" y2="1"')):
        edge = ground.apron / (wide if name == "x" else deep)
        ramp = [(share, share * share * (3.0 - 2.0 * share)) for share in np.linspace(0.0, 1.0, 6)]
        stops = [(edge * share, opacity) for share, opacity in ramp]
        stops += [(1.0 - at, opacity) for at, opacity in reversed(stops)]
        text = "".join(
            f'<stop offset="{at:.4g}" stop-color="#fff" stop-opacity="{opacity:.4g}"/>' for at, opacity in stops
        )
        yield f'<linearGradient id="fade-{name}" x1="0" y1="0" {end}>{text}</linearGradient>'
        yield f'<mask id="floor-{name}" {everywhere}><rect fill="url(#fade-{name})" {field}/></mask>'
    lines = [((x, low[1]), (x, high[1])) for x in _multiples(low[0], high[0], ground.step)]
    lines += [((low[0], z), (high[0], z)) for z in _multiples(low[1], high[1], ground.step)]
    ends = camera.to_pixels(np.array([[(x, 0.0, z) for x, z in line] for line in lines])).reshape(-1, 4)
    grid = "".join("M{:.1f} {:.1f}L{:.1f} {:.1f}".format(*row) for row in ends)
    yield (
        f'<g mask="url(#floor-x)"><g mask="url(#floor-z)"><rect fill="{hexadecimal(STAGE.ground)}" {field}/>'
        f'<path stroke="{hexadecimal(STAGE.grid)}" stroke-width="{line:g}" d="{grid}"/></g></g>'
    )


def _multiples(low: float, high: float, step: float) -> Floats:
    """Return the multiples of a step from `low` to `high` [N]."""
    return step * np.arange(ceil(low / step), floor(high / step) + 1, dtype=np.float64)


def _animation(times: Floats) -> Iterator[str]:
    """Yield the element that shows the frames in turn, and the middle frame for browsers set to reduced motion."""
    if len(times) == 1:
        yield '<use href="#f0"/>'
        return
    duration = times[-1] - times[0] + HOLD_S
    values = ";".join(f"#f{number}" for number in range(len(times)))
    keys = ";".join(f"{(time - times[0]) / duration:.6g}" for time in times)
    yield (
        f'<use class="play" href="#f0"><animate attributeName="href" calcMode="discrete" dur="{duration:.6g}s"'
        f' repeatCount="indefinite" values="{values}" keyTimes="{keys}"/></use>'
    )
    yield f'<use class="still" href="#f{len(times) // 2}" display="none"/>'


class _Artist:
    """Draws a stage as SVG elements."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        # Times and frames keep their columns as their digits grow.
        self.columns = [len(phrase) for phrase, _ in stage.words(len(stage) - 1)[:2]] if len(stage) > 1 else []
        body, joints = stage.body, len(stage.body.skeleton)
        # A surface has one body part and one paint. Balls at bridged joints follow the body's solids.
        pairs = list(zip(body.parts, body.paints, strict=True))
        self.surfaces = list(dict.fromkeys(pairs))
        parts = list(dict.fromkeys(body.parts))
        self.first = [pairs.index(surface) for surface in self.surfaces]  # a solid of each
        self.surface_of = _numbers([self.surfaces.index(pair) for pair in pairs] + [len(self.surfaces)] * joints)
        self.part_of = _numbers([parts.index(part) for part in body.parts] + [len(parts)] * joints)

    def track(self) -> Iterator[str]:
        """Yield the timeline with its insertions."""
        stage = self.stage
        if len(stage) > 1:
            spans = [(*stage.motion.times[[0, -1]], STAGE.timeline)]
            spans += [(*one.times[[0, -1]], VIOLET) for one in stage.motion.insertions]
            for start, end, ink in spans:
                x, y, width = stage.on_track(start), self.stage.track, stage.on_track(end) - stage.on_track(start)
                size = f'width="{width:.5g}" height="{stage.thick}"'
                yield f'<rect x="{x:.5g}" y="{y:.5g}" {size} fill="{hexadecimal(ink)}"/>'

    def ghosts(self) -> Iterator[str]:
        """Yield a group with the end postures of each insertion that has frames."""
        drawn = set()
        for frame in range(len(self.stage)):
            number = self._insertion(frame)
            if number is not None and number not in drawn:
                drawn.add(number)
                ghosts = "".join(
                    f'<g opacity="{GHOST_OPACITY_SHARE}">{self._body(ghost)}</g>' for ghost in self.stage.ghosts(frame)
                )
                yield f'<g id="g{number}">{ghosts}</g>'

    def frame(self, number: int) -> str:
        """Draw a frame."""
        stage = self.stage
        shadow, insertion = stage.shadow(number), self._insertion(number)
        text = self._shadow(shadow.dark, shadow.corner) if shadow else ""
        if insertion is not None:
            text += f'<use href="#g{insertion}"/>'
        return text + self._body(stage.drawing(number)) + self._words(number)

    def _insertion(self, number: int) -> int | None:
        """Return the index of a frame's insertion; None outside insertions."""
        one = self.stage.insertion(number)
        return None if one is None else self.stage.motion.insertions.index(one)

    def _body(self, drawing: FigurePlate) -> str:
        """Draw a body: its colours, shades on them, and lines where one body part stands before another."""
        solid, depth, shade = drawing.buffer.solid, drawing.buffer.depth, drawing.buffer.shade
        surfaces, filled = self.surface_of[solid], solid != EMPTY_CODE
        seen, depths = surfaces[filled], depth[filled]
        regions, text = outlines(surfaces), ""
        for surface in np.unique(regions.labels):
            # Farther surfaces are paler, as in a picture, but each evenly, to show no edges on it.
            near, full, most = haze(self.stage.body)
            far = most * float(np.clip((near - depths[seen == surface].mean()) / (near - full), 0.0, 1.0))
            paint = np.array(BRIDGED) if surface == len(self.surfaces) else drawing.paints[self.first[surface]]
            ink = hexadecimal(paint * 0.95 * (1.0 - far) + 255.0 * far)
            data = self._path(regions.only(regions.labels == surface), drawing.corner)
            text += f'<path fill="{ink}" stroke="{ink}" d="{data}"/>'
        few, shade = filled[::SAMPLES_PER_PX, ::SAMPLES_PER_PX], shade[::SAMPLES_PER_PX, ::SAMPLES_PER_PX]
        for limit in (0.89, 0.78):  # of brightness
            shaded = outlines(np.where(few & (shade < limit), 0, EMPTY_CODE).astype(np.int16))
            shaded = shaded.only(np.abs(shaded.areas()) > 12.0)  # square pixels
            text += f'<path stroke="none" opacity="0.12" d="{self._path(shaded, drawing.corner, 1)}"/>'
        lines = ridges(self.part_of[solid], depth, DEPTH_STEP_M * self.stage.body.size)
        lines = lines.only(lines.lengths() > 4.0 * SAMPLES_PER_PX)  # pixels
        width = 1.25 * self.stage.line / SAMPLES_PER_PX * UNITS_PER_PX  # wider than in pictures
        text += f'<path fill="none" stroke="{hexadecimal(INK)}" stroke-width="{width:g}"'
        text += f' d="{self._path(lines, drawing.corner)}"/>'
        bleed = 0.8 * UNITS_PER_PX  # width of the regions' edges, which leaves no gap between neighbours
        return f'<g transform="scale({1 / UNITS_PER_PX:g})" stroke-width="{bleed:g}">{text}</g>'

    def _shadow(self, dark: Singles, corner: Corner) -> str:
        """Draw the shadow on the floor, in layers that add up to its darkness."""
        opacity = 0.08  # of a layer
        layers = (1.0 - (1.0 - opacity) ** (level + 0.5) for level in count())
        paths = [
            self._path(outlines(np.where(dark > layer, 0, EMPTY_CODE).astype(np.int16)), corner, samples=1)
            for layer in takewhile(lambda layer: layer < dark.max(initial=0.0), layers)
        ]
        text = "".join(f'<path opacity="{opacity}" d="{data}"/>' for data in paths)
        return (
            f'<g transform="scale({1 / UNITS_PER_PX:g})" fill="{hexadecimal(STAGE.shadow)}">{text}</g>' if text else ""
        )

    def _path(self, lines: Lines, corner: Corner, samples: int = SAMPLES_PER_PX) -> str:
        """Return the path data of lines, `samples` a pixel, from a corner (x, y) of the picture, pixels."""
        return path(smooth(lines), UNITS_PER_PX / samples, np.multiply(corner, UNITS_PER_PX))

    def _words(self, number: int) -> str:
        """Draw the caption of a frame: text, and the cursor on the timeline."""
        stage, camera, text = self.stage, self.stage.camera, ""
        x, y, letter = float(camera.margin), stage.line_of_words, 0.55 * stage.letters
        for place, (phrase, ink) in enumerate(stage.words(number)):
            room = max(int((camera.width - camera.margin - x) / letter), 1)
            shown = phrase if len(phrase) <= room else phrase[: room - 1] + "…"
            text += f'<text x="{x:.4g}" y="{y:.4g}" dy=".35em" fill="{hexadecimal(ink)}">{_text(shown)}</text>'
            x += letter * (max([len(phrase), *self.columns[place : place + 1]]) + 2)
        if len(stage) > 1:
            x, y = stage.on_track(stage.motion.times[number]) - 0.5 * stage.thick, self.stage.track - stage.thick
            size = f'width="{stage.thick}" height="{3 * stage.thick}"'
            text += f'<rect x="{x:.5g}" y="{y:.5g}" {size} fill="{hexadecimal(STAGE.text)}"/>'
        return text


def _numbers(numbers: list[int]) -> Int16s:
    """Return a table [N + 1] indexed by the numbers of solids; EMPTY (-1, the last entry) stays EMPTY."""
    return np.array([*numbers, EMPTY_CODE], dtype=np.int16)


def _text(text: str) -> str:
    """Escape a line of text for XML."""
    return xml_text(text.replace("\n", " "))
