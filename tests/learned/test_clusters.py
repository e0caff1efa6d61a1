"""Clusters of postures: a posture founds one unless a founder is near, and joins the nearest."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionmind._typing import Floats, Ints
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.geometry.distances import squared_distance
from motionmind.learned import clusters
from motionmind.learned.clusters import CLUSTER_RADIUS_RAD


def one_by_one(orientations: Floats, within: float) -> Ints:
    """The clusters [N], every posture compared with every founder."""
    founders: list[int] = []
    for i, posture in enumerate(orientations):
        if all(squared_distance(posture, orientations[k]) > within for k in founders):
            founders.append(i)
    distances = [[squared_distance(posture, orientations[k]) for k in founders] for posture in orientations]
    return np.argmin(distances, axis=1)


def wander(seed: int, count: int, joints: int, pace: float) -> Floats:
    """Postures of a body whose joints wander."""
    steps = np.random.default_rng(seed).normal(0.0, pace, (count, joints, 3))
    return rot.exp(np.cumsum(steps, axis=0))


@given(
    seed=st.integers(0, 2**32 - 1),
    joints=st.integers(1, 6),
    pace=st.sampled_from([0.0, 0.01, 0.1, 1.0]),
    block=st.sampled_from([1, 7, 64]),
    decomposed=st.sampled_from([1, 64]),
)
def test_clusters_are_those_of_all_comparisons(
    seed: int, joints: int, pace: float, block: int, decomposed: int
) -> None:
    orientations = wander(seed, 60, joints, pace)
    orientations[17:23] = orientations[40:46]  # what is danced again is in the same cluster
    within = joints * CLUSTER_RADIUS_RAD**2
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clusters, "N_POSTURES_PER_BLOCK", block)
        patch.setattr(clusters, "MAX_FOUNDERS_COMPARED", 60)
        patch.setattr(clusters, "MAX_JOINTS_DECOMPOSED", decomposed)
        found = clusters.clusters(orientations, within)
    np.testing.assert_array_equal(found, one_by_one(orientations, within))
    np.testing.assert_array_equal(found[17:23], found[40:46])


@given(seed=st.integers(0, 2**32 - 1), joints=st.integers(1, 4))
def test_of_founders_that_are_equally_near_the_first_has_the_posture_whatever_the_last_digit(
    seed: int, joints: int
) -> None:
    """Founders lie on both sides of a posture, at equal angles, which rounding makes unequal either way."""
    rng = np.random.default_rng(seed)
    middle, turn = rot.exp(rng.normal(0.0, 1.0, (joints, 3))), rng.normal(0.0, 1.0, (joints, 3))
    turn *= 0.9 * CLUSTER_RADIUS_RAD / np.linalg.norm(turn, axis=-1, keepdims=True)
    ends = [rot.mul(middle, rot.exp(sign * turn)) for sign in (1.0, -1.0)]
    noise = rng.normal(0.0, 1e-16, (20, joints, 4))
    postures = np.stack([*ends, *(middle + noise)])
    np.testing.assert_array_equal(clusters.clusters(postures, joints * CLUSTER_RADIUS_RAD**2), [0, 1, *[0] * 20])


def test_of_many_that_all_differ_few_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of twice as many postures, all of them clusters of their own, no more than twice as many are compared."""
    compared, search = [0], clusters._search

    def counted(*arrays: Any) -> None:
        compared[-1] += search(*arrays)

    monkeypatch.setattr(clusters, "_search", counted)
    for count in (2_000, 4_000, 8_000):
        compared.append(0)
        orientations = rot.exp(np.random.default_rng(count).normal(0.0, 1.0, (count, 4, 3)))
        found = clusters.clusters(orientations, 4 * CLUSTER_RADIUS_RAD**2)
        assert found.max() > 0.9 * count
        assert compared[-1] <= 2 * 33 * count


@given(seed=st.integers(0, 2**32 - 1), most=st.integers(1, 9), enough=st.sampled_from([-1.0, 0.3, 2.0]))
def test_those_that_look_nearest_are_compared_and_no_others(seed: int, most: int, enough: float) -> None:
    orientations = rot.exp(np.random.default_rng(seed).normal(0.0, 0.7, (150, 3, 3)))
    seen, founders, postures = clusters._seen(orientations, Workshop()), np.arange(0, 150, 2), np.arange(150)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clusters, "MAX_FOUNDERS_COMPARED", most)
        least, place = clusters._nearest(clusters._grow(founders, seen), orientations, seen, postures, enough)
    for posture in postures:
        looks = np.sum((seen[founders] - seen[posture]) ** 2, axis=1)
        compared = np.argsort(looks)[:most]
        distances = [squared_distance(orientations[posture], orientations[founders[k]]) for k in compared]
        if enough < 0.0:
            assert (least[posture], place[posture]) == (min(distances), compared[np.argmin(distances)])
        assert (least[posture] > enough) == (min(distances) > enough)


@given(seed=st.integers(0, 2**32 - 1), joints=st.integers(65, 90), count=st.integers(1, 40))
def test_directions_of_many_joints_keep_nearly_all_that_exact_ones_do(seed: int, joints: int, count: int) -> None:
    points = clusters._points(wander(seed, count, joints, 0.1))
    points -= points.mean(axis=0)
    directions = clusters._directions(points)
    np.testing.assert_allclose(directions.T @ directions, np.eye(clusters.N_TREE_DIMENSIONS), atol=1e-9)
    greatest = np.linalg.svd(points, compute_uv=False)[: clusters.N_TREE_DIMENSIONS]
    assert np.sum((points @ directions) ** 2) >= 0.98 * np.sum(greatest**2)


def test_memory_is_in_proportion_to_the_joints() -> None:
    peaks = []
    for joints in (200, 800):
        orientations = wander(0, 20, joints, 0.1)
        tracemalloc.start()
        clusters.clusters(orientations, joints * CLUSTER_RADIUS_RAD**2)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 6.0 * peaks[0]
