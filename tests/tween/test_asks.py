"""What can be asked of a tween: restrictions, vias and changed costs, against brute force and toulbar2."""

from __future__ import annotations

import json
import os
import re
import signal
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st
from toys import Toy, best, evaluate, random_toy, solution, trellis_of

from motionmind._typing import Bools, Int32s
from motionmind.body.motion import Posture
from motionmind.bundled import bundled
from motionmind.cli.printing import Interruption
from motionmind.errors import MotionMindError, NoPathError
from motionmind.formats import read_motion, read_posture
from motionmind.geometry import rotations as rot
from motionmind.search import astar
from motionmind.search.cfn import cfn
from motionmind.search.problem import Via
from motionmind.search.sample import gibbs_sample
from motionmind.search.solve import Certificate, Progress
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.search.trellis import Trellis
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween

MOVES = 5
POSTURES = bundled("corpora") / "ballet" / "postures"


# --- brute force ------------------------------------------------------------------------------------------------------


def keeps(toy: Toy, path: Int32s, allowed: Bools, found: Certificate, vias: list[Via]) -> bool:
    starts = np.concatenate([[0], np.cumsum(toy.sizes)])[:-1]
    on_the_way = bool(allowed[starts + path[1:-1]].all())
    passed = all((path[t] == via.states).all() for t, via in zip(found.passed, vias, strict=True))
    there = all(via.move in (None, t) for t, via in zip(found.passed, vias, strict=True))
    return on_the_way and passed and there and all(a < b for a, b in pairwise((0, *found.passed, len(path) - 1)))


asks = st.tuples(
    st.integers(0, 10_000), st.booleans(), st.booleans(), st.floats(0.0, 0.6), st.integers(0, 3), st.integers(1, MOVES)
)


@settings(max_examples=150)
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
    found = solution(toy.problem(toy.rules(fewest, MOVES), vias, allowed=allowed))
    if found is None:
        assert expected == np.inf
    else:
        assert found.status == "optimal"
        assert found.cost == pytest.approx(expected, abs=2 * OPTIMAL_WITHIN_NATS)
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
        found = solution(toy.problem(toy.rules(1, MOVES, node_budget, 2), vias, allowed=allowed))
        if found is None:
            assert expected == np.inf
            continue
        assert found.lower_bound <= expected + 1e-9
        assert found.cost >= expected - 1e-9
        assert found.lower_bound >= before[0] - 1e-9
        assert found.cost <= before[1] + 1e-9
        before = found.lower_bound, found.cost


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.booleans())
def test_vias_at_the_postures_of_the_best_path_change_nothing(seed: int, at: bool) -> None:
    toy = random_toy(seed, even=seed % 2 == 0)
    found = solution(toy.problem(toy.rules(2, MOVES)))
    if found is None:
        return
    inner = [Via(states.astype(np.int64), t if at else None) for t, states in enumerate(found.path[1:-1], start=1)]
    for vias in (inner, inner[:1], inner[-1:]):
        again = solution(toy.problem(toy.rules(2, MOVES), vias))
        assert again is not None
        assert again.cost == pytest.approx(found.cost, abs=2 * OPTIMAL_WITHIN_NATS)


@settings(max_examples=50)
@given(st.integers(0, 10_000))
def test_a_restriction_never_lowers_the_cost_and_one_that_the_best_path_keeps_changes_nothing(seed: int) -> None:
    toy = random_toy(seed)
    found = solution(toy.problem(toy.rules(1, MOVES)))
    if found is None:
        return
    rng = np.random.default_rng(seed)
    allowed = np.ones(sum(toy.sizes), dtype=bool)
    on_it = np.zeros(sum(toy.sizes), dtype=bool)
    on_it[toy.model.starts[:-1] + found.path[1:-1]] = True
    cost = found.cost
    for _ in range(4):
        allowed &= rng.random(len(allowed)) > 0.2
        kept = solution(toy.problem(toy.rules(1, MOVES), allowed=allowed | on_it))
        assert kept is not None
        assert kept.cost == pytest.approx(found.cost, abs=2 * OPTIMAL_WITHIN_NATS)
        narrower = solution(toy.problem(toy.rules(1, MOVES), allowed=allowed))
        assert narrower is None or narrower.cost >= cost - 2 * OPTIMAL_WITHIN_NATS
        cost = np.inf if narrower is None else narrower.cost


