"""What the text formats share: lines of any encoding and line end, and numbers that are numbers."""

from __future__ import annotations

import codecs
import math
from collections.abc import Sequence

from motionmind.errors import FormatError, quoted
from motionmind.files import FilePath, read_bytes

# No length in any unit and no angle of a body comes near this; below it no sum or product can overflow.
LARGEST = 1e9

# The longest hand-made rigs have some hundreds; a file with more joints than this is damaged, or holds no body.
MOST_JOINTS = 4000


def read_lines(path: FilePath) -> list[str]:
    """The lines of a text file without their ends: LF, CRLF or CR; UTF-8 or UTF-16 with a mark, else Latin-1."""
    return decode(read_bytes(path)).replace("\r\n", "\n").replace("\r", "\n").split("\n")


def decode(data: bytes) -> str:
    """Text of `data`; Latin-1, in which any bytes are text, where it is no UTF-8."""
    utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        return data.decode("utf-16" if utf16 else "utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def to_number(token: str, path: FilePath, line: int) -> float:
    """`token` as a finite float; FormatError names file and line."""
    try:
        # float() knows more than the files' writers meant: 1_000 is no number here.
        value = float(token) if "_" not in token else math.nan
    except ValueError:
        value = math.nan
    if not abs(value) <= LARGEST:  # false for NaN too
        raise FormatError(f"{quoted(token)} where a number was expected", path=path, line=line)
    return value


def to_numbers(tokens: Sequence[str], path: FilePath, line: int) -> list[float]:
    """Every token as a finite float, as `to_number` does."""
    try:
        values = [float(token) for token in tokens]
    except ValueError:
        values = [math.nan]
    if all(-LARGEST <= value <= LARGEST for value in values) and "_" not in "".join(tokens):
        return values
    return [to_number(token, path, line) for token in tokens]  # names the one that is none
