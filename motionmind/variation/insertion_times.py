"""Estimates of the time that the engine inserts at each possible seam."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionmind._typing import Floats, Singles
from motionmind.body.motion import Posture
from motionmind.learned.pace import Way, ways
from motionmind.tween.pacing import PEAK_SPEED_RATIO, find_resting_speeds
from motionmind.variation.piece import Piece
from motionmind.variation.seams import TransitionTest


def estimate_insertions(piece: Piece, test: TransitionTest) -> Singles:
    """Estimate the seconds of an insertion from each of a piece's N postures to each other [N, N].

    The estimate is 0 where the corpus knows the transition. Elsewhere it is the corpus's median time for the
    displacement, or longer if a body part would exceed the 99th percentile of its speed (`motionmind.tween.pacing`).

    Args:
        piece: the piece.
        test: tells which transitions are abrupt.

    Raises:
        SkeletonError: the piece has another skeleton than the corpus.
    """
    engine = test.engine
    skeleton = engine.corpus.skeleton
    ends = [piece.ends(i, i)[0] for i in range(len(piece))]
    test.check_skeleton(ends[0])
    rotations, root = np.stack([end.rotations for end in ends]), np.stack([end.root for end in ends])
    seconds = np.empty((len(piece), len(piece)), dtype=np.float32)
    resting_speeds = find_resting_speeds(engine, rotations)
    for i in range(len(piece)):
        way = ways(skeleton, (rotations[i], rotations), (root[i], root))
        seconds[i] = _usual_seconds(test, way, (resting_speeds[i], resting_speeds))
    seconds[test.known(rotations, piece.durations)] = 0.0
    return seconds


def estimate_pairs(pairs: Sequence[tuple[Posture, Posture, float]], test: TransitionTest) -> Floats:
    """Estimate the seconds of the insertions between pairs of postures [n], as `estimate_insertions` does.

    Args:
        pairs: two postures each, and the seconds from the one to the other without an insertion.
        test: tells which transitions are abrupt.

    Raises:
        SkeletonError: a posture is on another skeleton than the corpus.
    """
    if not pairs:
        return np.empty(0)
    for posture in (posture for *both, _ in pairs for posture in both):
        test.check_skeleton(posture)
    (first, last), (begin, end) = (
        [np.stack([getattr(pair[side], name) for pair in pairs]) for side in (0, 1)] for name in ("rotations", "root")
    )
    resting_speeds = np.split(find_resting_speeds(test.engine, np.concatenate([first, last])), 2)
    way = ways(test.engine.corpus.skeleton, (first, last), (begin, end))
    seconds = _usual_seconds(test, way, (resting_speeds[0], resting_speeds[1]))
    return np.where([bool(test.abrupt_joints(*pair)) for pair in pairs], seconds, 0.0)


def _usual_seconds(test: TransitionTest, way: Way, resting_speeds: tuple[Floats, Floats]) -> Floats:
    pace = test.engine.pace
    least = PEAK_SPEED_RATIO * np.max(way.parts / pace.fastest, axis=-1)
    return np.asarray(np.maximum(pace.expected(way, resting_speeds), least))
