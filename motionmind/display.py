"""Foreign text, such as names and titles that files hold, as it is displayed: in messages, tables, pages and pictures.

Files and reports keep it whole, escaped as their formats do.
"""

from __future__ import annotations

import os
import re

LONGEST_NAME = 60  # characters; the longest joint of common rigs has half as many
_LONGEST_PATH = 300  # which is of use only whole
_LONGEST_LINE = 2000

# Control characters but ends of lines and tabs; characters that turn the direction of text or end lines; and halves of
# characters, which no output can encode.
_UNSAFE = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]"
)
_LONG_WORDS = re.compile(rf"\S{{{_LONGEST_PATH},}}")
_LONG_LINES = re.compile(rf"[^\n]{{{_LONGEST_LINE},}}")


def displayed(name: str, most: int = LONGEST_NAME) -> str:
    """Return a name as it is displayed: in one line that a terminal or a page shows and does not act on.

    Unsafe characters are escaped as JSON escapes them; the middle is left out if there are more than `most` characters.

    >>> from motionmind.display import displayed
    >>> displayed("left\\x1b[31m hip")
    'left\\\\u001b[31m hip'
    """
    # Cut first, so that a name of a million characters costs no more than one of sixty, and then what escapes added.
    return _shortened(escaped(_shortened(name, most)).replace("\n", "\\u000a").replace("\t", "\\u0009"), most)


def displayed_path(path: str | os.PathLike[str]) -> str:
    """Return the name of a file as it is displayed: as `displayed`, but longer, for half a path leads nowhere."""
    return displayed(os.fspath(path), _LONGEST_PATH)


def printable(text: str) -> str:
    """Return a message, in which names may stand, as it is displayed; it keeps its lines.

    Unsafe characters are escaped, and the middle of words and lines that would fill a screen is left out.
    """
    short = _LONG_WORDS.sub(lambda word: _shortened(word[0], 80), escaped(text))
    return _LONG_LINES.sub(lambda line: _shortened(line[0], _LONGEST_LINE), short)


def escaped(text: str) -> str:
    """Escape unsafe characters as JSON does, so that JSON stays what it is; ends of lines and tabs stay."""
    return _UNSAFE.sub(lambda one: f"\\u{ord(one[0]):04x}", text)


def _shortened(text: str, most: int) -> str:
    """Return text with its middle left out if it has more than `most` characters, three quarters of them before it."""
    end = (most - 3) // 4
    return text if len(text) <= most else f"{text[: most - 3 - end]}...{text[len(text) - end :]}"
