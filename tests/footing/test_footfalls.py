"""Footfalls: the time parted into standing and swinging, against all ways to part it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest

from motionmind._typing import Bools, Floats
from motionmind.footing.footfalls import (
    COSTS,
    SHORTEST_STEP_S,
    _crossing,
    _divide,
    find_stances,
    standing_costs,
)


def cost_of(
    stands: Sequence[bool],
    track: Floats,
    outward: Floats,
    stand: Floats,
    swing: Floats,
    half: tuple[int, int],
    fps: float,
) -> float:
    """The cost of a way to part the time into standing and swinging, straight from its definition."""
    last, total, at = len(track) - 1, 0.0, 0
    while at <= last:
        end = at
        while end < last and stands[end + 1] == stands[at]:
            end += 1
        here = slice(at, end + 1)
        if stands[at]:
            own = track[here]
            if at == 0 and end == last:
                far = max(float(np.linalg.norm(track[-1] - track[0])) - COSTS.slip, 0.0)
                off = np.sum((own - own.mean(axis=0)) ** 2) + len(own) * (far / COSTS.slip * COSTS.drift) ** 2
            elif at == 0 or end == last:
                place = track[0] if at == 0 else track[-1]
                inward = np.maximum(np.sum((own - place) * outward[here], axis=1), 0.0)
                off = np.sum((own - place) ** 2) + COSTS.crossing * np.sum(inward**2)
            else:
                across = 0.5 * COSTS.own_side * (track[end] - track[at]) @ outward[(at + end) // 2]
                off = np.sum((own - own.mean(axis=0)) ** 2) + len(own) * across**2
            total += stand[here].sum() / fps + float(off) / (COSTS.drift**2 * fps)
        else:
            if (at == 0 and stand[0] < COSTS.swing_firm) or (end == last and stand[-1] < COSTS.swing_firm):
                return np.inf
            inner = at > 0 and end < last
            least = max(2, round(SHORTEST_STEP_S * fps)) if inner else half[0] if at == 0 else half[1]
            if end + 1 - at < least:
                return np.inf
            off = track[min(end + 1, last)] - track[max(at - 1, 0)]
            total += (
                swing[here].sum() / fps
                + float(off @ off) / ((end + 2 - at) / fps * COSTS.quick**2)
                + inner * COSTS.step
            )
        at = end + 1
    return total


@pytest.mark.parametrize("seed", range(5))
def test_time_is_parted_in_the_way_that_costs_least(seed: int) -> None:
    rng, frames, fps = np.random.default_rng(seed), 11, 12.0
    track = np.cumsum(rng.normal(scale=0.05, size=(frames, 2)), axis=0)
    track -= track[0]
    angles = rng.uniform(0.0, 6.0) + np.cumsum(rng.normal(scale=0.1, size=frames))
    outward = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    stand, swing = rng.uniform(0.0, 8.0, frames), rng.uniform(0.0, 3.0, frames)
    if seed % 2:  # a foot that is lifted for a frame steps, and a step is no shorter than it may be
        track, stand = 0.1 * track, 0.1 * stand
        stand[frames // 2] = 60.0
    half = (3 * seed % 4, seed % 3)  # frames that a foot swings at least which is given in the air
    known = track, outward, stand, swing, half, fps
    best = min(product((True, False), repeat=frames), key=lambda one: cost_of(one, *known))
    crosses = _crossing(track, outward)
    parted = _divide(track, outward, crosses, stand / fps, swing / fps, max(2, round(SHORTEST_STEP_S * fps)), half, fps)
    found = np.zeros(frames, dtype=bool)
    for start, end in parted:
        found[start : end + 1] = True
    assert cost_of(list(found), *known) == pytest.approx(cost_of(best, *known), rel=1e-9)


def test_a_foot_that_is_lifted_swings_and_one_that_stands_firmly_stands() -> None:
    above, firm = np.array([0.0, 0.0, 0.3]), np.array([1.0, 0.1, 1.0])
    stand, swing = standing_costs(above, firm)
    np.testing.assert_array_equal(stand < swing, [True, False, False])
    # A leg in the air has farther to come down, the higher it is.
    higher = standing_costs(np.array([0.1, 0.3, 0.9]), np.ones(3))[0]
    assert 2.5 * higher[0] < higher[1]
    assert 2.5 * higher[1] < higher[2]
    track = np.zeros((30, 2))
    high = np.where((np.arange(30) > 9) & (np.arange(30) < 21), 0.2, 0.0)
    others, none = np.ones(30, dtype=np.bool_), np.zeros(30, dtype=np.bool_)
    outward = np.tile([1.0, 0.0], (30, 1))
    stances = find_stances(track, outward, *standing_costs(high, np.ones(30)), others, none, 30.0)
    assert [(one.start, one.end) for one in stances] == [(0, 9), (21, 29)]
    # Where nothing else bears, it is not lifted for so short a time.
    assert len(find_stances(track, outward, *standing_costs(high, np.ones(30)), none, none, 30.0)) == 1


@pytest.mark.parametrize("end", [0, 1])
def test_a_foot_that_is_given_in_the_air_takes_half_a_step_to_come_down(end: int) -> None:
    frames, fps = 30, 30.0
    track, outward = np.zeros((frames, 2)), np.tile([1.0, 0.0], (frames, 1))
    high = np.zeros(frames)
    high[-end] = 0.4
    others, none = np.ones(frames, dtype=np.bool_), np.zeros(frames, dtype=np.bool_)

    def comes_down(flying: Bools, moving: tuple[bool, bool]) -> int:
        """Frames for which it swings at that end."""
        (stance,) = find_stances(track, outward, *standing_costs(high, np.ones(frames)), others, flying, fps, moving)
        return stance.start if end == 0 else frames - 1 - stance.end

    assert comes_down(none, (False, False)) == round(SHORTEST_STEP_S * fps) // 2
    # On its way down, or with the body, it comes down as it falls.
    assert comes_down(none, (end == 0, end == 1)) == 1
    flying = none.copy()
    flying[-end] = True
    assert comes_down(flying, (False, False)) == 1
