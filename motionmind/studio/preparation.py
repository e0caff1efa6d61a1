"""Preparation: how far it is with what makes searches fast the first time, and how long it will take, in words."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from math import ceil

Steps = Generator[tuple[int, int, bool]]  # how far it is, of how much, and whether searches may begin
Told = Generator[tuple[int, int, str, bool]]  # the same, with what is going on

_FIRST, _REST = "getting ready, once", "getting the rest ready"
_SOON = 10  # steps before which nobody knows how long it will take: the first functions compile many others
_LATELY = 15  # steps by which the pace is told


def told(steps: Steps, now: Callable[[], float] = time.monotonic) -> Told:
    """Say of each step what is going on, and how long it will take as fast as it has gone lately.

    How fast that is hangs on what else the computer does, so no usual time is promised. To close the iterator closes
    `steps`.

    Args:
        steps: the steps, whose measure may change when searches may begin.
        now: returns the time in seconds.
    """
    try:
        gone: list[tuple[float, int]] = []  # when how many were done
        was_ready = False
        for done, of, is_ready in steps:
            if is_ready != was_ready:
                gone, was_ready = [], is_ready
            gone.append((now(), done))
            words = _REST if is_ready else _FIRST
            if done - gone[0][1] >= _SOON:
                time_then, done_then = next((one for one in reversed(gone) if one[1] <= done - _LATELY), gone[0])
                words += f": {_duration((now() - time_then) * (of - done) / (done - done_then))}"
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
