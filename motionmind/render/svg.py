"""Movement as vectors, animated: the figure of the pictures, traced, in a file that a browser plays by itself.

Which limb hides which is decided by the depth buffer, as in pictures; what it shows is traced. A frame is the body's
shadow, its regions in flat colours, the shades on them as translucent regions one within another, and lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import count, takewhile
from math import ceil, floor
from xml.sax.saxutils import escape

import numpy as np

from motionmind._typing import Floats, Int16s, Singles
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.render.camera import SMOOTH, Corner
from motionmind.render.figure import BRIDGED, INK, STEP, haze
from motionmind.render.ground import GRID, GROUND, PAPER, SHADOW, Ground
from motionmind.render.solids import EMPTY
from motionmind.render.stage import GHOST, HOLD, SLOWEST, TRACK, VIOLET, WORDS, FigurePlate, Stage, frame_times
from motionmind.render.trace import Lines, outlines, path, ridges, smooth

_RATE, _MOST = 12.0, 60.0  # frames a second: by default, as drawn animation has them; and those that screens have
_FINE = 10  # units of the file's whole numbers to a pixel
_LIT = 0.95  # brightness of what no shade lies on
_SHADES = (0.89, 0.78)  # brightness below which a region of shade begins
_SHADE = 0.12  # how much each takes of the light
_DUSK = 0.08  # how dark each region of the shadow on the floor is
_SPECK = 12.0  # square pixels: smaller shades are left out
_TICK = 4.0  # pixels: shorter lines are left out
_BLEED = 0.8  # pixels: colours are as much wider than their regions, so that nothing shows between neighbours
_LETTER = 0.55  # widths of a letter, about, by its height
_LINE = 1.25  # width of lines, by those of pictures


def write_svg(
    path: FilePath, motion: Motion, *, fps: float | None = None, view: str = "quarter", size: int = 480, first: int = 0
) -> None:
    """Draw a motion as an animated SVG at `path`; a motion of one frame as a still one.

    Args:
        path: where it goes.
        motion: the movement, on any skeleton.
        fps: frames a second; 12 by default.
        view: from where, one of `camera.VIEWS`.
        size: height of the picture in pixels.
        first: number of the first frame, as `Stage` has it.

    Raises:
        MotionMindError: rate, view or size are none, or the file cannot be written.
    """
    write_atomically(path, svg(motion, fps=fps, view=view, size=size, first=first).encode())


def svg(motion: Motion, *, fps: float | None = None, view: str = "quarter", size: int = 480, first: int = 0) -> str:
    """The text of the file that `write_svg` writes.

    Each frame is a group among the definitions; one reference to them is shown, and its target changes.
    """
    if fps is not None and not SLOWEST <= fps <= _MOST:
        raise MotionMindError(f"an SVG has from {SLOWEST:g} to {_MOST:g} frames a second, not {fps:g}")
    stage = Stage(motion, frame_times(motion, fps or _RATE), view=view, size=size, first=first)
    artist = _Artist(stage)
    width, height = stage.camera.width, stage.camera.height
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
        f' role="img" font-family="system-ui,Helvetica,Arial,sans-serif" font-size="{stage.letters}"'
        ' stroke-linejoin="round" stroke-linecap="round">',
        f"<title>{_plain(motion.name or 'movement')}</title>",
        "<style>text{font-variant-numeric:tabular-nums}"
        "@media(prefers-reduced-motion:reduce){.play{display:none}.still{display:inline}}</style>",
        f'<rect width="100%" height="100%" fill="{_hex(PAPER)}"/>',
        *(_floor(stage.ground, 0.3 * stage.line) if stage.ground else ()),
        *artist.track(),
        "<defs>",
        *artist.ghosts(),
        *(f'<g id="f{number}">{artist.frame(number)}</g>' for number in range(len(stage))),
        "</defs>",
        *_reel(stage.motion.times),
        "</svg>",
    ]
    return "\n".join(text) + "\n"


def _floor(ground: Ground, line: float) -> Iterator[str]:
    """The floor with its grid, in lines so many pixels wide, fading along x and along z."""
    camera, low, high = ground.camera, ground.low - ground.apron, ground.high + ground.apron
    zero, x, z = camera.to_pixels(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    to_pixels = " ".join(f"{value:.6g}" for value in (*(x - zero), *(z - zero), *zero))
    (left, far), (wide, deep) = low, high - low
    field = f'x="{left:.6g}" y="{far:.6g}" width="{wide:.6g}" height="{deep:.6g}" transform="matrix({to_pixels})"'
    everywhere = f'maskUnits="userSpaceOnUse" x="0" y="0" width="{camera.width}" height="{camera.height}"'
    for name, end in (("x", 'x2="1" y2="0"'), ("z", 'x2="0" y2="1"')):
        edge = ground.apron / (wide if name == "x" else deep)
        ramp = [(share, share * share * (3.0 - 2.0 * share)) for share in np.linspace(0.0, 1.0, 6)]
        stops = [(edge * share, there) for share, there in ramp]
        stops += [(1.0 - at, there) for at, there in reversed(stops)]
        text = "".join(f'<stop offset="{at:.4g}" stop-color="#fff" stop-opacity="{there:.4g}"/>' for at, there in stops)
        yield f'<linearGradient id="fade-{name}" x1="0" y1="0" {end}>{text}</linearGradient>'
        yield f'<mask id="floor-{name}" {everywhere}><rect fill="url(#fade-{name})" {field}/></mask>'
    lines = [((x, low[1]), (x, high[1])) for x in _steps(low[0], high[0], ground.step)]
    lines += [((low[0], z), (high[0], z)) for z in _steps(low[1], high[1], ground.step)]
    ends = camera.to_pixels(np.array([[(x, 0.0, z) for x, z in line] for line in lines])).reshape(-1, 4)
    grid = "".join("M{:.1f} {:.1f}L{:.1f} {:.1f}".format(*row) for row in ends)
    yield (
        f'<g mask="url(#floor-x)"><g mask="url(#floor-z)"><rect fill="{_hex(GROUND)}" {field}/>'
        f'<path stroke="{_hex(GRID)}" stroke-width="{line:g}" d="{grid}"/></g></g>'
    )


def _steps(low: float, high: float, step: float) -> Floats:
    """Multiples of a step from `low` to `high`."""
    return step * np.arange(ceil(low / step), floor(high / step) + 1, dtype=np.float64)


def _reel(times: Floats) -> Iterator[str]:
    """What shows the frames one after another; to those who want no motion, the middle one."""
    if len(times) == 1:
        yield '<use href="#f0"/>'
        return
    lasts = times[-1] - times[0] + HOLD
    values = ";".join(f"#f{number}" for number in range(len(times)))
    keys = ";".join(f"{(time - times[0]) / lasts:.6g}" for time in times)
    yield (
        f'<use class="play" href="#f0"><animate attributeName="href" calcMode="discrete" dur="{lasts:.6g}s"'
        f' repeatCount="indefinite" values="{values}" keyTimes="{keys}"/></use>'
    )
    yield f'<use class="still" href="#f{len(times) // 2}" display="none"/>'


class _Artist:
    """Draws what is on a stage, as elements of SVG."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        # Times and frames keep their columns while they grow.
        self.columns = [len(phrase) for phrase, _ in stage.words(len(stage) - 1)[:2]] if len(stage) > 1 else []
        body, joints = stage.body, len(stage.body.skeleton)
        # What a colour's regions are of: a part and a paint. Beyond the body's solids are balls at bridged joints.
        pairs = list(zip(body.parts, body.paints, strict=True))
        self.kinds = list(dict.fromkeys(pairs))
        parts = list(dict.fromkeys(body.parts))
        self.first = [pairs.index(kind) for kind in self.kinds]  # a solid of each
        self.kind_of = _numbers([self.kinds.index(pair) for pair in pairs] + [len(self.kinds)] * joints)
        self.part_of = _numbers([parts.index(part) for part in body.parts] + [len(parts)] * joints)

    def track(self) -> Iterator[str]:
        """The line of time, with what the engine inserted."""
        stage = self.stage
        if len(stage) > 1:
            spans = [(*stage.motion.times[[0, -1]], TRACK)]
            spans += [(*one.times[[0, -1]], VIOLET) for one in stage.motion.insertions]
            for start, end, ink in spans:
                x, y, width = stage.on_track(start), self.stage.track, stage.on_track(end) - stage.on_track(start)
                yield f'<rect x="{x:.5g}" y="{y:.5g}" width="{width:.5g}" height="{stage.thick}" fill="{_hex(ink)}"/>'

    def ghosts(self) -> Iterator[str]:
        """The postures between which the engine made movement, a group for each insertion that has frames."""
        drawn = set()
        for frame in range(len(self.stage)):
            number = self._insertion(frame)
            if number is not None and number not in drawn:
                drawn.add(number)
                ghosts = "".join(f'<g opacity="{GHOST}">{self._body(ghost)}</g>' for ghost in self.stage.ghosts(frame))
                yield f'<g id="g{number}">{ghosts}</g>'

    def frame(self, number: int) -> str:
        """One moment."""
        stage = self.stage
        shadow, insertion = stage.shadow(number), self._insertion(number)
        text = self._dusk(shadow.dark, shadow.corner) if shadow else ""
        if insertion is not None:
            text += f'<use href="#g{insertion}"/>'
        return text + self._body(stage.drawing(number)) + self._words(number)

    def _insertion(self, number: int) -> int | None:
        """Which of the motion's insertions goes on at a moment."""
        one = self.stage.insertion(number)
        return None if one is None else self.stage.motion.insertions.index(one)

    def _body(self, drawing: FigurePlate) -> str:
        """A body: its colours, the shades on them, and lines where a part stands before another."""
        solid, depth, shade = drawing.canvas.solid, drawing.canvas.depth, drawing.canvas.shade
        kinds, filled = self.kind_of[solid], solid != EMPTY
        regions, text = outlines(kinds), ""
        for kind in np.unique(regions.labels):
            # As in a picture what is farther is paler, but a part all over, so that no edges show on it.
            near, full, most = haze(self.stage.body)
            far = most * float(np.clip((near - depth[kinds == kind].mean()) / (near - full), 0.0, 1.0))
            paint = np.array(BRIDGED) if kind == len(self.kinds) else drawing.paints[self.first[kind]]
            ink = _hex(paint * _LIT * (1.0 - far) + 255.0 * far)
            ways = self._path(regions.only(regions.labels == kind), drawing.corner)
            text += f'<path fill="{ink}" stroke="{ink}" d="{ways}"/>'
        for limit in _SHADES:
            shaded = outlines(np.where(filled & (shade < limit), 0, EMPTY).astype(np.int16)[::SMOOTH, ::SMOOTH])
            shaded = shaded.only(np.abs(shaded.areas()) > _SPECK)
            text += f'<path stroke="none" opacity="{_SHADE}" d="{self._path(shaded, drawing.corner, 1)}"/>'
        lines = ridges(self.part_of[solid], depth, STEP * self.stage.body.size)
        lines = lines.only(lines.lengths() > _TICK * SMOOTH)
        text += f'<path fill="none" stroke="{_hex(INK)}" stroke-width="{_LINE * self.stage.line / SMOOTH * _FINE:g}"'
        text += f' d="{self._path(lines, drawing.corner)}"/>'
        return f'<g transform="scale({1 / _FINE:g})" stroke-width="{_BLEED * _FINE:g}">{text}</g>'

    def _dusk(self, dark: Singles, corner: Corner) -> str:
        """The shadow on the floor, in layers that together are as dark as it is."""
        layers = (1.0 - (1.0 - _DUSK) ** (level + 0.5) for level in count())
        ways = [
            self._path(outlines(np.where(dark > layer, 0, EMPTY).astype(np.int16)), corner, samples=1)
            for layer in takewhile(lambda layer: layer < dark.max(initial=0.0), layers)
        ]
        text = "".join(f'<path opacity="{_DUSK}" d="{way}"/>' for way in ways)
        return f'<g transform="scale({1 / _FINE:g})" fill="{_hex(SHADOW)}">{text}</g>' if text else ""

    def _path(self, lines: Lines, corner: Corner, samples: int = SMOOTH) -> str:
        """Lines among samples, so many to a pixel, from a corner (x, y) of the picture on, pixels."""
        return path(smooth(lines), _FINE / samples, np.multiply(corner, _FINE))

    def _words(self, number: int) -> str:
        """What is written under a moment, and where on the line of time it is."""
        stage, camera, text = self.stage, self.stage.camera, ""
        x, y, letter = float(camera.margin), stage.line_of_words, _LETTER * stage.letters
        for place, (phrase, ink) in enumerate(stage.words(number)):
            room = max(int((camera.width - camera.margin - x) / letter), 1)
            shown = phrase if len(phrase) <= room else phrase[: room - 1] + "…"
            text += f'<text x="{x:.4g}" y="{y:.4g}" dy=".35em" fill="{_hex(ink)}">{_plain(shown)}</text>'
            x += letter * (max([len(phrase), *self.columns[place : place + 1]]) + 2)
        if len(stage) > 1:
            x, y = stage.on_track(stage.motion.times[number]) - 0.5 * stage.thick, self.stage.track - stage.thick
            size = f'width="{stage.thick}" height="{3 * stage.thick}"'
            text += f'<rect x="{x:.5g}" y="{y:.5g}" {size} fill="{_hex(WORDS)}"/>'
        return text


def _numbers(numbers: list[int]) -> Int16s:
    """Numbers of solids, EMPTY, the last, among them."""
    return np.array([*numbers, EMPTY], dtype=np.int16)


def _hex(rgb: Iterable[float]) -> str:
    """A colour as SVG writes it."""
    return "#" + "".join(f"{round(float(value)):02x}" for value in rgb)


def _plain(text: str) -> str:
    """Text in XML, which has no way to write control characters."""
    return escape(re.sub(r"[\x00-\x1f\x7f\ud800-\udfff\ufffe\uffff]", " ", text))
