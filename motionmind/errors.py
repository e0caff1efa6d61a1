"""The errors that MotionMind raises on purpose, and the warning it gives when it mends something.

Every message says what was wrong, where (file, line, joint, frame) and what would be right.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any


class MotionMindError(Exception):
    """Root of all errors that bad input can cause; the command line prints it in one line, exit code 2."""


class FormatError(MotionMindError):
    """A file that cannot be read as what it claims to be."""

    def __init__(self, message: str, *, path: object | None = None, line: int | None = None) -> None:
        where = "" if path is None else f"{path}: " if line is None else f"{path}:{line}: "
        super().__init__(f"{where}{message}")


class SkeletonError(MotionMindError):
    """A skeleton that is no tree, or movement on another skeleton than the one that was expected."""


class CorpusError(MotionMindError):
    """A corpus that does not exist, holds nothing to learn from, or cannot be read."""


class NoPathError(MotionMindError):
    """No sequence of moves joins A to B under the rules that were asked for; the message is the diagnosis.

    `diagnosis` is the same as plain values for JSON, where joints move on their own.
    """

    def __init__(self, message: str, diagnosis: dict[str, Any] | None = None) -> None:
        super().__init__(message)
        self.diagnosis = diagnosis


class MotionMindWarning(UserWarning):
    """Something was mended while reading (a quaternion normalised, a header count corrected): says what, where."""


def quoted(text: str, most: int = 40) -> str:
    """`text` in quotes for a message, its middle left out where it is long."""
    return repr(text if len(text) <= most else f"{text[: most - 13]}...{text[-10:]}")


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """'; did you mean X?' for the known name nearest to `name`, or nothing where none is near."""
    close = get_close_matches(name, list(known), n=1)
    return f"; did you mean {close[0]}?" if close else ""


def enumerated(names: Iterable[str], most: int = 5) -> str:
    """Names in a row for a message: the first few and how many more."""
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
