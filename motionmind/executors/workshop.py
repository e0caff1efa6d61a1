"""A workshop: threads for parallel work, and storage for arrays larger than memory.

Large arrays are memory-mapped from files in a folder, which the system writes and reads as needed. The files have no
names, so they vanish with their arrays, however the process ends.
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

MAPPED_BYTES = 1 << 26  # smallest array that is mapped from a file


@dataclass(frozen=True)
class Workshop:
    """Threads, and storage for large arrays.

    Attributes:
        team: the threads; they share the caller's memory.
        folder: folder for large arrays; None keeps all in memory.
    """

    team: Team = field(default_factory=this_process)
    folder: Path | None = None

    @classmethod
    def of(cls, workers: int, folder: Path | None = None) -> Workshop:
        """Return a workshop with `workers` threads."""
        return cls(threads(workers), folder)

    def map(self, function: Callable[[_Job], _Result], jobs: Iterable[_Job]) -> Iterator[_Result]:
        """Yield the results of `function` for all jobs, in order."""
        return self.team.map(function, jobs)

    def do(self, function: Callable[[_Job], None], jobs: Iterable[_Job]) -> None:
        """Run all jobs, in any order."""
        for _ in self.team.map(function, jobs):
            pass

    def both(self, one: Callable[[], _One], other: Callable[[], _Other]) -> tuple[_One, _Other]:
        """Run two jobs, in parallel if there is more than one worker; return their results."""
        kept: dict[int, Any] = {}
        jobs: list[tuple[int, Callable[[], Any]]] = [(0, one), (1, other)]
        self.do(lambda job: kept.update({job[0]: job[1]()}), jobs)
        return kept[0], kept[1]

    def empty(self, shape: tuple[int, ...], dtype: DTypeLike = np.float64) -> NDArray[Any]:
        """Return an uninitialised array.

        Raises:
            OSError: the folder's disk is full.
        """
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if self.folder is None or size < MAPPED_BYTES:
            return np.empty(shape, dtype)
        with _nameless(self.folder) as file:
            # Reserve the space: writing to a mapped page on a full disk would kill the process.
            os.posix_fallocate(file.fileno(), 0, size) if hasattr(os, "posix_fallocate") else file.truncate(size)
            return _map(file, shape, np.dtype(dtype))

    def pile(self) -> Pile:
        """Return an empty array that can grow."""
        return Pile(self.folder)


class Pile:
    """An array that grows by rows.

    Args:
        folder: the folder of its file; None keeps the rows in memory.
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
        """Return all rows, at least one; afterwards, no more can be added."""
        if self._file is None:
            return np.concatenate(self._rows)
        with self._file as file:
            file.flush()
            return _map(file, (self._count, *self._shape), self._dtype)


def _nameless(folder: Path) -> IO[bytes]:
    return tempfile.TemporaryFile(dir=folder)


def _map(file: IO[bytes], shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Map an array from a file; return a plain view, because `np.memmap` slows down every slice."""
    return np.asarray(np.memmap(file, dtype, "r+", shape=shape)) if math.prod(shape) else np.empty(shape, dtype)