@settings(max_examples=60)
@given(st.integers(0, 10_000))
def test_states_by_other_numbers_cost_the_same(seed: int) -> None:
    toy = random_toy(seed)
    rng = np.random.default_rng(seed)
    new = [rng.permutation(size) for size in toy.sizes]  # what was state new[chain][s] is s
    other = replace(
        toy,
        edges=tuple(table[np.ix_(p, p)] for table, p in zip(toy.edges, new, strict=True)),
        children=tuple(row[p] if len(row) else row for row, p in zip(toy.children, new, strict=True)),
        above=tuple(
            row[new[parent]] if parent >= 0 else row for row, parent in zip(toy.above, toy.parents, strict=True)
        ),
        corrections=tuple(
            table[np.ix_(new[parent], p)] if parent >= 0 else table
            for table, p, parent in zip(toy.corrections, new, toy.parents, strict=True)
        ),
        start=tuple(int(np.flatnonzero(p == s)[0]) for p, s in zip(new, toy.start, strict=True)),
        goal=tuple(int(np.flatnonzero(p == s)[0]) for p, s in zip(new, toy.goal, strict=True)),
    )
    allowed = [rng.random(size) > 0.2 for size in toy.sizes]
    via = [int(rng.integers(size)) for size in toy.sizes]
    renamed = [int(np.flatnonzero(p == s)[0]) for p, s in zip(new, via, strict=True)]
    mine = solution(toy.problem(toy.rules(1, MOVES), [Via(np.array(via))], allowed=np.concatenate(allowed)))
    theirs = solution(
        other.problem(
            other.rules(1, MOVES),
            [Via(np.array(renamed))],
            allowed=np.concatenate([a[p] for a, p in zip(allowed, new, strict=True)]),
        )
    )
    assert (mine is None) == (theirs is None)
    if mine is not None and theirs is not None:
        assert mine.cost == pytest.approx(theirs.cost, abs=2 * OPTIMAL_WITHIN_NATS)


@settings(max_examples=60)
@given(st.integers(0, 10_000))
def test_chains_in_another_order_cost_the_same(seed: int) -> None:
    toy = random_toy(seed)
    rng = np.random.default_rng(seed)
    order: list[int] = []  # any in which parents come first
    while len(order) < len(toy.sizes):
        ready = [chain for chain, parent in enumerate(toy.parents) if chain not in order and parent in (-1, *order)]
        order.append(int(rng.choice(ready)))
    moved = {
        name: tuple(getattr(toy, name)[chain] for chain in order)
        for name in ("edges", "children", "above", "corrections", "start", "goal")
    }
    parents = tuple(order.index(toy.parents[chain]) if toy.parents[chain] >= 0 else -1 for chain in order)
    other = replace(toy, parents=parents, **moved)
    allowed = [rng.random(size) > 0.2 for size in toy.sizes]
    via = rng.integers(toy.sizes)
    costs = []
    for body, chains in ((toy, range(len(order))), (other, order)):
        kept = np.concatenate([allowed[chain] for chain in chains])
        found = solution(body.problem(body.rules(1, MOVES), [Via(via[list(chains)])], allowed=kept))
        costs.append(np.inf if found is None else found.cost)
    assert costs[0] == pytest.approx(costs[1], abs=2 * OPTIMAL_WITHIN_NATS)


