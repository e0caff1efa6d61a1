"""Movement that experiments are made with, learned once a process."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from motionmind import Engine, Motion, Posture, own_skeleton, read_motion
from motionmind._typing import Ints
from motionmind.body.contact import find_floor
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.discretize import make_discretization
from motionmind.metrics.figures import at_rate

RECORDED = {
    "cmu-05": "*.bvh",
    "cmu-135": "*.amc",
    "bandai": "*.bvh",
    "indian": "*.bvh",
    "cmu-16": "*.amc",
    "cmu-29": "*.amc",
}
SKIP = {"indian": 30}  # frames that lead from an added T-pose into the movement; elsewhere it is the first alone
LEVELLED = ("indian",)  # whose floor lies up to 17 cm below 0, in each clip elsewhere
TOLD_APART = ("cmu-05", "cmu-135", "bandai")  # by style, where that is the question
RATE = 5.0  # postures a second of what was recorded, to learn from
FPS = 30  # frames a second, to look at


def recorded(data: str | Path | None, *names: str) -> list[str]:
    """Those of the recorded corpora that are there."""
    return [name for name in names if data and (Path(data) / name).is_dir()]


@lru_cache(maxsize=6)
def recordings(data: str, name: str) -> tuple[Motion, ...]:
    """Whole clips as they were recorded, on human23, without the T-pose that was added before them."""
    clips = []
    for path in sorted(Path(data, name).rglob(RECORDED[name])):
        clip = own_skeleton(read_motion(path))
        clip = clip.slice(SKIP.get(name, 1), len(clip))
        clips.append(_levelled(clip) if name in LEVELLED else clip)
    return tuple(clips)


def _levelled(clip: Motion) -> Motion:
    """A clip with its floor at 0."""
    floor = find_floor(clip.skeleton, clip.rotations, clip.root)
    return replace(clip, root=clip.root - np.array([0.0, floor, 0.0]))


@lru_cache(maxsize=6)
def corpus(data: str | None, name: str) -> Corpus:
    """A bundled corpus, or a recorded one at 5 postures a second, facing free."""
    if name in RECORDED:
        assert data is not None
        return gather(name, recordings(data, name), rate=RATE)
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


@lru_cache(maxsize=24)
def movement(data: str | None, name: str, frames: int) -> dict[str, list[Motion]]:
    """The unbroken pieces of each sequence of a corpus that has one of more than so many frames, at 30 a second.

    Where a recording was reconstructed nobody knows what was danced: it is left out.
    """
    if name in RECORDED:
        assert data is not None
        whole = gather(name, recordings(data, name), rate=FPS)
        pieces = [piece for clip in whole.clips for piece in as_recorded(whole.motion(clip), clip)]
    else:
        whole = corpus(data, name)
        pieces = [at_rate(whole.recording(clip)) for clip in whole.clips]
    out: dict[str, list[Motion]] = {}
    for piece in pieces:
        out.setdefault(take_of(piece.name), []).append(piece)
    return {name: pieces for name, pieces in out.items() if any(len(piece) > frames for piece in pieces)}


def as_recorded(motion: Motion, clip: Clip) -> list[Motion]:
    """The pieces of a clip between the frames that were reconstructed."""
    step, known = 1.0 / FPS, np.ones(len(motion) + 2, dtype=bool)
    known[[0, -1]] = False
    for first, last in (repair.seconds for repair in clip.repairs if not repair.exact):
        known[1:-1] &= (motion.times < first - step) | (motion.times > last + step)
    edges = np.flatnonzero(np.diff(known))
    return [motion.slice(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def take_of(name: str) -> str:
    """The recording that a clip or piece is of: its name without the number of the part, or of the copy."""
    return re.sub(r"(\.\d+| \(\d+\))+$", "", name)


@lru_cache(maxsize=6)
def families(data: str | None, name: str) -> tuple[tuple[str, ...], ...]:
    """The recordings of a corpus, those of the same phrase together: what a held-out test leaves out at once."""
    takes = list(movement(data, name, 1))
    listed: list[list[str]] = []
    for folder in (Path(data) if data else None, Path(__file__).parent):
        path = folder / "takes.toml" if folder else None
        if path and path.exists():
            listed += tomllib.loads(path.read_text()).get(name, {}).get("families", [])
    family = {take: tuple(together) for together in listed for take in together}
    return tuple(dict.fromkeys(family.get(take, (take,)) for take in takes))


def without(data: str | None, name: str, sequence: str) -> Engine:
    """An engine that has seen neither a sequence nor others of the same phrase."""
    return learned(data, (name,), next(family for family in families(data, name) if sequence in family))


@lru_cache(maxsize=2)
def learned(data: str | None, names: tuple[str, ...], left_out: tuple[str, ...]) -> Engine:
    """An engine of the takes of corpora that are not left out."""
    return Engine.learn(rest(data, names, left_out), make_discretization("codebook", 15.0))


def rest(data: str | None, names: Sequence[str], left_out: Collection[str]) -> Corpus:
    """The takes of corpora that are not left out, at 5 postures a second where they were recorded."""
    if names[0] in RECORDED:
        assert data is not None
        takes = [take for name in names for take in recordings(data, name) if take.name not in left_out]
        return gather("+".join(names), takes, rate=RATE)
    whole = corpus(data, names[0])
    return part(whole, [number for number, clip in enumerate(whole.clips) if clip.name not in left_out])


def posture(whole: Corpus, index: int) -> Posture:
    """A posture of a corpus."""
    return Posture(whole.skeleton, whole.rotations[index], whole.root[index])


def pairs(whole: Corpus, count: int, seed: int) -> Ints:
    """Random pairs of a corpus's postures [count, 2]."""
    return np.random.default_rng(seed).integers(len(whole), size=(count, 2))
