"""Frames: a corpus's recordings at 30 frames per second, whole or near a movement."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.contact import CONTACT_FPS
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.learned.nearest import postures_near
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.walks.likelihood import squared_distances

N_FRAME_NEIGHBORS = 8  # of each posture of a movement, in a large corpus
N_POSTURES_BESIDE = 8  # before and after each neighbour, at least
N_LEAVES_SEARCHED = 32  # of the tree, for the neighbours
N_KNOTS_BEYOND = 4  # of the spline, beyond each end of a stretch: farther knots change it by a hundredth


class Frames(NamedTuple):
    """Recordings of a corpus at 30 frames per second, in consecutive stretches.

    Attributes:
        chains: orientations of the joint chains [F, L, 4].
        stretches: index of each frame's stretch, increasing [F].
        postures: the corpus's last posture at or before each frame [F].
        times: of the frames in their clips [F], seconds.
        rates: angular velocities of the joint chains, in their own frames [F, L, 3], rad/s.
    """

    chains: Floats
    stretches: Ints
    postures: Ints
    times: Floats
    rates: Floats


@lru_cache(maxsize=2)
def all_frames(corpus: Corpus) -> Frames:
    """Return all of a corpus's recordings; splines join keyframes, such as those of a score."""
    starts = corpus.columns.starts
    return _concatenate([_sample(corpus, int(a), int(b) - 1, (int(a), int(b))) for a, b in pairwise(starts)])


def frames_near(
    corpus: Corpus, statistics: PostureStatistics, poses: Floats, beside: int = N_POSTURES_BESIDE
) -> Frames:
    """Return the recordings within `beside` postures of the neighbours of `poses` [K, J, 4]; all recordings of a
    corpus without trees."""
    if statistics.trees is None:
        return all_frames(corpus)
    count, starts = len(corpus), corpus.columns.starts
    near = [
        postures_near(statistics.trees, statistics.orientations, pose, N_FRAME_NEIGHBORS, count, N_LEAVES_SEARCHED)
        for pose in poses
    ]
    around = np.unique(np.clip(np.concatenate(near)[:, None] + np.arange(-beside, beside + 1), 0, count - 1))
    clips = np.searchsorted(starts, around, side="right") - 1
    breaks = np.flatnonzero((np.diff(around) > 1) | (np.diff(clips) > 0)) + 1
    parts = []
    for run in np.split(around, breaks):
        clip = int(np.searchsorted(starts, run[0], side="right")) - 1
        known = (
            max(int(run[0]) - N_KNOTS_BEYOND, int(starts[clip])),
            min(int(run[-1]) + N_KNOTS_BEYOND + 1, int(starts[clip + 1])),
        )
        parts.append(_sample(corpus, int(run[0]), int(run[-1]), known))
    return _concatenate(parts)


def _sample(corpus: Corpus, first: int, last: int, known: tuple[int, int]) -> tuple[Floats, Ints, Floats]:
    """Return joint chains [n, L, 4], postures [n] and times [n] of the frames between two postures of a clip.

    Args:
        corpus: the corpus.
        first, last: the postures.
        known: range of postures that the spline passes through, the end excluded.
    """
    knots, between = slice(*known), corpus.detail.shape[1]
    keys, begin = corpus.times[knots], corpus.times[first]
    times = begin + np.arange(np.floor((corpus.times[last] - begin) * CONTACT_FPS + 1e-3) + 1.0) / CONTACT_FPS
    times = np.minimum(times, corpus.times[last])
    rotations = rotation_spline(keys, corpus.rotations[knots], times)
    postures = first + np.searchsorted(corpus.times[first : last + 1], times + 1e-6, side="right") - 1
    if between and last > first:
        begins = np.minimum(postures, last - 1)
        share = (times - corpus.times[begins]) / (corpus.times[begins + 1] - corpus.times[begins]) * (between + 1)
        below = np.clip(np.floor(share + 1e-6), 0, between).astype(np.int64)
        rest = np.maximum(share - below, 0.0)[:, None, None]
        edge = np.zeros((len(times), 1, *corpus.detail.shape[2:]))
        detail = np.concatenate([edge, corpus.detail[begins], edge], axis=1)  # zero at the postures
        rows = np.arange(len(times))
        rotations = rot.mul(rotations, rot.exp((1.0 - rest) * detail[rows, below] + rest * detail[rows, below + 1]))
    return rot.normalise(corpus.to_chains(rotations)), postures, times


def _concatenate(parts: Sequence[tuple[Floats, Ints, Floats]]) -> Frames:
    """Concatenate stretches of frames."""
    chains, postures, times = (np.concatenate(found) for found in zip(*parts, strict=True))
    stretches = np.repeat(np.arange(len(parts)), [len(found) for found, _, _ in parts])
    rates = np.concatenate([_rates(found) for found, _, _ in parts])
    return Frames(np.ascontiguousarray(chains), stretches, postures, times, rates)


def _rates(chains: Floats) -> Floats:
    """Return angular velocities [n, L, 3], radians per second, to the next frame; at the last, the one before."""
    rates = CONTACT_FPS * rot.log(rot.inv_mul(chains[:-1], chains[1:]))
    last = rates[-1:] if len(rates) else np.zeros((1, *chains.shape[1:-1], 3))
    return np.concatenate([rates, last])


def frames_of(corpus: Corpus, clip: int, begin: float, end: float) -> Frames:
    """Return a clip's recording from the last posture at or before `begin` to the first at or after `end`.

    Args:
        corpus: the corpus.
        clip: index of the clip.
        begin, end: times in the clip's own recording, seconds.
    """
    first, stop = (int(at) for at in corpus.columns.starts[clip : clip + 2])
    times = corpus.times[first:stop]
    lower = first + max(int(np.searchsorted(times, begin, side="right")) - 1, 0)
    upper = first + min(int(np.searchsorted(times, end)), stop - first - 1)
    return _concatenate(
        [
            _sample(
                corpus,
                lower,
                max(upper, lower),
                (max(lower - N_KNOTS_BEYOND, first), min(upper + N_KNOTS_BEYOND + 1, stop)),
            )
        ]
    )


def frame_distances(recorded: Frames, poses: Floats) -> Floats:
    """Return squared distances between postures [K, J, 4] and all frames: means over joints [K, F], radians^2."""
    whole = np.zeros((poses.shape[1], 1), dtype=np.int64)  # one part: the whole body
    return np.asarray(squared_distances(recorded.chains, whole, 1, np.ascontiguousarray(poses))[0])
