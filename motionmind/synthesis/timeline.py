"""Durations of moves, and times of a motion's frames."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s
from motionmind.body.rates import check_size
from motionmind.grammar.transitions import Transitions


class Timeline(NamedTuple):
    """The clock of a motion of T moves and N frames.

    Attributes:
        moves: times at which the moves begin, and the end of the last [T + 1], seconds from 0.
        frames: times of the frames [N], seconds, evenly spaced; the first is 0, the last the end of the last move.
        usual_moves: number of moves that the corpus makes in that time.
    """

    moves: Floats
    frames: Floats
    usual_moves: int


@lru_cache(maxsize=1)
def usual(transitions: Transitions) -> float:
    """Return the usual duration of the corpus's moves, seconds: the median; 1 for a corpus without moves."""
    return float(np.median(transitions.seconds)) if len(transitions.seconds) else 1.0


def durations(path: Int32s, transitions: Transitions) -> Floats:
    """Return the duration of each move [T] of a path, seconds: the median over chains of the corpus's durations.

    While some chains move, chains that hold or wait do not vote, because a hold may have any duration. Bridges have no
    duration and never vote. A move without votes takes the median duration of all moves in the corpus.

    Args:
        path: states of the chains [T + 1, L].
        transitions: the corpus's moves from state to state.
    """
    out = np.full(len(path) - 1, usual(transitions))
    edges, moving = transitions.edges(path), path[1:] != path[:-1]
    moving[~moving.any(axis=1)] = True
    timed = moving & (edges >= 0)
    votes = timed.sum(axis=1)
    if votes.any():
        voted = np.flatnonzero(votes)
        seconds = np.sort(np.where(timed, transitions.seconds[edges], np.inf), axis=1)
        out[voted] = 0.5 * (seconds[voted, (votes[voted] - 1) // 2] + seconds[voted, votes[voted] // 2])
    return out


def timeline(
    path: Int32s,
    transitions: Transitions,
    fps: float,
    length: float | None = None,
    fixed: Mapping[int, float] = MappingProxyType({}),
) -> Timeline:
    """Return the times of a path's moves and of its frames, at about `fps`; the last frame falls on the end exactly.

    Args:
        path: states of the chains [T + 1, L], with at least one move.
        transitions: the corpus's moves from state to state.
        fps: frames a second.
        length: total duration, seconds, to which the frames are fitted; None for the duration in the corpus, rounded to
            whole frames.
        fixed: times by which some numbers of moves end, seconds, both increasing, within a given `length`; each is
            moved to the nearest frame.
    """
    seconds = durations(path, transitions)
    usually = float(seconds.sum())
    frames = max(1, round((length or usually) * fps))
    check_size(frames + 1, path.shape[1], "the tween")
    length = length or frames / fps
    ends = {0: 0.0} | {move: round(time / length * frames) * length / frames for move, time in fixed.items()}
    ends[len(seconds)] = length
    own = np.concatenate([[0.0], np.cumsum(seconds)])
    moves = np.empty_like(own)
    for (first, begin), (last, end) in pairwise(ends.items()):
        share = (own[first : last + 1] - own[first]) / (own[last] - own[first])
        moves[first : last + 1] = begin + share * (end - begin)
        moves[last] = end
    return Timeline(moves, np.linspace(0.0, length, frames + 1), max(1, round(len(seconds) * length / usually)))


def stretch(clock: Timeline, at: Floats, times_longer: Floats, fps: float) -> tuple[Timeline, Floats]:
    """Return a slower or faster clock, and the times of the steps' boundaries on it [S + 1].

    Args:
        clock: the clock to stretch; its number of usual moves stays the same.
        at: the steps' boundaries on it [S + 1], from its first time to its last.
        times_longer: factor by which to stretch each step [S].
        fps: frames a second; the total is rounded to whole frames.
    """
    to = np.concatenate([[0.0], np.cumsum(times_longer * np.diff(at))])
    frames = max(1, round(float(to[-1]) * fps))
    length = frames / fps
    to *= length / to[-1]
    moves = np.interp(clock.moves, at, to)
    moves[-1] = to[-1] = length
    return Timeline(moves, np.linspace(0.0, length, frames + 1), clock.usual_moves), to
