"""Find movements and postures by name (`motionmind.names.spelling`)."""

from __future__ import annotations

import os
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, ItemsView, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from motionmind.body.motion import Motion, Posture
from motionmind.clip_names import split_clip
from motionmind.corpus import store
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.manifest import SourceManifest, parse_manifest
from motionmind.credits.credit import Credit, Origin, credit_clip
from motionmind.errors import MotionMindError, did_you_mean, enumerated, suggestion
from motionmind.formats import read_motion
from motionmind.names.spelling import Moment, PostureName, Source, is_file
from motionmind.notation import compose
from motionmind.notation.read import read_scores
from motionmind.notation.score import Score

_FILE_SUFFIX = re.compile(r"\.[a-z]\w{1,4}", re.IGNORECASE | re.ASCII)


class Collection(ABC):
    """Named clips and postures of a score or a corpus.

    Attributes:
        word: its path or name, for messages.
    """

    def __init__(self, word: str) -> None:
        self.word = word

    @property
    @abstractmethod
    def postures(self) -> Sequence[str]:
        """Names of the postures, in order."""

    @property
    @abstractmethod
    def clips(self) -> Mapping[str, str]:
        """Descriptions of the clips by name, in order."""

    @property
    @abstractmethod
    def scores(self) -> Sequence[Score]:
        """The scores in which the collection is written; none of a built corpus."""

    @abstractmethod
    def posture(self, name: str) -> Posture:
        """Return a posture by name."""

    def credits_of(self, name: str) -> tuple[Credit, ...]:
        """Return the credits of a posture; none if unknown."""
        return ()

    @abstractmethod
    def motions(self, names: Sequence[str]) -> list[Motion]:
        """Return clips by name."""

    def choose(self, wanted: Sequence[str] = ()) -> list[Motion]:
        """Return the clips with these names, each once, or all; raise MotionMindError if one does not exist."""
        if not self.clips:
            raise MotionMindError(f"{self.word}: holds no clips")
        for name in wanted:
            if name not in self.clips:
                raise MotionMindError(f"{self.word}: no clip {name!r}{suggestion(name, list(self.clips))}")
        return self.motions(list(dict.fromkeys(wanted)) or list(self.clips))

    def find(self, name: str, *, as_clip: bool) -> Motion:
        """Return a posture, as a motion of one frame, or a clip; if both exist, the clip if `as_clip`.

        Raises:
            MotionMindError: neither has this name.
        """
        self.check(name)
        if name in self.clips and (as_clip or name not in self.postures):
            return self.motions([name])[0]
        return replace(self.posture(name).as_motion(), name=name, recorded=self.credits_of(name))

    def check(self, name: str) -> None:
        """Raise MotionMindError, with a suggestion, if neither a posture nor a clip has this name."""
        if name not in self.postures and name not in self.clips:
            place, at, moment = name.rpartition("@")
            if at and (place in self.postures or place in self.clips):
                raise MotionMindError(_no_moment(f"{self.word}/{place}", moment))
            known = [*self.postures, *self.clips]
            raise MotionMindError(f"{self.word}: no posture or clip {name!r}{suggestion(name, known)}")


class _ScoreCollection(Collection):
    """A score's clips and postures, and the postures of included scores."""

    def __init__(self, path: str, home: Path | None) -> None:
        super().__init__(path)
        (self._score,) = _read_once((locate_score(path, home),))
        self._clips = {clip.name: clip for clip in self._score.clips}

    @property
    def postures(self) -> Sequence[str]:
        return list(self._score.postures)

    @property
    def clips(self) -> Mapping[str, str]:
        return {name: clip.about for name, clip in self._clips.items()}

    @property
    def scores(self) -> Sequence[Score]:
        return [self._score]

    def posture(self, name: str) -> Posture:
        return _posture(self._score, name)

    def motions(self, names: Sequence[str]) -> list[Motion]:
        return compose.motions(self._score, [self._clips[name] for name in names])


