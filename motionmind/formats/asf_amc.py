"""Acclaim's pair of files, in: a skeleton (ASF) and movement of that skeleton (AMC), as CMU's database has them.

Sources: M. Schafer, "Acclaim Skeleton File Definition V1.10" (1994), and the note on its lines that CMU's graphics
group keeps, "Acclaim Format - ASF line details" (graphics.cs.cmu.edu/nsp/course/cs229/info/ACCLAIMdef.html).

its tip (or its children's place) is `length * direction`, and at rest all joints' axes are the world's. `axis` gives
the frame C in which the angles of the AMC turn, R, so that the joint's local rotation is `C R inv(C)`.

Turns follow the order in which they are listed (`dof`, the root's `order`), about fixed axes: "rx ry rz" is Rz Ry Rx.

`length` of `:units` is how many units of the file are an inch: 2.54 if it is in centimetres, as the definition
has it, and 0.45 at CMU. Metres are `value / length * 0.0254`; CMU states the same: (1.0/0.45)*2.54/100.0
(mocap.cs.cmu.edu/faqs.php).
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, did_you_mean, enumerated, quoted
from motionmind.files import FilePath
from motionmind.formats._asf import Acclaim, fixed_axes, read_asf
from motionmind.formats.text import read_lines, to_numbers
from motionmind.geometry import rotations as rot


def read_amc(path: FilePath, asf: FilePath | None = None, *, fps: float = 120.0) -> Motion:
    """Movement from an AMC file, on the bones of its ASF file as joints, in metres.

    Bones whose length or place changes with time (`l`, `tx`, ... among their `dof`) keep those of the ASF; a
    warning says so.

    Args:
        path: the AMC file; its stem becomes the motion's name.
        asf: the skeleton. None takes the ASF in the same folder with the same stem, or with the part of it before
            "_" (135_06.amc: 135.asf), or the only one there.
        fps: frames a second, which the format does not say; CMU recorded 120. Frames that the file's numbering
            leaves out leave a gap in time.

    Raises:
        FormatError: a file is not there or is faulty; the message names file and line.

    Warns:
        MotionMindWarning: a bone's changes of length or place were left out.
    """
    if not (np.isfinite(fps) and fps > 0.0):
        raise MotionMindError(f"fps must be a positive number of frames a second, not {fps}")
    lines = read_lines(path)
    acclaim = read_asf(asf if asf is not None else _find_asf(path))
    numbers, values, degrees = _read_frames(lines, acclaim, path)
    skeleton = acclaim.skeleton()
    rotations = np.tile(rot.IDENTITY, (len(values), len(skeleton), 1))
    root = np.tile(acclaim.position, (len(values), 1))
    left_out = []
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
        if joint > 0 and any(np.any(series[channel] != 0.0) for channel in moves):
            left_out.append(bone.name)
        elif joint == 0:
            for axis, channel in enumerate(("TX", "TY", "TZ")):
                root[:, axis] += series.get(channel, 0.0)
    if left_out:
        message = f"{path}: changes of the length or place of {enumerated(left_out)} are left out"
        warnings.warn(message, MotionMindWarning, stacklevel=2)
    return Motion(skeleton, rotations, root * acclaim.scale, (numbers - numbers[0]) / fps, name=Path(path).stem)


def _find_asf(path: FilePath) -> Path:
    """The ASF file that belongs to an AMC file."""
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
    raise FormatError(f"its skeleton, an .asf file, was not found in {folder} ({there}): name it", path=path)


def _read_frames(lines: list[str], acclaim: Acclaim, path: FilePath) -> tuple[Floats, Floats, bool]:
    """Numbers of the frames [T], the bones' values [T, C] in the bones' order, and whether angles are degrees."""
    places: dict[str, slice] = {}
    column = 0
    for bone in acclaim.bones.values():
        if bone.channels:
            places[bone.name] = slice(column, column + len(bone.channels))
            column += len(bone.channels)
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
            _check_whole(missing, numbers, path, number)
            numbers.append(_frame_number(words[0], numbers, path, number))
            values.append([0.0] * column)
            missing = set(places)
        else:
            if not numbers:
                raise FormatError("values before the number of their frame", path=path, line=number)
            place = _place_of(words, places, missing, acclaim=acclaim, path=path, line=number)
            values[-1][place] = to_numbers(words[1:], path, number)
            missing.remove(words[0])
    if not numbers:
        raise FormatError("no frames", path=path, line=len(lines))
    _check_whole(missing, numbers, path, len(lines))
    frames = np.array(values)
    return np.array(numbers, dtype=np.float64), frames, degrees


def _frame_number(word: str, before: list[int], path: FilePath, line: int) -> int:
    if not re.fullmatch(r"[0-9]{1,9}", word):
        raise FormatError(
            f"{quoted(word)} where a bone's values or a frame's number was expected", path=path, line=line
        )
    number = int(word)
    if before and number <= before[-1]:
        raise FormatError(f"frame {number} after frame {before[-1]}", path=path, line=line)
    return number


def _place_of(
    words: list[str], places: dict[str, slice], missing: set[str], *, acclaim: Acclaim, path: FilePath, line: int
) -> slice:
    """Where the values of a line belong in their frame."""
    name = words[0]
    if name not in places:
        if name in acclaim.bones:
            fault = f"bone {name!r} has values here, but no dof in {acclaim.path}"
        else:
            fault = f"there is no bone {quoted(name)} in {acclaim.path}{did_you_mean(name, acclaim.bones)}"
        raise FormatError(fault, path=path, line=line)
    place = places[name]
    channels = acclaim.bones[name].channels
    if len(words) - 1 != len(channels):
        fault = f"{len(words) - 1} values for {name}, which has {len(channels)} ({' '.join(channels).lower()})"
        raise FormatError(fault, path=path, line=line)
    if name not in missing:
        raise FormatError(f"a second line for {name} in the same frame", path=path, line=line)
    return place


def _check_whole(missing: set[str], numbers: list[int], path: FilePath, line: int) -> None:
    if missing:
        raise FormatError(
            f"frame {numbers[-1]} ends without {enumerated(sorted(missing))}: is the file cut short?",
            path=path,
            line=line,
        )
