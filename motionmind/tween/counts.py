"""Counts: durations and times in a tempo. Count 1 is the first frame, and a tween of 8 counts ends on count 9."""

from __future__ import annotations

import re

from motionmind.display import displayed
from motionmind.errors import MotionMindError

TEMPO_RANGE_BPM = (1.0, 6000.0)  # counts a minute, as in scores
COUNTS_RANGE = (1e-3, 1e5)
SAME_TIME_S = 1e-6  # the last digit of a time in words: times no farther apart count as equal
_TIME = re.compile(r"(?:count ?(?P<count>\d{1,6}(?:\.\d{1,6})?)|(?P<seconds>\d{1,6}(?:\.\d{1,6})?) ?s)\Z", re.ASCII)


def counts_to_seconds(counts: float, tempo: float) -> float:
    """Return the duration of some counts at a tempo, counts a minute, in seconds."""
    return counts * 60.0 / tempo


def seconds_to_count(seconds: float, tempo: float) -> float:
    """Return the count at a time, seconds from the first frame, at a tempo, counts a minute.

    Examples:
        >>> from motionmind.tween.counts import seconds_to_count
        >>> seconds_to_count(1.5, 120.0)
        4.0
    """
    return 1.0 + seconds * tempo / 60.0


def moment(seconds: float, tempo: float | None) -> str:
    """Format a time; with a tempo, counts a minute, by its count: "count 4 (1.50 s)"."""
    return f"{seconds:.2f} s" if tempo is None else f"count {seconds_to_count(seconds, tempo):.3g} ({seconds:.2f} s)"


def parse_time(name: str, text: str, tempo: float | None) -> float:
    """Return the time of "1.5s", or of "count 4" at a tempo, seconds from the first frame.

    Args:
        name: what the time is for, in the error.
        text: the time.
        tempo: counts a minute; None if there is none.

    Raises:
        MotionMindError: the text is neither, the count is before 1, or there is no tempo to count by.
    """
    found = _TIME.match(text)
    if found is None:
        raise MotionMindError(f"{name}: {displayed(repr(text), 60)} is neither seconds such as '1.5s' nor 'count 4'")
    if found["seconds"]:
        return float(found["seconds"])
    if tempo is None:
        raise MotionMindError(f"{name}: {displayed(text)} needs a tempo, such as 120 counts a minute")
    if float(found["count"]) < 1.0:
        raise MotionMindError(f"{name}: counts begin with 1, which is A, not with {found['count']}")
    return counts_to_seconds(float(found["count"]) - 1.0, tempo)
