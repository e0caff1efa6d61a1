"""The choice of a number of moves by haste and tolls, against every choice listed one by one."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toys import Toy, best, random_toy, solution

from motionmind._typing import Bools, Floats, Ints
from motionmind.errors import InfeasibleError
from motionmind.search.length import choose_length
from motionmind.search.problem import Via

MOVES = 6
SAME = 1e-9

seeds = st.integers(0, 10_000)


def haste(toy: Toy, stop: Ints, next_stop: Ints, moves: int, allowed: Bools) -> float:
    """The haste of all chains from one stop to the next, from the toy's own tables."""
    total, first = 0.0, 0
    for chain, size in enumerate(toy.sizes):
        alone = toy.coupling(chain).min(axis=0) if toy.parents[chain] >= 0 else np.zeros(size)
        on_the_way = np.where(allowed[first : first + size], 0.0, np.inf)
        value = np.where(np.arange(size) == next_stop[chain], 0.0, np.inf)
        for k in range(moves):
            value = (toy.moves(chain) + (alone + value + (on_the_way if k else 0.0))).min(axis=1)
        if not np.isfinite(value[stop[chain]]):
            return np.inf
        total, first = total + value[stop[chain]] - value.min(), first + size
    return total


def choices(toy: Toy, shortest: int, vias: list[Via], tolls: Floats, allowed: Bools) -> dict[tuple[int, ...], float]:
    """The cost of every choice of the moves at which stops are passed, the end among them."""
    starts = np.concatenate([[0], np.cumsum(toy.sizes)])[:-1]
    start, goal = toy.ends()
    stops = [start, *(via.states for via in vias), goal]
    out = {}
    for ends in combinations(range(1, MOVES + 1), len(vias) + 1):
        there = all(
            via.move in (None, end) and allowed[starts + via.states].all()
            for via, end in zip(vias, ends[:-1], strict=True)
        )
        if ends[-1] < shortest or not there:
            continue
        out[ends] = sum(
            haste(toy, stops[k], stops[k + 1], b - a, allowed) + tolls[k, b - a]
            for k, (a, b) in enumerate(pairwise((0, *ends)))
        )
    return {ends: cost for ends, cost in out.items() if np.isfinite(cost)}


@settings(max_examples=200, deadline=None)
@given(seeds, st.integers(0, 2), st.integers(1, MOVES), st.floats(0.0, 0.4))
def test_it_is_the_best_of_all_choices(seed: int, count: int, shortest: int, share: float) -> None:
    toy, rng = random_toy(seed), np.random.default_rng(seed)
    allowed = rng.random(sum(toy.sizes)) >= share
    at = [int(rng.integers(1, MOVES)) if rng.random() < 0.3 else None for _ in range(count)]
    vias = [Via(rng.integers(toy.sizes), move) for move in at]
    tolls = rng.uniform(-3.0, 10.0, (count + 1, MOVES + 1))
    problem = replace(toy.problem(toy.rules(shortest, MOVES), vias, allowed=allowed), tolls=tolls)
    listed = choices(toy, shortest, vias, tolls, allowed)
    if not listed:
        with pytest.raises(InfeasibleError):
            choose_length(problem)
        return
    found = choose_length(problem)
    assert found.cost == found.lower_bound == pytest.approx(min(listed.values()), abs=SAME)
    assert listed[*found.passed, found.moves] == pytest.approx(found.cost, abs=SAME)
    others = [cost for ends, cost in listed.items() if ends[-1] != found.moves]
    assert found.lower_bound_elsewhere == pytest.approx(min(others, default=np.inf), abs=SAME)
    paid = sum(tolls[k, b - a] for k, (a, b) in enumerate(pairwise((0, *found.passed, found.moves))))
    assert found.haste == pytest.approx(found.cost - paid, abs=SAME)


@settings(max_examples=100, deadline=None)
@given(seeds, st.integers(0, 2), st.booleans())
def test_the_path_is_the_best_of_the_chosen_length_and_tolls_are_no_part_of_its_cost(
    seed: int, count: int, guided: bool
) -> None:
    toy, rng = random_toy(seed, frustrated=True), np.random.default_rng(seed)
    vias = [Via(rng.integers(toy.sizes)) for _ in range(count)]
    costs = rng.uniform(-2.0, 3.0, (MOVES, sum(toy.sizes)))
    guide = (lambda moves: costs[: moves - 1]) if guided else None
    tolls = rng.uniform(0.0, 30.0, (count + 1, MOVES + 1))
    problem = replace(toy.problem(toy.rules(1, MOVES), vias, guide=guide), tolls=tolls)
    found = solution(problem)
    if found is None:
        with pytest.raises(InfeasibleError):
            choose_length(problem)
        return
    assert found.length == choose_length(problem)
    assert (len(found.path) - 1, found.passed) == (found.length.moves, found.length.passed)
    placed = [Via(via.states, move) for via, move in zip(vias, found.passed, strict=True)]
    every = np.ones(sum(toy.sizes), dtype=bool)
    assert found.cost == pytest.approx(best(toy, [found.length.moves], every, placed, guide), abs=1e-6)


def test_a_given_number_of_moves_pays_no_toll() -> None:
    toy = random_toy(3)
    plain = solution(toy.problem(toy.rules(MOVES, MOVES)))
    tolled = solution(replace(toy.problem(toy.rules(MOVES, MOVES)), tolls=np.full((1, MOVES + 1), 7.0)))
    assert plain is not None
    assert tolled is not None
    assert (tolled.cost, tolled.length) == (plain.cost, None)


@pytest.mark.parametrize("tolls", [np.zeros((1, MOVES)), np.zeros((2, MOVES + 1)), np.full((1, MOVES + 1), np.inf)])
def test_tolls_that_do_not_fit_are_refused(tolls: Floats) -> None:
    toy = random_toy(4)
    with pytest.raises(ValueError, match="finite tolls"):
        choose_length(replace(toy.problem(toy.rules(1, MOVES)), tolls=tolls))
