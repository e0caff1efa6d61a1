"""The deviation of a score from its recording over time: how far each part of the body is off, and where most."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_type
from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.plots.canvas import Plate
from motionmind.plots.marks import Line, Mark, Words
from motionmind.plots.over_time import TimeAxis
from motionmind.plots.symbols import TEXT_PX, TICK_PX
from motionmind.render.palette import INK, PLOT
from motionmind.transcription import Transcription

_CURVES = ((PLOT.variation, "score"), (PLOT.piece, "what no score can say"))


@dataclass(frozen=True)
class _Lengths:
    """Lengths of the picture, pixels: its width, margins, panels with their gaps, and figures beside them."""

    width: int = 900
    left: float = 120.0
    right: float = 150.0
    top: float = 104.0
    bottom: float = 46.0
    panel: float = 74.0
    apart: float = 22.0
    figure: float = 70.0


_PX = _Lengths()


class _Panel(NamedTuple):
    """A panel: its name, its curves of values [T] each, what was allowed, and the unit of all."""

    name: str
    curves: tuple[Floats, ...]
    allowed: float
    unit: str


def draw_deviation(transcription: Transcription) -> Plate:
    """Draw how far a score deviates from its recording over time, by body part.

    One curve shows the score's movement, another the same postures written out in full, which no score can improve. A
    dashed line shows the tolerance between postures, ticks on the axis show the postures. Beside each panel stand the
    score's body and, pale, the recorded one, facing the viewer, in the frame that is marked: the worst.

    Args:
        transcription: the transcription.

    Returns:
        The picture, which a notebook shows; `picture.save(path)` writes it, as `.svg` or `.png`.

    Raises:
        MotionMindError: the recording is a single frame.

    >>> from motionmind import Engine
    >>> from motionmind.plots import draw_deviation
    >>> from motionmind.transcription import transcribe
    >>> engine = Engine.load("ballet")
    >>> clip = engine.corpus.motion(engine.corpus.clips[0]).resample(30.0).slice(0, 31)
    >>> draw_deviation(transcribe(clip, 20.0)).save("deviation.svg")
    """
    check_type("transcription", transcription, Transcription)
    recording, found = transcription.recording, transcription.deviation
    if len(recording) < 2:
        raise MotionMindError(f"{recording.name or 'the recording'}: is a single frame, and has no time to draw over")
    axis = TimeAxis(recording.times, _PX.width, _PX.left, _PX.right, _PX.top)
    panels = [
        _Panel(part, (np.array(off), np.array(found.unwritten[part])), transcription.tolerance, "degrees")
        for part, off in found.degrees.items()
    ]
    panels.append(_Panel("pelvis", (np.array(found.centimetres),), 0.5 * transcription.tolerance, "cm"))
    played = transcription.motion.at(transcription.motion.times[0] + (recording.times - recording.times[0]))
    marks, top = list[Mark](), _PX.top
    for panel in panels:
        marks += _draw_panel(panel, axis, top)
        worst = int(panel.curves[0].argmax())
        marks += _draw_bodies(recording, played, worst, top)
        top += _PX.panel + _PX.apart
    bottom = top - _PX.apart + 10.0
    title = f"{displayed(recording.name) or 'Recording'}: how far the score is off"
    frame = [*_heading(title), *axis.marks(bottom)]
    frame += [
        Line(np.array([[x, bottom - 7.0], [x, bottom]]), INK, 1.0, title="posture")
        for x in axis.x(recording.times[transcription.keys]).tolist()
    ]
    return Plate(_PX.width, ceil(bottom + _PX.bottom), title, (*frame, *marks))


def _heading(title: str) -> Iterator[Mark]:
    """Yield the title and the legend."""
    yield Words((30.0, 32.0), title, 18, INK)
    x = 30.0
    for ink, words in _CURVES:
        yield Line(np.array([[x, 62.0], [x + 22.0, 62.0]]), ink, 2.4)
        yield Words((x + 29.0, 62.0), words, TEXT_PX, PLOT.pale)
        x += 60.0 + 7.2 * len(words)
    yield Line(np.array([[x, 62.0], [x + 22.0, 62.0]]), PLOT.edge, 1.2, 4.0)
    yield Words((x + 29.0, 62.0), "tolerance between postures (ticks)", TEXT_PX, PLOT.pale)
    yield Words((30.0, 84.0), "Beside: the worst frame of each part, the recording pale", TEXT_PX, PLOT.pale)


def _draw_panel(panel: _Panel, axis: TimeAxis, top: float) -> Iterator[Mark]:
    """Yield the name, the scale, the tolerance and the curves of a panel, and a line at its worst frame."""
    bottom, most = top + _PX.panel, max(float(panel.curves[0].max()), panel.allowed)
    scale = _PX.panel / most

    def level(value: float) -> Floats:
        y = bottom - scale * value
        return np.array([[axis.left, y], [axis.end, y]])

    yield Words((axis.left - 52.0, top + 0.5 * _PX.panel), panel.name, TEXT_PX, INK, "end")
    for tick in (0.0, most):
        yield Line(level(tick), PLOT.grid, 0.8)
        unit = f" {panel.unit}" if tick else ""
        yield Words((axis.left - 8.0, bottom - scale * tick), f"{tick:.0f}{unit}", TICK_PX, PLOT.pale, "end")
    yield Line(level(panel.allowed), PLOT.edge, 1.2, 4.0, title=f"tolerance: {panel.allowed:g} {panel.unit}")
    x = float(axis.x(axis.times[[int(panel.curves[0].argmax())]])[0])
    yield Line(np.array([[x, top], [x, bottom]]), INK, 0.8)
    for (ink, words), values in reversed(list(zip(_CURVES, panel.curves, strict=False))):
        at, off = axis.thinned(values)
        points = np.stack([axis.x(at), bottom - scale * np.minimum(off, most)], axis=-1)
        yield Line(points, ink, 1.4, title=f"{words}: {panel.name}, {values.max():.1f} {panel.unit} at most")


def _draw_bodies(recording: Motion, played: Motion, frame: int, top: float) -> Iterator[Mark]:
    """Yield the recorded body, pale, and the score's body in a frame, with their pelvises at one place."""
    body = recording.skeleton
    turn = rot.inv(rot.about_vertical(rot.heading(recording.rotations[frame, 0])))
    scale = _PX.figure / body.height
    for motion, ink, width in ((recording, PLOT.grid, 6.0), (played, INK, 1.6)):
        points, tips = np.split(body.positions_and_tips(motion.rotations[frame], np.zeros(3)), [len(body)])
        points, tips = (rot.mul_vec(turn, one) for one in (points, tips))
        ends = [(points[parent], points[joint]) for joint, parent in enumerate(body.parents) if joint]
        ends += [(points[joint], tips[joint]) for joint in range(len(body)) if not body.children(joint)]
        x, y = _PX.width - 0.5 * _PX.right, top + 0.48 * _PX.panel
        for pair in ends:
            yield Line(np.array([[x + scale * end[0], y - scale * end[1]] for end in pair]), ink, width)
    seconds = float(recording.times[frame] - recording.times[0])
    yield Words((_PX.width - 14.0, top + _PX.panel), f"{seconds:.1f} s", TICK_PX, PLOT.pale, "end")
