"""Accents of a request: peaks of speed, or moments of rest, and how far each is from its count."""

from __future__ import annotations

import msgspec
import numpy as np

from motionmind.body.motion import Motion
from motionmind.synthesis.accent_times import AccentKind
from motionmind.synthesis.accents import ON_COUNT_FRAMES, frames_off, speeds_of
from motionmind.tween.request import TweenRequest


class Accented(msgspec.Struct, frozen=True):
    """An accent, and how far the nearest peak of speed, or moment of rest, is from it.

    Attributes:
        count: its count; null if it was given in seconds.
        seconds: its time, from the start.
        kind: "fast" or "still".
        frames: distance of the nearest peak or rest, frames; null if there is none.
    """

    count: float | None
    seconds: float
    kind: AccentKind
    frames: float | None

    @property
    def is_met(self) -> bool:
        """Whether it is within one frame."""
        return self.frames is not None and self.frames <= ON_COUNT_FRAMES

    def __str__(self) -> str:
        """Return the distance in words."""
        what = "peak of speed" if self.kind == "fast" else "moment of rest"
        where = f"{self.seconds:.2f} s" if self.count is None else f"count {self.count:g}"
        if self.frames is None:
            return f"there is no {what} near {where}"
        return f"the {what} is {self.frames:.1f} frames from {where}"


def find_accented(motion: Motion, request: TweenRequest) -> tuple[Accented, ...]:
    """Measure how far the peaks or rests of a motion are from the accents of its request."""
    accents = request.accents
    if accents is None or len(motion) < 2:
        return ()
    off = frames_off(speeds_of(motion), motion.fps, accents)
    return tuple(
        Accented(
            None if isinstance(given, str) else float(given),
            seconds,
            accents.kind,
            float(frames) if np.isfinite(frames) else None,
        )
        for given, seconds, frames in zip(request.accent, accents.seconds, off, strict=True)
    )
