"""Coordination of moves: its tables against pgmpy's, and what is found by it against brute force and toulbar2."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st
from toys import evaluate, solution

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.bundled import bundled
from motionmind.errors import MotionMindError
from motionmind.formats import read_posture
from motionmind.grammar.coordination import PRIOR_WEIGHT, Coordination
from motionmind.grammar.progression import fit_progression
from motionmind.search.cfn import Ingredients, cfn
from motionmind.search.problem import Model, Problem, Rules, Via, costs_to_go, places, with_waits
from motionmind.search.sample import gibbs_sample, sample_path
from motionmind.search.solve import solve
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.search.trellis import build_trellis
from motionmind.tween.ends import bring_ends
from motionmind.tween.engine import Engine
from motionmind.tween.formulate import formulate
from motionmind.tween.problem import lift_to_moves
from motionmind.tween.request import TweenRequest
from motionmind.tween.result import Tween

ALIKE = 2 * OPTIMAL_WITHIN_NATS
MOVES = 4
POSTURES = bundled("corpora") / "ballet" / "postures"


@dataclass(frozen=True, eq=False)
class Body:
    """A corpus of states in one clip, and dense tables of what its chains' moves cost, bridges among them.

    Attributes:
        parents: parent chain [L], or -1.
        states: of N postures [N, L].
        weights: what each move counts [N - 1].
        edges: cost of a move of each chain, infinite where there is none, L arrays of [S, S].
    """

    parents: Ints
    states: Int32s
    weights: Floats
    edges: tuple[Floats, ...]

    @property
    def sizes(self) -> tuple[int, ...]:
        return tuple(map(len, self.edges))

    def model(self) -> Model:
        """What the search reads, coupled by nothing."""
        starts = np.concatenate([[0], np.cumsum(self.sizes)]).astype(np.int64)
        rows = [row for table in self.edges for row in table]
        listed = [np.flatnonzero(np.isfinite(row)) for row in rows]
        nothing = np.zeros(starts[-1])
        return Model(
            starts=starts,
            parents=self.parents,
            indptr=np.concatenate([[0], np.cumsum([len(targets) for targets in listed])]).astype(np.int64),
            targets=np.concatenate(listed).astype(np.int32),
            costs=np.concatenate([row[targets] for row, targets in zip(rows, listed, strict=True)]),
            unary=nothing,
            alone=nothing.copy(),
            pair_starts=np.zeros(len(self.sizes) + 1, np.int64),
            pair_ptr=np.zeros(1, np.int64),
            pair_states=np.zeros(0, np.int32),
            pair_costs=np.zeros(0),
            allowed=np.ones(starts[-1], dtype=bool),
            place=np.concatenate([np.arange(size) for size in self.sizes]).astype(np.int32),
        )

    def net(self, held: Model) -> Coordination:
        begins = np.arange(len(self.states) - 1)
        moves = (held.starts, held.indptr, held.targets)
        return fit_progression(self.parents, *moves, self.states, begins, begins + 1, self.weights)

    def of_moves(self, goal: Ints, wait: float, factor: float) -> tuple[Model, Coordination]:
        held = with_waits(self.model(), goal, wait)
        net = self.net(held)
        return lift_to_moves(held, net, factor), net

    def counts(self, chain: int) -> Floats:
        """How often the chain was seen to move from s to s' while its parent moved from p to p' [s, s', p, p']."""
        size, above = self.sizes[chain], self.sizes[self.parents[chain]]
        seen = np.zeros((size, size, above, above))
        for (before, after), weight in zip(pairwise(self.states), self.weights, strict=True):
            parent = self.parents[chain]
            seen[before[chain], after[chain], before[parent], after[parent]] += weight
        return seen

    def together(self, chain: int) -> Floats:
        """-log P(s' | s, p, p') by its definition [s, s', p, p']; of the unattested s' all have that of their class."""
        seen = self.counts(chain)
        pairs = seen.sum(axis=(2, 3))
        alone = np.where(pairs > 0.0, pairs, PRIOR_WEIGHT) / (pairs.sum(axis=1, keepdims=True) + PRIOR_WEIGHT)
        return np.asarray(
            -np.log((seen + PRIOR_WEIGHT * alone[:, :, None, None]) / (seen.sum(axis=1, keepdims=True) + PRIOR_WEIGHT))
        )

    def best(
        self,
        start: Sequence[int],
        goal: Sequence[int],
        rules: Rules,
        factor: float,
        allowed: Bools,
        vias: Sequence[Via] = (),
    ) -> float:
        """Least cost over all joint states and numbers of moves."""
        joint = np.array(list(product(*map(range, self.sizes))))
        move = np.zeros((len(joint), len(joint)))
        for chain, parent in enumerate(self.parents):
            costs, here = self.edges[chain].copy(), joint[:, chain]
            costs[goal[chain], goal[chain]] = min(costs[goal[chain], goal[chain]], rules.wait)
            move += costs[here[:, None], here[None]]
            if parent >= 0:
                above = joint[:, parent]
                move += factor * self.together(chain)[here[:, None], here[None], above[:, None], above[None]]
        firsts = np.concatenate([[0], np.cumsum(self.sizes)])[:-1]
        inner = np.where(allowed[firsts + joint].all(axis=1), 0.0, np.inf)
        least = np.inf
        for last in range(rules.shortest, rules.longest + 1):
            value = np.full((len(vias) + 1, len(joint)), np.inf)
            value[0, (joint == start).all(axis=1)] = 0.0
            for t in range(1, last + 1):
                value = (value[:, :, None] + move).min(axis=1)
                if t < last:
                    value += inner
                    for k in range(len(vias), 0, -1):
                        if vias[k - 1].move in (None, t):
                            at = (joint == vias[k - 1].states).all(axis=1)
                            value[k, at] = np.minimum(value[k, at], value[k - 1, at])
            at_goal = (joint == goal).all(axis=1)
            least = min(least, value[-1, at_goal][0] + rules.per_move * last)
        return least


