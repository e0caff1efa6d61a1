"""Reads Acclaim's pair of files, as in CMU's database: a skeleton (ASF) and its movement (AMC).

Sources: M. Schafer, "Acclaim Skeleton File Definition V1.10" (1994), and the note on its lines kept by CMU's graphics
group, "Acclaim Format - ASF line details" (graphics.cs.cmu.edu/nsp/course/cs229/info/ACCLAIMdef.html).

Each bone becomes a joint at its start. In the joint's frame the bone's end, where its children start, is
`length * direction`; at rest all joints' axes are the world's. `axis` gives the frame C of the AMC's rotation R, so the
joint's local rotation is `C R inv(C)`.

Rotations apply in the listed order (`dof`, the root's `order`), about fixed axes: "rx ry rz" is Rz Ry Rx.

`length` in `:units` is the number of file units in an inch: 2.54 for centimetres, as in the definition, and 0.45 at
CMU. Metres are `value / length * 0.0254`; CMU states the same: (1.0/0.45)*2.54/100.0 (mocap.cs.cmu.edu/faqs.php).
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import NoReturn

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.noticeable import NOTICEABLE_M
from motionmind.body.rates import check_size
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, did_you_mean, enumerated, quoted
from motionmind.files import FilePath, name_of
from motionmind.formats._asf import Acclaim, fixed_axes, read_asf
from motionmind.formats.text import read_lines, to_numbers
from motionmind.geometry import rotations as rot


def read_amc(path: FilePath, asf: FilePath | None = None, *, fps: float = 120.0) -> Motion:
    """Read a motion from an AMC file; the bones of its ASF file become joints.

    Changes of a bone's length or place over time (`l`, `tx`, ... among its `dof`) are ignored, with a warning: the
    bone keeps its length and place in the ASF.

    Args:
        path: the AMC file; its stem becomes the motion's name.
        asf: the skeleton. None takes the ASF in the same folder with the same stem, or with the stem's part before "_"
            (135_06.amc: 135.asf), or the only ASF there.
        fps: frames per second, which the format does not record; CMU recorded at 120. A missing frame number leaves a
            gap in time.

    Returns:
        The motion, in metres and seconds, starting at time 0.

    Raises:
        FormatError: a file does not exist or is invalid; the message names file and line.

    Warns:
        MotionMindWarning: changes of bones' length or place were ignored.
    """
    if not (np.isfinite(fps) and fps > 0.0):
        raise MotionMindError(f"fps must be a positive number of frames a second, not {fps}")
    lines = read_lines(path)
    acclaim = read_asf(asf if asf is not None else _find_asf(path))
    numbers, values, degrees = _read_frames(lines, acclaim, path)
    check_size(len(values), max(len(acclaim.bones) - values.shape[1], 1), str(path))  # the file holds the rest
    rotations, root, ignored = _assemble(acclaim, values, degrees)
    if ignored:
        message = f"{path}: changes of the length or place of {enumerated(ignored)} are ignored"
        warnings.warn(message, MotionMindWarning, stacklevel=2)
    times = (numbers - numbers[0]) / fps
    return Motion(acclaim.skeleton(), rotations, root * acclaim.scale, times, name=name_of(path), rate=fps)


def _assemble(acclaim: Acclaim, values: Floats, degrees: bool) -> tuple[Floats, Floats, list[str]]:
    """Turn channel values [T, C] into local rotations [T, J, 4] and the root's places [T, 3] in the file's unit.

    Also return the names of bones whose changes of length or place are ignored.
    """
    rotations = np.tile(rot.IDENTITY, (len(values), len(acclaim.bones), 1))
    root = np.tile(acclaim.position, (len(values), 1))
    ignored = []
    column = 0
    for joint, bone in enumerate(acclaim.bones.values()):
        series = {channel: values[:, column + i] for i, channel in enumerate(bone.channels)}
        column += len(bone.channels)
        turns = [channel for channel in series if channel[0] == "R"]
        moves = [channel for channel in series if channel[0] != "R"]
        if turns:
            angles = np.stack([series[channel] for channel in turns], axis=-1)
            turned = fixed_axes("".join(channel[1] for channel in turns), np.radians(angles) if degrees else angles)
            rotations[:, joint] = rot.mul(bone.axis, rot.mul_inv(turned, bone.axis))
        if joint > 0 and any(np.any(np.abs(series[channel]) * acclaim.scale > NOTICEABLE_M) for channel in moves):
            ignored.append(bone.name)
        elif joint == 0:
            for axis, channel in enumerate(("TX", "TY", "TZ")):
                root[:, axis] += series.get(channel, 0.0)
    return rotations, root, ignored


def _find_asf(path: FilePath) -> Path:
    """Find the ASF file that belongs to an AMC file."""
    folder, stem = Path(path).parent, Path(path).stem.lower()
    try:
        found = sorted(file for file in folder.iterdir() if file.suffix.lower() == ".asf")
    except OSError:
        found = []
    for wanted in (stem, stem.split("_")[0]):
        for file in found:
            if file.stem.lower() == wanted:
                return file
    if len(found) == 1:
        return found[0]
    there = f"there are {enumerated(file.name for file in found)}" if found else "there is none"
    raise FormatError(f"its skeleton, an .asf file, was not found in {folder} ({there}): give its path", path=path)


def _read_frames(lines: list[str], acclaim: Acclaim, path: FilePath) -> tuple[Floats, Floats, bool]:
    """Read the frames' numbers [T], channel values [T, C] in the bones' order, and whether angles are in degrees."""
    columns: dict[str, slice] = {}
    column = 0
    for bone in acclaim.bones.values():
        if bone.channels:
            columns[bone.name] = slice(column, column + len(bone.channels))
            column += len(bone.channels)
    widths = {name: len(acclaim.bones[name].channels) for name in columns}
    degrees = acclaim.degrees
    numbers: list[int] = []
    values: list[list[float]] = []
    missing: set[str] = set()
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0].startswith(":"):
            degrees = {":DEGREES": True, ":RADIANS": False}.get(words[0].upper(), degrees)
        elif len(words) == 1 and words[0] not in acclaim.bones:
            _check_complete(missing, numbers, path, number)
            numbers.append(_frame_number(words[0], numbers, path, number))
            values.append([0.0] * column)
            missing = set(columns)
        else:
            if not numbers:
                raise FormatError("values before the number of their frame", path=path, line=number)
            name, *here = words
            if name not in missing or len(here) != widths[name]:
                _refuse_bone(words, columns, acclaim=acclaim, path=path, line=number)
            values[-1][columns[name]] = to_numbers(here, path, number)
            missing.remove(name)
    if not numbers:
        raise FormatError("no frames", path=path, line=len(lines))
    _check_complete(missing, numbers, path, len(lines))
    frames = np.array(values)
    return np.array(numbers, dtype=np.float64), frames, degrees


def _frame_number(word: str, before: list[int], path: FilePath, line: int) -> int:
    """Parse a frame's number; FormatError if it does not increase."""
    if not re.fullmatch(r"[0-9]{1,9}", word):
        raise FormatError(
            f"{quoted(word)} where a bone's values or a frame's number was expected", path=path, line=line
        )
    number = int(word)
    if before and number <= before[-1]:
        raise FormatError(f"frame {number} after frame {before[-1]}", path=path, line=line)
    return number


def _refuse_bone(
    words: list[str], columns: dict[str, slice], *, acclaim: Acclaim, path: FilePath, line: int
) -> NoReturn:
    """Raise FormatError for a line that does not match any bone missing from its frame."""
    name = words[0]
    if name not in columns:
        if name in acclaim.bones:
            fault = f"bone {name!r} has values here, but no dof in {acclaim.path}"
        else:
            fault = f"there is no bone {quoted(name)} in {acclaim.path}{did_you_mean(name, acclaim.bones)}"
        raise FormatError(fault, path=path, line=line)
    channels = acclaim.bones[name].channels
    if len(words) - 1 != len(channels):
        fault = f"{len(words) - 1} values for {name}, which has {len(channels)} ({' '.join(channels).lower()})"
        raise FormatError(fault, path=path, line=line)
    raise FormatError(f"a second line for {name} in the same frame", path=path, line=line)


def _check_complete(missing: set[str], numbers: list[int], path: FilePath, line: int) -> None:
    """Raise FormatError if bones are missing from the frame that ends before `line`."""
    if missing:
        raise FormatError(
            f"frame {numbers[-1]} ends without {enumerated(sorted(missing))}: is the file cut short?",
            path=path,
            line=line,
        )
