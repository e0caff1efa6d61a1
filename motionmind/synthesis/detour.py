"""Detours: movement that fills the time when a transition is given more than it takes.

The mean of long corpus walks is near the mean of all postures and hardly moves. Instead, a detour follows a recording
onwards from a posture like the first, then another into a posture like the last, and interpolates between the two.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.learned.nearest import postures_near
from motionmind.learned.posture_statistics import PostureStatistics

N_DETOUR_POSTURES = 8  # to try for each end


def detour(corpus: Corpus, statistics: PostureStatistics, ends: tuple[Floats, Floats], moves: int, own: int) -> Floats:
    """Return orientations of the joints at each move [moves + 1, J, 4], exact at both ends.

    Choose the pair of recordings, one from near the first posture and one into the last, that costs least. The cost is
    their distance to each other plus their distances to the ends plus 0.05 for each move that they leave unfilled
    besides `own`.

    Args:
        corpus: the recorded movement.
        statistics: its samples.
        ends: orientations of the chains in both postures [L, 4].
        moves: number of moves of the detour, each as long as a move of the corpus.
        own: number of moves in which to join the two recordings.
    """
    joints = len(corpus.skeleton)
    shown = statistics.orientations[: len(corpus), :joints]
    first, last = (end[:joints] for end in ends)
    starts, stops = corpus.columns.starts[:-1], corpus.columns.starts[1:]
    near = [_nearest(statistics, shown, end) for end in (first, last)]
    spare = max(moves - own, 0)
    best, chosen = np.inf, (0, 0, 0, 0)
    for i, first_off in zip(*near[0], strict=True):
        after = min(spare, int(stops[np.searchsorted(stops, i, side="right")] - 1 - i))
        for k, last_off in zip(*near[1], strict=True):
            before = min(spare, int(k - starts[np.searchsorted(stops, k, side="right")]))
            on = np.arange(after + 1)
            into = np.minimum(spare - on, before)
            apart = np.sqrt(np.mean(rot.angle(shown[i + on], shown[k - into]) ** 2, axis=-1))
            costs = apart + first_off + last_off + 0.05 * (spare - on - into)  # RMS rad per joint, for each move
            if costs.min() < best:
                best, n = float(costs.min()), int(costs.argmin())
                chosen = int(i), n, int(k), int(into[n])
    i, n, k, m = chosen  # n moves onwards from posture i, then m moves to posture k
    out = np.empty((moves + 1, joints, 4))
    out[: n + 1], out[moves - m :] = shown[i : i + n + 1], shown[k - m : k + 1]
    share = np.linspace(0.0, 1.0, moves - m - n + 1)[1:-1, None]
    out[n + 1 : moves - m] = rot.slerp(out[n][None], out[moves - m][None], share)
    out[0], out[-1] = first, last
    return out


def _nearest(statistics: PostureStatistics, shown: Floats, posture: Floats) -> tuple[Ints, Floats]:
    """Return the indices of the postures [N, J, 4] nearest to one [J, 4], and their distances, radians per joint."""
    some = np.arange(len(shown))
    if statistics.trees is not None:
        # Try four times as many, because the trees use another metric.
        count = 4 * N_DETOUR_POSTURES
        some = np.sort(postures_near(statistics.trees, statistics.orientations, posture, count, len(shown)))
    off = np.sqrt(np.mean(rot.angle(shown[some], posture) ** 2, axis=-1))
    order = np.argsort(off, kind="stable")[:N_DETOUR_POSTURES]
    return some[order], off[order]
