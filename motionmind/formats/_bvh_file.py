"""Reads the parts of a BVH file: the hierarchy, and the values of its channels in each frame."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import islice, takewhile
from pathlib import Path

import numpy as np

from motionmind._typing import Floats
from motionmind.body.rates import check_size
from motionmind.body.skeleton import Skeleton
from motionmind.clip_names import distinct_names, find_name
from motionmind.errors import FormatError, enumerated, quoted
from motionmind.files import FilePath, name_of
from motionmind.formats._bvh_hierarchy import BvhJoint, is_comment, read_hierarchy
from motionmind.formats._bvh_rig import Placed
from motionmind.formats.text import MAX_NUMBER, read_lines, to_number, to_numbers
from motionmind.geometry import rotations as rot

_FRAMES = re.compile(r"\s*Frames\s*:?\s*(\S*)\s*", re.IGNORECASE)
_FRAME_TIME = re.compile(r"\s*Frame\s*Time\s*:?\s*(\S*)\s*", re.IGNORECASE)

_MAX_HEAD_LINES = 100_000  # above MOTION


@dataclass(frozen=True)
class BvhFile:
    """The parts of a BVH file.

    Attributes:
        hierarchy: the lines above MOTION, as they stand in the file.
        joints: the joints in them, parents before children.
        values: the values of these joints' channels, in the file's order and units [T, C].
        declared: the header's number of frames.
        frame_time: the header's seconds per frame.
        rows: the lines of the frames, as they stand in the file, each with its number.
    """

    hierarchy: list[str]
    joints: list[BvhJoint]
    values: Floats
    declared: int
    frame_time: float
    rows: list[tuple[int, str]]

    @property
    def bodies(self) -> tuple[str, ...]:
        """The bodies' names: those of their roots, made distinct (`distinct_names`)."""
        return distinct_names([joint.name for joint in self.joints if joint.parent < 0])

    def body(self, number: int) -> BvhFile:
        """Return the file with the hierarchy and values of one of its bodies, counted from 0, and no rows."""
        roots = [i for i, joint in enumerate(self.joints) if joint.parent < 0]
        start, end = roots[number], [*roots, len(self.joints)][number + 1]
        columns = np.cumsum([0, *(len(joint.channels) for joint in self.joints)])
        joints = [replace(joint, parent=max(joint.parent - start, -1)) for joint in self.joints[start:end]]
        starts = [*(self.joints[root].line - 1 for root in roots), len(self.hierarchy)]
        own = self.hierarchy[: starts[0]] + self.hierarchy[starts[number] : starts[number + 1]]
        return replace(
            self, hierarchy=own, joints=joints, values=self.values[:, columns[start] : columns[end]], rows=[]
        )


def count_bodies(path: FilePath) -> int:
    """Count the ROOTs of a BVH file without reading its frames; 0 if it cannot be read."""
    try:
        with Path(path).open("rb") as file:
            head = iter(file.readline, b"")
            lines = takewhile(lambda line: line.strip().upper() != b"MOTION", islice(head, _MAX_HEAD_LINES))
            return sum(line.split(None, 1)[:1] == [b"ROOT"] for line in lines)
    except OSError:
        return 0


def read_body(path: FilePath, clip: str | None) -> BvhFile:
    """Read one body of a BVH file: the only one, or the one of this name or this number from 1.

    Raises:
        FormatError: as `read_file`, or the file has several bodies and none is chosen, or it has no such body.
    """
    file = read_file(path)
    names = file.bodies
    if clip is None and len(names) == 1:
        return file
    listed = enumerated([quoted(name) for name in names])
    if clip is None:
        fault = f"it has {len(names)} bodies, {listed}: choose one, as {quoted(f'{name_of(path)}.bvh#{names[0]}')}"
        raise FormatError(fault, path=path)
    if (found := find_name(names, clip)) is None:
        raise FormatError(f"no body {quoted(clip)}; it has {listed}", path=path)
    return file.body(found)


