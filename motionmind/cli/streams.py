"""Standard output and standard error, wrapped so that failing writes do not end the program."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from motionmind.display import escaped


class _Escaping:
    """Standard output, with control characters in names from files escaped."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write text with control characters escaped; drop it after the reader has closed the pipe."""
        try:
            self._stream.write(escaped(text))
        except BrokenPipeError:
            _silence(self._stream)
        except io.UnsupportedOperation as error:
            raise OSError(errno.EBADF, "standard output is closed") from error
        return len(text)

    def flush(self) -> None:
        """Flush, unless the reader has closed the pipe."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            _silence(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class _Forgiving:
    """A stream that drops text on failure: a closed terminal or a full disk must not end a search."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write text, or drop it on failure."""
        try:
            return self._stream.write(text)
        except (OSError, ValueError):  # ValueError: the stream is closed
            _silence(self._stream)
            return len(text)

    def flush(self) -> None:
        """Flush, ignoring failure."""
        try:
            self._stream.flush()
        except (OSError, ValueError):
            _silence(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _silence(stream: TextIO) -> None:
    """Redirect buffered and further text to the null device, or Python would fail at exit."""
    with suppress(OSError, ValueError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)


@contextmanager
def forgiving() -> Iterator[None]:
    """Make writing to standard error never fail, and escape control characters on standard output.

    Bytes of names that are not UTF-8 are escaped, too.
    """
    # A closed stream is opened anew, or a file of ours would get its descriptor, and the output of libraries.
    if sys.stdout is None:
        sys.stdout = open(os.devnull, encoding="utf-8")  # noqa: PTH123, SIM115 - for reading, so that writing fails
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - it stays open
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    given = sys.stdout, sys.stderr
    sys.stderr = _Forgiving(sys.stderr)
    sys.stdout = _Escaping(sys.stdout)
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):  # a full disk, which Python reports again at exit
                stream.flush()
        sys.stdout, sys.stderr = given
