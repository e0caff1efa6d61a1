"""Feet that stand where they should, steps, and a root that is carried in balance, also in the air."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from grounds import TIGHT, grounded

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.contact import foot_slide, limb_heights, lowest_height, skating
from motionmind.body.human import human23
from motionmind.body.limbs import limbs_of
from motionmind.body.limits import within_limits
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import centre_of_mass, find_support
from motionmind.footing.root import stand
from motionmind.geometry import rotations as rot
from motionmind.solver.plan import STEP_HEIGHT_M

LEGS = list(range(1, 9))


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


def posed(degrees: dict[str, tuple[float, float, float]], frames: int) -> Floats:
    """A posture of human23 by its joints' angles, held for so many frames.

    All joints stir, by less than a fifth of a degree: joints that the reference holds still are not free.
    """
    held = anatomy_named("human23").rotations({name: np.array([one]) for name, one in degrees.items()})
    stirs = 0.003 * np.sin(np.linspace(0.0, np.pi, frames)) ** 2
    return rot.mul(held, rot.from_axis_angle([1.0, 0.0, 0.0], stirs)[:, None])


def on_one_leg(frames: int, lift: float = 80.0) -> Floats:
    """A body on its right leg, the left thigh lifted ahead."""
    return posed({"left_hip": (-lift, 0.0, 0.0), "left_knee": (lift, 0.0, 0.0)}, frames)


# --- feet -------------------------------------------------------------------------------------------------------------


def test_feet_slide_much_less_and_all_but_the_legs_hardly_changes() -> None:
    q, root = sway()
    found, went = grounded(q, root)
    assert foot_slide(human23(), found, went) < 0.35 * foot_slide(human23(), q, root)
    moved = np.degrees(rot.angle(found, q).max(axis=0))
    free = [joint for joint in range(23) if joint not in LEGS]
    assert np.median(moved[free]) < 1.0
    assert moved[free].max() < 8.0
    np.testing.assert_allclose(found[[0, -1]], q[[0, -1]], rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(went[[0, -1]], root[[0, -1]])


def test_the_body_is_not_lifted_onto_the_toes_of_a_leg_that_works() -> None:
    """On one leg, the other points its foot down until it would be 6 cm in the floor: the standing foot stays on it."""
    skeleton, frames = human23(), 46
    q = on_one_leg(frames, 45.0)
    ankle = skeleton.index("left_ankle")
    point = 0.9 * np.sin(np.linspace(0.0, np.pi, frames)) ** 2
    q[:, ankle] = rot.mul(q[:, ankle], rot.from_axis_angle([1.0, 0.0, 0.0], point))
    q[:, 1] = rot.mul(
        q[:, 1], rot.from_axis_angle([1.0, 0.0, 0.0], 0.25 * np.sin(np.linspace(0.0, np.pi, frames)) ** 2)
    )
    root = stand(skeleton, q, np.zeros((frames, 3)), np.zeros(frames))
    standing = next(number for number, leg in enumerate(limbs_of(skeleton)) if skeleton.index("right_hip") in leg)
    raised = limb_heights(skeleton, q, root)[:, standing]
    assert raised.max() > 0.03
    found, went = grounded(q, root)
    heights = limb_heights(skeleton, found, went)[:, standing]
    assert heights.max() < 0.01
    assert lowest_height(skeleton, found, went).min() > -0.005


def test_quick_steps_leave_the_floor_before_they_go_far() -> None:
    """Feet that travel 2 m in 2.6 s and are not lifted by the movement hardly skate."""
    frames = 79
    q = posed({"left_knee": (15.0, 0.0, 0.0), "right_knee": (15.0, 0.0, 0.0)}, frames)
    root = stand(human23(), q, np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 2.0], frames), np.zeros(frames))
    assert skating(human23(), q, root) > 0.9
    assert skating(human23(), *grounded(q, root)) < 0.25


def test_a_leg_that_must_not_change_does_not() -> None:
    q, root = sway()
    fixed = TIGHT.copy()
    fixed[human23().index("left_knee")] = True
    found, went = grounded(q, root, fixed=fixed)
    np.testing.assert_allclose(found[:, fixed], q[:, fixed], rtol=0.0, atol=1e-12)
    assert rot.angle(found[:, 5:9], q[:, 5:9]).max() > 0.02
    assert np.abs(lowest_height(human23(), found, went)).max() < 0.03


@pytest.mark.parametrize("seed", range(3))
def test_the_only_foot_that_stands_at_both_ends_stays_there(seed: int) -> None:
    rng, frames = np.random.default_rng(seed), 46
    course = np.sin(np.linspace(0.0, np.pi, frames))[:, None, None] ** 2
    q = rot.mul(on_one_leg(frames), rot.exp(course * rng.normal(scale=0.15, size=(23, 3))))
    q = within_limits(human23(), q, q[[0, -1]], TIGHT)
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))
    root[-1] = root[0]
    found, went = grounded(q, root)
    toes = human23().index("right_toes")
    ends = human23().positions_and_tips(found, went)[:, [toes, toes + 23]]
    heights = limb_heights(human23(), found, went)[:, 1]
    assert heights.max() < 0.02
    assert np.linalg.norm(ends - ends[0], axis=-1).min(axis=1).max() < 0.03


@pytest.mark.parametrize("joint", ["right_ankle", "right_hip"])
def test_fine_detail_takes_the_foot_that_stays_off_the_floor_by_millimetres(joint: str) -> None:
    frames = 46
    bends = {"right_hip": (-20.0, 0.0, 0.0), "right_knee": (37.0, 0.0, 0.0), "right_ankle": (-17.0, 0.0, 0.0)}
    q = posed(bends | {"left_hip": (-80.0, 0.0, 0.0), "left_knee": (80.0, 0.0, 0.0)}, frames)
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))
    wavers = rot.mul(q, detail(frames, 0.2, [human23().index(joint)]))
    assert limb_heights(human23(), *grounded(wavers, root))[:, 1].max() < 0.01


@pytest.mark.parametrize(("degrees", "fastest"), [(30.0, 2.0), (40.0, 4.0), (50.0, 8.0)])
def test_the_body_comes_down_where_a_knee_is_too_slow_for_the_foot_that_stays(degrees: float, fastest: float) -> None:
    """A foot that rolls onto its toes in two frames, and back, under a knee that bends by `fastest` rad/s at most."""
    frames = 31
    bends = {"right_hip": (-20.0, 0.0, 0.0), "right_knee": (37.0, 0.0, 0.0), "right_ankle": (-17.0, 0.0, 0.0)}
    q = posed(bends | {"left_hip": (-80.0, 0.0, 0.0), "left_knee": (80.0, 0.0, 0.0)}, frames)
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))
    up = np.clip((np.arange(frames) - 10.0) / 2.0, 0.0, 1.0) * np.clip((20.0 - np.arange(frames)) / 2.0, 0.0, 1.0)
    ankle = human23().index("right_ankle")
    q[:, ankle] = rot.mul(q[:, ankle], rot.from_axis_angle([1.0, 0.0, 0.0], np.radians(degrees) * up))
    found, went = grounded(q, root, fastest=np.full(23, fastest))
    heights = limb_heights(human23(), found, went)[:, 1]
    assert -0.004 < heights.min() <= heights.max() < 0.02


@pytest.mark.parametrize("turn", [-1.8, 0.9, 1.8])
def test_a_foot_that_turns_on_the_spot_stays_there(turn: float) -> None:
    """About its heel, its toes go a foot's length, which is no step."""
    frames = 46
    q = on_one_leg(frames)
    turns = rot.about_vertical(np.linspace(0.0, turn, frames))
    q[:, 0] = rot.mul(turns, q[:, 0])
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))
    root -= human23().positions(q, root)[:, [human23().index("right_ankle")]][:, 0] * np.array([1.0, 0.0, 1.0])
    assert limb_heights(human23(), *grounded(q, root))[:, 1].max() < 0.01


