"""Make foreign text, such as names and titles from files, safe to display in messages, tables, pages and pictures.

Files and reports keep the whole text, with the escapes of their formats.
"""

from __future__ import annotations

import os
import re

_MAX_NAME_CHARS = 60  # the longest joint name of common rigs has half as many
_MAX_PATH_CHARS = 300  # half a path is useless
_MAX_LINE_CHARS = 2000

# Control characters except newline and tab; characters that change the direction of text or end lines; and surrogates,
# which no output can encode.
_UNSAFE = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]"
)
_LONG_WORDS = re.compile(rf"\S{{{_MAX_PATH_CHARS},}}")
_LONG_LINES = re.compile(rf"[^\n]{{{_MAX_LINE_CHARS},}}")


def displayed(name: str, most: int = _MAX_NAME_CHARS) -> str:
    """Return a name in one line that is safe to display in a terminal or page.

    Escape unsafe characters as JSON does; leave out the middle of names of more than `most` characters.

    >>> from motionmind.display import displayed
    >>> displayed("left\\x1b[31m hip")
    'left\\\\u001b[31m hip'
    """
    # Shorten before escaping, so that long names cost no time, and again after it.
    return _shortened(_unbroken(escaped(_shortened(name, most))), most)


def displayed_path(path: str | os.PathLike[str]) -> str:
    """Return a path as `displayed` does, up to a greater length, because half a path is useless."""
    return displayed(os.fspath(path), _MAX_PATH_CHARS)


def printable(text: str) -> str:
    """Return a message, which may contain names, safe to display; keep its lines.

    Escape unsafe characters, and leave out the middle of words and lines that would fill a screen.
    """
    short = _LONG_WORDS.sub(lambda word: _shortened(word[0], 80), escaped(text))
    return _LONG_LINES.sub(lambda line: _shortened(line[0], _MAX_LINE_CHARS), short)


def one_line(text: str) -> str:
    """Return a message as `printable` does, with newlines and tabs escaped, too.

    >>> from motionmind.display import one_line
    >>> one_line("a\\nb.bvh: cannot be read")
    'a\\\\u000ab.bvh: cannot be read'
    """
    return _unbroken(printable(text))


def escaped(text: str) -> str:
    """Escape unsafe characters as JSON does, which leaves JSON equivalent; keep newlines and tabs."""
    return _UNSAFE.sub(lambda one: f"\\u{ord(one[0]):04x}", text)


def _unbroken(text: str) -> str:
    return text.replace("\n", "\\u000a").replace("\t", "\\u0009")


def _shortened(text: str, most: int) -> str:
    """Shorten text to `most` characters: leave out its middle, and keep three quarters of them before it."""
    end = (most - 3) // 4
    return text if len(text) <= most else f"{text[: most - 3 - end]}...{text[len(text) - end :]}"
