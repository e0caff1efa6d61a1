"""The time that the engine will insert at each seam that a variation may have, estimated before it searches."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Singles
from motionmind.learned.pace import ways
from motionmind.tween.pacing import PEAK, lulls_of
from motionmind.variation.piece import Piece
from motionmind.variation.seams import TransitionTest


def estimate_insertions(piece: Piece, test: TransitionTest) -> Singles:
    """Estimate what a seam from each of a piece's N postures to each other inserts, seconds [N, N].

    It is nothing where the corpus knows the transition. Elsewhere it is the corpus's median time for so far a way, but
    no less than lets every part of the body be no faster than all but its fastest hundredth of moments
    (`motionmind.tween.pacing`).

    Args:
        piece: the piece.
        test: judges which transitions are abrupt.

    Raises:
        SkeletonError: the piece is on another skeleton than the corpus.
    """
    engine = test.engine
    skeleton = engine.corpus.skeleton
    ends = [piece.ends(i, i)[0] for i in range(len(piece))]
    test.check_skeleton(ends[0])
    rotations, root = np.stack([end.rotations for end in ends]), np.stack([end.root for end in ends])
    seconds = np.empty((len(piece), len(piece)), dtype=np.float32)
    lulls = lulls_of(engine, rotations)
    for i in range(len(piece)):
        way = ways(skeleton, (rotations[i], rotations), (root[i], root))
        least = PEAK * np.max(way.parts / engine.pace.fastest, axis=-1)
        seconds[i] = np.maximum(engine.pace.expected(way, (lulls[i], lulls)), least)
    seconds[test.known(rotations, piece.durations)] = 0.0
    return seconds
