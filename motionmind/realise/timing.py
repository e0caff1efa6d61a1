"""How long the moves of a path take."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from motionmind.grammar.transitions import Transitions


def usual(transitions: Transitions) -> float:
    """Seconds that a move of the corpus takes: the median."""
    return float(np.median(transitions.seconds)) if len(transitions.seconds) else 1.0


def durations(path: NDArray[np.int32], transitions: Transitions) -> NDArray[np.float64]:
    """Seconds of each move [T] of a path of states [T + 1, L]: the median over lanes of what the corpus took for it.

    Lanes that hold or wait do not vote while others move, for a hold can last any time; bridges have no time of their
    own. A move that nobody can time takes the median duration of all moves of the corpus.
    """
    out = np.full(len(path) - 1, usual(transitions))
    for t, (before, after) in enumerate(pairwise(path)):
        moving = [lane for lane in range(path.shape[1]) if before[lane] != after[lane]] or list(range(path.shape[1]))
        edges = [transitions.edge(lane, before[lane], after[lane]) for lane in moving]
        timed = [transitions.seconds[edge] for edge in edges if edge >= 0]
        if timed:
            out[t] = np.median(timed)
    return out
