"""Remember the notes printed about each file, so that later commands do not repeat them."""

from __future__ import annotations

import hashlib
import stat
from contextlib import suppress
from functools import cached_property
from pathlib import Path

from motionmind.files import make_folder, replace_file

_N_REMEMBERED = 20_000  # notes, the newest ones: 340 kB


class Noted:
    """The notes about files that commands printed, in the user's cache.

    A changed file counts as a new one. If the cache cannot be read or written, all notes are new.
    """

    def __init__(self) -> None:
        self._added: dict[str, None] = {}

    @cached_property
    def _place(self) -> Path:
        from motionmind.corpus import cache  # slow: imports numpy

        return cache.cache_folder("notes") / "printed"

    @cached_property
    def _known(self) -> dict[str, None]:
        with suppress(OSError, ValueError):
            return dict.fromkeys(self._place.read_text("ascii").split())
        return {}

    def is_new(self, path: Path, note: str) -> bool:
        """Return whether a note about a file is new, and remember it; a note about a pipe always is."""
        key = _key(path, note)
        if key in self._known or key in self._added:
            return False
        if key:
            self._added[key] = None
        return True

    def save(self) -> None:
        """Write the notes that were new, and drop the oldest if there are too many."""
        if self._added:
            with suppress(OSError):
                make_folder(self._place.parent)
                kept = [*self._known, *self._added][-_N_REMEMBERED:]
                replace_file(self._place, "\n".join(kept).encode("ascii"))


def _key(path: Path, note: str) -> str:
    """Return a hash of a note and of a regular file's path, size and time of change; "" for other files."""
    with suppress(OSError, ValueError):
        status = path.stat()
        if stat.S_ISREG(status.st_mode):
            identity = f"{path.absolute()}\0{status.st_size}\0{status.st_mtime_ns}\0{note}"
            return hashlib.sha256(identity.encode("utf-8", "surrogateescape")).hexdigest()[:16]
    return ""
