"""Reads numbers and arrays from a pickle without running any function that it names.

A pickle is a program for a stack machine, which may name and call any function. This machine knows only instructions
that build values, and only the functions that rebuild arrays of numpy and tensors of PyTorch, replaced by objects that
record their arguments. An array is then built from its type, shape and bytes, and checked. Protocols 0 to 5 are read,
from Python 2 and 3.

A pickle may refer to a value again, so that a few bytes are a list of billions of numbers. Only a value that holds no
others, or a recorded call, may be referred to again, as numpy does with types and names: containers are trees, no
larger than the number of instructions. The arguments of calls are read only where they are needed, and checked first.
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

_MAX_INSTRUCTIONS = 20_000  # a file of movement has some hundreds, since an array takes one
_MAX_DIMENSIONS = 8
_INSTRUCTIONS = (
    *("PROTO", "FRAME", "MARK", "STOP", "POP", "POP_MARK", "EMPTY_DICT", "DICT", "SETITEM", "SETITEMS"),
    *("EMPTY_LIST", "LIST", "APPEND", "APPENDS", "EMPTY_TUPLE", "TUPLE", "TUPLE1", "TUPLE2", "TUPLE3"),
    *("NONE", "NEWTRUE", "NEWFALSE", "INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1", "FLOAT"),
    *("BINFLOAT", "STRING", "BINSTRING", "SHORT_BINSTRING", "UNICODE", "BINUNICODE", "SHORT_BINUNICODE"),
    *("BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "GET", "BINGET", "LONG_BINGET", "PUT", "BINPUT"),
    *("LONG_BINPUT", "MEMOIZE", "GLOBAL", "STACK_GLOBAL", "REDUCE", "BUILD", "BINPERSID"),
)
_TENSOR_TYPES = ("Float", "Double", "Half", "BFloat16", "Long", "Int", "Short", "Char", "Byte", "Bool")
_NUMBER_TYPES = ("f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8")


_Step = Callable[[Any], None]


class Recorded:
    """A recorded call: the function's name, its arguments, and the state set afterwards."""

    __slots__ = ("arguments", "name", "state")

    def __init__(self, name: str, arguments: tuple[Any, ...]) -> None:
        self.name = name
        self.arguments = arguments
        self.state: Any = None

    def __setstate__(self, state: object) -> None:
        self.state = state


class _Recorder:
    """A stand-in for a function; calling it records the arguments."""

    __slots__ = ("name",)

    def __init__(self, name: str) -> None:
        self.name = name

    def __call__(self, *arguments: object) -> object:
        return Recorded(self.name, arguments)

    def __setstate__(self, _: object) -> None:
        raise pickle.UnpicklingError(f"{self.name} has no state")


_FUNCTIONS = {
    (module, name): _Recorder(name)
    for module, name in (
        *(
            (f"{core}.multiarray", name)
            for core in ("numpy.core", "numpy._core")
            for name in ("_reconstruct", "scalar")
        ),
        *((f"{core}.numeric", "_frombuffer") for core in ("numpy.core", "numpy._core")),
        *(("numpy", "ndarray"), ("numpy", "dtype"), ("_codecs", "encode")),
        *(("torch._utils", "_rebuild_tensor_v2"), ("collections", "OrderedDict")),
        *(("torch", f"{kind}Storage") for kind in _TENSOR_TYPES),
    )
}


def _read_bytes(reader: Any) -> None:
    """Push a counted run of bytes on the machine's stack."""
    (length,) = struct.unpack("<Q", reader.read(8))
    reader.append(reader.read(length))


def _keyed(step: _Step, keys: slice) -> _Step:
    """Return an instruction that fills a dict, which raises an error unless the keys on the stack are strings."""

    def fill(reader: Any) -> None:
        if not all(isinstance(key, str) for key in reader.stack[keys]):  # the hash of others can take hours
            raise pickle.UnpicklingError("its keys are not strings")
        step(reader)

    return fill


def _unshared(step: _Step) -> _Step:
    """Return an instruction that refers to an earlier value, which raises an error if that holds values."""

    def get(reader: Any) -> None:
        step(reader)
        if isinstance(reader.stack[-1], (list, tuple, dict)):
            raise pickle.UnpicklingError("it holds one list in several places: save copies")

    return get


def _called(step: _Step) -> _Step:
    """Return the instruction that calls a function, which raises an error unless the arguments are a tuple."""

    def call(reader: Any) -> None:
        if not isinstance(reader.stack[-1], tuple):  # a string would become as many arguments
            raise pickle.UnpicklingError("it calls a function without arguments")
        step(reader)

    return call


