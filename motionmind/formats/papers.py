"""Reads and writes the papers' notation: text that holds only rotations.

The brace form is from Bradley and Stuart, "Using chaos to generate variations on movement sequences", Chaos 8:800
(1998): each posture in braces, with each joint's name and quaternion x, y, z, w, separated by semicolons:

    {pelvis, 0.37187, 0, 0, 0.92823; left hip, 0, 0, 0, 1; ...}

The line form is from Bradley, Capps, Luftig and Stuart, "Towards stylistic consonance in human movement synthesis",
Open AI Journal 4 (2010): one posture per line, each joint's name followed by its four numbers. The paper abbreviates
its listing; this is our reading:

    pelvis 0.37187 0 0 0.92823 left_hip 0 0 0 1 ...

In both, names are written with blanks, underscores or hyphens, in either case, and # begins a comment. There are no
times and no places: postures come at an even rate, and the body stands on the floor at the origin. The papers have no
rate; a comment before the first posture states one other than 1 posture a second:

    # 30 postures a second
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from typing import Literal

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.human import BODIES
from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_FPS
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, did_you_mean, enumerated, quoted
from motionmind.files import FilePath, name_of, write_atomically
from motionmind.formats.text import LENGTH_TOLERANCE, WRITTEN_LENGTH_TOLERANCE, read_lines, to_numbers
from motionmind.geometry import rotations as rot

_NUMBER = re.compile(r"[+-]?(\.?[0-9]|(inf|infinity|nan)\b)", re.IGNORECASE)  # begins no joint's name
_RATE = re.compile(r"\s*#\s*([0-9.]+(?:e[+-]?[0-9]+)?) postures a second\s*", re.IGNORECASE)

# One joint of a posture in the file: its name, the words of its four numbers, and their line.
_Entry = tuple[str, list[str], int]

Form = Literal["braces", "lines"]


def read_papers(path: FilePath, *, skeleton: Skeleton | None = None, rate: float | None = None) -> Motion:
    """Read a motion from a file in the papers' notation, in either form.

    Joints that the file never names stay at rest, with a warning (the papers' bodies had no fingers or toes). A joint
    that only some postures name is an error. The root stays above the origin, at such a height that each posture's
    lowest joint or tip touches the floor, y = 0.

    Args:
        path: the file; its stem becomes the motion's name.
        skeleton: the body whose joints are named; None takes human23, or human44 if it has more of the named joints.
        rate: postures per second; None takes the rate in a comment before the first posture, or 1.

    Returns:
        The motion, in metres and seconds.

    Raises:
        FormatError: the file does not exist, or is not in this notation; the message names file, line and joint.

    Warns:
        MotionMindWarning: joints stay at rest, or a quaternion's length was off by more than 1 %.
    """
    if rate is not None and not (np.isfinite(rate) and rate > 0.0):
        raise MotionMindError(f"a rate must be a positive number of postures a second, not {rate}")
    written = read_lines(path)
    rate = _stated_rate(written, path) if rate is None else rate
    lines = [line.split("#")[0] for line in written]
    braces = any("{" in line or "}" in line for line in lines)
    postures = list(_split_braces(lines, path) if braces else _split_lines(lines, path))
    if not postures:
        raise FormatError("no posture: write '{pelvis, 0, 0, 0, 1; ...}' or 'pelvis 0 0 0 1 ...'", path=path)
    body = _guess_body(postures) if skeleton is None else skeleton
    rotations = _rotations(postures, body, path)
    root = np.zeros((len(postures), 3))
    root[:, 1] = -body.positions_and_tips(rotations, root)[..., 1].min(axis=-1)
    return Motion(body, rotations, root, np.arange(len(postures), dtype=np.float64) / rate, name=name_of(path))


def write_papers(path: FilePath, motion: Motion, *, form: Form = "braces") -> None:
    """Write the rotations of `motion` in the papers' notation; the root and uneven times are lost.

    Read back, rotations agree to 1e-9. A comment states the rate, if it is even and not one posture a second.

    Args:
        path: the file to write.
        motion: the movement.
        form: "braces", with blanks in names as in the paper, or "lines", with underscores.

    Raises:
        MotionMindError: the notation cannot hold a joint's name, or the file cannot be written.
    """
    names = [_name_as_written(name, motion.skeleton, form) for name in motion.skeleton.names]
    states_rate = len(motion) > 1 and motion.is_even and abs(motion.fps - 1.0) > 1e-9
    lines = [f"# {motion.fps:.9g} postures a second"] * states_rate
    for rotation in np.asarray(np.round(motion.rotations, 10) + 0.0).tolist():
        numbers = [[f"{value:.10f}".rstrip("0").rstrip(".") for value in quaternion] for quaternion in rotation]
        if form == "braces":
            lines.append("{" + "; ".join(", ".join([n, *q]) for n, q in zip(names, numbers, strict=True)) + "}")
        else:
            lines.append(" ".join(" ".join([n, *q]) for n, q in zip(names, numbers, strict=True)))
    write_atomically(path, ("\n".join(lines) + "\n").encode())


def _name_as_written(name: str, skeleton: Skeleton, form: str) -> str:
    """Return a joint's name in the given form; MotionMindError if reading would not restore the joint."""
    words = name.replace("_", " ").split()
    plain = " ".join(words)
    clash = sum(_key(other) == _key(name) for other in skeleton.names) > 1
    if not words or set(plain) & set("{};,#") or any(_NUMBER.match(word) for word in words) or clash:
        raise MotionMindError(f"{skeleton.name}: the papers' notation cannot hold the joint name {quoted(name)}")
    return plain if form == "braces" else "_".join(words)


def _key(name: str) -> str:
    """Normalise a name for comparison."""
    return "_".join(re.split(r"[\s_-]+", name.strip().lower()))


# --- reading -------------------------------------------------------------------------------------------------------


def _stated_rate(lines: list[str], path: FilePath) -> float:
    """Return the postures a second stated by a comment before the first posture; 1 without one."""
    for number, line in enumerate(lines, start=1):
        if line.split("#")[0].strip():
            break
        if match := _RATE.fullmatch(line):
            (rate,) = to_numbers([match[1]], path, number)
            if not 0.0 < rate <= MAX_FPS:
                message = f"{match[1]} postures a second: must be more than 0, and at most {MAX_FPS:g}"
                raise FormatError(message, path=path, line=number)
            return rate
    return 1.0


def _split_braces(lines: list[str], path: FilePath) -> Iterator[list[_Entry]]:
    """Yield the postures of the brace form."""
    entries: list[_Entry] = []
    pieces: list[str] = []  # the current joint's text
    start, opened = 0, 0  # its line, and the line of the open brace
    for number, line in enumerate(lines, start=1):
        for piece in re.split(r"([{};])", line):
            if piece == "{" and not opened:
                entries, pieces, opened = [], [], number
            elif piece in ("}", ";") and opened:
                if pieces:
                    name, *numbers = (word.strip() for word in " ".join(pieces).split(","))
                    entries.append((name, numbers, start))
                pieces = []
                if piece == "}":
                    if not entries:
                        raise FormatError("a posture without joints", path=path, line=number)
                    yield entries
                    opened = 0
            elif piece in ("{", "}", ";") or (piece.strip() and not opened):
                raise FormatError(f"{quoted(piece.strip())} may not appear here", path=path, line=number)
            elif piece.strip():
                start = start if pieces else number
                pieces.append(piece)
    if opened:
        raise FormatError("the posture's '}' is missing: is the file cut short?", path=path, line=opened)


def _split_lines(lines: list[str], path: FilePath) -> Iterator[list[_Entry]]:
    """Yield the postures of the line form: words before a number are a name, numbers before a word its rotation."""
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


def _guess_body(postures: list[list[_Entry]]) -> Skeleton:
    """Return the built-in body that lacks the fewest of the named joints; the first of several."""
    named = {_key(name) for entries in postures for name, _, _ in entries}
    return min((body() for body in BODIES.values()), key=lambda body: len(named - set(body.names)))


def _rotations(postures: list[list[_Entry]], skeleton: Skeleton, path: FilePath) -> Floats:
    """Return unit quaternions [T, J, 4] of all postures; joints that no posture names are at rest."""
    rotations = np.tile(rot.IDENTITY, (len(postures), len(skeleton), 1))
    lines = np.zeros((len(postures), len(skeleton)), dtype=np.intp)
    index = {_key(name): joint for joint, name in reversed(list(enumerate(skeleton.names)))}  # the first of a name
    first: set[int] = set()
    for frame, entries in enumerate(postures):
        row: dict[int, list[float]] = {}
        for name, words, line in entries:
            joint = index.get(_key(name))
            if joint is None:
                hint = did_you_mean(_key(name), skeleton.names)
                raise FormatError(f"{skeleton.name} has no joint {quoted(name)}{hint}", path=path, line=line)
            if joint in row:
                message = f"{quoted(name)} for the second time in posture {frame}"
                raise FormatError(message, path=path, line=line)
            row[joint] = _quaternion(name, words, path, line)
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
    return _normalise(rotations, lines, skeleton, path)


def _quaternion(name: str, words: list[str], path: FilePath, line: int) -> list[float]:
    """Parse a joint's four numbers."""
    if len(words) != 4:
        message = f"{len(words)} numbers for {quoted(name)}, where the four of a quaternion x, y, z, w were expected"
        raise FormatError(message, path=path, line=line)
    return to_numbers(words, path, line)


def _normalise(rotations: Floats, lines: Indices, skeleton: Skeleton, path: FilePath) -> Floats:
    """Normalise quaternions [T, J, 4]; FormatError for zero, a warning for a length off by more than 1 %."""
    length = np.linalg.norm(rotations, axis=-1)
    if np.any(length < 1e-6):
        frame, joint = np.argwhere(length < 1e-6)[0]
        fault = f"the rotation of {skeleton.names[joint]} is zero, which is not a rotation (identity is 0 0 0 1)"
        raise FormatError(fault, path=path, line=int(lines[frame, joint]))
    off = np.argwhere(np.abs(length - 1.0) > LENGTH_TOLERANCE)
    if len(off):
        frame, joint = off[0]
        more = f", and {len(off) - 1} more like it" if len(off) > 1 else ""
        where = f"{path}:{lines[frame, joint]}: the rotation of {skeleton.names[joint]}"
        message = f"{where} has length {length[frame, joint]:.3g}, not 1{more}; made 1"
        warnings.warn(message, MotionMindWarning, stacklevel=4)
    off_written = np.abs(length - 1.0)[..., None] > WRITTEN_LENGTH_TOLERANCE
    return np.where(off_written, rotations / length[..., None], rotations)
