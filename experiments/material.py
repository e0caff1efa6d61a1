"""Movement that experiments are made with, learned once a process."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from motionmind import Engine, Motion, Posture, make_discretization, own_skeleton, read_motion
from motionmind._typing import Ints
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.metrics.measure import at_rate

RECORDED = {"cmu-05": "*.bvh", "cmu-135": "*.amc", "bandai": "*.bvh"}  # with their T-poses as first frames
RATE = 5.0  # postures a second of what was recorded, to learn from
FPS = 30  # frames a second, to look at


def recorded(data: str | Path | None, *names: str) -> list[str]:
    """Those of the recorded corpora that are there."""
    return [name for name in names if data and (Path(data) / name).is_dir()]


@lru_cache(maxsize=4)
def recordings(data: str, name: str) -> tuple[Motion, ...]:
    """Whole clips as they were recorded, on human23."""
    return tuple(own_skeleton(read_motion(path)) for path in sorted(Path(data, name).rglob(RECORDED[name])))


@lru_cache(maxsize=6)
def corpus(data: str | None, name: str) -> Corpus:
    """A bundled corpus, or a recorded one at 5 postures a second, facing free."""
    if name in RECORDED:
        assert data is not None
        return gather(name, recordings(data, name), rate=RATE, skip=1)
    return Engine.load(name).corpus


@lru_cache(maxsize=3)
def engine(data: str | None, name: str, kind: str = "", tolerance: float = 15.0) -> Engine:
    """An engine of a corpus: with the discretization that it comes with where `kind` is "", else with that one."""
    if not kind and name not in RECORDED:
        return Engine.load(name)
    return Engine.learn(corpus(data, name), make_discretization(kind or "codebook", tolerance))


def part(whole: Corpus, clips: Sequence[int], mirror: bool = False) -> Corpus:
    """A corpus of some of the clips of another, in that order; mirrored ones too where `mirror` says so."""
    return gather(
        whole.name,
        [whole.recording(whole.clips[number]) for number in clips],
        rate=whole.rate,
        facing=whole.facing,
        flips="keep",
        mirror=mirror,
    )


@lru_cache(maxsize=6)
def movement(data: str | None, name: str, frames: int) -> dict[str, list[Motion]]:
    """The unbroken pieces of each sequence of a corpus that has one of more than so many frames, at 30 a second."""
    if name in RECORDED:
        assert data is not None
        whole = gather(name, recordings(data, name), rate=FPS, skip=1)
        pieces = [whole.motion(clip) for clip in whole.clips]
    else:
        whole = corpus(data, name)
        pieces = [at_rate(whole.recording(clip)) for clip in whole.clips]
    out: dict[str, list[Motion]] = {}
    for piece in pieces:
        out.setdefault(re.sub(r"\.\d+$", "", piece.name), []).append(piece)
    return {name: pieces for name, pieces in out.items() if any(len(piece) > frames for piece in pieces)}


def without(data: str | None, name: str, sequence: str) -> Engine:
    """An engine that has not seen a sequence."""
    if name in RECORDED:
        assert data is not None
        rest = gather(name, [clip for clip in recordings(data, name) if clip.name != sequence], rate=RATE, skip=1)
        return Engine.learn(rest, make_discretization("codebook", 15.0))
    whole = corpus(data, name)
    return Engine.learn(
        part(whole, [number for number, clip in enumerate(whole.clips) if clip.name != sequence]),
        make_discretization("codebook", 15.0),
    )


def posture(whole: Corpus, index: int) -> Posture:
    """A posture of a corpus."""
    return Posture(whole.skeleton, whole.rotations[index], whole.root[index])


def pairs(whole: Corpus, count: int, seed: int) -> Ints:
    """Random pairs of a corpus's postures [count, 2]."""
    return np.random.default_rng(seed).integers(len(whole), size=(count, 2))
