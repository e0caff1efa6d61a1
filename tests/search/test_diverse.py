"""Laws of the search for a path that differs from others: on toys (see toys.py), against every path listed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toys import Toy, random_toy, solution

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.errors import InfeasibleError
from motionmind.search.costs import path_cost
from motionmind.search.diverse import PRICE_FACTORS, TooSimilarError, _improve, difference, solve_diverse
from motionmind.search.polish import minimise_chain, minimise_move
from motionmind.search.problem import Problem, Via
from motionmind.search.solve import Certificate, Progress, solve
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.search.trellis import locate, segment_trellises

ROUNDING = 1e-9

seeds = st.integers(0, 10_000)


def small_toy(seed: int) -> Toy:
    """At most three chains of three states, so that all paths of four moves can be listed."""
    return random_toy(seed, most=3, states=3, frustrated=seed % 3 == 0)


def random_guide(toy: Toy, seed: int) -> Callable[[int], Floats]:
    def guide(moves: int) -> Floats:
        return np.random.default_rng([seed, moves]).uniform(-1.0, 2.0, (moves - 1, sum(toy.sizes)))

    return guide


def listed(toy: Toy, moves: int, allowed: Bools, vias: Sequence[Via], guide: Callable[[int], Floats]) -> list[Int32s]:
    """Every path of so many moves that keeps the rules, the cheapest first."""
    ways = [
        np.array([toy.start, *inner, toy.goal], dtype=np.int32)
        for inner in product(toy.joint_states().tolist(), repeat=moves - 1)
        if all(allowed[toy.rows(np.array(states))].all() for states in inner)
    ]
    costs = {id(path): toy.cost(path, guide(moves)) for path in ways if passes(path, vias)}
    return sorted((path for path in ways if costs.get(id(path), np.inf) < np.inf), key=lambda path: costs[id(path)])


def passes(path: Int32s, vias: Sequence[Via]) -> bool:
    move = 0
    for via in vias:
        inner = range(move + 1, len(path) - 1)
        at = [t for t in inner if (path[t] == via.states).all() and via.move in (None, t)]
        if not at:
            return False
        move = at[0]
    return True


def solve_if_possible(problem: Problem, others: Sequence[Int32s], share: float) -> Certificate | float:
    """The certificate, or the greatest share that is said to be possible."""
    try:
        return solve_diverse(problem, others, share)
    except TooSimilarError as error:
        return error.most


def test_two_paths_differ_by_the_share_of_states_on_the_way() -> None:
    path = np.array([[0, 0], [1, 2], [3, 4], [5, 5]], dtype=np.int32)
    other = np.array([[9, 9], [1, 2], [3, 0], [9, 9]], dtype=np.int32)
    assert difference(path, other) == 0.25
    assert difference(path, path) == 0.0
    assert difference(path[:2], other[:2]) == 0.0


@settings(max_examples=150, deadline=None)
@given(seeds, st.floats(0.0, 1.0), st.integers(1, 3), st.integers(2, 4), st.booleans())
def test_the_bound_holds_and_the_path_differs_by_enough(
    seed: int, share: float, earlier: int, moves: int, passed: bool
) -> None:
    toy, rng = small_toy(seed), np.random.default_rng(seed)
    guide, allowed = random_guide(toy, seed), rng.random(sum(toy.sizes)) >= 0.1
    moves = min(moves, 3) if len(toy.joint_states()) > 12 else moves
    vias = [Via(rng.integers(toy.sizes))] if passed else []
    every = listed(toy, moves, allowed, vias, guide)
    problem = toy.problem(toy.rules(moves, moves), vias, guide, allowed=allowed)
    if not every:
        with pytest.raises(InfeasibleError):
            solve_diverse(problem, [np.array([toy.start] * (moves + 1), dtype=np.int32)], share)
        return
    others = [every[0], *(every[int(rng.integers(len(every)))] for _ in range(earlier - 1))]
    least = [min(difference(path, other) for other in others) for path in every]
    found = solve_if_possible(problem, others, share)
    if isinstance(found, float):
        assert found >= max(least) - ROUNDING
        assert max(least) < share or earlier > 1
        if earlier == 1:
            assert found == pytest.approx(max(least), abs=ROUNDING)
        return
    assert min(difference(found.path, other) for other in others) >= share - ROUNDING
    assert toy.cost(found.path, guide(moves)) == pytest.approx(found.cost, abs=ROUNDING)
    assert allowed[toy.rows(found.path[1:-1])].all()
    assert passes(found.path, vias)
    assert all((found.path[t] == via.states).all() for t, via in zip(found.passed, vias, strict=True))
    best = next(path for path, differs in zip(every, least, strict=True) if differs >= share - ROUNDING)
    expected = toy.cost(best, guide(moves))
    assert found.lower_bound <= expected + ROUNDING
    assert found.cost >= expected - ROUNDING
    assert (found.status == "optimal") == (found.cost - found.lower_bound <= OPTIMAL_WITHIN_NATS)


def test_on_toys_most_are_proven_and_nearly_all_are_best() -> None:
    proven, best, total = 0, 0, 0
    for seed in range(120):
        toy = small_toy(seed)
        guide, allowed = random_guide(toy, seed), np.ones(sum(toy.sizes), dtype=bool)
        every = listed(toy, 3, allowed, [], guide)
        if not every:
            continue
        found = solve_if_possible(toy.problem(toy.rules(3, 3), [], guide), every[:1], 0.5)
        if isinstance(found, float):
            continue
        expected = next(toy.cost(path, guide(3)) for path in every if difference(path, every[0]) >= 0.5)
        total += 1
        proven += found.status == "optimal"
        best += found.cost <= expected + OPTIMAL_WITHIN_NATS
    assert total > 60
    assert proven > 0.5 * total
    assert best > 0.9 * total


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_a_share_of_zero_changes_nothing(seed: int) -> None:
    toy = small_toy(seed)
    problem = toy.problem(toy.rules(3, 3), [], random_guide(toy, seed))
    found = solution(problem)
    if found is not None:
        again = solve_diverse(problem, [found.path], 0.0)
        assert again.status == "optimal"
        assert again.cost == pytest.approx(found.cost, abs=2 * OPTIMAL_WITHIN_NATS)


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_a_greater_share_has_no_lower_optimum(seed: int) -> None:
    toy = small_toy(seed)
    problem = toy.problem(toy.rules(3, 3), [], random_guide(toy, seed))
    found = solution(problem)
    if found is None:
        return
    by_share = [solve_if_possible(problem, [found.path], share) for share in (0.0, 0.25, 0.5, 0.75)]
    known = [one for one in by_share if isinstance(one, Certificate)]
    assert all(less.lower_bound <= more.cost + ROUNDING for less, more in pairwise(known))
    assert all(not isinstance(one, Certificate) for one in by_share[len(known) :])


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_no_single_chain_or_move_improves_an_improved_path(seed: int) -> None:
    toy, rng = small_toy(seed), np.random.default_rng(seed)
    guide = random_guide(toy, seed)
    every = listed(toy, 4 if len(toy.joint_states()) < 10 else 3, np.ones(sum(toy.sizes), dtype=bool), [], guide)
    if not every:
        return
    moves = len(every[0]) - 1
    (trellis,) = segment_trellises(toy.problem(toy.rules(moves, moves), [], guide), [0, moves])
    path = locate(trellis, every[int(rng.integers(len(every)))])
    agreeing = rng.integers(0, 2, (2, len(trellis.dom))).astype(np.float64)
    allowed, prices = agreeing[:, path].sum(axis=1) - rng.integers(0, 2, 2), rng.uniform(0.1, 2.0, 2)

    def excess(path: Ints) -> float:
        return float(np.maximum(agreeing[:, path].sum(axis=1) - allowed, 0.0).sum())

    before = excess(path)
    cost = _improve(trellis, path, agreeing, allowed, prices)
    assert cost == path_cost(trellis, path)
    assert excess(path) <= before
    for factor, part in product(PRICE_FACTORS, range(trellis.chains + trellis.moves)):
        dearer = trellis._replace(unary=trellis.unary + factor * prices @ agreeing)
        trial, kept = path.copy(), np.ones(len(trellis.dom), dtype=np.bool_)
        if part < trellis.chains:
            minimise_chain(dearer, trial, part, kept)
        else:
            minimise_move(dearer, trial, part - trellis.chains + 1, kept)
        assert path_cost(trellis, trial) > cost - ROUNDING or excess(trial) > excess(path)


def test_a_path_without_inner_states_cannot_differ() -> None:
    toy = replace(small_toy(1), parents=(-1,), edges=(np.zeros((2, 2)),), children=(np.zeros(2),), above=(np.zeros(0),))
    toy = replace(toy, corrections=(np.zeros((0, 2)),), start=(0,), goal=(1,))
    path = solve(toy.problem(toy.rules(1, 1))).path
    with pytest.raises(TooSimilarError) as fault:
        solve_diverse(toy.problem(toy.rules(1, 1)), [path], 0.2)
    assert fault.value.most == 0.0


def test_a_watcher_ends_the_search_with_a_path_that_differs_and_a_bound() -> None:
    statuses = set()
    for seed in range(30):
        toy = small_toy(seed)
        guide = random_guide(toy, seed)
        every = listed(toy, 3, np.ones(sum(toy.sizes), dtype=bool), [], guide)
        least = [toy.cost(path, guide(3)) for path in every if difference(path, every[0]) >= 0.5]
        for calls in range(0, 9, 2):
            if not least:
                continue
            told: list[Progress] = []
            found = solve_diverse(
                toy.problem(toy.rules(3, 3), [], guide),
                every[:1],
                0.5,
                lambda so_far, told=told, calls=calls: told.append(so_far) or len(told) > calls,  # type: ignore[misc]
            )
            assert len(told) <= calls + 1
            assert difference(found.path, every[0]) >= 0.5
            assert found.lower_bound <= least[0] + ROUNDING <= found.cost + 2 * ROUNDING
            assert all(a.cost >= b.cost and a.lower_bound <= b.lower_bound + ROUNDING for a, b in pairwise(told))
            statuses.add(found.status)
    assert {"optimal", "interrupted"} <= statuses


def test_a_path_that_is_near_enough_ends_the_search_sooner() -> None:
    sooner = 0
    for seed in range(30):
        toy = small_toy(seed)
        guide = random_guide(toy, seed)
        every = listed(toy, 3, np.ones(sum(toy.sizes), dtype=bool), [], guide)
        if all(difference(path, every[0]) < 0.5 for path in every):
            continue
        problem = toy.problem(toy.rules(3, 3), [], guide)
        best, near = (solve_diverse(problem, every[:1], 0.5, within=within) for within in (0.0, 0.3))
        assert difference(near.path, every[0]) >= 0.5
        assert near.lower_bound <= best.lower_bound + ROUNDING
        assert best.cost <= near.cost + ROUNDING
        assert near.cost <= 1.3 * near.lower_bound + ROUNDING or near.cost <= best.cost + ROUNDING
        assert near.expansions <= best.expansions
        sooner += near.expansions < best.expansions
    assert sooner > 0
