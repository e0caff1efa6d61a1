"""The written problem, ingredient by ingredient, against the search's own trellis, which knows their sums alone."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest
from toys import Toy, costs_by_function, random_toy, solution

from motionmind._typing import Floats
from motionmind.search.cfn import cfn
from motionmind.search.costs import edge_cost
from motionmind.search.problem import Problem, Via
from motionmind.search.trellis import Trellis, correction, segment_trellises

MOVES = 5
ROUNDING = 1e-5  # nats; each of the few functions of a scope is rounded to 1e-6
PARTS = ("moves", "allowed", "one", "other", "network", "guide")

Scope = tuple[str, ...]


class Written(NamedTuple):
    """A toy's problem in the number of moves of its best path, as it was given and as it is written."""

    toy: Toy
    problem: Problem
    path: np.ndarray
    chains: list[str]
    text: str

    @property
    def moves(self) -> int:
        return len(self.path) - 1

    @property
    def trellises(self) -> Iterator[tuple[int, Trellis]]:
        """The trellis of each segment, and the move at which it starts."""
        stops = [0, *(int(via.move or 0) for via in self.problem.vias), self.moves]
        return zip(stops, segment_trellises(self.problem, stops), strict=False)


def written(seeds: int) -> Iterator[Written]:
    """Toys with guides, some with vias and states that are not allowed."""
    for seed in range(seeds):
        toy, rng = random_toy(seed, frustrated=seed % 3 == 0), np.random.default_rng(seed)
        guides = [rng.uniform(-2.0, 3.0, (max(moves - 1, 0), sum(toy.sizes))) for moves in range(MOVES + 1)]
        vias = [Via(rng.integers(toy.sizes))] * (seed % 2)
        allowed = rng.random(sum(toy.sizes)) > 0.1
        problem = toy.problem(toy.rules(2, MOVES), vias, guides.__getitem__, allowed=allowed)
        found = solution(problem)
        if found is not None:
            vias = [Via(via.states, move) for via, move in zip(vias, found.passed, strict=True)]
            problem, chains = replace(problem, vias=vias), [f"chain_{chain}" for chain in range(len(toy.sizes))]
            text = cfn(problem, len(found.path) - 1, chains, toy.ingredients(problem))
            yield Written(toy, problem, found.path, chains, text)


def test_functions_add_up_to_the_costs_of_the_search() -> None:
    """For all values of all variables: states, edges and pairs of coupled states, forbidden ones included."""
    checked = 0
    for one in written(80):
        network = json.loads(one.text)
        top = float(network["problem"]["mustbe"].removeprefix("<"))
        found = tables(network)
        expected = {(): np.array(one.toy.per_move * one.moves)}
        for first, trellis in one.trellises:
            expected |= dict(scopes(trellis, first, one.chains))
        assert found.keys() <= expected.keys()
        for scope, table in expected.items():
            here = found.get(scope, np.zeros(table.shape))
            np.testing.assert_array_equal(here >= top, np.isinf(table), err_msg=str(scope))
            np.testing.assert_allclose(np.where(here >= top, np.inf, here), table, atol=ROUNDING, err_msg=str(scope))
        checked += len(expected)
    assert checked > 500


def tables(network: dict[str, Any]) -> dict[Scope, Floats]:
    """The sum of the functions of each scope, as a dense table."""
    out: dict[Scope, Floats] = {}
    for function in network["functions"].values():
        scope, costs = tuple(function["scope"]), function["costs"]
        shape = tuple(len(network["variables"][name]) for name in scope)
        table = np.full(shape, function.get("defaultcost", 0.0), dtype=np.float64)
        if len(scope) == 2:
            for a, b, cost in zip(costs[::3], costs[1::3], costs[2::3], strict=True):
                table[a, b] = cost
        else:
            table[...] = costs[0] if not scope else costs
        out[scope] = out.get(scope, np.zeros(shape)) + table
    return out