def test_what_was_asked_is_in_the_written_problem(tmp_path: Path) -> None:
    pytoulbar2 = pytest.importorskip("pytoulbar2", reason="toulbar2 is not installed: no outside solver")
    checked = 0
    for seed in range(60):
        toy = random_toy(seed, frustrated=seed % 2 == 0)
        rng = np.random.default_rng(seed)
        allowed = rng.random(sum(toy.sizes)) >= 0.15
        vias = [Via(rng.integers(toy.sizes)) for _ in range(seed % 3)]
        problem = toy.problem(toy.rules(2, MOVES), vias, allowed=allowed)
        found = solution(problem)
        if found is None:
            continue
        at = [Via(via.states, move) for via, move in zip(vias, found.passed, strict=True)]
        chains = [f"chain{chain}" for chain in range(len(toy.sizes))]
        text = cfn(replace(problem, vias=at), len(found.path) - 1, chains, toy.ingredients(problem))
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
    for seed in range(20):
        toy = random_toy(seed, frustrated=True)
        vias = [Via(np.random.default_rng(seed).integers(toy.sizes))] * (seed % 2)
        expected = best(toy, range(1, MOVES + 1), np.ones(sum(toy.sizes), dtype=bool), vias)
        for calls in range(6):
            told: list[Progress] = []
            found = solution(
                toy.problem(toy.rules(1, MOVES), vias),
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


@pytest.mark.parametrize("chains", [1, 24, 45])
@pytest.mark.parametrize("memory", [10_000, 1_000_000, 33_554_432])
def test_nodes_take_no_more_memory_than_is_said(memory: int, chains: int) -> None:
    parents = np.full(chains, -1, np.int64)
    empty, none = np.zeros(0), np.zeros(0, np.int64)
    trellis = Trellis(chains, 0, parents, none, none, empty, none, none, empty, none, none, none, empty)
    budget = astar.node_capacity(memory, chains)
    held = sum(array.nbytes for array in astar._root.py_func(trellis, 0.0, budget))
    forgetting = budget
    assert 0.8 * memory < held + forgetting <= memory + 100


# --- a path drawn at random -------------------------------------------------------------------------------------------


def paths_of(toy: Toy, moves: int) -> dict[bytes, float]:
    """Every path of so many moves, and its probability."""
    joint = toy.joint_states()
    ends = [joint[(joint == end).all(axis=1)] for end in (toy.start, toy.goal)]
    weight = {}
    for inner in product(joint, repeat=moves - 1):
        path = np.array([*ends[0], *inner, *ends[1]], dtype=np.int32)
        if (cost := toy.cost(path)) < np.inf:
            weight[path.tobytes()] = np.exp(-cost)
    return {path: w / sum(weight.values()) for path, w in weight.items()}


@pytest.mark.long
def test_paths_are_drawn_as_often_as_they_are_likely() -> None:
    tried = 0
    for seed in range(24):
        toy = random_toy(seed, most=3, states=3, frustrated=seed % 2 == 0, dear=seed % 3 == 0)
        likely = paths_of(toy, 3)
        if not 4 <= len(likely) <= 400:
            continue
        trellis = trellis_of(toy, 3)
        first = np.frombuffer(next(iter(likely)), dtype=np.int32)
        path = np.array(
            [
                a + np.flatnonzero(trellis.dom[a:b] == s)[0]
                for (a, b), s in zip(pairwise(trellis.dom_ptr), first, strict=True)
            ]
        )
        rng, draws, seen = np.random.default_rng(seed), 4000, dict.fromkeys(likely, 0)
        for _ in range(draws):
            cost = gibbs_sample(trellis, path, 1, rng)
            states = trellis.dom[path].reshape(4, -1)
            seen[states.tobytes()] += 1
        assert cost + 3 * toy.per_move == pytest.approx(toy.cost(states), abs=1e-9)
        apart = 0.5 * sum(abs(seen[path] / draws - p) for path, p in likely.items())
        # Independent draws would be apart by about this much, by chance alone.
        chance = 0.5 * sum(np.sqrt(2.0 * p * (1.0 - p) / (np.pi * draws)) for p in likely.values())
        assert apart < 2.5 * chance + 0.01, (seed, apart, chance)
        tried += 1
    assert tried >= 10


# --- through the engine -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def engine() -> Engine:
    return Engine.load("ballet")


def posture(name: str) -> Posture:
    return read_posture(POSTURES / f"{name}.json")


def join(engine: Engine, **asked: Any) -> Tween:
    return engine.tween(posture("arabesque"), posture("fifth"), **asked)


@pytest.fixture(scope="module")
def plain(engine: Engine) -> Tween:
    return join(engine)


def chain_of(tween: Tween, joint: str) -> Int32s:
    return tween.path[:, tween.joints.index(joint)]


@pytest.mark.long
def test_a_range_of_moves_is_kept_and_its_best_is_the_best_of_its_numbers(engine: Engine, plain: Tween) -> None:
    found, *narrower = (join(engine, moves=moves) for moves in ((6, 8), (6, 7), (7, 8)))
    price = min(other.length.cost for other in narrower if other.length)
    assert found.length is not None
    assert found.length.cost == pytest.approx(price, abs=1e-6)
    assert found.cost == pytest.approx(join(engine, moves=found.moves).cost, abs=1e-6)
    heedless = join(engine, moves=(6, 8), without=["pace"], guide=0.0)
    costs = [join(engine, moves=moves, guide=0.0).cost for moves in (6, 7, 8)]
    assert heedless.cost == pytest.approx(min(costs), abs=1e-6)
    assert 6 <= found.moves <= 8
    assert join(engine, moves=(1, 60)).cost == pytest.approx(plain.cost, abs=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("duration", [1.6, 2.0, 2.719])
def test_a_motion_lasts_as_long_as_is_asked_for(engine: Engine, duration: float) -> None:
    found = join(engine, duration=duration)
    assert found.motion.times[-1] == duration
    assert found.motion.insertions[0].times[-1] == duration
    usual = float(np.median(engine.grammar.transitions.seconds))
    assert found.moves == round(duration / usual)
    assert abs(len(found.motion) - 1 - 30.0 * duration) <= 0.5
    slower = join(engine, duration=duration, moves=5)
    assert (slower.motion.times[-1], slower.moves) == (duration, 5)


@pytest.mark.long
def test_a_pinned_joint_is_in_the_state_of_its_end(engine: Engine, plain: Tween) -> None:
    for joint in ("left_wrist", "right_elbow"):
        at_a, at_b = join(engine, pin={joint: "A"}), join(engine, pin={joint: "B"})
        assert set(chain_of(at_a, joint)[:-1]) == {chain_of(plain, joint)[0]}
        assert set(chain_of(at_b, joint)[1:]) == {chain_of(plain, joint)[-1]}
        assert min(at_a.cost, at_b.cost) >= plain.cost - 1e-6
        assert {at_a.status, at_b.status} == {"optimal"}


@pytest.mark.long
def test_a_held_joint_stays_and_one_that_cannot_is_refused(engine: Engine, plain: Tween) -> None:
    alike = [joint for joint in plain.joints if chain_of(plain, joint)[0] == chain_of(plain, joint)[-1]]
    found = join(engine, hold=alike[:3])
    assert all(len(set(chain_of(found, joint))) == 1 for joint in alike[:3])
    assert found.cost >= plain.cost - 1e-6
    with pytest.raises(NoPathError, match=r"hold left_ankle: A and B have different states there, "):
        join(engine, hold=["left_ankle"])


@pytest.mark.long
def test_an_avoided_state_is_not_on_the_way_by_number_or_by_name(engine: Engine, plain: Tween) -> None:
    chain = plain.joints.index("left_knee")
    state = int(plain.path[1, chain])
    name = engine.space.label(chain, state)
    by_number, by_name = (join(engine, avoid=[("left_knee", wanted)], moves=plain.moves) for wanted in (state, name))
    assert state not in by_number.path[1:-1, chain]
    np.testing.assert_array_equal(by_number.path, by_name.path)
    assert by_number.cost > plain.cost


@pytest.mark.long
def test_postures_are_passed_in_order_and_shown_as_they_are(engine: Engine, plain: Tween) -> None:
    passe, plie = posture("passe"), posture("plie")
    found = join(engine, via=[passe, plie])
    assert 0 < found.passed[0] < found.passed[1] < found.moves
    states = engine.space.assign(engine.corpus.to_chains(np.stack([passe.rotations, plie.rotations])))
    np.testing.assert_array_equal(found.path[list(found.passed)], states)
    again = join(engine, via=[(passe, found.passed[0]), (plie, found.passed[1])], moves=found.moves)
    assert again.cost == pytest.approx(found.cost, abs=1e-6)
    exact = join(engine, via=[passe, plie], fps=300.0)
    times = exact.motion.insertions[0].times
    for move, stop in zip(exact.passed, (passe, plie), strict=True):
        frame = int(np.abs(exact.motion.times - times[move]).argmin())
        assert np.degrees(rot.angle(exact.motion.rotations[frame, 1:], stop.rotations[1:])).max() < 0.5


@pytest.mark.long
def test_novelty_0_is_the_default_exactly_and_1_weighs_all_that_is_attested_alike(engine: Engine, plain: Tween) -> None:
    same = join(engine, novelty=0.0)
    np.testing.assert_array_equal(same.path, plain.path)
    assert same.cost == plain.cost
    graph = engine.grammar.transitions
    leaving = np.diff(graph.indptr)[graph.sources]
    np.testing.assert_array_equal(graph.weights("conditional"), graph.weights("conditional", 0.0))
    for scheme in ("conditional", "printed"):
        np.testing.assert_allclose(graph.weights(scheme, 1.0), np.log(leaving), atol=1e-12)
        half = 0.5 * (graph.weights(scheme) + np.log(leaving))
        np.testing.assert_allclose(graph.weights(scheme, 0.5), half, atol=1e-12)
    assert join(engine, novelty=1.0).status == "optimal"


@pytest.mark.long
def test_a_path_is_drawn_by_its_seed_under_all_that_was_asked(engine: Engine, plain: Tween) -> None:
    asked = {"via": [posture("passe")], "pin": {"left_wrist": "A"}, "moves": 9}
    best, *drawn = join(engine, **asked), *(join(engine, sample=True, seed=seed, **asked) for seed in (1, 1, 2))
    np.testing.assert_array_equal(drawn[0].path, drawn[1].path)
    assert (drawn[0].path != drawn[2].path).any()
    for tween in drawn:
        assert tween.status == "sampled"
        assert tween.lower_bound == best.lower_bound < tween.cost
        assert tween.passed == best.passed
        assert set(chain_of(tween, "left_wrist")[:-1]) == {chain_of(plain, "left_wrist")[0]}
        np.testing.assert_array_equal(tween.path[tween.passed[0]], best.path[best.passed[0]])
        assert evaluate(tween.problem(), tween.path, tween.joints) == pytest.approx(tween.cost, abs=1e-3)


@pytest.mark.long
def test_without_coordination_joints_move_each_on_its_own(engine: Engine) -> None:
    alone, free = join(engine, coordination="none"), join(engine, lambda_=0.0)
    assert alone.cost == free.cost
    assert alone.asked["coordination"] == "none"


@pytest.mark.long
def test_the_report_adds_up_to_the_cost_whatever_was_asked(engine: Engine, plain: Tween) -> None:
    for asked in (
        {"novelty": 0.7, "pin": {"left_wrist": "B"}},
        {"unlike": [plain], "differ": 0.3},
        {"via": [posture("passe")]},
        {"sample": True, "seed": 2},
        {"coordination": "none"},
    ):
        found = join(engine, **asked)
        assert found.costs.total == pytest.approx(found.cost, abs=1e-6)


def test_a_restriction_that_leaves_no_path_is_named(engine: Engine) -> None:
    with pytest.raises(
        NoPathError, match=r"without pin right_elbow=B there is one(.|\n)*right_elbow: no path from A to B"
    ):
        join(engine, pin={"left_knee": "A", "right_elbow": "B"}, strict=True)
    with pytest.raises(
        NoPathError, match=r"without via 1 after move 3 there is one\n  with via 1 after move 4 there is one"
    ):
        join(engine, via=[(posture("passe"), 3)])


def test_of_restrictions_that_leave_no_path_together_as_few_as_do_so_are_named(engine: Engine) -> None:
    plain = join(engine)
    chain = plain.joints.index("right_elbow")
    every = [("right_elbow", state) for state in range(engine.space.sizes[chain])]
    with pytest.raises(NoPathError, match=r"in 4 moves(.|\n)*right_elbow") as fault:
        join(engine, avoid=[("left_hip", 1), *every], pin={"right_elbow": "B", "left_knee": "A"}, moves=4, strict=True)
    assert "left_" not in str(fault.value)
    with pytest.raises(NoPathError) as fault:
        join(engine, pin={"right_elbow": "B"}, via=[(posture("passe"), 3)], strict=True)
    assert re.findall(r"(.*) leaves none", str(fault.value)) == ["  via 1 after move 3", "  pin right_elbow=B"]
    with pytest.raises(NoPathError, match=r"in at most 1 move \(allow more moves\)"):  # not for what was asked
        join(engine, pin={"left_knee": "A"}, moves=1)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"moves": (4, 3)}, "moves must be a range from the least to the greatest, not from 4 to 3"),
        ({"moves": (0, 3)}, "moves must be a whole number from 1"),
        ({"duration": 0.0}, "duration must be a number of seconds from a frame's"),
        ({"duration": np.nan}, "duration must be"),
        ({"duration": 1e9}, "duration must be"),
        ({"pin": {"wing": "A"}}, "no joint 'wing'"),
        ({"pin": {"left_hip": "C"}}, "pin left_hip=C: a joint is pinned to A or to B"),
        ({"hold": ["wing"]}, "no joint 'wing'"),
        ({"avoid": [("left_hip", 999)]}, "left_hip has states 0 to .*, no state 999"),
        ({"avoid": [("left_knee", "bent")]}, "avoid left_knee=bent: a state is given by its number, 0 to .*: straight"),
        ({"novelty": 1.5}, "novelty must be a number from 0 to 1, not 1.5"),
        ({"novelty": np.nan}, "novelty must be"),
        ({"differ": 1.5}, "differ must be a number from 0 to 1, not 1.5"),
        ({"differ": np.nan}, "differ must be"),
        ({"within": -0.1}, "within must be a number from 0 to 1, not -0.1"),
        ({"seed": -1}, "seed must be a whole number of at least 0, not -1"),
        ({"coordination": "all"}, "coordination must be 'posture', 'progression' or 'none', not 'all'"),
        ({"memory": 10}, "memory=10 is too small"),
        ({"memory": 0}, "memory must be a whole number"),
    ],
)
def test_what_cannot_be_asked_is_refused(engine: Engine, asked: dict[str, Any], words: str) -> None:
    with pytest.raises(MotionMindError, match=words):
        join(engine, **asked)