# --- steps ------------------------------------------------------------------------------------------------------------


def steps_of(found: Floats, went: Floats) -> list[Bools]:
    """Whether each foot is off its place in each frame: both ends of it move more than 5 mm a frame, level."""
    ends = human23().positions_and_tips(found, went)[:, [[4, 27], [8, 31]]][..., [0, 2]]
    moved = np.linalg.norm(np.diff(ends, axis=0), axis=-1).min(axis=-1)
    return list((moved > 0.005).T)


def test_a_foot_that_is_given_a_little_above_the_floor_on_one_spot_stands_there() -> None:
    """Where a recording's floor is off, walks take who stands on one foot for a body in the air."""
    frames = 46
    q = on_one_leg(frames)
    root = stand(human23(), q, np.zeros((frames, 3)), np.full(frames, 0.08))
    found, went = grounded(q, root, aloft=np.ones(17), leap=0.08)
    heights = lowest_height(human23(), found, went)
    assert heights[10:-10].max() < 0.01  # between the ends it does not hop
    places = human23().positions(found, went)[:, human23().index("right_ankle")]
    assert np.linalg.norm(places[:, [0, 2]] - places[0, [0, 2]], axis=1).max() < 0.005


@pytest.mark.long
def test_the_farther_a_body_has_to_go_the_more_steps_it_takes_one_foot_after_the_other() -> None:
    counts = []
    for far in (0.5, 1.2, 2.4):
        frames = round(30 * (1.0 + 0.8 * far)) + 1
        q = posed({"left_knee": (15.0, 0.0, 0.0), "right_knee": (15.0, 0.0, 0.0)}, frames)
        root = stand(human23(), q, np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, far], frames), np.zeros(frames))
        found, went = grounded(q, root)
        swings = steps_of(found, went)
        counts.append(sum(int(np.sum(np.diff(foot.astype(int)) > 0)) for foot in swings))
        assert np.sum(swings[0] & swings[1]) <= 2  # as one lands the other may leave
        lifted = human23().positions_and_tips(found, went)[:, [[4, 27], [8, 31]], 1].min(axis=-1)
        assert lifted.max() > 0.4 * STEP_HEIGHT_M
    assert counts[0] < counts[1] < counts[2]
    assert counts[0] >= 2


