"""A clip's recording at an even rate, made block by block, so that hours of it take no more memory than minutes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.motion import Motion
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.geometry.splines import natural_spline, rotation_spline

FPS = 30.0  # at which movement is looked at where no other rate is said
BLOCK = 3840  # frames that are made at a time


class Sampled:
    """The frames of `corpus.recording(clip).resample(rate)`, of which only those that are asked for are made.

    Args:
        corpus: the movement.
        clip: one of its clips.
        rate: frames a second.
        smooth: whether frames of coarser recordings are on splines through theirs, as those of
            `motionmind.body.plausibility.at_rate`, instead of on straight lines.
    """

    def __init__(self, corpus: Corpus, clip: Clip, rate: float, *, smooth: bool = False) -> None:
        self.skeleton = corpus.skeleton
        self._corpus, self.clip = corpus, clip
        self._recorded = recorded = corpus.recorded_times(clip)
        steps = np.floor((recorded[-1] - recorded[0]) * rate + 1e-3)
        self.times = recorded[0] + np.arange(steps + 1) / rate
        self._smooth = smooth and len(recorded) > 1 and 1.0 / np.median(np.diff(recorded)) < rate

    def __len__(self) -> int:
        return len(self.times)

    def frames(self, start: int, stop: int) -> Motion:
        """Return the frames from `start` up to, not including, `stop`; up to the last if there are not so many.

        Of a clip of one block the frames are made once.
        """
        return self._whole.slice(start, stop) if len(self) <= BLOCK else self._make(start, stop)

    def _make(self, start: int, stop: int) -> Motion:
        times = self.times[start:stop]
        if self._smooth:
            keys = self._keys
            rotations = rotation_spline(keys.times, keys.rotations, times)
            return Motion(keys.skeleton, rotations, natural_spline(keys.times, keys.root, times), times, keys.name)
        first, last = np.searchsorted(self._recorded, times[[0, -1]], side="right")
        return self._corpus.recording(self.clip, max(int(first) - 1, 0), int(last) + 1).at(times)

    def blocks(self, size: int, overlap: int = 0) -> Iterator[Motion]:
        """Yield all frames, `size` at a time, each block with so many of the frames before it."""
        for start in range(0, len(self), size):
            yield self.frames(max(start - overlap, 0), start + size)

    def take(self, numbers: Ints) -> tuple[Floats, Floats]:
        """Return rotations [n, J, 4] and root positions [n, 3], metres, of frames with these numbers [n], in order."""
        rotations = np.empty((len(numbers), len(self._corpus.skeleton), 4))
        root = np.empty((len(numbers), 3))
        for number in np.unique(numbers // BLOCK):
            here = np.flatnonzero(numbers // BLOCK == number)
            first = numbers[here[0]]
            part = self.frames(int(first), int(numbers[here[-1]]) + 1)
            rotations[here], root[here] = part.rotations[numbers[here] - first], part.root[numbers[here] - first]
        return rotations, root

    def danced(self, times: Floats) -> Bools:
        """Return in which steps from one of some times [T] to the next nothing was reconstructed [T - 1]."""
        known = np.ones(len(times) - 1, dtype=np.bool_)
        for repair in self.clip.repairs:
            if not repair.exact:
                first, last = repair.seconds
                known &= (times[1:] < first) | (times[:-1] > last)
        return known

    @cached_property
    def _whole(self) -> Motion:
        return self._make(0, len(self))

    @cached_property
    def _keys(self) -> Motion:
        return self._corpus.recording(self.clip)
