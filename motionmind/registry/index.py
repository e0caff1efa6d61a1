"""Indexes of corpora: their schema, how to read them, and how to find a corpus."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal
from urllib.parse import urljoin

import msgspec

from motionmind.credits.credit import Origin
from motionmind.errors import CorpusError, FormatError, suggestion
from motionmind.files import read_bytes

MAX_INDEX_BYTES = 16 * 10**6  # some ten thousand corpora
SHIPPED = Path(__file__).parent / "recipes.json"

Name = Annotated[str, msgspec.Meta(pattern=r"^\w[\w.-]{0,63}$")]
Line = Annotated[str, msgspec.Meta(max_length=1000)]
Text = Annotated[str, msgspec.Meta(max_length=100_000)]
Hash = Annotated[str, msgspec.Meta(pattern="^[0-9a-f]{64}$")]
Bytes = Annotated[int, msgspec.Meta(ge=0, le=2**50)]
# A corpus's manifest, its licence, and the arrays of its first version: all names stay inside the folder.
Member = Annotated[str, msgspec.Meta(pattern=r"^(manifest\.json|LICENCE\.txt|1/\w{1,64}(\.\w{1,64}){0,3}\.npy)$")]


class File(msgspec.Struct, frozen=True, kw_only=True):
    """A file in an archive: its name there, its size in bytes, and its SHA-256."""

    name: Member
    size: Bytes
    sha256: Hash


class Archive(msgspec.Struct, frozen=True, kw_only=True):
    """An archive: its address, which may be relative to the index's, its size in bytes, and its SHA-256."""

    url: Line
    size: Bytes
    sha256: Hash


class Entry(msgspec.Struct, frozen=True, kw_only=True):
    """A corpus that can be fetched.

    Attributes:
        name: its name.
        title: a one-line description.
        author: its author.
        performers: the performers of its movement.
        source: the origin of its movement.
        licence: the name of its licence.
        licence_text: the text of the licence.
        citation: how to cite it; "" for no request.
        origins: the corpora that parts of it come from, with their licences.
        corpus_version: the version of its storage format.
        clips, postures: their numbers.
        archive: the archive to fetch.
        files: the files in the archive.
    """

    name: Name
    title: Line
    author: Line
    performers: Annotated[tuple[Line, ...], msgspec.Meta(max_length=10_000)]
    source: Line
    licence: Annotated[str, msgspec.Meta(min_length=1, max_length=1000)]
    licence_text: Text
    citation: Text
    corpus_version: int
    clips: Annotated[int, msgspec.Meta(ge=1)]
    postures: Annotated[int, msgspec.Meta(ge=1)]
    archive: Archive
    files: Annotated[tuple[File, ...], msgspec.Meta(min_length=1, max_length=256)]
    origins: Annotated[tuple[Origin, ...], msgspec.Meta(max_length=1000)] = ()

    def __post_init__(self) -> None:
        """Check that each file is listed once, and that all together are no larger than the archive."""
        names = [file.name for file in self.files]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise ValueError(f"{twice} is listed twice")
        if sum(file.size for file in self.files) > self.archive.size:
            raise ValueError("its files are larger than its archive")


class Recipe(msgspec.Struct, frozen=True, kw_only=True):
    """A collection that only its publisher may distribute, and how to build a corpus from it.

    Attributes:
        name: the name of the corpus.
        title: a one-line description.
        performers: its performers, as far as known.
        source: the address of the collection's own page.
        licence: the name of the licence.
        licence_text: what it allows and forbids.
        accept: the terms to accept, and where.
        citation: how to cite it.
        size: the amount of movement, in words.
        form: the format of its files.
        steps: how to obtain it and build a corpus from it, in order; command lines begin with "motionmind".
        unverified: parts of this recipe that could not be verified.
    """

    name: Name
    title: Line
    performers: Line
    source: Line
    licence: Line
    licence_text: Text
    accept: Line
    citation: Text
    size: Line
    form: Line
    steps: tuple[Line, ...]
    unverified: tuple[Line, ...]


class Index(msgspec.Struct, frozen=True, kw_only=True):
    """The contents of an index file."""

    format: Literal["motionmind-index"]
    version: Literal[1]
    corpora: tuple[Entry, ...] = ()
    recipes: tuple[Recipe, ...] = ()

    def __post_init__(self) -> None:
        """Check that all names differ."""
        names: set[str] = set()
        for one in self.all:
            if one.name in names:
                raise ValueError(f"there are two corpora {one.name!r}")
            names.add(one.name)

    @property
    def all(self) -> list[Entry | Recipe]:
        """All corpora and recipes."""
        return [*self.corpora, *self.recipes]


@dataclass(frozen=True)
class Source:
    """An index and its path or address, which archives' addresses are relative to."""

    index: Index
    place: str

    def locate(self, archive: Archive) -> str:
        """Return the path or the address of an archive."""
        if is_address(self.place) or is_address(archive.url):
            return urljoin(self.place, archive.url) if is_address(self.place) else archive.url
        return str(Path(self.place).parent / archive.url)


def is_address(place: str) -> bool:
    """Return whether a place is an address, not a path."""
    return "://" in place


def parse_index(data: bytes, place: str) -> Index:
    """Parse an index that was read from `place`; raise FormatError with the reason if it is invalid."""
    if len(data) > MAX_INDEX_BYTES:
        raise FormatError(f"is larger than an index may be ({MAX_INDEX_BYTES // 10**6} MB)", path=place)
    try:
        return msgspec.json.decode(data, type=Index)
    except (msgspec.ValidationError, ValueError, RecursionError) as error:
        message = str(error).replace("Object missing required field", "there is no key")
        raise FormatError(f"is not an index of corpora, version 1: {message}", path=place) from error


def open_index(place: str | None) -> Source:
    """Read an index from a path or an address; None reads the one that comes with MotionMind, which has recipes.

    Raises:
        CorpusError: it cannot be reached.
        FormatError: it is not an index.
    """
    if place is None:
        return Source(parse_index(SHIPPED.read_bytes(), str(SHIPPED)), str(SHIPPED))
    if not is_address(place):
        return Source(parse_index(read_bytes(place), place), place)
    from motionmind.registry.download import read_address

    data, reached = read_address(place, MAX_INDEX_BYTES)
    return Source(parse_index(data, place), reached)


def find(name: str, places: Iterable[str | None]) -> tuple[Entry | Recipe, Source]:
    """Return the first corpus or recipe with a name, and its index.

    Args:
        name: its name.
        places: the indexes to search, as for `open_index`.

    Raises:
        CorpusError: there is none; the message suggests a similar name or lists all.
    """
    known: list[str] = []
    for place in places:
        source = open_index(place)
        for one in source.index.all:
            if one.name == name:
                return one, source
            known.append(one.name)
    raise CorpusError(f"no corpus {name!r} in the index{suggestion(name, known)}")
