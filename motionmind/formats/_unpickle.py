"""Reads what a pickle holds, numbers and arrays of them, and runs nothing that it names.

A pickle is a program for a stack machine, which may name any function and call it. Here the machine knows the
instructions that build values, no other; and of functions it knows numpy's that rebuild arrays, which are replaced by
objects that only note down what they are given. An array is then made of its type, shape and bytes, and checked. The
protocols 0 to 5 are read, as Python 2 and 3 write them.
"""

from __future__ import annotations

import io
import math
import pickle
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MOST_STEPS = 20_000  # instructions; a file of movement has some hundreds, since an array is one of them
_VALUES = [
    "PROTO",
    "FRAME",
    "MARK",
    "STOP",
    "POP",
    "POP_MARK",
    "EMPTY_DICT",
    "DICT",
    "SETITEM",
    "SETITEMS",
    "EMPTY_LIST",
    "LIST",
    "APPEND",
    "APPENDS",
    "EMPTY_TUPLE",
    "TUPLE",
    "TUPLE1",
    "TUPLE2",
    "TUPLE3",
    "NONE",
    "NEWTRUE",
    "NEWFALSE",
    "INT",
    "BININT",
    "BININT1",
    "BININT2",
    "LONG",
    "LONG1",
    "FLOAT",
    "BINFLOAT",
    "STRING",
    "BINSTRING",
    "SHORT_BINSTRING",
    "UNICODE",
    "BINUNICODE",
    "SHORT_BINUNICODE",
    "BINBYTES",
    "SHORT_BINBYTES",
    "BINBYTES8",
    "GET",
    "BINGET",
    "LONG_BINGET",
    "PUT",
    "BINPUT",
    "LONG_BINPUT",
    "MEMOIZE",
    "GLOBAL",
    "STACK_GLOBAL",
    "REDUCE",
    "BUILD",
]


class Recorded:
    """A call of a function that was named: the function's name, what it was given, and the state set afterwards."""

    __slots__ = ("given", "name", "state")

    def __init__(self, name: str, given: tuple[Any, ...]) -> None:
        self.name = name
        self.given = given
        self.state: Any = None

    def __setstate__(self, state: object) -> None:
        self.state = state


class _Named:
    """A function that was named; calling it notes down what it is given."""

    __slots__ = ("_name",)

    def __init__(self, name: str) -> None:
        self._name = name

    def __call__(self, *given: object) -> object:
        if self._name == "encode":  # bytes, as protocols before 3 write them from Python 3
            return str(given[0]).encode("latin-1")
        return Recorded(self._name, given)

    def __setstate__(self, _: object) -> None:
        raise pickle.UnpicklingError(f"{self._name} has no state")


_NUMPY = {
    (f"{package}.{module}", name): _Named(name)
    for package in ("numpy.core", "numpy._core")
    for module, name in (("multiarray", "_reconstruct"), ("multiarray", "scalar"), ("numeric", "_frombuffer"))
} | {("numpy", name): _Named(name) for name in ("ndarray", "dtype")}
_KNOWN = _NUMPY | {("_codecs", "encode"): _Named("encode")}


def _read_bytes(reader: Any) -> None:
    """Put the bytes that follow, whose number they begin with, on the machine's stack."""
    (length,) = struct.unpack("<Q", reader.read(8))
    reader.append(reader.read(length))


class _Steps(dict[int, Callable[..., None]]):
    """The instructions that are known, counted as they are carried out."""

    def __init__(self) -> None:
        every = pickle._Unpickler.dispatch
        codes = [getattr(pickle, name)[0] for name in _VALUES]
        super().__init__({code: every[code] for code in codes})
        self[pickle.BYTEARRAY8[0]] = _read_bytes  # Python's takes the memory before it reads
        self.count = 0

    def __getitem__(self, code: int) -> Callable[..., None]:
        self.count += 1
        if self.count > _MOST_STEPS:
            raise pickle.UnpicklingError(f"more than {_MOST_STEPS} values are no movement")
        if code not in self:
            raise pickle.UnpicklingError(f"it has the instruction {chr(code)!r}, which is no value")
        return super().__getitem__(code)


class _Reader(pickle._Unpickler):
    """Python's own machine; the one in C takes memory for as many values as a file says it will keep."""

    def __init__(self, data: bytes) -> None:
        super().__init__(io.BytesIO(data), encoding="latin-1")
        self.dispatch = _Steps()  # type: ignore[misc]

    def find_class(self, module: str, name: str) -> object:
        """Return what stands for a function of numpy's; an error for any other name."""
        if (module, name) not in _KNOWN:
            raise pickle.UnpicklingError(f"it names {module}.{name}, and nothing of a pickle is run")
        return _KNOWN[module, name]


def unpickle(data: bytes) -> object:
    """Return the value in a pickle; `Recorded` where a function was to be called.

    Raises:
        Exception: of any class; the bytes are no pickle of plain values and numpy's arrays.
    """
    return _Reader(data).load()


def to_array(value: object) -> NDArray[Any]:
    """Return the array that a value from `unpickle` is: an array, a number, or lists of numbers.

    Raises:
        ValueError: it is none.
    """
    if not isinstance(value, Recorded):
        array = np.array(value) if isinstance(value, (int, float, list, tuple)) else np.array(None)
    elif value.name == "scalar" and len(value.given) == 2:
        array = _from_bytes(value.given[1], _dtype(value.given[0]), (), "C")
    elif value.name == "_frombuffer" and len(value.given) == 4:
        data, dtype, shape, order = value.given
        array = _from_bytes(data, _dtype(dtype), shape, order)
    elif value.name == "_reconstruct" and isinstance(value.state, tuple) and len(value.state) == 5:
        _, shape, dtype, is_fortran, data = value.state
        array = _from_bytes(data, _dtype(dtype), shape, "F" if is_fortran else "C")
    else:
        raise ValueError(f"{value.name} is no array")
    if array.dtype.kind not in "fiu":
        raise ValueError("it holds no numbers")
    return array


def _dtype(value: object) -> np.dtype[Any]:
    """Return a type of numbers: its name, such as f8, and its byte order."""
    name = value.given[0] if isinstance(value, Recorded) and value.name == "dtype" and value.given else None
    if not isinstance(value, Recorded) or name not in (
        "f2",
        "f4",
        "f8",
        "i1",
        "i2",
        "i4",
        "i8",
        "u1",
        "u2",
        "u4",
        "u8",
    ):
        raise ValueError(f"{str(name)[:20]!r} is no type of numbers")
    order = value.state[1] if isinstance(value.state, tuple) and len(value.state) > 1 else "<"
    return np.dtype(f"{'>' if order == '>' else '<'}{name}")


def _from_bytes(data: object, dtype: np.dtype[Any], shape: object, order: object) -> NDArray[Any]:
    """Return an array of as many bytes as its shape needs."""
    raw = data.encode("latin-1") if isinstance(data, str) else data
    whole = isinstance(shape, tuple) and all(isinstance(n, int) and n >= 0 for n in shape)
    if not isinstance(raw, bytes) or not isinstance(shape, tuple) or not whole:
        raise ValueError("its bytes and shape are none")
    if math.prod(shape) * dtype.itemsize != len(raw):
        raise ValueError(f"{len(raw)} bytes are none of the shape {list(shape)}")
    return np.frombuffer(raw, dtype).reshape(shape, order="F" if order == "F" else "C")
