"""Fetch a corpus from an index: download, verify and validate it, and learn it on this machine."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from motionmind.corpus import store
from motionmind.corpus.cache import cache_folder
from motionmind.corpus.versions import locked
from motionmind.errors import CorpusError, FormatError
from motionmind.files import make_folder
from motionmind.learned.learning import Learned
from motionmind.learned.persistence import load_movement, save
from motionmind.registry.archive import unpack
from motionmind.registry.download import Progress, check_address, download, file_hash
from motionmind.registry.index import Archive, Entry, Recipe, Source, find, is_address, open_index

_STATED = ("title", "author", "source", "licence", "citation", "origins")  # fields that index and corpus must agree on


def archives() -> Path:
    """Return the folder of fetched archives, each under its SHA-256."""
    return cache_folder("archives")


def look_up(name: str, index: str | None = None) -> tuple[Entry | Recipe, Source]:
    """Return the entry of a corpus in an index, and the index.

    Args:
        name: the name of a corpus; or the address of an index, with "#NAME" after it if that lists several corpora.
        index: the path or the address of an index to search before the one that comes with MotionMind.

    Raises:
        CorpusError: there is no such corpus, or the index cannot be reached.
        FormatError: it is not an index.
    """
    if not is_address(name):
        return find(name, [index, None] if index else [None])
    place, _, fragment = name.partition("#")
    if fragment:
        return find(fragment, [place])
    source = open_index(place)
    if len(source.index.corpora) != 1:
        names = ", ".join(entry.name for entry in source.index.corpora[:20]) or "none"
        raise CorpusError(f"{place}: holds {len(source.index.corpora)} corpora ({names}); add #NAME to the address")
    return source.index.corpora[0], source


def fetch(
    entry: Entry,
    source: Source,
    *,
    name: str | None = None,
    home: str | os.PathLike[str] | None = None,
    on_progress: Progress | None = None,
) -> Path:
    """Fetch a corpus, and return its folder among the user's own; it is written completely or not at all.

    The archive is kept for the next time, and an incomplete download is resumed.

    Args:
        entry: the corpus, from `look_up`.
        source: its index.
        name: its new name; its own by default.
        home: the user's home (`motionmind.corpus.store.home`).
        on_progress: called with the number of bytes of the archive so far.

    Raises:
        CorpusError: the name is invalid or taken, the archive cannot be downloaded or differs from the index, or the
            corpus in it is invalid.
    """
    chosen = entry.name if name is None else name
    place = store.place_for(chosen, home)
    if (place / store.MANIFEST).exists():
        raise CorpusError(f"there is a corpus {chosen!r} already; fetch this one under another name")
    if entry.corpus_version != (version := store.VERSIONS[store.BUILT]):
        raise CorpusError(f"{entry.name} is a corpus of version {entry.corpus_version}; {version} can be read")
    with _held(entry) as folder:
        archive = _obtain(entry, source, folder, on_progress)
        learned = _learn(entry, archive, folder / "unpacked")
        save(replace(learned, corpus=replace(learned.corpus, name=chosen)), place)
    return place


@contextmanager
def _held(entry: Entry) -> Iterator[Path]:
    """Lock the folder of an archive, and remove unpacked files before and after."""
    folder = archives() / entry.archive.sha256
    try:
        make_folder(folder)
        with locked(folder, alone=True, is_new=True) as is_mine:
            if not is_mine:
                raise CorpusError(f"{entry.name} is being fetched by another process")
            shutil.rmtree(folder / "unpacked", ignore_errors=True)  # left by a killed process
            try:
                yield folder
            finally:
                shutil.rmtree(folder / "unpacked", ignore_errors=True)
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be written: {error.strerror or error}") from error


def _obtain(entry: Entry, source: Source, folder: Path, on_progress: Progress | None) -> Path:
    """Return the verified archive of a corpus: a file beside a local index, the kept one, or a new download."""
    where, wanted = source.locate(entry.archive), entry.archive
    if is_address(where):
        check_address(where, source.place if is_address(source.place) else None)
        kept = folder / "archive.tar"
        if not _is_archive(kept, wanted):
            download(where, kept, wanted.size, wanted.sha256, on_progress)
    elif not _is_archive(kept := Path(where), wanted):
        message = f"there is no such file of {wanted.size:,} bytes with the SHA-256 {wanted.sha256}"
        raise CorpusError(f"{kept}: is not the archive that the index names: {message}")
    if on_progress:
        on_progress(wanted.size)
    return kept


def _is_archive(path: Path, wanted: Archive) -> bool:
    """Return whether a path is the archive that an index names; False for a pipe or a device, which may be endless."""
    return path.is_file() and path.stat().st_size == wanted.size and file_hash(path) == wanted.sha256


def _learn(entry: Entry, archive: Path, folder: Path) -> Learned:
    """Unpack an archive and learn its corpus; raise CorpusError if it is invalid or contradicts the index."""
    place = folder / entry.name
    unpack(archive, entry.files, place)
    try:
        learned = load_movement(place)
    except FormatError as error:
        message = str(error).removesuffix(f"; {store.remedy(place)}").replace(f"{place}{os.sep}", "")
        raise CorpusError(f"the archive of {entry.name} holds no valid corpus: {message}") from error
    for key in _STATED:
        if (told := getattr(learned.corpus, key)) != getattr(entry, key):
            raise CorpusError(f"the archive of {entry.name} states another {key} than the index: {told!r:.200}")
    return learned
