"""The changes of a cleaning over time: how far each step moved each part of the body."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np

from motionmind._typing import Floats, Singles
from motionmind.arguments import check_type
from motionmind.body.limbs import sided_parts
from motionmind.body.palette import Colour
from motionmind.clean.cleaning import Cleaning
from motionmind.display import displayed
from motionmind.plots.canvas import Plate
from motionmind.plots.marks import Line, Mark, Words
from motionmind.plots.over_time import TimeAxis
from motionmind.plots.symbols import TEXT_PX, TICK_PX
from motionmind.render.palette import BRIDGED, INK, PLOT, VIOLET

# Of each step, whose curves are drawn in this order; the floor moves all joints alike and is told in words.
_INKS: dict[str, tuple[Colour, str]] = {
    "gaps": (BRIDGED, "gaps filled"),
    "flips": (PLOT.variation, "flips repaired"),
    "feet": (VIOLET, "feet locked"),
    "filter": (PLOT.piece, "jitter filtered"),
}


@dataclass(frozen=True)
class _Lengths:
    """Lengths of the picture, pixels: its width, the margins beside the curves, and each panel with its gap."""

    width: int = 900
    left: float = 200.0
    right: float = 30.0
    top: float = 104.0
    bottom: float = 46.0
    panel: float = 54.0
    apart: float = 20.0


_PX = _Lengths()


def draw_cleaning(cleaning: Cleaning) -> Plate:
    """Draw how far each step of a cleaning moved each part of the body over time.

    A curve shows the joint of the part that a step moved farthest in each frame; all parts have one scale, logarithmic
    above 1 mm. A bar below a leg shows when its foot is locked.

    Args:
        cleaning: the cleaning.

    Returns:
        The picture, which a notebook shows; `picture.save(path)` writes it, as `.svg` or `.png`.

    >>> from motionmind import Engine
    >>> from motionmind.clean import clean_motion
    >>> from motionmind.plots import draw_cleaning
    >>> engine = Engine.load("ballet")
    >>> tween = engine.tween(engine.posture("ballet/arabesque"), engine.posture("ballet/fifth"))
    >>> draw_cleaning(clean_motion(tween.motion)).save("changes.svg")
    """
    check_type("cleaning", cleaning, Cleaning)
    moved = {step: far for step, far in cleaning.moved.items() if step in _INKS}
    most = max(max((1000.0 * float(far.max()) for far in moved.values()), default=0.0), 1.0)
    ticks = np.array([0.0, *(10.0**power for power in range(int(np.log10(most)) + 1))])
    scale = _PX.panel / np.log1p(most)
    marks: list[Mark] = []
    top = _PX.top
    for name, joints in sided_parts(cleaning.original.skeleton).items():
        marks += _panel(cleaning, name, {step: far[:, joints] for step, far in moved.items()}, ticks, top, scale)
        marks += _stances(cleaning, {int(joint) for joint in joints}, top + _PX.panel + 5.0)
        top += _PX.panel + _PX.apart
    bottom = top - _PX.apart + 10.0
    title = f"{displayed(cleaning.original.name) or 'Movement'}: how far cleaning moved joints (mm, logarithmic)"
    frame = [*_heading(cleaning, title), *_axis(cleaning).marks(bottom)]
    return Plate(_PX.width, ceil(bottom + _PX.bottom), title, (*frame, *marks))


def _axis(cleaning: Cleaning) -> TimeAxis:
    return TimeAxis(cleaning.original.times, _PX.width, _PX.left, _PX.right, _PX.top)


def _panel(
    cleaning: Cleaning, name: str, moved: dict[str, Singles], ticks: Floats, top: float, scale: float
) -> Iterator[Mark]:
    """Yield the name, the scale and the curves of a part, given how far each step moved its joints [T, K], metres."""
    bottom, right = top + _PX.panel, _PX.width - _PX.right
    yield Words((_PX.left - 42.0, top + 0.5 * _PX.panel), displayed(name, 22), TEXT_PX, INK, "end")
    for tick in ticks.tolist():
        y = bottom - scale * np.log1p(tick)
        yield Line(np.array([[_PX.left, y], [right, y]]), PLOT.grid, 0.8)
        yield Words((_PX.left - 8.0, y), f"{tick:g}", TICK_PX, PLOT.pale, "end")
    axis = _axis(cleaning)
    for step, (ink, words) in _INKS.items():
        if step in moved and moved[step].max() > 0.0:
            at, far = axis.thinned(1000.0 * moved[step].max(axis=1).astype(np.float64))
            points = np.stack([axis.x(at), bottom - scale * np.log1p(far)], axis=-1)
            yield Line(points, ink, 1.4, title=f"{words}: {displayed(name)}, {far.max():.1f} mm at most")


def _stances(cleaning: Cleaning, joints: set[int], y: float) -> Iterator[Mark]:
    """Yield a bar for each contact of a part's foot that is locked."""
    times, count = cleaning.original.times, len(cleaning.original.skeleton)
    for one in cleaning.contacts:
        if one.point % count in joints and one.point < 2 * count:
            ends = _axis(cleaning).x(times[[one.first, one.last]])
            yield Line(np.stack([ends, [y, y]], axis=-1), VIOLET if one.held else PLOT.edge, 3.0, title="foot locked")


def _heading(cleaning: Cleaning, title: str) -> Iterator[Mark]:
    """Yield the title, the legend of the steps that moved something, and the height of the floor."""
    yield Words((_PX.right, 32.0), title, 18, INK)
    x = _PX.right
    for step, (ink, words) in _INKS.items():
        if step in cleaning.moved and cleaning.moved[step].max() > 0.0:
            yield Line(np.array([[x, 62.0], [x + 22.0, 62.0]]), ink, 2.4)
            yield Words((x + 29.0, 62.0), words, TEXT_PX, PLOT.pale)
            x += 60.0 + 7.2 * len(words)
    floor = next((step.about for step in cleaning.steps if step.step == "floor"), "left as it is")
    yield Words((_PX.right, 84.0), f"Besides, the floor: {floor}", TEXT_PX, PLOT.pale)
