"""Laws of the search, on toy bodies small enough to try every joint state (see toys.py)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from toys import Toy, evaluate, noisy_messages, random_toy, solution, trellis_of

from motionmind.search import astar, bounding, heuristic, pair_chains, parts, solve, trws
from motionmind.search.cfn import cfn
from motionmind.search.costs import path_cost
from motionmind.search.heuristic import Heuristic
from motionmind.search.pair_chain_tables import PairChains
from motionmind.search.polish import polish
from motionmind.search.problem import Model, Problem, Rules, costs_to_go, with_waits
from motionmind.search.segments import Piece, Segments
from motionmind.search.solve import Certificate
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS, SAME_COST_NATS
from motionmind.search.trellis import Trellis, locate
from motionmind.search.watcher import Watcher
from motionmind.tween.engine import Engine
from motionmind.tween.problem import build_model

MOVES = 6
PROVEN = 2 * OPTIMAL_WITHIN_NATS
ROUNDING = 1e-9
ON = np.zeros(1, dtype=bool)  # what would end A* before its time
KINDS = {
    "plain": {},
    "frustrated": {"frustrated": True},
    "even": {"even": True},
    "frustrated and even": {"frustrated": True, "even": True},
    "dear": {"dear": True},
    "frustrated and dear": {"frustrated": True, "dear": True},
}


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> dict[str, bool]:
    return KINDS[request.param]


def answer(toy: Toy, rules: Rules) -> Certificate | None:
    return solution(toy.problem(rules))


def a_body(**changes: Any) -> Toy:
    """Two coupled chains of two states, every move attested at 1 nat, all couplings at 0."""
    toy = Toy(
        parents=(-1, 0),
        edges=(np.ones((2, 2)), np.ones((2, 2))),
        children=(np.zeros(2), np.zeros(2)),
        above=(np.zeros(0), np.zeros(2)),
        corrections=(np.zeros((0, 2)), np.zeros((2, 2))),
        start=(0, 0),
        goal=(1, 1),
        wait=1.0,
        per_move=0.5,
    )
    return replace(toy, **changes)


# --- the answer ------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_the_cost_at_every_number_of_moves_is_that_of_brute_force(kind: dict[str, bool]) -> None:
    for seed in range(120):
        toy = random_toy(seed, **kind)
        optima = toy.optima(MOVES)
        for moves in range(MOVES + 1):
            found = answer(toy, toy.rules(moves, moves))
            if found is None:
                assert optima[moves] == np.inf, (seed, moves)
            else:
                assert found.status == "optimal", (seed, moves)
                assert found.cost == pytest.approx(optima[moves], abs=PROVEN), (seed, moves)


def test_the_cost_over_all_numbers_of_moves_is_the_least_of_them(kind: dict[str, bool]) -> None:
    for seed in range(200):
        toy = random_toy(seed, **kind)
        least = toy.optima(MOVES)[1:].min()
        found = answer(toy, toy.rules(1, MOVES))
        if found is None:
            assert least == np.inf, seed
        else:
            assert found.status == "optimal", seed
            assert found.cost == pytest.approx(least, abs=PROVEN), seed


@pytest.mark.long
def test_a_path_keeps_the_rules_and_costs_what_is_stated(kind: dict[str, bool]) -> None:
    for seed in range(100):
        toy = random_toy(seed, **kind)
        for node_budget in (1, 20, 100_000):
            found = answer(toy, toy.rules(1, MOVES, node_budget))
            if found is not None:
                assert toy.cost(found.path) == pytest.approx(found.cost, abs=ROUNDING), (seed, node_budget)


@pytest.mark.long
@pytest.mark.parametrize("pairs", [0, bounding.MAX_STATE_PAIRS])
@pytest.mark.parametrize("sweeps", [1, 2])
def test_bound_optimum_and_cost_stand_in_this_order_whatever_effort_is_allowed(
    monkeypatch: pytest.MonkeyPatch, sweeps: int, pairs: int
) -> None:
    monkeypatch.setattr(bounding, "MAX_STATE_PAIRS", pairs)
    monkeypatch.setattr(bounding, "MAX_PAIR_CHAIN_SWEEPS", 0)
    monkeypatch.setattr(bounding, "N_SWEEPS_PER_ROUND", sweeps)
    searched = bounded = 0
    for seed in range(60):
        toy = random_toy(seed, frustrated=True)
        optima = toy.optima(MOVES)
        for moves in np.flatnonzero(np.isfinite(optima)):
            for node_budget in (1, 2, 5, 20, 100, 100_000):
                found = answer(toy, toy.rules(moves, moves, node_budget, sweeps))
                assert found is not None
                assert found.lower_bound <= optima[moves] + ROUNDING, (seed, moves, node_budget)
                assert found.cost >= optima[moves] - ROUNDING, (seed, moves, node_budget)
                assert toy.cost(found.path) == pytest.approx(found.cost, abs=ROUNDING), (seed, moves, node_budget)
                assert found.lower_bound <= found.cost
                assert (found.status == "optimal") == (found.cost - found.lower_bound <= OPTIMAL_WITHIN_NATS)
                assert found.peak_nodes <= node_budget
                assert min(moves, 1) <= found.expansions <= node_budget
                searched += found.expansions > moves * len(toy.sizes)
                bounded += found.status == "bounded"
    assert searched > 0
    assert bounded > 0


@pytest.mark.parametrize("pairs", [0, bounding.MAX_STATE_PAIRS])
def test_the_answer_is_the_path_of_a_star_and_costs_no_more_than_the_incumbent(
    monkeypatch: pytest.MonkeyPatch, kind: dict[str, bool], pairs: int
) -> None:
    """Where it had room to walk from the start to the goal, of all parts together."""
    monkeypatch.setattr(bounding, "MAX_STATE_PAIRS", pairs)
    walked: list[np.ndarray] = []
    search = astar.search

    def listening(trellis: Trellis, heuristic: Heuristic, cost: float, slack: float, path: Any, *rest: Any) -> Any:
        found = search(trellis, heuristic, cost, slack, path, *rest)
        if found[0] < cost:
            walked.append(trellis.dom[path].reshape(-1, trellis.chains))
        return found

    monkeypatch.setattr(astar, "search", listening)
    for seed in range(60):
        toy = random_toy(seed, **kind)
        walked.clear()
        found = answer(toy, toy.rules(1, MOVES))
        if found is None:
            assert not walked
        else:
            assert found.expansions >= 1
            mine = [path for path in walked if len(path) == len(found.path)]
            for chain in range(len(toy.sizes)):  # parts are put together chain by chain
                assert any((path[:, chain] == found.path[:, chain]).all() for path in mine), (seed, chain)
            if len(walked) == 1:
                np.testing.assert_array_equal(walked[0], found.path)


def test_where_the_bound_is_tight_the_search_walks_straight_to_the_goal() -> None:
    straight = 0
    for seed in range(100):
        toy = random_toy(seed)
        found = answer(toy, toy.rules(1, MOVES))
        if found is not None:
            straight += found.expansions == (len(found.path) - 1) * len(toy.sizes)
    assert straight > 50


def test_many_paths_of_equal_cost_do_not_slow_the_search() -> None:
    """Chains of bundled ballet that nothing couples, all attested moves alike, in more moves than they need."""
    engine = Engine.load("ballet")
    model, rng = build_model(engine.grammar, "conditional", 0.0, 1.0, novelty=1.0), np.random.default_rng(0)
    for _ in range(10):
        start, goal = engine.states[rng.integers(len(engine.states), size=2)].astype(np.int64)
        found = solve.solve(Problem(model, start, goal, Rules(1.0, 1.0, 12, 12, 200_000)))
        assert found.status == "optimal"
        assert found.expansions == 12 * len(start)


# --- what proves it --------------------------------------------------------------------------------------------------


def test_every_pair_of_sweeps_raises_the_bound_and_none_lifts_it_over_the_optimum(kind: dict[str, bool]) -> None:
    for seed in range(100):
        toy = random_toy(seed, **kind)
        optimum = toy.optima(MOVES)[MOVES] - MOVES * toy.per_move
        if optimum < np.inf:
            trellis = trellis_of(toy, MOVES)
            messages, path = trws.no_messages(trellis), np.zeros((MOVES + 1) * trellis.chains, np.int64)
            proven = [trws.tighten(trellis, messages, path, 1, np.inf)[0] for _ in range(8)]
            assert all(before <= after + ROUNDING for before, after in pairwise(proven)), seed
            assert proven[-1] <= optimum + ROUNDING, seed


def test_independent_costs_bound_the_optimum(kind: dict[str, bool]) -> None:
    for seed in range(100):
        toy = random_toy(seed, **kind)
        start, goal = toy.ends()
        held = with_waits(toy.model, goal, toy.wait)
        alone = costs_to_go(held, goal, MOVES)[:, held.starts[:-1] + start].sum(axis=1)
        assert np.all(alone + toy.per_move * np.arange(MOVES + 1) <= toy.optima(MOVES) + ROUNDING), seed


def test_independent_costs_are_the_optimum_without_couplings() -> None:
    for seed in range(100):
        toy = random_toy(seed)
        free = replace(toy, parents=(-1,) * len(toy.sizes))
        start, goal = free.ends()
        held = with_waits(free.model, goal, free.wait)
        alone = costs_to_go(held, goal, MOVES)[:, held.starts[:-1] + start].sum(axis=1)
        np.testing.assert_allclose(alone + free.per_move * np.arange(MOVES + 1), free.optima(MOVES), atol=ROUNDING)


def test_the_best_path_stays_in_what_is_left_of_its_trellis(kind: dict[str, bool]) -> None:
    pruned = 0
    for trellis, optimum, seed in bodies(60, kind):
        state = bounding.Bounded(trellis, Heuristic.of_messages(trws.no_messages(trellis)), np.inf)
        bounding.tighten(state, 20, Watcher(None))
        chosen = locate(state.trellis, state.states)
        assert (chosen >= 0).all(), seed
        assert path_cost(state.trellis, chosen) == pytest.approx(state.cost, abs=ROUNDING), seed
        assert state.lower_bound <= optimum + ROUNDING <= state.cost + 2 * ROUNDING, seed
        pruned += len(state.trellis.dom) < len(trellis.dom)
    assert pruned > 20


@pytest.mark.parametrize(("sweeps", "ends"), [(20, True), (1, False), (bounding.N_FIRST_SWEEPS, False), (20, False)])
def test_no_single_chain_or_move_improves_a_bounded_path(kind: dict[str, bool], sweeps: int, ends: bool) -> None:
    """That of the first round, too, which is polished only if it is the last."""
    for (trellis, _, seed), (own, _, _) in zip(bodies(60, kind), bodies(60, kind), strict=True):
        state = bounding.Bounded(own, Heuristic.of_messages(trws.no_messages(own)), np.inf)
        bounding.tighten(state, sweeps, Watcher(lambda: ends))
        path = locate(trellis, state.states)
        assert polish(trellis, path, np.full(len(trellis.dom), -np.inf)) >= state.cost - ROUNDING, seed


@pytest.mark.parametrize("sweeps", [1, 5])
def test_under_messages_alone_the_search_finds_the_optimum_too(sweeps: int, kind: dict[str, bool]) -> None:
    for trellis, optimum, seed in bodies(60, kind):
        messages, path = trws.no_messages(trellis), np.zeros((MOVES + 1) * trellis.chains, np.int64)
        trws.tighten(trellis, messages, path, sweeps, np.inf)
        heuristic = Heuristic.of_messages(messages)
        found = astar.search(trellis, heuristic, np.inf, SAME_COST_NATS, path, 50_000, 50_000, ON)
        assert found.cost == pytest.approx(optimum, abs=PROVEN), seed
        assert found.lower_bound == pytest.approx(optimum, abs=PROVEN), seed
        assert path_cost(trellis, path) == pytest.approx(optimum, abs=PROVEN), seed


@pytest.mark.parametrize("noise", [None, 0.5, 5.0])
def test_f_never_overestimates_along_an_optimal_path_whatever_the_forward_messages_were(noise: float | None) -> None:
    for seed in range(60):
        toy = random_toy(seed, frustrated=True)
        found = answer(toy, toy.rules(MOVES, MOVES))
        if found is None:
            continue
        trellis = trellis_of(toy, MOVES)
        messages = trws.no_messages(trellis) if noise is None else noisy_messages(trellis, seed, noise)
        if noise is None:
            trws.tighten(trellis, messages, np.zeros((MOVES + 1) * trellis.chains, np.int64), 3, np.inf)
            f = float(messages.constants.sum())
        else:
            f = trws.backward(trellis, messages)
        optimum = found.cost - MOVES * toy.per_move
        path = positions(trellis, found.path)
        for i in range(trellis.chains, len(path)):
            edge = edge_between(trellis, path[i - trellis.chains], path[i])
            parent = trellis.parents[i % trellis.chains]
            above = path[i - i % trellis.chains + parent] if parent >= 0 else -1
            grown = trws.step(trellis, messages, i, path[i - trellis.chains], above, edge)
            assert grown >= -ROUNDING
            f += grown
            assert f <= optimum + PROVEN, (seed, i)
        assert f == pytest.approx(optimum, abs=ROUNDING)


def test_two_chains_are_one_pair_chain_and_its_bound_is_their_optimum(kind: dict[str, bool]) -> None:
    for seed in range(100):
        toy = random_toy(seed, most=2, **kind)
        optimum = toy.optima(MOVES)[MOVES] - MOVES * toy.per_move
        if len(toy.sizes) == 2 and optimum < np.inf:
            trellis = trellis_of(toy, MOVES)
            tables, path = (
                pair_chains.build(trellis, noisy_messages(trellis, seed, 5.0)),
                np.zeros((MOVES + 1) * 2, np.int64),
            )
            assert pair_chains.lower_bound(tables) == pytest.approx(optimum, abs=ROUNDING), seed
            heuristic.descend(trellis, Heuristic.of_pair_chains(tables), path)
            assert path_cost(trellis, path) == pytest.approx(optimum, abs=ROUNDING), seed


def test_every_sweep_of_pair_chains_raises_the_bound_and_none_lifts_it_over_the_optimum(kind: dict[str, bool]) -> None:
    tighter = 0
    for trellis, optimum, seed in bodies(100, kind):
        messages, path = trws.no_messages(trellis), np.zeros((MOVES + 1) * trellis.chains, np.int64)
        by_messages = trws.tighten(trellis, messages, path, 50, np.inf)[0]
        tables, through = pair_chains.build(trellis, messages), np.zeros(len(trellis.dom))
        proven = [pair_chains.lower_bound(tables), *(pair_chains.sweep(trellis, tables, through) for _ in range(8))]
        assert all(before <= after + ROUNDING for before, after in pairwise(proven)), seed
        assert proven[-1] <= optimum + ROUNDING, seed
        assert proven[-1] == pytest.approx(pair_chains.lower_bound(tables), abs=ROUNDING), seed
        tighter += proven[-1] > by_messages + 1e-3
    assert tighter > 3 or not kind.get("frustrated")


def test_shares_move_between_pair_chains_but_add_up_to_what_a_path_costs(kind: dict[str, bool]) -> None:
    for trellis, _, seed in bodies(60, kind):
        tables, through = pair_chains.build(trellis, noisy_messages(trellis, seed, 2.0)), np.zeros(len(trellis.dom))
        for draw in range(3):
            path = some_path(trellis, seed + draw)
            assert shares(trellis, tables, path) == pytest.approx(path_cost(trellis, path), abs=ROUNDING), (seed, draw)
            pair_chains.sweep(trellis, tables, through)


@pytest.mark.parametrize("sweeps", [0, 1, 3])
def test_by_pair_chains_f_grows_along_every_path_from_the_bound_to_its_cost(sweeps: int) -> None:
    for trellis, _, seed in bodies(60, {"frustrated": True}):
        tables, through = pair_chains.build(trellis, noisy_messages(trellis, seed, 5.0)), np.zeros(len(trellis.dom))
        for _ in range(sweeps):
            pair_chains.sweep(trellis, tables, through)
        path = some_path(trellis, seed)
        f, frontier = pair_chains.lower_bound(tables), np.zeros(trellis.chains, np.uint16)
        for i in range(trellis.chains, len(path)):
            grown = pair_chains.step(
                trellis, tables, i, frontier, edge_between(trellis, path[i - trellis.chains], path[i])
            )
            assert grown >= -ROUNDING, (seed, i)
            f += grown
            frontier[i % trellis.chains] = path[i] - trellis.dom_ptr[i]
        assert f == pytest.approx(path_cost(trellis, path), abs=ROUNDING), seed


def test_pair_chains_bound_the_paths_through_each_position(kind: dict[str, bool]) -> None:
    moves = 4
    for seed in range(60):
        toy = random_toy(seed, **kind)
        if len(toy.sizes) == 1 or not np.isfinite(toy.optima(moves)[moves]):
            continue
        trellis, joint = trellis_of(toy, moves), toy.joint_states()
        tables, through = pair_chains.build(trellis, noisy_messages(trellis, seed, 2.0)), np.zeros(len(trellis.dom))
        cheapest = toy.so_far(moves) + toy.to_go(moves)[::-1]
        for _ in range(3):
            pair_chains.sweep(trellis, tables, through)
            for i, (first, last) in enumerate(pairwise(trellis.dom_ptr)):
                for p in range(first, last):
                    here = cheapest[i // trellis.chains, joint[:, i % trellis.chains] == trellis.dom[p]].min()
                    assert through[p] <= here + ROUNDING, (seed, i)


@pytest.mark.parametrize("spare", [1e-6, 0.1, 1.0])
def test_pruned_pair_chains_keep_cheaper_paths_and_the_bound(spare: float) -> None:
    taken_out = 0
    for whole, optimum, seed in bodies(100, {"frustrated": True}):
        trellis, tables = whole, pair_chains.build(whole, trws.no_messages(whole))
        for _ in range(3):
            through = np.zeros(len(trellis.dom))
            proven = pair_chains.sweep(trellis, tables, through)
            smaller, tables = pair_chains.prune(trellis, tables, through, optimum + spare)
            assert pair_chains.lower_bound(tables) >= proven - ROUNDING, seed
            taken_out += len(trellis.dom) - len(smaller.dom)
            trellis = smaller
        path = some_path(trellis, seed)
        assert shares(trellis, tables, path) == pytest.approx(path_cost(trellis, path), abs=ROUNDING), seed
        heuristic = Heuristic.of_pair_chains(tables)
        found = astar.search(trellis, heuristic, np.inf, SAME_COST_NATS, path, 50_000, 50_000, ON)
        assert found.cost == pytest.approx(optimum, abs=PROVEN), seed
        assert found.lower_bound == pytest.approx(optimum, abs=PROVEN), seed
    assert taken_out > 0


def test_pair_chains_are_left_empty_where_nothing_is_cheap_enough() -> None:
    for trellis, optimum, _ in bodies(20, {"frustrated": True}):
        tables, through = pair_chains.build(trellis, trws.no_messages(trellis)), np.zeros(len(trellis.dom))
        proven = pair_chains.sweep(trellis, tables, through)
        assert proven <= optimum + ROUNDING
        smaller, _ = pair_chains.prune(trellis, tables, through, proven - 1.0)
        assert len(smaller.dom) == 0


def test_messages_bound_the_paths_through_each_position(kind: dict[str, bool]) -> None:
    moves = 4
    for seed in range(60):
        toy = random_toy(seed, **kind)
        if not np.isfinite(toy.optima(moves)[moves]):
            continue
        trellis, joint = trellis_of(toy, moves), toy.joint_states()
        messages = trws.no_messages(trellis)
        cheapest = toy.so_far(moves) + toy.to_go(moves)[::-1]
        for sweeps in (1, 3):
            trws.tighten(trellis, messages, np.zeros((moves + 1) * trellis.chains, np.int64), sweeps, np.inf)
            for i, (first, last) in enumerate(pairwise(trellis.dom_ptr)):
                for p in range(first, last):
                    here = cheapest[i // trellis.chains, joint[:, i % trellis.chains] == trellis.dom[p]].min()
                    assert messages.through[p] <= here + ROUNDING, (seed, i)


@pytest.mark.parametrize("spare", [1e-6, 0.1, 1.0])
def test_a_pruned_trellis_keeps_cheaper_paths(spare: float) -> None:
    taken_out = 0
    for seed in range(100):
        toy = random_toy(seed, frustrated=True)
        optimum = toy.optima(MOVES)[MOVES] - MOVES * toy.per_move
        if optimum == np.inf:
            continue
        trellis = trellis_of(toy, MOVES)
        messages, path = trws.no_messages(trellis), np.zeros((MOVES + 1) * trellis.chains, np.int64)
        for _ in range(3):
            trws.tighten(trellis, messages, path, 1, np.inf)
            smaller, messages = trws.prune(trellis, messages, optimum + spare, True)
            taken_out += len(trellis.dom) - len(smaller.dom)
            trellis = smaller
        if trellis.chains == 1:
            continue
        tables = pair_chains.build(trellis, messages)
        heuristic = Heuristic.of_pair_chains(tables)
        found = astar.search(trellis, heuristic, np.inf, SAME_COST_NATS, path, 50_000, 50_000, ON)
        assert found.cost == pytest.approx(optimum, abs=PROVEN), seed
        assert found.lower_bound == pytest.approx(optimum, abs=PROVEN), seed
    assert taken_out > 0


def test_polishing_never_raises_the_cost_that_it_returns(kind: dict[str, bool]) -> None:
    better = 0
    for seed in range(100):
        toy = random_toy(seed, **kind)
        optimum = toy.optima(MOVES)[MOVES] - MOVES * toy.per_move
        if optimum == np.inf:
            continue
        trellis = trellis_of(toy, MOVES)
        messages, path = noisy_messages(trellis, seed, 5.0), np.zeros((MOVES + 1) * trellis.chains, np.int64)
        path[: trellis.chains] = trellis.dom_ptr[: trellis.chains]
        before = trws.backward(trellis, messages) + trws.descend(trellis, messages, path, trellis.chains)
        assert before == pytest.approx(path_cost(trellis, path), abs=ROUNDING), seed
        after = polish(trellis, path, messages.through)
        states = trellis.dom[path].reshape(MOVES + 1, trellis.chains)
        assert after == pytest.approx(toy.cost(states) - MOVES * toy.per_move, abs=ROUNDING), seed
        assert optimum - ROUNDING <= after <= before + ROUNDING, seed
        better += after < before - ROUNDING
    assert better > 0


def test_polishing_skips_only_useless_positions(kind: dict[str, bool]) -> None:
    passed_over = 0
    for seed in range(100):
        toy = random_toy(seed, **kind)
        if toy.optima(MOVES)[MOVES] == np.inf:
            continue
        trellis = trellis_of(toy, MOVES)
        messages, path = trws.no_messages(trellis), np.zeros((MOVES + 1) * trellis.chains, np.int64)
        trws.tighten(trellis, messages, path, 2, np.inf)
        other, everywhere = path.copy(), np.full(len(trellis.dom), -np.inf)
        passed_over += int(np.sum(messages.through > path_cost(trellis, path) + ROUNDING))
        assert polish(trellis, path, messages.through) == polish(trellis, other, everywhere), seed
        assert (path == other).all(), seed
    assert passed_over > 0


def test_parts_that_nothing_couples_cost_less_effort_each_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    def one_part(trellis: Trellis) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(trellis.chains, np.int64), np.ones(trellis.chains, dtype=bool)

    monkeypatch.setattr(bounding, "MAX_PAIR_CHAIN_SWEEPS", 0)
    expansions = {"apart": 0, "at once": 0}
    for seed in range(60):
        toy = random_toy(seed, most=3, frustrated=True)
        one, four = answer(toy, toy.rules(MOVES, MOVES)), side_by_side(toy, 4)
        if one is None or len(toy.sizes) == 1:
            continue
        for how, part in (("apart", parts._parts), ("at once", one_part)):
            with monkeypatch.context() as patch:
                patch.setattr(parts, "_parts", part)
                found = answer(four, four.rules(MOVES, MOVES, sweeps=1))
            assert found is not None
            assert found.status == "optimal", seed
            assert found.cost == pytest.approx(4 * one.cost - 3 * MOVES * toy.per_move, abs=2 * PROVEN), seed
            assert found.cost == pytest.approx(four.cost(found.path), abs=ROUNDING), seed
            expansions[how] += found.expansions
    assert 0 < expansions["apart"] < 0.3 * expansions["at once"]


def test_a_chain_with_one_state_parts_those_below_it_from_those_above() -> None:
    toy = Toy(
        parents=(-1, 0, 1, 1),
        edges=tuple(np.ones((size, size)) for size in (2, 1, 2, 2)),
        children=tuple(map(np.zeros, (2, 1, 2, 2))),
        above=tuple(map(np.zeros, (0, 2, 1, 1))),
        corrections=tuple(map(np.zeros, ((0, 2), (2, 1), (1, 2), (1, 2)))),
        start=(0, 0, 0, 0),
        goal=(1, 0, 1, 1),
        wait=1.0,
        per_move=0.5,
    )
    part, free = parts._parts(trellis_of(toy, 3))
    assert part.tolist() == [0, 1, 2, 3]
    assert free.tolist() == [True, False, True, True]
    part, _ = parts._parts(trellis_of(replace(toy, parents=(-1, 0, 0, 2), **coupled(toy)), 3))
    assert part.tolist() == [0, 1, 0, 0]


# --- edges of the problem --------------------------------------------------------------------------------------------


def test_a_limit_just_above_the_optimum_keeps_the_best_path(kind: dict[str, bool]) -> None:
    kept = 0
    for seed in range(30):
        toy = random_toy(seed, **kind)
        found = answer(toy, toy.rules(MOVES, MOVES))
        if found is not None:
            trellis = trellis_of(toy, MOVES, found.cost - MOVES * toy.per_move + 1e-6)
            assert locate(trellis, found.path).min() >= 0
            kept += len(trellis.dom) < len(trellis_of(toy, MOVES).dom)
    assert kept > 3


def test_bounds_never_exceed_the_limit() -> None:
    """Dearer ones were cut off, and what is proven of the rest does not hold of them."""
    trellis = trellis_of(a_body(), MOVES)
    chosen = np.zeros(len(trellis.dom_ptr) - 1, dtype=np.int64)
    trws.tighten(trellis, trws.no_messages(trellis), chosen, 2, np.inf)
    state = bounding.Bounded(trellis, Heuristic.of_messages(trws.no_messages(trellis)), -100.0)
    state.update(1e3, chosen, np.full(len(trellis.dom), -np.inf))
    assert (state.lower_bound, state.found, state.closed) == (-100.0, False, True)


def test_bounds_of_pieces_never_fall() -> None:
    segments, none = Segments(np.array([[[np.inf, 1.0, 7.0]]]), 1, []), np.zeros((0, 2), dtype=np.int32)
    for bound, proven in ((5.0, 5.0), (3.0, 5.0), (9.0, 7.0)):
        segments.update(Piece(0, 0, 1), bound, np.inf, none)
        assert segments.lower_bound() == proven


def test_without_any_edge_a_body_can_only_wait_where_it_is() -> None:
    nowhere = (np.full((2, 2), np.inf),) * 2
    assert answer(a_body(edges=nowhere), Rules(1.0, 0.5, 1, 5, 100)) is None
    staying = answer(a_body(edges=nowhere, goal=(0, 0)), Rules(1.0, 0.5, 1, 5, 100))
    assert staying is not None
    assert staying.path.tolist() == [[0, 0], [0, 0]]
    assert staying.cost == pytest.approx(2.5)


def test_one_chain_of_one_state_is_a_body() -> None:
    still = Toy((-1,), (np.zeros((1, 1)),), (np.zeros(1),), (np.zeros(0),), (np.zeros((0, 1)),), (0,), (0,), 1.0, 1.0)
    found = answer(still, still.rules(3, 5))
    assert found is not None
    assert found.path.tolist() == [[0]] * 4
    assert found.cost == pytest.approx(3.0)


def test_no_moves_at_all_lead_from_a_posture_to_itself_and_nowhere_else() -> None:
    there = answer(a_body(goal=(0, 0)), Rules(1.0, 0.5, 0, 0, 100))
    assert there is not None
    assert there.path.tolist() == [[0, 0]]
    assert there.cost == there.lower_bound == 0.0
    assert answer(a_body(), Rules(1.0, 0.5, 0, 0, 100)) is None


def test_no_path_is_found_where_the_least_number_of_moves_exceeds_the_greatest() -> None:
    assert answer(a_body(), Rules(1.0, 0.5, 4, 3, 100)) is None


def test_a_chain_waits_at_its_goal_for_beta_or_holds_there_if_that_is_cheaper() -> None:
    dear, cheap = np.array([[9.0, 1.0], [1.0, 9.0]]), np.array([[9.0, 1.0], [1.0, 0.25]])
    for edges, held in ((dear, 2.0), (cheap, 0.25)):
        found = answer(a_body(edges=(edges, edges)), Rules(2.0, 0.0, 2, 2, 100))
        assert found is not None
        assert found.cost == pytest.approx(2 * (1.0 + held))


def test_a_body_without_a_tree_is_as_many_bodies_as_chains() -> None:
    for seed in range(50):
        toy = random_toy(seed)
        free = replace(toy, parents=(-1,) * len(toy.sizes))
        found = answer(free, free.rules(MOVES, MOVES))
        optimum = free.optima(MOVES)[MOVES]
        assert (found.cost if found else np.inf) == pytest.approx(optimum, abs=PROVEN), seed
        assert found is None or found.expansions == MOVES * len(toy.sizes)


@pytest.mark.parametrize("scale", [1e3, 1e6, 1e10, 1e13])
def test_costs_so_great_that_rounding_exceeds_every_tolerance_break_nothing(scale: float) -> None:
    for seed in range(80):
        toy = random_toy(seed, frustrated=seed % 2 == 0).scaled(scale)
        least = toy.optima(MOVES)[1:].min()
        found = answer(toy, toy.rules(1, MOVES))
        if found is None:
            assert least == np.inf, seed
        else:
            assert found.cost == pytest.approx(least, rel=1e-9), seed
            assert found.cost == pytest.approx(toy.cost(found.path), rel=1e-9), seed
            assert found.lower_bound <= least + 1e-9 * abs(least), seed


def test_more_states_than_a_node_can_number_are_refused() -> None:
    states = 70_000
    every = np.arange(states)
    model = Model(
        starts=np.array([0, states]),
        parents=np.array([-1]),
        indptr=np.arange(states + 1),
        targets=((every + 1) % states).astype(np.int32),
        costs=np.ones(states),
        unary=np.zeros(states),
        alone=np.zeros(states),
        pair_starts=np.zeros(2, np.int64),
        pair_ptr=np.zeros(1, np.int64),
        pair_states=np.zeros(0, np.int32),
        pair_costs=np.zeros(0),
        allowed=np.ones(states, dtype=bool),
        place=every.astype(np.int32),
    )
    with pytest.raises(ValueError, match="70000"):
        solve.solve(Problem(model, np.array([0]), np.array([2]), Rules(1.0, 1.0, 1, 3, 100)))


# --- the problem written out -----------------------------------------------------------------------------------------


def test_a_path_costs_in_the_written_problem_what_its_certificate_states() -> None:
    for seed in range(60):
        toy = random_toy(seed)
        found = answer(toy, toy.rules(1, MOVES))
        if found is None:
            continue
        moves, chains = len(found.path) - 1, [f"chain{chain}" for chain in range(len(toy.sizes))]
        problem = toy.problem(toy.rules(1, MOVES))
        text = cfn(problem, moves, chains, toy.ingredients(problem))
        assert evaluate(text, found.path, chains) == pytest.approx(found.cost, abs=1e-4), seed


def test_the_written_problem_forbids_what_the_model_forbids() -> None:
    toy = a_body(edges=(np.array([[1.0, 1.0], [np.inf, np.inf]]), np.ones((2, 2))))
    problem = toy.problem(toy.rules(3, 3))
    text = cfn(problem, 3, ["a", "b"], toy.ingredients(problem))
    top = float(json.loads(text)["problem"]["mustbe"].removeprefix("<"))
    legal, illegal = [[0, 0], [0, 0], [0, 0], [1, 1]], [[0, 0], [1, 0], [0, 0], [1, 1]]
    assert evaluate(text, np.array(legal), ["a", "b"]) < top
    assert evaluate(text, np.array(illegal), ["a", "b"]) >= top


# --- helpers ---------------------------------------------------------------------------------------------------------


def side_by_side(toy: Toy, count: int) -> Toy:
    """So many of a body side by side, as one."""
    parents = tuple(parent + k * len(toy.sizes) if parent >= 0 else -1 for k in range(count) for parent in toy.parents)
    names = ("edges", "children", "above", "corrections", "start", "goal")
    return replace(toy, parents=parents, **{name: getattr(toy, name) * count for name in names})


def coupled(toy: Toy) -> dict[str, tuple[np.ndarray, ...]]:
    """Tables of couplings of two states each, for the last two chains."""
    return {
        "above": (*toy.above[:2], np.zeros(2), np.zeros(2)),
        "corrections": (*toy.corrections[:2], np.zeros((2, 2)), np.zeros((2, 2))),
    }


def bodies(seeds: int, kind: dict[str, bool]) -> Iterator[tuple[Trellis, float, int]]:
    """Grids of MOVES moves of toys with at least two chains, and their optima without tau."""
    for seed in range(seeds):
        toy = random_toy(seed, **kind)
        optimum = float(toy.optima(MOVES)[MOVES] - MOVES * toy.per_move)
        if len(toy.sizes) > 1 and optimum < np.inf:
            yield trellis_of(toy, MOVES), optimum, seed


def some_path(trellis: Trellis, seed: int) -> np.ndarray:
    """A path of positions [n], each edge drawn at random."""
    rng, path = np.random.default_rng(seed), np.zeros(len(trellis.dom_ptr) - 1, np.int64)
    path[: trellis.chains] = trellis.dom_ptr[: trellis.chains]
    for i in range(trellis.chains, len(path)):
        before = path[i - trellis.chains]
        path[i] = rng.choice(trellis.row_to[trellis.row_ptr[before] : trellis.row_ptr[before + 1]])
    return path


def shares(trellis: Trellis, tables: PairChains, path: np.ndarray) -> float:
    """What the pair chains cost on a path [n], each by its own shares."""
    total = 0.0
    for i, p in enumerate(path):
        chain = i % trellis.chains
        if chain == 0:
            continue
        a = i - chain + tables.partner[chain]
        size = trellis.dom_ptr[i + 1] - trellis.dom_ptr[i]
        total += tables.pair_cost[tables.pair_ptr[i] + (path[a] - trellis.dom_ptr[a]) * size + p - trellis.dom_ptr[i]]
        if i + trellis.chains < len(path):
            total += tables.edge_share[edge_between(trellis, p, path[i + trellis.chains])]
            e = edge_between(trellis, path[a], path[a + trellis.chains])
            total += tables.partner_share[tables.partner_ptr[i] + e - trellis.row_ptr[trellis.dom_ptr[a]]]
    return float(total)


def positions(trellis: object, states: np.ndarray) -> np.ndarray:
    """Positions [n] of a path of states [T + 1, L]."""
    return np.array(
        [
            first + np.flatnonzero(trellis.dom[first:last] == state)[0]
            for (first, last), state in zip(pairwise(trellis.dom_ptr), states.ravel(), strict=True)
        ]
    )


def edge_between(trellis: object, before: int, after: int) -> int:
    row = range(trellis.row_ptr[before], trellis.row_ptr[before + 1])
    return next(e for e in row if trellis.row_to[e] == after)
