"""Reading and writing whole files: one clear error if a file cannot be read, and never a half-written file."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

from motionmind.errors import FormatError, MotionMindError

FilePath = str | os.PathLike[str]


def read_bytes(path: FilePath) -> bytes:
    """Return all bytes of the file at `path`; FormatError if it does not exist or cannot be read."""
    try:
        return Path(path).read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise FormatError(f"cannot be read: {_reason(error)}", path=path) from error


def write_atomically(path: FilePath, data: bytes) -> None:
    """Write `data` to `path` atomically: a reader finds either the old file or the new one, never a part.

    The bytes go to a temporary file in the same folder, are flushed to disk, and are moved into place. Links are
    followed, and the permissions of a replaced file are kept. Anything but a regular file (a pipe, `/dev/stdout`) is
    written to directly.

    Raises:
        MotionMindError: writing failed; the temporary file is removed.
    """
    try:
        given = Path(path)
        mode = given.stat().st_mode if given.exists() else None
        if mode is not None and not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            given.write_bytes(data)
            return
        target = Path(os.path.realpath(path))
        if mode is not None and stat.S_ISDIR(mode):
            raise IsADirectoryError(0, "it is a folder")
        _write_beside_and_move(target, data, mode)
    except (OSError, ValueError) as error:
        raise MotionMindError(f"{os.fspath(path)}: cannot be written: {_reason(error)}") from error


def _write_beside_and_move(target: Path, data: bytes, mode: int | None) -> None:
    temporary = target.with_name(f".motionmind-{os.urandom(8).hex()}.tmp")
    try:
        # Not tempfile: it makes files private to their owner, whatever the umask.
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if mode is not None:
            temporary.chmod(stat.S_IMODE(mode))
        temporary.replace(target)
    except BaseException:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def _reason(error: OSError | ValueError) -> str:
    if isinstance(error, FileNotFoundError):
        return "there is no such file or folder"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror[0].lower() + error.strerror[1:]
    return str(error)
