"""Replace a folder's content atomically: each version has its own subfolder, and one file names the current version.

    corpora/mine/manifest.json     the current version, in "folder": 3, and in "previous" the manifest of version 2
    corpora/mine/3/*.npy           its arrays
    corpora/mine/2/*.npy           the arrays of the version that it replaced

To replace version 3, a writer makes folder 4, fills and flushes it, and moves a new manifest over the old one. Readers
find version 3 before that move and version 4 after it. Readers and writers of a version lock its folder; the lock ends
with the process, and cleaning removes versions that have no lock and are not in the manifest.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import sys
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path

from motionmind.corpus.arrays import CHECKED
from motionmind.files import TEMPORARY, sync_folder

if sys.platform != "win32":
    import fcntl

_ABANDONED_S = 3600.0  # a folder without locks that has not changed for this long counts as unused


@contextmanager
def hold(version: Path) -> Iterator[bool]:
    """Prevent the removal of a version until the context ends; yield whether the version exists."""
    with ExitStack() as stack:
        try:
            there = stack.enter_context(locked(version, alone=False))
        except FileNotFoundError:
            there = False
        yield there


@contextmanager
def new_version(folder: Path) -> Iterator[Path]:
    """Make a folder for the next version of `folder`, and hold an exclusive lock on it."""
    numbers = [int(entry.name) for entry in folder.iterdir() if _is_version(entry)]
    for number in count(max(numbers, default=0) + 1):
        version = folder / str(number)
        with ExitStack() as stack:
            try:
                version.mkdir()
                mine = stack.enter_context(locked(version, alone=True, is_new=True))
            except (FileExistsError, FileNotFoundError):  # another writer made it, or removed it as a leftover
                continue
            # Another writer may have removed it as a leftover, and made and locked it anew.
            if mine:
                yield version
                return


def remove_others(folder: Path, used: Callable[[], Collection[Path]]) -> None:
    """Remove all versions of `folder` except used ones and locked ones; ignore errors.

    Args:
        folder: the folder.
        used: returns the folders of the current version, and of the one that it replaced; none if there are none yet.
    """
    with suppress(OSError):
        for version in filter(_is_version, folder.iterdir()):
            with suppress(OSError), locked(version, alone=True) as unused:
                # Call used() only now: a writer holds a version while it makes it current.
                if unused and version not in used():
                    for file in version.iterdir():
                        if _is_array(file) or TEMPORARY.fullmatch(file.name):
                            file.unlink()
                    version.rmdir()


def remove(folder: Path) -> None:
    """Remove a folder with all its versions at once: move it to a hidden name first.

    Raises:
        OSError: it cannot be moved. `remove_leftovers` removes files that cannot be removed after the move.
    """
    aside = folder.with_name(f".{folder.name}-{secrets.token_hex(6)}")
    folder.rename(aside)
    sync_folder(folder.parent)
    shutil.rmtree(aside, ignore_errors=True)


def remove_unused(folder: Path) -> None:
    """Remove a folder and its content unless it is locked; ignore errors."""
    with suppress(OSError), locked(folder, alone=True) as unused:
        if unused:
            shutil.rmtree(folder, ignore_errors=True)


def remove_leftovers(folder: Path) -> None:
    """Remove the folders that `remove` moved aside but did not delete, because its process was killed."""
    name = re.compile(rf"\.{re.escape(folder.name)}-[0-9a-f]{{12}}")
    for aside in filter(lambda entry: name.fullmatch(entry.name), folder.parent.iterdir()):
        if find_stranger(aside, "manifest.json") is None:
            shutil.rmtree(aside, ignore_errors=True)


def find_stranger(folder: Path, manifest: str) -> Path | None:
    """Return a file or folder in `folder` that is no part of a version or its manifest; None if there is none."""
    for entry in folder.iterdir() if folder.exists() else ():
        parts = [entry]
        if _is_version(entry) and not entry.is_file():
            try:
                parts = list(entry.iterdir())
            except FileNotFoundError:  # another process has just removed it
                continue
        for part in parts:
            if not (_is_array(part) or TEMPORARY.fullmatch(part.name) or part == folder / manifest):
                return part
    return None


def _is_version(entry: Path) -> bool:
    return re.fullmatch("[1-9][0-9]{0,17}", entry.name) is not None


def _is_array(entry: Path) -> bool:
    return entry.suffix == ".npy" or entry.name == CHECKED


@contextmanager
def locked(folder: Path, *, alone: bool, is_new: bool = False) -> Iterator[bool]:
    """Lock a folder, exclusively or shared, until the context or the process ends.

    File systems without locks, and Windows, which cannot lock folders, take a folder to be unused, and so lockable
    exclusively, if it has not changed for an hour. Windows does not remove open files in any case.

    Args:
        folder: an existing folder.
        alone: whether to lock it exclusively.
        is_new: whether the caller has just made the folder, so that without locks it counts as unused.

    Yields:
        Whether it is locked and still in its place; False if another lock prevents that.
    """
    unused = time.time() - folder.stat().st_mtime > _ABANDONED_S
    if sys.platform == "win32":
        yield unused or is_new or not alone
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB if alone else fcntl.LOCK_SH)
            locked = _is_in_place(folder, descriptor)  # else another process removed it, and may have made it anew
        except BlockingIOError:
            locked = False
        except OSError:
            locked = unused or is_new or not alone
        yield locked
    finally:
        os.close(descriptor)


def _is_in_place(folder: Path, descriptor: int) -> bool:
    """Return whether `folder` still names the open folder."""
    try:
        return os.path.samestat(folder.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