def test_a_via_is_on_the_corpus_skeleton_and_at_a_move(engine: Engine) -> None:
    with pytest.raises(MotionMindError, match="via 1: the move must be a whole number from 1 to 9999, not 0"):
        join(engine, via=[(posture("passe"), 0)])


@pytest.mark.long
def test_the_report_says_what_was_asked(engine: Engine) -> None:
    found = join(engine, via=[(posture("passe"), 4)], avoid=[("left_knee", "passe 139")], novelty=0.25, memory=10**7)
    asked = json.loads(json.dumps(found.report()))["asked"]
    assert asked["via"] == [4]
    assert asked["avoid"] == [["left_knee", "passe 139"]]
    assert (asked["novelty"], asked["memory"], asked["moves"]) == (0.25, 10**7, None)
    assert found.node_budget == astar.node_capacity(10**7, len(found.joints))


# --- on the command line ----------------------------------------------------------------------------------------------

A, B = POSTURES / "arabesque.json", POSTURES / "fifth.json"


@pytest.mark.long
def test_everything_can_be_asked_on_the_command_line(run: Run, engine: Engine) -> None:
    via = f"{POSTURES / 'passe.json'}@4"
    asked = ["--moves", "6..9", "--pin", "left_wrist", "--pin", "right_wrist=B", "--avoid", "left_knee=plie 56"]
    asked += ["--via", via, "--novelty", "0.5", "--memory", "5MB", "--duration", "2.5"]
    ran = run("tween", A, B, "--corpus", "ballet", "--report", "-", *asked)
    assert ran.code == 0, ran.err
    found = join(
        engine,
        moves=(6, 9),
        pin={"left_wrist": "A", "right_wrist": "B"},
        avoid=[("left_knee", "plie 56")],
        via=[(posture("passe"), 4)],
        novelty=0.5,
        memory=5_000_000,
        duration=2.5,
    )
    assert ran.json["asked"] == json.loads(json.dumps(found.asked))
    assert (ran.json["cost"], ran.json["path"]) == (found.cost, found.path.tolist())
    assert ran.json["vias"][0]["move"] == 4
    lively = run(
        "tween", A, B, "--corpus", "ballet", "--report", "-", "--sample", "--seed", 3, "--coordination", "none"
    )
    drawn = join(engine, sample=True, seed=3, coordination="none")
    assert lively.json["path"] == drawn.path.tolist()
    table = run("tween", A, B, "--corpus", "ballet", *asked, "--details").out
    assert "\nvia 1     after move 4, " in table


