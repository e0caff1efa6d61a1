"""The baseline: whole postures in the order of the corpus, beside joints that move on their own."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import networkx as nx
import numpy as np
import pytest
from bundled_clips import BALLET
from command_line import Run
from toys import Toy, random_toy

from motionmind.body.motion import Motion, Posture
from motionmind.errors import InfeasibleError, MotionMindError, NoPathError
from motionmind.geometry import rotations as rot
from motionmind.search.solve import solve
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween
from motionmind.tween.whole_body import find_bodies, nearest_posture, solve_whole_body

ARABESQUE, FIFTH = (BALLET / "postures" / f"{name}.json" for name in ("arabesque", "fifth"))


def posture(engine: Engine, index: int) -> Posture:
    return Posture(engine.corpus.skeleton, engine.corpus.rotations[index], engine.corpus.root[index])


def between(engine: Engine, a: int, b: int, **options: Any) -> Tween:
    return engine.tween(posture(engine, a), posture(engine, b), whole_body=True, **options)


@pytest.fixture(scope="module")
def insects() -> Engine:
    return Engine.load("walk-hexapod")


# --- toys: a corpus is a random walk that the body's own edges allow --------------------------------------------------


def walk(toy: Any, rng: np.random.Generator, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """States [N, L] of a walk through a toy's joint states that begins at its start, in clips, and where moves begin;
    every move is one that every chain has an edge for, and every pair of states one with a discount or none."""
    states, begins = [np.array(toy.start)], []
    while len(states) < steps:
        nexts = [np.flatnonzero(np.isfinite(table[s])) for table, s in zip(toy.edges, states[-1], strict=True)]
        if all(map(len, nexts)) and rng.random() > 0.1:
            begins.append(len(states) - 1)
            states.append(np.array([rng.choice(options) for options in nexts]))
        else:
            states.append(np.array([rng.integers(size) for size in toy.sizes]))
    return np.array(states, dtype=np.int32), np.array(begins, dtype=np.int64)


@pytest.mark.parametrize("seed", range(40))
def test_the_optimum_is_that_of_all_walks_through_the_bodies(seed: int) -> None:
    rng, toy = np.random.default_rng(seed), random_toy(seed, most=4)
    if seed % 2:  # moves that are frequent may cost less than nothing, as the papers print them
        toy = replace(toy, edges=tuple(table - 1.5 for table in toy.edges))
    states, begins = walk(toy, rng, 60)
    # Every pair of states that stands together is listed, as in what is learned from these postures.
    listed = [table.copy() for table in toy.corrections]
    for chain, parent in enumerate(toy.parents):
        for body in states:
            if parent >= 0 and listed[chain][body[parent], body[chain]] == 0.0:
                listed[chain][body[parent], body[chain]] = -1e-3
    toy = replace(toy, corrections=tuple(listed), goal=tuple(map(int, states[rng.integers(60)])))
    bodies = find_bodies(states, begins, begins + 1)
    graph = nx.DiGraph((tuple(map(int, states[i])), tuple(map(int, states[i + 1]))) for i in begins)
    for shortest, longest in ((1, 7), (4, 4)):
        problem = toy.problem(toy.rules(shortest, longest))
        least = np.inf
        value = {toy.start: 0.0}
        for t in range(1, longest + 1):  # forwards, over dictionaries of bodies
            after: dict[tuple[int, ...], float] = {}
            for body, cost in value.items():
                for target in graph.successors(body) if body in graph else ():
                    step = np.array([toy.start, body, target])[1:]
                    paid = sum(toy.moves(j)[step[0, j], step[1, j]] for j in range(len(toy.parents)))
                    paid += sum(toy.coupling(j)[step[1, p], step[1, j]] for j, p in enumerate(toy.parents) if p >= 0)
                    after[target] = min(after.get(target, np.inf), cost + paid)
            value = after
            if t >= shortest and toy.goal in value:
                least = min(least, value[toy.goal] + toy.per_move * t)
        if np.isinf(least):
            with pytest.raises(InfeasibleError):
                solve_whole_body(problem, bodies)
            continue
        found = solve_whole_body(problem, bodies)
        assert found.cost == pytest.approx(least, abs=1e-9)
        assert toy.cost(found.path) == pytest.approx(found.cost, abs=1e-9)
        assert found.status == "optimal"
        assert solve(problem).lower_bound <= found.cost + 1e-6


def test_a_long_way_may_be_the_cheapest_where_moves_cost_less_than_nothing() -> None:
    """From 0 to 5 at once, or by five moves of which only the last is dear."""
    table = np.full((6, 6), np.inf)
    table[0, 5], table[4, 5] = 0.5, 4.0
    table[np.arange(4), np.arange(1, 5)] = -2.0
    none = np.zeros(6)
    toy = Toy((-1,), (table,), (none,), (none,), (np.zeros((1, 6)),), (0,), (5,), wait=9.0, per_move=0.5)
    states, begins = np.array([[0], [1], [2], [3], [4], [5], [0], [5]], dtype=np.int32), np.array([0, 1, 2, 3, 4, 6])
    found = solve_whole_body(toy.problem(toy.rules(1, 8)), find_bodies(states, begins, begins + 1))
    assert found.path[:, 0].tolist() == [0, 1, 2, 3, 4, 5]
    assert found.cost == pytest.approx(4.0 - 8.0 + 5 * 0.5)


# --- recorded bodies --------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_it_goes_through_whole_postures_in_their_order_and_is_never_cheaper(insects: Engine) -> None:
    rng, joints = np.random.default_rng(2), len(insects.corpus.skeleton)
    moves = insects.corpus.moves
    made = {
        (insects.states[i, :joints].tobytes(), insects.states[k, :joints].tobytes())
        for i, k in zip(moves.begins, moves.ends, strict=True)
    }
    joined = 0
    for a, b in rng.integers(len(insects.corpus), size=(12, 2)):
        try:
            tween = between(insects, a, b)
        except NoPathError:
            continue
        joined += 1
        path = np.ascontiguousarray(tween.path[:, :joints])
        assert all((before.tobytes(), after.tobytes()) in made for before, after in pairwise(path))
        assert tween.costs.total == pytest.approx(tween.cost, abs=1e-6)
        assert (tween.status, tween.lower_bound) == ("optimal", tween.cost)
        assert {bridge.joint for bridge in tween.bridges} <= {"facing"}
        free = insects.tween(posture(insects, a), posture(insects, b), without=["pace"], guide=0.0)
        assert free.lower_bound <= tween.cost + 1e-6
        np.testing.assert_array_equal(tween.motion.rotations[[0, -1]], insects.corpus.rotations[[a, b]])
    assert joined >= 6


def test_two_postures_of_a_clip_are_joined_at_most_as_the_clip_does(insects: Engine) -> None:
    clip = insects.corpus.clips[0]
    tween = between(insects, clip.start + 2, clip.start + 9)
    assert tween.moves <= 7
    fixed = between(insects, clip.start + 2, clip.start + 9, moves=7)
    assert fixed.moves == 7
    assert fixed.cost >= tween.cost - 1e-9


def test_a_posture_goes_to_the_nearest_one(insects: Engine) -> None:
    corpus = insects.corpus
    for index in (0, 40, 200):
        found = nearest_posture(corpus, corpus.rotations[index])
        np.testing.assert_allclose(
            corpus.to_chains(corpus.rotations[found])[:-1], corpus.to_chains(corpus.rotations[index])[:-1], atol=1e-9
        )


def test_without_a_way_the_ends_and_what_comes_nearest_are_named() -> None:
    engine = Engine.load("ballet")
    first, last = engine.corpus.clips[0], engine.corpus.clips[-1]
    with pytest.raises(NoPathError) as refused:
        between(engine, last.stop - 1, first.start + 7, max_moves=2)
    text = str(refused.value)
    assert text.startswith("no path from A to B in at most 2 moves through whole postures (")
    assert f"posture 7 of {first.label}, nearest to B" in text
    assert " moves lie between " in text
    # Two clips that share no body.
    clips = [engine.corpus.motion(clip) for clip in engine.corpus.clips if clip.name in ("jump", "plies")]
    apart = Engine.fit([clips[0].slice(0, 4), clips[1].slice(5, 12)], facing="stage")
    with pytest.raises(NoPathError, match=r"none in common; the nearest are posture \d+ of .* degrees a joint apart"):
        between(apart, 0, len(apart.corpus) - 1)
    assert apart.tween(posture(apart, 0), posture(apart, len(apart.corpus) - 1)).moves >= 1


def test_where_whole_bodies_take_another_number_of_moves_it_says_so() -> None:
    clip = Engine.load("ballet").corpus
    motion = clip.motion(next(one for one in clip.clips if one.name == "plies")).slice(0, 5)
    thread = Engine.fit([motion], facing="stage")
    assert len(np.unique(thread.states, axis=0)) == 5
    assert between(thread, 0, 4, moves=4).moves == 4
    with pytest.raises(NoPathError, match=r"4 moves lie between .*, but not in the requested number"):
        between(thread, 0, 4, moves=6)
    with pytest.raises(NoPathError, match=r"4 moves lie between [^,]*, nearest to A, and [^,]*, nearest to B$"):
        between(thread, 0, 4, moves=3)


def test_the_nearest_posture_has_the_least_sum_of_squares() -> None:
    """Of two postures, one has a joint far off, the other has all a little off: more in sum, less in squares."""
    engine = Engine.load("ballet")
    body, rest = engine.corpus.skeleton, engine.corpus.rotations[0]
    one, all_ = rest.copy(), rot.mul(rest, rot.from_axis_angle([1.0, 0.0, 0.0], np.full(len(body), 0.1)))
    one[5] = rot.mul(rest[5], rot.from_axis_angle([1.0, 0.0, 0.0], 0.8))
    root = np.zeros((2, 3))
    pair = Engine.fit([Motion(body, np.stack([one, all_]), root, np.array([0.0, 0.4]), "pair")], facing="stage")
    assert nearest_posture(pair.corpus, rest) == 1


@pytest.mark.long
def test_the_command_takes_it_and_refuses_the_problem_with_it(run: Run) -> None:
    ran = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "--whole-body", "--report", "-")
    assert ran.code == 0
    free = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "--without", "pace", "--report", "-")
    assert ran.json["cost"] > free.json["lower_bound"]
    both = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "--whole-body", "--problem", "a.cfn")
    assert both.code == 2
    assert "--whole-body" in both.err


def test_options_are_checked_with_it_too(insects: Engine) -> None:
    with pytest.raises(MotionMindError, match="moves must be"):
        between(insects, 0, 5, moves=0)