def test_without_steps_feet_slide() -> None:
    q, root = sway(seconds=2.0, travel=1.0)
    found, went = grounded(q, root, without=("steps",))
    stepped, _ = grounded(q, root)
    assert skating(human23(), found, went) > 0.05
    assert np.abs(stepped - found).max() > 0.1


def test_feet_that_travel_sideways_do_not_cross() -> None:
    frames = 91
    q = posed({"left_knee": (15.0, 0.0, 0.0), "right_knee": (15.0, 0.0, 0.0)}, frames)
    root = stand(human23(), q, np.linspace([0.0, 0.0, 0.0], [1.5, 0.0, 0.0], frames), np.zeros(frames))
    ankles = [human23().index(f"{side}_ankle") for side in ("left", "right")]
    places = human23().positions(*grounded(q, root))[:, ankles, 0]
    assert (places[:, 0] - places[:, 1]).min() > -0.02


# --- the root ---------------------------------------------------------------------------------------------------------


def test_the_height_is_smooth() -> None:
    """A body that shifts from one foot to the other, of which one knee is bent more, and back, each within 0.1 s."""
    frames = 61
    q = posed({"left_knee": (20.0, 0.0, 0.0), "right_knee": (20.0, 0.0, 0.0)}, frames)
    t = np.linspace(0.0, 2.0, frames)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        knee = human23().index(f"{side}_knee")
        bend = 0.12 * np.tanh(20.0 * np.sin(2.0 * np.pi * t) * sign)
        q[:, knee] = rot.mul(q[:, knee], rot.from_axis_angle([1.0, 0.0, 0.0], bend))
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))

    def bounce(found: Floats, went: Floats) -> float:
        mass = centre_of_mass(human23(), found, went)
        assert mass is not None
        return float(np.abs(np.diff(mass[:, 1], 2)).max() * 900.0)

    smooth, rough = bounce(*grounded(q, root)), bounce(*grounded(q, root, without=("bounce",)))
    assert smooth < 0.5 * bounce(q, root)
    assert smooth < 0.7 * rough