@cache
def body(seed: int) -> Body:
    rng = np.random.default_rng(seed)
    chains = int(rng.integers(1, 4))
    sizes = rng.integers(1, 4, chains)
    states = rng.integers(0, sizes, (int(rng.integers(2, 25)), chains)).astype(np.int32)
    edges = []
    for chain, size in enumerate(sizes):
        table = np.where(rng.random((size, size)) < 0.3, rng.uniform(0.5, 4.0, (size, size)), np.inf)  # bridges
        attested = states[:-1, chain], states[1:, chain]
        table[attested] = rng.uniform(0.0, 2.0, (size, size))[attested]
        edges.append(table)
    parents = [int(rng.integers(-1, chain)) if chain else -1 for chain in range(chains)]
    weights = rng.choice([1.0, 1.0, 0.5, 3.0], len(states) - 1)
    return Body(np.array(parents, dtype=np.int64), states, weights, tuple(edges))


def ends_of(seed: int) -> tuple[Ints, Ints]:
    rng = np.random.default_rng(seed + 1)
    return rng.integers(body(seed).sizes), rng.integers(body(seed).sizes)


# --- the tables -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
def test_the_tables_are_those_of_a_network_over_two_postures(seed: int) -> None:
    """pgmpy's, with the same counts and pseudo-counts; whatever is not attested is one state more."""
    import pandas as pd  # here: every worker would wait for it, and for pgmpy, before its first test
    from pgmpy.models import DiscreteBayesianNetwork
    from pgmpy.parameter_estimator import DiscreteBayesianEstimator

    toy = body(seed)
    for chain, parent in enumerate(toy.parents):
        if parent < 0:
            continue
        size, above = toy.sizes[chain], toy.sizes[parent]
        pairs = toy.counts(chain).sum(axis=(2, 3))
        alone = np.zeros((size, size + 1))
        alone[:, :size], alone[:, size] = pairs, PRIOR_WEIGHT
        alone /= alone.sum(axis=1, keepdims=True)
        network = DiscreteBayesianNetwork([("a", "next"), ("b", "next"), ("c", "next")])
        names = {"next": range(size + 1), "a": range(size), "b": range(above), "c": range(above)}
        columns = [(given[0], given) for given in product(range(size), range(above), range(above))]
        prior = np.array([PRIOR_WEIGHT * alone[s] for s, _ in columns]).T
        flat = {name: np.ones((len(names[name]), 1)) for name in "abc"}
        frame = pd.DataFrame(
            {
                "a": toy.states[:-1, chain],
                "b": toy.states[:-1, parent],
                "c": toy.states[1:, parent],
                "next": toy.states[1:, chain],
            }
        )
        estimator = DiscreteBayesianEstimator(
            state_names={name: list(values) for name, values in names.items()},
            prior_type="dirichlet",
            pseudo_counts={"next": prior, **flat},
        )
        fitted = estimator.fit(network, frame, sample_weight=toy.weights).parameters_
        cpd = next(cpd for cpd in fitted if cpd.variable == "next")
        given = cpd.variables[1:]
        values = cpd.values.transpose(0, *(1 + given.index(name) for name in "abc"))
        np.testing.assert_allclose(values.sum(axis=0), 1.0, atol=1e-12)

        held = toy.model()
        net, starts = toy.net(held), held.starts + held.indptr[held.starts]
        for (s, after), (p, p_after) in product(moves_of(held, chain), moves_of(held, parent)):
            row = after if pairs[s, after] > 0.0 else size
            m, n = move(held, chain, s, after), move(held, parent, p, p_after)
            assert net.cost(chain, n, m, starts) == pytest.approx(-np.log(values[row, s, p, p_after]), abs=1e-12)
            assert net.cost(chain, n, m, starts) == pytest.approx(toy.together(chain)[s, after, p, p_after], abs=1e-12)


