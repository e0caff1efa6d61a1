"""Peaks: limits on speeds and on the root's acceleration within windows of a given length.

Quick clips are short: a long movement whose every frame is below the 99th percentile of a corpus's speeds may still be
livelier than any stretch of the corpus that long. So each limit is the 99th percentile, over all windows of a length,
of the greatest value in the window.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.learned.percentiles import Percentile
from motionmind.learned.sampled import SAMPLED_FPS

PEAK_PERCENTILE = 99.0  # of frames, or windows
PEAK_WINDOWS_S = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0
STRIDE_FRAMES = 6  # from window to window
MIN_WINDOWS = 10  # with fewer, the peaks of shorter windows apply
_WINDOW_STRIDES = [
    round(seconds * SAMPLED_FPS / STRIDE_FRAMES) for seconds in PEAK_WINDOWS_S
]  # of the windows, in strides


class Peaks:
    """The peaks of stretches of movement, added one after the other, at SAMPLED_FPS.

    Args:
        lengths: numbers of steps of all stretches to be added [n].
    """

    def __init__(self, lengths: Ints) -> None:
        parts = -(-lengths // STRIDE_FRAMES)
        counts = [int(np.maximum(parts - size + 1, 0).sum()) for size in _WINDOW_STRIDES]
        self._windows = [Percentile(PEAK_PERCENTILE, count) if count >= MIN_WINDOWS else None for count in counts]

    def add(self, speeds: Floats, moved: Floats) -> None:
        """Add the next stretch of T steps.

        Args:
            speeds: of all parts [T, K].
            moved: displacements of the root [T, 3], heights.
        """
        parts = np.column_stack([speeds, np.append(accelerations(moved, SAMPLED_FPS), 0.0)])
        # Reduce each STRIDE_FRAMES frames to their maximum; the maxima of windows stay the same.
        parts = np.maximum.reduceat(parts, np.arange(0, len(parts), STRIDE_FRAMES))
        for size, windows in zip(_WINDOW_STRIDES, self._windows, strict=True):
            if windows is not None and len(parts) >= size:
                windows.add(np.lib.stride_tricks.sliding_window_view(parts, size, axis=0).max(axis=-1))

    def values(self, most: Floats, least: Floats) -> Floats:
        """Return the peaks of windows of each of PEAK_WINDOWS_S [6, K + 1].

        Args:
            most: peaks to use if there are too few windows of any length [K + 1].
            least: lower bounds of the peaks [K + 1].
        """
        peaks = []
        for windows in self._windows:
            most = most if windows is None else np.maximum(windows.value(), least)
            peaks.append(most)
        return np.stack(peaks)


def accelerations(moved: Floats, fps: float) -> Floats:
    """Return the accelerations between steps [T - 1], from displacements per step [T, 3], at `fps` steps per second."""
    return np.asarray(fps**2 * np.linalg.norm(np.diff(moved, axis=0), axis=1))
