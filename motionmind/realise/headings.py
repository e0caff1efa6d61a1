"""Where a body faces and travels, on corpora whose facing is free: headings are angles about the vertical, radians."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats, Int32s
from motionmind.geometry import rotations as rot
from motionmind.grammar.grammar import Grammar

RUN = 1.0  # seconds for which a body that turns goes on turning


def turn_with_walks(turn: Floats, spread: Floats, half_steps: Floats, facing: Mapping[int, Floats]) -> Floats:
    """Return headings [2 T + 1], unwrapped, of a body that turns as the walks do and meets the given facings.

    The less certain it is to which side walks turn on the whole, the less they turn: of turns that add up to M with
    variance V the share M^2 / (M^2 + V) is taken, the linear estimate of least mean square error. Walks that turn do so
    for about RUN seconds, so V counts steps that vary together for as long. The turn still missing to each facing is
    distributed over the steps in proportion to their variance, as in the mean of normal variables given their sum; of
    all facings that differ by whole turns, the nearest is meant.

    Args:
        turn: mean turn of the walks in each step [2 T], radians.
        spread: mean square of the same [2 T].
        half_steps: times of the steps' ends [2 T + 1], seconds.
        facing: the rotations [4] that the headings meet, by the number of moves; with the first and the last.
    """
    varies = np.maximum(spread - turn**2, 1e-4)
    variance = varies.sum() * RUN * len(turn) / (half_steps[-1] - half_steps[0])
    turn = turn * (turn.sum() ** 2 / (turn.sum() ** 2 + variance))
    out = np.concatenate([[0.0], np.cumsum(turn)]) + rot.heading(facing[0])
    for start, end in pairwise(2 * move for move in facing):
        missing = rot.heading(facing[end // 2]) - out[end]
        missing -= 2.0 * np.pi * np.round(missing / (2.0 * np.pi))
        share = np.cumsum(varies[start:end]) / varies[start:end].sum()
        out[start + 1 : end + 1] += missing * share
        out[end + 1 :] += missing
    return out


def turn_with_path(path: Int32s, grammar: Grammar, seconds: Floats, facing: Mapping[int, Floats]) -> Floats:
    """Return headings [T + 1], unwrapped, of a path through facing states, which meet the given facings.

    Each move turns the short way between its states, as it was counted. A state is a step of the circle, within which
    the body may face anywhere: of all headings in the path's states the most even are taken, so steady turning stays
    steady however coarse the steps.

    Args:
        path: states of the facing [T + 1].
        grammar: whose last chain is the facing.
        seconds: duration of each move [T].
        facing: the rotations [4] that the headings meet, by the number of moves; with the first and the last.
    """
    ring = grammar.centres[grammar.transitions.starts[-2] :]
    centres = np.unwrap(rot.heading(ring[path]))
    half = np.pi / len(ring)
    low, high = centres - half, centres + half
    for move, turn in facing.items():
        off = rot.heading(turn) - centres[move]
        low[move] = high[move] = centres[move] + off - 2.0 * np.pi * np.round(off / (2.0 * np.pi))
    return _taut_string(low[[0, -1]], low[1:-1], high[1:-1], seconds)


def travel_along(travel: Floats, headings: Floats) -> Floats:
    """Return the root's level displacement in the world in each step [2 T, 3], metres.

    Args:
        travel: the same in the body's own heading midway through the step [2 T, 3], metres.
        headings: at the steps' ends [2 T + 1], radians.
    """
    along = rot.mul_vec(rot.about_vertical(0.5 * (headings[1:] + headings[:-1])), travel)
    return np.asarray(along * np.array([1.0, 0.0, 1.0]))


def _taut_string(ends: Floats, low: Floats, high: Floats, seconds: Floats) -> Floats:
    """Return the numbers [T + 1] from ends[0] to ends[1], between `low` and `high` [T - 1] on the way, for which the
    sum of squared steps, each divided by its `seconds` [T], is least.

    By relaxation: every other number moves to where its neighbours pull it, in turns, until none moves.
    """
    out = np.concatenate([ends[:1], 0.5 * (low + high), ends[1:]])
    pull = 1.0 / seconds
    moved = np.inf
    while moved > 1e-6:
        before = out.copy()
        for first in (1, 2):
            here = np.arange(first, len(out) - 1, 2)
            mean = (pull[here - 1] * out[here - 1] + pull[here] * out[here + 1]) / (pull[here - 1] + pull[here])
            out[here] = np.clip(mean, low[here - 1], high[here - 1])
        moved = float(np.abs(out - before).max())
    return out
