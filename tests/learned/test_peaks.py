"""The greatest of windows, all but a hundredth, of stretches that come one after the other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from motionmind.learned.peaks import PEAK_PERCENTILE, PEAK_WINDOWS_S, STRIDE_FRAMES, Peaks
from motionmind.learned.sampled import SAMPLED_FPS

PARTS = 3
MOST, LEAST = np.full(PARTS + 1, 900.0), np.full(PARTS + 1, 1e-3)


@pytest.mark.parametrize("lengths", [[30] * 12, [31, 29, 200, 60, 6, 1, 400], [700], [180] * 10, [5] * 40])
def test_peaks_are_those_of_all_windows(lengths: list[int]) -> None:
    rng = np.random.default_rng(sum(lengths))
    stretches = [(rng.exponential(size=(length, PARTS)), rng.normal(size=(length, 3))) for length in lengths]
    peaks, shown = Peaks(np.array(lengths)), []
    for speeds, moved in stretches:
        peaks.add(speeds, moved)
        changes = [SAMPLED_FPS**2 * np.linalg.norm(after - before) for before, after in pairwise(moved)]
        whole = np.column_stack([speeds, [*changes, 0.0]])
        shown.append(
            np.stack([whole[at : at + STRIDE_FRAMES].max(axis=0) for at in range(0, len(whole), STRIDE_FRAMES)])
        )
    expected = MOST
    for found, seconds in zip(peaks.values(MOST, LEAST), PEAK_WINDOWS_S, strict=True):
        size = round(seconds * SAMPLED_FPS / STRIDE_FRAMES)
        windows = [part[at : at + size].max(axis=0) for part in shown for at in range(len(part) - size + 1)]
        if len(windows) >= 10:
            expected = np.percentile(windows, PEAK_PERCENTILE, axis=0)
        np.testing.assert_allclose(found, expected, rtol=1e-12)
