"""Jitter: noise of single frames, measured in the recording itself and filtered without delay.

The filter minimises |y - x|^2 + k |D^2 y|^2, where D^2 are second differences. Its gain 1 / (1 + (f / cut-off)^4) is
that of a second-order Butterworth filter run forward and backward: it has no phase. Source: Eilers, "A perfect
smoother", Analytical Chemistry 75:3631 (2003). Quaternions are filtered as vectors and normalised, which keeps turns of
constant speed, and does not depend on the axes.

Around each frame the cut-off minimises an unbiased estimate of the remaining error: |y - x|^2, plus twice the noise
that the filter lets pass. So a kick keeps its speed, while the same joint at rest is filtered more. Source: Stein,
"Estimation of the mean of a multivariate normal distribution", Annals of Statistics 9:1135 (1981).
"""

from __future__ import annotations

from functools import lru_cache
from math import comb
from typing import NamedTuple

import numpy as np
from scipy.linalg import solveh_banded
from scipy.ndimage import gaussian_filter1d

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

MIN_NOISE_RAD = np.radians(0.02)  # recordings with less are left alone: a tenth of a millimetre at a foot
MIN_NOISE_M = 1e-4
MIN_FILTERED_FRAMES = 16  # fewer do not show their noise
LOWEST_CUT_OFF_HZ = 1.0
N_CUT_OFFS = 16
N_TOGETHER = 8  # joints that are filtered at once, which bounds the memory
ADAPTS_S = 0.15  # standard deviation of the time around a frame that its cut-off depends on; chosen on cmu-05
N_NOISE_DIFFERENCES = 6  # of the differences that show noise and hardly any movement
CHI2_MEDIAN_RATIO = 2.36597  # the median of a chi-squared variable of three degrees of freedom, to the variance


class Filtered(NamedTuple):
    """Values without their jitter.

    Attributes:
        values: the values [T, J, K].
        noise: standard deviation of the jitter of each [J], along each of three axes.
        cut_offs: cut-off in each frame [T, J], Hz; infinite where nothing was filtered.
    """

    values: Floats
    noise: Floats
    cut_offs: Floats


def filter_rotations(rotations: Floats, fps: float) -> Filtered:
    """Filter the jitter of rotations [T, J, 4]; their noise is in radians."""
    found = _filter(rot.continuous(rotations), fps, 0.5 * MIN_NOISE_RAD)  # quaternions move by half of the angle
    changed = np.isfinite(found.cut_offs)[..., None]
    return Filtered(np.where(changed, rot.normalise(found.values), rotations), 2.0 * found.noise, found.cut_offs)


def filter_places(places: Floats, fps: float) -> Filtered:
    """Filter the jitter of positions [T, J, 3], metres."""
    return _filter(places, fps, MIN_NOISE_M)


def smooth(values: Floats, cut_off: float, fps: float) -> Floats:
    """Filter values [T, ...] at a cut-off, Hz, without delay; three values at least."""
    count = len(values)
    bands = np.zeros((3, count))
    second = np.array([1.0, -2.0, 1.0])
    for k in range(3):  # the products of D^2 with itself, k frames apart
        for row in range(3 - k):
            share = second[row] * second[row + k]
            bands[2 - k, row + k : count - 2 + row + k] += share
    bands *= _penalty(cut_off, fps)
    bands[2] += 1.0
    return np.asarray(solveh_banded(bands, values.reshape(count, -1), check_finite=False).reshape(values.shape))


def measure_noise(values: Floats) -> Floats:
    """Return the standard deviation of the jitter of values [T, J, K] along each of three axes [J].

    Differences of a high order hardly show movement, and their median ignores what they show in a few frames.
    """
    differences = np.diff(values, N_NOISE_DIFFERENCES, axis=0) / np.sqrt(
        comb(2 * N_NOISE_DIFFERENCES, N_NOISE_DIFFERENCES)
    )
    return np.asarray(np.sqrt(np.median(np.sum(differences**2, axis=-1), axis=0) / CHI2_MEDIAN_RATIO))


def _filter(values: Floats, fps: float, least: float) -> Filtered:
    """Filter values [T, J, K] whose noise is `least` or more."""
    noise = measure_noise(values) if len(values) >= MIN_FILTERED_FRAMES else np.zeros(values.shape[1])
    out, cut_offs = values.copy(), np.full(values.shape[:2], np.inf)
    chosen = np.flatnonzero(noise >= least)
    for start in range(0, len(chosen), N_TOGETHER):
        some = chosen[start : start + N_TOGETHER]
        out[:, some], cut_offs[:, some] = _adapt(values[:, some], noise[some], fps)
    return Filtered(out, noise, cut_offs)


def _adapt(values: Floats, noise: Floats, fps: float) -> tuple[Floats, Floats]:
    """Return values [T, J, K] filtered, each frame at the cut-off of least estimated error, and the cut-offs [T, J]."""
    bank = np.geomspace(LOWEST_CUT_OFF_HZ, 0.4 * fps, N_CUT_OFFS)
    around = max(ADAPTS_S * fps, 5.0)  # frames; fewer do not tell noise from movement
    variance = 3.0 * noise**2
    best = np.broadcast_to(variance, values.shape[:2]).copy()  # the error of values left alone
    choice = np.full(values.shape[:2], float(N_CUT_OFFS))
    for number in reversed(range(N_CUT_OFFS)):
        off = np.sum((smooth(values, bank[number], fps) - values) ** 2, axis=-1)
        error = gaussian_filter1d(off, around, axis=0) + (2.0 * _passed(bank[number], fps) - 1.0) * variance
        choice = np.where(error < best, number, choice)
        best = np.minimum(best, error)
    choice = gaussian_filter1d(choice, around, axis=0)
    out = np.zeros_like(values)
    for number in range(N_CUT_OFFS + 1):  # between two cut-offs, a mean
        share = np.maximum(1.0 - np.abs(choice - number), 0.0)[..., None]
        if share.any():
            out += share * (smooth(values, bank[number], fps) if number < N_CUT_OFFS else values)
    cut_offs = np.exp(np.interp(choice, np.arange(N_CUT_OFFS), np.log(bank)))
    return out, np.where(choice > N_CUT_OFFS - 1e-9, np.inf, cut_offs)


def _penalty(cut_off: float, fps: float) -> float:
    """Return the factor of the second differences for a cut-off, Hz."""
    return float((2.0 * np.sin(np.pi * cut_off / fps)) ** -4.0)


@lru_cache(maxsize=256)
def _passed(cut_off: float, fps: float) -> float:
    """Return the share of white noise that a filter lets pass: the mean of its gain over all frequencies."""
    angles = (np.arange(2000) + 0.5) / 2000 * np.pi
    return float(np.mean(1.0 / (1.0 + _penalty(cut_off, fps) * (2.0 * np.sin(0.5 * angles)) ** 4)))
