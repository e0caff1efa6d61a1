"""What each term wants, and that its gradient is that of its cost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from moved import FPS, HUMAN, differences, freedom_of, linearised, moved, random_state

from motionmind._typing import Floats, Indices
from motionmind.body.capsules import capsules_of, legs_depth, pair_depths
from motionmind.body.legs import find_hinge
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.geometry import rotations as rot
from motionmind.solver import collision as module
from motionmind.solver.collision import Collision
from motionmind.solver.kinematics import Freedom, State, body_of
from motionmind.solver.one_sided import Balance, Floor, Limits, OneSided
from motionmind.solver.reaches import Reaches
from motionmind.solver.speed_bounds import Speed, Travel
from motionmind.solver.system import Normal
from motionmind.solver.terms import Ballistic, Contacts, Smoothness, Term, Track

N, J = 6, len(HUMAN)
LEVEL = np.array([1.0, 0.0, 1.0])
POINTS = len(body_of(HUMAN).owners)
PAIRS = len(capsules_of(HUMAN).pairs())
USUAL_M = 0.005  # overlap of limbs that is allowed
RNG = np.random.default_rng(0)
UNKNOWNS = freedom_of(HUMAN).unknowns


def posture(**turned: list[float]) -> Floats:
    """Local rotations of N frames alike [N, J, 4], some joints of which are turned by vectors."""
    q = np.tile(rot.IDENTITY, (N, J, 1))
    for name, vector in turned.items():
        q[:, HUMAN.index(name)] = rot.exp(np.array(vector))
    return q


def at_rest(rotations: Floats, freedom: Freedom | None = None) -> State:
    """A movement that is its reference, its root at 0."""
    freedom = freedom or freedom_of(HUMAN)
    return State(
        body_of(HUMAN), freedom, rotations, np.zeros((len(rotations), 3)), np.zeros((len(rotations), freedom.unknowns))
    )


def contacts(state: State, off: float, sds: Floats, **changes: Any) -> Contacts:
    """Points that are to be about so far from where they are, and to move at random."""
    frames = np.repeat(np.arange(N), len(sds) // N)
    points = np.arange(len(frames)) * 7 % POINTS
    targets = state.places[frames, points] + off * np.random.default_rng(1).normal(size=(len(frames), 3))
    slips = np.where(np.arange(3 * N - 3).reshape(-1, 3) % 3 == 1, np.inf, 0.1)
    moves = np.random.default_rng(2).normal(size=(N - 1, 3, 2))
    stands = np.arange(len(frames)) % 2 == 0
    return Contacts(frames, points, targets, sds, stands, np.array([3, 4, POINTS - 1]), moves, slips, **changes)


def reaching(state: State, off: float) -> Reaches:
    """Joints that are to be about so far from where they are, at and between frames."""
    first, joints = np.array([1, 1, 3]), np.array([5, 9, 14])
    places = state.places[first, joints] + off * np.random.default_rng(1).normal(size=(3, 3))
    return Reaches(first, np.array([[1.0, 0.0], [0.3, 0.7], [0.5, 0.5]]), joints, places, 0.01, 0.02)


ALIKE = np.tile(RNG.uniform(0.01, 0.1, (4 * N, 1)), 3)
LEVEL_FREE = np.where([True, False, True], np.inf, ALIKE)
SOME = RNG.random(N) < 0.4
FASTEST = np.where(np.arange(J) % 5 == 4, np.inf, 3.0)

SMOOTH: dict[str, Callable[[State], Term]] = {
    "track": lambda _: Track(np.random.default_rng(0).uniform(0.1, 1.0, (N, UNKNOWNS))),
    "run": lambda _: Smoothness(np.random.default_rng(0).uniform(0.1, 1.0, UNKNOWNS)),
    "ballistic": lambda _: Ballistic(FPS, SOME[1:-1], GRAVITY_MPS2, (2.0, 3.0), 0.15),
    "ballistic without bounce": lambda _: Ballistic(FPS, SOME[1:-1], GRAVITY_MPS2, (2.0, np.inf), 0.15),
    "contacts near": lambda state: contacts(state, 0.01, ALIKE * [1.0, 0.1, 1.0]),
    "contacts far": lambda state: contacts(state, 0.2, ALIKE),
    "contacts far, height firmer": lambda state: contacts(state, 0.2, ALIKE * [1.0, 0.1, 1.0]),
    "contacts far, free": lambda state: contacts(state, 0.2, LEVEL_FREE),
    "reaches near": lambda state: reaching(state, 0.001),
    "reaches far": lambda state: reaching(state, 0.5),
    "floor": lambda _: Floor(np.linspace(-0.5, 0.5, N), 0.01),
    "speed": lambda _: Speed(FASTEST, float(FASTEST[0]), FPS, 0.05),
    "travel": lambda _: Travel(1, LEVEL, 20.0, SOME[1:], FPS, 0.02),
    "travel, accelerated": lambda _: Travel(2, np.ones(3), 900.0, SOME[1:-1], FPS, 0.2),
}


def assert_gradient(term: Term, state: State, columns: Indices | slice = slice(None)) -> None:
    """Fail unless the gradient in inner frames is the cost's, and not zero; ends do not move in a solve."""
    given = linearised(term, state).gradient[1:-1, columns]
    wanted = 0.5 * differences(lambda there: linearised(term, there).cost, state)[1:-1, columns]
    assert np.abs(wanted).max() > 0.0
    np.testing.assert_allclose(given, wanted, atol=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("name", SMOOTH)
def test_a_gradient_is_that_of_the_cost(name: str) -> None:
    state = random_state(1, 0.2, N)
    assert_gradient(SMOOTH[name](state), state)


@pytest.mark.parametrize("seed", range(3))
def test_the_gradient_of_balance_is_exact_but_for_how_the_support_moves(seed: int) -> None:
    """And for a higher mass's longer lever, which turns no row of a body that is at rest."""
    state = at_rest(np.repeat(random_state(seed, 0.2).rotations[:1], N, axis=0))
    touches = np.zeros((N, POINTS), dtype=np.bool_)
    touches[:, [HUMAN.index(name) for name in ("left_toes", "left_ankle", "right_toes")]] = True
    floor = np.full(N, state.places[0, :, 1].min())
    term = Balance(touches, floor, 0.01, 0.04, np.zeros((2, N)), GRAVITY_MPS2, FPS, 0.005)
    trunk = [HUMAN.index(name) for name in ("lumbar", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow")]
    assert_gradient(term, state, 3 + np.flatnonzero(np.isin(state.freedom.joints, trunk)))
    assert term.residuals(state).max() > 1.0


def test_the_gradient_of_limits_is_exact_for_hinges() -> None:
    knees = [HUMAN.index("left_knee"), HUMAN.index("right_knee")]
    axes = [find_hinge(HUMAN, knee) for knee in knees]
    assert axes[0] is not None
    freedom = Freedom(np.array(knees), np.array(axes))
    bent = [-0.3 * axes[0], np.zeros(3)]
    state = at_rest(posture(left_knee=bent[0].tolist()), freedom)
    term = Limits(posture()[:2], np.zeros(J, dtype=np.bool_), 0.03)
    assert_gradient(term, state)
    assert 10.0 < term.residuals(state).max() < np.degrees(0.3)


@pytest.mark.parametrize("turned", [{"left_hip": [-0.3, 0.2, -1.0]}, {"lumbar": [0.2, 1.2, 0.1]}])
def test_limits_of_ball_joints_pull_back_to_within_them(turned: dict[str, list[float]]) -> None:
    """Angles are clipped one by one, which is not the nearest rotation: the gradient is the cost's but for an angle."""
    state = at_rest(posture(**turned))
    term = Limits(posture()[:2], np.zeros(J, dtype=np.bool_), 0.03)
    given = linearised(term, state).gradient[1:-1]
    wanted = 0.5 * differences(lambda there: linearised(term, there).cost, state)[1:-1]
    cosine = np.sum(given * wanted, axis=1) / np.linalg.norm(given, axis=1) / np.linalg.norm(wanted, axis=1)
    assert cosine.min() > 0.9


def untapered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let capsules be as thick at both ends: where axes are nearest is then where capsules are deepest."""
    own = capsules_of(HUMAN)
    even = own._replace(radii=np.repeat(own.radii[:, :1], 2, axis=1))
    monkeypatch.setattr(module, "capsules_of", lambda skeleton: even)


def test_the_gradient_of_a_collision_is_exact_but_for_tapering_limbs(monkeypatch: pytest.MonkeyPatch) -> None:
    """An arm in the trunk and a thigh, and legs apart."""
    untapered(monkeypatch)
    inward = posture(left_hip=[0.1, 0.0, 0.1], right_hip=[-0.1, 0.1, -0.1], right_shoulder=[0.05, 0.0, 1.8])
    inward[[0, -1]] = rot.IDENTITY
    state = at_rest(inward)
    term = collision()
    assert_gradient(term, state)
    assert term.residuals(state).max() > 1.0
    assert not np.any(term._planes)


def test_the_gradient_of_legs_on_a_plane_is_exact_but_for_how_nearest_points_move(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    state, at = crossing(), list[Floats]()

    def held(ends: Floats, radii: Floats, pairs: Indices) -> tuple[Floats, Floats, Floats]:
        """Depths and directions between the points that were nearest first."""
        at.append(pair_depths(ends, radii, pairs)[2])
        where = ends[:, pairs, 0] + at[0][..., None] * (ends[:, pairs, 1] - ends[:, pairs, 0])
        apart = where[:, :, 0] - where[:, :, 1]
        far = np.linalg.norm(apart, axis=2)
        thick = radii[pairs, 0] + at[0] * (radii[pairs, 1] - radii[pairs, 0])
        return thick.sum(axis=2) - far, apart / far[..., None], at[0]

    monkeypatch.setattr(module, "pair_depths", held)
    term = collision()
    assert_gradient(term, state)
    assert np.any(term._planes)


def collision(around: int = 2) -> Collision:
    """Limbs that may overlap by `USUAL_M`."""
    return Collision(np.full(PAIRS, USUAL_M), 0.0025, around)


def crossing(inward: float = 0.25) -> State:
    """Legs that change sides through each other, turned inward by an angle in radians."""
    q = posture()
    swing = np.linspace(-0.3, 0.3, N)[:, None]
    q[:, HUMAN.index("left_hip")] = rot.exp(np.array([0.0, 0.0, -inward]) + swing * [1.0, 0.0, 0.0])
    q[:, HUMAN.index("right_hip")] = rot.exp(np.array([0.0, 0.1, inward]) - swing * [1.0, 0.0, 0.0])
    return at_rest(q)


def test_legs_that_would_pass_through_each_other_part_to_the_sides_of_their_hips() -> None:
    state = crossing()
    term = collision()
    normal = linearised(term, state)
    deep = np.flatnonzero(term.residuals(state) > 0.0)
    assert len(deep) > 0
    step = normal.step(0.3, ~np.isin(np.arange(N), deep))
    there = at_rest(state.rotations)
    there = State(there.body, there.freedom, state.rotations, there.root, step)
    knees = [HUMAN.index("left_knee"), HUMAN.index("right_knee")]
    apart = [one.places[deep][:, knees[0], 0] - one.places[deep][:, knees[1], 0] for one in (state, there)]
    assert np.all(apart[1] > apart[0] + 0.01)


def test_planes_are_unit_vectors_around_legs_that_meet_and_nowhere_else() -> None:
    q = np.concatenate([posture(), crossing().rotations, posture()])
    term = collision(around=1)
    term.separate(at_rest(q))
    meets = np.flatnonzero(legs_depth(HUMAN, q) > USUAL_M)
    near = np.abs(np.arange(len(q))[:, None] - meets).min(axis=1) <= 1
    assert 0 < near.sum() < len(q)
    np.testing.assert_allclose(np.linalg.norm(term._planes, axis=1), near, atol=1e-12)


def test_a_plane_turns_through_the_hips_only_between_opposite_sides() -> None:
    """Legs that meet from in front and part behind open; legs that touch on one side stay on it."""
    q = crossing().rotations
    opens, stays = collision(), collision()
    opens.separate(crossing(0.7))  # feet are on the wrong sides: the short way would leave them there
    stays.separate(at_rest(np.concatenate([q[:3], q[2::-1]])))
    assert opens._planes[0, 2] * opens._planes[-1, 2] < 0.0
    assert opens._planes[:, 0].max() > 0.95
    np.testing.assert_allclose(stays._planes, np.tile(stays._planes[0], (N, 1)), atol=0.02)


def test_legs_that_have_come_apart_stay_on_their_sides() -> None:
    term = collision()
    term.separate(crossing())
    planes = term._planes.copy()
    assert np.any(planes)
    term.separate(at_rest(posture()))
    np.testing.assert_array_equal(term._planes, planes)


@pytest.mark.long
def test_the_cost_of_legs_that_come_near_does_not_jump() -> None:
    """A thousandth of a step changes it by a thousandth, or a few; else whole steps are refused."""
    state, term = crossing(), collision()
    linearised(term, state)
    step = np.zeros(state.x.shape)
    for name, sign in (("left_hip", -1.0), ("right_hip", 1.0)):
        step[1:-1, state.freedom.slices(HUMAN.index(name))[1].start + 2] = -0.3 * sign
    costs = [linearised(term, moved(state, share * step)).cost for share in np.linspace(-1.0, 1.0, 1001)]
    assert np.abs(np.diff(costs)).max() < 0.02 * np.ptp(costs)


@pytest.mark.parametrize("frames", [2, 3, N])
def test_planes_that_turn_for_longer_than_a_movement_lasts_turn_throughout(frames: int) -> None:
    state = at_rest(crossing().rotations[(N - frames) // 2 : (N + frames) // 2])
    planes = []
    for around in (frames, 2 * frames + 1, 20 * frames):
        term = collision(around=around)
        term.separate(state)
        planes.append(term._planes)
    assert np.all(np.linalg.norm(planes[0], axis=1) > 0.5)
    assert planes[0].shape == (frames, 3)
    np.testing.assert_array_equal(planes[1], planes[0])
    np.testing.assert_array_equal(planes[2], planes[0])


# --- what is satisfied --------------------------------------------------------------------------------------------


def satisfied() -> dict[str, tuple[Term, State]]:
    """Every term with a movement that is as it wants."""
    state = at_rest(posture(right_hip=[0.0, 0.0, -0.1]))
    floor = np.full(N, state.places[..., 1].min())
    feet = np.flatnonzero(state.places[0, :, 1] < floor[0] + 0.1)
    frames, points = np.repeat(np.arange(N), len(feet)), np.tile(feet, N)
    still = np.zeros((N - 1, len(feet), 2)), np.full((N - 1, len(feet)), 0.01)
    placed = Contacts(
        frames,
        points,
        state.places[frames, points],
        np.full((len(frames), 3), 0.003),
        np.ones(len(frames), np.bool_),
        feet,
        *still,
    )
    touches = np.zeros((N, POINTS), dtype=np.bool_)
    touches[:, feet] = True
    fell = at_rest(state.rotations)
    fell = State(fell.body, fell.freedom, fell.rotations, fell.root, fell.x.copy())
    fell.x[:, 1] = -0.5 * GRAVITY_MPS2 * (np.arange(N) / FPS) ** 2
    fell = State(fell.body, fell.freedom, fell.rotations, fell.root, fell.x)
    return {
        "track": (Track(np.ones((N, UNKNOWNS))), state),
        "run": (Smoothness(np.ones(UNKNOWNS)), state),
        "ballistic, on the floor": (Ballistic(FPS, np.zeros(N - 2, np.bool_), GRAVITY_MPS2, (2.0, 2.0), 0.1), state),
        "ballistic, in the air": (Ballistic(FPS, np.ones(N - 2, np.bool_), GRAVITY_MPS2, (2.0, 2.0), 0.1), fell),
        "contacts": (placed, state),
        "floor": (Floor(floor - 0.01, 0.003), state),
        "balance": (Balance(touches, floor, 0.02, 0.04, np.zeros((2, N)), GRAVITY_MPS2, FPS, 0.005), state),
        "limits": (Limits(posture()[:2], np.zeros(J, np.bool_), 0.03), state),
        "limits, loose": (Limits(posture()[:2], np.ones(J, np.bool_), 0.03), random_state(0, 1.0, N)),
        "limits, given": (Limits(random_state(0, 1.0, N).rotations, np.zeros(J, np.bool_), 0.03), random_state(0, 1.0)),
        "speed": (Speed(np.full(J, 1.0), 1.0, FPS, 0.05), state),
        "speed, any": (Speed(np.full(J, np.inf), np.inf, FPS, 0.05), random_state(0, 1.0, N)),
        "travel": (Travel(1, LEVEL, 1.0, np.zeros(N - 1, np.bool_), FPS, 0.02), fell),
        "travel, free": (Travel(2, np.ones(3), 1.0, np.ones(N - 2, np.bool_), FPS, 0.2), random_state(0, 1.0, N)),
        "collision": (Collision(np.full(PAIRS, 0.03), 0.0025, 2), state),
        "collision, usual": (Collision(np.full(PAIRS, 1.0), 0.0025, 2), random_state(0, 1.0, N)),
    }


@pytest.mark.parametrize("name", satisfied())
def test_a_term_that_is_satisfied_gives_nothing_and_pulls_at_nothing(name: str) -> None:
    term, state = satisfied()[name]
    np.testing.assert_allclose(term.residuals(state), 0.0, atol=1e-6)
    normal = linearised(term, state)
    assert normal.cost == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(normal.gradient, 0.0, atol=1e-6)


def test_terms_say_by_how_much_they_give() -> None:
    state = at_rest(posture(left_elbow=[0.0, 0.5, 0.0]))
    lowest = state.places[..., 1].min()
    falling = np.array([True, False, False, False])
    assert Floor(np.full(N, lowest + 0.05), 0.01).residuals(state) == pytest.approx(5.0)
    np.testing.assert_allclose(
        Ballistic(FPS, falling, GRAVITY_MPS2, (2.0, 2.0), 0.1).residuals(state), GRAVITY_MPS2 * (np.arange(N) == 1)
    )
    turning = State(state.body, state.freedom, state.rotations, state.root, np.arange(N)[:, None] * np.eye(UNKNOWNS)[5])
    faster = Speed(np.full(J, 10.0), 10.0, FPS, 0.05).residuals(turning)
    np.testing.assert_allclose(faster, np.degrees(FPS - 10.0) * (np.arange(N) > 0), rtol=1e-6)
    np.testing.assert_allclose(Track(np.ones((N, UNKNOWNS))).residuals(turning), np.degrees(np.arange(N)))


# --- one-sided terms, and contacts of parts ---------------------------------------------------------------------------


def down(state: State) -> Floats:
    return np.tile(-0.05 * np.eye(UNKNOWNS)[1], (N, 1))


def aside(state: State) -> Floats:
    """The trunk jerks."""
    return np.where(state.freedom.joints == HUMAN.index("lumbar"), 0.02, 0.0) @ np.eye(UNKNOWNS)[3:] * np.ones((N, 1))


def across(state: State) -> Floats:
    """The left leg swings into the other."""
    own, columns = state.freedom.slices(HUMAN.index("left_hip"))
    step = np.zeros((N, UNKNOWNS))
    step[:, columns] = state.freedom.axes[own] @ [0.0, 0.0, -0.1]
    return step


def at_random(state: State) -> Floats:
    return np.asarray(0.1 * np.random.default_rng(0).normal(size=(N, UNKNOWNS)))


BREAKS: dict[str, Callable[[State], Floats]] = {
    "floor": down,
    "balance": aside,
    "speed": at_random,
    "travel": at_random,
    "collision": across,
}


@pytest.mark.parametrize("name", BREAKS)
def test_a_step_that_would_break_a_bound_is_computed_again(name: str) -> None:
    term, state = satisfied()[name]
    if name == "collision":
        state = at_rest(posture(left_hip=[0.0, 0.0, -0.12]))
    assert isinstance(term, OneSided)
    normal, fixed = Normal(N, UNKNOWNS), np.arange(N) % (N - 1) == 0
    normal.block(0)[:] = np.eye(UNKNOWNS)
    normal.gradient -= BREAKS[name](state)
    breaks = normal.step(0.0, fixed)
    assert not term.foresee(state, 0.0 * breaks, normal)
    assert term.foresee(state, breaks, normal)
    normal.expand(state.mass_jacobian)
    keeps = normal.step(0.0, fixed)
    costs = [linearised(term, moved(state, step)).cost for step in (breaks, keeps)]
    assert costs[1] < 0.05 * costs[0]
    assert np.abs(keeps).max() > 0.1 * np.abs(breaks).max()


def test_contacts_of_parts_are_those_of_the_whole() -> None:
    state = random_state(1, 0.2, N)
    whole = contacts(state, 0.2, ALIKE)
    joined = Contacts.joined([whole.part(slice(0, 3)), whole.part(slice(3, N))], [0, 3], N)
    for name in ("frames", "points", "targets", "sds", "grips"):
        np.testing.assert_array_equal(getattr(joined, name), getattr(whole, name))
    across = np.arange(N - 1) == 2  # neither part knows how the last frame of one goes on to the other's first
    np.testing.assert_array_equal(joined.slips[~across], whole.slips[~across])
    assert np.isinf(joined.slips[across]).all()


def test_far_contacts_pull_no_harder_than_those_at_their_reach() -> None:
    state = at_rest(posture())
    pulls = []
    for off in (0.025, 0.05, 0.1, 1.0):
        target = state.places[2, 4] + [off, 0.0, 0.0]
        none = np.zeros(0, np.int64), np.zeros((N - 1, 0, 2)), np.zeros((N - 1, 0))
        term = Contacts(
            np.array([2]), np.array([4]), target[None], np.full((1, 3), 0.01), np.ones(1, np.bool_), *none, reach=0.05
        )
        pulls.append(linearised(term, state).gradient[2, 0])
    np.testing.assert_allclose(pulls, np.array([0.5, 1.0, 1.0, 1.0]) * pulls[1])


def test_a_foot_far_from_its_place_still_comes_down_to_the_floor() -> None:
    """Level distance is eased apart from height."""
    state = at_rest(posture())
    pulls = []
    for off in ([0.0, 0.01, 0.0], [1.0, 0.01, -0.5]):
        none = np.zeros(0, np.int64), np.zeros((N - 1, 0, 2)), np.zeros((N - 1, 0))
        target = (state.places[2, 4] + off)[None]
        term = Contacts(np.array([2]), np.array([4]), target, np.full((1, 3), 0.01), np.ones(1, np.bool_), *none)
        pulls.append(linearised(term, state).gradient[2])
    assert pulls[0][1] == pytest.approx(-100.0)
    assert pulls[1][1] == pytest.approx(pulls[0][1])
    assert np.hypot(pulls[1][0], pulls[1][2]) == pytest.approx(0.02 / 0.01**2)


def test_contacts_give_how_far_standing_points_are_off_the_floor() -> None:
    """Points that swing, or stand less firmly than the firmest by half, are not reported; nor are level distances."""
    state = at_rest(posture())
    frames, points = np.array([1, 2, 3, 4]), np.full(4, 4)
    targets = state.places[frames, points] + [[0.3, 0.02, 0.0], [0.0, -0.03, 0.0], [0.0, 0.1, 0.0], [0.0, 0.1, 0.0]]
    sds = np.full((4, 3), 0.01)
    sds[3] = 0.05
    none = np.zeros(0, np.int64), np.zeros((N - 1, 0, 2)), np.zeros((N - 1, 0))
    term = Contacts(frames, points, targets, sds, np.array([True, True, False, True]), *none)
    np.testing.assert_allclose(term.residuals(state), [0.0, 2.0, 3.0, 0.0, 0.0, 0.0], atol=1e-9)


def test_travel_bounds_only_the_axes_that_count() -> None:
    state = at_rest(posture())
    falling = State(state.body, state.freedom, state.rotations, state.root, np.arange(N)[:, None] * np.eye(UNKNOWNS)[1])
    free = np.zeros(N - 1, np.bool_)
    assert linearised(Travel(1, LEVEL, 1.0, free, FPS, 0.02), falling).cost == 0.0
    assert linearised(Travel(1, np.ones(3), 1.0, free, FPS, 0.02), falling).cost > 0.0