@pytest.mark.long
def test_a_body_that_steps_travels_hardly_faster_than_it_may() -> None:
    """Between two steps it would hurry from one foot to the other; the distance takes 0.83 m/s."""
    q, root = sway(seconds=3.0, travel=2.5)
    speeds = [
        30.0 * np.linalg.norm(np.diff(grounded(q, root, travels=most)[1][:, [0, 2]], axis=0), axis=1).max()
        for most in (np.inf, 1.2, 1.0)
    ]
    assert speeds[0] > 1.35
    assert speeds[1] < 1.32
    assert speeds[2] < 1.15


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_body_that_passes_an_end_fast_does_not_stop_dead(way: float) -> None:
    """It stands in balance on both feet, but for the 4 m/s that it is given in one end."""
    q, frames = on_one_leg(46, 0.0), 46
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))
    fast = np.array([0.0, 0.0, 4.0])

    def jolt(**options: Any) -> float:
        """Its greatest acceleration level, m/s^2: knees that give way come later."""
        went = grounded(q, root, rates=(fast, None) if way > 0.0 else (None, fast), **options)[1]
        step = 30.0 * (went[1] - went[0] if way > 0.0 else went[-1] - went[-2])
        assert step[2] > 3.0
        return float(900.0 * np.linalg.norm(np.diff(went[:, [0, 2]], 2, axis=0), axis=1).max())

    # The leg that it stands on reaches only so far: the rest it pays in how hard it brakes.
    assert jolt(pushes=25.0) < 1.02 * jolt()


@pytest.mark.long
def test_the_weight_comes_over_the_standing_foot() -> None:
    """A body whose trunk leans far aside on one leg; at both ends it stands upright."""
    frames = 91
    q = on_one_leg(frames)
    lean = np.radians(35.0) * np.sin(np.linspace(0.0, np.pi, frames)) ** 2
    for name in ("lumbar", "thorax"):
        index = human23().index(name)
        q[:, index] = rot.mul(q[:, index], rot.from_axis_angle([0.0, 0.0, 1.0], -lean))
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))

    def over(**options: Any) -> float:
        support = find_support(human23(), *grounded(q, root, **options), 30.0)
        assert support.overhang is not None
        return float(np.nanmax(support.overhang[20:-20]))

    assert over() < 0.1
    assert over(without=("balance",)) > over() + 0.03


@pytest.mark.long
def test_the_floor_and_the_limits_hold() -> None:
    for travel in (0.0, 0.5, 1.5):
        q, root = sway(seconds=1.2 + travel, size=0.2, travel=travel)
        found, went = grounded(q, root)
        heights = lowest_height(human23(), found, went)
        assert heights.min() > -0.01
        assert heights.max() < 0.025
        beyond = rot.angle(within_limits(human23(), found, found[[0, -1]], TIGHT), found)
        assert beyond.max() < np.radians(2.0)


# --- flight -----------------------------------------------------------------------------------------------------------


def into_the_air(frames: int, high: float) -> tuple[Floats, Floats, Floats]:
    """A body that stands, and is so high in its last frame, metres: rotations, root, and how far walks are aloft."""
    q = posed({"left_knee": (0.0, 0.0, 0.0)}, frames)
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))
    root[-1, 1] += high
    aloft = np.zeros(17)
    aloft[-2:] = 1.0
    return q, root, aloft


def fall(found: Floats, went: Floats, frames: slice) -> Floats:
    """Vertical acceleration of the centre of mass at some frames, metres a second squared."""
    mass = centre_of_mass(human23(), found, went)
    assert mass is not None
    return 900.0 * np.diff(mass[:, 1], 2)[frames]


