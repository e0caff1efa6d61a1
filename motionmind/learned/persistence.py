"""Saving and loading of learned corpora.

A built corpus is a folder of arrays with a manifest (`motionmind.corpus.store`). The result of learning from a
hand-written corpus, such as a bundled one, is cached under a fingerprint of everything that it depends on.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import MISSING, asdict, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import States
from motionmind.body.limbs import parts_of
from motionmind.body.skeleton import Skeleton
from motionmind.corpus import store
from motionmind.corpus.clip import FLIP_DEGREES, Clip, JointFlip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.entries import Columns, Entries, Packed, StoredClips
from motionmind.corpus.fingerprint import fingerprint
from motionmind.corpus.gather import gather
from motionmind.corpus.kept import Kept
from motionmind.corpus.manifest import (
    BuiltManifest,
    ListingManifest,
    NamedManifest,
    SourceManifest,
    parse_manifest,
)
from motionmind.discretize.library import library_path
from motionmind.discretize.protocol import Discretization
from motionmind.discretize.spec import from_spec
from motionmind.discretize.states import StateSpace
from motionmind.errors import FormatError, MotionMindError
from motionmind.formats import read_motion
from motionmind.grammar.bridges import Bridges
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.transitions import Transitions
from motionmind.learned.carriage import Carriage
from motionmind.learned.gauge import Gauge
from motionmind.learned.learning import Learned, learn, learn_from_states
from motionmind.learned.neighbours import Neighbours
from motionmind.learned.pace import Pace, measure_pace
from motionmind.learned.plausibility import Plausibility
from motionmind.learned.trust import PRIOR_TRUST, Trust
from motionmind.learned.validity import (
    ENTRIES,
    FORMS,
    GAUGE,
    MOVEMENT,
    TREES,
    TRUST,
    check_entries,
    check_forms,
    check_values,
)
from motionmind.notation.sources import sources
from motionmind.retarget.retarget import own_skeleton
from motionmind.walks.evidence import spread_of

_Part = TypeVar("_Part", Transitions, Bridges, Coordination, Carriage, Pace, Plausibility, Gauge, Trust)

_CORPUS_KEYS = ("name", "title", "author", "source", "licence", "facing", "rate", "skip", "citation")
_PARTS = {
    "transitions": Transitions,
    "bridges": Bridges,
    "coordination": Coordination,
    "carriage": Carriage,
    "pace": Pace,
    "plausibility": Plausibility,
}


def save(learned: Learned, folder: str | os.PathLike[str]) -> None:
    """Write a learned corpus to a folder, atomically.

    Args:
        learned: the learned corpus.
        folder: the destination; a built corpus there is replaced.

    Raises:
        CorpusError: the folder cannot be written, or holds anything but a built corpus.
    """
    arrays = _movement(learned)
    for name, kind in _PARTS.items():
        part = getattr(learned if kind in (Carriage, Pace, Plausibility) else learned.grammar, name)
        arrays |= {f"{name}.{key}": getattr(part, key) for key in _array_names(kind)}
    gauge = learned.gauge or measure_pace(Kept.none(learned.corpus))
    arrays |= {f"gauge.{key}": getattr(gauge, key) for key in _array_names(Gauge)}
    arrays |= {f"trust.{key}": getattr(learned.carriage.trust, key) for key in _array_names(Trust)}
    if learned.carriage.trees is not None:
        arrays |= {f"neighbours.{key}": array for key, array in learned.carriage.trees.arrays.items()}
    store.save(Path(folder), _manifest(learned), arrays)


def save_movement(learned: Learned, folder: str | os.PathLike[str]) -> None:
    """Write only a corpus's movement and states, as `save` does; `load_movement` learns the rest again."""
    store.save(Path(folder), _manifest(learned), _movement(learned))


def load_movement(folder: str | os.PathLike[str]) -> Learned:
    """Load the movement and the states of a built corpus, and learn the rest from them.

    Args:
        folder: written by `save` or `save_movement`, in this version or an earlier one.

    Raises:
        FormatError: it cannot be read, or is not valid.
    """
    return learn_from_states(*_read_movement(Path(folder), store.load(Path(folder))))


