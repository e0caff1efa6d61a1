"""A workshop: threads for work that can be done apart, and room for arrays that are larger than memory.

Large arrays are mapped from files in a folder, which the system writes and reads as it has memory to spare. The files
have no names, so nothing is left of them when the arrays are gone, however the process ends.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, TypeVar
from weakref import finalize

import numpy as np
from numpy.typing import DTypeLike, NDArray

from motionmind.executors.here import this_process, threads
from motionmind.executors.team import Team

_Job = TypeVar("_Job")
_Result = TypeVar("_Result")
_One = TypeVar("_One")
_Other = TypeVar("_Other")

LARGE = 1 << 26  # bytes of an array that is mapped from a file


@dataclass(frozen=True)
class Workshop:
    """Threads, and room for large arrays.

    Attributes:
        team: the threads; they share memory with those who have work.
        folder: for large arrays; None keeps all in memory.
    """

    team: Team = field(default_factory=this_process)
    folder: Path | None = None

    @classmethod
    def of(cls, workers: int, folder: Path | None = None) -> Workshop:
        """Return a workshop of so many threads."""
        return cls(threads(workers), folder)

    def map(self, function: Callable[[_Job], _Result], jobs: Iterable[_Job]) -> Iterator[_Result]:
        """Yield the results of `function` for all jobs, in their order."""
        return self.team.map(function, jobs)

    def do(self, function: Callable[[_Job], None], jobs: Iterable[_Job]) -> None:
        """Do all jobs, in any order."""
        for _ in self.team.map(function, jobs):
            pass

    def both(self, one: Callable[[], _One], other: Callable[[], _Other]) -> tuple[_One, _Other]:
        """Return the results of two jobs, side by side if there is more than one worker."""
        kept: dict[int, Any] = {}
        jobs: list[tuple[int, Callable[[], Any]]] = [(0, one), (1, other)]
        self.do(lambda job: kept.update({job[0]: job[1]()}), jobs)
        return kept[0], kept[1]

    def empty(self, shape: tuple[int, ...], dtype: DTypeLike = np.float64) -> NDArray[Any]:
        """Return an array that is not filled yet.

        Raises:
            OSError: the folder's disk is full.
        """
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if self.folder is None or size < LARGE:
            return np.empty(shape, dtype)
        with _nameless(self.folder) as file:
            # A page that finds no room when it is written would end the process.
            os.posix_fallocate(file.fileno(), 0, size) if hasattr(os, "posix_fallocate") else file.truncate(size)
            return _map(file, shape, np.dtype(dtype))

    def pile(self) -> Pile:
        """Return an array that is to grow."""
        return Pile(self.folder)


class Pile:
    """Rows that are put on each other, and become one array.

    Args:
        folder: of the file that takes them; None keeps them in memory.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._file: IO[bytes] | None = None
        self._rows: list[NDArray[Any]] = []
        self._shape: tuple[int, ...] = ()
        self._dtype: np.dtype[Any] = np.dtype(np.float64)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, rows: NDArray[Any]) -> None:
        """Add rows [n, ...], all of one shape and type.

        Raises:
            OSError: the folder's disk is full.
        """
        self._shape, self._dtype = rows.shape[1:], rows.dtype
        self._count += len(rows)
        if self._folder is None:
            self._rows.append(rows)
            return
        if self._file is None:
            self._file = _nameless(self._folder)
            finalize(self, self._file.close)
        self._file.write(np.ascontiguousarray(rows).data)

    def array(self) -> NDArray[Any]:
        """Return all rows, one at least; nothing can be added any more."""
        if self._file is None:
            return np.concatenate(self._rows)
        with self._file as file:
            file.flush()
            return _map(file, (self._count, *self._shape), self._dtype)


def _nameless(folder: Path) -> IO[bytes]:
    return tempfile.TemporaryFile(dir=folder)


def _map(file: IO[bytes], shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the array that a file holds; a plain view, for the subclass slows every slice."""
    return np.asarray(np.memmap(file, dtype, "r+", shape=shape)) if math.prod(shape) else np.empty(shape, dtype)