def moves_of(held: Model, chain: int) -> list[tuple[int, int]]:
    rows = range(held.starts[chain], held.starts[chain + 1])
    return [
        (row - int(held.starts[chain]), int(after))
        for row in rows
        for after in held.targets[held.indptr[row] : held.indptr[row + 1]]
    ]


def move(held: Model, chain: int, before: int, after: int) -> int:
    """The number of a move among the states of the chain when these are moves."""
    return int(np.diff(held.starts)[chain]) + moves_of(held, chain).index((before, after))


@pytest.mark.parametrize("seed", range(12))
def test_arrays_that_the_search_bisects_are_sorted(seed: int) -> None:
    model, _ = body(seed).of_moves(ends_of(seed)[1], 0.7, 1.0)
    for pointer, listed in ((model.indptr, model.targets), (model.pair_ptr, model.pair_states)):
        for first, last in pairwise(pointer):
            assert np.all(np.diff(listed[first:last]) > 0)


# --- what is found ----------------------------------------------------------------------------------------------------


@settings(max_examples=200)
@given(st.integers(0, 100_000), st.floats(0.0, 0.5), st.integers(0, 2), st.sampled_from([0.0, 0.6, 1.0, 3.0]))
def test_the_cost_is_that_of_brute_force(seed: int, share: float, passed: int, factor: float) -> None:
    toy, rng = body(seed), np.random.default_rng(seed + 2)
    start, goal = ends_of(seed)
    rules = Rules(float(rng.uniform(0.2, 1.5)), 0.3, int(rng.integers(1, 3)), MOVES, 100_000)
    allowed = rng.random(sum(toy.sizes)) >= share
    vias = [Via(rng.integers(toy.sizes), None if rng.random() < 0.6 else k + 1) for k in range(passed)]
    held = with_waits(toy.model()._replace(allowed=allowed), goal, rules.wait)
    net = toy.net(held)
    model = lift_to_moves(held, net, factor)
    expected = toy.best(start, goal, rules, factor, allowed, vias)
    rules = replace(rules, wait=np.inf)
    problem = Problem(model, start, goal, rules, vias)
    found = solution(problem)
    if found is None:
        assert expected == np.inf
        return
    assert found.status == "optimal"
    assert found.cost == pytest.approx(expected, abs=ALIKE)
    assert found.lower_bound <= expected + 1e-9
    path = places(model, found.path)
    firsts = np.concatenate([[0], np.cumsum(toy.sizes)])[:-1]
    assert path[0].tolist() == start.tolist()
    assert path[-1].tolist() == goal.tolist()
    assert allowed[firsts + path[1:-1]].all()
    for via, t in zip(vias, found.passed, strict=True):
        assert path[t].tolist() == via.states.tolist()

    chains = [f"chain{chain}" for chain in range(len(toy.sizes))]
    through = [Via(via.states, t) for via, t in zip(vias, found.passed, strict=True)]
    text = written(replace(problem, vias=through), len(path) - 1, chains, net, factor)
    assert evaluate(text, path, chains) == pytest.approx(found.cost, abs=1e-4)


