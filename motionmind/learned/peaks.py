"""Peaks: what the greatest speeds, and accelerations of the root, keep to in windows of some length.

A movement of many seconds that is nowhere faster than all but a hundredth of a corpus's moments may still show more
than any of the corpus that is as long, for quick clips are short. So the greatest of each part is taken of all windows
of a length, and the hundredth of the windows that show most is left out.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.learned.percentiles import Percentile
from motionmind.learned.sampled import FPS

RARE = 99.0  # percentile of frames, or windows
LENGTHS = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0  # seconds of the windows whose peaks are known
STRIDE = 6  # frames from window to window
FEW = 10  # windows; where there are fewer, peaks are those of shorter ones
_SIZES = [round(seconds * FPS / STRIDE) for seconds in LENGTHS]  # of the windows, in strides


class Peaks:
    """The peaks of stretches of movement that come one after the other, at FPS frames a second.

    Args:
        lengths: the numbers of steps of all stretches that will come [n].
    """

    def __init__(self, lengths: Ints) -> None:
        parts = -(-lengths // STRIDE)
        counts = [int(np.maximum(parts - size + 1, 0).sum()) for size in _SIZES]
        self._windows = [Percentile(RARE, count) if count >= FEW else None for count in counts]

    def add(self, speeds: Floats, moved: Floats) -> None:
        """Add the next stretch of T steps.

        Args:
            speeds: of all parts [T, K].
            moved: displacements of the root [T, 3], heights.
        """
        parts = np.column_stack([speeds, np.append(accelerations(moved, FPS), 0.0)])
        # Each STRIDE frames are one, for the greatest is the same.
        parts = np.maximum.reduceat(parts, np.arange(0, len(parts), STRIDE))
        for size, windows in zip(_SIZES, self._windows, strict=True):
            if windows is not None and len(parts) >= size:
                windows.add(np.lib.stride_tricks.sliding_window_view(parts, size, axis=0).max(axis=-1))

    def values(self, most: Floats, least: Floats) -> Floats:
        """Return the peaks of windows of each of LENGTHS [6, K + 1].

        Args:
            most: of windows too few to tell, if there are no shorter ones [K + 1].
            least: what no peak is less than [K + 1].
        """
        peaks = []
        for windows in self._windows:
            most = most if windows is None else np.maximum(windows.value(), least)
            peaks.append(most)
        return np.stack(peaks)


def accelerations(moved: Floats, fps: float) -> Floats:
    """Return the accelerations between steps [T - 1], from displacements in each [T, 3], at so many a second."""
    return np.asarray(fps**2 * np.linalg.norm(np.diff(moved, axis=0), axis=1))
