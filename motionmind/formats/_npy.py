"""Reads numpy's `.npy` format from a stream: arrays of numbers, no larger than the caller allows.

The format is described in "numpy.lib.format", NumPy Enhancement Proposal 1. numpy's own reader loads a header of any
length before it refuses it, evaluates types of objects, and advises to trust the file.
"""

from __future__ import annotations

import ast
import math
import re
import warnings
from typing import IO

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats
from motionmind.errors import FormatError, quoted
from motionmind.files import FilePath
from motionmind.formats.text import MAX_NUMBER

_MAGIC = b"\x93NUMPY"
_MAX_HEADER_BYTES = 10_000  # numpy's own limit; its headers of arrays of numbers have 118
_MAX_DIMENSIONS = 8
_PYTHON_2_LONG = re.compile(r"(?<=\d)L\b")


def read_array(stream: IO[bytes], max_bytes: int, what: str, path: FilePath) -> Floats:
    """Read an array of numbers in range, as floats.

    Args:
        stream: the array's file, at its beginning.
        max_bytes: the most that the array may take as floats.
        what: its name in errors.
        path: the file, for errors.

    Raises:
        FormatError: it is no such array, too large, or cut short.
        Exception: of the stream.
    """
    dtype, shape, order = _read_header(stream, what, path)
    count = math.prod(shape)
    if 8 * math.prod(max(size, 1) for size in shape) > max_bytes:  # numpy refuses long sides of empty arrays, too
        raise FormatError(f"{what} is too large to be movement: {list(shape)}", path=path)
    size = count * dtype.itemsize
    data = stream.read(size)
    if len(data) < size:
        raise FormatError(f"{what} cannot be read: cut short, {len(data)} of {size} bytes", path=path)
    array = np.frombuffer(data, dtype).reshape(shape, order="F" if order else "C")
    return checked_numbers(array, what, path)


def _read_header(stream: IO[bytes], what: str, path: FilePath) -> tuple[np.dtype[np.generic], tuple[int, ...], bool]:
    """Return an array's type, its shape, and whether its first index runs fastest."""
    magic = stream.read(8)
    if magic[:6] != _MAGIC or magic[6:7] not in (b"\1", b"\2", b"\3"):
        raise FormatError(f"{what} cannot be read: not a numpy array", path=path)
    length = int.from_bytes(stream.read(2 if magic[6] == 1 else 4), "little")
    if length > _MAX_HEADER_BYTES:
        message = f"its header has {length} characters; that of an array of numbers has {_MAX_HEADER_BYTES} at most"
        raise FormatError(f"{what} cannot be read: {message}", path=path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the parser's, about the style of Python
            header = ast.literal_eval(_PYTHON_2_LONG.sub("", stream.read(length).decode("latin-1")).strip())
        descr, order, shape = header["descr"], header["fortran_order"], header["shape"]
    except (ValueError, SyntaxError, TypeError, KeyError, MemoryError, RecursionError):
        raise FormatError(f"{what} cannot be read: its header is not that of a numpy array", path=path) from None
    if not isinstance(shape, tuple) or len(shape) > _MAX_DIMENSIONS or not all(map(_is_size, shape)):
        raise FormatError(
            f"{what} cannot be read: its shape is not {_MAX_DIMENSIONS} whole numbers or fewer", path=path
        )
    try:
        dtype = np.dtype(descr if isinstance(descr, str) else object)
    except (TypeError, ValueError, SyntaxError):
        raise FormatError(f"{what} cannot be read: numpy has no type {quoted(descr)}", path=path) from None
    if dtype.kind not in "fiu":
        raise FormatError(f"{what} holds no numbers", path=path)
    return dtype, shape, bool(order)


def _is_size(number: object) -> bool:
    return isinstance(number, int) and not isinstance(number, bool) and 0 <= number < 2**63


def checked_numbers(array: NDArray[np.generic], what: str, path: FilePath) -> Floats:
    """Return the array as floats; FormatError names an element that is not a number in range."""
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise FormatError(f"{what} holds no numbers", path=path)
    with np.errstate(invalid="ignore"):  # for a signalling NaN, which is found below
        numbers = array.astype(np.float64, copy=False)
    bad = np.argwhere(~(np.abs(numbers) <= MAX_NUMBER))  # NaN too
    if len(bad):
        value = numbers[tuple(bad[0])]
        raise FormatError(f"{what}{bad[0].tolist()} is {value:g}, not a place or an angle", path=path)
    return numbers
