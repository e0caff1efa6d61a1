"""Walks whose states are known, and what is learned of them, counted a second time in dictionaries."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.discretize.codebook import Codebook
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine

STEP = 30.0  # degrees from state to state
POLE = Skeleton("pole", ("pole", "flag"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))


def walk(name: str, states: Sequence[int], flags: Sequence[int] | None = None, seconds: float = 0.2) -> Motion:
    """A pole that leans by so many steps, and a flag that does; both without a heading."""
    angles = np.radians(STEP) * np.array([states, flags or states], dtype=float).T
    q = rot.from_axis_angle([0.0, 0.0, 1.0], angles)
    root = np.stack([np.array(states, dtype=float), np.zeros(len(states)), np.zeros(len(states))], axis=1)
    return Motion(POLE, q, root, np.arange(len(states)) * seconds, name)


def learned(clips: Sequence[Motion], **options: Any) -> Engine:
    return Engine.fit(clips, discretization=Codebook(STEP / 3.0), facing="stage", **options)


def steps(engine: Engine, chain: int = 0) -> list[int]:
    """What each state of a chain is called in the walks."""
    return [round(math.degrees(float(rot.log(q)[2])) / STEP) for q in engine.space.of(chain)]


def edges(engine: Engine, values: NDArray[Any], chain: int = 0) -> dict[tuple[int, int], float]:
    """Values [E] of a chain's transitions, by the walks' states."""
    graph, called = engine.grammar.transitions, steps(engine, chain)
    rows = graph.sources - graph.starts[chain]
    mine = range(graph.indptr[graph.starts[chain]], graph.indptr[graph.starts[chain + 1]])
    return {(called[rows[e]], called[graph.targets[e]]): float(values[e]) for e in mine}


def weights(engine: Engine, chain: int = 0) -> dict[tuple[int, int], float]:
    return edges(engine, engine.grammar.transitions.weights("conditional"), chain)


def counted(walks: Sequence[Sequence[int]]) -> Counter[tuple[int, int]]:
    return Counter(move for states in walks for move in pairwise(states))


def expected(counts: Mapping[tuple[int, int], float]) -> dict[tuple[int, int], float]:
    """-log P(next | state) of weighted counts."""
    leaving: dict[int, float] = defaultdict(float)
    for (before, _), number in counts.items():
        leaving[before] += number
    return {move: math.log(leaving[move[0]]) - math.log(number) for move, number in counts.items()}


def assert_rows_sum_to_one(engine: Engine) -> None:
    graph = engine.grammar.transitions
    p = np.bincount(graph.sources, np.exp(-graph.weights("conditional")), len(graph.visits))
    np.testing.assert_allclose(p[np.diff(graph.indptr) > 0], 1.0, rtol=1e-12)


WALKS = st.lists(st.lists(st.integers(-2, 2), min_size=2, max_size=9), min_size=1, max_size=3)
PRICES = st.sampled_from([0.0, 0.3, 1.0, 2.5, 40.0, 100.0])
few = settings(max_examples=25)


def dance(name: str, seed: int, frames: int = 14) -> Motion:
    """A person who moves every joint a little, in no symmetric way."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames) * 0.2
    phase, size = rng.uniform(0.0, 6.0, (23, 3)), rng.uniform(0.1, 0.5, (23, 3))
    q = rot.exp(size * np.sin(1.1 * t[:, None, None] + phase))
    q[:, 0] = rot.mul(rot.about_vertical(rng.uniform(-0.5, 0.5) * t), q[:, 0])
    return Motion(human23(), rot.normalise(q), np.stack([np.sin(t), 1.0 + 0.0 * t, t], axis=1), t, name)
