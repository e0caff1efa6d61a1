"""What is learned from a corpus: learning it, keeping it on disk, finding it again."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from time import perf_counter
from typing import Any, Self, TypeVar, Unpack

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, States
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.corpus import store
from motionmind.corpus.corpus import FACING, Clip, Corpus
from motionmind.corpus.gather import Gathering, gather
from motionmind.corpus.manifest import BuiltManifest, SourceManifest, parse_manifest
from motionmind.discretize import Codebook, Discretization, StateSpace, from_spec
from motionmind.discretize.library import library_path
from motionmind.errors import CorpusError, FormatError, MotionMindError
from motionmind.formats import read_motion
from motionmind.geometry import rotations as rot
from motionmind.grammar.bridges import Bridges
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar, learn
from motionmind.grammar.transitions import Transitions
from motionmind.learned.carriage import Carriage, learn_carriage
from motionmind.notation.sources import sources
from motionmind.retarget.retarget import own_skeleton

MOST_STATES_LEARNED = 10_000  # of a joint: its pairs take some 6 GB while they are learned
_Part = TypeVar("_Part", Transitions, Bridges, Coordination, Carriage)


@dataclass(frozen=True, eq=False)
class LearnedCorpus:
    """What was learned from a corpus.

    Attributes:
        corpus: the movement that was learned from.
        space: the states of each chain.
        states: of the corpus's postures [N, L].
        grammar: joint graphs, bridges and coordination.
        carriage: how the corpus's bodies hold themselves, travel and stand.
        load_seconds: time that loading took.
    """

    corpus: Corpus
    space: StateSpace
    states: States
    grammar: Grammar
    carriage: Carriage
    load_seconds: float = 0.0

    # --- learning ---------------------------------------------------------------------------------------------------

    @classmethod
    def fit(
        cls,
        clips: Iterable[Motion] = (),
        *,
        name: str = "corpus",
        discretization: Discretization | None = None,
        mix: Mapping[str, float] | None = None,
        home: str | os.PathLike[str] | None = None,
        **options: Unpack[Gathering],
    ) -> Self:
        """Learn from clips, all on the same joints (`own_skeleton` brings known rigs together).

        Args:
            clips: the movement; names tell where a move comes from.
            name: of the corpus.
            discretization: how orientations become states; a learned codebook of 15 degrees by default.
            mix: other corpora to learn from as well, by name or folder, each with what its postures and moves count
                where those of `clips` count 1.
            home: where the corpora of these names are.
            options: rate, skip, facing, flips, flip_degrees, mirror, reverse, about, title, author, source and licence:
                see `motionmind.corpus.gather.gather`.

        Raises:
            CorpusError: nothing to learn from, clips on different joints, more states than can be held, or no such
                corpus to mix.
            SkeletonError: the body cannot be mirrored.
        """
        others = [(cls.load(other, home).corpus, weight) for other, weight in (mix or {}).items()]
        return cls.learn(gather(name, clips, mix=others, **options), discretization or Codebook(15.0))

    @classmethod
    def learn(cls, corpus: Corpus, discretization: Discretization) -> Self:
        """Learn from a corpus."""
        orientations = corpus.to_chains(corpus.rotations)
        joints = corpus.skeleton.names
        space = discretization.fit(joints, orientations[:, : len(joints)])
        space, states = _seen(space, space.assign(orientations[:, : len(joints)]))
        _check_size(corpus, space)
        if corpus.facing == "free":
            space, facing = _with_facing(space, orientations[:, -1])
            states = np.concatenate([states, facing[:, None]], axis=1)
        moves = corpus.moves
        grammar = learn(
            corpus.chains,
            corpus.chain_parents,
            space.centres,
            states,
            space.sizes,
            moves.begins,
            moves.seconds,
            ends=moves.ends,
            weights=moves.weights,
            posture_weights=corpus.weights,
        )
        return cls(corpus, space, states, grammar, learn_carriage(corpus))

    # --- saving and loading -----------------------------------------------------------------------------------------

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write all that was learned to a folder, whole or not at all."""
        corpus, space = self.corpus, self.space
        arrays: dict[str, NDArray[Any]] = {
            "rotations": corpus.rotations,
            "root": corpus.root,
            "times": corpus.times,
            "detail": corpus.detail,
            "states": self.states,
            "centres": space.centres,
        }
        for name, kind in _PARTS.items():
            part = self.carriage if kind is Carriage else getattr(self.grammar, name)
            arrays |= {f"{name}.{field.name}": getattr(part, field.name) for field in fields(kind)}
        skeleton = corpus.skeleton
        manifest = {
            **{key: getattr(corpus, key) for key in _CORPUS_KEYS},
            "skeleton": {
                "name": skeleton.name,
                "names": skeleton.names,
                "parents": skeleton.parents,
                "offsets": skeleton.offsets.tolist(),
                "tips": skeleton.tips.tolist(),
            },
            "clips": [_saved(clip) for clip in corpus.clips],
            "faults": [asdict(fault) for fault in corpus.faults],
            "space": {
                "kind": space.kind,
                "starts": space.starts.tolist(),
                "tolerances": space.tolerances.tolist(),
                "labels": space.labels,
            },
        }
        store.save(Path(folder), manifest, arrays)

    @classmethod
    def load(cls, name: str, home: str | os.PathLike[str] | None = None) -> Self:
        """What was learned from a corpus, by its name or folder: one that was built, or a bundled one.

        A bundled corpus is learned on first use and kept in the platform's cache directory.

        Raises:
            CorpusError: there is no such corpus; the message names those there are.
            FormatError: it cannot be read.
        """
        began = perf_counter()
        folder = store.locate(name, home)
        found = store.read_manifest(folder)
        if found["format"] == store.BUILT:
            return cls._open(folder, began, found)
        manifest = parse_manifest(found, SourceManifest, folder / store.MANIFEST)
        built = store.cache() / f"{folder.name}-{store.fingerprint(_files(folder, manifest))}"
        try:
            return cls._open(built, began)
        except MotionMindError:  # it is not there yet, or is damaged
            engine = cls.learn(*_source(folder, manifest))
        with suppress(MotionMindError):  # nowhere to keep it: it is learned again next time
            engine.save(built)
        return replace(engine, load_seconds=perf_counter() - began)

    @classmethod
    def _open(cls, folder: Path, began: float, found: dict[str, Any] | None = None) -> Self:
        saved, arrays = store.load(folder, found)
        path = folder / store.MANIFEST
        manifest = parse_manifest(saved, BuiltManifest, path)
        missing = [name for name in _ARRAYS if name not in arrays]
        if missing:
            raise FormatError(f"lists no array {missing[0]}; build the corpus again", path=path)
        body, states = manifest.skeleton, manifest.space
        corpus = Corpus(
            skeleton=Skeleton(body.name, body.names, body.parents, np.array(body.offsets), np.array(body.tips)),
            clips=manifest.clips,
            rotations=arrays["rotations"],
            root=arrays["root"],
            times=arrays["times"],
            detail=arrays["detail"],
            faults=manifest.faults,
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
        grammar = Grammar(
            corpus.chains,
            arrays["centres"],
            _part(Transitions, "transitions", arrays),
            _part(Bridges, "bridges", arrays),
            _part(Coordination, "coordination", arrays),
        )
        carriage = _part(Carriage, "carriage", arrays)
        return cls(corpus, space, arrays["states"], grammar, carriage, perf_counter() - began)


_CORPUS_KEYS = ("name", "title", "author", "source", "licence", "facing", "rate")
_PARTS = {"transitions": Transitions, "bridges": Bridges, "coordination": Coordination, "carriage": Carriage}
_ARRAYS = (
    *("rotations", "root", "times", "detail", "states", "centres"),
    *(f"{name}.{field.name}" for name, kind in _PARTS.items() for field in fields(kind)),
)


def _part(kind: type[_Part], name: str, arrays: Mapping[str, NDArray[Any]]) -> _Part:
    return kind(**{field.name: arrays[f"{name}.{field.name}"] for field in fields(kind)})


def _saved(clip: Clip) -> dict[str, Any]:
    """A clip as the manifest has it: without what is as usual, for there may be thousands."""
    values = {field.name: (getattr(clip, field.name), field.default) for field in fields(clip)}
    return {name: value for name, (value, usual) in values.items() if value != usual}


def _seen(space: StateSpace, states: States) -> tuple[StateSpace, States]:
    """The state space without states that no posture is in, for nothing is known of them; and the states in it."""
    kept = [np.unique(column) for column in states.T]
    labels = [[named[s] for s in seen] if named else [] for named, seen in zip(space.labels, kept, strict=True)]
    centres = [space.of(joint)[seen] for joint, seen in enumerate(kept)]
    smaller = StateSpace.of_joints(space.names, centres, kind=space.kind, tolerances=space.tolerances, labels=labels)
    renamed = [np.searchsorted(seen, column) for seen, column in zip(kept, states.T, strict=True)]
    return smaller, np.stack(renamed, axis=1).astype(np.int32)


def _check_size(corpus: Corpus, space: StateSpace) -> None:
    """CorpusError where learning, which compares all pairs of a joint's states, would take too much memory."""
    largest = int(np.argmax(space.sizes))
    if space.sizes[largest] > MOST_STATES_LEARNED:
        raise CorpusError(
            f"corpus {corpus.name!r}: {space.names[largest]} has {space.sizes[largest]} states within "
            f"{space.tolerances[largest]:g} degrees, and a joint can have {MOST_STATES_LEARNED}; "
            "give it a coarser tolerance"
        )


def _with_facing(space: StateSpace, turns: Floats) -> tuple[StateSpace, States]:
    """The state space with a chain for the facing, whose states are equal steps of a circle as wide as the root's
    tolerance, and the states [N] of the corpus's turns [N, 4] in it."""
    count = max(8, round(360.0 / float(space.tolerances[0])))
    ring = rot.canonical(rot.about_vertical(np.arange(count) * 2.0 * np.pi / count))
    wider = StateSpace.of_joints(
        (*space.names, FACING),
        [*(space.of(joint) for joint in range(len(space))), ring],
        kind=space.kind,
        tolerances=np.append(space.tolerances, 360.0 / count),
        labels=(*space.labels, ()),
    )
    steps = np.round(rot.heading(turns) / (2.0 * np.pi / count)).astype(np.int32) % count
    return wider, steps


def _files(folder: Path, manifest: SourceManifest) -> list[Path]:
    """All that a corpus which people wrote is learned from."""
    library = manifest.discretization.get("library")
    return [
        folder / store.MANIFEST,
        *(folder / clip.file for clip in manifest.clips),
        *(file for score in manifest.scores for file in sources(folder / score)),
        *([library_path(library)] if isinstance(library, str) else []),
    ]


def _source(folder: Path, manifest: SourceManifest) -> tuple[Corpus, Discretization]:
    """A corpus that people wrote: its clips, and the discretization that its manifest names."""
    from motionmind.notation.compose import motions
    from motionmind.notation.read import read_score

    try:
        discretization = from_spec(manifest.discretization)
    except FormatError as error:
        raise FormatError(str(error), path=folder / store.MANIFEST) from error
    scores = [read_score(folder / score) for score in manifest.scores]
    clips = [own_skeleton(replace(read_motion(folder / clip.file), name=clip.name)) for clip in manifest.clips]
    about = {clip.name: clip.about for clip in manifest.clips}
    about |= {clip.name: clip.about for score in scores for clip in score.clips}
    corpus = gather(
        motions=[*clips, *(motion for score in scores for motion in motions(score))],
        flips="keep",
        about=about,
        **{key: getattr(manifest, key) for key in _CORPUS_KEYS},
    )
    return corpus, discretization
