"""Text formats: lines in any encoding and with any line ends, and strict parsing of numbers."""

from __future__ import annotations

import codecs
import math
from collections.abc import Sequence

from motionmind.errors import FormatError, quoted
from motionmind.files import FilePath, read_bytes

# Larger than any length of a body in any unit, and any angle; below it no sum or product can overflow.
MAX_NUMBER = 1e9

# The largest hand-made rigs have some hundreds; a file with more joints is damaged or not a body.
MAX_JOINTS = 4000

# Lengths of quaternions written with ten decimals are off 1 by less; such quaternions are read bit-identical.
WRITTEN_LENGTH_TOLERANCE = 1e-9
LENGTH_TOLERANCE = 0.01  # of a quaternion, without a warning: numbers may be rounded to two digits


def read_lines(path: FilePath) -> list[str]:
    """Read a text file's lines, without LF, CRLF or CR; UTF-8 or UTF-16 with a byte order mark, else Latin-1."""
    return decode(read_bytes(path)).replace("\r\n", "\n").replace("\r", "\n").split("\n")


def decode(data: bytes) -> str:
    """Decode `data` as UTF-8, or UTF-16 with a byte order mark; otherwise as Latin-1, which decodes any bytes."""
    utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        return data.decode("utf-16" if utf16 else "utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def to_number(token: str, path: FilePath, line: int) -> float:
    """Parse `token` as a finite float; FormatError names file and line."""
    try:
        # float() accepts 1_000, which is not a number here.
        value = float(token) if "_" not in token else math.nan
    except ValueError:
        value = math.nan
    if not abs(value) <= MAX_NUMBER:  # false for NaN too
        raise FormatError(f"{quoted(token)} where a number was expected", path=path, line=line)
    return value


def to_numbers(tokens: Sequence[str], path: FilePath, line: int) -> list[float]:
    """Parse all tokens as finite floats; FormatError names file and line."""
    try:
        values = list(map(float, tokens))
    except ValueError:
        values = [math.nan]
    if sum(map(abs, values)) <= MAX_NUMBER and "_" not in "".join(tokens):  # so no value is larger, or NaN
        return values
    return [to_number(token, path, line) for token in tokens]  # names the faulty token
