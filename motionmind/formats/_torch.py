"""Reads tensors of numbers from files of PyTorch (`torch.save`), without PyTorch and without running any code in them.

A file is a zip archive without compression. It holds a pickle, `NAME/data.pkl`, where a tensor is a call that names a
storage, and the storages' bytes, `NAME/data/0`, `NAME/data/1` and so on. Files of PyTorch before 1.6 differ.
"""

from __future__ import annotations

import io
import math
import zipfile
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionmind.formats._unpickle import Recorded, unpickle

_TYPES = {
    "FloatStorage": "<f4",
    "DoubleStorage": "<f8",
    "HalfStorage": "<f2",
    "LongStorage": "<i8",
    "IntStorage": "<i4",
}
_MAX_DIMENSIONS = 8


@dataclass(frozen=True, eq=False)
class TorchFile:
    """A file of PyTorch.

    Attributes:
        held: the value in it, with `Recorded` in place of tensors.
    """

    held: object
    _archive: zipfile.ZipFile
    _folder: str

    def tensor(self, value: object, max_bytes: int) -> NDArray[Any]:
        """Return a tensor of the file as an array.

        Args:
            value: the recorded call that builds it.
            max_bytes: the most that it may take as floats of 8 bytes.

        Raises:
            ValueError: it is no tensor of numbers, too large, or beyond its storage.
        """
        if not isinstance(value, Recorded) or value.name != "_rebuild_tensor_v2" or len(value.arguments) < 4:
            raise ValueError("it is no tensor")
        storage, offset, shape, strides = value.arguments[:4]
        data = self._storage(storage)
        sizes = (offset, *shape, *strides) if isinstance(shape, tuple) and isinstance(strides, tuple) else (None,)
        if not all(isinstance(n, int) and 0 <= n < 2**62 for n in sizes) or len(shape) != len(strides):
            raise ValueError("its shape is invalid")
        if len(shape) > _MAX_DIMENSIONS or 8 * math.prod(shape) > max_bytes:
            raise ValueError(f"it is too large to be movement: {list(shape[:_MAX_DIMENSIONS])}")
        last = offset + sum((n - 1) * step for n, step in zip(shape, strides, strict=True))
        if math.prod(shape) and last >= len(data):
            raise ValueError("it reaches beyond its storage")
        steps = [step * data.itemsize for step in strides]
        return np.array(np.lib.stride_tricks.as_strided(data[offset:], shape, steps))

    def _storage(self, value: object) -> NDArray[Any]:
        """Return the numbers of a recorded storage."""
        held = value.arguments[0] if isinstance(value, Recorded) and value.name == "storage" else None
        if not isinstance(held, tuple) or len(held) != 5 or not isinstance(held[2], str):
            raise ValueError("it has no storage")
        kind = _TYPES.get(str(getattr(held[1], "name", "")))
        if kind is None:
            raise ValueError("it holds no numbers")
        return np.frombuffer(_read_stored(self._archive, f"{self._folder}/data/{held[2]}"), kind)


def read_torch(data: bytes) -> TorchFile:
    """Read the pickle in the bytes of a file.

    Raises:
        Exception: of any class; the bytes are not a file of PyTorch, or its pickle does more than build values.
    """
    archive = zipfile.ZipFile(io.BytesIO(data))
    folder = next(name.removesuffix("/data.pkl") for name in archive.namelist() if name.endswith("/data.pkl"))
    if f"{folder}/byteorder" in archive.namelist() and _read_stored(archive, f"{folder}/byteorder") != b"little":
        raise ValueError("its numbers are not little-endian")
    return TorchFile(unpickle(_read_stored(archive, f"{folder}/data.pkl")), archive, folder)


def _read_stored(archive: zipfile.ZipFile, name: str) -> bytes:
    """Return the bytes of a member, which takes no more than the file has."""
    member = archive.getinfo(name)
    if member.compress_type != zipfile.ZIP_STORED or member.file_size != member.compress_size:
        raise ValueError(f"{name[:40]!r} is compressed, which PyTorch never does")
    return archive.read(member)
