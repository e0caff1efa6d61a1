"""Progress of the preparation that makes the first searches fast, with an estimate of the remaining time."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from math import ceil

Steps = Generator[tuple[int, int, bool]]  # steps done, steps in all, and whether searches may begin
Told = Generator[tuple[int, int, str, bool]]  # the same, with a description before the last


def told(steps: Steps, now: Callable[[], float] = time.monotonic) -> Told:
    """Describe each step, with the remaining time at the pace of the last few steps.

    The pace, over the last 15 steps, depends on the load of the computer. Closing the iterator closes `steps`.

    Args:
        steps: the steps; their counts may start anew once searches may begin.
        now: returns the time in seconds.
    """
    try:
        gone: list[tuple[float, int]] = []  # time, and steps done by then
        was_ready = False
        for done, of, is_ready in steps:
            if is_ready != was_ready:
                gone, was_ready = [], is_ready
            gone.append((now(), done))
            words = "getting the rest ready" if is_ready else "getting ready, first time only"
            if done - gone[0][1] >= 10:  # the first functions compile many others
                time_then, done_then = next((one for one in reversed(gone) if one[1] <= done - 15), gone[0])
                words += f": {_duration((now() - time_then) * (of - done) / (done - done_then))}"
            yield done, of, words, is_ready
    finally:
        steps.close()


def _duration(seconds: float) -> str:
    """Return a rough duration in words."""
    if seconds < 10:
        return "a few seconds"
    if seconds <= 90:
        return f"about {10 * ceil(seconds / 10)} s"
    return f"about {ceil(seconds / 30) / 2:g} minutes"
