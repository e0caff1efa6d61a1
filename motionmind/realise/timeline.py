"""How long the moves of a path take."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s
from motionmind.grammar.transitions import Transitions


def usual(transitions: Transitions) -> float:
    """Seconds that a move of the corpus takes: the median."""
    return float(np.median(transitions.seconds)) if len(transitions.seconds) else 1.0


def durations(path: Int32s, transitions: Transitions) -> Floats:
    """Seconds of each move [T] of a path of states [T + 1, L]: the median over chains of what the corpus took for it.

    Chains that hold or wait do not vote while others move, for a hold can last any time; bridges have no time of their
    own. A move that nobody can time takes the median duration of all moves of the corpus.
    """
    out = np.full(len(path) - 1, usual(transitions))
    edges, moving = transitions.edges(path), path[1:] != path[:-1]
    moving[~moving.any(axis=1)] = True
    for t, timed in enumerate(moving & (edges >= 0)):
        if timed.any():
            out[t] = np.median(transitions.seconds[edges[t, timed]])
    return out
