"""Heading and travel of the body, for corpora with free facing: headings are angles about the vertical, radians."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot
from motionmind.walks.minimal import END_VELOCITY_DECAY_S, departure

SPIN_RADPS = 4.0  # a body that turns faster at an end continues as the corpus does, even the long way round
TURN_PERSISTENCE_S = 0.5  # correlation time of turning


def turn_with_walks(
    turn: Floats,
    spread: Floats,
    trust: Floats,
    half_steps: Floats,
    facing: Mapping[int, Floats],
    rates: tuple[float | None, float | None],
    near: bool = False,
    decay: float = END_VELOCITY_DECAY_S,
) -> Floats:
    """Return unwrapped headings [2 T + 1] of a body that turns as the walks do and meets the given facings.

    Walks that disagree about the direction turn the body less: a total turn M with variance V is scaled by
    M^2 / (M^2 + V), the linear estimate of least mean square error. V treats steps within `TURN_PERSISTENCE_S` as
    correlated. The turn still missing to each facing is distributed over the steps in proportion to their variance, as
    in the mean of normal variables given their sum. Facings are known up to whole turns. Each is taken nearest to the
    walks' turn or, with `near` and for turns below 150 degrees, nearest to the previous facing; a body that turns
    faster than `SPIN_RADPS` at an end may add one whole turn. Where walks are not trusted, the body does not turn with
    them, and the missing turn is distributed evenly. The result meets turning rates given at the ends.

    Args:
        turn: mean turn of the walks in each step [2 T], radians.
        spread: mean square of the turn [2 T].
        trust: trust in the walks in each step [2 T], from 0 to 1.
        half_steps: times of the steps' ends [2 T + 1], seconds.
        facing: rotations [4] that the headings meet, keyed by the number of moves; first and last included.
        rates: turning rate at the first and the last, rad/s; None where unknown.
        near: turn the short way from each facing to the next.
        decay: seconds for which a turning rate at an end has effect, at most.
    """
    spins = [rate for rate in rates if rate is not None and abs(rate) >= SPIN_RADPS]
    varies = np.maximum(spread - turn**2, 1e-4)
    variance = varies.sum() * TURN_PERSISTENCE_S * len(turn) / (half_steps[-1] - half_steps[0])
    turn = trust * turn * (turn.sum() ** 2 / (turn.sum() ** 2 + variance))
    varies = trust * varies + (1.0 - trust) * varies.mean()
    out = np.concatenate([[0.0], np.cumsum(turn)]) + rot.heading(facing[0])
    for start, end in pairwise(2 * move for move in facing):
        missing = rot.heading(facing[end // 2]) - out[end]
        shortest = rot.heading(facing[end // 2]) - rot.heading(facing[start // 2])
        shortest -= 2.0 * np.pi * np.round(shortest / (2.0 * np.pi))
        missing -= 2.0 * np.pi * np.round(missing / (2.0 * np.pi))
        if near:  # at most one extra turn, for a spin or a turn of nearly 180 degrees
            either = abs(shortest) >= np.radians(150.0)
            fewest = -int(either or any(rate < 0.0 for rate in spins))
            most = int(either or any(rate > 0.0 for rate in spins))
            turns = np.round((out[end] + missing - out[start] - shortest) / (2.0 * np.pi))
            missing += 2.0 * np.pi * (np.clip(turns, fewest, most) - turns)
        share = np.cumsum(varies[start:end]) / varies[start:end].sum()
        out[start + 1 : end + 1] += missing * share
        out[end + 1 :] += missing
    steps = np.diff(out) / np.diff(half_steps)
    first, last = (
        None if rate is None else np.asarray(rate - step) for rate, step in zip(rates, steps[[0, -1]], strict=True)
    )
    moves = [*facing]
    until = half_steps[2 * moves[1]], half_steps[2 * moves[-2]]
    return np.asarray(out + departure(half_steps, first, last, until, decay))


def correct_headings(headings: Floats, centres: Floats, within: Floats) -> Floats:
    """Return continuous corrections that bring headings [K] `within` radians [K] of the `centres` of states [K].

    Where headings and centres turn in opposite directions, the corrections grow to a whole turn and keep it.
    """
    missing = np.unwrap(centres - headings)
    turns = 2.0 * np.pi * np.round(missing / (2.0 * np.pi))
    return np.asarray(missing - np.clip(missing - turns, -within, within))


def travel_along(travel: Floats, headings: Floats) -> Floats:
    """Return the root's horizontal displacement in world axes in each step [2 T, 3], metres.

    Args:
        travel: the displacement relative to the body's heading midway through the step [2 T, 3], metres.
        headings: at the steps' ends [2 T + 1], radians.
    """
    along = rot.mul_vec(rot.about_vertical(0.5 * (headings[1:] + headings[:-1])), travel)
    return np.asarray(along * np.array([1.0, 0.0, 1.0]))
