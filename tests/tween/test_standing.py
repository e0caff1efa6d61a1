"""Feet in whole tweens: those that stand stay, none sinks into the floor, and bodies turn the near way round."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from motionmind.body.contact import contact_points, lowest_height
from motionmind.body.motion import Motion, Posture
from motionmind.body.support import find_support, standing_rise, stands_alone
from motionmind.formats import read_motion
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import own_skeleton
from motionmind.tween.engine import Engine


@cache
def engine_of(name: str) -> Engine:
    return Engine.load(name)


@pytest.fixture(scope="module")
def recorded(shared_data: Path) -> Engine:
    clips = [own_skeleton(read_motion(path)) for path in sorted((shared_data / "cmu-05").glob("*.bvh"))[:10]]
    return Engine.fit(clips, name="cmu-05", rate=5.0, skip=1)


def posture(engine: Engine, row: int) -> Posture:
    corpus = engine.corpus
    return Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row])


def stances(engine: Engine, gap: int, within: float) -> Iterator[tuple[int, int, str]]:
    """Rows of postures `gap` moves apart, between which a foot stands in one place `within` metres, low."""
    corpus = engine.corpus
    points = corpus.skeleton.positions_and_tips(corpus.rotations, corpus.root)
    for clip in corpus.clips:
        here = points[clip.start : clip.stop]
        floor = np.percentile(here[..., 1].min(axis=1), 5.0)
        for side in ("left_toes", "right_toes"):
            foot = here[:, corpus.skeleton.index(side)]
            for row in range(0, len(foot) - gap, gap):
                stands = foot[row : row + gap + 1]
                near = np.linalg.norm(stands - stands[0], axis=1).max() < within
                if near and (stands[:, 1] - floor).max() < 2.0 * within:
                    yield clip.start + row, clip.start + row + gap, side


def departures_of_standing_feet(engine: Engine, gap: int, within: float) -> tuple[list[float], list[float]]:
    """How far standing feet slide and rise in twenty tweens between such postures, metres."""
    found = list(stances(engine, gap, within))
    chosen = np.random.default_rng(0).permutation(len(found))[:20]
    slides, rises = [], []
    for number in chosen:
        a, b, side = found[number]
        motion = engine.tween(posture(engine, a), posture(engine, b), moves=gap).motion
        foot = motion.skeleton.positions(motion.rotations, motion.root)[:, motion.skeleton.index(side)]
        slides.append(float(np.linalg.norm((foot - foot[0])[:, [0, 2]], axis=1).max()))
        rises.append(float((foot[:, 1] - foot[[0, -1], 1].max()).max()))
    return slides, rises


@pytest.mark.parametrize(("name", "gap"), [("ballet", 4), ("karate", 5)])
def test_a_foot_that_stands_in_a_in_b_and_between_stays_where_it_stands(name: str, gap: int) -> None:
    slides, rises = departures_of_standing_feet(engine_of(name), gap, 0.015)
    assert len(slides) > 10
    assert np.mean(slides) < 0.008  # it is 1.5 and 3.3 cm where nothing holds them
    assert np.max(slides) < 0.022
    assert np.max(rises) < 0.03


def test_a_dancer_s_standing_foot_stays_where_it_stands(recorded: Engine) -> None:
    slides, rises = departures_of_standing_feet(recorded, 3, 0.03)
    assert len(slides) > 10
    assert np.mean(slides) < 0.02
    assert np.mean(rises) < 0.03


def on_one_leg(engine: Engine, side: str, count: int) -> Iterator[tuple[Posture, Posture]]:
    """Postures of any clips that stand on the toes of one side alone; the second is moved onto the first one's foot
    and, where bodies may face anywhere, turned as that is."""
    corpus, rng = engine.corpus, np.random.default_rng(1)
    skeleton = corpus.skeleton
    foot, other = (skeleton.index(f"{name}_toes") for name in (side, "right" if side == "left" else "left"))
    points, turned = (
        skeleton.positions_and_tips(corpus.rotations, corpus.root),
        skeleton.global_rotations(corpus.rotations),
    )
    heights = points[..., 1] - points[..., 1].min(axis=1, keepdims=True)
    stands, hangs = (heights[:, [toes, toes + len(skeleton)]].min(axis=1) for toes in (foot, other))
    rows = np.flatnonzero((stands < 0.005) & (hangs > 0.05))
    while count:
        a, b = rng.choice(rows, 2, replace=False)
        rotations = corpus.rotations[b].copy()
        if corpus.facing == "free":
            as_there = rot.about_vertical(rot.heading(rot.mul_inv(turned[a, foot], turned[b, foot])))
            rotations[0] = rot.mul(as_there, rotations[0])
        elif rot.angle(corpus.rotations[a, 0], rotations[0]) > 0.6:
            continue
        there = skeleton.positions(rotations[None], corpus.root[b][None])[0, foot]
        root = corpus.root[b] + (points[a, foot] - there) * [1.0, 0.0, 1.0]
        yield Posture(skeleton, corpus.rotations[a], corpus.root[a]), Posture(skeleton, rotations, root)
        count -= 1


@pytest.mark.long
@pytest.mark.parametrize(("name", "within"), [("ballet", 0.006), ("karate", 0.03)])
def test_bodies_on_one_leg_stay_on_it_whatever_else_they_do(name: str, within: float) -> None:
    """Of default tweens; the foot's end that slides least counts, for a foot may turn on its ball or on its tip."""
    engine, slid = engine_of(name), []
    for side in ("left", "right"):
        for a, b in on_one_leg(engine, side, 20):
            motion = engine.tween(a, b).motion
            toes = motion.skeleton.index(f"{side}_toes")
            ends = motion.skeleton.positions_and_tips(motion.rotations, motion.root)[
                :, [toes, toes + len(motion.skeleton)]
            ]
            steps = np.linalg.norm(np.diff(ends[..., [0, 2]], axis=0), axis=-1)
            low = np.maximum(ends[1:, :, 1], ends[:-1, :, 1]) < 0.02
            slid.append(float(np.where(low, steps, np.inf).min(axis=1)[low.any(axis=1)].sum()))
    assert np.mean(slid) < within  # it is twice as far where nothing holds them


