"""Toys whose movement of least squares is known."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import count, repeat
from typing import ClassVar

import numpy as np
import pytest
from moved import FPS, HUMAN, freedom_of, linearised, random_rotations, random_state

from motionmind._typing import Floats
from motionmind.body.capsules import capsules_of, legs_depth
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.solver.collision import Collision
from motionmind.solver.kinematics import Freedom, State, body_of
from motionmind.solver.one_sided import Balance, Floor, Limits
from motionmind.solver.solve import MAX_ITERATIONS_PER_PLAN, Problem, solve
from motionmind.solver.speed_bounds import Speed, Travel
from motionmind.solver.system import Normal
from motionmind.solver.terms import Ballistic, Contacts, Smoothness, Term, Track

N, J = 11, len(HUMAN)
POINTS = len(body_of(HUMAN).owners)
NOWHERE = np.zeros(0, np.int64), np.zeros((N - 1, 0, 2)), np.zeros((N - 1, 0))
ENDS = np.arange(N) % (N - 1) == 0


def problem_of(rotations: Floats, root: Floats, freedom: Freedom | None = None) -> Problem:
    """A movement whose ends are fixed."""
    return Problem(body_of(HUMAN), freedom or freedom_of(HUMAN), rotations, root, ENDS)


def rest(problem: Problem) -> Floats:
    return np.zeros((N, problem.freedom.unknowns))


def standing() -> Problem:
    return problem_of(np.tile(rot.IDENTITY, (N, J, 1)), np.zeros((N, 3)))


def test_a_body_in_the_air_falls_on_a_parabola() -> None:
    rng = np.random.default_rng(0)
    problem = problem_of(random_rotations(HUMAN, N, 0.3, 0), np.linspace([0.0, 1.0, 0.0], [0.5, 1.2, 0.3], N))
    given = problem.state(rest(problem)).mass[[0, -1]]
    sds = rng.uniform(0.5, 1.0, (N, problem.freedom.unknowns))
    fall = Ballistic(FPS, np.ones(N - 2, np.bool_), GRAVITY_MPS2, (np.inf, np.inf), 0.01)
    made = solve(problem, [Track(sds), fall], rest(problem))
    t = np.arange(N) / FPS
    wanted = given[0] + (t / t[-1])[:, None] * (given[1] - given[0])
    wanted[:, 1] += 0.5 * GRAVITY_MPS2 * t * (t[-1] - t)
    np.testing.assert_allclose(made.mass, wanted, atol=1e-4)
    np.testing.assert_allclose(fall.residuals(made), 0.0, atol=0.02)


def test_a_body_on_the_floor_is_accelerated_as_little_as_may_be() -> None:
    """With nothing else to keep to, its mass goes straight on from end to end."""
    problem = problem_of(random_rotations(HUMAN, N, 0.3, 0), np.random.default_rng(0).normal(0.0, 0.1, (N, 3)))
    rests = Ballistic(FPS, np.zeros(N - 2, np.bool_), GRAVITY_MPS2, (0.1, 0.1), 0.1)
    made = solve(problem, [rests], rest(problem))
    np.testing.assert_allclose(made.mass, np.linspace(made.mass[0], made.mass[-1], N), atol=1e-3)


def reaching(state: State, point: int, off: list[float]) -> Contacts:
    target = state.places[5, point] + off
    return Contacts(
        np.array([5]), np.array([point]), target[None], np.full((1, 3), 0.003), np.ones(1, np.bool_), *NOWHERE
    )


@pytest.mark.parametrize("name", ["left_fingers", "right_toes", "atlantal"])
def test_a_point_reaches_its_place_where_nothing_else_pulls(name: str) -> None:
    problem = standing()
    contacts = reaching(problem.state(rest(problem)), HUMAN.index(name), [0.2, 0.3, -0.1])
    made = solve(problem, [contacts], rest(problem))
    np.testing.assert_allclose(made.places[5, HUMAN.index(name)], contacts.targets[0], atol=1e-4)
    np.testing.assert_array_equal(np.delete(made.x, 5, axis=0), 0.0)


def test_an_arm_reaches_where_the_body_must_stay() -> None:
    """The elbow's hinge bends, the shoulder turns, and the root is where it was."""
    problem = standing()
    fingers = HUMAN.index("left_fingers")
    contacts = reaching(problem.state(rest(problem)), fingers, [-0.15, 0.2, 0.1])
    sds = np.full((N, problem.freedom.unknowns), 1e-4)
    for joint in ("left_shoulder", "left_elbow"):
        sds[:, problem.freedom.slices(HUMAN.index(joint))[1]] = 10.0
    made = solve(problem, [Track(sds), contacts], rest(problem), iterations=30)
    np.testing.assert_allclose(made.places[5, fingers], contacts.targets[0], atol=1e-3)
    assert np.abs(made.root).max() < 1e-3


