"""What makes searches fast the first time, told of truthfully: how far it is, and how long it will take."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from math import ceil

Steps = Generator[tuple[int, int, bool]]  # how far it is, of how much, and whether searches may begin
Told = Generator[tuple[int, int, str, bool]]  # the same, with what is going on

_FIRST, _REST = "getting ready, once", "getting the rest ready"
_SOON = 5  # seconds and steps before which nobody knows how long it will take


def told(steps: Steps, now: Callable[[], float] = time.monotonic) -> Told:
    """Say of each step what is going on, and how long it will take as fast as it has gone until then.

    How fast that is hangs on what else the computer does, so no usual time is promised. To close the iterator closes
    `steps`.

    Args:
        steps: the steps, whose measure may change when searches may begin.
        now: returns the time in seconds.
    """
    try:
        begun: tuple[float, int] | None = None
        was_ready = False
        for done, of, is_ready in steps:
            if begun is None or is_ready != was_ready:
                begun, was_ready = (now(), done), is_ready
            seconds, gone = now() - begun[0], done - begun[1]
            words = _REST if is_ready else _FIRST
            if seconds >= _SOON and gone >= _SOON:
                words += f": {_duration(seconds * (of - done) / gone)}"
            yield done, of, words, is_ready
    finally:
        steps.close()


def _duration(seconds: float) -> str:
    """Return a duration as people say it who do not know it exactly."""
    if seconds < 10:
        return "a few seconds"
    if seconds <= 60:
        return f"about {10 * ceil(seconds / 10)} s"
    minutes = ceil(seconds / 60)
    return f"about {minutes} minutes"
