"""Parse the spellings of movements and postures.

    arabesque.json           the only posture of a file
    clip.bvh@240             frame 240 of a file, counted from 0; @-1 is the last
    clip.bvh@2.0s            the frame nearest to 2.0 s
    hero.glb#Dance           a clip of a glTF file that has several
    hero.glb#Dance@240       a frame of it
    centre.score/tendu       a named posture of a score
    centre.score/adagio@23   a frame of one of its clips
    ballet/arabesque         a named posture of a corpus
    ballet/adagio@23         a posture of one of its clips

A file with the whole name has priority, because file names may contain #, @ and ~, and so has a clip of a glTF file; a
corpus, by name or folder, comes next. This module only checks which files, clips and corpora exist.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from motionmind.clip_names import find_name, read_names, split_clip

_MOMENT = r"-?\d{1,9}|\d{1,9}(?:\.\d{1,9})?s"  # more digits are a typing error
_POSTURE = re.compile(rf"(.+?)(?:@({_MOMENT}))?(~?)", re.ASCII | re.DOTALL)
_SCORE = re.compile(r"(.+?\.score)(?:/(.+))?", re.IGNORECASE | re.DOTALL)


@dataclass(frozen=True)
class Source:
    """A source of movement.

    Attributes:
        word: its spelling.
        kind: a motion file, a score, or a corpus; a missing source counts as a file.
        place: the path of the file or score; the name or the folder of the corpus.
        name: the posture or clip of the score or corpus, or the clip of a glTF file; "" if none is named.
    """

    word: str
    kind: Literal["file", "score", "corpus"]
    place: str
    name: str = ""

    @property
    def file(self) -> Path | str:
        """The motion file, with its clip if one is named, as `read_motion` takes it."""
        return f"{self.place}#{self.name}" if self.name else Path(self.place)

    @property
    def paths(self) -> tuple[Path, ...]:
        """The file to read, if the source is not a corpus: names never lead to writing in a corpus's folder."""
        return () if self.kind == "corpus" else (Path(self.place),)


@dataclass(frozen=True)
class Moment:
    """A frame of a movement.

    Attributes:
        frame: its index, from 0, or from the end if negative.
        seconds: the time to find the nearest frame for; None if `frame` is given.
    """

    frame: int = 0
    seconds: float | None = None

    @classmethod
    def of(cls, word: str) -> Moment:
        """Parse "240", "-1" or "2.0s"."""
        return cls(seconds=float(word[:-1])) if word.endswith("s") else cls(int(word))


@dataclass(frozen=True)
class PostureName:
    """The name of a posture.

    Attributes:
        word: its spelling.
        source: its movement.
        moment: its frame there; None if the movement has only one.
        is_moving: whether the name ends in ~, which includes the movement around it.
    """

    word: str
    source: Source
    moment: Moment | None = None
    is_moving: bool = False


def parse_source(word: str, home: Path | None = None) -> Source:
    """Parse the name of a movement: a file, a score, a corpus, SCORE/NAME or CORPUS/NAME.

    Args:
        word: the name.
        home: the folder of the user's corpora; None for the default folder.
    """
    # Imported here, because motion files need no corpora.
    from motionmind.corpus.store import MANIFEST, list_corpora

    score = _SCORE.fullmatch(word)
    file, clip = split_clip(word)
    if clip and is_file(str(file)):
        return Source(word, "file", str(file), clip)
    if is_file(word) and not (score and score[2] is None):
        return Source(word, "file", word)
    if score:
        return Source(word, "score", score[1], score[2] or "")
    corpus, _, name = word.partition("/")
    if corpus in list_corpora(home):
        return Source(word, "corpus", corpus, name)
    parts = word.split("/")
    for length in range(len(parts), 0, -1):
        if length < len(parts) and os.path.isdir(word):  # noqa: PTH112 - as in `is_file`
            break  # a folder inside a corpus's folder, not one of its names
        folder = "/".join(parts[:length])
        if folder and os.path.isfile(f"{folder}/{MANIFEST}"):  # noqa: PTH113 - as in `is_file`
            return Source(word, "corpus", folder, "/".join(parts[length:]))
    return Source(word, "file", str(file), clip) if clip else Source(word, "file", word)


def parse_posture(word: str, home: Path | None = None) -> PostureName:
    """Parse the name of a posture; arguments as for `parse_source`."""
    found = _POSTURE.fullmatch(word)
    if found is None or is_file(word) or _is_clip(word):
        return PostureName(word, parse_source(word, home))
    place, moment, tilde = found.groups()
    return PostureName(word, parse_source(place, home), None if moment is None else Moment.of(moment), bool(tilde))


def _is_clip(word: str) -> bool:
    """Return whether a word that may end in a frame is the whole name of a clip of a glTF file, such as Walk@2."""
    file, clip = split_clip(word)
    return clip is not None and ("@" in clip or clip.endswith("~")) and find_name(read_names(file), clip) is not None


def is_file(word: str) -> bool:
    """Return whether a file, a pipe or the like, but no folder, has this name."""
    # Path.exists fails for names that are too long for a file.
    return os.path.exists(word) and not os.path.isdir(word)  # noqa: PTH110, PTH112