def test_a_body_that_is_to_be_in_the_air_gets_there_in_time_and_falls_freely() -> None:
    frames = 46
    q, root, aloft = into_the_air(frames, 0.25)
    found, went = grounded(q, root, aloft=aloft, leap=0.25)
    heights = lowest_height(human23(), found, went)
    flying = np.flatnonzero(heights > 0.03)
    assert len(flying) == frames - flying[0]
    assert (frames - 1 - flying[0]) / 30.0 == pytest.approx(np.sqrt(2.0 * 0.25 / GRAVITY_MPS2), abs=0.06)
    np.testing.assert_allclose(fall(found, went, slice(flying[0] + 1, None)), -GRAVITY_MPS2, rtol=0.15)
    assert abs(went[-1, 1] - went[-2, 1]) * 30.0 < 0.5
    left, there = grounded(q, root, aloft=aloft, leap=0.25, without=("flight",))
    assert root[0, 1] - there[:, 1].min() < 0.02
    np.testing.assert_allclose(left[-1], q[-1], rtol=0.0, atol=1e-12)


def test_a_jump_on_the_way_lasts_as_long_as_its_height_asks() -> None:
    frames = 61
    q = posed({"left_knee": (0.0, 0.0, 0.0)}, frames)
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))
    aloft = np.zeros(17)
    aloft[7:10] = 1.0
    found, went = grounded(q, root, aloft=aloft, leap=0.2)
    heights = lowest_height(human23(), found, went)
    flying = np.flatnonzero(heights > 0.03)
    assert heights.max() == pytest.approx(0.2, abs=0.05)
    assert np.all(np.diff(flying) == 1)
    assert flying.mean() == pytest.approx(30.0, abs=2.0)
    np.testing.assert_allclose(fall(found, went, slice(flying[0], flying[-1] - 1)), -GRAVITY_MPS2, rtol=0.15)
    assert lowest_height(human23(), *grounded(q, root, aloft=aloft, leap=0.2, without=("flight",))).max() < 0.01


def detail(frames: int, size: float, joints: Sequence[int]) -> Floats:
    """Rotations that waver by `size` radians, five times a second: what a recording has between its postures."""
    rng, t = np.random.default_rng(3), np.arange(frames) / 30.0
    phase = rng.uniform(0.0, 6.0, (len(joints), 3))
    vectors = np.zeros((frames, 23, 3))
    fades = np.minimum(np.minimum(t, t[::-1]) / 0.2, 1.0)[:, None, None]
    vectors[:, joints] = size * fades * np.sin(10.0 * np.pi * t[:, None, None] + phase)
    return rot.exp(vectors)


def test_a_body_with_fine_detail_falls_freely() -> None:
    frames = 46
    q, root, aloft = into_the_air(frames, 0.25)
    arms = [human23().index(f"{side}_shoulder") for side in ("left", "right")]
    found, went = grounded(rot.mul(q, detail(frames, 0.1, arms)), root, aloft=aloft, leap=0.25)
    flying = np.flatnonzero(lowest_height(human23(), found, went) > 0.03)
    assert np.mean(np.abs(fall(found, went, slice(flying[0] + 2, None)) + GRAVITY_MPS2) < 0.2 * GRAVITY_MPS2) > 0.9