def _movement(learned: Learned) -> dict[str, NDArray[Any]]:
    """Return the arrays from which everything else can be learned again, by name."""
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
    manifest["code"] = learned.code
    if corpus.flip_degrees != FLIP_DEGREES:
        manifest["flip_degrees"] = corpus.flip_degrees
    if corpus.origins:
        manifest["origins"] = [asdict(origin) for origin in corpus.origins]
    return manifest


def load(name: str, home: str | os.PathLike[str] | None = None) -> Learned:
    """Load a learned corpus; a bundled corpus is learned on first use and cached.

    Args:
        name: of the corpus, or its folder.
        home: where a user's corpora are.

    Raises:
        CorpusError: there is no such corpus; the message names those there are.
        FormatError: it cannot be read.
    """
    folder = store.locate(name, home)
    stored = store.load(folder)
    if stored.is_current:
        return _open(folder, stored)
    if stored.manifest["format"] == store.BUILT:
        # From a corpus of an earlier version, only the movement and its states are loaded; the rest is learned again.
        files = [folder / store.MANIFEST, *stored.files]
        return _kept(folder, files, lambda: learn_from_states(*_read_movement(folder, stored)))
    source = parse_manifest(stored.manifest, SourceManifest, folder / store.MANIFEST)
    return _kept(folder, _learned_files(folder, source), lambda: learn(*_read_source(folder, source)))


def _kept(folder: Path, files: Iterable[Path], learn_it: Callable[[], Learned]) -> Learned:
    """Return the learned corpus of these files from the cache; if missing, learn and cache it."""
    built = store.cache() / f"{folder.name}-{fingerprint(files)}"
    try:
        return _open(built, store.load(built))
    except MotionMindError:  # not cached yet, or damaged
        learned = learn_it()
    with suppress(MotionMindError):  # the cache is not writable: learn again next time
        save(learned, built)
    return learned


def _open(folder: Path, stored: store.Stored) -> Learned:
    """Build the learned corpus from a folder's contents; FormatError if something is missing or not valid."""
    arrays: Mapping[str, NDArray[Any]] = stored.arrays
    if not stored.measures_feet:
        arrays = {**arrays, "plausibility.slides": np.array([np.nan])}
    is_named = stored.measures_clips
    needed = (name for name in FORMS if is_named or name not in GAUGE)
    corpus, space, states = _read_arrays(folder, stored, arrays, needed)
    grammar = Grammar(
        corpus.chains,
        arrays["centres"],
        _part(Transitions, "transitions", arrays),
        _part(Bridges, "bridges", arrays),
        _part(Coordination, "coordination", arrays),
    )
    carriage = replace(_part(Carriage, "carriage", arrays), trees=_trees(arrays, corpus.skeleton))
    carriage = replace(carriage, trust=_trust(arrays, corpus, carriage))
    return Learned(
        corpus,
        space,
        states,
        grammar,
        carriage,
        _part(Pace, "pace", arrays),
        _part(Plausibility, "plausibility", arrays),
        _part(Gauge, "gauge", arrays) if is_named else None,
        stored.manifest["code"] if is_named else "",
    )


def _read_movement(folder: Path, stored: store.Stored) -> tuple[Corpus, StateSpace, States]:
    """Return the movement of a corpus that an earlier version built, and its states; FormatError as `_open`."""
    arrays = {name: stored.arrays[name] for name in (*MOVEMENT, *ENTRIES) if name in stored.arrays}
    if "rotations" in arrays:  # the first corpora kept nothing of the movement between postures
        postures, joints = (*arrays["rotations"].shape, 0, 0)[:2]
        arrays.setdefault("detail", np.zeros((postures, 0, joints, 3), np.float16))
    return _read_arrays(folder, stored, arrays, (*MOVEMENT, *ENTRIES))


