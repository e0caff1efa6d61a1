"""What walks through bundled corpora expect: exact at stops, moving as they do, and little where they know little."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture, Velocity
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.walks.expectation import Expectation, expect
from motionmind.walks.headings import turn_with_walks
from motionmind.walks.mean_walk import _without_ends
from motionmind.walks.minimal import END_VELOCITY_DECAY_S, minimal_movement
from motionmind.walks.stops import Rates, Stop, sample_rates, stop_at

CORPORA = ["ballet", "karate", "walk-hexapod"]  # stage and free, people and insects
STEPS = 6


@cache
def engine_of(name: str) -> Engine:
    return Engine.load(name)


@pytest.fixture(scope="module", params=CORPORA)
def engine(request: pytest.FixtureRequest) -> Engine:
    return engine_of(request.param)


def clip_of(engine: Engine) -> Motion:
    return engine.corpus.motion(engine.corpus.clips[0])


def expected(engine: Engine, stops: dict[int, Stop], path: Floats | None = None) -> Expectation:
    half_steps = np.linspace(0.0, max(stops) * float(np.median(engine.corpus.seconds)), 2 * max(stops) + 1)
    return expect(engine.corpus, engine.statistics, stops, half_steps, path)


def chains_at(engine: Engine, found: Expectation) -> Floats:
    return found.chains(engine.corpus, found.half_steps)


def far_off(engine: Engine, seed: int) -> Posture:
    """A posture that the corpus knows nothing like: every joint about a right angle off the first."""
    first, rng = clip_of(engine).posture(0), np.random.default_rng(seed)
    off = rng.normal(size=(len(first.skeleton), 3))
    off *= 1.5 / np.linalg.norm(off, axis=1, keepdims=True)
    return replace(first, rotations=rot.mul(first.rotations, rot.exp(off)))


def test_stops_are_met_exactly(engine: Engine) -> None:
    clip = clip_of(engine)
    moving = Velocity(np.full((len(clip.skeleton), 3), 0.7), np.array([0.2, 0.0, 0.1]))
    stops = {
        0: stop_at(engine.corpus, clip.posture(3), moving),
        2: stop_at(engine.corpus, clip.posture(6)),
        STEPS: stop_at(engine.corpus, far_off(engine, 0), moving),
    }
    found = expected(engine, stops)
    chains = chains_at(engine, found)
    for move, stop in stops.items():
        assert rot.angle(chains[2 * move], stop.chains).max() < 1e-6
    assert np.isfinite(chains).all()
    np.testing.assert_allclose(found.samples.sum(axis=1), 1.0)
    np.testing.assert_allclose(found.moves.sum(axis=1), 1.0)


def test_walks_between_postures_of_the_corpus_are_trusted_and_the_less_the_farther_both_ends_are(
    engine: Engine,
) -> None:
    a, b = clip_of(engine).posture(3), clip_of(engine).posture(12)
    far, rng = [], np.random.default_rng(1)
    off = rng.normal(size=(len(a.skeleton), 3))
    for size in (0.0, 0.3, 0.7, 1.2):
        ends = [replace(end, rotations=rot.mul(end.rotations, rot.exp(size * off))) for end in (a, b)]
        stops = dict(zip((0, STEPS), (stop_at(engine.corpus, end) for end in ends), strict=True))
        far.append(np.median(expected(engine, stops).trust))
    assert far[0] > 0.99
    assert far[1] < 0.5 * far[0]
    assert np.all(np.diff(far) <= 0.0)
    assert far[-1] == 0.0


@pytest.mark.parametrize("size", [0.1, 0.3])
def test_far_from_the_corpus_joints_turn_the_short_way(engine: Engine, size: float) -> None:
    """Between two postures near each other and far from everything known."""
    a, rng = far_off(engine, 2), np.random.default_rng(3)
    off = rng.normal(size=(len(a.skeleton), 3))
    off[0] = 0.0
    off *= size / np.maximum(np.linalg.norm(off, axis=1, keepdims=True), 1e-9)
    b = replace(a, rotations=rot.mul(a.rotations, rot.exp(off)))
    stops = {0: stop_at(engine.corpus, a), STEPS: stop_at(engine.corpus, b)}
    found = expected(engine, stops)
    share = np.linspace(0.0, 1.0, 2 * STEPS + 1)[:, None]
    joints = len(a.skeleton)
    straight = rot.slerp(stops[0].chains[None, :joints], stops[STEPS].chains[None, :joints], share)
    assert rot.angle(found.poses, straight).max() < 0.05 * size


def test_without_displacement_no_joint_moves(engine: Engine) -> None:
    joints = len(engine.corpus.skeleton)
    for posture in (clip_of(engine).posture(5), far_off(engine, 4)):
        stop = stop_at(engine.corpus, posture)
        found = expected(engine, {0: stop, STEPS: stop})
        assert rot.angle(found.poses, stop.chains[:joints]).max() < 1e-6


@pytest.mark.parametrize("goes", ["elsewhere", "on"])
def test_a_travelling_cycle_has_a_displacement(engine: Engine, goes: str) -> None:
    """It travels, or moves at its ends: what the corpus knows of such movement is trusted, as it is not at rest."""
    a = clip_of(engine).posture(5)
    off = np.random.default_rng(6).normal(size=(len(a.skeleton), 3))
    a = replace(a, rotations=rot.mul(a.rotations, rot.exp(1e-3 * off)))
    ahead = np.array([0.0, 0.0, 0.8 * a.skeleton.height if goes == "elsewhere" else 0.0])
    moving = Velocity(np.full((len(a.skeleton), 3), 1.0), np.zeros(3)) if goes == "on" else None
    stops = {
        0: stop_at(engine.corpus, a, moving),
        STEPS: stop_at(engine.corpus, replace(a, root=a.root + ahead), moving),
    }
    still = dict.fromkeys((0, STEPS), stop_at(engine.corpus, a))
    assert expected(engine, still).trust.max() == 0.0
    assert expected(engine, stops).trust.min() > 0.9


def test_a_path_draws_the_walks_to_it(engine: Engine) -> None:
    """Of two recorded ways on, walks take the one that they are told of."""
    clip, joints = clip_of(engine), len(engine.corpus.skeleton)
    a, b = (stop_at(engine.corpus, clip.posture(row)) for row in (4, 4 + STEPS))
    path = engine.corpus.to_chains(clip.rotations[4 : 5 + STEPS])[:, :joints]
    free, led = (expected(engine, {0: a, STEPS: b}, one).poses[::2] for one in (None, path))
    assert rot.angle(led, path).mean() < rot.angle(free, path).mean()
    other = rot.slerp(path[:1], path[-1:], np.linspace(0.0, 1.0, STEPS + 1)[:, None])
    astray = expected(engine, {0: a, STEPS: b}, other).poses[::2]
    assert rot.angle(astray, path).mean() > rot.angle(led, path).mean()


def test_velocities_choose_among_walks(engine: Engine) -> None:
    """A posture with the velocity that it was recorded with, and against it: walks go on as it moved there."""
    corpus, clip = engine.corpus, clip_of(engine)
    rates = sample_rates(corpus, engine.statistics)
    last = stop_at(corpus, far_off(engine, 5))

    def likely(row: int, sign: float, which: str) -> float:
        """How likely the moment is in which the body was there, with one of its velocities by `sign`."""
        own = {"joints": rates.joints[row], "turn": rates.turn[row], "travel": rates.travel[row]}
        own[which] = sign * own[which]
        stop = stop_at(corpus, clip.posture(row))._replace(rates=Rates(**own))
        return float(expected(engine, {0: stop, STEPS: last}).samples[0, row])

    inner = slice(2, len(clip) - 2)
    speeds = {
        "joints": np.linalg.norm(rates.joints[inner], axis=-1).mean(axis=1),
        "turn": np.abs(rates.turn[inner]),
        "travel": np.linalg.norm(rates.travel[inner], axis=1),
    }
    for which, speed in speeds.items():
        row = int(speed.argmax()) + 2
        if speed.max() > 0.02:
            assert likely(row, 1.0, which) > likely(row, -1.0, which), which


def spinning(engine: Engine, posture: Posture, turn: float, seed: int) -> Stop:
    """A stop at a posture whose joints move, and which turns about the vertical."""
    velocity = np.random.default_rng(seed).normal(size=(len(posture.skeleton), 3))
    stop = stop_at(engine.corpus, posture, Velocity(velocity, np.zeros(3)))
    assert stop.rates is not None
    return stop._replace(rates=stop.rates._replace(turn=np.asarray(turn)))


def test_headings_are_those_of_the_walks_or_of_the_body_where_it_has_its_own(engine: Engine) -> None:
    clip = clip_of(engine)
    stops = {0: spinning(engine, clip.posture(3), 0.7, 8), STEPS: spinning(engine, clip.posture(9), -1.3, 9)}
    found, statistics = expected(engine, stops), engine.statistics
    if engine.corpus.facing == "stage":
        np.testing.assert_allclose(found.headings, rot.heading(found.poses[:, 0]), atol=1e-12)
        return
    turn, spread = (found.moves @ moved for moved in (statistics.turn, statistics.turn**2))
    facing = {move: stop.chains[-1] for move, stop in stops.items()}
    by_hand = turn_with_walks(turn, spread, found.trust[:, 0], found.half_steps, facing, (0.7, -1.3))
    np.testing.assert_allclose(found.headings, by_hand, atol=1e-12)


def test_far_from_the_corpus_joints_go_on_as_they_move_at_the_ends(engine: Engine) -> None:
    """Both ends are given their velocities, or the one or the other: the movement is the minimal one with them."""
    joints, a = len(engine.corpus.skeleton), far_off(engine, 2)
    b = replace(a, rotations=rot.mul(a.rotations, rot.exp(np.full((joints, 3), 0.1))))
    both = spinning(engine, a, 0.0, 8), spinning(engine, b, 0.0, 9)
    for first, last in ((True, True), (True, False), (False, True)):
        ends = [stop if moves else stop._replace(rates=None) for stop, moves in zip(both, (first, last), strict=True)]
        found = expected(engine, {0: ends[0], STEPS: ends[1]})
        rates = [None if end.rates is None else end.rates.joints for end in ends]
        decay = float(engine.statistics.trust.lasts[0])
        wanted = minimal_movement(np.stack([end.chains[:joints] for end in ends]), found.half_steps, *rates, decay)
        still = minimal_movement(np.stack([end.chains[:joints] for end in ends]), found.half_steps, None, None)
        assert rot.angle(found.poses, wanted).max() < 0.15 * rot.angle(still, wanted).max()


def test_walks_use_both_end_velocities(engine: Engine) -> None:
    """Each changes how likely samples are there, beside the other too."""
    clip = clip_of(engine)
    a, b = spinning(engine, clip.posture(3), 0.7, 8), spinning(engine, clip.posture(9), -1.3, 9)
    samples = expected(engine, {0: a, STEPS: b}).samples
    for ends, at in (({0: a._replace(rates=None), STEPS: b}, 0), ({0: a, STEPS: b._replace(rates=None)}, -1)):
        assert np.abs(expected(engine, ends).samples[at] - samples[at]).sum() > 0.01


def test_velocities_of_samples_are_those_of_the_chains(engine: Engine) -> None:
    """In the middle of a move, those of the move; and a stop's are those with which its chains turn."""
    corpus, statistics = engine.corpus, engine.statistics
    rates, seconds = sample_rates(corpus, statistics), corpus.moves.seconds
    begins, ends = corpus.moves.begins, corpus.moves.ends
    chains, middles = corpus.to_chains(corpus.rotations), len(corpus) + np.arange(len(seconds))
    joints = len(corpus.skeleton)
    turned = rot.log(rot.inv_mul(chains[begins], chains[ends])) / seconds[:, None, None]
    small = np.linalg.norm(turned, axis=-1).max(axis=1) * seconds < 0.5 * np.pi
    np.testing.assert_allclose(rates.joints[middles][small], turned[small][:, :joints], atol=1e-6)
    if corpus.facing == "free":
        np.testing.assert_allclose(rates.turn[middles], turned[:, -1, 1], atol=1e-6)
    moved = corpus.root[ends] - corpus.root[begins]
    np.testing.assert_allclose(
        np.linalg.norm(rates.travel[middles], axis=1), np.linalg.norm(moved, axis=1) / seconds, atol=1e-6
    )
    posture, rng = clip_of(engine).posture(2), np.random.default_rng(6)
    turned_about = posture.rotations.copy()
    turned_about[0] = rot.mul(rot.about_vertical(2.0), turned_about[0])
    posture = replace(posture, rotations=turned_about)
    velocity = Velocity(rng.normal(size=(joints, 3)), rng.normal(size=3))
    stop = stop_at(corpus, posture, velocity)
    assert stop.rates is not None
    later = corpus.to_chains(rot.mul(posture.rotations, rot.exp(1e-5 * velocity.rotations)))
    expected_turns = rot.log(rot.inv_mul(stop.chains, later)) / 1e-5
    np.testing.assert_allclose(stop.rates.joints, expected_turns[:joints], atol=0.02)
    if corpus.facing == "free":
        assert stop.rates.turn == pytest.approx(expected_turns[-1, 1], abs=0.02)
    else:
        assert stop.rates.turn == 0.0
        np.testing.assert_array_equal(rates.turn, 0.0)
    back = rot.mul_vec(rot.about_vertical(rot.heading(posture.rotations[0])), stop.rates.travel)
    np.testing.assert_allclose(back, velocity.root, atol=1e-9)


@pytest.mark.parametrize("moving", [(False, False), (True, False), (False, True), (True, True)])
def test_departures_and_given_rates_are_zero_at_the_ends(moving: tuple[bool, bool]) -> None:
    rng = np.random.default_rng(7)
    times = np.linspace(0.0, 2.0, 2001)
    waves = np.sin(times[:, None, None] * rng.uniform(0.5, 3.0, (4, 3)) + rng.uniform(0.0, 6.0, (4, 3)))
    out = _without_ends(waves, times, *moving, decay=END_VELOCITY_DECAY_S)
    np.testing.assert_allclose(out[[0, -1]], 0.0, atol=1e-12)
    rates = np.abs(np.diff(out, axis=0)[[0, -1]] / 0.001).max(axis=(1, 2))
    for rate, still in zip(rates, moving, strict=True):
        assert (rate < 0.02) == still
    # What is taken out is no more than what the ends were off, and their rates.
    assert np.abs(out - waves).max() < np.abs(waves[[0, -1]]).max() + 3.0
