"""Formats that other packages add, by their suffixes: see docs/how-to/plugins.md."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

from motionmind.body.motion import Motion
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.plugins import Group, added, failure, load, unfit

_GROUP: Group = "motionmind.formats"


@runtime_checkable
class MotionReader(Protocol):
    """A format to read; packages add one by an entry point in `motionmind.formats`, named after its suffix.

    >>> from motionmind.formats import MotionReader
    >>> class Dots:
    ...     def read_motion(self, path, *, fps):
    ...         ...
    >>> isinstance(Dots(), MotionReader)
    True
    """

    def read_motion(self, path: Path, *, fps: float | None) -> Motion:
        """Read a motion.

        Args:
            path: the file.
            fps: frames a second; None takes the file's own.

        Returns:
            The motion, in metres and seconds, Y up, on the file's own skeleton.

        Raises:
            FormatError: the file cannot be read.
        """
        ...


@runtime_checkable
class MotionWriter(Protocol):
    """A format to write; the object of one entry point may also be a `MotionReader`.

    >>> from motionmind.formats import MotionWriter
    >>> class Dots:
    ...     def motion_bytes(self, motion):
    ...         return b""
    ...     def lossy_fields(self, motion):
    ...         return ["all"]
    >>> isinstance(Dots(), MotionWriter)
    True
    """

    def motion_bytes(self, motion: Motion) -> bytes:
        """Encode a motion as the bytes of a file, which is written whole or not at all.

        Raises:
            MotionMindError: the format cannot hold this motion.
        """
        ...

    def lossy_fields(self, motion: Motion) -> Sequence[str]:
        """Name in words the parts of a motion that the format cannot hold; empty if nothing is lost."""
        ...


def added_suffixes() -> list[str]:
    """Return the suffixes that installed packages add, sorted, without importing the packages."""
    return [f".{name}" for name in added(_GROUP)]


def read_added(path: FilePath, fps: float | None) -> Motion:
    """Read a motion with the added format of the suffix.

    Raises:
        FormatError: the file cannot be read, or the format fails; the message names its package.
        MotionMindError: the format cannot be imported, or does not read.
    """
    name, found = _format(path)
    if not isinstance(found, MotionReader):
        raise unfit(_GROUP, name, "a MotionReader to be read")
    try:
        motion = found.read_motion(Path(path), fps=fps)
    except MotionMindError:
        raise
    except Exception as error:
        raise FormatError(failure(_GROUP, name, error), path=path) from error
    if not isinstance(motion, Motion):
        raise unfit(_GROUP, name, f"a MotionReader, which reads a Motion, not a {type(motion).__name__}")
    return motion


def write_added(path: FilePath, motion: Motion) -> None:
    """Write a motion with the added format of the suffix, whole or not at all.

    Raises:
        MotionMindError: the format cannot hold this motion, cannot be imported, fails, or does not write.
    """
    name, writer = _writer(path)
    try:
        data = writer.motion_bytes(motion)
    except MotionMindError:
        raise
    except Exception as error:
        raise MotionMindError(f"{path}: {failure(_GROUP, name, error)}") from error
    if not isinstance(data, bytes):
        raise unfit(_GROUP, name, f"a MotionWriter, which returns bytes, not a {type(data).__name__}")
    write_atomically(path, data)


def lossy_added(path: FilePath, motion: Motion) -> list[str]:
    """Name the parts of a motion that the added format of the suffix cannot hold."""
    name, writer = _writer(path)
    try:
        return [str(field) for field in writer.lossy_fields(motion)]
    except Exception as error:
        raise MotionMindError(f"{path}: {failure(_GROUP, name, error)}") from error


def _writer(path: FilePath) -> tuple[str, MotionWriter]:
    name, found = _format(path)
    if not isinstance(found, MotionWriter):
        raise unfit(_GROUP, name, "a MotionWriter to be written")
    return name, found


def _format(path: FilePath) -> tuple[str, object]:
    """Return the name of the suffix's added format, and its object, or an instance if the object is a class."""
    name = Path(path).suffix.lower().removeprefix(".")
    found = load(_GROUP, name)
    try:
        return name, found() if isinstance(found, type) else found
    except Exception as error:
        raise MotionMindError(failure(_GROUP, name, error)) from error
