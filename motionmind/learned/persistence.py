"""Saving and loading of learned corpora.

On disk, a corpus is its movement and states (`motionmind.corpus.store`). What is learned from them is cached under a
hash of the corpus and of the code (`motionmind.corpus.cache`), and learned again if it is not there. A hand-written
corpus, such as a bundled one, is compiled to a built one in the cache.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import MISSING, asdict, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import States
from motionmind.body.limbs import parts_of
from motionmind.body.skeleton import Skeleton
from motionmind.clip_names import split_clip
from motionmind.corpus import cache, store
from motionmind.corpus.clip import FLIP_DEG, Clip, JointFlip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.entries import Columns, Entries, Packed, StoredClips
from motionmind.corpus.fingerprint import fingerprint
from motionmind.corpus.gather import gather
from motionmind.corpus.manifest import BuiltManifest, SourceManifest, parse_manifest
from motionmind.discretize.library import library_path
from motionmind.discretize.protocol import Discretization
from motionmind.discretize.spec import from_spec
from motionmind.discretize.states import StateSpace
from motionmind.errors import CorpusError, FormatError, MotionMindError, MotionMindWarning
from motionmind.executors.workshop import Workshop
from motionmind.formats import read_motion
from motionmind.grammar.bridges import Bridges
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.transitions import Transitions
from motionmind.jit import interpreted
from motionmind.learned.gauge import Gauge
from motionmind.learned.learning import Learned, learn, learn_from_states
from motionmind.learned.neighbours import Neighbours
from motionmind.learned.pace import Pace
from motionmind.learned.plausibility import Plausibility
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.learned.trust import Trust
from motionmind.learned.validity import MOVEMENT, check_forms, check_values
from motionmind.notation.sources import sources
from motionmind.retarget.retarget import own_skeleton

_Part = TypeVar("_Part", Transitions, Bridges, Coordination, PostureStatistics, Pace, Plausibility, Gauge, Trust)

_CORPUS_KEYS = ("name", "title", "author", "source", "licence", "facing", "rate", "skip", "citation")


def save(learned: Learned, folder: str | os.PathLike[str], *, keep: bool = True) -> None:
    """Write a learned corpus to a folder, atomically, and cache what was learned.

    Args:
        learned: the learned corpus.
        folder: the destination; a built corpus there is replaced.
        keep: whether the replaced one stays beside it (`motionmind.corpus.store.save`).

    Raises:
        CorpusError: the folder cannot be written, or holds anything but a built corpus.
    """
    cache.remember(save_movement(learned, folder, keep=keep), learned_arrays(learned))


def save_movement(learned: Learned, folder: str | os.PathLike[str], *, keep: bool = True) -> str:
    """Write a corpus to a folder, as `save` does, without caching; return the corpus's hash."""
    return store.save(Path(folder), _manifest(learned), _movement(learned), keep=keep)


def load_movement(folder: str | os.PathLike[str]) -> Learned:
    """Load a built corpus and learn from it, without the cache.

    Args:
        folder: written by `save` or `save_movement`.

    Raises:
        FormatError: it cannot be read, or is not valid.
    """
    return learn_from_states(*_read_movement(Path(folder), store.load(Path(folder))))


def _movement(learned: Learned) -> dict[str, NDArray[Any]]:
    """Return the arrays from which everything else can be learned, by name."""
    corpus = learned.corpus
    clips, faults = Packed.of(map(_clip_entry, corpus.clips)), Packed.of(corpus.faults)
    entries = {"clips": {**clips._asdict(), **corpus.columns._asdict()}, "faults": faults._asdict()}
    return {
        "rotations": corpus.rotations,
        "root": corpus.root,
        "times": corpus.times,
        "detail": corpus.detail,
        "states": learned.states,
        "centres": learned.space.centres,
        **{f"{name}.{key}": array for name, arrays in entries.items() for key, array in arrays.items()},
    }


def learned_arrays(learned: Learned) -> dict[str, NDArray[Any]]:
    """Return the arrays that were learned, by name."""
    grammar, statistics = learned.grammar, learned.statistics
    parts = {
        "transitions": grammar.transitions,
        "bridges": grammar.bridges,
        "coordination": grammar.coordination,
        "statistics": statistics,
        "pace": learned.pace,
        "plausibility": learned.plausibility,
        "gauge": learned.gauge,
        "trust": statistics.trust,
    }
    arrays = {f"{name}.{key}": getattr(part, key) for name, part in parts.items() for key in _array_names(type(part))}
    trees = statistics.trees.arrays if statistics.trees is not None else {}
    return arrays | {f"neighbours.{key}": array for key, array in trees.items()}


