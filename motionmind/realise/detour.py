"""Detours: what fills the time where there is more of it than a movement from one posture to another takes.

The mean of walks that may wander for long is near the mean of all postures, and hardly moves. Dancers who have time go
on as they do from there, and come as they do to where they are to be. So a detour follows the corpus on from a posture
that is like the first, and into one that is like the last; in between it joins the two in its own time.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.learned.carriage import Carriage
from motionmind.learned.nearest import postures_near

NEAREST = 8  # of the corpus's postures are tried for each end
SEVERAL = 4  # times as many are looked at of a large corpus, whose trees measure distances in another way
UNUSED = 0.05  # radians a joint (root mean square) that a recording must be nearer to be worth a move less of detour


def detour(corpus: Corpus, carriage: Carriage, ends: tuple[Floats, Floats], moves: int, own: int) -> Floats:
    """Return orientations of the joints at each move [moves + 1, J, 4], the ends' own at both ends.

    Of the recordings that go on from near the first posture, and that lead near the last, those are taken that come
    nearest to each other, are nearest to the ends, and last for all but `own` of the moves.

    Args:
        corpus: the movement that was learned from.
        carriage: its moments.
        ends: orientations of the chains in both postures [L, 4].
        moves: number of moves, as long as the corpus's.
        own: number of moves to join the recordings in.
    """
    joints = len(corpus.skeleton)
    shown = carriage.orientations[: len(corpus), :joints]
    first, last = (end[:joints] for end in ends)
    starts, stops = corpus.columns.starts[:-1], corpus.columns.starts[1:]
    near = [_nearest(carriage, shown, end) for end in (first, last)]
    spare = max(moves - own, 0)
    best, way = np.inf, (0, 0, 0, 0)
    for i, first_off in zip(*near[0], strict=True):
        after = min(spare, int(stops[np.searchsorted(stops, i, side="right")] - 1 - i))
        for k, last_off in zip(*near[1], strict=True):
            before = min(spare, int(k - starts[np.searchsorted(stops, k, side="right")]))
            on = np.arange(after + 1)
            into = np.minimum(spare - on, before)
            apart = np.sqrt(np.mean(rot.angle(shown[i + on], shown[k - into]) ** 2, axis=-1))
            costs = apart + first_off + last_off + UNUSED * (spare - on - into)
            if costs.min() < best:
                best, n = float(costs.min()), int(costs.argmin())
                way = int(i), n, int(k), int(into[n])
    i, n, k, m = way
    out = np.empty((moves + 1, joints, 4))
    out[: n + 1], out[moves - m :] = shown[i : i + n + 1], shown[k - m : k + 1]
    share = np.linspace(0.0, 1.0, moves - m - n + 1)[1:-1, None]
    out[n + 1 : moves - m] = rot.slerp(out[n][None], out[moves - m][None], share)
    out[0], out[-1] = first, last
    return out


def _nearest(carriage: Carriage, shown: Floats, posture: Floats) -> tuple[Ints, Floats]:
    """Return the corpus's postures nearest to one [J, 4], of all [N, J, 4], and their distances, radians a joint."""
    some = np.arange(len(shown))
    if carriage.trees is not None:
        some = np.sort(postures_near(carriage.trees, carriage.orientations, posture, SEVERAL * NEAREST, len(shown)))
    off = np.sqrt(np.mean(rot.angle(shown[some], posture) ** 2, axis=-1))
    order = np.argsort(off, kind="stable")[:NEAREST]
    return some[order], off[order]