def test_an_end_in_the_air_shows_nothing_of_its_floor() -> None:
    """It is higher than the corpus's bodies jump: that is no reason to climb."""
    frames = 61
    q, root, aloft = into_the_air(frames, 0.4)
    found, went = grounded(q, root, aloft=aloft, leap=0.2)
    assert lowest_height(human23(), found, went)[: frames // 2].max() < 0.01


@pytest.mark.parametrize(("high", "share"), [(0.4, 0.1), (0.3, 0.3)])
def test_an_end_as_high_as_some_jump_is_in_the_air_though_most_stand_so(high: float, share: float) -> None:
    """In a crouch a corpus stands more often than it jumps; a floor so high is less likely than a jump."""
    frames = 61
    q, root, aloft = into_the_air(frames, high)
    found, went = grounded(q, root, aloft=share * aloft, leap=0.3)
    heights = lowest_height(human23(), found, went)
    flying = np.flatnonzero(heights > 0.03)
    assert heights[: frames // 2].max() < 0.01
    np.testing.assert_allclose(fall(found, went, slice(flying[0] + 1, None)), -GRAVITY_MPS2, rtol=0.15)


def test_an_end_higher_than_any_step_is_in_the_air_though_no_walk_is() -> None:
    """The postures of a corpus may lie on both sides of a short jump."""
    frames = 61
    q, root, aloft = into_the_air(frames, 0.25)
    found, went = grounded(q, root, aloft=0.0 * aloft)
    heights = lowest_height(human23(), found, went)
    flying = np.flatnonzero(heights > 0.03)
    assert heights[: frames // 2].max() < 0.01
    np.testing.assert_allclose(fall(found, went, slice(flying[0] + 1, None)), -GRAVITY_MPS2, rtol=0.15)


def test_an_end_a_little_higher_than_most_stand_shows_a_higher_floor() -> None:
    """It is nearer to the height at which most stand than to that of the jumps."""
    q, root, aloft = into_the_air(61, 0.14)
    assert fall(*grounded(q, root, aloft=0.3 * aloft, leap=0.3), slice(None)).min() > -0.5 * GRAVITY_MPS2


@pytest.mark.parametrize("high", [0.09, 0.11])
def test_an_end_as_high_as_some_jump_low_is_in_the_air(high: float) -> None:
    """Most stand so, but none of them so high."""
    q, root, aloft = into_the_air(61, high)
    falling = fall(*grounded(q, root, aloft=0.3 * aloft, leap=0.1), slice(-2, None))
    np.testing.assert_allclose(falling, -GRAVITY_MPS2, rtol=0.15)
    # Where walks of either kind are about as high, as many as stand stand.
    assert fall(*grounded(q, root, aloft=0.3 * aloft, leap=high + 0.15), slice(None)).min() > -0.5 * GRAVITY_MPS2


def test_a_foot_stays_on_the_floor_until_it_takes_off_though_detail_stretches_it() -> None:
    frames, leaves = 46, 38
    q, root, aloft = into_the_air(frames, 0.25)
    stretched, course = q.copy(), np.exp(-(((np.arange(frames) - leaves) / 1.5) ** 2))
    course[[0, -1]] = 0.0
    for side in ("left", "right"):
        ankle = human23().index(f"{side}_ankle")
        stretched[:, ankle] = rot.mul(stretched[:, ankle], rot.from_axis_angle([1.0, 0.0, 0.0], 1.2 * course))
    assert lowest_height(human23(), stretched, root)[leaves] < -0.08
    heights = lowest_height(human23(), *grounded(stretched, root, aloft=aloft, leap=0.25))
    assert heights[: leaves - 1].max() < 0.03
    assert heights[leaves + 2] > 0.05


def test_a_foot_that_wavers_into_the_floor_does_not_lift_the_body() -> None:
    frames = 61
    angles = {f"left_{joint}": (bend, 0.0, 0.0) for joint, bend in (("hip", -20.0), ("knee", 37.0), ("ankle", 0.0))}
    q = posed(angles | {"right_hip": (-15.0, 0.0, 0.0), "right_knee": (30.0, 0.0, 0.0)}, frames)
    root = stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))
    wavers = rot.mul(q, detail(frames, 0.4, [human23().index("left_ankle")]))
    assert lowest_height(human23(), wavers, root).min() < -0.01
    found, went = grounded(wavers, root)
    ankle = human23().positions(found, went)[:, human23().index("right_ankle"), 1]
    assert np.ptp(ankle) < 0.02
    assert lowest_height(human23(), found, went).min() > -0.006


def on_bent_knees(frames: int) -> tuple[Floats, Floats]:
    """A body that stands still on bent knees: rotations and root."""
    bends = {"hip": (-20.0, 0.0, 0.0), "knee": (37.0, 0.0, 0.0), "ankle": (-17.0, 0.0, 0.0)}
    q = posed({f"{side}_{joint}": bend for side in ("left", "right") for joint, bend in bends.items()}, frames)
    return q, stand(human23(), q, np.zeros((frames, 3)), np.zeros(frames))


def test_feet_that_stand_keep_their_places_under_legs_with_fine_detail() -> None:
    q, root = on_bent_knees(61)
    wavers = rot.mul(q, detail(61, 0.04, [human23().index(f"{side}_hip") for side in ("left", "right")]))
    ankles = [human23().index(f"{side}_ankle") for side in ("left", "right")]

    def slips(rotations: Floats, root: Floats) -> float:
        return float(np.ptp(human23().positions(rotations, root)[:, ankles][..., [0, 2]], axis=0).max())

    assert slips(wavers, root) > 0.05
    assert slips(*grounded(wavers, root)) < 0.015


def test_fine_detail_of_knees_lifts_no_standing_foot_for_long() -> None:
    q, root = on_bent_knees(61)
    wavers = rot.mul(q, detail(61, 0.15, [human23().index(f"{side}_knee") for side in ("left", "right")]))
    heights = limb_heights(human23(), *grounded(wavers, root))[:, :2]
    assert heights.max() < 0.02
    assert heights.min() > -0.006
    assert np.all(np.mean(heights < 0.004, axis=0) > 0.4)


# --- laws -------------------------------------------------------------------------------------------------------------


def test_it_is_the_same_wherever_the_body_faces() -> None:
    q, root = sway(travel=0.5)
    turn = rot.about_vertical(1.1)
    other = q.copy()
    other[:, 0] = rot.mul(turn, q[:, 0])
    found, went = grounded(q, root)
    away = np.array([3.0, 0.0, -2.0])
    again, there = grounded(other, rot.mul_vec(turn, root) + away)
    assert rot.angle(again[:, 1:], found[:, 1:]).max() < 1e-5
    np.testing.assert_allclose(there, rot.mul_vec(turn, went) + away, atol=1e-6)


def test_it_is_much_the_same_at_any_frame_rate() -> None:
    found, went = grounded(*sway(travel=0.0))
    fine, there = grounded(*sway(travel=0.0, fps=120.0), fps=120.0)
    # A knee that a step bends begins up to a frame later.
    apart = np.degrees(rot.angle(fine[::4], found))
    assert apart.max() < 14.0
    assert np.percentile(apart[:, LEGS], 95.0) < 5.0
    np.testing.assert_allclose(there[::4], went, atol=0.03)


def test_a_body_that_stands_still_already_stays_as_it_is() -> None:
    q, root = sway(size=0.0)
    found, went = grounded(q, root)
    assert rot.angle(found, q).max() < 0.02
    np.testing.assert_allclose(went, root, atol=0.003)


def test_postures_that_are_given_stay() -> None:
    q, root = sway(travel=0.4)
    found, _ = grounded(q, root, given=[10.0, 20.4])
    np.testing.assert_allclose(found[[10, 20, 21]], q[[10, 20, 21]], rtol=0.0, atol=1e-12)
    assert rot.angle(found[15], q[15]).max() > 1e-3


@pytest.mark.parametrize("frames", [2, 3, 4, 5])
def test_few_frames_leave_little_to_do(frames: int) -> None:
    q, root = sway()
    found, went = grounded(q[:frames], root[:frames])
    np.testing.assert_allclose(found[[0, -1]], q[[0, frames - 1]], rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(went[[0, -1]], root[[0, frames - 1]])


# --- bodies -----------------------------------------------------------------------------------------------------------


def test_a_body_without_legs_keeps_its_joints() -> None:
    rod = Skeleton("rod", ("a", "b"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    q, root = np.tile(rot.IDENTITY, (5, 2, 1)), np.arange(15.0).reshape(5, 3)
    root[:, 1] = 0.0
    found, went = grounded(q, root, skeleton=rod, fixed=TIGHT[:2])
    np.testing.assert_array_equal(found, q)
    np.testing.assert_array_equal(went[[0, -1]], root[[0, -1]])
    np.testing.assert_allclose(went[:, 1], 0.0, atol=1e-6)