@pytest.mark.long
def test_alternatives_go_to_files_of_their_own(run: Run) -> None:
    ran = run("tween", A, B, "--corpus", "ballet", "--alternatives", 3, "-o", "out.json", "--report", "r.json")
    assert ran.code == 0, ran.err
    assert sorted(path.name for path in Path().iterdir()) == [
        f"{name}-{k}.json" for name in ("out", "r") for k in (1, 2, 3)
    ]
    reports = [json.loads(Path(f"r-{k}.json").read_text()) for k in (1, 2, 3)]
    assert [report["asked"]["unlike"] for report in reports] == [0, 1, 2]
    passages = [report["asked"]["passage"] for report in reports]
    assert passages[0] is None
    assert len(set(passages)) == 3
    together = run("tween", A, B, "--corpus", "ballet", "--alternatives", 3, "--report", "-").json
    assert [report["path"] for report in together] == [report["path"] for report in reports]


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ("--moves 6..", "'6..' is neither a number of moves such as 8 nor a range such as 6..10"),
        ("--moves 6..4", "'6..4' ends before it begins"),
        ("--moves 0", "'0' is neither a number of moves"),
        ("--memory lots", "'lots' is not a size such as 200MB"),
        ("--memory 1MB --node-budget 5", "give one of them"),
        ("--pin left_hip=C", "--pin left_hip=C: give JOINT or JOINT=A"),
        ("--pin left_hip --pin left_hip=B", "left_hip is pinned to A and to B"),
        ("--avoid left_hip", "--avoid left_hip: give JOINT=STATE"),
        ("--via nowhere.json@2", "nowhere.json: cannot be read: there is no such file"),
        ("--novelty 2", "2.0 is not in the range 0<=x<=1"),
    ],
)
def test_what_cannot_be_asked_is_one_line(run: Run, words: str, fault: str) -> None:
    ran = run("tween", A, B, "--corpus", "ballet", *words.split())
    assert ran.code == 2
    assert fault in ran.err
    assert ran.err.count("\n") == 1


