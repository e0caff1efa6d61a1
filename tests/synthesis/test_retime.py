"""A clock that slows down where a movement as it is made is too fast."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.contact import foot_slides, lowest_height
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline
from motionmind.learned.pace import moved_in, steps_of
from motionmind.learned.peaks import accelerations
from motionmind.synthesis.retime import MIN_CLOCK_CHANGE_RATIO, SLOWDOWN_AROUND_S, SLOWDOWN_FROM_END_S, slower_steps
from motionmind.synthesis.timeline import Timeline, stretch

FPS, BODY = 30.0, human23()
ELBOW = BODY.index("left_elbow")
STILL = (False, False)


def bent(angles: Floats, heights: Floats | None = None) -> tuple[Motion, Timeline]:
    """A body that bends an elbow by such angles [N], and whose root is so high [N], with a clock of five moves."""
    times = np.arange(len(angles)) / FPS
    rotations = np.tile(rot.IDENTITY, (len(times), len(BODY), 1))
    rotations[:, ELBOW] = rot.from_axis_angle([1.0, 0.0, 0.0], angles)
    root = np.zeros((len(times), 3))
    root[:, 1] = 1.0 if heights is None else heights
    return Motion(BODY, rotations, root, times), Timeline(np.linspace(0.0, times[-1], 6), times, 5)


def quick(top: float, count: int = 91) -> Floats:
    """Angles of an elbow that bends slowly, but for its fastest moment, in the middle."""
    speeds = 0.5 + top * np.exp(-(((np.arange(count - 1) - 0.5 * count) / 4.0) ** 2))
    return np.concatenate([[0.0], np.cumsum(speeds) / FPS])


def most(joints: float, acceleration: float = 900.0) -> Floats:
    return np.concatenate([np.full(len(BODY), joints), [9.0, 9.0, 9.0, acceleration]])


def raised(motion: Motion, by: Floats) -> Motion:
    return replace(motion, root=motion.root + by[:, None] * np.array([0.0, 1.0, 0.0]))


def slow_down(
    motion: Motion,
    clock: Timeline,
    most: Floats,
    moving: tuple[bool, bool],
    slides: float = np.inf,
    kept: Sequence[float] = (),
) -> tuple[Motion, Timeline]:
    """The movement on a clock that slows down up to three times, and that clock."""
    for _ in range(3):
        slower = slower_steps(motion, most, moving, slides, kept)
        if slower.max() < 1.0 + MIN_CLOCK_CHANGE_RATIO:
            break
        times = motion.times
        clock, at = stretch(clock, times, slower, 1.0 / float(times[1] - times[0]))
        was = np.interp(clock.frames, at, times)
        rotations = rot.normalise(rotation_spline(times, motion.rotations, was))
        rotations[[0, -1]] = motion.rotations[[0, -1]]
        motion = Motion(motion.skeleton, rotations, natural_spline(times, motion.root, was), clock.frames)
    return motion, clock


def speeds(motion: Motion) -> Floats:
    return steps_of(motion)[:, ELBOW] / np.diff(motion.times)


@pytest.mark.parametrize("top", [2.5, 4.0, 7.0])
def test_what_is_too_fast_is_slowed_as_much_as_it_needs(top: float) -> None:
    motion, clock = bent(quick(top))
    slower, later = slow_down(motion, clock, most(2.0), STILL)
    assert speeds(motion).max() > 2.0
    assert 1.8 < speeds(slower).max() < 2.0 * 1.03
    np.testing.assert_array_equal(slower.rotations[[0, -1]], motion.rotations[[0, -1]])
    np.testing.assert_allclose(np.diff(slower.times), 1.0 / FPS, rtol=0.02)
    np.testing.assert_array_equal(slower.times, later.frames)
    assert later.moves[-1] == slower.times[-1] > motion.times[-1]
    # The same movement: at each move it is where it was, and nothing else is longer than it need be.
    was, now = (
        np.interp(c.moves, m.times, np.cumsum(np.append(0.0, steps_of(m)[:, ELBOW])))
        for c, m in ((clock, motion), (later, slower))
    )
    np.testing.assert_allclose(now, was, atol=0.02)
    far = np.abs(motion.times[:-1] - 1.5) > 0.5 + 2.0 * SLOWDOWN_AROUND_S
    assert slower.times[-1] - motion.times[-1] < (top / 2.0 - 0.5) * (~far).sum() / FPS


def test_what_is_slow_enough_is_left_as_it_is() -> None:
    motion, clock = bent(quick(1.0))
    assert slow_down(motion, clock, most(2.0), STILL) == (motion, clock)


def test_what_falls_falls_as_it_did() -> None:
    since = (np.arange(91) - 45.0) / FPS
    heights = np.maximum(1.0 + 4.905 * (0.2**2 - since**2), 1.0)
    motion, clock = bent(quick(7.0), heights)
    slower, _ = slow_down(motion, clock, most(2.0), STILL)
    falls = np.diff(slower.root[:, 1], 2) * FPS**2
    assert np.sum(np.abs(falls + 9.81) < 0.3) >= 10  # of the 0.4 s that it flies
    assert slower.root[:, 1].max() == pytest.approx(heights.max(), abs=1e-3)


def test_a_body_that_bobs_on_the_floor_is_slowed_as_others_are() -> None:
    heights = 1.0 + 0.015 * np.sin(0.9 * np.arange(91))
    motion, clock = bent(quick(4.0), heights)
    assert np.diff(heights, 2).min() * FPS**2 < -9.81
    slower, _ = slow_down(motion, clock, most(2.0), STILL)
    assert speeds(slower).max() < 2.0 * 1.03


def test_a_start_that_is_too_quick_is_slowed() -> None:
    at = np.arange(91) / FPS
    motion, clock = bent(0.01 * at)
    way = np.cumsum(np.cumsum(6.0 * np.exp(-(((at - 1.0) / 0.1) ** 2)) - 6.0 * np.exp(-(((at - 2.0) / 0.1) ** 2))))
    motion = replace(motion, root=motion.root + way[:, None] / FPS**2 * [1.0, 0.0, 0.0])

    def quickest(motion: Motion) -> float:
        return float(accelerations(moved_in(motion), 1.0 / (motion.times[1] - motion.times[0])).max())

    wanted = 0.6 * quickest(motion)
    slower, _ = slow_down(motion, clock, most(9.0, wanted), STILL)
    assert 0.8 * wanted < quickest(slower) < 1.06 * wanted
    assert slower.times[-1] < 1.5 * motion.times[-1]


def test_what_shows_more_between_frames_is_slowed_again() -> None:
    angles = np.where(np.arange(91) % 30 == 15, 0.12, 0.0)  # for one frame in thirty
    motion, clock = bent(angles)
    slower, _ = slow_down(motion, clock, most(2.0), STILL)
    assert speeds(motion).max() > 3.5
    assert speeds(slower).max() < 2.0 * 1.06


def test_a_foot_that_is_too_fast_near_the_floor_is_slowed_and_one_above_it_is_not() -> None:
    motion, clock = bent(np.zeros(91))
    low = float(lowest_height(BODY, motion.rotations, motion.root).min())
    way = np.cumsum(0.1 + 1.4 * np.exp(-(((np.arange(91) - 45.0) / 6.0) ** 2))) / FPS
    near = replace(motion, root=motion.root + way[:, None] * [1.0, 0.0, 0.0] - [0.0, low, 0.0])

    def quickest(motion: Motion) -> float:  # heights a second
        slides = foot_slides(BODY, motion.rotations, motion.root)
        return float(slides.max() / (motion.times[1] - motion.times[0]) / BODY.height)

    limit = 0.6 * quickest(near)
    slower, later = slow_down(near, clock, most(9.0), STILL, limit)
    assert 0.8 * limit < quickest(slower) < 1.1 * limit
    assert later.moves[-1] == slower.times[-1] < 1.5 * near.times[-1]
    for above, known in ((0.06, limit), (0.0, np.inf), (0.0, np.nan)):
        lifted = raised(near, np.full(91, above))
        assert slow_down(lifted, clock, most(9.0), STILL, known) == (lifted, clock)
    # Under ends that are lower the floor is lower.
    sunk = raised(near, np.where(np.abs(np.arange(91) - 45) < 25, -0.24, -0.3))
    assert slow_down(sunk, clock, most(9.0), STILL, limit) == (sunk, clock)


@pytest.mark.parametrize("top", [2.5, 3.0])
def test_what_is_too_fast_takes_its_time_from_the_rest_where_the_whole_lasts_as_long(top: float) -> None:
    motion, clock = bent(quick(top))
    slower, later = slow_down(motion, clock, most(2.0), STILL, kept=[motion.times[-1]])
    assert (len(slower), slower.times[-1], later.moves[-1]) == (91, motion.times[-1], motion.times[-1])
    assert speeds(slower).max() < 2.0 * 1.06 < speeds(motion).max()
    assert speeds(slower)[0] > speeds(motion)[0]
    np.testing.assert_array_equal(slower.rotations[[0, -1]], motion.rotations[[0, -1]])
    # Who has no time to spare stays as fast.
    hurries, clock = bent(np.linspace(0.0, 9.0, 91))
    assert slow_down(hurries, clock, most(2.0), STILL, kept=[hurries.times[-1]]) == (hurries, clock)


@pytest.mark.parametrize("middle", [45, 70])
def test_a_time_that_is_kept_stays_however_the_steps_around_it_change(middle: int) -> None:
    motion, _ = bent(quick(3.0))
    slower = slower_steps(motion, most(2.0), STILL, kept=motion.times[[middle, -1]])
    assert slower.max() > 1.1
    steps = np.diff(motion.times)
    assert slower[:middle] @ steps[:middle] == pytest.approx(motion.times[middle])
    assert slower @ steps == pytest.approx(motion.times[-1])


@pytest.mark.parametrize("end", [0, 1])
def test_an_end_that_is_passed_at_a_velocity_keeps_it(end: int) -> None:
    angles = np.concatenate([[0.0], np.cumsum(np.linspace(6.0, 0.5, 90)) / FPS])
    motion, clock = bent(angles if end == 0 else angles[-1] - angles[::-1])
    first, last = ((0, -1), (-1, 0))[end]
    slower, _ = slow_down(motion, clock, most(2.0), (end == 0, end == 1))
    assert speeds(slower)[first] == pytest.approx(speeds(motion)[first], rel=0.1)
    assert slower.times[-1] > motion.times[-1] + SLOWDOWN_FROM_END_S
    assert speeds(slower)[last] == pytest.approx(speeds(motion)[last], rel=0.1)


@pytest.mark.parametrize("end", [0, 1])
def test_who_brakes_from_a_given_velocity_is_not_slowed_down_for_that(end: int) -> None:
    """It would brake the harder; who starts as suddenly takes longer."""
    motion, clock = bent(np.zeros(91))
    steps = np.concatenate([[0.1] * 2, np.linspace(0.1, 0.0, 8), np.zeros(80)])
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    gone = gone if end == 0 else gone[-1] - gone[::-1]
    motion = replace(motion, root=motion.root + gone[:, None] * np.array([0.0, 0.0, 1.0]))
    hard = most(9.0, 0.3 * accelerations(moved_in(motion), FPS).max())
    assert slow_down(motion, clock, hard, (end == 0, end == 1))[1].frames[-1] == pytest.approx(3.0)
    assert slow_down(motion, clock, hard, STILL)[1].frames[-1] > 3.2
    assert slow_down(motion, clock, hard, (end == 1, end == 0))[1].frames[-1] > 3.2