def scopes(trellis: Trellis, first: int, chains: list[str]) -> Iterator[tuple[Scope, Floats]]:
    """What states, edges and couplings of a segment cost after its first posture: one number each, as searched."""
    domains = [range(*span) for span in pairwise(trellis.dom_ptr)]
    names = [f"{chains[i % len(chains)]}_{first + i // len(chains)}" for i in range(len(domains))]
    for i in range(len(chains), len(domains)):
        yield (names[i],), trellis.unary[domains[i].start : domains[i].stop]
        before, chain = i - len(chains), i % len(chains)
        edges = [[edge_cost(trellis, p, x) for x in domains[i]] for p in domains[before]]
        yield (names[before], names[i]), np.array(edges)
        if trellis.parents[chain] >= 0:
            above = i - chain + int(trellis.parents[chain])
            rows = range(int(trellis.up_ptr[i]), int(trellis.up_ptr[i + 1]))
            yield (names[above], names[i]), np.array([[correction(trellis, u, x) for x in domains[i]] for u in rows])


def test_each_ingredient_adds_up_to_its_cost_along_a_path() -> None:
    kinds = 0
    for one in written(60):
        held, ingredients = one.problem.model_with_waits(), one.toy.ingredients(one.problem)
        guide = one.problem.timed_costs(one.moves)
        assert guide is not None
        paid = by_part(one)
        for t, (before, after) in enumerate(pairwise(one.path.tolist()), start=1):
            for chain, name in enumerate(one.chains):
                parent, cell = one.toy.parents[chain], f"{name}_{t}"
                together = one.toy.coupling(chain)[after[parent], after[chain]] if parent >= 0 else 0.0
                listed = slice(*held.indptr[held.starts[chain] + before[chain] :][:2])
                edge = listed.start + int(np.searchsorted(held.targets[listed], after[chain]))
                kind = ingredients.kinds[ingredients.kind[edge]]
                kinds |= 1 << int(ingredients.kind[edge])
                expected = {
                    "allowed": 0.0,
                    kind: one.toy.moves(chain)[before[chain], after[chain]],
                    "network": together,
                    "guide": guide[t, held.starts[chain] + after[chain]],
                }
                for part in PARTS[1:]:
                    assert paid[part, cell] == pytest.approx(expected.get(part, 0.0), abs=ROUNDING), (part, cell)
    assert kinds == 3


def by_part(one: Written) -> dict[tuple[str, str], float]:
    """What the path pays, by ingredient and the variable that is arrived in."""
    out: dict[tuple[str, str], float] = defaultdict(float)
    for name, cost in costs_by_function(one.text, one.path, one.chains).items():
        part, _, cell = name.partition("_")
        assert part in PARTS
        out[part, cell.removesuffix("_child").removesuffix("_parent")] += cost
    return out


def test_networks_and_guides_that_are_0_throughout_are_left_out() -> None:
    toy = random_toy(5)
    nothing = {name: tuple(map(np.zeros_like, getattr(toy, name))) for name in ("children", "above", "corrections")}
    for body, expected in ((toy, {"network"}), (replace(toy, **nothing), set())):
        problem = body.problem(body.rules(3, 3), guide=lambda moves: np.zeros((moves - 1, sum(toy.sizes))))
        functions = json.loads(cfn(problem, 3, toy_chains(body), body.ingredients(problem)))["functions"]
        assert {name.split("_")[0] for name in functions} - {"one", "other"} == {"moves", "allowed"} | expected


def toy_chains(toy: Toy) -> list[str]:
    return [f"chain{chain}" for chain in range(len(toy.sizes))]


def test_a_via_without_a_move_is_refused() -> None:
    toy = random_toy(0)
    problem = toy.problem(toy.rules(3, 3), [Via(np.array(toy.start))])
    with pytest.raises(ValueError, match="via 1 has no move"):
        cfn(problem, 3, toy_chains(toy), toy.ingredients(problem))
