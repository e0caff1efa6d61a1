"""Measures of movement: laws that they keep, and what others' definitions give on the same movement."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bodies import insect
from command_line import Run
from hypothesis import given
from hypothesis import strategies as st

from motionmind._typing import Floats, Int32s
from motionmind.body.contact import find_feet, find_floor, foot_slide, skating
from motionmind.body.human import human23, human44
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot
from motionmind.metrics.figures import MAIN_FIGURES, _pieces, at_rate, measure
from motionmind.metrics.inbetween import l2p, l2q, npss, position_spread, seen
from motionmind.metrics.paths import arrival_spread, arrivals, attested_share, learn_habits
from motionmind.metrics.smoothness import angular_jerk, angular_speed, sparc
from motionmind.metrics.style import features, fit_style_classifier
from motionmind.metrics.verbatim import learn_phrases
from motionmind.tween.engine import Engine

seeds = st.integers(0, 2**32 - 1)


def movement(rng: np.random.Generator, *shape: int, step: float = 0.1) -> Floats:
    """Rotations [*shape, 4] that walk at random along the first axis but one of the last two, from random ones."""
    start = rot.exp(rng.normal(size=(*shape[:-2], 1, shape[-1], 3)))
    steps = rot.exp(step * rng.normal(size=(*shape, 3)))
    out = [start[..., 0, :, :]]
    for t in range(1, shape[-2]):
        out.append(rot.mul(out[-1], steps[..., t, :, :]))
    return np.stack(out, axis=-3)


def flipped(rng: np.random.Generator, q: Floats) -> Floats:
    """The same rotations, some as -q."""
    return np.asarray(q * rng.choice([-1.0, 1.0], size=(*q.shape[:-1], 1)))


# --- in between -------------------------------------------------------------------------------------------------------


def lafan1(truth: Floats, made: Floats) -> tuple[float, float]:
    """L2Q and NPSS of global quaternions [B, T, J, 4] whose signs fit, as the protocol's formulas read, one by one."""
    norms = [np.linalg.norm(made[b, t] - truth[b, t]) for b in range(len(truth)) for t in range(truth.shape[1])]
    distances, weights = [], []
    for b in range(len(truth)):
        for joint in range(truth.shape[2]):
            for k in range(4):
                power = [np.fft.fft(q[b, :, joint, k]).real ** 2 for q in (truth, made)]
                share = [one / one.sum() if one.sum() else one for one in power]
                distances.append(np.abs(np.cumsum(share[1]) - np.cumsum(share[0])).sum())
                weights.append(power[0].sum())
    return float(np.mean(norms)), float(np.dot(distances, weights) / np.sum(weights))


