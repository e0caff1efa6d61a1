"""Where a body faces and travels, on corpora whose facing is free: headings are angles about the vertical, radians."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot
from motionmind.walks.minimal import LASTS, departure

NEARLY = np.radians(150.0)  # of half a turn: by so much a body may as well turn the other way
SPINS = 4.0  # radians a second from which a body goes on turning as the corpus does, even the far way
RUN = 0.5  # seconds for which a body that turns goes on turning


def turn_with_walks(
    turn: Floats,
    spread: Floats,
    trust: Floats,
    half_steps: Floats,
    facing: Mapping[int, Floats],
    rates: tuple[float | None, float | None],
    near: bool = False,
    lasts: float = LASTS,
) -> Floats:
    """Return headings [2 T + 1], unwrapped, of a body that turns as the walks do and meets the given facings.

    The less certain it is to which side walks turn on the whole, the less they turn: of turns that add up to M with
    variance V the share M^2 / (M^2 + V) is taken, the linear estimate of least mean square error. Walks that turn do so
    for about RUN seconds, so V counts steps that vary together for as long. The turn still missing to each facing is
    distributed over the steps in proportion to their variance, as in the mean of normal variables given their sum; of
    all facings that differ by whole turns, the nearest to what the walks do is meant, or, where it is to be the `near`
    way and that is less than NEARLY half a turn, the nearest to the facing before; a body that SPINS at an end goes on,
    by one whole turn more at most.
    As far as walks are not trusted, the body does not turn with them, and distributes what is missing evenly. A body
    that turns at an end does so there, too.

    Args:
        turn: mean turn of the walks in each step [2 T], radians.
        spread: mean square of the same [2 T].
        trust: how far walks are trusted in each step [2 T], from 0 to 1.
        half_steps: times of the steps' ends [2 T + 1], seconds.
        facing: the rotations [4] that the headings meet, by the number of moves; with the first and the last.
        rates: turning at the first and at the last, radians a second; None where it is unknown.
        near: whether the body is to turn the near way from each facing to the next.
        lasts: seconds for which turning at an end is felt at most.
    """
    spins = [rate for rate in rates if rate is not None and abs(rate) >= SPINS]
    varies = np.maximum(spread - turn**2, 1e-4)
    variance = varies.sum() * RUN * len(turn) / (half_steps[-1] - half_steps[0])
    turn = trust * turn * (turn.sum() ** 2 / (turn.sum() ** 2 + variance))
    varies = trust * varies + (1.0 - trust) * varies.mean()
    out = np.concatenate([[0.0], np.cumsum(turn)]) + rot.heading(facing[0])
    for start, end in pairwise(2 * move for move in facing):
        missing = rot.heading(facing[end // 2]) - out[end]
        way = rot.heading(facing[end // 2]) - rot.heading(facing[start // 2])
        way -= 2.0 * np.pi * np.round(way / (2.0 * np.pi))
        missing -= 2.0 * np.pi * np.round(missing / (2.0 * np.pi))
        if near:  # no more than the one turn that a spin, or having as far to either side, is worth
            either = abs(way) >= NEARLY
            fewest = -int(either or any(rate < 0.0 for rate in spins))
            most = int(either or any(rate > 0.0 for rate in spins))
            turns = np.round((out[end] + missing - out[start] - way) / (2.0 * np.pi))
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
    return np.asarray(out + departure(half_steps, first, last, until, lasts))


def correct_headings(headings: Floats, centres: Floats, within: Floats) -> Floats:
    """Return what to add to headings [K] to be `within` radians [K] of the `centres` of states [K], without a leap.

    Where both turn on opposite ways the corrections come to a whole turn, and stay there.
    """
    missing = np.unwrap(centres - headings)
    turns = 2.0 * np.pi * np.round(missing / (2.0 * np.pi))
    return np.asarray(missing - np.clip(missing - turns, -within, within))


def travel_along(travel: Floats, headings: Floats) -> Floats:
    """Return the root's level displacement in the world in each step [2 T, 3], metres.

    Args:
        travel: the same in the body's own heading midway through the step [2 T, 3], metres.
        headings: at the steps' ends [2 T + 1], radians.
    """
    along = rot.mul_vec(rot.about_vertical(0.5 * (headings[1:] + headings[:-1])), travel)
    return np.asarray(along * np.array([1.0, 0.0, 1.0]))
