"""Check the arguments of public functions: a value of the wrong type raises a WrongTypeError of one clear line."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from numbers import Integral, Real
from typing import TYPE_CHECKING

from motionmind.display import displayed
from motionmind.errors import WrongTypeError, did_you_mean

if TYPE_CHECKING:
    from motionmind._typing import Floats, Ints

_MAX_VALUE_CHARS = 40  # in a message


def check_type(name: str, value: object, *types: type, wanted: str = "", or_none: bool = False) -> None:
    """Check that a value has one of some types.

    Args:
        name: the argument's name, for the message.
        value: the argument.
        types: the accepted types.
        wanted: the types in words; by default their names.
        or_none: whether to accept None.

    Raises:
        WrongTypeError: it has none of them; the message names the attribute `motion` of `value` if that has.
    """
    if isinstance(value, types) or (or_none and value is None):
        return
    wanted = wanted or " or ".join(map(_a_type, types))
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
    """Check that a value is a number of Python or NumPy, but not a bool; WrongTypeError if it is not."""
    _check_number(name, value, Real, "a number", or_none)


def check_integer(name: str, value: object, *, or_none: bool = False) -> None:
    """Check that a value is an integer of Python or NumPy, but not a bool; WrongTypeError if it is not."""
    _check_number(name, value, Integral, "a whole number", or_none)


def _check_number(name: str, value: object, kind: type, wanted: str, or_none: bool) -> None:
    if isinstance(value, bool):  # a subclass of int
        raise WrongTypeError(f"{name} must be {wanted}, not {value}")
    check_type(name, value, kind, wanted=wanted, or_none=or_none)


def check_flag(name: str, value: object) -> None:
    """Check that a value is a bool of Python or NumPy; WrongTypeError if it is not."""
    # By its name: NumPy need not be imported.
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
    """Check that a value is a sequence with items of some types.

    Text is not a sequence here. Items of iterators are not checked.

    Args:
        name: the argument's name, for the message.
        value: the argument.
        wanted: the items in words, for the message.
        types: the accepted types of items; none to skip their check.

    Raises:
        WrongTypeError: it is not a sequence, or an item has none of the types.
    """
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        hint = f"; write [{value!r:.{_MAX_VALUE_CHARS}}]" if str in types and isinstance(value, str) else ""
        raise WrongTypeError(f"{name} must be a sequence of {wanted}, not {described(value)}{hint}")
    if not types or iter(value) is value:
        return
    for number, item in enumerate(value):
        if not isinstance(item, types):
            raise WrongTypeError(f"{name} must be a sequence of {wanted}; item {number} is {described(item)}")


def check_options(
    owner: str, given: Iterable[str], options: type, function: Callable[..., object] | None = None
) -> None:
    """Check the names of options.

    Args:
        owner: what has the options, for the message: a function, or "a tween".
        given: the names.
        options: the TypedDict of the options.
        function: the function whose other keyword arguments the message may suggest, too; None for none.

    Raises:
        WrongTypeError: there is no such option; the message suggests the most similar name.
    """
    for name in given:
        if name not in options.__annotations__:
            known = [*options.__annotations__, *(getattr(function, "__kwdefaults__", None) or {})]
            raise WrongTypeError(f"{owner} has no option {name!r}{did_you_mean(name, known)}")


def as_floats(name: str, value: object) -> Floats:
    """Return a new array of floats; WrongTypeError if the value is not an array of numbers."""
    import numpy as np

    try:
        array = np.asarray(value)
        if array.dtype.kind in "biuf":
            return array.astype(np.float64)
    except ValueError:  # rows of different lengths
        pass
    raise WrongTypeError(f"{name} must be an array of numbers, not {described(value)}")


def as_integers(name: str, value: object) -> Ints:
    """Return a new array of integers; WrongTypeError if the value is not an array of integers."""
    import numpy as np

    try:
        array = np.asarray(value)
        if array.dtype.kind in "iu" or array.size == 0:
            return array.astype(np.int64)
    except ValueError:  # rows of different lengths
        pass
    raise WrongTypeError(f"{name} must be an array of whole numbers, not {described(value)}")


def _a_type(type_: type) -> str:
    return f"a{'n' * (type_.__name__[0] in 'AEIOUaeiou')} {type_.__name__}"


def described(value: object) -> str:
    """Describe a value for a message: short text and numbers as written in Python, else its type."""
    if value is None or isinstance(value, bool | int | float):
        return repr(value)
    if isinstance(value, str):
        return repr(displayed(value, _MAX_VALUE_CHARS))
    return _a_type(type(value))