def written(problem: Problem, moves: int, chains: list[str], net: Coordination, factor: float) -> str:
    """The problem as it is written, all edges of one kind."""
    one = np.zeros(len(problem.model.costs), np.int64)
    return cfn(problem, moves, chains, Ingredients(("edge",), one, factor * net.child_costs, factor * net.parent_costs))


def test_a_guide_over_moves_is_paid_on_the_way_and_the_optimum_is_that_of_toulbar2(tmp_path: Path) -> None:
    pytoulbar2 = pytest.importorskip("pytoulbar2", reason="toulbar2 is not installed: no outside solver")
    checked = 0
    for seed in range(60):
        toy, (start, goal) = body(seed), ends_of(seed)
        model, net = toy.of_moves(goal, 0.7, 1.0)
        rng = np.random.default_rng(seed)
        guides = [rng.uniform(-2.0, 3.0, (max(moves - 1, 0), model.starts[-1])) for moves in range(MOVES + 1)]
        vias = [Via(rng.integers(toy.sizes))] * (seed % 2)
        problem = Problem(model, start, goal, Rules(np.inf, 0.3, 1, MOVES, 100_000), vias, guides.__getitem__)
        found = solution(problem)
        if found is None:
            continue
        moves, chains = len(found.path) - 1, [f"chain{chain}" for chain in range(len(toy.sizes))]
        problem = replace(problem, vias=[Via(via.states, t) for via, t in zip(vias, found.passed, strict=True)])
        plain = written(replace(problem, guide=None), moves, chains, net, 1.0)
        paid = sum(guides[moves][t, model.starts[:-1] + states].sum() for t, states in enumerate(found.path[1:-1]))
        cost = evaluate(plain, places(model, found.path), chains) + paid
        assert cost == pytest.approx(found.cost, abs=1e-4), seed
        (tmp_path / "problem.cfn").write_text(written(problem, moves, chains, net, 1.0))
        network = pytoulbar2.CFN(verbose=-1)
        network.Read(str(tmp_path / "problem.cfn"))
        assert network.Solve()[1] == pytest.approx(found.cost, abs=1e-4), seed
        checked += moves > 1
    assert checked > 10


@pytest.mark.long
def test_paths_are_drawn_as_often_as_they_are_likely() -> None:
    tried = 0
    for seed in range(60):
        toy, (start, goal) = body(seed), ends_of(seed)
        model, _ = toy.of_moves(goal, 0.7, 1.0)
        likely = paths_of(toy, model, start, goal)
        if not 4 <= len(likely) <= 300:
            continue
        trellis = build_trellis(model, start, 3, costs_to_go(model, goal, 3), np.inf)
        best = solve(Problem(model, start, goal, Rules(np.inf, 0.0, 3, 3, 1000)))
        chains, domains = trellis.chains, [trellis.dom[a:b] for a, b in pairwise(trellis.dom_ptr)]
        path = np.array([np.searchsorted(d, s) for d, s in zip(domains, best.path.ravel(), strict=True)])
        path += trellis.dom_ptr[:-1]
        rng, draws, seen = np.random.default_rng(seed), 2000, dict.fromkeys(likely, 0)
        for _ in range(draws):
            gibbs_sample(trellis, path, 1, rng)
            seen[places(model, trellis.dom[path].reshape(4, chains)).tobytes()] += 1
        apart = 0.5 * sum(abs(seen[one] / draws - p) for one, p in likely.items())
        chance = 0.5 * sum(np.sqrt(2.0 * p * (1.0 - p) / (np.pi * draws)) for p in likely.values())
        assert apart < 2.5 * chance + 0.01, (seed, apart, chance)
        tried += 1
    assert tried >= 10


