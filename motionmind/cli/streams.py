"""Standard output and standard error, wrapped so that neither can stop the work."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from motionmind.display import escaped


class _Escaping:
    """Standard output, on which names from files stand."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write text with what a terminal would act on as escapes; drop it if its reader has gone away."""
        try:
            self._stream.write(escaped(text))
        except BrokenPipeError:
            _silence(self._stream)
        return len(text)

    def flush(self) -> None:
        """Flush, unless the reader has gone away."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            _silence(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class _Forgiving:
    """A stream that drops what it cannot write: nobody reads a closed terminal, and a full disk ends no search."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write text, or drop it on failure."""
        try:
            return self._stream.write(text)
        except (OSError, ValueError):  # ValueError: it was closed
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
    """Let what is buffered and what is still written go nowhere, or Python would fail with it when it ends."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


@contextmanager
def forgiving() -> Iterator[None]:
    """Let writing to standard error never fail, and standard output get no character that a terminal acts on.

    Names that are no UTF-8 are printed with their bytes escaped.
    """
    if sys.stderr is None:  # closed; a file of ours would take its number, and get what libraries print
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - it stays open
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    given = sys.stdout, sys.stderr
    sys.stderr = _Forgiving(sys.stderr)
    if sys.stdout is not None:
        sys.stdout = _Escaping(sys.stdout)
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):  # a full disk, which Python says again when it ends
                if stream is not None:
                    stream.flush()
        sys.stdout, sys.stderr = given