def read_file(path: FilePath) -> BvhFile:
    """Read a BVH file, with all its bodies.

    Raises:
        FormatError: the file does not exist, or is not a complete BVH; the message names file and line.
    """
    lines = read_lines(path)
    start = next((i for i, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    joints = read_hierarchy(lines[:start], path)
    if start is None:
        raise FormatError("no line MOTION: the file ends before its frames", path=path, line=len(lines))
    channels = sum(len(joint.channels) for joint in joints)
    if channels == 0:
        raise FormatError("no joint has CHANNELS: nothing can move", path=path, line=start + 1)
    declared, frame_time, first = _read_motion_header(lines, start + 1, path)
    rows = [(n, line) for n, line in enumerate(lines[first:], start=first + 1) if line.strip() and not is_comment(line)]
    if not rows:
        raise FormatError("no frames after the header", path=path, line=len(lines))
    values = _read_frames(rows, channels, declared, path)
    check_size(len(values), max(len(joints) - channels, 1), str(path))  # the file holds the rest
    return BvhFile(lines[:start], joints, values, declared, frame_time, rows)


def _read_motion_header(lines: list[str], start: int, path: FilePath) -> tuple[int, float, int]:
    """Return the header's frame count, its seconds per frame, and the index of the next line."""
    declared: int | None = None
    frame_time: float | None = None
    for index in range(start, len(lines)):
        line = lines[index]
        if not line.strip() or is_comment(line):
            continue
        if match := _FRAME_TIME.fullmatch(line):
            frame_time = to_number(match[1], path, index + 1)
            if frame_time < 1e-9:
                raise FormatError(
                    f"Frame Time is {match[1]}; it must be the seconds per frame, more than 0",
                    path=path,
                    line=index + 1,
                )
        elif match := _FRAMES.fullmatch(line):
            if not re.fullmatch(r"[0-9]{1,18}", match[1]):
                raise FormatError(
                    f"{quoted(match[1])} where the number of frames was expected", path=path, line=index + 1
                )
            declared = int(match[1])
        else:
            break
        if declared is not None and frame_time is not None:
            return declared, frame_time, index + 1
    missing = "Frame Time" if declared is not None else "Frames"
    raise FormatError(f"no line '{missing}: ...' between MOTION and the frames", path=path, line=start)


def _read_frames(rows: list[tuple[int, str]], channels: int, declared: int, path: FilePath) -> Floats:
    """Read channel values [T, C], one frame per line; frames may wrap over lines if their total count is right."""
    if len(rows) * channels >= 10_000:
        from motionmind.formats._numbers import read_plain  # numba is slow to import

        plain = read_plain([line for _, line in rows], channels)
        if plain is not None and np.all(np.abs(plain) <= MAX_NUMBER):
            return plain
    try:
        frames = np.loadtxt([line for _, line in rows], dtype=np.float64, comments=None, ndmin=2)
    except ValueError:  # a word that is not a number, or lines of different lengths
        return _read_irregular_frames(rows, channels, declared, path)
    if frames.shape[1] != channels or not np.all(np.abs(frames) <= MAX_NUMBER):  # false for NaN too
        return _read_irregular_frames(rows, channels, declared, path)
    return frames


def _read_irregular_frames(rows: list[tuple[int, str]], channels: int, declared: int, path: FilePath) -> Floats:
    """Read frames word by word, to name the first fault or accept frames that wrap over lines."""
    values = [to_numbers(line.split(), path, number) for number, line in rows]
    flat = np.array([value for row in values for value in row])
    irregular = next((i for i, row in enumerate(values) if len(row) != channels), None)
    if irregular is None or len(flat) == declared * channels:
        return flat.reshape(-1, channels)
    fault = f"the line holds {len(values[irregular])} numbers, a frame of this file has {channels}"
    raise FormatError(fault, path=path, line=rows[irregular][0])


def assemble(joints: list[BvhJoint], values: Floats, name: str) -> Placed:
    """Turn the channels' values [T, C] into the joints' rotations and places."""
    frames = len(values)
    rotations = np.tile(rot.IDENTITY, (frames, len(joints), 1))
    places: dict[int, Floats] = {}
    groups: dict[str, list[tuple[int, list[int]]]] = {}  # by rotation order: joints, converted all at once
    column = 0
    for index, joint in enumerate(joints):
        columns = list(enumerate(joint.channels, start=column))
        column += len(joint.channels)
        turns = [(channel[0], at) for at, channel in columns if channel.endswith("ROTATION")]
        moves = [("XYZ".index(channel[0]), at) for at, channel in columns if channel.endswith("POSITION")]
        if turns:
            order = "".join(letter for letter, _ in turns)
            groups.setdefault(order, []).append((index, [at for _, at in turns]))
        if moves:
            place = np.tile(np.array(joint.offset, dtype=np.float64), (frames, 1))
            for axis, at in moves:
                place[:, axis] = values[:, at]
            places[index] = place
    for order, members in groups.items():
        angles = np.radians(values[:, [columns for _, columns in members]])
        rotations[:, [index for index, _ in members]] = rot.from_euler(order, angles)
    skeleton = Skeleton(
        name,
        tuple(joint.name for joint in joints),
        tuple(joint.parent for joint in joints),
        np.array([joint.offset for joint in joints], dtype=np.float64),
        np.array([joint.tip or [0.0, 0.0, 0.0] for joint in joints], dtype=np.float64),
    )
    return Placed(skeleton, rotations, places)