def paths_of(toy: Body, model: Model, start: Ints, goal: Ints) -> dict[bytes, float]:
    """Every path of three moves, by the states of its joint graphs, and its probability."""
    joint = list(product(*map(range, toy.sizes)))
    weight = {}
    for inner in product(joint, repeat=2):
        path = np.array([start, *inner, goal], dtype=np.int32)
        cost = 0.0
        for before, after in pairwise(path):
            for chain, parent in enumerate(toy.parents):
                waits = before[chain] == after[chain] == goal[chain]
                cost += min(toy.edges[chain][before[chain], after[chain]], 0.7 if waits else np.inf)
                if parent >= 0:
                    cost += toy.together(chain)[before[chain], after[chain], before[parent], after[parent]]
        if cost < np.inf:
            weight[path.tobytes()] = np.exp(-cost)
    return {path: w / sum(weight.values()) for path, w in weight.items()}


def test_a_path_that_is_drawn_passes_what_the_best_one_does() -> None:
    for seed in range(30):
        toy, (start, goal) = body(seed), ends_of(seed)
        model, _ = toy.of_moves(goal, 0.7, 1.0)
        via = Via(np.random.default_rng(seed).integers(toy.sizes))
        problem = Problem(model, start, goal, Rules(np.inf, 0.3, 1, MOVES, 1000), [via])
        best = solution(problem)
        if best is not None:
            other = sample_path(problem, best, seed)
            path = places(model, other.path)
            assert path[best.passed[0]].tolist() == via.states.tolist()
            assert (path[0].tolist(), path[-1].tolist()) == (start.tolist(), goal.tolist())
            assert other.cost >= best.cost - ALIKE


# --- through the engine -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def engine() -> Engine:
    return Engine.load("ballet")


def join(engine: Engine, **asked: Any) -> Tween:
    a, b = (read_posture(POSTURES / f"{name}.json") for name in ("arabesque", "fifth"))
    return engine.tween(a, b, coordination="progression", **asked)


@pytest.mark.long
def test_the_report_adds_up_to_the_cost(engine: Engine) -> None:
    plain = join(engine)
    assert plain.status == "optimal"
    for asked in (
        {},
        {"lambda_": 0.5, "novelty": 0.5, "avoid": [("left_knee", "plie 56")]},
        {"strict": True},
        {"via": [read_posture(POSTURES / "passe.json")]},
        {"unlike": [plain], "differ": 0.3},
        {"sample": True, "seed": 2},
        {"moves": 7, "pin": {"left_wrist": "B"}},
    ):
        found = join(engine, **asked)
        assert found.costs.total == pytest.approx(found.cost, abs=1e-6)
        assert found.path.shape == (found.moves + 1, len(found.joints))
        assert found.asked["coordination"] == "progression"


def test_chains_wait_at_the_goal_by_moves_that_coordinate_alone(engine: Engine) -> None:
    """They could wait there for the price of waiting as well, past what their parents do."""
    passe = read_posture(POSTURES / "passe.json")
    searched = formulate(
        engine, bring_ends(engine.corpus, passe, passe), TweenRequest.of(coordination="progression", moves=2)
    ).searched
    assert searched.model_with_waits() is searched.model


def test_coordination_that_costs_nothing_is_none(engine: Engine) -> None:
    free, none = (
        join(engine, lambda_=0.0),
        engine.tween(
            *(read_posture(POSTURES / f"{name}.json") for name in ("arabesque", "fifth")), coordination="none"
        ),
    )
    assert free.cost == pytest.approx(none.cost, abs=ALIKE)
    assert free.moves == none.moves


def test_whole_postures_have_no_progressions(engine: Engine) -> None:
    with pytest.raises(MotionMindError, match="posture or none"):
        join(engine, whole_body=True)


def test_more_moves_than_a_node_can_number_are_refused(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionmind.tween.formulate.MAX_CHAIN_STATES", 50)
    with pytest.raises(
        MotionMindError, match=r"has \d+ states and moves, and the search takes up to 50; build the corpus"
    ):
        join(engine)


@pytest.mark.long
def test_the_command_line_finds_the_same_and_writes_its_problem(run: Run, engine: Engine, tmp_path: Path) -> None:
    problem = tmp_path / "problem.cfn"
    a, b = POSTURES / "arabesque.json", POSTURES / "fifth.json"
    ran = run(
        *("tween", a, b, "--corpus", "ballet", "--report", "-", "--problem", problem),
        *("--coordination", "progression"),
    )
    assert ran.code == 0, ran.err
    found = join(engine)
    assert (ran.json["cost"], ran.json["path"]) == (found.cost, found.path.tolist())
    assert problem.read_text() == found.problem()