def test_nothing_moves_without_a_reason() -> None:
    problem = standing()
    terms: list[Term] = [Track(np.ones((N, problem.freedom.unknowns))), Smoothness(np.ones(problem.freedom.unknowns))]
    np.testing.assert_array_equal(solve(problem, terms, rest(problem)).x, 0.0)


def test_fixed_frames_keep_the_unknowns_that_they_start_with() -> None:
    problem, start = standing(), random_state(0, 0.1, N).x
    fixed = problem._replace(fixed=np.arange(N) % 3 == 0)
    made = solve(fixed, [Track(np.full(start.shape, 0.1))], start)
    np.testing.assert_array_equal(made.x[fixed.fixed], start[fixed.fixed])
    np.testing.assert_allclose(made.x[~fixed.fixed], 0.0, atol=5e-3)


class Scripted:
    """A term that costs what a script says, whatever the movement, and pulls the root along in every iteration."""

    unit: ClassVar[str] = ""

    def __init__(self, costs: Iterable[float]) -> None:
        self.costs, self.seen = iter(costs), list[Floats]()

    def add(self, state: State, normal: Normal) -> None:
        diagonal = np.arange(state.x.shape[1])
        normal.block(0)[:, diagonal, diagonal] += 1.0
        normal.gradient[:, 0] += 0.1
        normal.cost += next(self.costs)
        self.seen.append(state.x)

    def residuals(self, state: State) -> Floats:
        return np.zeros(len(state.x))


def test_no_iteration_changes_nothing_and_plans_nothing() -> None:
    problem, start, seen = standing(), random_state(0, 0.1, N).x, list[State]()

    def replan(state: State) -> bool:
        seen.append(state)
        return True

    made = solve(problem, [Track(np.full(start.shape, 0.1))], start, replan, 0)
    np.testing.assert_array_equal(made.x, start)
    assert seen == []


def test_terms_are_planned_again_every_few_iterations() -> None:
    falling, looked = Scripted(0.9**k for k in count()), list[int]()

    def replan(state: State) -> bool:
        looked.append(len(falling.seen) - 1)
        return False

    solve(standing(), [falling], rest(standing()), replan, 3 * MAX_ITERATIONS_PER_PLAN)
    assert looked == [MAX_ITERATIONS_PER_PLAN, 2 * MAX_ITERATIONS_PER_PLAN, 3 * MAX_ITERATIONS_PER_PLAN]


def test_terms_are_planned_again_where_the_solve_has_settled_until_nothing_changes() -> None:
    level, looked = Scripted(repeat(1.0)), list[int]()

    def replan(state: State) -> bool:
        looked.append(len(level.seen))
        return len(looked) < 3

    solve(standing(), [level], rest(standing()), replan)
    assert looked == [2, 4, 6]  # before and after each iteration


