"""Modes: passages that lead from one posture to another in different ways, the farthest from what is known first."""

from __future__ import annotations

from itertools import combinations, pairwise, product

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.contact import CONTACT_FPS
from motionmind.body.motion import Posture
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.walks.frames import Frames, all_frames
from motionmind.walks.modes import N_CANDIDATE_PASSAGES, _from_start_to_end, _held_to_ends, _likeliest, find_modes
from motionmind.walks.passages import NODE_FRAMES, WARP_COST_RAD2, WARP_FRAMES, Place, node_distances
from motionmind.walks.stops import Stop, stop_at

COUNT = 11


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def ends(engine: Engine, a: int, b: int) -> tuple[Stop, Stop]:
    corpus = engine.corpus
    one, other = (Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row]) for row in (a, b))
    return stop_at(engine.corpus, one), stop_at(engine.corpus, other)


def straight(stops: tuple[Stop, Stop], joints: int) -> Floats:
    """The short way between two stops [COUNT, J, 4]."""
    first, last = (stop.chains[None, :joints] for stop in stops)
    return rot.slerp(first, last, np.linspace(0.0, 1.0, COUNT)[:, None])


@pytest.mark.parametrize("steps", [1, 2, 3])
def test_no_passage_from_start_to_end_costs_less(steps: int) -> None:
    rng = np.random.default_rng(steps)
    stretches, costs = np.repeat([0, 1], [9, 6]), rng.uniform(0.0, 1.0, 15)
    total, begins = _from_start_to_end(stretches, costs, steps)
    least, reached = np.full(15, np.inf), [set[int]() for _ in range(15)]
    for begin, *warps in product(range(15), *[WARP_FRAMES] * steps):
        end = begin + sum(warps)
        if end >= 15 or stretches[end] != stretches[begin]:
            continue
        cost = costs[begin] + sum(WARP_COST_RAD2 / steps * abs(warp - NODE_FRAMES) for warp in warps)
        if cost < least[end] - 1e-12:
            least[end], reached[end] = cost, {begin}
        elif cost < least[end] + 1e-12:
            reached[end].add(begin)
    np.testing.assert_allclose(total, least)
    for end in np.flatnonzero(np.isfinite(total)).tolist():
        assert int(begins[end]) in reached[end]
    assert not np.isfinite(total).all()


@pytest.mark.parametrize("seed", range(6))
def test_no_more_than_half_of_a_likely_passage_lies_in_another(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chains = rot.exp(rng.normal(0.0, 1.0, (60, 1, 3)))
    recorded = Frames(
        chains, np.repeat([0, 1], [40, 20]), np.arange(60), np.arange(60) / CONTACT_FPS, np.zeros((60, 1, 3))
    )
    poses, none = rot.exp(rng.normal(0.0, 1.0, (2, 1, 3))), np.zeros(3)
    stops = Stop(poses[0], none), Stop(poses[1], none)
    found = _likeliest(recorded, stops, poses, 5)
    assert 2 <= len(found) <= N_CANDIDATE_PASSAGES
    for (begin, end), (one, other) in combinations(found, 2):
        overlap = min(end, other) - max(begin, one)
        assert overlap <= 0.5 * min(end - begin, other - one)
    first, last = node_distances(recorded, poses, stops)
    best = np.nanmin(_from_start_to_end(recorded.stretches, first, 5)[0] + last)
    begin, end = found[0]
    assert _from_start_to_end(recorded.stretches, first, 5)[0][end] + last[end] == best
    assert all(recorded.stretches[begin] == recorded.stretches[end] for begin, end in found)
    assert all(5 * WARP_FRAMES[0] <= end - begin <= 5 * WARP_FRAMES[-1] for begin, end in found)


def test_held_to_the_ends_a_passage_keeps_its_way_between() -> None:
    rng = np.random.default_rng(0)
    chains = rot.exp(np.cumsum(rng.normal(0.0, 0.1, (31, 2, 3)), axis=0))
    recorded = Frames(
        chains, np.zeros(31, dtype=np.int64), np.arange(31), np.arange(31) / CONTACT_FPS, np.zeros((31, 2, 3))
    )
    own = _held_to_ends(recorded, (0, 30), chains[[0, 30]], 11)
    np.testing.assert_allclose(rot.angle(own, chains[::3]), 0.0, atol=1e-7)
    poses = rot.exp(rng.normal(size=(2, 2, 3)))
    assert rot.angle(_held_to_ends(recorded, (0, 30), poses, 11)[[0, -1]], poses).max() < 1e-7


@pytest.mark.parametrize("name", ["ballet", "cmu05"])
def test_each_mode_is_the_farthest_from_what_is_known_by_then(name: str, request: pytest.FixtureRequest) -> None:
    engine = request.getfixturevalue(name)
    corpus, seconds = engine.corpus, 2.0
    stops, joints = ends(engine, 40, 300), len(corpus.skeleton)
    known = [straight(stops, joints)]
    recorded, poses = all_frames(corpus), known[0][[0, -1]]
    left = _likeliest(recorded, stops, poses, round(seconds * CONTACT_FPS / NODE_FRAMES))
    shown = {passage: _held_to_ends(recorded, passage, poses, COUNT) for passage in left}
    found = []

    def place_of(begin: int) -> Place:
        return Place(int(recorded.stretches[begin]), float(recorded.times[begin]))  # a stretch is a clip

    distance = []
    for place in find_modes(corpus, engine.statistics, stops, seconds, known):
        off = {one: min(float(rot.angle(shown[one], other).mean()) for other in known) for one in left}
        farthest = max(off, key=lambda one: off[one])
        assert place == place_of(farthest[0])
        distance.append(off[farthest])
        left.remove(farthest)
        known.append(shown[farthest])
        found.append(place)
    assert left == []
    assert len(found) == len(set(found)) > 4
    assert all(one >= other - 1e-12 for one, other in pairwise(distance))  # as of any farthest-first traversal


def test_there_are_no_modes_where_no_recording_lasts_so_long(ballet: Engine) -> None:
    stops = ends(ballet, 3, 9)
    known = [straight(stops, 23)]
    assert list(find_modes(ballet.corpus, ballet.statistics, stops, 100.0, known)) == []
    assert len(list(find_modes(ballet.corpus, ballet.statistics, stops, 0.01, known))) == N_CANDIDATE_PASSAGES
