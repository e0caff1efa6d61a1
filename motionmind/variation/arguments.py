"""Checks of arguments: convert Python and NumPy numbers to Python's, which JSON can hold, and refuse the rest."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import described
from motionmind.errors import MotionMindError, WrongTypeError


def check_whole(name: str, value: object, least: int | None = None, most: int | None = None) -> int:
    """Return a whole number as an int.

    Args:
        name: the argument's name, for the message.
        value: the argument, Python's or NumPy's.
        least, most: the range allowed; None for no limit.

    Raises:
        WrongTypeError: `value` is not a whole number.
        MotionMindError: it is out of range.
    """
    number = int(value) if isinstance(value, int | np.integer) and not isinstance(value, bool) else None
    if number is not None and (least is None or number >= least) and (most is None or number <= most):
        return number
    span = "".join(f" {word} {bound}" for word, bound in (("from", least), ("to", most)) if bound is not None)
    raise _error(number is not None)(f"{name} must be a whole number{span}, not {described(value)}")


def check_number(name: str, value: object) -> float:
    """Return a finite number as a float; WrongTypeError if it is not a number, MotionMindError if it is not finite."""
    wanted = "a finite number"
    array = _numbers(name, value, wanted)
    if array.ndim:
        raise WrongTypeError(f"{name} must be {wanted}, not {described(value)}")
    return float(array)


def check_numbers(name: str, value: object) -> tuple[float, ...]:
    """Return finite numbers as floats [d], d = 1 for a single number; errors as for `check_number`."""
    return tuple(map(float, _numbers(name, value, "finite numbers").reshape(-1)))


def _numbers(name: str, value: object, wanted: str) -> Floats:
    """Return finite numbers as an array of at most one dimension."""
    try:
        array = np.asarray(value)
        is_numbers = array.dtype.kind in "iuf" and array.ndim <= 1
    except ValueError:  # rows of different lengths
        is_numbers = False
    if not is_numbers or not np.isfinite(array).all():
        raise _error(is_numbers)(f"{name} must be {wanted}, not {described(value)}")
    return array.astype(np.float64)


def _error(is_of_type: bool) -> type[MotionMindError]:
    """Return the error class for a value out of range, or of the wrong type."""
    return MotionMindError if is_of_type else WrongTypeError
