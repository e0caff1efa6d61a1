"""The key by which a studio and the pages that it let in know each other after a restart.

A cookie that outlives its process would not do: browsers send it to any program of another user that takes the port
meanwhile. This key is never sent. Each side proves that it has the key by a hash (HMAC) of two fresh numbers and of the
studio's URL, the studio first; so a program that passes messages on between them, at another port, convinces neither.

The key is in a file that only its user can read, with the port, which the studio takes again. Pages hold it in memory
alone: what a browser stores for a page, any other program at the same port could read.

The same file holds the key of the look-only link, which stays valid until the owner replaces it.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
import socket
import stat
import time
from collections import OrderedDict
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal
from urllib.parse import urlsplit

import msgspec

from motionmind.files import make_folder

_LASTS_S = 7 * 86400.0
_KEPT_S = 180 * 86400.0
_ANSWER_S = 30.0  # for a page to answer
_MAX_ASKED = 64
_MAX_BYTES = 4096
_N_KEY_CHARS = 43  # 32 bytes in base64
# All addresses of this computer: their family, an address of nobody elsewhere, and one that is always there.
_PROBES = {
    "0.0.0.0": (socket.AF_INET, "192.0.2.1", "127.0.0.1"),
    "::": (socket.AF_INET6, "2001:db8::1", "::1"),
}
_NOFOLLOW = getattr(os, "O_NOFOLLOW", 0)


class _Record(msgspec.Struct):
    """Contents of the file: the key, its time (seconds since 1970), the studio's URL, the project's file, and the key
    of its look-only link."""

    key: str
    made: float
    url: str
    project: str = ""
    looking: str = ""


class Renewal:
    """The key of a project's studio.

    Attributes:
        key: the key.
    """

    def __init__(self, project: Path, url: str, home: Path) -> None:
        """Take the key of the studio before, or make one.

        Args:
            project: the project's file.
            url: the URL of this studio, without a token.
            home: the folder of the user's data.
        """
        self._file, self._url = _KeyFile(project, home), url
        self._asked: OrderedDict[str, tuple[str, float]] = OrderedDict()  # by own number: the page's, and the time
        before = self._file.read()
        self.key, made = (before.key, before.made) if before and _lasts(before) else _new()
        self._file.write(key=self.key, made=made, url=url)

    def replace(self) -> None:
        """Make another key: somebody else may know this one."""
        self.key, made = _new()
        self._asked.clear()
        self._file.write(key=self.key, made=made)

    def prove(self, number: str) -> tuple[str, str]:
        """Return a number of one's own, and the proof that goes with both.

        Args:
            number: the page's number.
        """
        own = secrets.token_urlsafe(32)
        self._asked[own] = number, time.monotonic()
        while len(self._asked) > _MAX_ASKED:
            self._asked.popitem(last=False)
        return own, proof(self.key, "studio", self._url, number, own)

    def admits(self, own: str, given: str) -> bool:
        """Return whether a page has the key; each number counts once.

        Args:
            own: the number that `prove` returned.
            given: the page's proof.
        """
        number, asked = self._asked.pop(own, ("", -_ANSWER_S))
        right = proof(self.key, "page", self._url, number, own)
        in_time = time.monotonic() - asked < _ANSWER_S
        return hmac.compare_digest(given.encode("utf-8", "replace"), right.encode()) and in_time


class Link:
    """A project's look-only link.

    Attributes:
        key: its key.
    """

    def __init__(self, project: Path, url: str, home: Path) -> None:
        """Take the key of the studio before, or make one.

        Args:
            project: the project's file.
            url: the URL of this studio, without a token.
            home: the folder of the user's data.
        """
        self._file, self._url = _KeyFile(project, home), url
        before = self._file.read()
        self.key = before.looking if before and len(before.looking) >= _N_KEY_CHARS else secrets.token_urlsafe(32)
        self._file.write(looking=self.key, url=url)

    @property
    def address(self) -> str:
        """The link, with an address that other computers reach."""
        return f"{_outward(self._url)}/#look={self.key}"

    def replace(self) -> None:
        """Make another key; the one before counts no more."""
        self.key = secrets.token_urlsafe(32)
        self._file.write(looking=self.key)


class _KeyFile:
    """The file of a project's keys, which only its user can read."""

    def __init__(self, project: Path, home: Path) -> None:
        self._path, self._project = _file_of(project, home), os.path.realpath(project)

    def read(self) -> _Record | None:
        return _read(self._path)

    def write(self, **changes: Any) -> None:
        """Change some fields; if the file cannot be written, pages need the URL after a restart."""
        before = self.read() or _Record("", 0.0, "")
        data = msgspec.json.encode(msgspec.structs.replace(before, project=self._project, **changes))
        temporary = self._path.with_suffix(f".{secrets.token_hex(8)}")
        with suppress(OSError):
            make_folder(self._path.parent)
            _remove_old(self._path.parent)
            descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NOFOLLOW, 0o600)
            try:
                with os.fdopen(descriptor, "wb") as file:
                    file.write(data)
                temporary.replace(self._path)
            except BaseException:
                temporary.unlink()
                raise


