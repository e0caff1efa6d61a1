"""A clip's recording resampled at an even rate, block by block: hours take no more memory than minutes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.motion import Motion
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.geometry.splines import natural_spline, rotation_spline

SAMPLED_FPS = 30.0  # for measurements
BLOCK_FRAMES = 3840  # resampled at a time


class Sampled:
    """The frames of `corpus.recording(clip).resample(rate)`, computed on demand.

    Args:
        corpus: the movement.
        clip: one of its clips.
        rate: frames per second.
        smooth: whether to interpolate coarser recordings with splines, as `motionmind.body.plausibility.at_rate` does,
            instead of linearly.
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
        """Return the frames from `start` to `stop`, excluded, or to the last frame if that is earlier.

        The frames of a clip that fits one block are cached.
        """
        return self._whole.slice(start, stop) if len(self) <= BLOCK_FRAMES else self._make(start, stop)

    def _make(self, start: int, stop: int) -> Motion:
        times = self.times[start:stop]
        if self._smooth:
            keys = self._keys
            rotations = rotation_spline(keys.times, keys.rotations, times)
            return Motion(keys.skeleton, rotations, natural_spline(keys.times, keys.root, times), times, keys.name)
        first, last = np.searchsorted(self._recorded, times[[0, -1]], side="right")
        return self._corpus.recording(self.clip, max(int(first) - 1, 0), int(last) + 1).at(times)

    def blocks(self, size: int, overlap: int = 0) -> Iterator[Motion]:
        """Yield all frames, `size` at a time, each block preceded by `overlap` frames of the one before."""
        for start in range(0, len(self), size):
            yield self.frames(max(start - overlap, 0), start + size)

    def take(self, numbers: Ints) -> tuple[Floats, Floats]:
        """Return rotations [n, J, 4] and root positions [n, 3], metres, of frames given by increasing index [n]."""
        rotations = np.empty((len(numbers), len(self._corpus.skeleton), 4))
        root = np.empty((len(numbers), 3))
        for number in np.unique(numbers // BLOCK_FRAMES):
            here = np.flatnonzero(numbers // BLOCK_FRAMES == number)
            first = numbers[here[0]]
            part = self.frames(int(first), int(numbers[here[-1]]) + 1)
            rotations[here], root[here] = part.rotations[numbers[here] - first], part.root[numbers[here] - first]
        return rotations, root

    def danced(self, times: Floats) -> Bools:
        """Return a mask of the steps between consecutive times [T] that contain no reconstructed movement [T - 1]."""
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
