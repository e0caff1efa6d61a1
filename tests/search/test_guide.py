"""Laws of the guided search: costs of states by move, on toys (see toys.py) and on bundled movement."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toys import Toy, best, evaluate, random_toy, solution

from motionmind._typing import Bools, Floats
from motionmind.geometry import rotations as rot
from motionmind.search import bounding
from motionmind.search.cfn import cfn
from motionmind.search.costs import path_cost
from motionmind.search.problem import Problem, Rules, Via
from motionmind.search.sample import sample_path
from motionmind.search.solve import Certificate, Progress, feasible, solve
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.search.trellis import segment_trellises
from motionmind.tween.engine import Engine
from motionmind.tween.problem import build_model, ingredients_of

MOVES = 5
SAME = 2 * OPTIMAL_WITHIN_NATS
ROUNDING = 1e-9

seeds = st.integers(0, 10_000)


def random_guide(toy: Toy, seed: int) -> Callable[[int], Floats]:
    """Costs of both signs, other ones for every number of moves."""

    def guide(moves: int) -> Floats:
        return np.random.default_rng([seed, moves]).uniform(-2.0, 3.0, (moves - 1, sum(toy.sizes)))

    return guide


def random_vias(toy: Toy, seed: int, count: int, at: float) -> list[Via]:
    """Vias, a share of them at given moves."""
    rng, vias = np.random.default_rng(seed), []
    for k in range(count):
        move = int(rng.integers(k + 1, MOVES)) if rng.random() < at and k + 1 < MOVES else None
        vias.append(Via(rng.integers(toy.sizes), move))
    return vias


def every(toy: Toy) -> Bools:
    return np.ones(sum(toy.sizes), dtype=bool)


def guided_cost(toy: Toy, found: Certificate, guide: Callable[[int], Floats] | None) -> float:
    moves = len(found.path) - 1
    return toy.cost(found.path, guide(moves) if guide is not None and moves > 1 else None)


def keeps(found: Certificate, vias: list[Via]) -> bool:
    passed = all((found.path[t] == via.states).all() for t, via in zip(found.passed, vias, strict=True))
    there = all(via.move in (None, t) for t, via in zip(found.passed, vias, strict=True))
    return passed and there and all(a < b for a, b in pairwise((0, *found.passed, len(found.path) - 1)))


# --- the answer -------------------------------------------------------------------------------------------------------


@settings(max_examples=250, deadline=None)
@given(seeds, st.booleans(), st.booleans(), st.floats(0.0, 0.5), st.integers(0, 3), st.integers(1, MOVES))
def test_in_a_given_number_of_moves_the_cost_is_that_of_brute_force(
    seed: int, frustrated: bool, even: bool, share: float, passed: int, moves: int
) -> None:
    toy = random_toy(seed, frustrated=frustrated, even=even)
    allowed = np.random.default_rng(seed).random(sum(toy.sizes)) >= share
    vias, guide = random_vias(toy, seed, passed, at=0.4), random_guide(toy, seed)
    expected = best(toy, [moves], allowed, vias, guide)
    problem = toy.problem(toy.rules(moves, moves), vias, guide, allowed=allowed)
    found = solution(problem)
    assert feasible(problem) == (expected < np.inf)
    if found is None:
        assert expected == np.inf
        return
    assert (found.status, found.length) == ("optimal", None)
    assert found.cost == pytest.approx(expected, abs=SAME)
    assert found.lower_bound <= expected + ROUNDING
    assert guided_cost(toy, found, guide) == pytest.approx(found.cost, abs=ROUNDING)
    assert keeps(found, vias)


@settings(max_examples=150, deadline=None)
@given(seeds, st.booleans(), st.integers(0, 2))
def test_the_number_of_moves_is_the_best_without_the_guide(seed: int, frustrated: bool, passed: int) -> None:
    toy = random_toy(seed, frustrated=frustrated)
    vias, guide, asked = random_vias(toy, seed, passed, at=0.3), random_guide(toy, seed), []

    def listening(moves: int) -> Floats:
        asked.append(moves)
        return guide(moves)

    unguided = [best(toy, [moves], every(toy), vias) for moves in range(1, MOVES + 1)]
    found = solution(toy.problem(toy.rules(1, MOVES), vias, listening))
    if found is None:
        assert min(unguided) == np.inf
        return
    moves, length = len(found.path) - 1, found.length
    assert length is not None
    assert set(asked) <= {moves}
    assert length.moves == moves
    assert unguided[moves - 1] == pytest.approx(min(unguided), abs=SAME)
    assert length.cost >= min(unguided) - ROUNDING
    assert length.lower_bound <= min(unguided) + ROUNDING
    others = [cost for count, cost in enumerate(unguided, start=1) if count != moves]
    assert length.cost - OPTIMAL_WITHIN_NATS <= length.lower_bound_elsewhere <= min(others) + ROUNDING
    assert found.status == "optimal"
    assert found.cost == pytest.approx(best(toy, [moves], every(toy), vias, guide), abs=SAME)
    assert guided_cost(toy, found, guide) == pytest.approx(found.cost, abs=ROUNDING)
    assert keeps(found, vias)


@settings(max_examples=250, deadline=None)
@given(
    seeds,
    st.integers(0, 3),
    st.booleans(),
    st.integers(1, MOVES),
    st.integers(1, 1000),
    st.sampled_from([0, 1, 100]),
    st.sampled_from([0, bounding.MAX_STATE_PAIRS]),
    st.none() | st.integers(0, 10),
)
def test_the_certificate_holds_however_little_effort_is_allowed(
    seed: int, passed: int, guided: bool, fewest: int, nodes: int, sweeps: int, pairs: int, calls: int | None
) -> None:
    toy = random_toy(seed, frustrated=seed % 3 > 0, even=seed % 2 == 0)
    vias, guide = random_vias(toy, seed, passed, at=0.3), random_guide(toy, seed) if guided else None
    told: list[Progress] = []
    watch = None if calls is None else lambda so_far: told.append(so_far) or len(told) > calls
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bounding, "MAX_PAIR_CHAIN_SWEEPS", sweeps)
        patch.setattr(bounding, "MAX_STATE_PAIRS", pairs)
        found = solution(toy.problem(toy.rules(fewest, MOVES, nodes, sweeps=1 + seed % 3), vias, guide), watch)
    unguided = {moves: best(toy, [moves], every(toy), vias) for moves in range(fewest, MOVES + 1)}
    if found is None:
        assert min(unguided.values()) == np.inf
        return
    moves = len(found.path) - 1
    optimum = min(unguided.values()) if guide is None else best(toy, [moves], every(toy), vias, guide)
    assert found.lower_bound <= optimum + ROUNDING <= found.cost + 2 * ROUNDING
    assert found.status != "optimal" or found.cost <= optimum + SAME
    assert guided_cost(toy, found, guide) == pytest.approx(found.cost, abs=ROUNDING)
    assert 1 <= found.expansions <= nodes
    assert found.peak_nodes <= nodes
    assert keeps(found, vias)
    if found.length is not None:
        assert found.length.cost >= unguided.pop(moves) - ROUNDING
        assert found.length.lower_bound_elsewhere <= min(unguided.values()) + ROUNDING


def test_an_interrupted_search_has_a_guided_path_and_a_bound_wherever_it_is_ended() -> None:
    statuses = set()
    for seed in range(40):
        toy = random_toy(seed, frustrated=True)
        vias, guide = random_vias(toy, seed, seed % 3, at=0.0), random_guide(toy, seed)
        for calls in range(8):
            told: list[Progress] = []
            found = solution(
                toy.problem(toy.rules(1, MOVES), vias, guide),
                lambda so_far, told=told, calls=calls: told.append(so_far) or len(told) > calls,  # type: ignore[misc]
            )
            assert (found is None) == (best(toy, range(1, MOVES + 1), every(toy), vias) == np.inf)
            if found is None:
                continue
            expected = best(toy, [len(found.path) - 1], every(toy), vias, guide)
            assert found.lower_bound <= expected + ROUNDING <= found.cost + SAME
            assert guided_cost(toy, found, guide) == pytest.approx(found.cost, abs=ROUNDING)
            assert len(told) <= calls + 1
            statuses.add(found.status)
    assert statuses == {"optimal", "interrupted"}


def test_a_guide_that_costs_nothing_changes_nothing_and_one_that_costs_all_alike_adds_that() -> None:
    for seed in range(40):
        toy = random_toy(seed, frustrated=seed % 2 == 0)
        alike = np.ones((2, sum(toy.sizes)))
        for vias in ([], random_vias(toy, seed, 1, at=0.0)):
            costs = []
            for nats in (None, 0.0, 1.5, -1.5):
                guide = None if nats is None else lambda _, costs=nats * alike: costs
                found = solution(toy.problem(toy.rules(3, 3), vias, guide))
                costs.append(np.inf if found is None else found.cost - 2 * len(toy.sizes) * (nats or 0.0))
            assert costs == pytest.approx(costs[:1] * 4, abs=SAME)


def test_optimal_and_sampled_paths_follow_a_strong_guide_past_a_via() -> None:
    """Guides that charge 60 nats for leaving a path whose every move is possible."""
    followed = 0
    for seed in range(60):
        toy = random_toy(seed)
        wanted = solution(toy.problem(toy.rules(MOVES, MOVES), random_vias(toy, seed, 1, at=0.0)))
        if wanted is None:
            continue
        costs = np.full((MOVES - 1, sum(toy.sizes)), 60.0)
        np.put_along_axis(costs, toy.rows(wanted.path[1:-1]), 0.0, axis=1)
        problem = toy.problem(toy.rules(MOVES, MOVES), [Via(wanted.path[2].astype(np.int64))], lambda _, c=costs: c)
        found = solve(problem)
        np.testing.assert_array_equal(found.path, wanted.path)
        assert found.cost == pytest.approx(wanted.cost, abs=SAME)
        sampled = sample_path(problem, found, seed)
        np.testing.assert_array_equal(sampled.path, wanted.path)
        assert sampled.cost == pytest.approx(wanted.cost, abs=SAME)
        followed += 1
    assert followed > 20


def test_the_cost_of_a_sampled_path_includes_the_guide() -> None:
    for seed in range(30):
        toy = random_toy(seed)
        vias, guide = random_vias(toy, seed, seed % 3, at=0.3), random_guide(toy, seed)
        problem = toy.problem(toy.rules(1, MOVES), vias, guide)
        found = solution(problem)
        if found is not None:
            sampled = sample_path(problem, found, seed)
            assert guided_cost(toy, sampled, guide) == pytest.approx(sampled.cost, abs=ROUNDING)
            assert sampled.lower_bound <= sampled.cost + ROUNDING


def test_the_guide_is_checked() -> None:
    toy = random_toy(0)
    for costs, message in ((np.zeros((1, 1)), r"the guide of 5 moves has the shape \(1, 1\)"), (None, "not finite")):
        guide = np.full((MOVES - 1, sum(toy.sizes)), np.inf) if costs is None else costs
        with pytest.raises(ValueError, match=message):
            solve(toy.problem(toy.rules(MOVES, MOVES), guide=lambda _, guide=guide: guide))


# --- the problem written out ------------------------------------------------------------------------------------------


def written(toy: Toy, problem: Problem, found: Certificate, chains: list[str]) -> str:
    """The problem in the number of moves that was found, its vias where they were passed."""
    vias = [Via(via.states, move) for via, move in zip(problem.vias, found.passed, strict=True)]
    return cfn(replace(problem, vias=vias), len(found.path) - 1, chains, toy.ingredients(problem))


def test_a_path_costs_in_the_written_problem_what_its_certificate_states() -> None:
    for seed in range(60):
        toy = random_toy(seed)
        problem = toy.problem(toy.rules(1, MOVES), random_vias(toy, seed, seed % 3, at=0.3), random_guide(toy, seed))
        found = solution(problem)
        if found is not None:
            chains = [f"chain{chain}" for chain in range(len(toy.sizes))]
            text = written(toy, problem, found, chains)
            assert evaluate(text, found.path, chains) == pytest.approx(found.cost, abs=1e-4), seed
            moves = [0, *found.passed, len(found.path) - 1]
            cost = sum(
                path_cost(trellis, positions)
                for trellis, positions in located(segment_trellises(problem, moves), found, moves)
            )
            assert cost + toy.per_move * moves[-1] == pytest.approx(found.cost, abs=ROUNDING)


def located(trellises: list, found: Certificate, moves: list[int]) -> list:
    """Trellises of segments, each with its part of the path as positions [n]."""
    out = []
    for trellis, (first, last) in zip(trellises, pairwise(moves), strict=True):
        domains = [trellis.dom[slice(*span)] for span in pairwise(trellis.dom_ptr)]
        states = found.path[first : last + 1].ravel()
        at = [np.searchsorted(domain, state) for domain, state in zip(domains, states, strict=True)]
        out.append((trellis, trellis.dom_ptr[:-1] + np.array(at)))
    return out


def toulbar2(text: str, folder: Path) -> float:
    """The optimum that toulbar2 finds and proves."""
    pytoulbar2 = pytest.importorskip("pytoulbar2", reason="toulbar2 is not installed: no outside solver")
    (folder / "problem.cfn").write_text(text)
    network = pytoulbar2.CFN(verbose=-1)
    network.Read(str(folder / "problem.cfn"))
    return network.Solve()[1]


def test_the_guided_optima_of_toys_are_those_of_toulbar2(tmp_path: Path) -> None:
    checked = 0
    for seed in range(40):
        toy = random_toy(seed, frustrated=seed % 2 == 0)
        problem = toy.problem(toy.rules(2, MOVES), random_vias(toy, seed, seed % 3, at=0.3), random_guide(toy, seed))
        found = solution(problem)
        if found is not None:
            text = written(toy, problem, found, [f"chain{chain}" for chain in range(len(toy.sizes))])
            assert toulbar2(text, tmp_path) == pytest.approx(found.cost, abs=1e-4), seed
            checked += 1
    assert checked > 10


def test_costs_of_a_millionth_of_a_nat_are_written_as_toulbar2_reads_them(tmp_path: Path) -> None:
    toy = random_toy(3)
    rng = np.random.default_rng(3)
    small = 1e-6 * rng.integers(1, 90, (MOVES - 1, sum(toy.sizes)))
    problem = toy.problem(toy.rules(MOVES, MOVES), guide=lambda _: small)
    found = solution(problem)
    assert found is not None
    text = written(toy, problem, found, [f"chain{chain}" for chain in range(len(toy.sizes))])
    assert not re.search(r"\de-", text)
    assert toulbar2(text, tmp_path) == pytest.approx(found.cost, abs=1e-4)


@pytest.mark.parametrize("guided", [False, True])
def test_optima_on_bundled_ballet_are_those_of_toulbar2(guided: bool, tmp_path: Path) -> None:
    """From posture to posture of the corpus; the guide leads each joint along the shortest arc, 15 degrees a nat."""
    engine = Engine.load("ballet")
    model = build_model(engine.grammar, "conditional", 1.0, 1.0)
    space, rng = engine.space, np.random.default_rng(3)
    for _ in range(6):
        start, goal = engine.states[rng.integers(len(engine.states), size=2)].astype(np.int64)

        def guide(moves: int, start: np.ndarray = start, goal: np.ndarray = goal) -> Floats:
            a, b = space.decode(np.stack([start, goal]))
            out = np.empty((moves - 1, space.starts[-1]))
            for chain, (first, last) in enumerate(pairwise(space.starts)):
                every = np.tile(start, (last - first, 1))
                every[:, chain] = np.arange(last - first)
                states = space.decode(every)[:, chain]
                for t in range(1, moves):
                    arc = rot.slerp(a[chain], b[chain], t / moves)
                    out[t - 1, first:last] = (rot.angle(states, arc) / np.radians(15.0)) ** 2
            return out

        problem = Problem(model, start, goal, Rules(1.0, 1.0, 1, 30, 200_000), guide=guide if guided else None)
        found = solve(problem)
        assert found.status == "optimal"
        ingredients = ingredients_of(problem, engine.grammar, "conditional", engine.grammar.coordination, 1.0, 1.0)
        text = cfn(problem, len(found.path) - 1, engine.grammar.chains, ingredients)
        assert toulbar2(text, tmp_path) == pytest.approx(found.cost, abs=1e-3)
