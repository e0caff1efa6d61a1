"""The notation of the papers, in and out: text that holds rotations only.

The form in braces is that of Bradley and Stuart, "Using chaos to generate variations on movement sequences", Chaos
8:800 (1998): one pair of braces a posture, in it each joint's name and quaternion x, y, z, w, joints apart by
semicolons; postures follow each other:

    {pelvis, 0.37187, 0, 0, 0.92823; left hip, 0, 0, 0, 1; ...}

The line form is that of Bradley, Capps, Luftig and Stuart, "Towards stylistic consonance in human movement synthesis",
Open AI Journal 4 (2010): one posture a line, each joint's name and its four numbers, one after the other. The paper's
listing is abbreviated; this is our reading of it:

    pelvis 0.37187 0 0 0.92823 left_hip 0 0 0 1 ...

In both, names are written with blanks, underscores or hyphens, in either case; what follows a # is a comment. There
are no times and no places: postures come at an even rate, and the body stands on the floor at the origin.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Literal

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.human import BODIES
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, did_you_mean, enumerated, quoted
from motionmind.files import FilePath, write_atomically
from motionmind.formats.text import read_lines, to_numbers
from motionmind.geometry import rotations as rot

# A number is what begins like one: joints' names do not.
_NUMBER = re.compile(r"[+-]?(\.?[0-9]|(inf|infinity|nan)\b)", re.IGNORECASE)

# Numbers printed with five digits, as the papers do, are off unit length by about 1e-5; only more is worth a word.
_PRINTED = 1e-3
_WRITTEN = 1e-9

# One joint as it stands in the file: its name, the four words that should be numbers, and their line.
_Entry = tuple[str, list[str], int]

Form = Literal["braces", "lines"]


def read_papers(path: FilePath, *, skeleton: Skeleton | None = None, rate: float = 1.0) -> Motion:
    """Movement from a file in the papers' notation, in either form.

    Joints that the file never names stand at rest; a warning names them (the papers' bodies had no fingers or
    toes). A joint that some postures name and others do not is an error. The root stands above the origin, as high
    as lets the lowest joint or tip of each posture touch the floor, y = 0.

    Args:
        path: the file; its stem becomes the motion's name.
        skeleton: the body whose joints are named; None takes human23, or human44 where only that has joints that are
            named.
        rate: postures a second.

    Raises:
        FormatError: the file is not there, or is not in this notation; the message names file, line and joint.

    Warns:
        MotionMindWarning: joints stand at rest, or a quaternion's length was off by more than 1e-3.
    """
    if not (np.isfinite(rate) and rate > 0.0):
        raise MotionMindError(f"a rate must be a positive number of postures a second, not {rate}")
    lines = [line.split("#")[0] for line in read_lines(path)]
    braces = any("{" in line or "}" in line for line in lines)
    postures = list(_split_braces(lines, path) if braces else _split_lines(lines, path))
    if not postures:
        raise FormatError("no posture: write '{pelvis, 0, 0, 0, 1; ...}' or 'pelvis 0 0 0 1 ...'", path=path)
    body = _body(postures) if skeleton is None else skeleton
    rotations = _rotations(postures, body, path)
    root = np.zeros((len(postures), 3))
    root[:, 1] = -body.positions_and_tips(rotations, root)[..., 1].min(axis=-1)
    return Motion(body, rotations, root, np.arange(len(postures), dtype=np.float64) / rate, name=Path(path).stem)


def write_papers(path: FilePath, motion: Motion, *, form: Form = "braces") -> None:
    """Write the rotations of `motion` in the papers' notation; the notation has no place for root and times.

    Read back, rotations agree to 1e-9. Names are written with blanks in braces, as the papers do, and with
    underscores in lines.

    Raises:
        MotionMindError: a joint's name cannot stand in the notation, or the file cannot be written.
    """
    names = [_written(name, motion.skeleton, form) for name in motion.skeleton.names]
    lines = []
    for rotation in np.asarray(np.round(motion.rotations, 10) + 0.0).tolist():
        numbers = [[f"{value:.10f}".rstrip("0").rstrip(".") for value in quaternion] for quaternion in rotation]
        if form == "braces":
            lines.append("{" + "; ".join(", ".join([n, *q]) for n, q in zip(names, numbers, strict=True)) + "}")
        else:
            lines.append(" ".join(" ".join([n, *q]) for n, q in zip(names, numbers, strict=True)))
    write_atomically(path, ("\n".join(lines) + "\n").encode())


def _written(name: str, skeleton: Skeleton, form: str) -> str:
    words = name.replace("_", " ").split()
    plain = " ".join(words)
    clash = sum(_key(other) == _key(name) for other in skeleton.names) > 1
    if not words or set(plain) & set("{};,#") or any(_NUMBER.match(word) for word in words) or clash:
        raise MotionMindError(
            f"{skeleton.name}: the papers' notation has no way to write the joint name {quoted(name)}"
        )
    return plain if form == "braces" else "_".join(words)


def _key(name: str) -> str:
    """A name as it is compared."""
    return "_".join(re.split(r"[\s_-]+", name.strip().lower()))


# --- in ------------------------------------------------------------------------------------------------------------


def _split_braces(lines: list[str], path: FilePath) -> Iterator[list[_Entry]]:
    """The postures of the form in braces."""
    entries: list[_Entry] = []
    text, start, opened = "", 0, 0  # the joint that is being read, its line, and the line of the open brace
    for number, line in enumerate(lines, start=1):
        for piece in re.split(r"([{};])", line):
            if piece == "{" and not opened:
                entries, text, opened = [], "", number
            elif piece in ("}", ";") and opened:
                if text.strip():
                    name, *numbers = (word.strip() for word in text.split(","))
                    entries.append((name, numbers, start))
                text = ""
                if piece == "}":
                    if not entries:
                        raise FormatError("a posture that names no joint", path=path, line=number)
                    yield entries
                    opened = 0
            elif piece in ("{", "}", ";") or (piece.strip() and not opened):
                raise FormatError(f"{quoted(piece.strip())} may not stand here", path=path, line=number)
            else:
                start = start if text.strip() else number
                text += piece + " "
    if opened:
        raise FormatError("the posture's '}' is missing: is the file cut short?", path=path, line=opened)


def _split_lines(lines: list[str], path: FilePath) -> Iterator[list[_Entry]]:
    """The postures of the line form: words up to a number are a name, the numbers up to a word are its own."""
    for number, line in enumerate(lines, start=1):
        entries: list[_Entry] = []
        name: list[str] = []
        numbers: list[str] = []
        for word in line.replace(",", " ").split():
            if _NUMBER.match(word):
                if not name:
                    raise FormatError(f"{quoted(word)} where a joint's name was expected", path=path, line=number)
                numbers.append(word)
                continue
            if numbers:
                entries.append((" ".join(name), numbers, number))
                name, numbers = [], []
            name.append(word)
        if name:
            entries.append((" ".join(name), numbers, number))
        if entries:
            yield entries


def _body(postures: list[list[_Entry]]) -> Skeleton:
    """The first of the bodies that go by their names that lacks the fewest of the joints that are named."""
    named = {_key(name) for entries in postures for name, _, _ in entries}
    return min((body() for body in BODIES.values()), key=lambda body: len(named - set(body.names)))


def _rotations(postures: list[list[_Entry]], skeleton: Skeleton, path: FilePath) -> Floats:
    """Unit quaternions [T, J, 4] of all postures; joints that none of them names are at rest."""
    find = cache(partial(_find, skeleton=skeleton))
    rotations = np.tile(rot.IDENTITY, (len(postures), len(skeleton), 1))
    lines = np.zeros((len(postures), len(skeleton)), dtype=np.intp)
    first: set[int] = set()
    for frame, entries in enumerate(postures):
        row: dict[int, list[float]] = {}
        for name, words, line in entries:
            joint = find(name)
            fault = ""
            if joint is None:
                fault = f"{skeleton.name} has no joint {quoted(name)}{did_you_mean(_key(name), skeleton.names)}"
            elif joint in row:
                fault = f"{quoted(name)} for the second time in posture {frame}"
            elif len(words) != 4:
                fault = (
                    f"{len(words)} numbers for {quoted(name)}, where the four of a quaternion x, y, z, w were expected"
                )
            if joint is None or fault:
                raise FormatError(fault, path=path, line=line)
            row[joint] = to_numbers(words, path, line)
            lines[frame, joint] = line
        named = set(row)
        first = named if frame == 0 else first
        if named != first:
            odd = min(named ^ first)
            fault = f"posture {frame} {'names' if odd in named else 'lacks'} {skeleton.names[odd]}, unlike the first"
            raise FormatError(fault, path=path, line=entries[-1][2])
        rotations[frame, list(row)] = list(row.values())
    unnamed = [name for joint, name in enumerate(skeleton.names) if joint not in first]
    if unnamed:
        warnings.warn(f"{path}: {enumerated(unnamed)} are not named and stand at rest", MotionMindWarning, stacklevel=3)
    return _unit(rotations, lines, skeleton, path)


def _find(name: str, skeleton: Skeleton) -> int | None:
    keys = [_key(joint) for joint in skeleton.names]
    return keys.index(_key(name)) if _key(name) in keys else None


def _unit(rotations: Floats, lines: Indices, skeleton: Skeleton, path: FilePath) -> Floats:
    """The quaternions [T, J, 4] made unit; a zero is an error, far from unit a warning."""
    length = np.linalg.norm(rotations, axis=-1)
    if np.any(length < 1e-6):
        frame, joint = np.argwhere(length < 1e-6)[0]
        fault = f"the rotation of {skeleton.names[joint]} is zero, which is no rotation (no rotation is 0 0 0 1)"
        raise FormatError(fault, path=path, line=int(lines[frame, joint]))
    off = np.argwhere(np.abs(length - 1.0) > _PRINTED)
    if len(off):
        frame, joint = off[0]
        more = f", and {len(off) - 1} more like it" if len(off) > 1 else ""
        where = f"{path}:{lines[frame, joint]}: the rotation of {skeleton.names[joint]}"
        message = f"{where} has length {length[frame, joint]:.6g}, not 1{more}; made 1"
        warnings.warn(message, MotionMindWarning, stacklevel=4)
    # What this module wrote stays as it is.
    return np.where(np.abs(length - 1.0)[..., None] > _WRITTEN, rotations / length[..., None], rotations)
