"""Tweens at the edge of what can be asked: crowded, hasty and long ones, scarce corpora, other bodies."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from bodies import ant
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import Facing
from motionmind.discretize.codebook import Codebook
from motionmind.errors import NoPathError
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween


@cache
def engine_of(name: str) -> Engine:
    return Engine.load(name)


def posture(engine: Engine, row: int) -> Posture:
    corpus = engine.corpus
    return Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row])


def assert_sound(tween: Tween, a: Posture, b: Posture) -> None:
    motion = tween.motion
    assert np.isfinite(motion.rotations).all()
    assert np.isfinite(motion.root).all()
    np.testing.assert_array_equal(motion.rotations[[0, -1]], [a.rotations, b.rotations])
    np.testing.assert_array_equal(motion.root[[0, -1]], [a.root, b.root])
    np.testing.assert_allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0, atol=1e-9)
    assert np.all(np.diff(motion.times) > 0.0)
    assert motion.insertions[0].times[-1] == motion.times[-1]
    assert np.isfinite(tween.costs.guide).all()
    assert tween.costs.total == pytest.approx(tween.cost, abs=1e-6)
    reach = 3.0 * motion.skeleton.height + 2.0 * np.abs(b.root - a.root).max() + 2.0 * motion.times[-1]
    assert np.abs(motion.root - motion.root[0]).max() < reach


@pytest.mark.long
@pytest.mark.parametrize(
    "options",
    [
        {"moves": 20, "duration": 0.5},
        {"duration": 0.1},
        {"duration": 1.0 / 30.0},
        {"duration": 12.0},
        {"moves": 1},
        {"moves": 1, "duration": 6.0},
        {"moves": 40, "duration": 0.1},
        {"fps": 2.0},
        {"fps": 240.0, "duration": 0.4},
        {"guide": 50.0},
        {"guide": 0.0, "duration": 0.3},
    ],
    ids=str,
)
@pytest.mark.parametrize("name", ["ballet", "karate", "walk-hexapod", "hands"])
def test_ends_are_exact_and_numbers_finite_however_hasty_or_slow(name: str, options: dict[str, Any]) -> None:
    engine = engine_of(name)
    for a, b in np.random.default_rng(2).integers(0, len(engine.corpus), (2, 2)).tolist():
        ends = posture(engine, a), posture(engine, b)
        try:
            tween = engine.tween(*ends, **options)
        except NoPathError:
            assert options.get("moves", 1) == 1 or "duration" in options
            continue
        assert_sound(tween, *ends)
        if "duration" in options:
            assert tween.motion.times[-1] == pytest.approx(options["duration"])


@pytest.mark.long
@pytest.mark.parametrize("facing", ["free", "stage"])
@pytest.mark.parametrize("frames", [2, 3])
def test_a_corpus_of_one_clip_of_few_postures(facing: Facing, frames: int) -> None:
    body, rng = human23(), np.random.default_rng(0)
    rotations = rot.exp(0.3 * rng.normal(size=(frames, 23, 3)))
    rotations[:, 0] = rot.mul(rot.about_vertical(np.linspace(0.0, 2.5, frames)), rotations[:, 0])
    clip = Motion(body, rotations, 0.2 * rng.normal(size=(frames, 3)), 0.3 * np.arange(frames), "few")
    engine = Engine.fit([clip], facing=facing)
    for options in ({}, {"moves": 5}, {"duration": 2.0}, {"duration": 0.1}):
        for a, b in ((0, frames - 1), (0, 0)):
            try:
                tween = engine.tween(clip.posture(a), clip.posture(b), **options)
            except NoPathError:
                continue
            assert_sound(tween, clip.posture(a), clip.posture(b))
    assert_sound(engine.tween(clip.posture(0), clip.posture(-1)), clip.posture(0), clip.posture(-1))


def chain(joints: int, rng: np.random.Generator) -> Skeleton:
    """A body whose joints hang from each other at random."""
    parents = (-1, *(int(rng.integers(0, k)) for k in range(1, joints)))
    offsets = rng.normal(size=(joints, 3)) * 0.2
    offsets[0] = 0.0
    return Skeleton("any", tuple(f"joint{k}" for k in range(joints)), parents, offsets)


@pytest.mark.long
@settings(max_examples=20)
@given(st.integers(0, 10_000), st.sampled_from(["free", "stage"]))
def test_any_body_moves_in_any_corpus_from_any_end(seed: int, facing: Facing) -> None:
    """Corpora made at random, and ends of any velocity that are not in them."""
    rng = np.random.default_rng(seed)
    body = chain(int(rng.integers(1, 7)), rng)
    clips = []
    for number in range(int(rng.integers(1, 4))):
        frames = int(rng.integers(2, 12))
        turns = np.cumsum(rng.normal(size=(frames, len(body), 3)) * rng.uniform(0.05, 0.6), axis=0)
        root = np.cumsum(rng.normal(size=(frames, 3)) * 0.1, axis=0)
        times = np.cumsum(rng.uniform(0.05, 0.5, frames))
        clips.append(Motion(body, rot.exp(turns), root, times, f"clip{number}"))
    engine = Engine.fit(clips, facing=facing, discretization=Codebook(30.0))
    first, last = clips[0].posture(0), clips[-1].posture(-1)
    off = rot.exp(rng.normal(size=(len(body), 3)) * rng.choice([0.0, 0.05, 1.0]))
    first = Posture(body, rot.mul(first.rotations, off), first.root)
    times = np.array([-0.1, -0.05, 0.0])
    spin, way = rng.normal(size=(len(body), 3)), rng.normal(size=3)
    before = Motion(
        body,
        rot.mul(first.rotations, rot.exp(times[:, None, None] * spin)),
        first.root + times[:, None] * way,
        times + 1.0,
        "before",
    )
    # As it is stored there: to the last bit.
    first = before.posture(-1)
    for options in ({}, {"duration": float(rng.uniform(0.05, 3.0))}):
        for moving in ({}, {"before": before}):
            try:
                tween = engine.tween(first, last, **options, **moving)
            except NoPathError:
                continue
            assert_sound(tween, first, last)


@pytest.mark.long
def test_an_ant_s_tween_is_as_small_as_an_ant() -> None:
    rng, body = np.random.default_rng(3), ant()
    times = np.arange(30) * 0.1
    rotations = rot.exp(0.3 * np.sin(2.0 * times[:, None, None] + rng.uniform(0.0, 6.0, (len(body), 3))))
    root = np.stack([0.0 * times, 0.01 + 0.0 * times, 0.01 * times], axis=1)
    clip = Motion(body, rotations, root, times, "ant")
    engine = Engine.fit([clip], facing="free")
    for a, b in ((0, 9), (20, 3)):
        tween = engine.tween(clip.posture(a), clip.posture(b))
        assert_sound(tween, clip.posture(a), clip.posture(b))
        assert np.abs(tween.motion.root - clip.posture(a).root).max() < 0.05
