"""Retiming: a movement takes longer where something in it would be faster than the corpus's bodies usually are.

How long a movement takes on the whole is settled before its path is known, and by the way from end to end alone. On the
way a joint may go there and back. Where that would be faster than all but the corpus's fastest hundredth of moments,
the clock slows down: all of the body, so that joints stay together, and smoothly, over a few half steps.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.learned.pace import way_of
from motionmind.realise.expectation import Expectation

HEADROOM = 0.9  # share of the fastest speeds that is kept to: fine detail, and what holds the feet, come later
SETTLES = 0.3  # seconds from an end that is passed at a given speed, in which the clock comes to slow down


def keep_pace(
    walk: Expectation,
    frames: Floats,
    corpus: Corpus,
    fastest: Floats,
    travel: Floats,
    moving: tuple[bool, bool],
) -> Floats:
    """Return how many times longer each half step of a walk is to take [2 T], at least 1.

    Args:
        walk: the movement at its half steps.
        frames: times at which to look how fast it is, in order, seconds.
        corpus: what it was learned from.
        fastest: speeds of the joints, rad/s, of the body's turning, and of its travel, heights/s [J + 2].
        travel: level displacement of the root in each half step [2 T, 3], metres, on the corpus's skeleton.
        moving: whether the first and the last posture are passed at a given velocity, which is not to change.
    """
    times = walk.half_steps
    root = np.concatenate([np.zeros((1, 3)), np.cumsum(travel, axis=0)])
    at = np.stack([np.interp(frames, times, axis) for axis in root.T], axis=1)
    rotations = rot.normalise(corpus.from_chains(walk.chains(corpus, frames)))
    speeds = way_of(Motion(corpus.skeleton, rotations, at, frames)).parts / np.diff(frames)[:, None]
    slower = np.ones(len(travel))
    step = np.searchsorted(times, 0.5 * (frames[1:] + frames[:-1])) - 1
    np.maximum.at(slower, step.clip(0, len(slower) - 1), (speeds / (HEADROOM * fastest)).max(axis=1))
    # The greatest of three, twice, covers the mean of five: no half step is slowed less than it needs.
    around = np.lib.stride_tricks.sliding_window_view(np.pad(slower, 2, mode="edge"), 5).max(axis=1)
    weights = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
    slower = np.convolve(np.pad(around, 2, mode="edge"), weights, "valid")
    middle = 0.5 * (times[1:] + times[:-1])
    for is_moving, since in zip(moving, (middle - times[0], times[-1] - middle), strict=True):
        if is_moving:
            slower = 1.0 + (slower - 1.0) * np.clip(since / SETTLES, 0.0, 1.0)
    return np.asarray(slower)