def test_the_best_movement_since_terms_were_planned_again_is_returned() -> None:
    """A step may raise the cost; costs before and after a plan are of different terms."""
    first, then = [10.0, 5.0, 5.9, 5.7, 5.5], [8.0, 9.0, 7.0, 7.5, 7.3]
    planned = list[Floats]()

    def replan(state: State) -> bool:
        planned.append(state.x)
        return len(planned) == 1

    term = Scripted([*first, *then])
    made = solve(standing(), [term], rest(standing()), replan, 2 * MAX_ITERATIONS_PER_PLAN)
    assert len(term.seen) == 10
    np.testing.assert_array_equal(planned[0], term.seen[1])
    np.testing.assert_array_equal(term.seen[5], term.seen[1])  # the solve goes on from there
    np.testing.assert_array_equal(planned[1], term.seen[7])
    np.testing.assert_array_equal(made.x, term.seen[7])


def test_terms_that_replanning_changes_count_at_once() -> None:
    problem = standing()
    terms: list[Term] = []
    contacts = reaching(problem.state(rest(problem)), 4, [0.1, 0.0, 0.0])

    def replan(state: State) -> bool:
        if terms:
            return False
        terms.append(contacts)
        return True

    made = solve(problem, terms, rest(problem), replan)
    np.testing.assert_allclose(made.places[5, 4], contacts.targets[0], atol=1e-4)


INF = np.inf
FREE: dict[str, Callable[[State], Term]] = {
    "track": lambda state: Track(np.full(state.x.shape, INF)),
    "run": lambda state: Smoothness(np.full(state.x.shape[1], INF)),
    "ballistic": lambda _: Ballistic(FPS, np.arange(N - 2) % 2 == 0, GRAVITY_MPS2, (INF, INF), INF),
    "contacts": lambda state: Contacts(
        np.array([3]),
        np.array([4]),
        np.ones((1, 3)),
        np.full((1, 3), INF),
        np.ones(1, np.bool_),
        np.array([4]),
        np.ones((N - 1, 1, 2)),
        np.full((N - 1, 1), INF),
    ),
    "floor": lambda _: Floor(np.ones(N), INF),
    "balance": lambda _: Balance(
        np.tile(np.arange(POINTS) == 4, (N, 1)), np.full(N, -1.0), 0.0, 0.0, np.zeros((2, N)), GRAVITY_MPS2, FPS, INF
    ),
    "limits": lambda _: Limits(np.tile(rot.IDENTITY, (2, J, 1)), np.zeros(J, np.bool_), INF),
    "speed": lambda _: Speed(np.full(J, 0.1), 0.1, FPS, INF),
    "travel": lambda _: Travel(1, np.ones(3), 0.1, np.zeros(N - 1, np.bool_), FPS, INF),
    "travel, accelerated": lambda _: Travel(2, np.ones(3), 0.1, np.zeros(N - 2, np.bool_), FPS, INF),
    "collision": lambda _: Collision(np.zeros(len(capsules_of(HUMAN).pairs())), INF, 4),
}


@pytest.mark.parametrize("name", FREE)
def test_a_term_of_infinite_standard_deviation_changes_nothing(name: str) -> None:
    problem = problem_of(random_rotations(HUMAN, N, 0.4, 1), np.random.default_rng(1).normal(0.0, 0.1, (N, 3)))
    start = problem.state(rest(problem))
    others: list[Term] = [Track(np.full(start.x.shape, 0.3)), reaching(start, 4, [0.1, 0.0, 0.1])]
    free = FREE[name](start)
    assert linearised(free, start).cost == 0.0
    alone, both = solve(problem, others, rest(problem)), solve(problem, [*others, free], rest(problem))
    np.testing.assert_allclose(both.x, alone.x, atol=1e-9)


def test_legs_in_each_other_come_apart() -> None:
    rotations = np.tile(rot.IDENTITY, (N, J, 1))
    inward = 0.25 * np.sin(np.linspace(0.0, np.pi, N))[:, None]
    rotations[:, HUMAN.index("left_hip")] = rot.exp(-inward * [0.1, 0.0, 1.0])
    rotations[:, HUMAN.index("right_hip")] = rot.exp(inward * [0.2, 0.0, 1.0])
    problem = problem_of(rotations, np.zeros((N, 3)))
    collision = Collision(np.full(len(capsules_of(HUMAN).pairs()), 0.005), 0.0025, 4)
    terms: list[Term] = [
        Track(np.full((N, problem.freedom.unknowns), 0.3)),
        Smoothness(np.full(problem.freedom.unknowns, 0.05)),
        collision,
    ]
    assert collision.residuals(problem.state(rest(problem))).max() > 3.0
    assert collision.residuals(solve(problem, terms, rest(problem))).max() < 0.2


