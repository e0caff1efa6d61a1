"""A project's file: append-only JSON lines, each written to disk before its effect becomes visible.

    {"format": "motionmind studio", "version": 1, "title": "nutcracker", "corpus": "ballet", "corpora": {"ballet": "…"}}
    {"movement": "m-0123456789abcdef", "title": "solo.bvh", "motion": {…}}
    {"finding": "…", "abrupt": true, …}
    {"edit": {"edit": "delete", "block": "b1"}, "number": 7, "window": "w3f…"}
    {"undo": 7, "number": 8, "window": "w3f…"}

A process that is killed while it writes leaves an incomplete last line, which the next opening drops. A lock lets only
one process at a time open a project; it ends with the process.

The process keeps all lines in memory. If the file is deleted, moved away or changed by another program, it writes them
to a new file, and never over a file that is not its own.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple, Self

import msgspec

from motionmind.display import displayed_path
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import create_file, lock_alone, make_folder, read_bytes

FORMAT, VERSION = "motionmind studio", 1
SUFFIX = ".motionmind"
_OPEN = os.O_RDWR | getattr(os, "O_BINARY", 0)


class DamagedError(FormatError):
    """A line of a project's file is damaged.

    Attributes:
        number: the number of the line, from 0.
    """

    def __init__(self, message: str, path: Path, number: int) -> None:
        super().__init__(message, path=path, line=number + 1)
        self.number = number


class OpenElsewhereError(MotionMindError):
    """Another studio has the project open."""


class Line(NamedTuple):
    """A line of the file.

    Attributes:
        number: its number, from 0.
        start: its first byte.
        data: its bytes, without the end of line.
    """

    number: int
    start: int
    data: bytes


class Journal:
    """A project's file, open and locked.

    Attributes:
        path: the file; it changes if another program takes its place.
        count: the number of its lines.
        dropped: whether opening it dropped an incomplete last line.
        told: called with a notice when the lines continue in a new file.
    """

    def __init__(self, path: Path, descriptor: int, data: bytes) -> None:
        """Take over an open and locked file with these bytes; `mend` it before the first append."""
        end = _whole(data)
        self.path, self.dropped = path, end < len(data)
        self.told: Callable[[str], None] = _nobody
        self._descriptor, self._seen = descriptor, _stamp(os.fstat(descriptor))
        self._data = bytearray(data[:end])
        self._written = end
        if self._data and not self._data.endswith(b"\n"):  # the last line lacks only its newline
            self._data += b"\n"
        self.count = self._data.count(b"\n")

    @classmethod
    def create(cls, path: Path, **head: Any) -> Self:
        """Create a project's file; raise MotionMindError if the file exists or cannot be written.

        Args:
            path: the file.
            head: further fields of its first line.
        """
        return cls.create_from(path, head_line(**head))

    @classmethod
    def create_from(cls, path: Path, data: bytes) -> Self:
        """Create a project's file with these lines; raise the errors of `create`."""
        try:
            create_file(Path(os.path.realpath(path)), data)
        except FileExistsError:
            raise MotionMindError(f"{path}: already exists") from None
        except OSError as error:
            raise MotionMindError(f"{path}: cannot be written: {error.strerror or error}") from error
        return cls.open(path)

    @classmethod
    def open(cls, path: Path) -> Self:
        """Open and lock a project's file, without changing it.

        Raises:
            DamagedError: its first line is damaged, or it is not a project's file.
            FormatError: it is of another version.
            OpenElsewhereError: another process has it open.
            MotionMindError: it cannot be read.
        """
        _check_head(path)
        try:
            descriptor = os.open(path, _OPEN)
        except OSError as error:
            raise MotionMindError(f"{path}: cannot be opened: {error.strerror or error}") from error
        try:
            if not lock_alone(descriptor):
                raise OpenElsewhereError(
                    f"{path}: already open in a studio; close it, or open the address that its terminal shows"
                )
            return cls(path, descriptor, read_bytes(path))
        except BaseException:
            os.close(descriptor)
            raise

    def mend(self) -> None:
        """Remove an incomplete last line from the file, or complete its end; raise MotionMindError if that fails."""
        if self.dropped or self._written < len(self._data):
            try:
                self._write()
            except OSError as error:
                raise MotionMindError(f"{self.path}: cannot be written: {error.strerror or error}") from error

    def lines(self) -> Iterator[Line]:
        """Yield all lines."""
        start = 0
        for number in range(self.count):
            end = self._data.index(b"\n", start)
            yield Line(number, start, bytes(self._data[start:end]))
            start = end + 1

    @property
    def saved(self) -> float:
        """The time at which the file was last written, in seconds since 1970."""
        return self._seen[-1] / 1e9

    def read(self, start: int, length: int) -> bytes:
        """Return a range of bytes."""
        return bytes(self._data[start : start + length])

    def append(self, record: Any) -> Line:
        """Append a record, sync it to disk and return its line.

        Raises:
            MotionMindError: it cannot be written; the file is unchanged.
        """
        data = msgspec.json.encode(record)
        line = Line(self.count, len(self._data), data)
        try:
            self._find()
            self._data += data + b"\n"
            try:
                self._write()
            except BaseException:
                del self._data[line.start :]
                with suppress(OSError):
                    os.ftruncate(self._descriptor, self._written)
                with suppress(OSError):
                    self._seen = _stamp(os.fstat(self._descriptor))
                raise
        except OSError as error:
            reason = error.strerror or str(error)
            raise MotionMindError(f"not done: {self.path.name} cannot be written: {reason}") from error
        self.count += 1
        return line

    def close(self) -> None:
        """Unlock and close the file, unless it is closed; keep the lines beside a file that has taken its place."""
        if self._descriptor >= 0:
            try:
                if self.path.exists():  # a deleted one was complete
                    self._find()
            except OSError as error:
                self.told(f"{displayed_path(self.path)} cannot be written: {error.strerror or error}")
            os.close(self._descriptor)
            self._descriptor = -1

    def _write(self) -> None:
        """Write the lines that the file lacks, and sync it."""
        os.ftruncate(self._descriptor, self._written)  # remove what a failed append may have left
        os.lseek(self._descriptor, self._written, os.SEEK_SET)
        left = bytes(self._data[self._written :])
        while left:
            left = left[os.write(self._descriptor, left) :]
        os.fsync(self._descriptor)
        self._written, self._seen = len(self._data), _stamp(os.fstat(self._descriptor))

    def _find(self) -> None:
        """Continue in a new file if this one is gone or another program has changed it; OSError if that fails."""
        try:
            status = self.path.stat()
        except (FileNotFoundError, NotADirectoryError):
            self._continue_at(self.path)
            self.told(f"{displayed_path(self.path)} was deleted or moved away: written anew, with all edits")
            return
        if _stamp(status) == self._seen:
            return
        if self._holds_all(status):
            if (status.st_dev, status.st_ino) == self._seen[:2]:
                self._seen = _stamp(status)
                return
            descriptor = os.open(self.path, _OPEN)
            if lock_alone(descriptor):
                self._take(descriptor)
                return
            os.close(descriptor)  # a copy, open in another studio
        other = self.path
        for path in beside(other):
            with suppress(FileExistsError):
                self._continue_at(path)
                break
        self.told(
            f"{displayed_path(other)} was changed by another program, and is left as it is: "
            f"your piece, with all edits, continues in {displayed_path(self.path)}"
        )

    def _holds_all(self, status: os.stat_result) -> bool:
        """Return whether the file at the path has exactly the lines of this one."""
        is_alike = stat.S_ISREG(status.st_mode) and status.st_size == len(self._data)
        return is_alike and self.path.read_bytes() == self._data

    def _continue_at(self, path: Path) -> None:
        """Write all lines to a new file and continue there; FileExistsError if there is one."""
        place = Path(os.path.realpath(path))
        make_folder(place.parent)
        create_file(place, bytes(self._data))
        try:
            descriptor = os.open(place, _OPEN)
        except OSError:
            with suppress(OSError):
                place.unlink()
            raise
        lock_alone(descriptor)
        self._take(descriptor)
        self.path, self._written = path, len(self._data)

    def _take(self, descriptor: int) -> None:
        """Take over a file with all lines, and close the one before."""
        os.close(self._descriptor)
        self._descriptor, self._seen = descriptor, _stamp(os.fstat(descriptor))


