"""Folders of arrays: one .npy file each, with a checksum in a manifest, verified once and mapped into memory."""

from __future__ import annotations

import hashlib
import io
import math
import mmap
import os
import re
import time
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec

from motionmind.errors import FormatError
from motionmind.files import replace_file

if TYPE_CHECKING:
    from numpy.typing import NDArray

CHECKED = "checked"  # the file that says in which state the others were valid
_CHECKED_BY = Path(__file__).parents[1] / "learned" / "validity.py"  # when it changes, all are checked again
_NAME = re.compile(r"\w+(\.\w+)*")  # of an array: no name in a manifest leads out of the folder


class ArrayEntry(msgspec.Struct, frozen=True):
    """The entry of an array in a manifest: its type as NumPy writes it, its shape, and the SHA-256 of its file."""

    type: Annotated[str, msgspec.Meta(pattern=r"^(<f[248]|<[iu][248]|\|[iub]1)\Z")]
    shape: Annotated[tuple[Annotated[int, msgspec.Meta(ge=0, le=2**40)], ...], msgspec.Meta(max_length=8)]
    sha256: str


def array_file(folder: Path, name: str) -> Path:
    """Return the file of an array in its folder."""
    return folder / f"{name}.npy"


def parse_entries(entries: object) -> dict[str, ArrayEntry]:
    """Convert the entries of a manifest; ValueError if they are none."""
    found = msgspec.convert(entries, dict[str, ArrayEntry])
    if wrong := next((name for name in found if not _NAME.fullmatch(name)), None):
        raise ValueError(f"{wrong!r:.80} is not the name of an array")
    return found


def write_arrays(folder: Path, arrays: Mapping[str, NDArray[Any]], *, flush: bool) -> dict[str, ArrayEntry]:
    """Write arrays to new files in a folder, and return their entries for the manifest.

    Args:
        folder: the folder, which exists.
        arrays: by name.
        flush: whether to flush each file to disk.

    Raises:
        OSError: they cannot be written.
        ValueError: an array holds Python objects.
    """
    import numpy as np  # here, because shells complete names of corpora without it

    entries = {}
    for name, array in arrays.items():
        whole = np.ascontiguousarray(array)
        if whole.dtype.hasobject:
            raise ValueError(f"{name}: Object arrays cannot be saved")
        header = _header(whole.dtype.str, *whole.shape)
        digest = hashlib.sha256(header)
        digest.update(whole.data)
        with array_file(folder, name).open("xb") as file:
            file.write(header)
            file.write(whole.data)
            if flush:
                file.flush()
                os.fsync(file.fileno())
        entries[name] = ArrayEntry(whole.dtype.str, whole.shape, digest.hexdigest())
    return entries


def open_arrays(folder: Path, entries: Mapping[str, ArrayEntry], *, verify: bool) -> dict[str, NDArray[Any]]:
    """Map the arrays of a folder into memory, read-only.

    Args:
        folder: the folder.
        entries: what the manifest states of each.
        verify: whether to compare the checksums.

    Raises:
        FormatError: a file is missing, or is not the one that was written.
    """
    arrays = {}
    for name, entry in entries.items():
        file = array_file(folder, name)
        try:
            with file.open("rb") as stream:
                is_right = not verify or hashlib.file_digest(stream, "sha256").hexdigest() == entry.sha256
            arrays[name] = _map(file, entry)
        except (OSError, ValueError) as error:
            raise FormatError(f"cannot be read as an array: {error}", path=file) from error
        if not is_right:
            raise FormatError("its checksum is not the manifest's", path=file)
    return arrays


def _map(file: Path, entry: ArrayEntry) -> NDArray[Any]:
    """Map an array; ValueError if the file does not begin with its header, or is too short."""
    import numpy as np

    header, count = _header(entry.type, *entry.shape), math.prod(entry.shape)
    with file.open("rb") as stream:
        if stream.read(len(header)) != header:
            raise ValueError("its type or shape is not the manifest's")
        if not count:
            return np.zeros(entry.shape, entry.type)
        data = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    return np.frombuffer(data, entry.type, count, len(header)).reshape(entry.shape)  # np.memmap slows every slice


@lru_cache(maxsize=1000)
def _header(kind: str, *shape: int) -> bytes:
    """Return the header of an array's file; comparing it takes a fifth of the time of parsing one."""
    import numpy as np

    written = io.BytesIO()
    np.lib.format.write_array_header_1_0(written, {"descr": kind, "fortran_order": False, "shape": shape})
    return written.getvalue()


def identify(folder: Path, manifest: bytes, names: Mapping[str, ArrayEntry]) -> str:
    """Return a hash of a manifest and of each file's inode, size and times.

    It is "" if a file is missing or younger than two seconds: clocks of file systems can be that coarse, and the file
    could change and keep its times.
    """
    digest, newest = hashlib.sha256(manifest), 0.0
    for file in [*(array_file(folder, name) for name in names), _CHECKED_BY]:
        try:
            found = file.stat()
        except OSError:
            return ""
        newest = max(newest, found.st_mtime, found.st_ctime)
        digest.update(repr((found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns)).encode())
    return digest.hexdigest() if time.time() - newest > 2.0 else ""


def is_checked(folder: Path, identity: str) -> bool:
    """Return whether the files of a folder were valid when they had this identity."""
    with suppress(OSError, ValueError):
        return bool(identity) and (folder / CHECKED).read_text("utf-8") == identity
    return False


def remember_checked(folder: Path, identity: str) -> None:
    """Note that the files of a folder are valid, where that can be written.

    Nobody can choose the time at which the system last changed a file, so no copied note is valid.
    """
    with suppress(OSError):
        if identity:
            replace_file(folder / CHECKED, identity.encode())
