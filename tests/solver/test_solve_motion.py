"""Movements that feet carry, of whole bodies: exact where they are given, and alike where bodies are."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import numpy as np
import pytest
from bodies import ant
from moved import FPS, HUMAN

from motionmind._typing import Floats
from motionmind.body.capsules import capsules_of, legs_depth, penetration
from motionmind.body.contact import lowest_height
from motionmind.body.limbs import limbs_of
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import centre_of_mass
from motionmind.footing.corrections import Correction
from motionmind.footing.ground import Given, Stance
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.solver import motion as module
from motionmind.solver.kinematics import State
from motionmind.solver.motion import Bounds, Synthesis, solve_motion
from motionmind.solver.one_sided import Limits
from motionmind.solver.solve import Problem, solve
from motionmind.solver.terms import Ballistic, Contacts, Term
from motionmind.solver.weights import WEIGHTS, Weights

MOVES = 8
T = TypeVar("T")


def most_of(made: Synthesis, term: str) -> float:
    """The largest residual of a term; 0 if it has none."""
    return max((one.most for one in made.residuals if one.term == term), default=0.0)


class Toy(NamedTuple):
    """A movement on a level floor, as little known of its corpus as may be.

    Attributes:
        rotations: local rotations [N, J, 4].
        far: from the first to the last position of the root [3], metres.
        leap: height of a jump in the middle, metres; 0 for none.
        through: given postures between, by the number of moves that lead there: heights, metres.
    """

    rotations: Floats
    far: tuple[float, float, float] = (0.0, 0.0, 0.0)
    leap: float = 0.0
    through: Mapping[int, float] = MappingProxyType({})
    skeleton: Skeleton = HUMAN

    @property
    def times(self) -> Floats:
        return np.arange(len(self.rotations)) / FPS

    @property
    def stance(self) -> Stance:
        count, limbs = 2 * MOVES + 1, len(limbs_of(self.skeleton)) + 1
        aloft = np.zeros(count)
        aloft[MOVES - 2 : MOVES + 3] = float(self.leap > 0.0)
        still = np.zeros(count), np.ones(count), np.ones((count, limbs))
        drift = np.tile(np.array(self.far) / (2 * MOVES), (2 * MOVES, 1))
        return Stance(np.linspace(0.0, self.times[-1], count), *still, aloft, self.leap * aloft, drift, 0.02)

    @property
    def given(self) -> Given:
        high = -lowest_height(self.skeleton, self.rotations[[0, -1]], np.zeros((2, 3)))
        ends = np.array([0.0, high[0], 0.0]), np.array([0.0, high[1], 0.0]) + self.far
        return Given({0: 0.0, **self.through, MOVES: 0.0}, ends, (None, None))

    @property
    def bounds(self) -> Bounds:
        none = np.zeros(len(self.skeleton), dtype=np.bool_)
        return Bounds(
            none, none, none, np.zeros(len(capsules_of(self.skeleton).pairs())), None, np.inf, np.inf, np.inf, np.inf
        )

    def made(
        self, without: Collection[Correction] = (), before: Synthesis | None = None, weights: Weights = WEIGHTS
    ) -> Synthesis:
        known = self.stance, self.given, self.bounds
        return solve_motion(self.skeleton, self.rotations, self.times, *known, without, before, weights)


def crouching(count: int = 31, depth: float = 0.4) -> Floats:
    """A body that bends its legs and its back, lifts an arm, and comes back."""
    q = np.tile(rot.IDENTITY, (count, len(HUMAN), 1))
    bend = depth * np.sin(np.linspace(0.0, np.pi, count))[:, None]
    turns = {"lumbar": [1.0, 0.0, 0.5], "left_shoulder": [0.0, 0.0, -2.0]}
    for side in ("left", "right"):
        turns |= {f"{side}_hip": [-1.0, 0.0, 0.0], f"{side}_knee": [2.0, 0.0, 0.0], f"{side}_ankle": [-1.0, 0.0, 0.0]}
    for name, turn in turns.items():
        q[:, HUMAN.index(name)] = rot.exp(bend * turn)
    return q


def post() -> Skeleton:
    """A single bone."""
    return Skeleton("post", ("post",), (-1,), np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]))


def snake() -> Skeleton:
    """Bones in a row, without legs."""
    offsets = np.array([[0.0, 0.0, 0.3]] * 5)
    offsets[0] = 0.0
    tips = np.zeros((5, 3))
    tips[-1] = [0.0, 0.0, 0.3]
    return Skeleton("snake", tuple("abcde"), (-1, 0, 1, 2, 3), offsets, tips)


def writhing(skeleton: Skeleton, count: int = 31) -> Floats:
    """Every joint turns and comes back, each about an axis of its own."""
    axes = np.random.default_rng(0).normal(size=(len(skeleton), 3))
    return rot.exp(0.3 * np.sin(np.linspace(0.0, np.pi, count))[:, None, None] * axes)


TOYS: dict[str, Callable[[], Toy]] = {
    "crouches": lambda: Toy(crouching()),
    "walks": lambda: Toy(crouching(45), far=(0.2, 0.0, 0.8)),
    "jumps": lambda: Toy(crouching(45), leap=0.2),
    "passes a posture": lambda: Toy(crouching(49), far=(0.0, 0.0, 0.5), through=MappingProxyType({3: 0.02})),
    "post": lambda: Toy(writhing(post()), skeleton=post()),
    "snake": lambda: Toy(writhing(snake()), far=(0.3, 0.0, 0.0), skeleton=snake()),
    "ant": lambda: Toy(writhing(ant()), far=(0.002, 0.0, 0.0), skeleton=ant()),
    "three frames": lambda: Toy(crouching(3)),
    "two frames": lambda: Toy(crouching(31)[[0, 10]]),
}


@pytest.mark.parametrize("name", TOYS)
def test_given_postures_are_exact_and_rotations_are_units(name: str) -> None:
    toy = TOYS[name]()
    made = toy.made()
    np.testing.assert_allclose(made.rotations[[0, -1]], toy.rotations[[0, -1]], atol=1e-15)
    np.testing.assert_array_equal(made.root[[0, -1]], toy.given.ends)
    np.testing.assert_allclose(np.linalg.norm(made.rotations, axis=-1), 1.0, atol=1e-12)
    assert made.rotations.shape == toy.rotations.shape
    assert np.isfinite(made.root).all()


@pytest.mark.parametrize("name", TOYS)
def test_the_same_movement_is_made_again_to_the_last_bit(name: str) -> None:
    one, other = TOYS[name]().made(), TOYS[name]().made()
    for array in ("rotations", "root", "x", "falls"):
        assert getattr(one, array).tobytes() == getattr(other, array).tobytes()
    assert one.residuals == other.residuals


@pytest.mark.parametrize("name", ["post", "snake", "crouches", "walks"])
def test_bodies_stay_on_the_floor_and_out_of_it(name: str) -> None:
    toy = TOYS[name]()
    made = toy.made()
    np.testing.assert_allclose(lowest_height(toy.skeleton, made.rotations, made.root), 0.0, atol=0.02)


def test_postures_that_are_passed_are_exact() -> None:
    toy = TOYS["passes a posture"]()
    made, frame = toy.made(), 3 * 48 // MOVES
    np.testing.assert_allclose(made.rotations[frame], toy.rotations[frame], atol=1e-15)
    assert lowest_height(HUMAN, made.rotations[frame], made.root[frame]) == pytest.approx(0.02, abs=1e-9)
    assert np.abs(made.x[frame - 1]).max() > 0.0


def test_a_body_that_jumps_falls() -> None:
    toy = TOYS["jumps"]()
    made = toy.made()
    high = lowest_height(HUMAN, made.rotations, made.root) > 0.05
    assert 0.1 < lowest_height(HUMAN, made.rotations, made.root).max() < 0.3
    mass = centre_of_mass(HUMAN, made.rotations, made.root)
    assert mass is not None
    accelerated = FPS**2 * np.diff(mass, 2, axis=0)
    np.testing.assert_allclose(accelerated[high[1:-1]], np.tile([0.0, -GRAVITY_MPS2, 0.0], (high.sum(), 1)), atol=0.5)
    assert lowest_height(HUMAN, *toy.made(["flight"])[:2]).max() < 0.05


class Solved(NamedTuple):
    """What a solve of a window was given."""

    problem: Problem
    terms: list[Term]

    def of(self, kind: type[T]) -> T:
        """Return its term of a kind."""
        (one,) = (term for term in self.terms if isinstance(term, kind))
        return one


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[Solved]:
    """The solves of the test, in order."""
    seen: list[Solved] = []

    def solve_and_note(problem: Problem, terms: list[Term], *known: Any) -> State:
        seen.append(Solved(problem, terms))
        return solve(problem, terms, *known)

    monkeypatch.setattr(module, "solve", solve_and_note)
    return seen


@pytest.mark.parametrize("far", [0.0, 1.0])
def test_a_body_in_the_air_for_a_second_falls_freely(far: float, solved: list[Solved]) -> None:
    """A posture is given at the top: 1.2 m high is half a second from the floor, and another half back to it."""
    made = Toy(crouching(61, 0.3), (0.0, 0.0, far), 1.2, MappingProxyType({MOVES // 2: 1.2})).made()
    falls = solved[0].of(Ballistic).falling
    assert 28 <= falls.sum() <= 31
    mass = centre_of_mass(HUMAN, made.rotations, made.root)
    assert mass is not None
    accelerated = FPS**2 * np.diff(mass, 2, axis=0)[falls]
    np.testing.assert_allclose(accelerated, np.tile([0.0, -GRAVITY_MPS2, 0.0], (len(accelerated), 1)), atol=0.5)
    assert most_of(made, "Ballistic") < 0.5


LEAPS: dict[str, Callable[[], Toy]] = {
    "jumps": TOYS["jumps"],
    "leaps": lambda: Toy(crouching(45), (0.3, 0.0, 0.8), 0.2),
    "is given in the air": lambda: Toy(crouching(61), leap=0.5, through=MappingProxyType({MOVES // 2: 0.5})),
}


@pytest.mark.parametrize("name", LEAPS)
def test_a_foot_in_flight_has_no_target(name: str, solved: list[Solved]) -> None:
    LEAPS[name]().made()
    falls, contacts = 1 + np.flatnonzero(solved[0].of(Ballistic).falling), solved[0].of(Contacts)
    assert len(falls) > 5
    assert not np.isin(falls, contacts.frames).any()
    assert np.isinf(contacts.slips[falls]).all()
    assert np.isinf(contacts.slips[falls - 1]).all()
    on_floor = np.setdiff1d(np.arange(1, len(solved[0].problem.reference) - 1), falls)
    assert np.isin(on_floor, contacts.frames).all()


def test_every_window_has_the_limits_of_all_given_postures(
    monkeypatch: pytest.MonkeyPatch, solved: list[Solved]
) -> None:
    """And of no others, though windows keep the frames that the last one solved."""
    toy = Toy(np.concatenate([crouching(80, depth) for depth in (0.4, 0.2, 0.5)]), through=MappingProxyType({4: 0.0}))
    monkeypatch.setattr(module, "N_WINDOW_FRAMES", 120)
    toy.made()
    assert len(solved) > 2
    assert solved[1].problem.fixed[:2].all()
    given = toy.rotations[[0, 119, 120, 239]]
    for one in solved:
        np.testing.assert_array_equal(one.of(Limits).given, given)


@pytest.mark.parametrize("frames", [3, 4, 6])
def test_legs_of_a_short_movement_may_cross(frames: int) -> None:
    """A movement shorter than the time in which legs pass each other."""
    assert frames <= 2 * module.LEGS_PASS_S * FPS
    swing = np.linspace(-0.3, 0.3, frames)[:, None]
    q = np.tile(rot.IDENTITY, (frames, len(HUMAN), 1))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        q[:, HUMAN.index(f"{side}_hip")] = rot.exp(sign * (swing * [1.0, 0.0, 0.0] + [0.0, 0.0, -0.2]))
    toy = Toy(q)
    made = toy.made()
    np.testing.assert_allclose(made.rotations[[0, -1]], q[[0, -1]], atol=1e-15)
    assert legs_depth(HUMAN, q)[1:-1].max() > legs_depth(HUMAN, made.rotations)[1:-1].max()


@pytest.mark.parametrize("name", ["crouches", "walks", "passes a posture", "post", "snake", "ant"])
def test_a_body_twice_as_large_moves_twice_as_far(name: str) -> None:
    """But for gravity, which is the same for both: nothing is said of flights, nor of balance."""
    toy = TOYS[name]()
    skeleton = replace(toy.skeleton, offsets=2.0 * toy.skeleton.offsets, tips=2.0 * toy.skeleton.tips)
    one = toy.made(["balance", "flight"])
    known = toy.stance.scaled(2.0), toy.given.scaled(2.0), toy.bounds.scaled(2.0)
    other = solve_motion(skeleton, toy.rotations, toy.times, *known, ["balance", "flight"])
    np.testing.assert_allclose(other.rotations, one.rotations, atol=1e-9)
    np.testing.assert_allclose(other.root, 2.0 * one.root, atol=1e-9)


@pytest.mark.parametrize(
    ("correction", "free"),
    [("limbs", {"collision": np.inf}), ("bounce", {"push_vertical": np.inf})],
)
def test_what_is_left_out_is_what_has_an_infinite_standard_deviation(
    correction: Correction, free: dict[str, float]
) -> None:
    toy = TOYS["walks"]()
    left_out, worth_nothing = toy.made([correction]), toy.made(weights=WEIGHTS._replace(**free))
    np.testing.assert_allclose(left_out.rotations, worth_nothing.rotations, atol=1e-9)
    np.testing.assert_allclose(left_out.root, worth_nothing.root, atol=1e-9)


@pytest.mark.long
def test_a_term_that_is_left_out_gives_nothing_and_changes_the_movement() -> None:
    q = crouching()
    inward = np.sin(np.linspace(0.0, np.pi, len(q)))[:, None]
    q[:, HUMAN.index("right_shoulder")] = rot.exp(1.6 * inward * [0.0, 0.3, 1.0])  # a hand goes through a thigh
    toy = Toy(q)
    kept, left_out = toy.made(), toy.made(["limbs"])
    assert most_of(left_out, "Collision") == 0.0
    deepest = [max(depth.max() for depth in penetration(HUMAN, made.rotations).values()) for made in (kept, left_out)]
    assert deepest[1] > 0.05
    assert deepest[0] < 0.01
    walks = TOYS["walks"]()
    assert most_of(walks.made(), "Balance") > 0.0
    assert most_of(walks.made(["balance"]), "Balance") == 0.0
    assert not np.array_equal(walks.made(["balance"]).root, walks.made().root)
    assert not np.array_equal(walks.made(["steps"]).root, walks.made().root)


def test_joints_that_must_not_change_are_the_references() -> None:
    toy = TOYS["walks"]()
    fixed = np.zeros(len(HUMAN), dtype=np.bool_)
    fixed[[HUMAN.index(name) for name in ("left_knee", "lumbar")]] = True
    made = solve_motion(HUMAN, toy.rotations, toy.times, toy.stance, toy.given, toy.bounds._replace(fixed=fixed))
    np.testing.assert_allclose(made.rotations[:, fixed], toy.rotations[:, fixed], atol=1e-15)
    assert rot.angle(made.rotations[:, ~fixed], toy.rotations[:, ~fixed]).max() > 0.05


def test_joints_of_which_something_is_asked_stay_nearer_the_reference() -> None:
    """But for legs, which stand where they must."""
    toy = TOYS["walks"]()
    trunk, legs = (
        np.isin(HUMAN.names, names) for names in (["pelvis", "lumbar"], ["left_hip", "right_hip", "left_knee"])
    )
    made = [
        solve_motion(HUMAN, toy.rotations, toy.times, toy.stance, toy.given, toy.bounds._replace(wished=wished))
        for wished in (trunk & legs, trunk, legs)
    ]
    off = [rot.angle(one.rotations[:, trunk], toy.rotations[:, trunk]).max() for one in made]
    assert off[1] < 0.2 * off[0]
    assert made[2].x.tobytes() == made[0].x.tobytes()


def test_joints_turn_no_faster_than_may_be() -> None:
    toy = Toy(crouching(21, depth=1.0))
    most = np.full(len(HUMAN), 4.0)
    made = solve_motion(HUMAN, toy.rotations, toy.times, toy.stance, toy.given, toy.bounds._replace(fastest=most))

    def fastest(rotations: Floats) -> float:
        return float(FPS * rot.angle(rotations[1:], rotations[:-1]).max())

    assert fastest(toy.rotations) > 5.0
    assert fastest(made.rotations) < fastest(toy.rotations)


def test_movements_that_are_solved_for_in_windows_are_those_solved_for_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    toy = Toy(np.concatenate([crouching(80, depth) for depth in (0.4, 0.2, 0.5)]), through=MappingProxyType({4: 0.0}))
    whole = toy.made()
    monkeypatch.setattr(module, "N_WINDOW_FRAMES", 120)
    parts = toy.made()
    np.testing.assert_allclose(parts.root, whole.root, atol=0.003)
    places = [HUMAN.positions(made.rotations, made.root) for made in (whole, parts)]
    np.testing.assert_allclose(places[1], places[0], atol=0.005)


def test_a_solve_goes_on_from_another() -> None:
    toy = TOYS["walks"]()
    made = toy.made()
    same = made.at(toy.times, toy.times)
    np.testing.assert_allclose(same.x, made.x, atol=1e-9)
    np.testing.assert_allclose(same.falls, made.falls)
    again = toy.made(before=same)
    np.testing.assert_allclose(again.root, made.root, atol=0.01)
    np.testing.assert_allclose(made.at(toy.times, toy.times[:5]).x, made.x[:5], atol=1e-9)


def test_a_solve_goes_on_at_other_times_though_a_joint_hardly_moves() -> None:
    """A joint that turns just enough to be free in one frame, which the slower clock does not have."""
    q = crouching()
    q[15, HUMAN.index("right_shoulder")] = rot.exp(np.array([0.0, 1.02 * module.MOTIONLESS_RAD, 0.0]))
    toy = Toy(q)
    then = np.linspace(0.0, toy.times[-1], 36)
    slower = rot.normalise(rotation_spline(toy.times, q, then))
    made = toy.made().at(toy.times, then)
    solve_motion(HUMAN, slower, then, toy.stance, toy.given, toy.bounds, (), made)


def test_limits_are_widened_to_postures_that_are_passed() -> None:
    """A back that bends farther than backs do, as it is given halfway."""
    q = crouching(49)
    lumbar = HUMAN.index("lumbar")
    q[:, lumbar] = rot.exp(1.3 * np.sin(np.linspace(0.0, np.pi, 49))[:, None] * [-1.0, 0.0, 0.0])
    made = Toy(q, through=MappingProxyType({4: 0.0})).made()
    assert most_of(made, "Limits") < 0.1
    assert rot.angle(made.rotations[22:27, lumbar], q[22:27, lumbar]).max() < np.radians(2.0)


def test_each_term_gives_its_largest_residual_at_a_time_of_the_movement() -> None:
    toy = TOYS["walks"]()
    residuals = toy.made().residuals
    assert residuals
    assert len({one.term for one in residuals}) == len(residuals)
    for one in residuals:
        assert one.most > 0.0
        assert one.unit
        assert np.any(one.at == toy.times)


def test_of_many_joints_those_with_the_longest_reach_are_free() -> None:
    count = 3 * module.MAX_FREE_JOINTS
    offsets = np.tile([0.0, 0.1, 0.0], (count, 1))
    names = tuple(f"joint{number}" for number in range(count))
    chain = Skeleton("chain", names, tuple(range(-1, count - 1)), offsets)
    turned = rot.exp(np.random.default_rng(0).normal(0.0, 0.1, (4, count, 3)))
    for fixed in ([], [0, 7]):
        still = np.isin(np.arange(count), fixed)
        free = np.setdiff1d(np.flatnonzero(~still), 1)[: module.MAX_FREE_JOINTS]  # joint1 is like a collarbone
        np.testing.assert_array_equal(module._freedom(chain, still, turned).joints, np.repeat(free, 3))