@given(seeds)
def test_l2q_and_npss_are_those_of_the_protocol(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = movement(rng, 3, 12, 5)
    made = rot.mul(truth, rot.exp(0.2 * rng.normal(size=(3, 12, 5, 3))))
    made[0, :, 0] = rot.IDENTITY  # no power in three of its coefficients
    expected = lafan1(np.asarray(truth), made * np.sign(np.sum(made * truth, axis=-1, keepdims=True)))
    assert l2q(truth, made).mean() == pytest.approx(expected[0])
    smooth = made.copy()
    for t in range(1, 12):
        smooth[:, t] *= np.sign(np.sum(smooth[:, t] * smooth[:, t - 1], axis=-1, keepdims=True))
    assert npss(truth, made) == pytest.approx(lafan1(truth, smooth)[1])


@given(seeds)
def test_the_sign_of_a_quaternion_counts_for_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth, made = movement(rng, 2, 9, 4), movement(rng, 2, 9, 4)
    others = flipped(rng, truth), flipped(rng, made)
    assert np.allclose(l2q(*others), l2q(truth, made))
    assert npss(*others) == pytest.approx(npss(truth, made))
    assert np.allclose(angular_jerk(others[0], 30.0), angular_jerk(truth, 30.0))
    assert np.allclose(angular_speed(others[0], 30.0), angular_speed(truth, 30.0))


@given(seeds)
def test_the_truth_is_no_error_at_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = movement(rng, 2, 9, 4)
    places = rng.normal(size=(2, 9, 4, 3))
    assert np.array_equal(l2q(truth, truth), [0.0, 0.0])
    assert npss(truth, truth) == 0.0
    assert np.array_equal(l2p(places, places, np.ones((4, 3))), [0.0, 0.0])


@given(seeds, st.floats(0.0, np.pi))
def test_l2q_of_joints_that_are_all_off_by_an_angle(seed: int, angle: float) -> None:
    rng = np.random.default_rng(seed)
    truth = movement(rng, 1, 5, 7)
    axis = rng.normal(size=(1, 5, 7, 3))
    made = rot.mul(truth, rot.from_axis_angle(axis / np.linalg.norm(axis, axis=-1, keepdims=True), angle))
    assert l2q(truth, flipped(rng, made))[0] == pytest.approx(2.0 * np.sqrt(7.0) * np.sin(angle / 4.0))


def test_l2p_counts_each_coordinate_in_its_spread() -> None:
    rng = np.random.default_rng(0)
    places = rng.normal(size=(40, 50, 3, 3)) * np.array([0.1, 1.0, 10.0]) + 5.0
    spread = position_spread(places)
    assert np.allclose(spread, [0.1, 1.0, 10.0], rtol=0.05)
    off = places + 2.0 * spread  # every one of nine coordinates is two standard deviations off
    assert np.allclose(l2p(places, off, spread), 2.0 * 3.0)


def test_what_never_moves_measures_nothing() -> None:
    places = np.random.default_rng(0).normal(size=(4, 5, 2, 3))
    places[..., 1, 2] = 1.0
    with pytest.raises(MotionMindError, match="never moves"):
        position_spread(places)


@given(seeds, st.floats(-np.pi, np.pi))
def test_where_the_stage_is_and_how_it_is_turned_counts_for_nothing(seed: int, turn: float) -> None:
    rng = np.random.default_rng(seed)
    body = human23()
    truth, made = movement(rng, 2, 8, len(body)), movement(rng, 2, 8, len(body))
    roots = rng.normal(size=(2, 2, 8, 3))
    about, moved = rot.about_vertical(turn), np.array([rng.normal(), 0.0, rng.normal()])
    found = []
    for q, p in ((rot.IDENTITY, np.zeros(3)), (about, moved)):
        there = [one.copy() for one in (truth, made)]
        for one in there:
            one[..., 0, :] = rot.mul(q, one[..., 0, :])
        places = rot.mul_vec(q, roots) + p
        shown = [seen(body, one, root, there[0], places[0]) for one, root in zip(there, places, strict=True)]
        (true_turns, true_places), (turns, positions) = shown
        found.append([*l2q(true_turns, turns), *l2p(true_places, positions, np.ones(3)), npss(true_turns, turns)])
        assert np.allclose(rot.heading(true_turns[:, 0, 0]), 0.0)
        assert np.allclose(true_places[:, :, 0, ::2].mean(axis=1), 0.0)
    assert np.allclose(found[0], found[1])


# --- smooth -----------------------------------------------------------------------------------------------------------


@given(seeds, st.sampled_from([10.0, 30.0, 120.0]))
def test_the_jerk_of_a_turn_that_is_a_cubic_of_time_is_exact_at_any_rate(seed: int, fps: float) -> None:
    rng = np.random.default_rng(seed)
    a, b, c = rng.normal(size=(3, 4))
    axes = rng.normal(size=(4, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    t = np.arange(12)[:, None] / fps
    turns = rot.from_axis_angle(axes, a * t + b * t**2 + c * t**3)
    assert np.allclose(angular_jerk(turns, fps), 6.0 * np.abs(c), rtol=1e-4, atol=1e-5)


@given(seeds)
def test_jerk_and_speed_are_the_same_however_the_world_is_turned(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turns = movement(rng, 12, 3)
    turned = rot.mul(rot.exp(rng.normal(size=3)), turns)
    assert np.allclose(angular_jerk(turned, 30.0), angular_jerk(turns, 30.0))
    assert np.allclose(angular_speed(turned, 30.0), angular_speed(turns, 30.0))


def test_an_even_turn_has_its_speed_and_no_jerk() -> None:
    turns = rot.about_vertical(0.05 * np.arange(20))[:, None]
    assert np.allclose(angular_speed(turns, 30.0), 1.5)
    assert np.allclose(angular_jerk(turns, 30.0), 0.0, atol=1e-8)


def test_sparc_is_what_its_authors_compute() -> None:
    # The value that the documentation of their code gives for this speed.
    t = np.arange(-1.0, 1.0, 0.01)
    assert sparc(np.exp(-5.0 * t**2), 100.0) == pytest.approx(-1.41403, abs=5e-6)


def test_sparc_falls_with_every_halt_and_not_with_size() -> None:
    t = np.linspace(0.0, 1.0, 301)
    halts = [np.abs(np.sin(np.pi * count * t)) for count in (1, 2, 3, 5)]
    found = [sparc(speed, 100.0) for speed in halts]
    assert all(before > after for before, after in pairwise(found))
    assert sparc(7.0 * halts[2], 100.0) == pytest.approx(found[2])
    assert np.isnan(sparc(np.zeros(30), 30.0))


# --- feet -------------------------------------------------------------------------------------------------------------


def walker(steps: Floats, lift: float = 0.0) -> tuple[Floats, Floats]:
    """Rotations and root of a standing body that is moved by `steps` [T - 1, 3], its soles `lift` above the floor."""
    body = human23()
    ground = -float(body.positions_and_tips(np.tile(rot.IDENTITY, (23, 1)), np.zeros(3))[:, 1].min())
    root = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]) + np.array([0.0, ground + lift, 0.0])
    return np.tile(rot.IDENTITY, (len(root), 23, 1)), root


def test_feet_are_where_limbs_end_on_the_floor() -> None:
    for body, names in (
        (human23(), ["left_toes", "right_toes"]),
        (human44(), ["left_toes_end", "right_toes_end"]),
        (insect(), [name for name in insect().names if name.endswith("tibia")]),
    ):
        assert [body.names[joint] for joint in find_feet(body)] == names


@pytest.mark.parametrize(
    ("step", "lift", "expected"), [(0.026, 0.0, 0.5), (0.024, 0.0, 0.0), (0.026, 0.049, 0.5), (0.026, 0.051, 0.0)]
)
def test_a_foot_skates_that_is_low_and_goes_far(step: float, lift: float, expected: float) -> None:
    steps = np.zeros((20, 3))
    steps[::2, 0] = step
    rotations, root = walker(steps, lift)
    assert skating(human23(), rotations, root) == expected
    assert skating(human23(), rotations, root + np.array([0.0, 1.0, 0.0]), floor=1.0) == expected
    assert find_floor(human23(), rotations, root) == pytest.approx(lift)


def test_a_foot_slides_as_far_as_the_body_goes_on_the_floor() -> None:
    steps = np.zeros((20, 3))
    steps[:, 2] = -0.01
    slides = [foot_slide(human23(), *walker(steps, lift)) for lift in (0.0, 0.005, 0.01, 0.02, 0.03)]
    assert slides[0] == pytest.approx(1.0)
    assert slides == sorted(slides, reverse=True)
    assert slides[-1] == 0.0


def test_a_body_that_turns_on_the_ball_of_its_foot_does_not_skate() -> None:
    body = human23()
    rotations, root = walker(np.zeros((20, 3)))
    ball = body.index("left_toes")
    pivot = body.positions(rotations, root)[0, ball]
    turn = rot.about_vertical(0.5 * np.arange(21))
    rotations[:, 0] = turn
    root = pivot + rot.mul_vec(turn, root - pivot)
    lifted = rotations.copy()
    lifted[:, body.index("right_hip")] = rot.from_axis_angle([1.0, 0.0, 0.0], -1.0)
    assert skating(body, lifted, root) == 0.0
    assert skating(body, rotations, root) == 1.0  # the other foot is dragged along
    assert foot_slide(body, lifted, root) == pytest.approx(0.0, abs=1e-9)


# --- paths ------------------------------------------------------------------------------------------------------------


def learned(rng: np.random.Generator, clips: int = 4, length: int = 25) -> Engine:
    """What is learned from clips of a small body whose joints turn back and forth at random about one axis."""
    body = human23()
    motions = []
    for number in range(clips):
        angles = np.cumsum(rng.choice([-1.0, 0.0, 1.0, 1.0], size=(length, 23)), axis=0) % 5
        rotations = rot.from_axis_angle([1.0, 0.0, 0.0], np.radians(20.0) * angles)
        root = np.tile([0.0, 0.9, 0.0], (length, 1))
        motions.append(Motion(body, rotations, root, np.arange(length) / 5.0, f"clip {number}"))
    return Engine.fit(motions, name="random", rate=5, facing="stage", flips="keep")


@pytest.fixture(scope="module")
def engine() -> Engine:
    return learned(np.random.default_rng(7))


def own_paths(engine: Engine) -> list[Int32s]:
    states = np.asarray(engine.states)
    return [states[clip.start : clip.stop] for clip in engine.corpus.clips]


@given(seeds)
def test_arrivals_are_the_first_postures_after_which_nothing_changes(seed: int) -> None:
    path = np.random.default_rng(seed).integers(3, size=(6, 4)).astype(np.int32)
    found = arrivals(path)
    for chain, arrival in enumerate(found):
        assert np.all(path[arrival:, chain] == path[-1, chain])
        assert arrival == 0 or path[arrival - 1, chain] != path[-1, chain]
    moving = found[found > 0]
    assert arrival_spread(path) == pytest.approx(moving.std() if len(moving) else 0.0)


def test_of_the_corpus_itself_all_is_attested_and_the_mean_percentile_is_fifty(engine: Engine) -> None:
    habits = learn_habits(engine.grammar)
    paths = own_paths(engine)
    assert all(attested_share(path, engine.grammar) == 1.0 for path in paths)
    assert np.concatenate([habits.percentiles(path) for path in paths]).mean() == pytest.approx(50.0)
    # A corpus is as likely as its transitions' entropy says.
    counts, graph = engine.grammar.transitions.counts, engine.grammar.transitions
    leaving = np.bincount(graph.sources, counts)[graph.sources]
    entropy = (counts * np.log(counts / leaving)).sum() / counts.sum()
    assert np.concatenate([habits.log_likelihoods(path) for path in paths]).mean() == pytest.approx(entropy)


def test_cliches_are_the_most_frequent_moves_where_there_is_a_choice(engine: Engine) -> None:
    habits = learn_habits(engine.grammar)
    seen: dict[tuple[int, int], Counter[int]] = {}
    for path in own_paths(engine):
        for before, after in pairwise(path.tolist()):
            for chain, (a, b) in enumerate(zip(before, after, strict=True)):
                if a != b:
                    seen.setdefault((chain, a), Counter())[b] += 1
    expected = []
    for before, after in pairwise(own_paths(engine)[0].tolist()):
        for chain, (a, b) in enumerate(zip(before, after, strict=True)):
            known = seen[chain, a] if a != b else Counter()
            if len(known) > 1:
                expected.append(known[b] == max(known.values()) > min(known.values()))
    assert habits.cliches(own_paths(engine)[0]).tolist() == expected
    assert 0 < sum(expected) < len(expected)


def test_a_move_that_nobody_made_is_no_cliche(engine: Engine) -> None:
    habits, graph = learn_habits(engine.grammar), engine.grammar.transitions
    path = own_paths(engine)[0][:2].copy()
    chain = 5
    known = {int(b) for a, b in pairwise(own_paths(engine)[0][:, chain]) if a == path[0, chain]}
    path[1] = path[0]
    path[1, chain] = next(s for s in range(graph.sizes()[chain]) if graph.edge(chain, path[0, chain], s) < 0)
    assert path[1, chain] not in known
    assert habits.percentiles(path).tolist() == [0.0]
    assert not habits.cliches(path).any()
    joints = len(engine.corpus.skeleton)
    others = np.delete(engine.grammar.transitions.edges(path)[:, :joints] >= 0, chain)
    assert attested_share(path, engine.grammar) == pytest.approx(others.sum() / joints)


# --- what is copied ---------------------------------------------------------------------------------------------------


def test_a_clip_is_copied_whole_from_itself_and_not_without_it(engine: Engine) -> None:
    book = learn_phrases(engine.corpus, np.asarray(engine.states))
    for number, path in enumerate(own_paths(engine)):
        assert book.runs(path) == [len(path)]
        assert all(book.copied(path, size, n) == 1.0 for size in book.groups for n in range(1, 6))
        assert max(book.runs(path, number), default=0) < 3
        assert book.copied(path, "body", 2, number) == 0.0


def test_what_is_copied_falls_with_the_length_and_the_size_of_what_is_compared(engine: Engine) -> None:
    book = learn_phrases(engine.corpus, np.asarray(engine.states))
    path = own_paths(engine)[1]
    shares = {size: [book.copied(path, size, n, 1) for n in range(1, 6)] for size in ("joint", "limb", "body")}
    for found in shares.values():
        assert all(before >= after for before, after in pairwise(found))
    assert all(joint >= limb >= body for joint, limb, body in zip(*shares.values(), strict=True))
    assert np.isnan(book.copied(path[:3], "joint", 4))


def test_runs_end_where_clips_do(engine: Engine) -> None:
    book = learn_phrases(engine.corpus, np.asarray(engine.states))
    first, second = own_paths(engine)[:2]
    strange = first[:1].copy()
    strange[0] = (strange[0] + 1) % engine.space.sizes
    path = np.concatenate([first[-4:], second[:6], strange, second[3:5]])
    assert book.runs(path) == [4, 6, 2]


# --- style ------------------------------------------------------------------------------------------------------------


def wavers(rng: np.random.Generator, pace: float, count: int = 4) -> dict[str, list[Floats]]:
    """Sequences of movement at 30 frames a second whose joints turn to and fro so many times a second."""
    t = np.arange(200)[:, None] / 30.0
    return {
        f"{pace:g} {number}": [
            rot.from_axis_angle(
                [0.0, 0.0, 1.0], np.sin(2.0 * np.pi * (pace * rng.uniform(0.7, 1.4, size=5) * t + rng.uniform(size=5)))
            )
        ]
        for number in range(count)
    }


def test_style_is_told_by_how_joints_move_and_not_by_where_they_are() -> None:
    rng = np.random.default_rng(3)
    classifier = fit_style_classifier({"slow": wavers(rng, 0.4), "fast": wavers(rng, 1.6)}, 60)
    found = classifier.table(0)
    for shares in found.values():
        assert shares["held out"] > 0.8  # 95 % at most, as what is too far off is taken for nothing
        assert shares["shuffle"] < 0.1
        assert shares["slerp"] < 0.1
    sequence, real = next(classifier.held_out("slow"))
    away = rot.mul(rot.exp(np.array([1.0, -2.0, 0.5])), real)
    assert classifier.takes(away, "slow", sequence) == classifier.takes(real, "slow", sequence)
    assert classifier.table(0) == found


@pytest.mark.parametrize(("frames", "windows"), [(17, 0), (18, 1), (26, 1), (27, 2), (36, 3)])
def test_windows_of_style_begin_every_nine_frames_up_to_the_last_that_fits(frames: int, windows: int) -> None:
    turned = wavers(np.random.default_rng(3), 1.0, 1)["1 0"][0][:frames]
    assert features(turned).shape == (windows, 10)


def test_pieces_are_as_long_as_asked_and_a_clip_that_is_shorter_is_one() -> None:
    assert _pieces([10, 3, 2, 4], 4, 3) == [(0, 0), (0, 4), (1, 0), (3, 0)]


def test_of_two_corpora_in_one_style_each_is_taken_for_the_other_as_often() -> None:
    rng = np.random.default_rng(5)
    classifier = fit_style_classifier({"one": wavers(rng, 1.0, 12), "other": wavers(rng, 1.0, 12)}, 60)
    for shares in classifier.table(0).values():
        assert 0.25 < shares["held out"] < 0.75


def test_style_needs_something_to_be_judged_by() -> None:
    rng = np.random.default_rng(3)
    slow, fast = wavers(rng, 0.4), wavers(rng, 1.6)
    for corpora, frames, words in (
        ({"slow": slow, "fast": fast}, 10, "18 frames"),
        ({"slow": slow, "fast": fast}, 500, "no clip of 500 frames"),
        ({"slow": slow, "fast": dict([next(iter(fast.items()))])}, 60, "two sequences"),
    ):
        with pytest.raises(MotionMindError, match=words):
            fit_style_classifier(corpora, frames)


# --- all at once ------------------------------------------------------------------------------------------------------


def test_a_tween_is_measured_by_the_states_that_it_passes(engine: Engine) -> None:
    corpus = engine.corpus
    ends = [Motion(corpus.skeleton, corpus.rotations[[i]], corpus.root[[i]], np.zeros(1)).posture(0) for i in (3, 60)]
    tween = engine.tween(*ends)
    found = measure(tween.motion, engine, tween.path)
    assert found["moves"].value == tween.moves
    assert found["attested"].value == pytest.approx(tween.attested)
    assert found["log_likelihood"].value == pytest.approx(
        np.log(tween.costs.likelihood[tween.costs.likelihood > 0.0]).mean()
    )
    for figure in found.values():
        assert not figure.low > figure.high
    own = measure(tween.motion, engine)["attested"].value  # of the motion, not of the path
    assert tween.motion_attested == own < found["attested"].value
    slow = engine.tween(*ends, moves=4, duration=2.9)  # at the corpus's pace that would be 14 moves
    assert measure(slow.motion, engine)["moves"].value == 4


def test_a_corpus_measures_itself_within_its_range_but_for_what_it_copies(engine: Engine) -> None:
    clip = engine.corpus.motion(engine.corpus.clips[0])
    found = measure(clip, engine)
    assert found["attested"].value == 1.0
    assert found["longest_run"].value == len(clip)
    assert found["copied_body_5"].value == 1.0 > found["copied_body_5"].high
    assert found["moves"].value == len(clip) - 1


@pytest.mark.long
def test_a_body_that_bounces_does_so_beyond_the_corpus() -> None:
    ballet = Engine.load("ballet")
    clip = at_rate(ballet.corpus.recording(ballet.corpus.clips[0])).slice(0, 60)
    calm = measure(clip, ballet)["bounce"]
    assert calm.value <= calm.high
    shaken = clip.root + 0.04 * np.sin(np.arange(60))[:, None] * [0.0, 1.0, 0.0]
    bounce = measure(replace(clip, root=shaken), ballet)["bounce"]
    assert bounce.value == pytest.approx(0.04 * 30.0**2, rel=0.15)
    assert bounce.value > bounce.high


def test_keyframes_and_frames_between_them_are_one_movement(engine: Engine) -> None:
    keys = engine.corpus.motion(engine.corpus.clips[0])
    fine = at_rate(keys)
    assert np.allclose(rot.angle(fine.rotations[::6], keys.rotations), 0.0, atol=1e-6)
    assert np.allclose(fine.root[::6], keys.root)
    coarse, again = measure(keys, engine), measure(fine, engine)
    for name in ("speed", "jerk", "sparc", "style", "slide", "attested", "cliche_rate", "longest_run"):
        assert coarse[name].value == pytest.approx(again[name].value, rel=1e-6), name


def test_what_cannot_be_measured_is_said(engine: Engine) -> None:
    clip = engine.corpus.motion(engine.corpus.clips[0])
    with pytest.raises(MotionMindError, match="too short"):
        measure(clip.slice(0, 1), engine)
    with pytest.raises(MotionMindError, match="23 chains"):
        measure(clip, engine, np.zeros((3, 5), dtype=np.int32))
    crawling = Motion(insect(), np.tile(rot.IDENTITY, (9, 14, 1)), np.zeros((9, 3)), np.arange(9) / 5.0)
    with pytest.raises(SkeletonError, match="another skeleton"):
        measure(crawling, engine)


def test_the_command_prints_what_is_measured(run: Run, engine: Engine) -> None:
    engine.save(Path("home/corpora/random"))
    corpus = engine.corpus
    clip = corpus.motion(corpus.clips[0])
    tween = engine.tween(clip.posture(0), clip.posture(9))
    write_motion("tween.json", tween.motion)
    Path("report.json").write_text(json.dumps(tween.report()))
    told = run("measure", "tween.json", "--corpus", "random", "--report", "report.json", "--json")
    assert (told.code, told.err) == (0, "")
    found = measure(read_motion("tween.json"), engine, tween.path)  # a fall that is exact is not quite so in the file
    figures = told.json["figures"]
    assert list(figures) == list(found)
    for name, figure in found.items():
        expected = [number if np.isfinite(number) else None for number in (figure.value, figure.low, figure.high)]
        assert [figures[name][key] for key in ("value", "low", "high")] == pytest.approx(expected), name
    for everything, names in ((["--all"], list(found)), ([], [name for name in found if name in MAIN_FIGURES])):
        shown = run("measure", "tween.json", "--corpus", "random", "--report", "report.json", *everything)
        assert shown.code == 0
        lines = shown.out.splitlines()[2:]
        assert [line.split("  ")[0].replace(" ", "_") for line in lines] == names
        for line, figure in zip(lines, (found[name] for name in names), strict=True):
            cells = re.split(r" {2,}", line)
            value, low, high = (float(f"{number:.3g}") for number in (figure.value, figure.low, figure.high))
            assert ("above" in cells, "below" in cells) == (value > high, value < low)
            assert np.isnan(value) or cells[1] == f"{value:g} {figure.unit}".rstrip()
    assert len(MAIN_FIGURES) == 10


def test_the_command_refuses_what_it_cannot_measure(run: Run, engine: Engine) -> None:
    engine.save(Path("home/corpora/random"))
    clip = engine.corpus.motion(engine.corpus.clips[0])
    tween = engine.tween(clip.posture(0), clip.posture(9))
    write_motion("tween.json", tween.motion)
    write_motion("short.json", clip.slice(0, 1))
    report = tween.report()
    for name, changed in (("joints", report["joints"][::-1]), ("path", [*report["path"][:-1], [99] * 23])):
        Path(f"{name}.json").write_text(json.dumps(report | {name: changed}))
        said = run("measure", "tween.json", "--corpus", "random", "--report", f"{name}.json")
        assert (said.code, said.out, said.err.count("\n")) == (2, "", 1)
        assert f"{name}.json: not a tween of random" in said.err
    said = run("measure", "short.json", "--corpus", "random")
    assert (said.code, said.out) == (2, "")
    assert "too short" in said.err
