"""Publish a corpus: write a folder with archive, metadata and index, for any file server."""

from __future__ import annotations

import datetime
import os
import re
import shutil
from pathlib import Path
from typing import NamedTuple

import msgspec

from motionmind.arguments import check_text
from motionmind.corpus import store
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.origins import warn_of_licences
from motionmind.corpus.versions import locked
from motionmind.errors import CorpusError
from motionmind.files import all_or_none, make_folder, sync_folder, write_atomically
from motionmind.learned.persistence import load, save_movement
from motionmind.registry.archive import pack
from motionmind.registry.croissant import describe
from motionmind.registry.download import check_address, file_hash
from motionmind.registry.index import Archive, Entry, File, Index, Recipe, parse_index


class Published(NamedTuple):
    """The result of publishing: the entry in the index, and the written files."""

    entry: Entry
    files: tuple[Path, ...]


def publish(
    name: str,
    folder: str | os.PathLike[str],
    *,
    url: str,
    date: str,
    licence_text: str,
    licence_url: str | None = None,
    home: str | os.PathLike[str] | None = None,
) -> Published:
    """Write a corpus's archive, its Croissant metadata, and its entry in the index of a folder.

    The same corpus gives the same bytes. Other corpora in the folder's index stay; one with the same name is replaced.

    Args:
        name: the name of the corpus, or its folder.
        folder: the target folder, which is created if necessary.
        url: the address that the folder will have.
        date: the day of publication, as "2026-11-23".
        licence_text: the text of the licence.
        licence_url: the address of the licence, if it has one.
        home: the user's home (`motionmind.corpus.store.home`).

    Warns:
        MotionMindWarning: the licences of its parts do not allow redistribution.

    Raises:
        CorpusError: there is no such corpus, it lacks a title, author, source or licence, or the folder cannot be
            written.
    """
    check_address(url := url.rstrip("/") + "/")
    if licence_url is not None:
        check_address(licence_url)
    _check_date(date)
    if not licence_text.strip():
        raise CorpusError("the licence's text is empty; give the licence itself")
    learned, target = load(name, home), Path(folder)
    _check_origin(learned.corpus)
    warn_of_licences(learned.corpus)
    staged = target / ".motionmind-unpublished"
    try:
        make_folder(target)
        with locked(target, alone=True, is_new=True) as is_mine:
            if not is_mine:
                raise CorpusError(f"{target}: another process is publishing there")
            shutil.rmtree(staged, ignore_errors=True)  # left by a killed process
            try:
                save_movement(learned, staged / "corpus")
                (staged / "corpus" / "LICENCE.txt").write_text(licence_text, "utf-8", newline="\n")
                entry = _pack(learned.corpus, staged, licence_text)
                written = _write(entry, target, staged, describe(entry, url, date, licence_url))
            finally:
                shutil.rmtree(staged, ignore_errors=True)
    except OSError as error:
        raise CorpusError(f"{target}: cannot be written: {error.strerror or error}") from error
    return Published(entry, written)


def _check_date(date: str) -> None:
    check_text("date", date)
    try:
        if not re.fullmatch(r"\d{4}-\d\d-\d\d", date):
            raise ValueError
        datetime.date.fromisoformat(date)
    except ValueError:
        raise CorpusError(f"{date!r:.80} is not a day such as 2026-11-23") from None


def _check_origin(corpus: Corpus) -> None:
    """Check that a corpus has a title, author, source and licence."""
    if missing := [key for key in ("title", "author", "source", "licence") if not getattr(corpus, key)]:
        options = " ".join(f"--{key}" for key in missing)
        raise CorpusError(f"corpus {corpus.name!r} states no {', '.join(missing)}; build it again with {options}")


def _pack(corpus: Corpus, staged: Path, licence_text: str) -> Entry:
    """Pack the staged corpus, and return its entry."""
    root = staged / "corpus"
    paths = {path.relative_to(root).as_posix(): path for path in sorted(root.rglob("*")) if path.is_file()}
    archive = staged / "archive.tar"
    pack(paths, archive)
    sha256 = file_hash(archive)
    return Entry(
        name=corpus.name,
        title=corpus.title,
        author=corpus.author,
        performers=tuple(sorted({corpus.credit_of(clip).performer for clip in corpus.clips} - {""})),
        source=corpus.source,
        licence=corpus.licence,
        licence_text=licence_text,
        citation=corpus.citation,
        corpus_version=store.VERSIONS[store.BUILT],
        clips=len(corpus.clips),
        postures=len(corpus),
        archive=Archive(url=f"{corpus.name}-{sha256[:12]}.tar", size=archive.stat().st_size, sha256=sha256),
        files=tuple(File(name=name, size=path.stat().st_size, sha256=file_hash(path)) for name, path in paths.items()),
        origins=corpus.origins,
    )


def _write(entry: Entry, target: Path, staged: Path, described: dict[str, object]) -> tuple[Path, ...]:
    """Move the archive into place, then write the metadata and the index that name it."""
    index = target / "index.json"
    others: tuple[Entry, ...] = ()
    recipes: tuple[Recipe, ...] = ()
    if index.exists():
        before = parse_index(index.read_bytes(), str(index))
        others, recipes = tuple(one for one in before.corpora if one.name != entry.name), before.recipes
    corpora = tuple(sorted((*others, entry), key=lambda one: one.name))
    data = msgspec.json.encode(Index(format="motionmind-index", version=1, corpora=corpora, recipes=recipes))
    parse_index(data, str(index))  # check that the published index is readable
    archive, metadata = target / entry.archive.url, target / f"{entry.name}.croissant.json"
    (staged / "archive.tar").replace(archive)
    sync_folder(target)
    with all_or_none():
        write_atomically(metadata, _format(msgspec.json.encode(described)))
        write_atomically(index, _format(data))
    return archive, metadata, index


def _format(data: bytes) -> bytes:
    return msgspec.json.format(data, indent=1) + b"\n"
