"""Folders that no other user can change, for files that run or are trusted when they are read."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

if sys.platform != "win32":
    import grp
    import pwd


def is_private(folder: Path) -> bool:
    """Return whether a folder is the user's own, and no other user can write to it or replace it; True on Windows."""
    if sys.platform == "win32":
        return True
    try:
        found = folder.lstat()
    except OSError:
        return False
    is_own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not _is_shared(found)
    return is_own and is_fixed(folder)


def is_fixed(folder: Path) -> bool:
    """Return whether no other user can replace a folder, or could if it is still to be made; True on Windows.

    The user or the system must own each folder above. Others may write to none, except where only owners can remove
    entries, as in `/tmp`.
    """
    if sys.platform == "win32":
        return True
    owners = {os.getuid(), 0, Path("/").stat().st_uid}  # in a sandbox, the system may have another number
    for above in folder.parents:
        with suppress(FileNotFoundError, NotADirectoryError):
            found = above.lstat()
            if found.st_uid not in owners or (_is_shared(found) and not found.st_mode & stat.S_ISVTX):
                return False
    return True


def _is_shared(found: os.stat_result) -> bool:
    """Return whether another user can write to a folder."""
    return bool(found.st_mode & stat.S_IWOTH or (found.st_mode & stat.S_IWGRP and not _is_own(found.st_gid)))


def _is_own(number: int) -> bool:
    """Return whether a group is the user's own, without other members, as many systems make it."""
    try:
        user, group = pwd.getpwuid(os.getuid()), grp.getgrgid(number)
    except KeyError:
        return False
    return (number, group.gr_name) == (user.pw_gid, user.pw_name) and {*group.gr_mem} <= {user.pw_name}


@cache
def temporary_folder() -> Path:
    """Return a private folder among the system's temporary ones, if possible the same each time.

    Raises:
        OSError: none can be made.
    """
    parent = Path(os.path.realpath(tempfile.gettempdir()))
    folder = parent / f"motionmind-{os.getuid() if sys.platform != 'win32' else 0}"
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    if not is_private(folder):
        folder = Path(tempfile.mkdtemp(prefix="motionmind-"))
    if not is_private(folder):
        raise PermissionError(f"{parent}: others could replace folders in it")
    return folder


def read_own(file: Path) -> bytes:
    """Return the bytes of a file that only this user could write; raise OSError if it is another.

    The check is of the opened file, which no link or later change can replace.
    """
    with open(file, "rb", opener=_open_own) as opened:
        return opened.read()


def _open_own(path: str, flags: int) -> int:
    if sys.platform == "win32":
        return os.open(path, flags)
    descriptor = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK)  # a pipe would wait for a writer
    found = os.fstat(descriptor)
    is_shared = found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if found.st_uid != os.getuid() or is_shared or not stat.S_ISREG(found.st_mode):
        os.close(descriptor)
        raise PermissionError(f"{path}: others could have written it")
    return descriptor