class _CorpusCollection(Collection):
    """A corpus's clips, and the named postures of its scores if it is written by hand.

    Names in a corpus written by hand come from its scores, because learning it takes a while the first time.
    """

    def __init__(self, name: str, home: Path | None) -> None:
        super().__init__(name)
        self._home = home
        self._folder = store.locate(name, home)

    @cached_property
    def _written(self) -> SourceManifest | None:
        """The manifest of a corpus written by hand; None for a built corpus."""
        manifest = store.read_manifest(self._folder)
        if manifest["format"] == store.BUILT:
            return None
        return parse_manifest(manifest, SourceManifest, self._folder / store.MANIFEST)

    @cached_property
    def scores(self) -> Sequence[Score]:
        return _read_once(tuple(self._folder / name for name in self._written.scores)) if self._written else ()

    @cached_property
    def _scores(self) -> dict[str, Score]:
        """The score of each posture by name, the first if several scores have it."""
        found: dict[str, Score] = {}
        for score in self.scores:
            found = dict.fromkeys(score.postures, score) | found
        return found

    @cached_property
    def _corpus(self) -> Corpus:
        from motionmind.learned import persistence  # numba is slow to import

        return persistence.load_corpus(self.word, self._home)

    @property
    def postures(self) -> Sequence[str]:
        return list(self._scores)

    @cached_property
    def clips(self) -> Mapping[str, str]:
        if self._written is None:
            return _Labels(self._corpus)
        recorded = {clip.name: clip.about for clip in self._written.clips}
        return recorded | {clip.name: clip.about for score in self.scores for clip in score.clips}

    def posture(self, name: str) -> Posture:
        return _posture(self._scores[name], name)

    def credits_of(self, name: str) -> tuple[Credit, ...]:
        if self._written is None:
            return ()
        of = self._written
        return (credit_clip(Origin(of.name, of.title, of.author, of.source, of.licence, of.citation), name),)

    def motions(self, names: Sequence[str]) -> list[Motion]:
        corpus = self._corpus
        try:
            return [replace(corpus.motion(corpus.clip_labelled(name)), name=name) for name in names]
        except KeyError as error:
            raise MotionMindError(f"{self.word}: no clip {error} any more, for its files have changed") from error


class _Labels(Mapping[str, str]):
    """Descriptions of a corpus's clips by label; a lookup does not read all of them."""

    def __init__(self, corpus: Corpus) -> None:
        self._corpus = corpus

    def __getitem__(self, label: str) -> str:
        return self._corpus.clip_labelled(label).about

    def __iter__(self) -> Iterator[str]:
        return iter(dict(self.items()))

    def items(self) -> ItemsView[str, str]:
        """Return all labels, each with the clip's description."""
        return {clip.label: clip.about for clip in self._corpus.clips}.items()

    def __len__(self) -> int:
        return len(self._corpus.clips)


_Stamps = dict[Path, tuple[int, int] | None]
_kept: dict[tuple[Path, ...], tuple[_Stamps, Sequence[Score]]] = {}


def _read_once(places: tuple[Path, ...]) -> Sequence[Score]:
    """Return cached scores, read again if a file has changed."""
    known = _kept.get(places)
    if known is not None and _stamps(known[0]) == known[0]:
        return known[1]
    before = _stamps(places)
    scores, files = read_scores(places)
    stamps = _stamps(files)
    _kept.pop(places, None)
    # A file that changed during the read may be incomplete: do not cache it.
    if _stamps(places) == before:
        while len(_kept) >= 16:
            _kept.pop(next(iter(_kept)))
        _kept[places] = stamps, scores
    return scores


@lru_cache(64)
def _posture(score: Score, name: str) -> Posture:
    """Return a cached posture of a score; balancing it over its feet takes half as long as a tween."""
    return compose.posture(score, name)


def _stamps(files: Iterable[Path]) -> _Stamps:
    """Return each file's modification time and size; None for a missing file."""
    return {file: (file.stat().st_mtime_ns, file.stat().st_size) if file.is_file() else None for file in files}


def open_collection(source: Source, home: Path | None = None) -> Collection:
    """Open the score or corpus of a source.

    Raises:
        MotionMindError: it cannot be read.
    """
    return (_ScoreCollection if source.kind == "score" else _CorpusCollection)(source.place, home)


def locate_score(path: str, home: Path | None = None) -> Path:
    """Return the path of a score: the file, or else a corpus's own score, CORPUS/NAME.score.

    Raises:
        MotionMindError: neither exists, but a corpus has a score with this name.
    """
    if is_file(path):
        return Path(path)
    corpora = store.list_corpora(home)
    corpus, _, name = path.rpartition("/")
    if corpus in corpora and is_file(f"{corpora[corpus]}/{name}"):
        return corpora[corpus] / name
    if not corpus and (owner := next((word for word in corpora if is_file(f"{corpora[word]}/{name}")), None)):
        raise MotionMindError(f"{path}: there is no such file; did you mean {owner}/{name}?")
    return Path(path)


def find_motion(
    source: Source,
    home: Path | None = None,
    *,
    as_clip: bool = True,
    read: Callable[[Path | str], Motion] = read_motion,
) -> Motion:
    """Find the movement of a source; a posture is a motion of one frame.

    Args:
        source: the source.
        home: the folder of the user's corpora; None for the default folder.
        as_clip: whether a clip has priority over a posture with the same name.
        read: reads a file, or the clip in it that its path names.

    Raises:
        MotionMindError: there is no such movement, or the source has several clips and names none.
    """
    if source.kind == "file":
        check_exists(source, home)
        return read(source.file)
    collection = open_collection(source, home)
    if source.name:
        return collection.find(source.name, as_clip=as_clip)
    if len(collection.clips) != 1:
        raise MotionMindError(f"{source.word}: holds {len(collection.clips)} clips{_example(source, collection)}")
    return collection.choose()[0]


