"""Read and write whole files: one clear error if a file cannot be read, and never a half-written file."""

from __future__ import annotations

import errno
import hashlib
import mmap
import os
import re
import stat
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from motionmind.errors import FormatError, MotionMindError

if TYPE_CHECKING:
    from numpy.typing import NDArray

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

FilePath = str | os.PathLike[str]

_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_LONG_KEY = re.compile(rf"(?<![\w-])(?:{_PART}){{20}}")

TEMPORARY = re.compile(r"\.motionmind-(?:(\d+)-)?[0-9a-f]{16}\.tmp")  # with the number of the writing process
_DAY_S = 86400.0
_RETRY_PAUSES_S = (0.01, 0.03, 0.1, 0.3, 0.5)  # while another program holds a file open


def name_of(path: FilePath) -> str:
    """Return a file's name without its suffix, as text (`as_text`)."""
    return as_text(Path(path).stem)


def as_text(name: str) -> str:
    """Return a file's name as text that can be encoded: bytes that are not UTF-8 become escapes."""
    return name.encode("utf-8", "backslashreplace").decode()


def read_bytes(path: FilePath) -> bytes:
    """Return all bytes of the file at `path`; FormatError if it is missing, unreadable or a terminal.

    A pipe yields its bytes once; the context of `pipes_kept` keeps them for later reads.
    """
    data = _read(path)
    if (recorded := _recorded.get()) is not None:
        recorded[str(Path(path).absolute())] = hashlib.sha256(data).hexdigest()
    return data


def _read(path: FilePath) -> bytes:
    kept = _kept.get()
    try:
        status = Path(path).stat()
        place = status.st_dev, status.st_ino
        if kept is not None and place in kept:
            return kept[place]
        with Path(path).open("rb") as file:
            if file.isatty():
                raise FormatError("cannot be read: it is a terminal", path=path)
            data = file.read()
        if kept is not None and stat.S_ISFIFO(status.st_mode):
            kept[place] = data
        return data
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise FormatError(f"cannot be read: {_reason(error)}", path=path) from error


_kept: ContextVar[dict[tuple[int, int], bytes] | None] = ContextVar("kept", default=None)


def give_back(array: NDArray[Any]) -> None:
    """Release the pages of a mapped array, if it is one; the system reads them again when needed."""
    base: Any = array
    while base is not None and not isinstance(base, mmap.mmap):
        base = getattr(base, "base", None)
    if base is not None and hasattr(mmap, "MADV_DONTNEED"):
        base.madvise(mmap.MADV_DONTNEED)


@contextmanager
def pipes_kept() -> Iterator[None]:
    """Keep the bytes read from pipes in the context, so that each pipe can be read again like a file."""
    token = _kept.set({})
    try:
        yield
    finally:
        _kept.reset(token)


_recorded: ContextVar[dict[str, str] | None] = ContextVar("recorded", default=None)


@contextmanager
def reads_recorded() -> Iterator[dict[str, str]]:
    """Record the files read in the context; yield their hashes (SHA-256), by absolute path."""
    recorded: dict[str, str] = {}
    token = _recorded.set(recorded)
    try:
        yield recorded
    finally:
        _recorded.reset(token)


def parse_toml(text: str) -> dict[str, Any]:
    """Parse TOML with keys of at most 20 parts: the parser's memory grows with the square of their number.

    Raises:
        ValueError: the text is not such TOML; the message gives the line.
        RecursionError: the nesting is too deep.
    """
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise ValueError(f"a key of more than 20 parts (at line {line})")
    return tomllib.loads(text)


def format_toml_string(text: str) -> str:
    """Return a text as a basic string of TOML.

    Raises:
        MotionMindError: the text has a surrogate, as names of files that are not UTF-8 do.

    Examples:
        >>> from motionmind.files import format_toml_string
        >>> print(format_toml_string('the "hero"'))
        "the \\"hero\\""
    """
    if any("\ud800" <= c <= "\udfff" for c in text):
        raise MotionMindError(f"{text!r:.300}: cannot be written in TOML, which is UTF-8; rename the file")
    escapes = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
    return '"' + "".join(escapes.get(c, c if c.isprintable() else f"\\U{ord(c):08X}") for c in text) + '"'