def proof(key: str, side: Literal["studio", "page"], url: str, number: str, own: str) -> str:
    """Return what proves that a side has the key.

    Args:
        key: the key.
        side: the side.
        url: the URL of the studio.
        number: the page's number.
        own: the studio's number.
    """
    return hmac.new(key.encode(), f"{side} {url} {number} {own}".encode("utf-8", "replace"), "sha256").hexdigest()


def known(project: Path, home: Path) -> tuple[str, str] | None:
    """Return the URL and the key of a project's latest studio; None if they are unknown.

    Args:
        project: the project's file.
        home: the folder of the user's data.
    """
    found = _read(_file_of(project, home))
    return (found.url, found.key) if found and _lasts(found) else None


def last_url(project: Path, home: Path) -> str:
    """Return the URL of a project's latest studio; "" if it is unknown.

    Args:
        project: the project's file.
        home: the folder of the user's data.
    """
    found = _read(_file_of(project, home))
    return found.url if found else ""


def recent(home: Path) -> list[tuple[Path, float]]:
    """Return the projects opened last that still exist, with the times in seconds since 1970; the latest is first.

    Args:
        home: the folder of the user's data.
    """
    out: list[tuple[Path, float]] = []
    with suppress(OSError):
        for entry in os.scandir(home / "studio"):
            with suppress(OSError, ValueError):
                record = _read(Path(entry.path))
                if record and record.project and Path(record.project).is_file():
                    out.append((Path(record.project), entry.stat(follow_symlinks=False).st_mtime))
    return sorted(out, key=lambda one: one[1], reverse=True)


def _outward(url: str) -> str:
    """Return a URL with this computer's address in its network, if it stands for all of its addresses."""
    parts = urlsplit(url)
    if parts.hostname not in _PROBES:
        return url
    family, far, near = _PROBES[parts.hostname]
    with socket.socket(family, socket.SOCK_DGRAM) as probe, suppress(OSError):
        probe.connect((far, 9))  # sends nothing
        near = probe.getsockname()[0]
    return f"http://{f'[{near}]' if ':' in near else near}:{parts.port}"


def _new() -> tuple[str, float]:
    return secrets.token_urlsafe(32), time.time()


def _file_of(project: Path, home: Path) -> Path:
    name = hashlib.sha256(os.fsencode(os.path.realpath(project))).hexdigest()[:32]
    return home / "studio" / f"{name}.json"


def _read(file: Path) -> _Record | None:
    """Return what a file holds; None if it is missing or damaged, or others could read or have written it."""
    try:
        descriptor = os.open(file, os.O_RDONLY | _NOFOLLOW)
        with os.fdopen(descriptor, "rb") as opened:
            status = os.fstat(descriptor)
            data = opened.read(_MAX_BYTES) if stat.S_ISREG(status.st_mode) else b""
        if os.name == "posix" and (status.st_uid != os.geteuid() or status.st_mode & 0o077):
            return None
        return msgspec.json.decode(data, type=_Record)
    except (OSError, ValueError, RecursionError):
        return None


def _lasts(record: _Record) -> bool:
    """Return whether a key still counts."""
    return 0.0 <= time.time() - record.made < _LASTS_S and len(record.key) >= _N_KEY_CHARS


def _remove_old(folder: Path) -> None:
    """Remove files of projects not opened for long, and leftovers of killed processes."""
    for entry in os.scandir(folder):
        with suppress(OSError):
            if time.time() - entry.stat(follow_symlinks=False).st_mtime > _KEPT_S:
                Path(entry.path).unlink()
