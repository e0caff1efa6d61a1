"""What can be asked of a tween: restrictions, vias and changed costs, against brute force and toulbar2."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from toys import Toy, random_toy

from motionmind.search import astar
from motionmind.search.cfn import cfn
from motionmind.search.costs import dearer, shared_moves
from motionmind.search.problem import Grid
from motionmind.search.solve import PROVEN, Certificate, Progress, Via, solve

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


def test_brute_force_is_not_all_of_one_kind() -> None:
    """What the test above draws has answers and none, and restrictions that cost something."""
    outcomes = set()
    for seed in range(60):
        toy = random_toy(seed)
        rng = np.random.default_rng(seed)
        allowed = rng.random(sum(toy.sizes)) >= 0.2
        vias = [Via(rng.integers(toy.sizes))]
        free, asked = (
            best(toy, range(1, MOVES + 1), allowed | where, through) for where, through in ((True, []), (False, vias))
        )
        outcomes.add("none" if asked == np.inf else "dearer" if asked > free else "same")
    assert outcomes == {"none", "dearer", "same"}


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.integers(0, 2))
def test_bounds_hold_whatever_effort_is_allowed_and_more_of_it_never_worsens_them(seed: int, passed: int) -> None:
    toy = random_toy(seed, frustrated=True)
    rng = np.random.default_rng(seed)
    allowed = rng.random(sum(toy.sizes)) >= 0.15
    vias = [Via(rng.integers(toy.sizes)) for _ in range(passed)]
    expected = best(toy, range(1, MOVES + 1), allowed, vias)
    before = (-np.inf, np.inf)
    for node_budget in (1, 20, 100_000):
        model = toy.model()._replace(allowed=allowed)
        found = solve(model, *toy.ends(), toy.rules(1, MOVES, node_budget, 2), vias)
        if found is None:
            assert expected == np.inf
            continue
        assert found.lower_bound <= expected + 1e-9
        assert found.cost >= expected - 1e-9
        assert found.lower_bound >= before[0] - 1e-9
        assert found.cost <= before[1] + 1e-9
        before = found.lower_bound, found.cost


@settings(max_examples=100)
@given(st.integers(0, 10_000), st.booleans())
def test_vias_at_the_postures_of_the_best_path_change_nothing(seed: int, at: bool) -> None:
    toy = random_toy(seed, even=seed % 2 == 0)
    found = solve(toy.model(), *toy.ends(), toy.rules(2, MOVES))
    if found is None:
        return
    inner = [Via(states.astype(np.int64), t if at else None) for t, states in enumerate(found.path[1:-1], start=1)]
    for vias in (inner, inner[:1], inner[-1:]):
        again = solve(toy.model(), *toy.ends(), toy.rules(2, MOVES), vias)
        assert again is not None
        assert again.cost == pytest.approx(found.cost, abs=2 * PROVEN)


@settings(max_examples=100)
@given(st.integers(0, 10_000))
def test_a_restriction_never_lowers_the_cost_and_one_that_the_best_path_keeps_changes_nothing(seed: int) -> None:
    toy = random_toy(seed)
    found = solve(toy.model(), *toy.ends(), toy.rules(1, MOVES))
    if found is None:
        return
    rng = np.random.default_rng(seed)
    allowed = np.ones(sum(toy.sizes), dtype=bool)
    on_it = np.zeros(sum(toy.sizes), dtype=bool)
    on_it[toy.model().starts[:-1] + found.path[1:-1]] = True
    cost = found.cost
    for _ in range(4):
        allowed &= rng.random(len(allowed)) > 0.2
        kept = solve(toy.model()._replace(allowed=allowed | on_it), *toy.ends(), toy.rules(1, MOVES))
        assert kept is not None
        assert kept.cost == pytest.approx(found.cost, abs=2 * PROVEN)
        narrower = solve(toy.model()._replace(allowed=allowed), *toy.ends(), toy.rules(1, MOVES))
        assert narrower is None or narrower.cost >= cost - 2 * PROVEN
        cost = np.inf if narrower is None else narrower.cost


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.floats(0.1, 3.0))
def test_moves_shared_with_others_cost_as_much_more_as_is_said(seed: int, diversity: float) -> None:
    toy = random_toy(seed)
    others: list[NDArray[np.int32]] = []
    for _ in range(3):
        dear = toy.edges
        for path in others:
            tables = [table.copy() for table in dear]
            made = {(lane, a[lane], b[lane]) for a, b in pairwise(path) for lane in range(len(tables))}
            for lane, state, target in made:
                if state != target:
                    tables[lane][state, target] += diversity
            dear = tuple(tables)
        expected = replace(toy, edges=dear).optima(MOVES)[1:].min()
        found = solve(dearer(toy.model(), others, diversity), *toy.ends(), toy.rules(1, MOVES))
        if found is None:
            assert expected == np.inf
            return
        assert found.cost == pytest.approx(expected, abs=2 * PROVEN)
        shared = shared_moves(found.path, others)
        assert toy.cost(found.path) + diversity * shared == pytest.approx(found.cost, abs=1e-9)
        others.append(found.path)


@settings(max_examples=60)
@given(st.integers(0, 10_000))
def test_states_by_other_numbers_cost_the_same(seed: int) -> None:
    toy = random_toy(seed)
    rng = np.random.default_rng(seed)
    new = [rng.permutation(size) for size in toy.sizes]  # what was state new[lane][s] is s
    other = replace(
        toy,
        edges=tuple(table[np.ix_(p, p)] for table, p in zip(toy.edges, new, strict=True)),
        children=tuple(row[p] if len(row) else row for row, p in zip(toy.children, new, strict=True)),
        above=tuple(
            row[new[parent]] if parent >= 0 else row for row, parent in zip(toy.above, toy.parents, strict=True)
        ),
        discounts=tuple(
            table[np.ix_(new[parent], p)] if parent >= 0 else table
            for table, p, parent in zip(toy.discounts, new, toy.parents, strict=True)
        ),
        start=tuple(int(np.flatnonzero(p == s)[0]) for p, s in zip(new, toy.start, strict=True)),
        goal=tuple(int(np.flatnonzero(p == s)[0]) for p, s in zip(new, toy.goal, strict=True)),
    )
    allowed = [rng.random(size) > 0.2 for size in toy.sizes]
    via = [int(rng.integers(size)) for size in toy.sizes]
    renamed = [int(np.flatnonzero(p == s)[0]) for p, s in zip(new, via, strict=True)]
    mine = solve(
        toy.model()._replace(allowed=np.concatenate(allowed)), *toy.ends(), toy.rules(1, MOVES), [Via(np.array(via))]
    )
    theirs = solve(
        other.model()._replace(allowed=np.concatenate([a[p] for a, p in zip(allowed, new, strict=True)])),
        *other.ends(),
        other.rules(1, MOVES),
        [Via(np.array(renamed))],
    )
    assert (mine is None) == (theirs is None)
    if mine is not None and theirs is not None:
        assert mine.cost == pytest.approx(theirs.cost, abs=2 * PROVEN)


def test_what_was_asked_is_in_the_written_problem(tmp_path: Path) -> None:
    pytoulbar2 = pytest.importorskip("pytoulbar2", reason="toulbar2 is not installed: no outside solver")
    checked = 0
    for seed in range(60):
        toy = random_toy(seed, frustrated=seed % 2 == 0)
        rng = np.random.default_rng(seed)
        allowed = rng.random(sum(toy.sizes)) >= 0.15
        model = dearer(toy.model()._replace(allowed=allowed), [rng.integers(toy.sizes, size=(9, len(toy.sizes)))], 1.5)
        vias = [Via(rng.integers(toy.sizes)) for _ in range(seed % 3)]
        found = solve(model, *toy.ends(), toy.rules(2, MOVES), vias)
        if found is None:
            continue
        at = [Via(via.states, move) for via, move in zip(vias, found.passed, strict=True)]
        lanes = [f"lane{lane}" for lane in range(len(toy.sizes))]
        text = cfn(model, *toy.ends(), toy.rules(2, MOVES), len(found.path) - 1, lanes, at)
        (tmp_path / "problem.cfn").write_text(text)
        network = pytoulbar2.CFN(verbose=-1)
        network.Read(str(tmp_path / "problem.cfn"))
        assert network.Solve()[1] == pytest.approx(found.cost, abs=1e-4), seed
        assert len(json.loads(text)["variables"]) == found.path.size
        checked += 1
    assert checked > 20


# --- interruption -----------------------------------------------------------------------------------------------------


def test_an_interrupted_search_knows_a_path_and_a_bound_wherever_it_is_ended() -> None:
    statuses = set()
    for seed in range(40):
        toy = random_toy(seed, frustrated=True)
        vias = [Via(np.random.default_rng(seed).integers(toy.sizes))] * (seed % 2)
        expected = best(toy, range(1, MOVES + 1), np.ones(sum(toy.sizes), dtype=bool), vias)
        for calls in range(6):
            told: list[Progress] = []
            found = solve(
                toy.model(),
                *toy.ends(),
                toy.rules(1, MOVES),
                vias,
                lambda so_far, told=told, calls=calls: told.append(so_far) or len(told) > calls,  # type: ignore[misc]
            )
            assert (found is None) == (expected == np.inf)
            if found is None:
                continue
            assert found.lower_bound <= expected + 1e-9 <= found.cost + 2e-9
            assert toy.cost(found.path) == pytest.approx(found.cost, abs=1e-9)
            assert len(told) <= calls + 1
            assert all(a.cost >= b.cost and a.lower_bound <= b.lower_bound + 1e-9 for a, b in pairwise(told))
            statuses.add(found.status)
    assert statuses == {"optimal", "interrupted"}


# --- memory -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lanes", [1, 24, 45])
@pytest.mark.parametrize("memory", [10_000, 1_000_000, 33_554_432])
def test_nodes_take_no_more_memory_than_is_said(memory: int, lanes: int) -> None:
    parents = np.full(lanes, -1, np.int64)
    empty, none = np.zeros(0), np.zeros(0, np.int64)
    grid = Grid(lanes, 0, parents, none, none, empty, none, none, empty, none, none, none, empty)
    budget = astar.nodes_in(memory, lanes)
    held = sum(array.nbytes for array in astar._root.py_func(grid, 0.0, budget))
    forgetting = budget * (4 + 8 + 1)
    assert 0.8 * memory < held + forgetting <= memory + 100
