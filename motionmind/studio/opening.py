"""Open a project's file; if a line of it is damaged, open what comes before as a copy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError, enumerated
from motionmind.files import create_file, read_bytes
from motionmind.studio.journal import DamagedError, beside, head_line
from motionmind.studio.project import Project
from motionmind.studio.records import decode_line


def open_project(path: Path, corpus: str, home: Path | None = None) -> Project:
    """Open a project, or a copy of its lines before a damaged one; the damaged file stays as it is.

    If the first line is damaged, the copy has a new one, and all lines up to the next damage. The project's `words` say
    what was opened.

    Args:
        path: the project's file.
        corpus: the corpus that judges and smooths, if the first line is damaged.
        home: the folder of the user's corpora; None for the default folder.

    Raises:
        FormatError: the file is not a project's, or of another version.
        MotionMindError: it is open elsewhere, or cannot be read; or the copy cannot be written.
    """
    try:
        return Project.open(path, home)
    except DamagedError as error:
        damage = error
    lines = read_bytes(path).split(b"\n")
    if not _is_record(lines[-1]):  # empty, or incomplete, which is no loss
        lines.pop()
    damaged = [damage.number]
    if damage.number == 0:
        if not any(map(_is_record, lines[1:])):
            raise damage
        lines[0] = head_line(title=displayed(path.stem), corpus=corpus, corpora={}).rstrip()
    else:
        del lines[damage.number :]
    while True:
        copy = _write_copy(path, lines)
        try:
            project = Project.open(copy, home)
            break
        except DamagedError as error:
            copy.unlink()
            damaged = [*damaged[: damage.number == 0], error.number]
            del lines[error.number :]
    project.words.insert(0, _words(path, copy, damaged, len(project.changes)))
    return project


def _is_record(line: bytes) -> bool:
    """Return whether a line is one of a project's file."""
    try:
        decode_line(line)
    except (ValueError, RecursionError):
        return False
    return True


def _write_copy(path: Path, lines: Sequence[bytes]) -> Path:
    """Write lines to a new file beside a damaged one."""
    for copy in beside(path):
        try:
            create_file(copy, b"".join(line + b"\n" for line in lines))
        except FileExistsError:
            continue
        except OSError as error:
            reason = f"a copy of its sound lines cannot be written: {error.strerror or error}"
            raise MotionMindError(f"{path}: is damaged, and {reason}") from error
        return copy
    raise AssertionError


def _words(path: Path, copy: Path, damaged: Sequence[int], edits: int) -> str:
    """Describe what was opened of a damaged file, given the numbers of its damaged lines."""
    file, numbers = displayed_path(path), enumerated([str(number + 1) for number in damaged])
    place = f"line{'s' * (len(damaged) > 1)} {numbers}"
    count = f"{edits} edit{'s' * (edits != 1)}"
    which = f"the {count} before line {damaged[-1] + 1}" if damaged[-1] else f"all {count}"
    return f"{file} is damaged in {place} and stays as it is: a copy with {which} is open, {displayed_path(copy)}"
