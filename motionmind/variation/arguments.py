"""Checks of arguments: numbers, numpy's or Python's, become Python's own, which files can hold; the rest is refused."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from motionmind._typing import Floats
from motionmind.errors import MotionMindError


def check_whole(name: str, value: object, least: int | None = None, most: int | None = None) -> int:
    """Return a whole number as an int.

    Args:
        name: the argument's name, for the message.
        value: what was given, Python's or numpy's.
        least: the smallest number allowed; None for no limit.
        most: the largest number allowed; None for no limit.

    Raises:
        MotionMindError: `value` is not a whole number, or out of range.
    """
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        number = int(value)
        if (least is None or number >= least) and (most is None or number <= most):
            return number
    span = "".join(f" {word} {bound}" for word, bound in (("from", least), ("to", most)) if bound is not None)
    raise MotionMindError(f"{name} must be a whole number{span}, not {value!r}")


def check_number(name: str, value: object) -> float:
    """Return a finite number as a float; raise MotionMindError if it is not one."""
    array = _finite(value)
    if array is None or array.ndim:
        raise MotionMindError(f"{name} must be a finite number, not {value!r}")
    return float(array)


def check_numbers(name: str, value: object) -> tuple[float, ...]:
    """Return finite numbers as floats [d], d = 1 for a single number; raise MotionMindError if any is not finite."""
    array = _finite(value)
    if array is None:
        raise MotionMindError(f"{name} must be finite numbers, not {value!r}")
    return tuple(map(float, array.reshape(-1)))


def take_renamed(options: dict[str, Any], old: str, new: str, value: Any) -> Any:
    """Take a keyword's former name out of `options`, with a DeprecationWarning for the caller's caller.

    Args:
        options: keywords that a function collected; `old` is removed from them.
        old: the former name.
        new: the present name.
        value: what was given by the present name; None where nothing was.

    Returns:
        What was given, by either name.

    Raises:
        TypeError: both names were given.
    """
    if old not in options:
        return value
    if value is not None:
        raise TypeError(f"{old} is the former name of {new}: give {new} alone")
    warnings.warn(f"the keyword {old} is deprecated: use {new}", DeprecationWarning, stacklevel=3)
    return options.pop(old)


def _finite(value: object) -> Floats | None:
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        return None
    if array.dtype.kind not in "iuf" or array.ndim > 1 or not np.isfinite(array).all():
        return None
    return array.astype(np.float64)