@pytest.mark.long
@pytest.mark.parametrize("name", ["ballet", "karate", "walk-hexapod"])
def test_no_frame_is_below_the_floor(name: str) -> None:
    """The floor is at 0, or as low as the ends are; legs at their joints' limits may leave a foot a little in it."""
    engine = engine_of(name)
    size = engine.corpus.skeleton.height
    for a, b in np.random.default_rng(1).integers(0, len(engine.corpus), (12, 2)).tolist():
        motion = engine.tween(posture(engine, a), posture(engine, b)).motion
        low = lowest_height(motion.skeleton, motion.rotations, motion.root)
        floor = np.interp(motion.times, motion.times[[0, -1]], np.minimum(low[[0, -1]], 0.0))
        assert np.min(low - floor) > -0.01 * size


def turned(found: Posture, degrees: float) -> Posture:
    """The posture facing `degrees` about the vertical."""
    rotations = found.rotations.copy()
    off = np.radians(degrees) - rot.heading(rotations[0])
    rotations[0] = rot.mul(rot.about_vertical(off), rotations[0])
    return replace(found, rotations=rotations)


def spinning(end: Posture, speed: float, before: bool) -> Motion:
    """Frames that lead to a posture, or follow it, while it turns on the spot at `speed` radians a second."""
    times = np.arange(5) / 30.0
    angles = speed * (times - (times[-1] if before else 0.0))
    rotations = np.repeat(end.rotations[None], 5, axis=0)
    rotations[:, 0] = rot.mul(rot.about_vertical(angles), rotations[:, 0])
    return Motion(end.skeleton, rotations, np.repeat(end.root[None], 5, axis=0), times, "spin")


