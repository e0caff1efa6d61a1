"""Estimates of the time that the engine inserts at each possible seam."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Singles
from motionmind.learned.pace import ways
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
        least = PEAK_SPEED_RATIO * np.max(way.parts / engine.pace.fastest, axis=-1)
        seconds[i] = np.maximum(engine.pace.expected(way, (resting_speeds[i], resting_speeds)), least)
    seconds[test.known(rotations, piece.durations)] = 0.0
    return seconds
