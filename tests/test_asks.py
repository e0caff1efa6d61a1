"""What can be asked of a tween: restrictions, vias and changed costs, against brute force and toulbar2."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from toys import Toy, random_toy

from motionmind.search.solve import PROVEN, Certificate, Progress, Rules, Via, solve

MOVES = 5


# --- brute force ------------------------------------------------------------------------------------------------------


def best(toy: Toy, moves: Sequence[int], allowed: NDArray[np.bool_], vias: Sequence[Via]) -> float:
    """Least cost over all joint states, for numbers of moves, with `allowed` [G] on the way and vias passed in order.

    value[k, n]: of the ways so far to joint state n, past k vias; no two are passed at once, nor at either end.
    """
    joint = toy.joint_states()
    move, stand = toy._tables()
    starts = np.concatenate([[0], np.cumsum(toy.sizes)])[:-1]
    inner = np.where(allowed[starts + joint].all(axis=1), 0.0, np.inf)
    at_goal = (joint == toy.goal).all(axis=1)
    least = np.inf
    for last in moves:
        value = np.full((len(vias) + 1, len(joint)), np.inf)
        value[0] = np.where((joint == toy.start).all(axis=1), 0.0, np.inf)
        for t in range(1, last + 1):
            value = (value[:, :, None] + move).min(axis=1) + stand
            if t < last:
                value += inner
                for k in range(len(vias), 0, -1):
                    if vias[k - 1].move in (None, t):
                        here = (joint == vias[k - 1].states).all(axis=1)
                        value[k, here] = np.minimum(value[k, here], value[k - 1, here])
        least = min(least, value[-1, at_goal][0] + toy.per_move * last)
    return least


def keeps(toy: Toy, path: NDArray[np.int32], allowed: NDArray[np.bool_], found: Certificate, vias: list[Via]) -> bool:
    starts = np.concatenate([[0], np.cumsum(toy.sizes)])[:-1]
    on_the_way = bool(allowed[starts + path[1:-1]].all())
    passed = all((path[t] == via.states).all() for t, via in zip(found.passed, vias, strict=True))
    there = all(via.move in (None, t) for t, via in zip(found.passed, vias, strict=True))
    return on_the_way and passed and there and all(a < b for a, b in pairwise((0, *found.passed, len(path) - 1)))


asks = st.tuples(
    st.integers(0, 10_000), st.booleans(), st.booleans(), st.floats(0.0, 0.6), st.integers(0, 3), st.integers(1, MOVES)
)


@settings(max_examples=250)
@given(asks)
def test_whatever_is_asked_the_cost_is_that_of_brute_force(
    asked: tuple[int, bool, bool, float, int, int],
) -> None:
    seed, frustrated, even, share, passed, fewest = asked
    toy = random_toy(seed, frustrated=frustrated, even=even)
    rng = np.random.default_rng(seed)
    allowed = rng.random(sum(toy.sizes)) >= share
    vias = []
    for k in range(passed):
        move = int(rng.integers(k + 1, MOVES)) if rng.random() < 0.4 and k + 1 < MOVES else None
        vias.append(Via(rng.integers(toy.sizes), move))
    moves = range(fewest, MOVES + 1)
    expected = best(toy, moves, allowed, vias)
    found = solve(toy.model()._replace(allowed=allowed), *toy.ends(), toy.rules(fewest, MOVES), vias)
    if found is None:
        assert expected == np.inf
    else:
        assert found.status == "optimal"
        assert found.cost == pytest.approx(expected, abs=2 * PROVEN)
        assert found.lower_bound <= expected + 1e-9
        assert toy.cost(found.path) == pytest.approx(found.cost, abs=1e-9)
        assert keeps(toy, found.path, allowed, found, vias)