def _manifest(learned: Learned) -> dict[str, Any]:
    """Return a built corpus's entries in its manifest."""
    corpus, space, skeleton = learned.corpus, learned.space, learned.corpus.skeleton
    manifest: dict[str, Any] = {
        **{key: getattr(corpus, key) for key in _CORPUS_KEYS if key != "citation" or corpus.citation},
        "skeleton": {
            "name": skeleton.name,
            "names": skeleton.names,
            "parents": skeleton.parents,
            "offsets": skeleton.offsets.tolist(),
            "tips": skeleton.tips.tolist(),
        },
        "space": {
            "kind": space.kind,
            "starts": space.starts.tolist(),
            "tolerances": space.tolerances.tolist(),
            "labels": space.labels,
        },
    }
    if corpus.flip_degrees != FLIP_DEG:
        manifest["flip_degrees"] = corpus.flip_degrees
    if corpus.origins:
        manifest["origins"] = [asdict(origin) for origin in corpus.origins]
    return manifest


def load(name: str, home: str | os.PathLike[str] | None = None) -> Learned:
    """Load a learned corpus; learn what the cache does not hold.

    Args:
        name: of the corpus, or its folder.
        home: where a user's corpora are.

    Raises:
        CorpusError: there is no such corpus; the message names those there are.
        FormatError: it cannot be read.

    Warns:
        MotionMindWarning: something in the cache is damaged and learned again, or the cache cannot be written.
    """
    folder = store.locate(name, home)
    stored = store.load(folder)
    if stored.manifest["format"] == store.BUILT:
        return _open(folder, stored)
    source, built = _find_built(folder, stored)
    if (built / store.MANIFEST).exists():
        try:
            return _open(built, store.load(built))
        except FormatError as error:
            what = str(error).removesuffix(f"; {store.remedy(built)}")
            warnings.warn(f"{what}; learning from {folder.name} again", MotionMindWarning, stacklevel=2)
    with interpreted(False):
        learned = learn(*_read_source(folder, source))
    try:
        save(learned, built, keep=False)  # it can be made again
    except CorpusError as error:
        warnings.warn(f"{error}; each command will learn {folder.name} again", MotionMindWarning, stacklevel=2)
    return learned


def load_corpus(name: str, home: str | os.PathLike[str] | None = None) -> Corpus:
    """Load the movement of a corpus, without learning from it: a hand-written one is composed unless the cache has it.

    Arguments and errors are as for `load`.
    """
    folder = store.locate(name, home)
    stored = store.load(folder)
    if stored.manifest["format"] == store.BUILT:
        return _read_movement(folder, stored)[0]
    source, built = _find_built(folder, stored)
    if (built / store.MANIFEST).exists():
        with suppress(FormatError):  # `load` warns, and makes it again
            return _read_movement(built, store.load(built))[0]
    with interpreted(False):  # thousands of postures: compiling takes 2 s, Python would take 40
        return _read_source(folder, source)[0]


def _find_built(folder: Path, stored: store.Stored) -> tuple[SourceManifest, Path]:
    """Return a hand-written corpus's manifest, and the cache's folder of the corpus that is compiled from it."""
    source = parse_manifest(stored.manifest, SourceManifest, folder / store.MANIFEST)
    return source, cache.cache_folder("corpora") / f"{folder.name}-{fingerprint(_source_files(folder, source))}"


def _open(folder: Path, stored: store.Stored) -> Learned:
    """Return what was learned from a built corpus, from the cache or anew; FormatError if the corpus is not valid."""
    corpus, space, states = _read_movement(folder, stored)
    arrays = cache.recall(stored.digest)
    if arrays is None:
        with interpreted(False):
            learned = learn_from_states(corpus, space, states, Workshop(folder=cache.workroom()))
        cache.remember(stored.digest, learned_arrays(learned))
        return learned
    grammar = Grammar(
        corpus.chains,
        space.centres,
        _part(Transitions, "transitions", arrays),
        _part(Bridges, "bridges", arrays),
        _part(Coordination, "coordination", arrays),
    )
    trees = {name.partition(".")[2]: array for name, array in arrays.items() if name.startswith("neighbours.")}
    statistics = replace(
        _part(PostureStatistics, "statistics", arrays),
        trees=Neighbours(parts_of(corpus.skeleton), **trees) if trees else None,
        trust=_part(Trust, "trust", arrays),
    )
    return Learned(
        corpus,
        space,
        states,
        grammar,
        statistics,
        _part(Pace, "pace", arrays),
        _part(Plausibility, "plausibility", arrays),
        _part(Gauge, "gauge", arrays),
    )


