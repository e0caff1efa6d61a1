"""Reads tables of plain decimal numbers in compiled code, many times faster than a general parser.

Double precision holds the digits exactly up to 2^53, and powers of ten up to 10^22; so a single division, or product,
rounds correctly (Clinger, "How to read floating point numbers accurately", PLDI 1990). Longer numbers and other
notations are left to the general parser.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionmind._typing import Floats, Pixels
from motionmind.jit import jit

_POWERS_OF_TEN = np.array([10.0**power for power in range(23)])


def read_plain(rows: Sequence[str], columns: int) -> Floats | None:
    """Read a table [rows, columns], one row a line.

    Returns:
        The numbers; None if a row has another count, or a number is not plain.
    """
    try:
        text = np.frombuffer("\n".join((*rows, "")).encode("ascii"), np.uint8)
    except UnicodeEncodeError:
        return None
    out = np.empty((len(rows), columns))
    return out if _parse(text, _POWERS_OF_TEN, out) else None


@jit
def _parse(text: Pixels, tens: Floats, out: Floats) -> bool:
    """Parse a text of terminated lines into `out` [rows, columns]; return whether all numbers are plain."""
    row, column, at, end = 0, 0, 0, len(text)
    while at < end:
        sign = text[at]
        if sign == 10:
            if column != out.shape[1]:
                return False
            row, column, at = row + 1, 0, at + 1
            continue
        if sign in (32, 9):
            at += 1
            continue
        at += sign in (43, 45)
        digits, decimals, point, mantissa = 0, 0, False, 0
        while text[at] == 46 or 48 <= text[at] <= 57:  # the last character is the end of a line
            if text[at] != 46:
                mantissa = 10 * mantissa + int(text[at]) - 48
                digits, decimals = digits + 1, decimals + point
            elif point:
                return False
            else:
                point = True
            at += 1
        power, is_less, at_power = 0, False, 0
        if text[at] in (69, 101):  # E, e
            is_less = text[at + 1] == 45
            at += 2 if text[at + 1] in (43, 45) else 1
            at_power = at
            while 48 <= text[at] <= 57 and power < 1000:
                power, at = 10 * power + int(text[at]) - 48, at + 1
        power = (-power if is_less else power) - decimals
        # 18 digits are less than 2^63.
        if not 0 < digits <= 18 or mantissa > 2**53 or abs(power) >= len(tens) or at == at_power:
            return False
        if text[at] not in (10, 32, 9) or column == out.shape[1] or row == len(out):
            return False
        value = mantissa / tens[-power] if power < 0 else mantissa * tens[power]
        out[row, column] = -value if sign == 45 else value
        column += 1
    return row == len(out)