def between(rotations: Floats, parts: int = 10) -> Floats:
    """The same movement, so many times as many frames."""
    then = np.arange(parts * (len(rotations) - 1) + 1) / parts
    return rotation_spline(np.arange(float(len(rotations))), rotations, then)


def swapping(forward: float, inward: float, frames: float) -> Floats:
    """Legs of which each swings to the other's side, by angles in radians, in so many frames around the middle."""
    rotations = np.tile(rot.IDENTITY, (N, J, 1))
    side = np.clip((np.arange(N) - 0.5 * (N - 2)) / (0.5 * frames), -1.0, 1.0)[:, None]
    rotations[:, HUMAN.index("left_hip")] = rot.exp(side * [forward, 0.0, 0.0] + [0.0, 0.0, -inward])
    rotations[:, HUMAN.index("right_hip")] = rot.exp(side * [-forward, 0.0, 0.0] + [0.0, 0.0, inward])
    return rotations


@pytest.mark.parametrize(
    ("rotations", "frames_show_it"),
    [
        (swapping(0.1, 0.11, 1.0), False),
        pytest.param(swapping(0.3, 0.2, 8.0), True),
    ],
    ids=["between two frames", "in eight frames"],
)
def test_legs_that_swap_sides_are_pulled_apart(rotations: Floats, frames_show_it: bool) -> None:
    """Through each other between two frames, too, though they overlap in none."""
    assert (legs_depth(HUMAN, rotations).max() > 0.005) == frames_show_it
    assert legs_depth(HUMAN, between(rotations)).max() > 0.06
    problem = problem_of(rotations, np.zeros((N, 3)))
    terms: list[Term] = [
        Track(np.full((N, problem.freedom.unknowns), 0.3)),
        Smoothness(np.full(problem.freedom.unknowns, 0.05)),
        Collision(np.full(len(capsules_of(HUMAN).pairs()), 0.005), 0.0025, 4),
    ]
    made = solve(problem, terms, rest(problem))
    assert legs_depth(HUMAN, between(made.rotations)).max() < 0.02


def test_a_step_stops_at_a_bound_and_not_before_it() -> None:
    """A body that is to go from 6 cm above the floor to 5 cm below it, in one iteration."""
    problem = standing()
    lowest = problem.state(rest(problem)).places[..., 1].min()
    floor = Floor(np.full(N, lowest + 0.05), 0.001)
    above = rest(problem)
    above[1:-1, 1] = 0.11
    sds = np.full((N, problem.freedom.unknowns), 0.5)
    made = solve(problem, [Track(sds), floor], above, iterations=1)
    assert np.abs(made.places[1:-1, :, 1].min(axis=1) - floor.floor[1:-1]).max() < 0.002


def test_what_is_too_fast_slows_down_by_the_time_it_has() -> None:
    """The fast middle of a turn is spread over its slow beginning and end."""
    turn = np.interp(np.arange(N), [0.0, 4.0, 6.0, N - 1.0], [0.0, 0.0, 0.9, 0.9])
    rotations = np.tile(rot.IDENTITY, (N, J, 1))
    shoulder = HUMAN.index("left_shoulder")
    rotations[:, shoulder] = rot.exp(turn[:, None] * [0.0, 1.0, 0.0])
    problem = problem_of(rotations, np.zeros((N, 3)))
    speed = Speed(np.full(J, 4.0), 4.0, FPS, 0.05)
    made = solve(problem, [Track(np.full((N, problem.freedom.unknowns), 0.5)), speed], rest(problem))
    assert speed.residuals(problem.state(rest(problem))).max() > 500.0
    assert speed.residuals(made).max() < 5.0
    np.testing.assert_allclose(made.rotations[[0, -1]], rotations[[0, -1]])