@pytest.mark.parametrize("speeds", [None, (0.0, 0.0), (0.5, 0.5), (-0.5, -0.5)])
@pytest.mark.parametrize(("a", "b", "turn"), [(170.0, -170.0, 20.0), (-170.0, 170.0, -20.0), (0.0, 45.0, 45.0)])
def test_a_body_turns_the_near_way_round(a: float, b: float, turn: float, speeds: tuple[float, float] | None) -> None:
    engine = engine_of("karate")
    for row in (20, 130):
        stands = posture(engine, row)
        first, last = turned(stands, a), turned(posture(engine, row + 3), b)
        moving = {}
        if speeds:
            moving = {"before": spinning(first, speeds[0], True), "after": spinning(last, speeds[1], False)}
        motion = engine.tween(first, last, duration=1.5, **moving).motion
        headings = np.degrees(np.unwrap(rot.heading(motion.rotations[:, 0])))
        assert headings[-1] - headings[0] == pytest.approx(turn, abs=1e-6)
        assert headings.max() - headings.min() < abs(turn) + 40.0


@pytest.mark.parametrize(
    ("facings", "turns"),
    [
        ([170.0, -170.0], [20.0]),
        ([170.0, 180.0, -170.0], [10.0, 10.0]),
        ([0.0, 100.0, -120.0], [100.0, 140.0]),
        ([-90.0, 160.0, -170.0, 90.0], [-110.0, 30.0, -100.0]),
    ],
)
def test_from_one_posture_to_the_next_a_body_turns_the_near_way_round(facings: list[float], turns: list[float]) -> None:
    engine = engine_of("karate")
    a, *via, b = (turned(posture(engine, 130 + 3 * k), degrees) for k, degrees in enumerate(facings))
    tween = engine.tween(a, b, via=via, without=["pace"])  # in a longer time the path may turn the far way
    headings = np.degrees(np.unwrap(rot.heading(tween.motion.rotations[:, 0])))
    times = tween.motion.insertions[0].times[[0, *tween.passed, tween.moves]]
    np.testing.assert_allclose(np.diff(np.interp(times, tween.motion.times, headings)), turns, atol=3.0)
    assert np.ptp(headings) < np.ptp(np.cumsum([0.0, *turns])) + 40.0


@pytest.mark.long
def test_a_body_that_stands_on_the_same_leg_at_both_ends_does_not_leave_the_floor() -> None:
    """It may put down the other foot to turn."""
    engine = engine_of("ballet")
    corpus, rng = engine.corpus, np.random.default_rng(0)
    legs = stands_alone(corpus.skeleton, corpus.rotations, corpus.root)
    for _ in range(60):
        ends = []
        for row in rng.choice(np.flatnonzero(legs == rng.integers(2)), 2, replace=False):
            places, _ = contact_points(corpus.skeleton, corpus.rotations[row], corpus.root[row])
            ends.append(replace(posture(engine, row), root=corpus.root[row] - places[places[:, 1].argmin()]))
        motion = engine.tween(*ends, fps=30.0).motion
        if not np.isnan(standing_rise(motion.skeleton, motion.rotations, motion.root)):  # nor a step
            assert lowest_height(motion.skeleton, motion.rotations, motion.root).max() < 0.02


@pytest.mark.parametrize(("name", "row"), [("ballet", 0), ("ballet", 500), ("karate", 334)])
def test_a_body_with_nowhere_to_go_stays_where_it_is(name: str, row: int) -> None:
    engine = engine_of(name)
    here = posture(engine, row)
    motion = engine.tween(here, here, duration=1.5).motion
    np.testing.assert_allclose(motion.root, np.broadcast_to(here.root, motion.root.shape), atol=5e-3)
    assert np.degrees(rot.angle(motion.rotations, here.rotations)).max() < 8.0


def test_a_body_in_the_air_lands_and_jumps_where_there_is_time() -> None:
    engine = engine_of("ballet")
    leaps = engine.statistics.aloft[: len(engine.corpus)] * engine.statistics.clearance[: len(engine.corpus)]
    here = posture(engine, int(np.abs(leaps - 0.25).argmin()))
    motion = engine.tween(here, here, duration=1.5).motion
    low = lowest_height(motion.skeleton, motion.rotations, motion.root)
    floor = low.min()
    assert low[0] - floor > 0.1
    support = find_support(motion.skeleton, motion.rotations, motion.root, motion.fps)
    assert support.mass is not None
    fall = np.diff(support.mass[:, 1], 2) * motion.fps**2
    np.testing.assert_allclose(fall[(low > floor + 0.05)[1:-1]], -9.81, rtol=0.2)
