"""Checks of the arrays of a corpus's movement, which may come from elsewhere: compiled code does not check indices.

Letters are sizes: N postures, J joints, L joint chains, G states in all, K frames of detail between postures,
C clips and F faults; clip_bytes and fault_bytes are the lengths of their encoded text.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Ints
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.entries import Columns
from motionmind.files import give_back


class _Form(NamedTuple):
    """The type of an array, its shape, and the range of its numbers."""

    kind: str
    shape: str
    low: float = -1e6  # metres or seconds: far beyond any movement, and far below where sums overflow
    high: float = 1e6

    def holds(self, numbers: NDArray[Any]) -> NDArray[np.bool_]:
        """Return which numbers are in the range; NaN is not."""
        return np.asarray((numbers >= self.low) & (numbers <= self.high))


MOVEMENT = {
    "rotations": _Form("f8", "N J 4", -2.0, 2.0),
    "root": _Form("f8", "N 3"),
    "times": _Form("f8", "N"),
    "detail": _Form("f2", "N K J 3", -4.0, 4.0),
    "states": _Form("i4", "N L"),
    "centres": _Form("f8", "G 4", -2.0, 2.0),
    "clips.text": _Form("u1", "clip_bytes"),
    "clips.lines": _Form("i8", "C+1"),
    "clips.starts": _Form("i8", "C+1"),
    "clips.weights": _Form("f8", "C 2", 0.0, 1e15),
    "clips.order": _Form("i4", "C"),
    "faults.text": _Form("u1", "fault_bytes"),
    "faults.lines": _Form("i8", "F+1"),
}


def check_forms(arrays: Mapping[str, NDArray[Any]], joints: int, chains: int) -> None:
    """Check the type, shape and range of each array, and where entries begin; ValueError names the first wrong one.

    Args:
        arrays: all arrays of `MOVEMENT`, by name.
        joints: number of joints J.
        chains: number of joint chains L.
    """
    sizes = {"J": joints, "L": chains}
    for name, form in MOVEMENT.items():
        array, words = arrays[name], form.shape.split()
        if array.dtype != np.dtype(form.kind):
            raise ValueError(f"{name} is of {array.dtype}, not of {np.dtype(form.kind)}")
        if array.ndim == len(words):
            for word, size in zip(words, array.shape, strict=True):  # the first array with a size defines it
                letter, _, more = word.partition("+")
                sizes.setdefault(letter, size - int(more or 0))
        shape = [_size(word, sizes) for word in words]
        if list(array.shape) != shape:
            raise ValueError(f"{name} is of the shape {list(array.shape)}, not {shape}")
        if form.kind[0] == "f" and not _is_all(array, form.holds):
            raise ValueError(f"{name} holds a number that is not from {form.low:g} to {form.high:g}")
    for name, counted in (
        ("clips.lines", "clips.text"),
        ("faults.lines", "faults.text"),
        ("clips.starts", "rotations"),
    ):
        starts, last = arrays[name], len(arrays[counted])
        if starts[0] != 0 or starts[-1] != last or (np.diff(starts) <= 0).any():
            raise ValueError(f"{name} does not rise from 0 to {last}")
    _check_indices("clips.order", arrays, len(arrays["clips.order"]))


def check_values(arrays: Mapping[str, NDArray[Any]], corpus: Corpus, sizes: Ints) -> None:
    """Check rotations, times, states and clips; ValueError names the first that is wrong.

    Args:
        arrays: as for `check_forms`, which they passed.
        corpus: the corpus of these arrays.
        sizes: number of states of each joint chain [L].
    """
    for name in ("clips", "faults"):
        try:
            for _ in getattr(corpus, name):
                pass
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{name}.text holds what is no entry: {error}") from error
    corpus.check_clips()
    for name, column in Columns.of(corpus.clips)._asdict().items():
        if not np.array_equal(arrays[f"clips.{name}"], column):
            raise ValueError(f"clips.{name} is not what clips.text says")
    # The square of a unit quaternion's length may differ from 1 by rounding. Written so that a NaN fails too.
    if not _is_all(arrays["rotations"], lambda part: np.abs(np.einsum("...i,...i", part, part) - 1.0) <= 1e-5):
        raise ValueError("rotations holds a quaternion that is not of unit length")
    steps = np.diff(corpus.times)
    steps[corpus.columns.starts[1:-1] - 1] = 1.0  # from clip to clip
    if not (steps > 0.0).all():
        raise ValueError("times does not rise within a clip")
    _check_indices("states", arrays, sizes)


def _size(word: str, sizes: Mapping[str, int]) -> int:
    """Return the size that a word of a shape stands for, as 4, "J" or "C+1"; -1 if it is not known."""
    letter, _, more = word.partition("+")
    return (int(letter) if letter.isdecimal() else sizes.get(letter, -1)) + int(more or 0)


def _check_indices(name: str, arrays: Mapping[str, NDArray[Any]], size: int | Ints) -> None:
    """Check that the entries of an array are at least 0 and less than a size, or than each column's size."""
    if not _is_all(arrays[name], lambda part: (part >= 0) & (part < size)):
        raise ValueError(f"{name} holds an index out of range")


def _is_all(array: NDArray[Any], test: Callable[[NDArray[Any]], NDArray[np.bool_]]) -> bool:
    """Return whether all entries of an array pass a test; test a mapped one by parts of 4 MiB to bound the memory."""
    rows = max((1 << 22) // max(array[:1].nbytes, 1), 1)
    for start in range(0, len(array), rows):
        if not test(array[start : start + rows]).all():
            return False
        give_back(array)
    return True
