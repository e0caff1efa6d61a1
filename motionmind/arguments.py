"""Checks at the public door: a value of a type that a function does not take is one clear line, a WrongTypeError."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from numbers import Integral, Real
from typing import TYPE_CHECKING

from motionmind.display import displayed
from motionmind.errors import WrongTypeError

if TYPE_CHECKING:
    from motionmind._typing import Floats, Ints

_LONGEST = 40  # characters of a value in a message


def check_type(name: str, value: object, *types: type, wanted: str = "", or_none: bool = False) -> None:
    """Check that a value is of one of some types.

    Args:
        name: the argument's name, for the message.
        value: what was given.
        types: what is taken.
        wanted: the types in words; by default their names.
        or_none: whether None is taken too.

    Raises:
        WrongTypeError: it is not; the message names the attribute of `value` that is, if there is one.
    """
    if isinstance(value, types) or (or_none and value is None):
        return
    wanted = wanted or " or ".join(map(_one, types))
    within = getattr(value, "motion", None)
    hint = "; its .motion is one" if isinstance(within, types) else ""
    raise WrongTypeError(f"{name} must be {wanted}, not {described(value)}{hint}")


def check_path(name: str, value: object, *, or_none: bool = False) -> None:
    """Check that a value is the name of a file or folder; WrongTypeError if it is not."""
    check_type(name, value, str, os.PathLike, wanted="the name of a file or folder", or_none=or_none)


def check_text(name: str, value: object, *, or_none: bool = False) -> None:
    """Check that a value is text; WrongTypeError if it is not."""
    check_type(name, value, str, wanted="text", or_none=or_none)


def check_real(name: str, value: object, *, or_none: bool = False) -> None:
    """Check that a value is a number, Python's or numpy's, and no flag; WrongTypeError if it is not."""
    _check_number(name, value, Real, "a number", or_none)


def check_integer(name: str, value: object, *, or_none: bool = False) -> None:
    """Check that a value is a whole number, Python's or numpy's, and no flag; WrongTypeError if it is not."""
    _check_number(name, value, Integral, "a whole number", or_none)


def _check_number(name: str, value: object, kind: type, wanted: str, or_none: bool) -> None:
    if isinstance(value, bool):  # which Python counts among the whole numbers
        raise WrongTypeError(f"{name} must be {wanted}, not {value}")
    check_type(name, value, kind, wanted=wanted, or_none=or_none)


def check_flag(name: str, value: object) -> None:
    """Check that a value is True or False, Python's or numpy's; WrongTypeError if it is not."""
    # numpy's type by its name, for it need not be imported.
    if not isinstance(value, bool) and type(value).__name__ not in ("bool", "bool_"):
        raise WrongTypeError(f"{name} must be True or False, not {described(value)}")


def check_function(name: str, value: object, *, or_none: bool = False) -> None:
    """Check that a value can be called; WrongTypeError if it cannot."""
    if not callable(value) and not (or_none and value is None):
        raise WrongTypeError(f"{name} must be a function, not {described(value)}")


def check_mapping(name: str, value: object, *, or_none: bool = False) -> None:
    """Check that a value is a mapping; WrongTypeError if it is not."""
    check_type(name, value, Mapping, wanted="a mapping, such as a dict", or_none=or_none)


def check_items(name: str, value: object, wanted: str, *types: type) -> None:
    """Check that a value is a sequence, and its items of some types.

    Text, a sequence of letters to Python, is none. Items of what can be gone through only once are not looked at.

    Args:
        name: the argument's name, for the message.
        value: what was given.
        wanted: what the sequence is of, in words.
        types: what its items are; nothing if they are checked elsewhere.

    Raises:
        WrongTypeError: it is not a sequence, or one of its items is none of `types`.
    """
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        hint = f"; write [{value!r:.{_LONGEST}}]" if str in types and isinstance(value, str) else ""
        raise WrongTypeError(f"{name} must be a sequence of {wanted}, not {described(value)}{hint}")
    if not types or iter(value) is value:
        return
    for number, item in enumerate(value):
        if not isinstance(item, types):
            raise WrongTypeError(f"{name} must be a sequence of {wanted}; item {number} is {described(item)}")


def as_floats(name: str, value: object) -> Floats:
    """Return a new array of numbers, such as a list of lists has; WrongTypeError if there is something else in it."""
    import numpy as np

    try:
        array = np.asarray(value)
        if array.dtype.kind in "biuf":
            return array.astype(np.float64)
    except ValueError:  # rows of different lengths
        pass
    raise WrongTypeError(f"{name} must be an array of numbers, not {described(value)}")


def as_integers(name: str, value: object) -> Ints:
    """Return a new array of whole numbers; WrongTypeError if there is something else in it."""
    import numpy as np

    try:
        array = np.asarray(value)
        if array.dtype.kind in "iu" or array.size == 0:
            return array.astype(np.int64)
    except ValueError:  # rows of different lengths
        pass
    raise WrongTypeError(f"{name} must be an array of whole numbers, not {described(value)}")


def _one(type_: type) -> str:
    return f"a{'n' * (type_.__name__[0] in 'AEIOUaeiou')} {type_.__name__}"


def described(value: object) -> str:
    """Return a value as a message has it: short text and numbers as they are written, else its type."""
    if value is None or isinstance(value, bool | int | float):
        return repr(value)
    if isinstance(value, str):
        return repr(displayed(value, _LONGEST))
    return _one(type(value))
