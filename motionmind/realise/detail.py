"""The fine detail of movement: what postures a few times a second leave out, as it was in the corpus's recordings.

A movement that passes smoothly through its postures is smoother than any that was recorded: what happens between two
postures is missing. It is taken from the corpus's moves that are likest to those of the movement, in long runs: the
whole body's from one move, for what its joints do within a fifth of a second they do together.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.corpus.corpus import Corpus, Moves
from motionmind.geometry.distances import squared
from motionmind.jit import jit

GOES_OVER = 0.4  # radians a joint, root mean square: how much nearer a posture must be for a run to end before it


def likest_moves(moves: Moves, shown: Floats, poses: Floats) -> Ints:
    """The corpus's moves [T] that lead along `poses` [T + 1, J, 4], in long runs; its own postures are `shown`
    [N, J, 4].

    They minimise the sum of d^2 over both ends of all moves, d being their distance from the movement's postures,
    radians, root mean square over the joints, plus 2 GOES_OVER^2 for each move that does not go on from the one before
    as its clip does. Found by dynamic programming.
    """
    far = _far(np.ascontiguousarray(shown), np.ascontiguousarray(poses)) / poses.shape[1]
    cost = far[:-1, moves.begins] + far[1:, moves.ends]
    before = _before(moves)
    total, came = cost[0], []
    for step in cost[1:]:
        least = int(total.argmin())
        straight = np.where(before >= 0, total[before], np.inf)
        over = total[least] + 2.0 * GOES_OVER**2
        came.append(np.where(straight <= over, before, least))
        total = np.minimum(straight, over) + step
    out = [int(total.argmin())]
    for previous in reversed(came):
        out.append(int(previous[out[-1]]))
    return np.array(out[::-1], dtype=np.int64)


def detail_of(corpus: Corpus, moves: Ints) -> Floats:
    """The detail of some of the corpus's moves, one after another: rotation vectors [T (K + 1) + 1, J, 3], radians.

    They are 0 at the postures, so that it is without a gap wherever one move does not go on from the other.
    """
    begins, ends = corpus.moves.begins[moves], corpus.moves.ends[moves]
    between = corpus.detail[np.minimum(begins, ends)].astype(np.float64)
    backward = ends < begins
    between[backward] = between[backward, ::-1]
    count, inner, joints, _ = between.shape
    out = np.zeros((count, inner + 1, joints, 3))
    out[:, 1:] = between
    return np.concatenate([out.reshape(-1, joints, 3), np.zeros((1, joints, 3))])


def _before(moves: Moves) -> Ints:
    """The move that comes before each in its clip [M], -1 where none does."""
    out = np.full(len(moves.begins), -1)
    count = max(int(moves.begins.max()), int(moves.ends.max())) + 1
    forward = moves.ends > moves.begins
    for way in (np.flatnonzero(forward), np.flatnonzero(~forward)):
        arrives = np.full(count, -1)
        arrives[moves.ends[way]] = way
        out[way] = arrives[moves.begins[way]]
    return out


@jit
def _far(shown: Floats, poses: Floats) -> Floats:
    """Squared distance of each of `poses` [T, J, 4] from each posture that is `shown` [N, J, 4]: [T, N]."""
    out = np.empty((len(poses), len(shown)))
    for t in range(len(poses)):
        for i in range(len(shown)):
            out[t, i] = squared(shown[i], poses[t])
    return out
