"""MotionMind's errors and its warning, and helpers that word their messages.

Every message says what was wrong, where (file, line, joint, frame), and what would be right.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any


class MotionMindError(Exception):
    """Root of all errors caused by bad input; the command line prints it in one line and exits with code 2."""


class FormatError(MotionMindError):
    """A file that cannot be read as the format it claims to be.

    Args:
        message: what was wrong, and what would be right.
        path: the file, put before the message.
        line: the line in that file, counted from 1.
    """

    def __init__(self, message: str, *, path: object | None = None, line: int | None = None) -> None:
        where = "" if path is None else f"{path}: " if line is None else f"{path}:{line}: "
        super().__init__(f"{where}{message}")


class SkeletonError(MotionMindError):
    """A skeleton that is not a tree, or movement on a skeleton other than the expected one."""


class CorpusError(MotionMindError):
    """A corpus that does not exist, cannot be read, or holds nothing to learn from."""


class NoPathError(MotionMindError):
    """No sequence of moves leads from A to B under the given constraints; the message is the diagnosis.

    Args:
        message: the diagnosis in words.
        diagnosis: the same as plain values, ready for JSON, if joints move on their own; None otherwise.
    """

    def __init__(self, message: str, diagnosis: dict[str, Any] | None = None) -> None:
        super().__init__(message)
        self.diagnosis = diagnosis


class InfeasibleError(MotionMindError):
    """No path satisfies the problem that the search was given."""


class MotionMindWarning(UserWarning):
    """Input that was repaired on reading (a quaternion normalised, a frame count corrected), and where."""


def quoted(text: str, most: int = 40) -> str:
    """Quote `text` for a message; leave out its middle if it has more than `most` characters."""
    return repr(text if len(text) <= most else f"{text[: most - 13]}...{text[-10:]}")


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return '; did you mean X?' for the known name most similar to `name`, or '' if none is similar."""
    close = get_close_matches(name, list(known), n=1)
    return f"; did you mean {close[0]}?" if close else ""


def enumerated(names: Iterable[str], most: int = 5) -> str:
    """Join names with commas for a message: the first `most`, then how many more there are."""
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
