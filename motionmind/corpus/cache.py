"""The user's cache folder, with what was learned from corpora.

    learned/3f9a...-c0de.../manifest.json, *.npy

A folder's name combines a hash of the corpus, without its name, and a hash of the code that learned from it, so a
change of either leads to another folder. A writer fills a hidden folder and renames it, so readers never find the
folder of a killed writer. Each array has a checksum. Missing or damaged arrays are learned again.
"""

from __future__ import annotations

import os
import secrets
import shutil
import time
import warnings
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import platformdirs

from motionmind.corpus.arrays import (
    identify,
    is_checked,
    open_arrays,
    parse_entries,
    remember_checked,
    write_arrays,
)
from motionmind.corpus.fingerprint import code_name
from motionmind.errors import FormatError, MotionMindWarning
from motionmind.files import make_folder
from motionmind.private_folders import is_fixed, is_private, temporary_folder

if TYPE_CHECKING:
    from numpy.typing import NDArray

_MANIFEST = "manifest.json"
_UNFINISHED_S, _EXPIRY_S = 86_400.0, 60 * 86_400.0  # a folder without change for this long is removed


def cache_folder(room: str) -> Path:
    """Return a folder of the user's cache: "corpora" (compiled bundled corpora), "learned", "archives" or "notes"."""
    return Path(platformdirs.user_cache_dir("motionmind", appauthor=False)) / room


def recall(corpus: str) -> dict[str, NDArray[Any]] | None:
    """Return the arrays that this code learned from a corpus, by its hash; None if they are missing or damaged.

    Warns:
        MotionMindWarning: they are damaged; the corpus will be learned again.
    """
    try:
        folder = _folder(corpus)
        data = (folder / _MANIFEST).read_bytes()
    except OSError:
        return None
    try:
        entries = parse_entries(msgspec.json.decode(data))
        identity = identify(folder, data, entries)
        is_known = is_checked(folder, identity)
        arrays = open_arrays(folder, entries, verify=not is_known)
    except (FormatError, ValueError, RecursionError) as error:
        if folder.exists():  # else another process has just removed it
            what = error if isinstance(error, FormatError) else f"{folder / _MANIFEST}: {error}"
            warnings.warn(f"{what}; learning from the corpus again", MotionMindWarning, stacklevel=2)
            _remove(folder)
        return None
    if not is_known:
        remember_checked(folder, identity)
    with suppress(OSError):
        os.utime(folder)  # it is in use
    return arrays


def remember(corpus: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Store the arrays that this code learned from a corpus, by its hash, unless they are stored already.

    Warns:
        MotionMindWarning: the cache cannot be written.
    """
    folder = None
    try:
        folder = _folder(corpus)
        make_folder(folder.parent)
        _remove_unused(folder.parent)
        unfinished = folder.with_name(f".{secrets.token_hex(8)}")
        try:
            unfinished.mkdir()
            entries = write_arrays(unfinished, arrays, flush=False)  # a checksum detects damage by a power cut
            (unfinished / _MANIFEST).write_bytes(msgspec.json.encode(entries))
            unfinished.rename(folder)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
    except OSError as error:
        if folder is None or not folder.exists():
            what = f"{cache_folder('learned')}: cannot be written: {error.strerror or error}"
            warnings.warn(f"{what}; each command will learn the corpus again", MotionMindWarning, stacklevel=2)


def forget(corpus: str) -> None:
    """Remove all arrays learned from a corpus, by its hash, by any version of the code; ignore errors."""
    with suppress(OSError):
        for folder in _private(cache_folder("learned")).glob(f"{corpus}-*"):
            _remove(folder)


def workroom() -> Path | None:
    """Return a folder for large arrays while learning; None if there is none."""
    with suppress(OSError):
        folder = _private(cache_folder("learned"))
        make_folder(folder)
        return folder
    return None


def _folder(corpus: str) -> Path:
    """Return the folder of what this code learned from a corpus; OSError if there is no place for it."""
    return _private(cache_folder("learned")) / f"{corpus}-{code_name()}"


@cache
def _private(folder: Path) -> Path:
    """Return a folder, or one among temporary files if other users could write to it: compiled code trusts arrays."""
    folder = Path(os.path.realpath(folder))
    if is_fixed(folder):
        with suppress(OSError):
            make_folder(folder)
        if is_private(folder) or not folder.exists():
            return folder
    return temporary_folder() / folder.name


def _remove(folder: Path) -> None:
    """Remove a folder atomically: move it aside first; ignore errors."""
    aside = folder.with_name(f".{secrets.token_hex(8)}")
    with suppress(OSError):
        folder.rename(aside)
        shutil.rmtree(aside, ignore_errors=True)


def _remove_unused(parent: Path) -> None:
    """Remove folders of killed writers, and folders unused for two months."""
    for entry in parent.iterdir():
        with suppress(OSError):
            limit = _UNFINISHED_S if entry.name.startswith(".") else _EXPIRY_S
            if time.time() - entry.stat().st_mtime > limit:
                _remove(entry)