def _read_movement(folder: Path, stored: store.Stored) -> tuple[Corpus, StateSpace, States]:
    """Return the corpus, the state space and the states [N, L] in a folder; check files that are new.

    Args:
        folder: the corpus's folder.
        stored: its content.

    Raises:
        FormatError: something is missing or not valid.
    """
    path, arrays = folder / store.MANIFEST, stored.arrays
    try:
        manifest = parse_manifest(stored.manifest, BuiltManifest, path)
    except FormatError as error:
        raise FormatError(f"{error}; {store.remedy(folder)}") from error
    if missing := next((name for name in MOVEMENT if name not in arrays), None):
        raise FormatError(f"lists no array {missing}; {store.remedy(folder)}", path=path)
    body, states = manifest.skeleton, manifest.space
    try:
        skeleton = Skeleton(body.name, body.names, body.parents, np.array(body.offsets), np.array(body.tips))
        if not stored.is_checked:
            check_forms(arrays, len(skeleton), len(skeleton) + (manifest.facing == "free"))
        corpus = Corpus(
            skeleton=skeleton,
            clips=StoredClips(_packed("clips", arrays), Columns(*(arrays[f"clips.{key}"] for key in Columns._fields))),
            rotations=arrays["rotations"],
            root=arrays["root"],
            times=arrays["times"],
            detail=arrays["detail"],
            faults=Entries(_packed("faults", arrays), JointFlip),
            origins=manifest.origins,
            flip_degrees=manifest.flip_degrees,
            **{key: getattr(manifest, key) for key in _CORPUS_KEYS},
        )
        space = StateSpace(
            corpus.chains,
            arrays["centres"],
            np.array(states.starts),
            states.kind,
            np.array(states.tolerances),
            states.labels,
        )
        if not stored.is_checked:
            check_values(arrays, corpus, space.sizes)
            stored.remember_checked()
    except (MotionMindError, ValueError, OverflowError) as error:
        raise FormatError(f"{error}; {store.remedy(folder)}", path=path) from error
    return corpus, space, arrays["states"]


def _packed(name: str, arrays: Mapping[str, NDArray[Any]]) -> Packed:
    return Packed(*(arrays[f"{name}.{key}"] for key in Packed._fields))


def _part(kind: type[_Part], name: str, arrays: Mapping[str, NDArray[Any]]) -> _Part:
    """Build a part of a learned corpus from its arrays, which are named after its fields."""
    values: dict[str, Any] = {key: arrays[f"{name}.{key}"] for key in _array_names(kind)}
    return kind(**values)


def _array_names(kind: type[Any]) -> list[str]:
    """Return the names of the fields of a part that are arrays."""
    return [field.name for field in fields(kind) if field.default is MISSING]


def _clip_entry(clip: Clip) -> dict[str, Any]:
    """Return a clip's manifest entry without default values: there may be thousands of clips."""
    values = {field.name: (getattr(clip, field.name), field.default) for field in fields(clip)}
    return {name: value for name, (value, default) in values.items() if value != default}


# --- corpora that people write ----------------------------------------------------------------------------------------


def _source_files(folder: Path, manifest: SourceManifest) -> list[Path]:
    """Return all source files of a hand-written corpus."""
    library = manifest.discretization.get("library")
    return [
        folder / store.MANIFEST,
        *(Path(split_clip(folder / clip.file)[0]) for clip in manifest.clips),
        *(file for score in manifest.scores for file in sources(folder / score)),
        *([library_path(library)] if isinstance(library, str) else []),
    ]


def _read_source(folder: Path, manifest: SourceManifest) -> tuple[Corpus, Discretization]:
    """Read a hand-written corpus: its movement, and the discretization that its manifest names."""
    # Imported here, since a built corpus needs no scores.
    from motionmind.notation.compose import motions
    from motionmind.notation.read import read_scores

    try:
        discretization = from_spec(manifest.discretization)
    except FormatError as error:
        raise FormatError(str(error), path=folder / store.MANIFEST) from error
    scores, _ = read_scores(folder / score for score in manifest.scores)
    clips = [own_skeleton(replace(read_motion(folder / clip.file), name=clip.name)) for clip in manifest.clips]
    about = {clip.name: clip.about for clip in manifest.clips}
    about |= {clip.name: clip.about for score in scores for clip in score.clips}
    corpus = gather(
        performer={clip.name: clip.performer for clip in manifest.clips},
        motions=[*clips, *(motion for score in scores for motion in motions(score))],
        flips="keep",
        about=about,
        **{key: getattr(manifest, key) for key in _CORPUS_KEYS},
    )
    return corpus, discretization