def head_line(**head: Any) -> bytes:
    """Return the first line of a project's file, with further fields."""
    return msgspec.json.encode({"format": FORMAT, "version": VERSION, **head}) + b"\n"


def beside(path: Path) -> Iterator[Path]:
    """Yield names for a copy of a project's file: "dance-2.motionmind", "dance-3.motionmind", and so on."""
    return (path.with_name(f"{path.stem}-{number}{SUFFIX}") for number in count(2))


def _nobody(_: str) -> None:
    """Ignore a notice."""


def _stamp(status: os.stat_result) -> tuple[int, ...]:
    """Return values that change with a file or its content."""
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns


def _whole(data: bytes) -> int:
    """Return the number of bytes up to the end of the last complete line: one that ends, or lacks only its newline."""
    start = data.rfind(b"\n") + 1
    try:
        msgspec.json.decode(data[start:], type=dict[str, msgspec.Raw])
    except (ValueError, RecursionError):
        return start
    return len(data)


def _check_head(path: Path) -> None:
    try:
        with path.open("rb") as file:
            first = file.readline(2**20)
    except OSError as error:
        raise MotionMindError(f"{path}: cannot be read: {error.strerror or error}") from error
    try:
        head = msgspec.json.decode(first, type=dict[str, Any])
    except (ValueError, RecursionError):
        head = {}
    if head.get("format") != FORMAT:
        raise DamagedError(f"not a studio project: its first line does not say {FORMAT!r}", path, 0)
    if head.get("version") != VERSION:
        raise FormatError(f"is version {head.get('version')!r} of a project; version {VERSION} can be read", path=path)
