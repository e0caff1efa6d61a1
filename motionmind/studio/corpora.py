"""Corpora in the studio: their list, sheets of their clips, and learning one from uploaded clips."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
import numpy as np

from motionmind.body.motion import Motion
from motionmind.corpus import store
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.manifest import count_clips
from motionmind.display import displayed
from motionmind.errors import CorpusError, MotionMindError
from motionmind.studio.reading import Facts, load_clip

Report = Callable[[int, int, str], None]  # called with steps done, steps in all, and a description of the next

_MAX_TITLE_LENGTH = 200  # characters


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A clip of an upload to learn from."""

    upload: str
    clip: Annotated[int, msgspec.Meta(ge=0)] = 0


class Mixed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A corpus to mix in, and the weight of each of its moves."""

    name: str
    weight: Annotated[float, msgspec.Meta(ge=1e-6, le=1e6)] = 1.0


class Lesson(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request for a new corpus.

    Attributes:
        name: its name.
        title: description in one line.
        parts: uploaded clips.
        mix: corpora to learn from as well.
        mirror: whether to learn from the mirrored clips, too.
        rate: postures a second; None to choose automatically.
    """

    name: Annotated[str, msgspec.Meta(max_length=200)]
    title: Annotated[str, msgspec.Meta(max_length=_MAX_TITLE_LENGTH)] = ""
    parts: Annotated[tuple[Part, ...], msgspec.Meta(max_length=1_000)] = ()
    mix: Annotated[tuple[Mixed, ...], msgspec.Meta(max_length=50)] = ()
    mirror: bool = False
    rate: Annotated[float, msgspec.Meta(gt=0.0, le=1_000.0)] | None = None


class Recording(NamedTuple):
    """A clip to learn from, where a reader process stored it.

    Attributes:
        folder: folder of the upload.
        facts: facts about the upload.
        clip: number of the clip.
        skip: frames to leave out at its beginning.
    """

    folder: Path
    facts: Facts
    clip: int
    skip: int


def known(name: str, home: Path | None) -> str:
    """Return the name of an existing corpus; raise CorpusError if there is none, or if the name is a path."""
    if name not in store.list_corpora(home):
        raise CorpusError(f"no corpus {displayed(name)}")
    return name


def list_all(home: Path | None) -> list[dict[str, Any]]:
    """List all corpora with facts from their manifests, or with the error on reading them."""
    found = []
    for name, folder in store.list_corpora(home).items():
        entry: dict[str, Any] = {"name": name, "title": "", "own": _is_own(name, folder, home), "error": ""}
        try:
            manifest = store.read_manifest(folder)
            entry["title"] = displayed(str(manifest.get("title") or ""), _MAX_TITLE_LENGTH)
            entry["rate"] = manifest.get("rate")
            if manifest["format"] == store.BUILT:
                entry["clips"] = count_clips(manifest)
        except MotionMindError as error:
            entry["error"] = displayed(str(error), _MAX_TITLE_LENGTH)
        found.append(entry)
    return found


def _rate_of(lesson: Lesson, home: Path | None) -> float | Literal["auto"]:
    """Return the rate to learn at: the requested one, or the lowest of the mixed corpora, which have no more frames."""
    if lesson.rate is not None:
        return lesson.rate
    folders = store.list_corpora(home)
    rates = [store.read_manifest(folders[known(one.name, home)]).get("rate") for one in lesson.mix]
    return min((float(rate) for rate in rates if rate is not None), default="auto")


def _is_own(name: str, folder: Path, home: Path | None) -> bool:
    try:
        return store.place_for(name, home) == folder
    except CorpusError:  # it is bundled
        return False


def list_clips(corpus: Corpus, name: str) -> list[dict[str, Any]]:
    """List the clips of the corpus of a name, each with its key, size and duration."""
    clips = []
    for clip in corpus.clips:
        times = corpus.times[clip.start : clip.stop]
        clips.append(
            {
                "key": f"{name}/{clip.label}",
                "title": displayed(clip.label),
                "about": displayed(clip.about, _MAX_TITLE_LENGTH),
                "frames": (len(clip) - 1) * _frames_per_posture(corpus) + 1,
                "seconds": float(times[-1] - times[0]),
            }
        )
    return clips


def _frames_per_posture(corpus: Corpus) -> int:
    """Return the number of a recording's frames from one of the corpus's postures to the next."""
    return int(corpus.detail.shape[1]) + 1


def sheet_of(corpus: Corpus, name: str) -> dict[str, Any]:
    """Return the clips of the corpus of a name with the frames to show of each, and the corpus's origin."""
    clips = []
    for clip, listed in zip(corpus.clips, list_clips(corpus, name), strict=True):
        postures = np.unique(np.linspace(0, len(clip) - 1, min(6, len(clip))).round().astype(int))
        clips.append(listed | {"pictures": (postures * _frames_per_posture(corpus)).tolist()})
    about = {
        key: displayed(str(getattr(corpus, key)), _MAX_TITLE_LENGTH) for key in ("title", "author", "source", "licence")
    }
    body = f"{len(corpus.skeleton)} joints"
    return {"name": name, **about, "body": body, "postures": len(corpus), "rate": corpus.rate, "clips": clips}


def check_lesson(lesson: Lesson, home: Path | None) -> None:
    """Check a request for a corpus before any work starts.

    Raises:
        CorpusError: the name is invalid or taken, there is nothing to learn from, or a corpus to mix does not exist.
    """
    store.place_for(lesson.name, home)
    if lesson.name in store.list_corpora(home):
        raise CorpusError(f"corpus {lesson.name} already exists: choose another name or delete it first")
    if not (lesson.parts or lesson.mix):
        raise CorpusError("nothing to learn from: add files or mix in corpora")
    for one in lesson.mix:
        known(one.name, home)


def learn(report: Report, lesson: Lesson, recordings: list[Recording], home: Path | None) -> dict[str, Any]:
    """Learn a corpus and store it, in a worker process that may be killed at any moment.

    Args:
        report: called with the progress.
        lesson: the request.
        recordings: the uploaded clips.
        home: the folder of the user's corpora; None for the default folder.

    Returns:
        The corpus's name and size, and notes on doubtful points, for the page.

    Raises:
        MotionMindError: the clips are unsuitable.
    """
    from motionmind.tween.engine import Engine

    steps = len(recordings) + 2

    def clips() -> Iterator[Motion]:
        for number, one in enumerate(recordings):
            motion = load_clip(one.folder, one.facts, one.clip)
            report(number, steps, f"reading {displayed(motion.name)}")
            if one.skip >= len(motion):
                raise CorpusError(f"{displayed(motion.name)}: skipping {one.skip} frames leaves none")
            yield replace(motion.slice(one.skip, len(motion)), name=motion.name)
        report(len(recordings), steps, "learning")

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        engine = Engine.fit(
            clips(),
            name=lesson.name,
            home=home,
            mix={one.name: one.weight for one in lesson.mix},
            rate=_rate_of(lesson, home),
            mirror=lesson.mirror,
            title=lesson.title,
        )
    report(len(recordings) + 1, steps, "saving")
    engine.save(store.place_for(lesson.name, home))
    notes = list(dict.fromkeys(displayed(str(one.message), _MAX_TITLE_LENGTH) for one in caught))[:5]
    corpus = engine.corpus
    repaired = sum(len(clip.repairs) for clip in corpus.clips)
    if repaired:
        notes.append(f"repaired {repaired} joint jumps")
    return {"name": lesson.name, "clips": len(corpus.clips), "postures": len(corpus), "notes": notes}
