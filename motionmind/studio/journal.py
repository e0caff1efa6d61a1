"""A project's file: append-only JSON lines, each written to disk before its effect becomes visible.

    {"format": "motionmind studio", "version": 1, "title": "nutcracker", "corpus": "ballet", "corpora": {"ballet": "…"}}
    {"movement": "m-0123456789abcdef", "title": "solo.bvh", "motion": {…}}
    {"finding": "…", "abrupt": true, …}
    {"edit": {"edit": "delete", "block": "b1"}, "number": 7, "window": "w3f…"}
    {"undo": 7, "number": 8, "window": "w3f…"}

A process that is killed while it writes leaves an incomplete last line, which the next opening drops. A lock lets only
one process at a time open a project; it ends with the process.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

import msgspec

from motionmind.errors import FormatError, MotionMindError
from motionmind.files import lock_alone, read_bytes, replace_file, sync_folder

FORMAT, VERSION = "motionmind studio", 1
SUFFIX = ".motionmind"


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
        path: the file.
        count: the number of its lines.
        dropped: whether opening it dropped an incomplete last line.
    """

    def __init__(self, path: Path, descriptor: int, end: int, count: int, dropped: bool) -> None:
        self.path, self.count, self.dropped = path, count, dropped
        self._descriptor, self._end = descriptor, end

    @classmethod
    def create(cls, path: Path, **head: Any) -> Self:
        """Create a project's file; raise MotionMindError if the file exists or cannot be written.

        Args:
            path: the file.
            head: further fields of its first line.
        """
        line = msgspec.json.encode({"format": FORMAT, "version": VERSION, **head}) + b"\n"
        try:
            with path.open("xb") as file:
                file.write(line)
                file.flush()
                os.fsync(file.fileno())
            sync_folder(path.parent)
        except FileExistsError:
            raise MotionMindError(f"{path}: already exists") from None
        except OSError as error:
            with suppress(OSError):
                path.unlink()
            raise MotionMindError(f"{path}: cannot be written: {error.strerror or error}") from error
        return cls.open(path)

    @classmethod
    def open(cls, path: Path) -> Self:
        """Open and lock a project's file, and drop an incomplete last line.

        Raises:
            FormatError: it is not a project's file, or of another version.
            MotionMindError: it cannot be read, or another process has it open; the message gives that studio's address.
        """
        _check_head(path)
        try:
            descriptor = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
        except OSError as error:
            raise MotionMindError(f"{path}: cannot be opened: {error.strerror or error}") from error
        try:
            if not lock_alone(descriptor):
                raise MotionMindError(f"{path}: already open in a studio{_address_of(path)}; close it or work there")
            data = read_bytes(path)
            end, dropped = _whole(data), False
            if end == len(data) and not data.endswith(b"\n"):  # the last line lacks only its newline
                _write(descriptor, end, b"\n")
                data, end = data + b"\n", end + 1
            elif end < len(data):
                os.ftruncate(descriptor, end)
                os.fsync(descriptor)
                dropped = True
            return cls(path, descriptor, end, data.count(b"\n", 0, end), dropped)
        except BaseException:
            os.close(descriptor)
            raise

    def lines(self) -> Iterator[Line]:
        """Yield all lines."""
        data = self.read(0, self._end)
        start = 0
        for number in range(self.count):
            end = data.index(b"\n", start)
            yield Line(number, start, data[start:end])
            start = end + 1

    def read(self, start: int, length: int) -> bytes:
        """Read a range of bytes; raise MotionMindError if that fails."""
        try:
            with self.path.open("rb") as file:
                file.seek(start)
                return file.read(length)
        except OSError as error:
            raise MotionMindError(f"{self.path}: cannot be read: {error.strerror or error}") from error

    def append(self, record: Any) -> Line:
        """Append a record, sync it to disk and return its line.

        Raises:
            MotionMindError: it cannot be written; the file is unchanged.
        """
        data = msgspec.json.encode(record)
        try:
            os.ftruncate(self._descriptor, self._end)  # remove what a failed append may have left
            _write(self._descriptor, self._end, data + b"\n")
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._descriptor, self._end)
            reason = error.strerror or str(error)
            raise MotionMindError(f"not done: {self.path.name} cannot be written: {reason}") from error
        line = Line(self.count, self._end, data)
        self._end += len(data) + 1
        self.count += 1
        return line

    def tell(self, address: str) -> None:
        """Write down the address of this studio, for another one that tries to open the project."""
        with suppress(OSError):
            replace_file(_address_file(self.path), address.encode())

    def close(self) -> None:
        """Unlock and close the file, unless it is closed."""
        if self._descriptor >= 0:
            with suppress(OSError):
                _address_file(self.path).unlink()
            os.close(self._descriptor)
            self._descriptor = -1


def _write(descriptor: int, start: int, data: bytes) -> None:
    os.lseek(descriptor, start, os.SEEK_SET)
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]
    os.fsync(descriptor)


def _whole(data: bytes) -> int:
    """Return the number of bytes up to the end of the last complete line."""
    start = data.rfind(b"\n", 0, len(data) - 1) + 1
    try:
        msgspec.json.decode(data[start:], type=dict[str, msgspec.Raw])
    except ValueError:
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
        raise FormatError(f"not a studio project: its first line does not say {FORMAT!r}", path=path)
    if head.get("version") != VERSION:
        raise FormatError(f"is version {head.get('version')!r} of a project; version {VERSION} can be read", path=path)


def _address_file(path: Path) -> Path:
    return path.with_name(f".{path.name}.address")


def _address_of(path: Path) -> str:
    """Return " at ADDRESS" for the studio that has a project open; "" if its address is unknown."""
    try:
        return f" at {_address_file(path).read_text('ascii')[:100]}"
    except (OSError, ValueError):
        return ""
