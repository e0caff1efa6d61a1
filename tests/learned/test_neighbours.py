"""Trees over a corpus's samples: what they promise of their balls, and what is found by them."""

from __future__ import annotations

import heapq
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from motionmind.geometry import rotations as rot
from motionmind.geometry.distances import squared_distance
from motionmind.learned import nearest, neighbours, persistence
from motionmind.learned.nearest import find_near, postures_near
from motionmind.learned.neighbours import MAX_LEAF_SAMPLES, Neighbours, build_neighbours, node_bounds
from motionmind.tween.engine import Engine


@pytest.fixture(scope="module")
def engine() -> Engine:
    return Engine.load("ballet")


@pytest.fixture(scope="module")
def trees(engine: Engine) -> Neighbours:
    return build_neighbours(engine.corpus.skeleton, engine.statistics.orientations, engine.statistics.weights)


def distances(engine: Engine, part: np.ndarray, posture: np.ndarray) -> np.ndarray:
    """Squared distances of all samples from a posture of a part [m, 4]."""
    cosines = np.einsum("njc,jc->nj", engine.statistics.orientations[:, part], posture)
    return np.asarray(4.0 * np.maximum(1.0 - cosines**2, 0.0).mean(axis=1))


def test_each_ball_holds_its_samples_and_their_weights(engine: Engine, trees: Neighbours) -> None:
    count = len(engine.statistics.weights)
    assert np.diff(trees.bounds[(len(trees.bounds) - 1) // 2 :]).max() <= MAX_LEAF_SAMPLES
    for number, part in enumerate(trees.parts):
        order = trees.order[number]
        np.testing.assert_array_equal(np.sort(order), np.arange(count))
        np.testing.assert_array_equal(trees.ranks[number][order], np.arange(count))
        centres = trees.centres_of(number).astype(np.float64)
        for node, (start, stop) in enumerate(trees.bounds):
            off = distances(engine, part, centres[node])[order[start:stop]]
            assert np.sqrt(off.max()) <= trees.radii[number, node] + 1e-3  # of single precision
            assert trees.weights[number, node] == pytest.approx(engine.statistics.weights[order[start:stop]].sum())


def test_children_halve_their_parents() -> None:
    for count in (1, 32, 33, 1000, 1025):
        bounds = node_bounds(count)
        assert bounds[0].tolist() == [0, count]
        for node in range(len(bounds) // 2):
            (start, stop), (first, middle), (again, last) = bounds[[node, 2 * node + 1, 2 * node + 2]].tolist()
            assert (start, middle, stop) == (first, again, last)
            assert abs((middle - first) - (last - middle)) <= 1


@pytest.mark.parametrize("coded", [True, False])
def test_in_all_leaves_the_nearest_are_found_and_in_a_few_nearly(
    engine: Engine, trees: Neighbours, coded: bool
) -> None:
    rng, shown = np.random.default_rng(0), engine.statistics.orientations
    if not coded:
        trees = replace(trees, codes=trees.codes[:0])
    leaves, nearly = len(trees.bounds) // 2 + 1, []
    for number, part in enumerate(trees.parts):
        for _ in range(4):
            posture = rot.mul(shown[rng.integers(len(shown))], rot.exp(rng.normal(0.0, 0.1, (shown.shape[1], 3))))
            off = np.sqrt(distances(engine, part, posture[part]))
            found = find_near(trees, number, shown, posture[None], 50, leaves)
            assert found.shape == (1, 50)
            assert len(np.unique(found)) == 50
            np.testing.assert_allclose(off[found[0]], np.sort(off)[:50], atol=0.02 if coded else 1e-5)
            few = find_near(trees, number, shown, posture[None], len(shown), leaves // 8)
            assert few.shape[1] <= leaves // 8 * MAX_LEAF_SAMPLES
            nearly.append(off[few[0, 0]] / off.min())
    assert np.median(nearly) < 1.01
    assert np.quantile(nearly, 0.9) < 1.5


@pytest.mark.parametrize("alike", [False, True])
def test_leaves_are_searched_in_the_order_of_what_they_promise(trees: Neighbours, alike: bool) -> None:
    """As by a heap of pairs, where many promise the same, too."""
    rng, bounds = np.random.default_rng(1), trees.bounds
    for number, part in enumerate(trees.parts):
        centres, radii = trees.centres_apart[number], trees.radii[number]
        if alike:
            centres, radii = centres.copy()[rng.integers(2, size=len(bounds))], np.full(len(bounds), 0.1)
        posture = rot.exp(rng.normal(0.0, 0.5, (len(part), 3)))
        heap, expected = [(0.0, 0)], []
        while heap:
            _, node = heapq.heappop(heap)
            if 2 * node + 2 >= len(bounds):
                expected.append(node)
                continue
            for child in (2 * node + 1, 2 * node + 2):
                away = np.sqrt(squared_distance(centres[child], posture) / len(part))
                heapq.heappush(heap, (away - nearest.NEARER_THAN_CENTRE_RATIO * radii[child], child))
        for leaves in (1, 5, len(expected)):
            assert nearest._search(posture, bounds, centres, radii, leaves).tolist() == expected[:leaves]


def test_centres_are_copied_for_searches_unless_they_are_large(
    engine: Engine, trees: Neighbours, monkeypatch: pytest.MonkeyPatch
) -> None:
    copied, large, shown = replace(trees), replace(trees), engine.statistics.orientations
    assert len(copied.centres_apart) == len(trees.parts)
    monkeypatch.setattr(neighbours, "MAX_COPIED_BYTES", 0)
    for number in range(len(trees.parts)):
        np.testing.assert_array_equal(copied.centres_apart[number], trees.centres_of(number))
        assert not np.shares_memory(copied.centres_apart[number], trees.centres)
        assert np.shares_memory(large.centres_apart[number], trees.centres)
        for posture in shown[:3]:
            found = [find_near(one, number, shown, posture[None], 9, 4).tolist() for one in (copied, large)]
            assert found[0] == found[1]


def test_codes_are_of_what_the_samples_of_each_leaf_show(engine: Engine, trees: Neighbours) -> None:
    for number, part in enumerate(trees.parts):
        for start, stop in trees.bounds[len(trees.bounds) // 2 :]:
            shown = engine.statistics.orientations[trees.order[number, start:stop]][:, part]
            codes = trees.codes_of(number)[4 * len(part) * start : 4 * len(part) * stop]
            np.testing.assert_allclose(
                codes.reshape(-1, stop - start).T / 127.0, shown.reshape(len(shown), -1), atol=4e-3
            )


def test_postures_near_one_are_no_middles_of_moves(engine: Engine, trees: Neighbours) -> None:
    count, shown = len(engine.corpus), engine.statistics.orientations
    found = postures_near(trees, shown, shown[7], 5, count)
    assert found[0] == 7
    assert len(found) == 5
    assert found.max() < count


def test_what_was_learned_just_now_is_searched_by_the_loop_for_what_was_loaded(
    engine: Engine, trees: Neighbours
) -> None:
    shown, loop = engine.statistics.orientations.copy(), cast(Any, nearest._leaves)
    loaded = shown.view()
    loaded.setflags(write=False)
    find_near(trees, 0, loaded, shown[:1], 5)
    known = len(loop.signatures)
    find_near(replace(trees, codes=trees.codes.copy()), 0, shown, shown[:1], 5)
    assert len(loop.signatures) == known
    assert not any(array.flags.writeable for array in trees.arrays.values())


def test_trees_are_kept_with_the_corpus(engine: Engine, trees: Neighbours, tmp_path: Path, empty_cache: Path) -> None:
    persistence.save(replace(engine, statistics=replace(engine.statistics, trees=trees)), tmp_path / "large")
    loaded = persistence.load(str(tmp_path / "large")).statistics.trees
    assert loaded is not None
    for name, array in trees.arrays.items():
        np.testing.assert_array_equal(loaded.arrays[name], array)
