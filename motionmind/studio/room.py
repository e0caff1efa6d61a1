"""A private temporary folder that goes with its process: if that is killed, the next one removes the folder.

A file in the folder, locked as long as the process runs, tells a folder in use from one that a killed process left. A
process's number could not: systems use numbers again.
"""

from __future__ import annotations

import os
import re
import shutil
import stat
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from weakref import finalize

from motionmind.files import lock_alone

_PREFIX = "motionmind-studio-"
_NAME = re.compile(rf"{_PREFIX}[\w-]+")
_LOCK = "lock"
_MAX_TRIES = 10
_DAY_S = 86400.0


class Room:
    """A private temporary folder.

    Attributes:
        folder: the folder.
        close: removes it; the end of the process does so, too.
    """

    def __init__(self) -> None:
        """Make a folder, and remove the folders of killed processes; raise OSError if it cannot be made."""
        for _ in range(_MAX_TRIES):  # another process may take it for a leftover before it is locked
            self.folder = Path(tempfile.mkdtemp(prefix=_PREFIX))
            if (lock := _lock(self.folder, os.O_CREAT)) is not None:
                break
            shutil.rmtree(self.folder, ignore_errors=True)
        else:
            raise OSError(f"{self.folder}: cannot be locked")
        self.close = finalize(self, _remove, self.folder, lock)
        _remove_leftovers(self.folder)


def _lock(folder: Path, flags: int = 0) -> int | None:
    """Lock a folder's lock file and return its descriptor; None if it is missing or another process holds the lock."""
    try:
        descriptor = os.open(folder / _LOCK, os.O_RDWR | flags, 0o600)
    except OSError:
        return None
    with suppress(OSError):
        if lock_alone(descriptor) and os.path.samestat(os.fstat(descriptor), (folder / _LOCK).stat()):
            return descriptor
    os.close(descriptor)
    return None


def _remove(folder: Path, lock: int) -> None:
    """Remove a folder whose lock this process holds."""
    shutil.rmtree(folder, ignore_errors=True)
    os.close(lock)
    shutil.rmtree(folder, ignore_errors=True)  # the lock file, where open files cannot be removed


def _remove_leftovers(own: Path) -> None:
    """Remove this user's folders that no process holds."""
    with suppress(OSError):
        user = own.stat().st_uid
        for entry in os.scandir(own.parent):
            if not _NAME.fullmatch(entry.name) or entry.name == own.name:
                continue
            with suppress(OSError):
                found, folder = entry.stat(follow_symlinks=False), Path(entry.path)
                if not stat.S_ISDIR(found.st_mode) or found.st_uid != user:
                    continue
                if (lock := _lock(folder)) is not None:
                    _remove(folder, lock)
                elif not (folder / _LOCK).exists() and time.time() - found.st_mtime > _DAY_S:
                    shutil.rmtree(folder)  # made by 0.2, or never locked