def _read_arrays(
    folder: Path, stored: store.Stored, arrays: Mapping[str, NDArray[Any]], needed: Iterable[str]
) -> tuple[Corpus, StateSpace, States]:
    """Return the corpus, the state space and the states [N, L] that a folder's manifest and arrays hold.

    Args:
        folder: the corpus's folder.
        stored: its content.
        arrays: the arrays to take, by name.
        needed: names of those that may not lack, but for `ENTRIES` where the manifest lists these.

    Raises:
        FormatError: something lacks or is not valid.
    """
    path = folder / store.MANIFEST
    try:
        listed = parse_manifest(stored.manifest, ListingManifest, path) if stored.lists_clips else None
        kind = NamedManifest if stored.measures_clips else BuiltManifest
        manifest = listed or parse_manifest(stored.manifest, kind, path)
    except FormatError as error:
        raise FormatError(f"{error}; {store.remedy(folder)}") from error
    lacking = (name for name in needed if name not in arrays and not (listed and name in ENTRIES))
    if missing := next(lacking, None):
        raise FormatError(f"lists no array {missing}; {store.remedy(folder)}", path=path)
    body, states, is_new = manifest.skeleton, manifest.space, not stored.is_checked
    try:
        skeleton = Skeleton(body.name, body.names, body.parents, np.array(body.offsets), np.array(body.tips))
        if is_new:
            check_forms(arrays, skeleton, manifest.facing)
            if not listed:
                check_entries(arrays)
        corpus = Corpus(
            skeleton=skeleton,
            clips=listed.clips if listed else _clips(arrays),
            rotations=arrays["rotations"],
            root=arrays["root"],
            times=arrays["times"],
            detail=arrays["detail"],
            faults=listed.faults if listed else Entries(_packed("faults", arrays), JointFlip),
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
        if is_new:
            check_values(arrays, corpus, space)
    except (ValueError, OverflowError) as error:
        raise FormatError(f"{error}; {store.remedy(folder)}", path=path) from error
    if is_new:
        stored.remember_checked()
    return corpus, space, arrays["states"]


def _clips(arrays: Mapping[str, NDArray[Any]]) -> StoredClips:
    """Return the clips of a corpus from its arrays."""
    columns = Columns(*(arrays[f"clips.{key}"] for key in Columns._fields))
    return StoredClips(_packed("clips", arrays), columns)


def _packed(name: str, arrays: Mapping[str, NDArray[Any]]) -> Packed:
    return Packed(*(arrays[f"{name}.{key}"] for key in Packed._fields))


def _part(kind: type[_Part], name: str, arrays: Mapping[str, NDArray[Any]]) -> _Part:
    """Build a part of a learned corpus from its arrays, which are named after its fields."""
    values: dict[str, Any] = {key: arrays[f"{name}.{key}"] for key in _array_names(kind)}
    return kind(**values)


def _array_names(kind: type[_Part]) -> list[str]:
    """Return the names of the fields of a part that are arrays."""
    return [field.name for field in fields(kind) if field.default is MISSING]


def _trees(arrays: Mapping[str, NDArray[Any]], skeleton: Skeleton) -> Neighbours | None:
    """Return the trees over a corpus's samples; None if it has none."""
    own = {name.partition(".")[2]: array for name, array in arrays.items() if name in TREES}
    if own:
        own.setdefault("codes", np.zeros(0, np.int8))
    return Neighbours(parts_of(skeleton), **own) if own else None


def _trust(arrays: Mapping[str, NDArray[Any]], corpus: Corpus, carriage: Carriage) -> Trust:
    """Return the trust in a corpus's walks; the prior for a corpus of an earlier version."""
    if arrays.keys() >= TRUST.keys():
        return _part(Trust, "trust", arrays)
    return replace(PRIOR_TRUST, spread=spread_of(corpus, carriage))


def _clip_entry(clip: Clip) -> dict[str, Any]:
    """Return a clip's manifest entry without default values: there may be thousands of clips."""
    values = {field.name: (getattr(clip, field.name), field.default) for field in fields(clip)}
    return {name: value for name, (value, default) in values.items() if value != default}


# --- corpora that people write ----------------------------------------------------------------------------------------


def _learned_files(folder: Path, manifest: SourceManifest) -> list[Path]:
    """Return all source files of a hand-written corpus."""
    library = manifest.discretization.get("library")
    return [
        folder / store.MANIFEST,
        *(folder / clip.file for clip in manifest.clips),
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
