"""A player that Python and the page share: if one of them changes the time or the selection, the other follows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from motionmind.arguments import as_floats
from motionmind.body.motion import Motion, Posture
from motionmind.errors import MotionMindError
from motionmind.notebook.cell import check_length, motion_of, packed
from motionmind.render.page import page_beside
from motionmind.render.timing import SAME_TIME_S

try:
    import anywidget
    import traitlets
except ImportError as error:
    raise ImportError(
        f'the player in notebooks needs anywidget: pip install "motionmind[notebook]" ({error})'
    ) from error


class Player(anywidget.AnyWidget):
    """A widget that plays movement in a notebook; `time`, `motion` and `selection` are shared with Python.

    Args:
        movement: a motion, posture, tween, piece or variation.
        height: of the widget, pixels.

    Attributes:
        motion: the motion shown; assign another to replace it.
        time: the time shown, seconds; during playback Python receives it ten times a second.
        selection: start and end of the selected time, seconds; None without a selection.

    Raises:
        WrongTypeError: the argument is not a movement.
        MotionMindError: the motion is too long for a notebook, or a time or a selection is outside the motion.

    >>> from motionmind import Engine
    >>> from motionmind.notebook import Player
    >>> engine = Engine.load("ballet")
    >>> player = Player(engine.tween(engine.posture("ballet/arabesque"), engine.posture("ballet/fifth")))
    >>> player.selection = (0.5, 1.0)
    >>> player.selected().times[[0, -1]].tolist()
    [0.5, 1.0]
    """

    _esm = Path(__file__).parent / "widget.js"

    motion: Motion = traitlets.Instance(Motion)
    time: float = traitlets.Float().tag(sync=True)
    selection: tuple[float, float] | None = traitlets.Tuple(default_value=None, allow_none=True).tag(sync=True)
    height: int = traitlets.Int(480).tag(sync=True)
    _page: str = traitlets.Unicode().tag(sync=True)

    def __init__(self, movement: Any, *, height: int = 480) -> None:
        motion = motion_of(movement)
        super().__init__(motion=motion, time=float(motion.times[0]), height=height)

    def selected(self) -> Motion:
        """Return the frames of the selection, at unchanged times; all frames if nothing is selected.

        A selection without a frame returns the frame before it.
        """
        if self.selection is None:
            return self.motion
        start, end = self.selection
        first = int(np.searchsorted(self.motion.times, start - SAME_TIME_S))
        stop = int(np.searchsorted(self.motion.times, end + SAME_TIME_S))
        return self.motion.slice(min(first, max(stop - 1, 0)), max(stop, 1))

    def posture(self) -> Posture:
        """Return the posture at the time shown."""
        return self.motion.at(np.array([self.time])).posture(0)

    @traitlets.validate("motion")
    def _check_motion(self, proposal: Any) -> Motion:
        motion: Motion = proposal.value
        check_length(motion)
        return motion

    @traitlets.observe("motion")
    def _show(self, change: Any) -> None:
        with self.hold_trait_notifications():
            self.selection = None
            self.time = float(self.motion.times[0])
        self._page = packed(page_beside(self.motion, "notebook", {}), self.motion.name)

    @traitlets.validate("time")
    def _check_time(self, proposal: Any) -> float:
        self._check_within("time", proposal.value)
        return float(proposal.value)

    @traitlets.validate("selection")
    def _check_selection(self, proposal: Any) -> tuple[float, float] | None:
        if proposal.value is None:
            return None
        times = as_floats("selection", proposal.value)
        if times.shape != (2,) or not times[0] < times[1]:
            raise MotionMindError(f"selection: must be an earlier and a later time, not {proposal.value}")
        self._check_within("selection", *times.tolist())
        return float(times[0]), float(times[1])

    def _check_within(self, name: str, *times: float) -> None:
        first, last = map(float, self.motion.times[[0, -1]])
        for time in times:
            if not first - SAME_TIME_S <= time <= last + SAME_TIME_S:
                raise MotionMindError(f"{name}: the motion lasts from {first:g} to {last:g} s; {time:g} is outside")
