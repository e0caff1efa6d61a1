"""How long a corpus's bodies take for how far a way, and how fast they are at most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import insect
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import find_peaks

from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.clip import JointRepair
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.corpus.kept import Kept
from motionmind.geometry import rotations as rot
from motionmind.learned.pace import (
    MIN_PEAK_ROOT_ACCELERATION,
    MIN_PEAK_SPEEDS,
    PRIOR_LEVEL,
    PRIOR_PULL,
    PRIOR_SLOPE,
    PULL_RANGE,
    SLOPE_RANGE,
    Pace,
    Way,
    _fit,
    _smooth,
    find_still,
    measure_pace,
    refit_pace,
    way_between,
    way_of,
)
from motionmind.learned.sampled import SAMPLED_FPS

ARM = 7


def reaches(skeleton: Skeleton, seconds: list[float], angles: list[float], stride: float = 0.0) -> Motion:
    """All joints but the root turn there and back, one of them farthest; the root travels; still between moves."""
    times, turned, gone = [0.0], [0.0], [0.0]
    for number, (length, angle) in enumerate(zip(seconds, angles, strict=True)):
        share = np.arange(1, round(length * SAMPLED_FPS) + 1) / round(length * SAMPLED_FPS)
        eased = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)  # least jerk
        way = angle if number % 2 == 0 else -angle
        times += [times[-1] + length * part for part in share]
        turned += [turned[-1] + way * part for part in eased]
        gone += [gone[-1] + stride * angle * part for part in eased]
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (len(times), len(skeleton), 1))
    for joint in range(1, len(skeleton)):
        share = 1.0 if joint == ARM else 0.5
        rotations[:, joint] = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), share * np.array(turned))
    root = np.zeros((len(times), 3))
    root[:, 2] = gone
    return Motion(skeleton, rotations, root, np.array(times), "reaches")


def learn_pace(corpus: Corpus) -> Pace:
    return refit_pace(corpus, measure_pace(Kept.none(corpus)))


def learned(*clips: Motion, rate: float | None = 10.0) -> Pace:
    return learn_pace(gather("reaches", clips, rate=rate))


def way(skeleton: Skeleton, turn: float = 0.0, travel: float = 0.0, facing: float = 0.0) -> Way:
    """The way of a body whose arm turns, that travels, and faces elsewhere in the end."""
    still = reaches(skeleton, [1.0], [0.0]).posture(0)
    rotations, root = still.rotations.copy(), still.root + np.array([0.0, 0.0, travel])
    rotations[0] = rot.about_vertical(np.array(facing))
    rotations[ARM] = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(turn))
    return way_between(still, Posture(skeleton, rotations, root))


def expected(pace: Pace, way: Way, resting_speed: float = 0.2) -> float:
    """The median duration of movement between two such lulls."""
    return float(pace.expected(way, (np.array(resting_speed), np.array(resting_speed))))


def test_a_way_is_what_a_body_does_between_two_postures() -> None:
    skeleton = human23()
    there = way(skeleton, turn=0.7, travel=2.0 * skeleton.height, facing=-0.4)
    assert there.joints[ARM] == pytest.approx(0.7)
    assert there.joints.sum() == pytest.approx(0.7)  # that the body turns is no turn of the root's own
    assert (float(there.turn), float(there.travel)) == (pytest.approx(0.4), pytest.approx(2.0))


def test_still_samples_are_found_where_moves_meet() -> None:
    clip = reaches(human23(), [0.8, 1.2, 0.6, 1.0], [1.0, 1.0, 2.0, 2.0])
    np.testing.assert_allclose(find_still(way_of(clip).joints.mean(axis=1)), np.cumsum([24, 36, 18]), atol=4)


@pytest.mark.parametrize("length", [20, 21, 60])
def test_a_level_stretch_is_still_once_in_its_middle_and_only_where_it_is_slower_on_both_sides(length: int) -> None:
    levels = {0.05: 40, 0.03: 40, 0.002: length, 0.06: 40}
    assert find_still(np.repeat([*levels], [*levels.values()])).tolist() == [80 + (length - 1) // 2]


@given(st.lists(st.sampled_from([0.0, 0.01, 0.02, 0.05]), max_size=60))
def test_still_samples_are_the_peaks_that_scipy_finds(steps: list[float]) -> None:
    expected = find_peaks(-np.round(_smooth(np.array(steps)), 9))[0]
    np.testing.assert_array_equal(find_still(np.array(steps)), expected)


@given(seed=st.integers(0, 2**32 - 1))
def test_still_samples_do_not_hang_on_rounding(seed: int) -> None:
    """Joints of keyframed movement turn evenly from key to key: whether one step is less than the next is chance."""
    chance = np.random.default_rng(seed)
    lasts = chance.integers(20, 60, size=6)
    steps = np.repeat(np.where(np.arange(6) % 2, 0.002, 0.05), lasts)
    rounded = steps * (1.0 + 1e-14 * chance.standard_normal(len(steps)))
    still = find_still(steps)
    assert len(still) == 2  # nothing comes after the third slow stretch
    np.testing.assert_array_equal(find_still(rounded), still)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_who_is_slower_in_the_same_is_expected_to_take_longer(factor: float) -> None:
    seconds, angles = [0.8, 1.0, 1.2, 0.9] * 6, [0.4, 1.5] * 12
    clips = [reaches(human23(), [times * length for length in seconds], angles, 0.3) for times in (1.0, factor)]
    usual, other = (learned(clip) for clip in clips)
    there = way(human23(), turn=1.0, travel=0.3)
    assert (expected(other, there) > expected(usual, there)) == (factor > 1.0)
    assert other.fastest[ARM] == pytest.approx(usual.fastest[ARM] / factor, rel=0.15)


def test_of_many_windows_on_a_plane_the_law_is_that_plane() -> None:
    efforts, quickness = np.random.default_rng(0).uniform([0.5, -2.0], [3.0, 0.5], size=(20_000, 2)).T
    law = _fit(efforts, quickness, 0.7 + 0.4 * efforts - 0.2 * quickness)
    np.testing.assert_allclose(law[:3], [0.7, 0.4, -0.2], atol=0.01)


def test_windows_that_say_nothing_leave_the_prior() -> None:
    law = _fit(*np.zeros((3, 0)))
    np.testing.assert_allclose(law[:3], [PRIOR_LEVEL, PRIOR_SLOPE, PRIOR_PULL])
    slope, pull = _fit(np.linspace(0.5, 3.0, 99), np.linspace(-2.0, 0.5, 99), np.linspace(9.0, 0.0, 99))[1:3]
    assert (slope, pull) == (SLOPE_RANGE[0], PULL_RANGE[0])  # whatever the windows say, a longer way takes longer


def test_a_longer_way_takes_longer() -> None:
    rng = np.random.default_rng(0)
    for seed in range(5):
        seconds, angles = rng.uniform(0.4, 1.5, 20).tolist(), rng.uniform(0.1, 2.0, 20).tolist()
        pace = learned(reaches(human23(), seconds, angles, rng.uniform(0.0, 1.0)))
        assert SLOPE_RANGE[0] <= pace.law[1] <= SLOPE_RANGE[1], seed
        for kind, most in (("turn", 3.0), ("travel", 5.0), ("facing", 3.0)):
            taken = [expected(pace, way(human23(), **{kind: far})) for far in np.linspace(0.0, most, 20)]
            assert np.all(np.diff(taken) > 0.0), (seed, kind)
            assert taken[-1] < 60.0


def rests_and_runs() -> Motion:
    """Movement from rest to rest whose way is long, then movement there and back that never stops."""
    rests = reaches(human23(), [1.5] * 12, [1.5] * 12)
    times = np.arange(600) / SAMPLED_FPS
    rotations = np.tile(rests.rotations[-1], (len(times), 1, 1))
    turned = 6.0 * times + 0.8 * np.cos(6.0 * times)  # as many lulls, at a fifth of the mean speed or more
    for joint in range(1, len(rests.skeleton)):
        rotations[:, joint] = rot.from_axis_angle(np.array([0.0, 1.0, 0.0]), 0.2 * turned)
    root = np.tile(rests.root[-1], (len(times), 1))
    clock = np.concatenate([rests.times, rests.times[-1] + 1 / SAMPLED_FPS + times])
    return replace(
        rests,
        rotations=np.concatenate([rests.rotations, rotations]),
        root=np.concatenate([rests.root, root]),
        times=clock,
    )


def test_the_lulls_are_the_speeds_of_the_still_samples_around() -> None:
    clip = rests_and_runs()
    corpus = gather("lulls", [clip], rate=10.0)
    resting_speeds, speeds = learn_pace(corpus).resting_speeds, SAMPLED_FPS * way_of(clip).joints.mean(axis=1)
    resting = corpus.times < 15.0
    running = corpus.times > 20.0
    assert resting_speeds[resting].max() < 0.2 * resting_speeds[running].min()
    assert resting_speeds[resting].max() < 0.5  # also in the middle of a movement, where the body is fast
    assert resting_speeds[running].min() < speeds[600:].mean() / speeds.mean()


def test_it_takes_no_longer_in_the_midst_of_quick_movement() -> None:
    pace, there = learned(reaches(human23(), [0.8, 1.2] * 9, [0.7, 1.4] * 9)), way(human23(), turn=1.0)
    taken = [expected(pace, there, resting_speed) for resting_speed in np.linspace(0.0, 3.0, 9)]
    assert np.all(np.diff(taken) < 0.0)
    one, other = (
        pace.expected(there, resting_speeds)
        for resting_speeds in ((np.array(0.1), np.array(1.0)), (np.array(1.0), np.array(0.1)))
    )
    assert one == other


def test_a_posture_has_the_lull_of_those_that_are_like_it() -> None:
    corpus = gather("lulls", [rests_and_runs()], rate=10.0)
    pace, shown = learn_pace(corpus), corpus.to_chains(corpus.rotations)[:, : len(corpus.skeleton)]
    numbers = np.array([40, 90, len(corpus) - 50])
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(3, len(corpus.skeleton), 1))
    found = pace.resting_speeds_of(signs * shown[numbers], shown)  # q and -q are one orientation
    for resting_speed, number in zip(found, numbers, strict=True):
        alike = np.argsort(np.sum(rot.angle(shown, shown[number]) ** 2, axis=1), kind="stable")[:5]
        assert pace.resting_speeds[alike].min() - 1e-9 <= resting_speed <= pace.resting_speeds[alike].max() + 1e-9
    assert found[2] > 3.0 * found[0]
    few = replace(pace, resting_speeds=pace.resting_speeds[:2])
    assert np.isfinite(few.resting_speeds_of(shown[:1], shown[:2])).all()


def test_nothing_is_learned_of_durations_from_what_was_reconstructed() -> None:
    corpus = gather("mended", [reaches(human23(), [0.8, 1.2] * 9, [0.7, 1.4] * 9)], rate=10.0)
    (clip,) = corpus.clips

    def law(*spans: tuple[float, float], exact: bool = False) -> list[float]:
        repairs = tuple(JointRepair("left_knee", 0, 0, span, exact) for span in spans)
        return learn_pace(replace(corpus, clips=(replace(clip, repairs=repairs),))).law[:3].tolist()

    last = float(corpus.times[-1])
    assert law((0.0, last)) == pytest.approx([PRIOR_LEVEL, PRIOR_SLOPE, PRIOR_PULL])
    assert law((0.0, last), exact=True) == law()
    assert law(*((second, second) for second in np.arange(0.0, last, 0.2))) == pytest.approx(
        [PRIOR_LEVEL, PRIOR_SLOPE, PRIOR_PULL]
    )
    assert law((8.9, 9.1)) not in (law(), law((0.0, last)))


def test_the_fastest_speeds_are_those_of_the_rarest_frames() -> None:
    clip = reaches(human23(), [1.0] * 30, [1.5] * 30, 1.0)
    pace, speeds = learned(clip, rate=30.0), SAMPLED_FPS * way_of(clip).parts
    assert pace.fastest[ARM] == pytest.approx(np.percentile(speeds[:, ARM], 99.0), rel=0.05)
    assert pace.fastest[-1] == pytest.approx(np.percentile(speeds[:, -1], 99.0), rel=0.05)


def test_long_movement_shows_no_more_than_the_clips_that_are_as_long() -> None:
    quick, calm = (
        reaches(human23(), [2.0 * length] * count, [1.5] * count, 1.0) for length, count in ((0.3, 4), (1, 9))
    )
    pace = learned(*[quick] * 20, calm, rate=30.0)
    assert quick.times[-1] < 3.0
    assert calm.times[-1] > 6.0
    tops = [SAMPLED_FPS * way_of(clip).parts[:, -1].max() for clip in (quick, calm)]
    assert pace.peaks_in(1.0)[-3] == pytest.approx(tops[0], rel=0.05)
    assert pace.peaks_in(9.0)[-3] == pytest.approx(max(tops[1], pace.fastest[-1]), rel=0.05)
    assert np.all(np.diff([pace.peaks_in(seconds)[-3] for seconds in np.linspace(0.5, 7.0, 9)]) <= 0.0)
    assert np.all(pace.peaks[:, :-2] >= pace.fastest)
    assert np.all(pace.peaks[:, -2:] > 0.0)  # also where nothing ever rises
    starts = [SAMPLED_FPS**2 * np.abs(np.diff(clip.root, 2, axis=0)).max() / human23().height for clip in (quick, calm)]
    assert pace.peaks_in(1.0)[-1] == pytest.approx(starts[0], rel=0.05)
    assert pace.peaks_in(9.0)[-1] == pytest.approx(max(starts[1], MIN_PEAK_ROOT_ACCELERATION), rel=0.05)


def test_what_was_reconstructed_is_no_peak() -> None:
    calm, quick = (reaches(human23(), [length] * 9, [1.5] * 9) for length in (2.0, 0.4))
    times = np.concatenate([calm.times, calm.times[-1] + 1 / SAMPLED_FPS + quick.times])
    both = {name: np.concatenate([getattr(calm, name), getattr(quick, name)]) for name in ("rotations", "root")}
    corpus = gather("mended", [replace(calm, times=times, **both)], rate=10.0, flips="keep")
    (clip,) = corpus.clips
    repairs = (JointRepair("left_knee", 0, 0, (float(calm.times[-1]), float(times[-1])), exact=False),)
    mended = replace(corpus, clips=(replace(clip, repairs=repairs),))
    one, other = learn_pace(corpus), learn_pace(mended)
    assert other.peaks_in(2.0)[ARM] == pytest.approx(other.fastest[ARM], rel=1e-9)
    assert one.peaks_in(2.0)[ARM] > 1.05 * other.peaks_in(2.0)[ARM]


def test_what_never_moves_in_a_corpus_may_move() -> None:
    pace = learned(reaches(human23(), [1.0, 1.0], [1.0, 1.0]))
    assert np.all(pace.fastest > 0.0)
    assert pace.fastest[0] == pytest.approx(0.25 * np.median(pace.fastest[:-2]))
    assert tuple(pace.fastest[-2:]) == MIN_PEAK_SPEEDS[1:]


def test_where_most_joints_rest_they_may_move_as_everyday() -> None:
    motion = reaches(human23(), [2.0, 1.0], [0.8, 0.8])
    rotations = np.tile(rot.normalise(np.array([0.1, 0.2, 0.3, 0.4])), (len(motion), len(human23()), 1))
    rotations[:, ARM] = motion.rotations[:, ARM]
    rotations *= 1.0 + 1e-15 * np.random.default_rng(0).standard_normal((len(motion), len(human23()), 1))
    pace = learned(replace(motion, rotations=rotations))
    assert (np.delete(pace.fastest[:-2], ARM) == MIN_PEAK_SPEEDS[0]).all()


@pytest.mark.parametrize("frames", [2, 3])
def test_a_corpus_of_a_few_postures_has_the_prior(frames: int) -> None:
    still = reaches(human23(), [1.0], [0.5]).slice(0, frames)
    pace = learn_pace(gather("few", [still], rate=None))
    assert np.isfinite(pace.law).all()
    assert 0.5 < expected(pace, way(human23(), turn=1.0, travel=1.0)) < 5.0


def test_size_does_not_matter() -> None:
    clip = reaches(human23(), [0.8, 1.2] * 8, [1.0, 1.0] * 8, 0.5)
    body = clip.skeleton
    small = Skeleton("small", body.names, body.parents, 0.01 * body.offsets, 0.01 * body.tips)
    shrunk = replace(clip, skeleton=small, root=0.01 * clip.root)
    for one, other in zip(vars(learned(clip)).values(), vars(learned(shrunk)).values(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6)


def test_insects_have_a_pace_too() -> None:
    body = insect()
    pace = learned(reaches(body, [0.5, 0.4] * 10, [0.8, 0.8] * 10, 0.01))
    assert len(pace.fastest) == len(body) + 2
    assert expected(pace, way(body, turn=0.8)) < expected(pace, way(body, turn=0.8, travel=0.1))
