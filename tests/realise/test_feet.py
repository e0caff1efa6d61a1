"""Feet that stay where they stand: tracks, steps, legs that follow, on the floor and within limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.contact import foot_slide, lowest_height, skating
from motionmind.body.human import human23, human44
from motionmind.body.limbs import limbs_of, parts_of
from motionmind.body.limits import within_limits
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.realise.feet import STAY, _follow_legs, plant_feet
from motionmind.realise.legs import find_legs, reach
from motionmind.realise.root import stand
from motionmind.realise.tracks import BACK, EVEN, HOLDS, SMOOTH, STEP, _envelope, _track

LEGS = list(range(1, 9))
TIGHT = np.zeros(23, dtype=np.bool_)  # no joint is loose


def sway(seconds: float = 1.2, size: float = 0.12, travel: float = 0.0, fps: float = 30.0) -> tuple[Floats, Floats]:
    """A body on bent knees whose joints waver, each on a course of its own, and whose root travels ahead: rotations and
    root, its lowest point on the floor."""
    rng, t = np.random.default_rng(5), np.linspace(0.0, seconds, round(seconds * fps) + 1)
    skeleton = human23()
    phase, sizes = rng.uniform(0.0, 6.0, (23, 3)), size * rng.uniform(0.3, 1.0, (23, 3))
    q = rot.exp(sizes * np.sin(4.0 * t[:, None, None] + phase))
    for side in ("left", "right"):
        for joint, bend in (("hip", -0.45), ("knee", 0.8), ("ankle", -0.35)):
            index = skeleton.index(f"{side}_{joint}")
            q[:, index] = rot.from_axis_angle([1.0, 0.0, 0.0], bend + sizes[index, 0] * np.sin(4.0 * t + index))
    q = within_limits(skeleton, q, q[[0, -1]], TIGHT)
    root = np.stack([0.0 * t, 0.0 * t, travel * t / seconds], axis=1)
    return q, stand(skeleton, q, root, np.zeros(len(t)))


def planted(q: Floats, root: Floats, fps: float = 30.0, given: Sequence[float] = ()) -> tuple[Floats, Floats]:
    zero = np.zeros(len(q))
    return plant_feet(
        human23(), q, root, zero, zero, stands(q), TIGHT, TIGHT, fps, np.array(given or [0.0, len(q) - 1.0])
    )


def stands(q: Floats, skeleton: Skeleton | None = None) -> Floats:
    """All limbs stand, where they are low."""
    return np.ones((len(q) - 1, len(limbs_of(skeleton or human23())) + 1))


# --- what it does -----------------------------------------------------------------------------------------------------


def test_feet_slide_much_less_and_all_but_legs_and_root_stay() -> None:
    q, root = sway()
    found, went = planted(q, root)
    assert foot_slide(human23(), found, went) < 0.35 * foot_slide(human23(), q, root)
    others = [joint for joint in range(23) if joint not in LEGS]
    np.testing.assert_array_equal(found[:, others], q[:, others])
    np.testing.assert_array_equal(found[[0, -1]], q[[0, -1]])
    np.testing.assert_allclose(went[[0, -1]], root[[0, -1]], atol=1e-12)


def test_feet_that_are_to_slide_are_let_slide() -> None:
    q, root = sway(size=0.05)
    zero = np.zeros(len(q))
    found, went = plant_feet(
        human23(), q, root, zero, zero, 0.0 * stands(q), TIGHT, TIGHT, 30.0, np.array([0.0, len(q) - 1.0])
    )
    before, after = (human23().positions(*one)[:, LEGS][..., [0, 2]] for one in ((q, root), (found, went)))
    assert np.abs(after - before).max() < 0.003  # what a knee yields where one foot is lower
    assert foot_slide(human23(), found, went) == pytest.approx(foot_slide(human23(), q, root), rel=0.1)


def test_the_body_is_not_lifted_onto_a_foot_that_does_not_stand() -> None:
    """One knee straightens until its foot would be in the floor: the body stays on the other, and that leg bends."""
    skeleton, still = human23(), sway(size=0.0)
    q, root = still[0].copy(), still[1].copy()
    knee = skeleton.index("left_knee")
    straighter = 0.15 * np.sin(np.linspace(0.0, np.pi, len(q)))
    q[:, knee] = rot.mul(q[:, knee], rot.from_axis_angle([1.0, 0.0, 0.0], -straighter))
    root = stand(skeleton, q, root, np.zeros(len(q)))
    assert np.ptp(root[:, 1]) > 0.01
    standing = stands(q)
    standing[:, [number for number, leg in enumerate(limbs_of(skeleton)) if knee in leg]] = 0.2
    found, went = plant_feet(
        skeleton, q, root, *np.zeros((2, len(q))), standing, TIGHT, TIGHT, 30.0, np.array([0.0, len(q) - 1.0])
    )
    assert abs(went[18, 1] - went[0, 1]) < 0.1 * abs(root[18, 1] - root[0, 1])
    assert np.ptp(went[:, 1]) < 0.3 * np.ptp(root[:, 1])  # near the ends it begins to
    np.testing.assert_allclose(lowest_height(skeleton, found, went), 0.0, atol=1e-9)


def test_a_leg_that_must_not_change_does_not_and_the_body_rests_on_it() -> None:
    """The same, but the leg that straightens is fixed: the body is lifted by it, and the other leg does not bend."""
    skeleton, still = human23(), sway(size=0.0)
    q, root = still[0].copy(), still[1].copy()
    knee = skeleton.index("left_knee")
    straighter = 0.15 * np.sin(np.linspace(0.0, np.pi, len(q)))
    q[:, knee] = rot.mul(q[:, knee], rot.from_axis_angle([1.0, 0.0, 0.0], -straighter))
    root = stand(skeleton, q, root, np.zeros(len(q)))
    standing, fixed = stands(q), np.zeros(23, dtype=np.bool_)
    standing[:, [number for number, leg in enumerate(limbs_of(skeleton)) if knee in leg]] = 0.05
    fixed[knee] = True
    zero, given = np.zeros(len(q)), np.array([0.0, len(q) - 1.0])
    found, went = plant_feet(skeleton, q, root, zero, zero, standing, TIGHT, fixed, 30.0, given)
    np.testing.assert_array_equal(found[:, 1:5], q[:, 1:5])
    np.testing.assert_allclose(went[:, 1], root[:, 1], atol=0.002)
    assert rot.angle(found[:, 5:9], q[:, 5:9]).max() < 0.02
    free, _ = plant_feet(skeleton, q, root, zero, zero, standing, TIGHT, TIGHT, 30.0, given)
    assert rot.angle(free[:, 1:5], q[:, 1:5]).max() > 0.05


def test_feet_that_would_skate_step() -> None:
    q, root = sway(seconds=0.8, travel=0.5)
    found, went = planted(q, root)
    before, after = skating(human23(), q, root), skating(human23(), found, went)
    assert before > 0.5
    assert after < 0.2 * before
    ends = human23().positions_and_tips(found, went)[:, [[4, 27], [8, 31]], 1].min(axis=-1)
    # Not both at once: the body does not hop.
    assert ends.max() > 0.8 * STEP
    assert ends.min(axis=1).max() < 0.2 * STEP


def test_the_floor_and_the_limits_hold_and_the_height_stays() -> None:
    for travel in (0.0, 0.5, 1.5):
        q, root = sway(size=0.3, travel=travel)
        found, went = planted(q, root)
        np.testing.assert_allclose(lowest_height(human23(), found, went), 0.0, atol=1e-9)
        assert rot.angle(within_limits(human23(), found, found[[0, -1]], TIGHT), found).max() < 1e-9


def test_knees_keep_to_their_side_and_feet_to_their_orientations() -> None:
    q, root = sway()
    found, _ = planted(q, root)
    knees = anatomy_named("human23").degrees(found)[:, [2, 6], 0]
    assert knees.min() > 5.0
    turned = [human23().global_rotations(rotations)[:, [3, 4, 7, 8]] for rotations in (q, found)]
    inside = rot.angle(within_limits(human23(), found, found[[0, -1]], TIGHT), found).max(axis=1) < 1e-12
    assert rot.angle(*turned)[inside].max() < np.radians(3.0)


def test_it_is_smooth() -> None:
    q, root = sway(travel=0.4)
    found, went = planted(q, root)
    bend = [np.linalg.norm(np.diff(rot.log(rot.mul_inv(x[1:], x[:-1])), axis=0), axis=-1).max() for x in (q, found)]
    assert bend[1] < bend[0] + 0.1
    assert np.abs(np.diff(went, 2, axis=0)).max() < np.abs(np.diff(root, 2, axis=0)).max() + 0.02


# --- laws -------------------------------------------------------------------------------------------------------------


def test_backwards_in_time_it_is_the_same_backwards() -> None:
    q, root = sway(travel=0.5)
    found, went = planted(q, root)
    again, back = planted(q[::-1], root[::-1])
    assert rot.angle(again[::-1], found).max() < 1e-6
    np.testing.assert_allclose(back[::-1], went, atol=1e-7)


def test_it_is_the_same_wherever_the_body_faces() -> None:
    q, root = sway(travel=0.5)
    turn = rot.about_vertical(1.1)
    other = q.copy()
    other[:, 0] = rot.mul(turn, q[:, 0])
    found, went = planted(q, root)
    away = np.array([3.0, 0.0, -2.0])
    again, there = planted(other, rot.mul_vec(turn, root) + away)
    assert rot.angle(again[:, 1:], found[:, 1:]).max() < 1e-6
    np.testing.assert_allclose(there, rot.mul_vec(turn, went) + away, atol=1e-7)


def test_it_is_much_the_same_at_any_frame_rate() -> None:
    found, went = planted(*sway(travel=0.3))
    fine, there = planted(*sway(travel=0.3, fps=120.0), fps=120.0)
    assert np.degrees(rot.angle(fine[::4], found)).max() < 4.0
    np.testing.assert_allclose(there[::4], went, atol=0.01)


def test_feet_that_stand_still_already_stay_as_they_are() -> None:
    q, root = sway()
    q, root = np.repeat(q[:1], 30, axis=0), np.repeat(root[:1], 30, axis=0)
    found, went = planted(q, root)
    assert rot.angle(found, q).max() < 1e-7
    np.testing.assert_allclose(went, root, atol=1e-9)


def test_postures_that_are_given_stay() -> None:
    q, root = sway(travel=0.4)
    found, _ = planted(q, root, given=[0.0, 10.0, 20.4, len(q) - 1.0])
    np.testing.assert_array_equal(found[[10, 20, 21]], q[[10, 20, 21]])
    assert rot.angle(found[15], q[15]).max() > 1e-3


@pytest.mark.parametrize("frames", [1, 2, 3, 4])
def test_few_frames_leave_little_to_do(frames: int) -> None:
    q, root = sway()
    found, _ = planted(q[:frames], root[:frames])
    np.testing.assert_array_equal(found[[0, -1]], q[[0, frames - 1]])


# --- bodies -----------------------------------------------------------------------------------------------------------


def test_legs_are_found_by_their_long_bones() -> None:
    for skeleton in (human23(), human44()):
        legs = [
            ([skeleton.names[joint] for joint in leg], skeleton.names[leg[knee]])
            for leg, knee in find_legs(skeleton)[1]
        ]
        assert [knee for _, knee in legs] == ["left_knee", "right_knee"]
        assert [leg[0] for leg, _ in legs] == ["left_hip", "right_hip"]


def test_legs_hang_where_the_body_forks_first() -> None:
    """A rig's own root above the pelvis changes nothing; a chain that does not fork is no leg."""
    body = human23()
    rig = Skeleton(
        "rig",
        ("root", *body.names),
        (-1, 0, *(p + 1 for p in body.parents[1:])),
        np.concatenate([[[0.0] * 3], body.offsets]),
        np.concatenate([[[0.0] * 3], body.tips]),
    )
    assert [[joint - 1 for joint in leg] for leg, _ in find_legs(rig)[1]] == [leg for leg, _ in find_legs(body)[1]]
    assert parts_of(rig)[1].tolist() == [0, *(parts_of(body)[1] + 1)]
    chain = Skeleton("chain", ("a", "b", "c"), (-1, 0, 1), np.array([[0.0] * 3, [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]))
    assert find_legs(chain)[1] == []


def test_a_body_without_legs_stays_as_it_is() -> None:
    rod = Skeleton("rod", ("a", "b"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    q, root = np.tile(rot.IDENTITY, (5, 2, 1)), np.arange(15.0).reshape(5, 3)
    found, went = plant_feet(
        rod, q, root, np.zeros(5), np.zeros(5), stands(q, rod), TIGHT[:2], TIGHT[:2], 30.0, np.array([0.0, 4.0])
    )
    np.testing.assert_array_equal(found, q)
    np.testing.assert_array_equal(went, root * np.array([1.0, 0.0, 1.0]))  # on the floor


# --- its parts --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("frames", "fps"), [(3, 30.0), (4, 24.0), (5, 30.0), (40, 60.0)])
def test_a_track_is_the_least_squares_solution(frames: int, fps: float) -> None:
    rng = np.random.default_rng(frames)
    moves, heights = rng.normal(size=(frames - 1, 2, 2)), rng.uniform(-0.02, 0.2, (frames - 1, 2))
    still = rng.uniform(0.0, 1.0, frames - 1)
    hold = np.sqrt(still[:, None] / (1.0 + (np.maximum(heights, 0.0) / HOLDS) ** 4))
    first, second = np.diff(np.eye(frames), axis=0), np.diff(np.eye(frames), 2, axis=0)
    free = 1.0 - hold.max(axis=1) ** 2
    back = np.sqrt(np.convolve(free, [0.5, 0.5])) * BACK / fps
    rows = [hold[:, :1] * first, hold[:, 1:] * first, np.sqrt(EVEN) * first, np.diag(back)]
    rows += [SMOOTH * fps * second, SMOOTH * fps * np.eye(frames)[[1, -2]]]  # it rests before and after
    right = [-hold[:, :1] * moves[:, 0], -hold[:, 1:] * moves[:, 1]]
    system = np.concatenate(rows)[:, 1:-1]
    right.append(np.zeros((len(system) - 2 * (frames - 1), 2)))
    expected = np.linalg.lstsq(system, np.concatenate(right), rcond=None)[0]
    found = _track(moves, heights, still, fps)
    np.testing.assert_allclose(found[1:-1], expected, atol=1e-9)
    np.testing.assert_array_equal(found[[0, -1]], 0.0)


def test_an_envelope_is_smooth_and_nowhere_less_than_is_needed() -> None:
    need = np.zeros(60)
    need[[20, 21, 33]] = 0.05, 0.06, 0.02
    found = _envelope(need, 30.0)
    assert np.all(found >= need - 1e-12)
    assert found.max() <= need.max() + 1e-12
    assert np.abs(np.diff(found, 2)).max() < 0.01
    np.testing.assert_array_equal(_envelope(np.ones(60), 30.0)[[0, -1]], 0.0)


def test_the_root_goes_along_as_far_as_legs_would_be_stretched() -> None:
    rng = np.random.default_rng(1)
    legs, off = rng.normal(size=(5, 2, 3)), rng.normal(size=(5, 2, 3))
    found = _follow_legs(legs, off)
    unit = legs / np.linalg.norm(legs, axis=-1, keepdims=True)

    def cost(r: Floats) -> Floats:
        return np.asarray(np.sum(np.sum(unit * (off - r[:, None]), -1) ** 2, -1) + STAY * np.sum(r**2, -1))

    for step in 1e-3 * np.concatenate([np.eye(3), -np.eye(3)]):
        assert np.all(cost(found + step) > cost(found))


def bent(bends: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Orientations of hips [N, 4], and hip, knee and ankle [N, 3, 3] of legs bent by so much about the hip's x."""
    hip = rot.normalise(rng.normal(size=(len(bends), 4)))
    knee = rot.mul_vec(hip, np.array([0.0, -0.42, 0.0]))
    shank = rot.mul(hip, rot.from_axis_angle([1.0, 0.0, 0.0], bends))
    return hip, np.stack([0.0 * knee, knee, knee + rot.mul_vec(shank, np.array([0.0, -0.4, 0.0]))], axis=1)


def test_a_leg_reaches_what_is_in_its_reach_and_bends_as_it_did() -> None:
    rng = np.random.default_rng(2)
    hip, leg = bent(rng.uniform(0.8, 1.6, 50), rng)
    target = leg[:, 2] + rng.uniform(-0.03, 0.03, (50, 3))
    thigh, shank = reach(hip, leg, target)
    knee = rot.mul_vec(thigh, leg[:, 1])
    np.testing.assert_allclose(knee + rot.mul_vec(shank, leg[:, 2] - leg[:, 1]), target, atol=1e-9)
    # The shank turns against the thigh about the knee's own axis alone, and not beyond straight.
    axis = rot.mul_vec(rot.mul(thigh, hip), np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(np.sum(axis * (target - knee), axis=-1), 0.0, atol=1e-9)
    assert np.all(np.sum(axis * np.cross(knee, target - knee), axis=-1) > 0.0)


def test_a_leg_that_is_too_short_is_stretched_ever_less_and_never_straight() -> None:
    far = np.linspace(0.0, 0.5, 200)
    hip, leg = bent(np.full(200, 0.6), np.random.default_rng(3))
    hip, leg = np.repeat(hip[:1], 200, axis=0), np.repeat(leg[:1], 200, axis=0)
    along = leg[:, 2] / np.linalg.norm(leg[:, 2], axis=-1, keepdims=True)
    thigh, shank = reach(hip, leg, leg[:, 2] + far[:, None] * along)
    bend = rot.angle(shank, thigh)
    reached = np.linalg.norm(rot.mul_vec(thigh, leg[:, 1]) + rot.mul_vec(shank, leg[:, 2] - leg[:, 1]), axis=-1)
    assert np.all(np.diff(reached) >= -1e-12)
    assert reached.max() <= 0.82 + 1e-9
    assert np.abs(np.diff(bend, 2)).max() < 0.02


def test_a_leg_that_is_where_it_should_be_stays_even_straight() -> None:
    hip, leg = bent(np.zeros(9), np.random.default_rng(4))
    for turn in reach(hip, leg, leg[:, 2]):
        assert rot.angle(turn, np.broadcast_to(rot.IDENTITY, turn.shape)).max() < 1e-4