def write_atomically(path: FilePath, data: bytes) -> None:
    """Write `data` to `path` atomically: a reader finds either the old file or the new one, never a part.

    Write a temporary file in the same folder, flush it to disk, and move it into place. Follow links, and keep the
    permissions of a replaced file. Write directly to anything but a regular file (a pipe, `/dev/stdout`). In the
    context of `all_or_none` the move waits for its end.

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
        if (held_back := _held_back.get()) is None:
            replace_file(target, data, mode)
        else:
            held_back.append(Written(given, target, _write_beside(target, data, mode), not given.exists()))
    except (OSError, ValueError) as error:
        raise MotionMindError(f"{os.fspath(path)}: cannot be written: {_reason(error)}") from error


class Written(NamedTuple):
    """A file written beside its target.

    Attributes:
        path: the path given.
        target: where to move it, links followed.
        temporary: the temporary file.
        is_new: whether the target did not exist.
    """

    path: Path
    target: Path
    temporary: Path
    is_new: bool


_held_back: ContextVar[list[Written] | None] = ContextVar("held_back", default=None)


@contextmanager
def all_or_none() -> Iterator[list[Written]]:
    """Hold back the files written atomically in the context, and move them into place together at its end.

    If an error or Ctrl-C ends the context, existing files stay as they were, and no new ones appear.

    Yields:
        The files so far.

    Raises:
        MotionMindError: a file cannot be moved into place.
    """
    held_back: list[Written] = []
    moved: list[Written] = []
    token = _held_back.set(held_back)
    try:
        yield held_back
        for one in held_back:
            try:
                _move(one.temporary, one.target)
            except OSError as error:
                raise MotionMindError(f"{one.path}: cannot be written: {_reason(error)}") from error
            moved.append(one)
        for folder in {one.target.parent for one in moved}:
            sync_folder(folder)
    except BaseException:
        for one in held_back:
            with suppress(OSError):
                (one.target if one.is_new and one in moved else one.temporary).unlink(missing_ok=True)
        raise
    finally:
        _held_back.reset(token)


def sha256_of(written: Sequence[Written], path: Path | None) -> str | None:
    """Return the hash of the file written to `path`; None if there is none, as for a pipe."""
    return next((hashlib.sha256(one.temporary.read_bytes()).hexdigest() for one in written if one.path == path), None)


def replace_file(target: Path, data: bytes, mode: int | None = None) -> None:
    """Write a file beside `target`, flush it, move it there and flush the folder; OSError if that fails.

    Remove temporary files that killed processes left in the folder.

    Args:
        target: the file; a regular file there is replaced.
        data: the file's bytes.
        mode: its permissions; None for those of a new file.
    """
    temporary = _write_beside(target, data, mode)
    try:
        _move(temporary, target)
    except BaseException:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise
    sync_folder(target.parent)


def create_file(target: Path, data: bytes) -> None:
    """Write a new file atomically; FileExistsError if there is one, another OSError if that fails."""
    temporary = _write_beside(target, data, None)
    try:
        try:
            os.link(temporary, target)  # unlike a move, it never replaces a file
        except FileExistsError:
            raise
        except OSError:  # some file systems have no links
            if os.path.lexists(target):
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST)) from None
            _move(temporary, target)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
    try:
        sync_folder(target.parent)
    except BaseException:
        with suppress(OSError):
            target.unlink()
        raise


def _write_beside(target: Path, data: bytes, mode: int | None) -> Path:
    """Write and flush a temporary file in the folder of `target`, and return its path; leave nothing if that fails."""
    _remove_leftovers(target.parent)
    temporary = target.with_name(f".motionmind-{os.getpid()}-{os.urandom(8).hex()}.tmp")
    try:
        # Not tempfile: it makes files private to their owner, whatever the umask.
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if mode is not None:
            temporary.chmod(stat.S_IMODE(mode))
    except BaseException:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise
    return temporary


def make_folder(folder: Path) -> None:
    """Make a folder and its missing parents, and flush them to disk."""
    if not folder.is_dir():
        make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        sync_folder(folder.parent)


def sync_folder(folder: Path) -> None:
    """Flush the entries of a folder to disk, where the system can."""
    if os.name == "nt":  # Windows cannot open folders, and logs their changes in order
        return
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except PermissionError:  # a folder that is writable but not readable
        return
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some file systems cannot flush folders
            raise
    finally:
        os.close(descriptor)


def lock_alone(descriptor: int) -> bool:
    """Lock an open file for this process until it is closed; return False if another process holds the lock."""
    try:
        if sys.platform == "win32":
            os.lseek(descriptor, 2**40, os.SEEK_SET)  # lock one byte, far behind the end
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _move(source: Path, target: Path) -> None:
    """Move a file over another atomically; wait up to a second while a program holds that open (Windows)."""
    for pause in (*_RETRY_PAUSES_S, None):
        try:
            source.replace(target)
            return
        except PermissionError:
            if pause is None:
                raise
            time.sleep(pause)


def _remove_leftovers(folder: Path) -> None:
    """Remove the temporary files of dead processes."""
    with suppress(OSError):
        for entry in os.scandir(folder):
            if parts := TEMPORARY.fullmatch(entry.name):
                with suppress(OSError):
                    age = time.time() - entry.stat(follow_symlinks=False).st_mtime
                    # The process may run on another machine that shares the folder, or reuse the number of a dead one.
                    if age > _DAY_S or (age > 60.0 and parts[1] and not _runs(int(parts[1]))):
                        Path(entry.path).unlink()


def _runs(process: int) -> bool:
    """Return whether a process of this number runs on this machine; True where the system cannot tell."""
    if os.name == "nt":  # where the query would end the process
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _reason(error: OSError | ValueError) -> str:
    if isinstance(error, FileNotFoundError):
        return "there is no such file or folder"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror[0].lower() + error.strerror[1:]
    return str(error)
