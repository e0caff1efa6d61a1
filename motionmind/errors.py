"""MotionMind's errors and its warning, and helpers that word their messages.

Every message says what was wrong, where (file, line, joint, frame), and what would be right. Messages quote names from
files; each is escaped where the error is made, so that it is one line and safe to log.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from typing import Any

from motionmind.display import one_line, printable

_MAX_WORD_CHARS = 64  # of words to compare


class MotionMindError(Exception):
    """Root of all errors caused by bad input; the command line prints it in one line and exits with code 2.

    Args:
        message: the fault; control characters in it are escaped, and long words shortened.

    >>> from motionmind import Engine, MotionMindError
    >>> try:
    ...     Engine.load("opera")
    ... except MotionMindError as error:
    ...     print(str(error).partition(";")[0])
    no corpus 'opera'
    """

    def __init__(self, message: str = "") -> None:
        super().__init__(one_line(message))


class WrongTypeError(MotionMindError, TypeError):
    """A value of the wrong type, or an unknown option.

    >>> from motionmind import write_motion
    >>> write_motion("clip.bvh", "clip.glb")
    Traceback (most recent call last):
    motionmind.errors.WrongTypeError: motion must be a Motion, not 'clip.glb'
    """


class FormatError(MotionMindError):
    """A file that cannot be read as the format it claims to be.

    Args:
        message: the fault, and what would be right.
        path: the file, put before the message.
        line: the line in that file, counted from 1.

    >>> from motionmind import read_motion
    >>> read_motion("nowhere.bvh")
    Traceback (most recent call last):
    motionmind.errors.FormatError: nowhere.bvh: cannot be read: there is no such file or folder
    """

    def __init__(self, message: str, *, path: object | None = None, line: int | None = None) -> None:
        where = "" if path is None else f"{path}: " if line is None else f"{path}:{line}: "
        super().__init__(f"{where}{message}".replace("\n", "\\n"))  # one line, whatever names a message quotes


class SkeletonError(MotionMindError):
    """A skeleton that is not a tree, or movement on a skeleton other than the expected one.

    >>> from motionmind import human23
    >>> human23().index("tail")
    Traceback (most recent call last):
    motionmind.errors.SkeletonError: no joint 'tail' in human23; ...
    """


class CorpusError(MotionMindError):
    """A corpus that does not exist, cannot be read, or holds nothing to learn from.

    >>> from motionmind import Engine
    >>> Engine.load("opera")
    Traceback (most recent call last):
    motionmind.errors.CorpusError: no corpus 'opera'; there are ballet, hands, karate, ...
    """


class NoPathError(MotionMindError):
    """No sequence of moves leads from A to B under the given constraints; the message is the diagnosis.

    Args:
        message: the diagnosis in words.
        diagnosis: the same as plain values, ready for JSON, if joints move on their own; None otherwise.

    >>> from motionmind import Engine
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> engine.tween(motion.posture(0), motion.posture(9), moves=1, strict=True)
    Traceback (most recent call last):
    motionmind.errors.NoPathError: no path from A to B in at most 1 move ...
    """

    def __init__(self, message: str, diagnosis: dict[str, Any] | None = None) -> None:
        Exception.__init__(self, printable(message))  # which keeps the lines of the diagnosis
        self.diagnosis = diagnosis


class InfeasibleError(MotionMindError):
    """No path satisfies the problem that the search was given."""


class MotionMindWarning(UserWarning):
    """Input that was repaired on reading (a quaternion normalised, a frame count corrected), and where.

    >>> import warnings
    >>> from motionmind import MotionMindWarning, read_motion
    >>> with warnings.catch_warnings():  # refuse files that need mending
    ...     warnings.simplefilter("error", MotionMindWarning)
    ...     read_motion("nowhere.bvh")
    Traceback (most recent call last):
    motionmind.errors.FormatError: nowhere.bvh: cannot be read: there is no such file or folder
    """

    def __init__(self, message: str = "") -> None:
        super().__init__(one_line(message))


def quoted(text: str, most: int = 40) -> str:
    """Quote `text` for a message; leave out its middle if it has more than `most` characters."""
    return repr(text if len(text) <= most else f"{text[: most - 13]}...{text[-10:]}")


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return '; did you mean X?' for the known name most similar to `name`, or '' if none is similar."""
    # A comparison takes the product of the lengths: skip long words, and compare 2,000 words at most.
    comparable = (word for word in known if len(word) <= _MAX_WORD_CHARS)
    near = list(islice(comparable, 2000)) if len(name) <= _MAX_WORD_CHARS else []
    close = get_close_matches(name, near, n=1)
    return f"; did you mean {close[0]}?" if close else ""


def suggestion(name: str, known: Iterable[str], otherwise: str = "there are", most: int = 60) -> str:
    """Return '; did you mean X?', or else the known names: '; there are X, Y', the first `most` of them.

    Args:
        name: the unknown name.
        known: the known names.
        otherwise: the words before them.
        most: number of names to list.
    """
    known = list(known)
    return did_you_mean(name, known) or f"; {otherwise} {enumerated(known, most) or 'none'}"


def enumerated(names: Iterable[str], most: int = 5) -> str:
    """Join names with commas for a message: the first `most`, then how many more there are."""
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
