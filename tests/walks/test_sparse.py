"""Walks over few of a corpus's samples, beside those over all of them."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from motionmind._typing import Floats, Ints
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.geometry import rotations as rot
from motionmind.geometry.distances import squared_distance
from motionmind.learned.nearest import find_near
from motionmind.learned.neighbours import build_neighbours
from motionmind.learned.posture_statistics import PostureStatistics, learn_posture_statistics
from motionmind.tween.engine import Engine
from motionmind.walks import mean_walk, sparse
from motionmind.walks.expectation import Expectation, expect
from motionmind.walks.steps import follow, steps_at
from motionmind.walks.stops import sample_rates, stop_at

MOVES = 6


@pytest.fixture(scope="module")
def engine() -> Engine:
    return Engine.load("karate")


@pytest.fixture(scope="module")
def statistics(engine: Engine) -> PostureStatistics:
    return grown(engine.corpus.skeleton, engine.statistics)


def grown(skeleton: Skeleton, statistics: PostureStatistics) -> PostureStatistics:
    """Posture statistics with trees, however few samples there are."""
    return replace(statistics, trees=build_neighbours(skeleton, statistics.orientations, statistics.weights))


def walk(engine: Engine, statistics: PostureStatistics, start: int, path: bool) -> Expectation:
    """What walks expect from a posture to one that follows on it, near what lies between if `path` says so."""
    motion = engine.corpus.motion(engine.corpus.clips[0]).slice(start, start + MOVES + 1)
    stops = {0: stop_at(engine.corpus, motion.posture(0)), MOVES: stop_at(engine.corpus, motion.posture(-1))}
    chains = engine.corpus.to_chains(motion.rotations)[:, : len(motion.skeleton)]
    return expect(engine.corpus, statistics, stops, np.linspace(0.0, 1.8, 2 * MOVES + 1), chains if path else None)


@pytest.fixture(autouse=True)
def _nothing_kept() -> Iterator[None]:
    """Look-ups are kept by what is looked for; some tests change how much is looked up."""
    for keeps in (sparse._choose_cached, sparse._balls):
        keeps.cache_clear()
    yield
    for keeps in (sparse._choose_cached, sparse._balls):
        keeps.cache_clear()


@pytest.mark.parametrize("path", [False, True])
def test_over_all_samples_one_by_one_the_sums_are_the_same(
    engine: Engine, statistics: PostureStatistics, path: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("N_END_SAMPLES", "N_NEAREST_END_SAMPLES", "N_END_NEIGHBORS"):
        monkeypatch.setattr(sparse, name, 10**6)
    for start in (0, 11):
        whole, few = (walk(engine, one, start, path) for one in (engine.statistics, statistics))
        assert len(few.samples[0]) == len(engine.statistics.weights)
        assert few.left_out == 0.0
        # Means leave out what has a millionth of the weight, by part here and of all parts together there.
        np.testing.assert_allclose(few.poses, whole.poses, atol=1e-3)
        np.testing.assert_allclose(few.headings, whole.headings, atol=1e-3)
        np.testing.assert_allclose(few.samples, whole.samples, atol=1e-12)
        np.testing.assert_allclose(few.moves, whole.moves, atol=1e-12)


@pytest.mark.parametrize("path", [False, True])
def test_over_few_samples_the_mean_is_near_that_over_all(
    engine: Engine, statistics: PostureStatistics, path: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sparse, "N_END_SAMPLES", 24)
    for start in (0, 11, 23):
        whole, few = (walk(engine, one, start, path) for one in (engine.statistics, statistics))
        straight = rot.slerp(whole.poses[:1], whole.poses[-1:], np.linspace(0.0, 1.0, 2 * MOVES + 1)[:, None])
        adds = np.sqrt(np.mean(rot.angle(whole.poses, straight) ** 2))
        off = np.sqrt(np.mean(rot.angle(whole.poses, few.poses) ** 2))
        assert off < 0.3 * adds
        # Rows of probabilities, and no more mass is missing at the ends than is said.
        np.testing.assert_allclose(few.samples.sum(axis=1), 1.0)
        assert 0.0 <= few.left_out < 1.0


def test_walks_begin_and_end_in_samples_that_stand_for_others(
    engine: Engine, statistics: PostureStatistics, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sparse, "N_END_SAMPLES", 12)
    trees = statistics.trees
    assert trees is not None
    balls = sparse._balls(trees, 0)

    def by_ball(found: Expectation, row: int) -> Floats:
        """How likely walks are to be in each ball of the whole body."""
        of = np.arange(len(statistics.weights)) if isinstance(found.of_samples, slice) else found.of_samples
        return np.bincount(sparse._balls_of(of, balls), found.samples[row], len(balls.starts))

    apart = []
    for start in (0, 11, 23, 35, 47):
        whole, few = (walk(engine, one, start, False) for one in (engine.statistics, statistics))
        assert few.left_out > 0.5
        apart += [0.5 * np.abs(by_ball(whole, row) - by_ball(few, row)).sum() for row in (0, -1)]
    assert np.mean(apart) < 0.25  # 0.31 where walks begin and end only in what is near


def test_samples_near_an_end_are_spread_from_near_to_far(statistics: PostureStatistics) -> None:
    trees = statistics.trees
    assert trees is not None
    for number, part in enumerate(trees.parts):
        ends = np.ascontiguousarray(statistics.orientations[[3, 40], : part.max() + 1])
        found = find_near(trees, number, statistics.orientations, ends, sparse.N_END_NEIGHBORS)
        chosen = sparse.choose(statistics, number, ends, 12).chosen
        assert chosen.near is not None
        for ranked, near in zip(found, chosen.near, strict=True):
            np.testing.assert_array_equal(
                np.asarray(chosen.samples)[near], np.sort(ranked[: sparse.N_NEAREST_END_SAMPLES])
            )
            ranks = np.flatnonzero(np.isin(ranked, chosen.samples))
            assert set(range(sparse.N_NEAREST_END_SAMPLES)) <= set(ranks)
            assert np.diff(ranks).max() <= len(ranked) / (sparse.N_END_SAMPLES - sparse.N_NEAREST_END_SAMPLES) + 1


def test_chosen_samples_represent_the_whole_corpus(engine: Engine, statistics: PostureStatistics) -> None:
    trees = statistics.trees
    assert trees is not None
    joints = len(engine.corpus.skeleton)
    ends = np.asarray(statistics.orientations[[3, 40], :joints])
    for number in range(len(trees.parts)):
        chosen, shown, off = sparse.choose(statistics, number, ends, 12)
        assert isinstance(chosen.samples, np.ndarray)
        here = statistics.orientations[chosen.samples][:, trees.parts[number]]
        np.testing.assert_array_equal(shown, here.transpose(1, 0, 2))
        away = [squared_distance(one, end[trees.parts[number]]) / len(shown) for end in ends for one in here]
        np.testing.assert_allclose(off.ravel(), away, atol=1e-12)
        assert chosen.weights.sum() == pytest.approx(statistics.weights.sum())
        assert (chosen.weights > 0.0).all()
        leave = np.bincount(statistics.begins, statistics.shares, len(statistics.weights))[chosen.samples]
        np.testing.assert_allclose(np.bincount(chosen.begins, chosen.shares, len(chosen.samples)), leave)
        same = statistics.clusters[chosen.samples, number]
        assert all(len(np.unique(same[chosen.clusters == k])) == 1 for k in range(chosen.clusters.max() + 1))


def test_each_moment_is_in_the_ball_of_its_place(statistics: PostureStatistics) -> None:
    trees, samples = statistics.trees, np.arange(len(statistics.weights))
    assert trees is not None
    for number in range(len(trees.parts)):
        balls = sparse._balls(trees, number)
        found = sparse._balls_of(samples, balls)
        assert set(found) == set(range(len(balls.starts)))
        np.testing.assert_allclose(np.bincount(found, statistics.weights), balls.weights)
        np.testing.assert_array_equal(found[balls.middles], np.arange(len(balls.starts)))


def test_walks_lead_on_from_where_all_performances_of_a_dance_end(
    engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sparse, "N_END_SAMPLES", 12)
    motion = engine.corpus.motion(engine.corpus.clips[0]).slice(0, 2 * MOVES + 1)
    corpus = gather("many", [replace(motion, name=f"{number}") for number in range(14)])
    statistics = grown(corpus.skeleton, learn_posture_statistics(corpus))
    stops = {0: stop_at(corpus, motion.posture(-1)), MOVES: stop_at(corpus, motion.posture(MOVES))}
    found = expect(corpus, statistics, stops, np.linspace(0.0, 1.8, 2 * MOVES + 1))
    np.testing.assert_allclose(found.samples.sum(axis=1), 1.0)
    assert np.isfinite(found.poses).all()
    assert np.isfinite(found.headings).all()


def test_threads_change_no_byte(engine: Engine, statistics: PostureStatistics, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for threads in (1, 3):
        monkeypatch.setattr(mean_walk, "N_THREADS", threads)
        monkeypatch.setattr(mean_walk, "MIN_SAMPLES_PER_THREAD", 1)
        found.append(walk(engine, statistics, 4, True))
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)


@pytest.fixture(scope="module")
def both_ways(engine: Engine) -> tuple[Corpus, PostureStatistics]:
    """A corpus that is learned backward as well."""
    clips = [engine.corpus.motion(clip) for clip in engine.corpus.clips[:3]]
    corpus = gather("both", clips, reverse=1.0, flips="keep")
    return corpus, learn_posture_statistics(corpus)


def test_steps_are_found_from_their_ends(both_ways: tuple[Corpus, PostureStatistics]) -> None:
    _, statistics = both_ways
    begins, ends = statistics.begins, statistics.ends
    postures, rng = len(statistics.weights) - len(statistics.turn), np.random.default_rng(0)
    some = np.sort(rng.choice(len(statistics.weights), 30, replace=False))
    for ahead, here, there in ((True, begins, ends), (False, ends, begins)):
        at, other, steps = steps_at(some, ahead, begins, ends, postures)
        np.testing.assert_array_equal(some[at], here[steps])
        np.testing.assert_array_equal(other, there[steps])
        assert sorted(steps) == np.flatnonzero(np.isin(here, some)).tolist()
        reached = follow(some[:1], ahead, 2, begins, ends, postures)
        once = there[here == some[0]]
        assert set(reached) == {*once, *there[np.isin(here, once)]}
        # From a posture at most a moment more to either side with each step, by however many ways one comes there.
        assert len(follow(some[:1], ahead, 40, begins, ends, postures)) <= 41 * 42


def test_velocities_in_some_samples_are_those_in_all(both_ways: tuple[Corpus, PostureStatistics]) -> None:
    corpus, statistics = both_ways
    some = np.arange(3, len(statistics.weights), 7)
    both = sample_rates(corpus, statistics, some), sample_rates(corpus, statistics)
    for few, whole in zip(*both, strict=True):
        np.testing.assert_allclose(few, whole[some], atol=1e-12)


def cost(engine: Engine, moves: Ints, poses: Floats) -> float:
    """What fine detail from these moves costs, but for leaving runs."""
    shown, corpus = engine.statistics.orientations[: len(engine.corpus), : poses.shape[1]], engine.corpus.moves
    ends = (shown[corpus.begins[moves]], poses[:-1]), (shown[corpus.ends[moves]], poses[1:])
    return float(sum(np.sum(4.0 * np.sin(0.5 * rot.angle(*pair)) ** 2) for pair in ends))


def test_a_tween_of_a_corpus_with_trees_is_near_that_without(engine: Engine, statistics: PostureStatistics) -> None:
    indexed, motion = replace(engine, statistics=statistics), engine.corpus.motion(engine.corpus.clips[0])
    for start, stop, seconds in ((3, 12, 1.8), (40, 15, 4.0)):
        few, whole = (
            one.tween(motion.posture(start), motion.posture(stop), duration=seconds) for one in (indexed, engine)
        )
        assert few.report()["left_out"] == few.left_out >= 0.0 == whole.left_out
        assert np.sqrt(np.mean(rot.angle(few.motion.rotations, whole.motion.rotations) ** 2)) < 0.15


def test_look_ups_are_kept_as_long_as_the_corpus_and_no_longer(engine: Engine, statistics: PostureStatistics) -> None:
    own = replace(statistics)
    assert own.trees is not None
    own = replace(own, trees=replace(own.trees))
    ends = np.asarray(own.orientations[:2, : len(own.trees.parts[0])])
    first = sparse.choose(own, 0, ends, 40)
    assert sparse.choose(own, 0, ends, 50) is first  # what is near the ends is followed no farther
    assert sparse.choose(statistics, 0, ends, 40) is not first
    assert sparse._balls(own.trees, 0) is sparse._balls(own.trees, 0)
    alive, trees = weakref.ref(own), weakref.ref(own.trees)
    del own
    gc.collect()
    assert alive() is trees() is None