class _Steps(dict[int, _Step]):
    """The known instructions, with a count of executed ones."""

    def __init__(self) -> None:
        every = pickle._Unpickler.dispatch
        codes = {name: getattr(pickle, name)[0] for name in _INSTRUCTIONS}
        super().__init__({code: every[code] for code in codes.values()})
        self[pickle.BYTEARRAY8[0]] = _read_bytes  # Python's own allocates before it reads
        for name in ("GET", "BINGET", "LONG_BINGET"):
            self[codes[name]] = _unshared(every[codes[name]])
        for name, keys in (("SETITEM", slice(-2, -1)), ("SETITEMS", slice(0, None, 2)), ("DICT", slice(0, None, 2))):
            self[codes[name]] = _keyed(every[codes[name]], keys)
        self[pickle.REDUCE[0]] = _called(every[pickle.REDUCE[0]])
        self.count = 0

    def __getitem__(self, code: int) -> _Step:
        self.count += 1
        if self.count > _MAX_INSTRUCTIONS:
            raise pickle.UnpicklingError(f"more than {_MAX_INSTRUCTIONS} values are not movement")
        if code not in self:
            raise pickle.UnpicklingError(f"it has the instruction {chr(code)!r}, which builds no value")
        return super().__getitem__(code)


class _Reader(pickle._Unpickler):
    """The machine written in Python; the one in C allocates memory for as many values as a file claims."""

    def __init__(self, data: bytes) -> None:
        super().__init__(io.BytesIO(data), encoding="latin-1")
        self.dispatch = _Steps()  # type: ignore[misc]

    def find_class(self, module: str, name: str) -> object:
        """Return the stand-in for a known function; raise an error for any other name."""
        if (module, name) not in _FUNCTIONS:
            raise pickle.UnpicklingError(f"it names {module}.{name}, and pickled code is never run")
        return _FUNCTIONS[module, name]

    def persistent_load(self, pid: object) -> object:
        """Return a record of a value that is outside of the pickle, as PyTorch's storages are."""
        return Recorded("storage", (pid,))


def unpickle(data: bytes) -> object:
    """Return the value in a pickle, with `Recorded` in place of function calls.

    Raises:
        Exception: of any class; the bytes are not a pickle of plain values and numpy arrays.
    """
    return _Reader(data).load()


def to_array(value: object) -> NDArray[Any]:
    """Return a value from `unpickle` as an array: an array, a number, or lists of numbers.

    Raises:
        ValueError: it is none of these.
    """
    if not isinstance(value, Recorded):
        array = np.array(value) if _holds_numbers(value) else np.array(None)
    elif value.name == "scalar" and len(value.arguments) == 2:
        array = _from_bytes(value.arguments[1], _dtype(value.arguments[0]), (), "C")
    elif value.name == "_frombuffer" and len(value.arguments) == 4:
        data, dtype, shape, order = value.arguments
        array = _from_bytes(data, _dtype(dtype), shape, order)
    elif value.name == "_reconstruct" and isinstance(value.state, tuple) and len(value.state) == 5:
        _, shape, dtype, is_fortran, data = value.state
        array = _from_bytes(data, _dtype(dtype), shape, "F" if is_fortran else "C")
    else:
        raise ValueError(f"{value.name} is not an array")
    if array.dtype.kind not in "fiu":
        raise ValueError("it holds no numbers")
    return array


def _holds_numbers(value: object) -> bool:
    """Return whether a value is a number, or a tree of lists of numbers; numpy would copy a string for each mention."""
    values = [value]
    for one in values:
        if isinstance(one, (list, tuple)):
            values += one
        elif not isinstance(one, (int, float)):
            return False
    return True


def _dtype(value: object) -> np.dtype[Any]:
    """Return the type of numbers of a recorded dtype, such as f8 in its byte order."""
    name = value.arguments[0] if isinstance(value, Recorded) and value.name == "dtype" and value.arguments else None
    if not isinstance(value, Recorded) or name not in _NUMBER_TYPES:
        raise ValueError(f"{name[:20] if isinstance(name, str) else 'its type'!r} is not a type of numbers")
    order = value.state[1] if isinstance(value.state, tuple) and len(value.state) > 1 else "<"
    return np.dtype(f"{'>' if order == '>' else '<'}{name}")


def _from_bytes(data: object, dtype: np.dtype[Any], shape: object, order: object) -> NDArray[Any]:
    """Build an array from bytes; ValueError unless their number fits the shape."""
    if isinstance(data, Recorded) and data.name == "encode" and data.arguments:
        data = data.arguments[0]  # Python 3 writes bytes so in protocols before 3
    raw = data.encode("latin-1") if isinstance(data, str) else data
    # The product of long numbers takes hours.
    sizes = shape if isinstance(shape, tuple) and len(shape) <= _MAX_DIMENSIONS else (None,)
    if not isinstance(raw, bytes) or not all(isinstance(n, int) and 0 <= n < 2**63 for n in sizes):
        raise ValueError(f"its bytes are missing, or its shape is not {_MAX_DIMENSIONS} whole numbers or fewer")
    if math.prod(sizes) * dtype.itemsize != len(raw):
        raise ValueError(f"{len(raw)} bytes do not fill the shape {list(sizes)}")
    return np.frombuffer(raw, dtype).reshape(sizes, order="F" if order == "F" else "C")
