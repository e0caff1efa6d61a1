"""Beats: when the counts of a piece of music come."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.arguments import as_floats, as_integers, check_integer, check_real
from motionmind.errors import MotionMindError

MAX_BEATS = 20_000  # an hour at 333 a minute
LEAST_BEAT_S = 0.01  # between two beats: 6000 a minute, as the fastest tempo of a score
_SAME_TIME_S = 1e-6  # times no farther apart count as equal


@dataclass(frozen=True, eq=False)
class Beats:
    """The times of beats. Count 1 is the first downbeat that is known, or else the first beat.

    After the last beat, counts go on as far apart as the last two beats; before the first beat, as the first two.

    Attributes:
        times: seconds from the beginning of the music, increasing [N], N at least 2.
        in_bar: number of each beat in its bar, from 1 [N]; 0 where unknown.
        first: index of the beat that is count 1; None for the first downbeat.

    >>> from motionmind.music import Beats
    >>> beats = Beats([0.5, 1.0, 1.5, 2.5], in_bar=[4, 1, 2, 3])
    >>> beats.start, beats.seconds(3)
    (1.0, 1.5)
    """

    times: Floats
    in_bar: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    first: int | None = None

    def __post_init__(self) -> None:
        times = as_floats("times", self.times)
        in_bar = as_integers("in_bar", self.in_bar)
        if times.ndim != 1 or not 2 <= len(times) <= MAX_BEATS or not np.isfinite(times).all():
            raise MotionMindError(f"beats must be from 2 to {MAX_BEATS:,} finite times, not {times.size}")
        if (np.diff(times) < LEAST_BEAT_S).any():
            at = int(np.argmax(np.diff(times) < LEAST_BEAT_S))
            raise MotionMindError(
                f"beat {at + 2} comes at {times[at + 1]:g} s, not {LEAST_BEAT_S:g} s or more after beat {at + 1} at "
                f"{times[at]:g} s: times of beats must increase"
            )
        in_bar = in_bar if len(in_bar) else np.zeros(len(times), dtype=np.int64)
        if in_bar.shape != times.shape or (in_bar < 0).any():
            raise MotionMindError("in_bar must be a number for each beat: from 1, or 0 if unknown")
        check_integer("first", 0 if self.first is None else self.first)
        if self.first is not None and not 0 <= self.first < len(times):
            raise MotionMindError(f"first must be the index of a beat, 0 to {len(times) - 1}, not {self.first}")
        for array in (times, in_bar):
            array.setflags(write=False)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "in_bar", in_bar)
        if self.first is None:
            object.__setattr__(self, "first", int(np.argmax(in_bar == 1)))

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        return f"<Beats: {len(self)} from {self.times[0]:.2f} to {self.times[-1]:.2f} s, {self.tempo:.1f} a minute>"

    @property
    def tempo(self) -> float:
        """Counts a minute, by the median of the time between beats."""
        return float(60.0 / np.median(np.diff(self.times)))

    @property
    def start(self) -> float:
        """When count 1 comes, seconds from the beginning of the music."""
        return float(self.times[self._first])

    @property
    def counts(self) -> int:
        """Number of counts from count 1 to the last beat."""
        return len(self) - self._first

    @property
    def _first(self) -> int:
        assert self.first is not None
        return self.first

    def seconds(self, count: float) -> float:
        """Return when a count comes, seconds from count 1; between two beats in proportion.

        Raises:
            MotionMindError: the count is not a finite number.
        """
        check_real("count", count)
        if not np.isfinite(count):
            raise MotionMindError(f"a count must be a finite number, not {count}")
        place = self._first + float(count) - 1.0
        at = int(np.clip(np.floor(place), 0, len(self) - 2))
        before, after = self.times[at : at + 2]
        return float(before + (place - at) * (after - before) - self.start)

    def count(self, seconds: float) -> float:
        """Return the count at a time, seconds from count 1; the inverse of `seconds`.

        Raises:
            MotionMindError: the time is not a finite number.

        >>> from motionmind.music import Beats
        >>> Beats([0.5, 1.0, 2.0]).count(1.0)
        2.5
        """
        check_real("seconds", seconds)
        if not np.isfinite(seconds):
            raise MotionMindError(f"a time must be a finite number, not {seconds}")
        time = self.start + float(seconds)
        at = int(np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, len(self) - 2))
        before, after = self.times[at : at + 2]
        return float(at - self._first + 1.0 + (time - before) / (after - before))

    def grid(self, every: int, seconds: float) -> Floats:
        """Return when counts 1, 1 + every, 1 + 2 every, ... come, up to the first at or after `seconds`.

        Args:
            every: the interval, counts.
            seconds: seconds from count 1.

        Returns:
            Times [M], seconds from count 1, the first 0; M is at least 2.
        """
        check_integer("every", every)
        check_real("seconds", seconds)
        if every < 1 or not np.isfinite(seconds):
            raise MotionMindError(f"a grid needs a whole number of counts from 1 on, and finite seconds, not {every}")
        step = float(self.times[-1] - self.times[-2])
        later = self.times[self._first :] - self.start
        more = np.arange(1, np.ceil(max(seconds - later[-1], 0.0) / step) + every + 1)
        grid = np.concatenate([later, later[-1] + step * more])[::every]
        return grid[: max(int(np.searchsorted(grid, seconds - _SAME_TIME_S)) + 1, 2)]

    def starting_at(self, seconds: float) -> Beats:
        """Return the beats with count 1 at the first beat at or after `seconds` of the music.

        Raises:
            MotionMindError: there is no beat so late.
        """
        check_real("seconds", seconds)
        at = int(np.searchsorted(self.times, seconds - _SAME_TIME_S))
        if at == len(self):
            raise MotionMindError(f"the last beat comes at {self.times[-1]:.2f} s, before {seconds:g} s")
        return replace(self, first=at)


def beats_of_tempo(tempo: float) -> Beats:
    """Return beats at a tempo, counts a minute; count 1 comes at 0 s."""
    return Beats(np.array([0.0, 60.0 / tempo]))