def check_exists(source: Source, home: Path | None = None) -> None:
    """Raise MotionMindError, with a suggestion, if a source does not exist and is not spelled like a file."""
    word, place = source.word, str(split_clip(source.place)[0])
    if source.kind != "file" or is_file(place) or _FILE_SUFFIX.fullmatch(Path(place).suffix):
        return  # the reader reports what is wrong with a file
    if os.path.isdir(word):  # noqa: PTH112 - a name may be too long for any file
        raise MotionMindError(f"{word}: is a folder, and no corpus; give a file, or a corpus's posture or clip")
    place, at, moment = word.rpartition("@")
    if at and is_file(place):
        raise MotionMindError(_no_moment(place, moment))
    first, slash, _ = word.partition("/")
    corpora = list(store.list_corpora(home))
    if slash:
        raise MotionMindError(f"{word}: there is no such file, and no corpus {first!r}{suggestion(first, corpora)}")
    if "@" in word:
        raise MotionMindError(f"{word}: there is no such file; frames are spelled clip.bvh@240 or clip.bvh@2.0s")
    hint = _elsewhere(word, home) or f"; corpora are {enumerated(corpora, 60)}, a posture of one is CORPUS/NAME"
    raise MotionMindError(f"{word}: there is no such file or corpus{hint}")


def check_named(source: Source, home: Path | None = None) -> None:
    """Raise MotionMindError if there is no such movement, as far as is known before reading or learning it."""
    if source.kind != "file":
        if source.name:
            open_collection(source, home).check(source.name)
    elif not is_file(source.place):
        find_motion(source, home)  # raises with the reason


def frame_of(name: PostureName, motion: Motion) -> int:
    """Return the index of a posture's frame in its movement.

    Raises:
        MotionMindError: there is no such frame, or there are several and the name gives none.
    """
    if name.moment is not None:
        return select_frame(name.source.word, motion, name.moment)
    if len(motion) > 1:
        word = name.source.word
        raise MotionMindError(
            f"{word}: {len(motion)} frames, where one posture was expected; say which, from {word}@0 to "
            f"{word}@{len(motion) - 1}"
        )
    return 0


def select_frame(word: str, motion: Motion, moment: Moment) -> int:
    """Return the index of a frame; raise MotionMindError, which names the motion `word`, if there is no such frame."""
    if moment.seconds is None:
        return select_frames(word, len(motion), moment.frame, moment.frame)[0]
    times, seconds = motion.times, moment.seconds
    rounding = 0.5 * (times[-1] - times[0]) / max(len(times) - 1, 1) + 1e-6
    if not times[0] - rounding <= seconds <= times[-1] + rounding:
        raise MotionMindError(
            f"{word}: its frames are from {times[0]:.2f} to {times[-1]:.2f} s, there is none at {seconds:g} s"
        )
    return int(np.abs(times - seconds).argmin())


def select_frames(clip: Path | str, length: int, start: int, end: int) -> range:
    """Return the frames of a clip from `start` to `end`, both inclusive; negative numbers count from the end.

    Args:
        clip: the clip's name, for messages.
        length: the number of its frames.
        start: the first frame.
        end: the last frame.

    Raises:
        MotionMindError: there is no such frame, or `end` lies before `start`.
    """
    first, last = (frame + length if frame < 0 else frame for frame in (start, end))
    for frame, given in ((first, start), (last, end)):
        if not 0 <= frame < length:
            raise MotionMindError(f"{clip}: frames are 0 to {length - 1}, there is no frame {given}")
    if last < first:
        raise MotionMindError(f"{clip}: the last frame, {end}, lies before the first, {start}")
    return range(first, last + 1)


def _no_moment(word: str, moment: str) -> str:
    """Return the message for an invalid moment after the @ of a movement's name."""
    return f"{word}: @{moment} is neither a frame, such as @240, nor seconds, such as @2.0s"


def _example(source: Source, collection: Collection) -> str:
    """Return a hint with the name of a posture or a clip of a collection, if it has any."""
    example = next(iter((*collection.postures, *collection.clips)), None)
    return f"; name a posture or a clip, such as {source.place}/{example}" if example else ""


def _elsewhere(name: str, home: Path | None) -> str:
    """Return "; did you mean ...?" with a corpus's posture of this name or a corpus of a similar name; or ""."""
    corpora = store.list_corpora(home)
    for corpus in corpora:
        try:
            if name in _CorpusCollection(corpus, home).postures:
                return f"; did you mean {corpus}/{name}?"
        except MotionMindError:  # ignore damaged corpora
            continue
    return did_you_mean(name, corpora)