def test_no_path_is_exit_code_3_and_names_what_was_asked(run: Run) -> None:
    ran = run("tween", A, B, "--corpus", "ballet", "--via", f"{POSTURES / 'bow.json'}@1", "-o", "out.json")
    assert ran.code == 3
    assert "without via 1 after move 1 there is one" in ran.err
    assert not Path("out.json").exists()
    ran = run("tween", A, B, "--corpus", "ballet", "--hold", "left_ankle")
    assert (ran.code, ran.err.count("\n")) == (3, 1)
    assert "hold left_ankle: A and B have different states there" in ran.err


@pytest.mark.long
def test_ctrl_c_writes_what_was_found(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """The signal comes while the search is at its first piece of work."""
    watched = Interruption.watch

    def press(self: Interruption, so_far: Progress) -> bool:
        if so_far.cost == np.inf:
            os.kill(os.getpid(), signal.SIGINT)
        return watched(self, so_far)

    monkeypatch.setattr(Interruption, "watch", press)
    before = signal.getsignal(signal.SIGINT)
    ran = run("tween", A, B, "--corpus", "ballet", "-o", "out.json", "--report", "r.json", "--alternatives", 3)
    assert ran.code == 130
    assert sorted(path.name for path in Path().iterdir()) == ["out-1.json", "r-1.json"]
    report = json.loads(Path("r-1.json").read_text())
    assert report["status"] == "interrupted"
    assert report["lower_bound"] < report["cost"]
    assert len(read_motion("out-1.json")) > 2
    assert signal.getsignal(signal.SIGINT) is before
