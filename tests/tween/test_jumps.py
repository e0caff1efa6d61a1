"""Jumps into and out of postures that are given in the air: from legs that stretch, and as long as gravity has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionmind import Engine, Motion, Posture
from motionmind._typing import Bools, Floats
from motionmind.body.contact import lowest_height, pose
from motionmind.body.human import human23
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.support import centre_of_mass
from motionmind.footing.flight import SHORTEST_PUSH_OFF_S, find_falls
from motionmind.geometry import rotations as rot
from motionmind.synthesis.retime import LEAP_JOINT_SPEED_RATIO, jump_in_time, land_between, slower_steps

BODY, FPS = human23(), 30.0
CROUCH = 0.5  # metres: no leap begins or ends deeper, by the pelvis; in a split it is at 0.3
SPLIT = 11  # half steps from standing to a split


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def posture(engine: Engine, number: int) -> Posture:
    return Posture(BODY, engine.corpus.rotations[number], engine.corpus.root[number])


def leap(engine: Engine, number: int) -> Posture:
    """Keyframes of the grand jete: flying into the split, in it, and out of it."""
    clip = next(clip for clip in engine.corpus.clips if clip.name == "grand-jete")
    low = lowest_height(BODY, engine.corpus.rotations, engine.corpus.root)
    up = [k for k in range(clip.start, clip.stop) if low[k] > 0.3]
    return posture(engine, up[number])


def standing(engine: Engine, seed: int) -> list[Posture]:
    low = lowest_height(BODY, engine.corpus.rotations, engine.corpus.root)
    on_floor = np.flatnonzero(low < 0.02)
    return [posture(engine, int(k)) for k in np.random.default_rng(seed).choice(on_floor, 4, replace=False)]


def in_place(moved: Posture, at: Posture) -> Posture:
    """A posture half a metre from another."""
    return replace(moved, root=np.array([at.root[0] + 0.5, moved.root[1], at.root[2]]))


def off_floor(motion: Motion) -> Bools:
    """Frames in the air, with both neighbours."""
    up = lowest_height(BODY, motion.rotations, motion.root) > 0.06
    return np.asarray(up[1:-1] & up[2:] & up[:-2])


def check_leap(motion: Motion) -> None:
    mass = centre_of_mass(BODY, motion.rotations, motion.root)
    assert mass is not None
    fps = (len(motion) - 1) / motion.times[-1]
    falls = -(fps**2) * np.diff(mass[:, 1], 2)[off_floor(motion)]
    assert len(falls) > 1
    assert np.abs(falls / GRAVITY_MPS2 - 1.0).max() < 0.2
    assert motion.root[:, 1].min() > CROUCH


@pytest.mark.parametrize("number", [0, 1, 2])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_leap_is_from_stretched_legs_and_lands_on_them(ballet: Engine, number: int, seed: int) -> None:
    for stands in standing(ballet, seed)[:2]:
        into = leap(ballet, number)
        check_leap(ballet.tween(stands, in_place(into, stands), fps=FPS).motion)
        check_leap(ballet.tween(into, in_place(stands, into), fps=FPS).motion)


def test_from_leap_to_leap_the_body_lands_on_its_feet_between(ballet: Engine) -> None:
    a, b = leap(ballet, 1), leap(ballet, 4)
    motion = ballet.tween(a, b, fps=FPS).motion
    check_leap(motion)
    assert lowest_height(BODY, motion.rotations, motion.root).min() < 0.02


@pytest.mark.parametrize("number", [0, 1, 2])
def test_who_leaves_in_the_air_at_a_velocity_goes_on_with_it(ballet: Engine, number: int) -> None:
    clip = next(clip for clip in ballet.corpus.clips if clip.name == "grand-jete")
    recorded = ballet.corpus.recording(clip).resample(FPS)
    low = lowest_height(BODY, recorded.rotations, recorded.root)
    up = np.flatnonzero(low > 0.3)
    frame = int(up[(number + 1) * len(up) // 4])
    stands = standing(ballet, 0)[number]
    before = recorded.slice(frame - 2, frame + 1)
    motion = ballet.tween(before.posture(2), in_place(stands, before.posture(2)), before=before, fps=FPS).motion
    mass = centre_of_mass(BODY, motion.rotations, motion.root)
    assert mass is not None
    rates = FPS * np.diff(mass[:, 1])
    falling = np.flatnonzero(off_floor(motion))
    assert len(falling) > 2
    assert (
        np.mean(np.abs(FPS * np.diff(rates)[falling] / GRAVITY_MPS2 + 1.0) < 0.3) > 0.75
    )  # legs whip down from a split
    assert falling.max() < 0.6 * FPS  # it comes down, and does not hover
    gone = FPS * (recorded.root[frame, 1] - recorded.root[frame - 1, 1])
    assert FPS * (motion.root[1, 1] - motion.root[0, 1]) == pytest.approx(gone, abs=0.7)


def test_legs_that_come_down_fast_do_not_hide_a_fall(ballet: Engine) -> None:
    """The root of a body that closes a split does not fall as its mass does."""
    motion = ballet.tween(leap(ballet, 1), in_place(standing(ballet, 1)[0], leap(ballet, 1)), fps=FPS).motion
    ends = np.arange(len(motion)) % (len(motion) - 1) == 0
    _, falls = find_falls(BODY, pose(BODY, motion.rotations, motion.root), ends, FPS)
    assert [first for first, _ in falls] == [1]
    slow = np.full(len(BODY) + 4, 0.05)  # all of it is too fast
    slower = slower_steps(motion, slow, (False, False))
    np.testing.assert_array_equal(slower[: falls[0][1]], 1.0)
    assert slower.max() > 3.0


@pytest.mark.parametrize("moving", [(False, False), (True, True)])
def test_who_is_in_the_air_twice_has_the_time_to_come_down(moving: tuple[bool, bool]) -> None:
    seconds = np.full(12, 0.05)
    longer = land_between(seconds, np.array([0.25, 0.5]), 1.0, moving)
    falls = np.sqrt(2.0 * 0.25 / GRAVITY_MPS2) + np.sqrt(2.0 * 0.5 / GRAVITY_MPS2)
    assert float(longer @ seconds) > falls + 2.0 * SHORTEST_PUSH_OFF_S
    assert longer.min() >= 1.0
    assert (longer[0] < 1.2 * longer.min()) == moving[0] or not any(moving)
    # One leap leads from the one to the other, or there is time enough.
    for takes, heights in ((0.02, [0.25, 0.5]), (0.2, [0.25, 0.5])):
        unchanged = land_between(np.full(12, takes), np.array(heights), 1.0, moving)
        np.testing.assert_array_equal(unchanged, np.ones(12))


def test_from_one_jump_into_a_higher_one_the_body_lands(ballet: Engine) -> None:
    a = leap(ballet, 1)
    lower = replace(a, root=a.root - [0.0, 0.15, 0.0])
    for there, back in ((lower, a), (a, lower)):
        motion = ballet.tween(there, back, fps=FPS).motion
        low = lowest_height(BODY, motion.rotations, motion.root)
        assert low.min() < 0.02
        assert low.max() < max(low[0], low[-1]) + 0.15


def test_a_body_whose_floor_is_lower_jumps_from_there_and_does_not_float_up(ballet: Engine) -> None:
    """As in a recording whose zero is off: the other end, in the air, shows nothing of the floor."""
    flying = leap(ballet, 1)
    up = float(lowest_height(BODY, flying.rotations, flying.root)) - 0.03
    for stands in standing(ballet, 0):
        a = replace(stands, root=stands.root - [0.0, 0.12, 0.0])
        b = in_place(replace(flying, root=flying.root - [0.0, up, 0.0]), a)
        motion = ballet.tween(a, b, fps=FPS).motion
        low = lowest_height(BODY, motion.rotations, motion.root)
        assert np.abs(low[: len(low) // 2] - low[0]).max() < 0.03


@pytest.mark.parametrize(("seconds", "fps"), [(1.05, 30.0), (2.05, 30.0), (2.0, 7.3)])
def test_a_given_duration_is_exact_in_the_air_too(ballet: Engine, seconds: float, fps: float) -> None:
    a = posture(ballet, 0)
    motion = ballet.tween(a, in_place(leap(ballet, 1), a), duration=seconds, fps=fps).motion
    assert motion.times[-1] == pytest.approx(seconds)


def test_a_leap_begins_after_the_posture_before_it() -> None:
    """Half steps beyond the next posture that is given are left as they are."""
    far, near = timed(0.2, 1.0), timed(0.2, 1.0, reach=3)
    assert (far[:-3] < 1.0).any()
    assert (near[:-3] == 1.0).all()


def test_who_gives_up_flight_gives_up_its_time(ballet: Engine) -> None:
    a = posture(ballet, 0)
    lowest = [
        ballet.tween(a, in_place(leap(ballet, 1), a), without=names, duration=2.4, fps=FPS).motion.root[:, 1].min()
        for names in ((), ("flight",))
    ]
    assert lowest[1] < lowest[0] - 0.1  # it goes down longer


def split(share: Floats) -> Floats:
    """Rotations of a body whose legs part, one forward and one back [N, J, 4], by shares of a quarter turn."""
    rotations = np.tile(rot.IDENTITY, (len(share), len(BODY), 1))
    for hip, sign in (("left_hip", 1.0), ("right_hip", -1.0)):
        rotations[:, BODY.index(hip)] = rot.from_axis_angle([1.0, 0.0, 0.0], sign * 0.45 * np.pi * share)
    return rotations


def timed(
    seconds: float,
    low: float,
    heights: Floats | None = None,
    in_air: tuple[bool, bool] = (False, True),
    fastest: float = 4.0,
    reach: int = SPLIT - 1,
) -> Floats:
    """How much longer half steps are to take, of which each takes as long as given, from standing into a split."""
    share = np.linspace(0.0, 1.0, SPLIT)
    share = share if in_air[1] else share[::-1]
    up = np.linspace(0.0, low, SPLIT) if heights is None else heights
    up = up if in_air[1] else up[::-1]
    lows = np.array([0.0, low] if in_air[1] else [low, 0.0])
    poses, speeds = split(share), np.full(len(BODY), fastest)
    air = np.array(in_air, dtype=np.bool_)
    return jump_in_time(BODY, poses, np.full(SPLIT - 1, seconds), up, lows, air, (reach, reach), speeds)


@pytest.mark.parametrize("fastest", [4.0, 1.0])
def test_a_walk_into_the_air_takes_as_long_as_the_fall_from_there(fastest: float) -> None:
    slow = timed(0.2, 1.0, fastest=fastest)
    jumps = slow < 1.0
    rises = np.flatnonzero(jumps)
    assert rises[-1] == SPLIT - 2
    assert len(rises) == rises[-1] + 1 - rises[0]  # the last ones, without a gap
    assert len(set(slow[jumps])) == 1
    poses, still = split(np.linspace(0.0, 1.0, SPLIT)), np.zeros((SPLIT, 3))
    mass = centre_of_mass(BODY, poses, still)
    assert mass is not None
    high = mass[:, 1] - lowest_height(BODY, poses, still)
    fall = np.sqrt(2.0 * (high[-1] + 1.0 - high[rises[0]]) / GRAVITY_MPS2)
    assert 0.2 * float(slow[jumps].sum()) == pytest.approx(fall)
    # Legs hurry, and no faster than they may.
    turn = np.abs(np.diff(np.linspace(0.0, 1.0, SPLIT)))[jumps].sum() * 0.45 * np.pi
    assert turn / fall < LEAP_JOINT_SPEED_RATIO * fastest
    assert np.array_equal(timed(0.2, 1.0, in_air=(True, False), fastest=fastest), slow[::-1])


def test_a_body_half_as_large_hurries_by_its_size() -> None:
    """Falls of half the height take 1 / sqrt(2) of the time, from the same posture if legs need no more than that."""
    half = replace(BODY, offsets=0.5 * BODY.offsets, tips=0.5 * BODY.tips)
    poses, seconds, up = split(np.linspace(0.0, 1.0, SPLIT)), np.full(SPLIT - 1, 0.2), np.linspace(0.0, 1.0, SPLIT)
    lows, in_air, fastest = np.array([0.0, 1.0]), np.array([False, True]), np.full(len(BODY), 9.0)
    large = jump_in_time(BODY, poses, seconds, up, lows, in_air, (SPLIT - 1,) * 2, fastest)
    small = jump_in_time(half, poses, seconds, 0.5 * up, 0.5 * lows, in_air, (SPLIT - 1,) * 2, fastest)
    np.testing.assert_allclose(small[large < 1.0], large[large < 1.0] / np.sqrt(2.0))
    np.testing.assert_array_equal(small[large == 1.0], 1.0)


def test_slower_legs_leave_the_floor_farther_apart() -> None:
    times = [timed(0.2, 1.0, fastest=fastest) for fastest in (4.0, 1.2, 1.0)]
    hurried = [int((one < 1.0).sum()) for one in times]
    assert hurried == sorted(hurried, reverse=True)
    assert hurried[0] > hurried[-1] > 0


@pytest.mark.parametrize(
    ("seconds", "low", "heights", "in_air"),
    [
        (0.2, 1.0, None, (False, False)),  # nothing is given in the air
        (0.02, 1.0, None, (False, True)),  # quick enough
        (0.2, 1.0, np.zeros(SPLIT), (False, True)),  # the corpus's bodies stand
        (0.2, 0.1, None, (False, True)),  # lower than it stands: no jump
    ],
)
def test_other_walks_are_left_as_they_are(
    seconds: float, low: float, heights: Floats | None, in_air: tuple[bool, bool]
) -> None:
    assert np.array_equal(timed(seconds, low, heights, in_air), np.ones(SPLIT - 1))
