"""Reads and writes BVH (Biovision hierarchy) files: movement of any tree of joints.

The format has no standard. Rotation channels apply in the listed order, each about axes turned by the previous ones.
Position channels, anywhere in the list, move the joint in its parent's frame and replace its OFFSET.
Source: M. Meredith and S. Maddock, "Motion capture file formats explained", University of Sheffield, CS-01-11 (2001).
"""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_FPS, check_size
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, quoted
from motionmind.files import FilePath, name_of, write_atomically
from motionmind.formats._bvh_hierarchy import BvhJoint, is_comment, read_hierarchy
from motionmind.formats._bvh_rig import NormalisedRig, Placed, normalise
from motionmind.formats._clock import even_step
from motionmind.formats.text import MAX_NUMBER, read_lines, to_number, to_numbers
from motionmind.formats.units import guess_unit, metres_per_unit
from motionmind.geometry import rotations as rot

_FRAMES = re.compile(r"\s*Frames\s*:?\s*(\S*)\s*", re.IGNORECASE)
_FRAME_TIME = re.compile(r"\s*Frame\s*Time\s*:?\s*(\S*)\s*", re.IGNORECASE)
_MIN_MOVING_COUNT = 12  # this many frames, and joints, should show some movement

_log = logging.getLogger(__name__)


def read_bvh(path: FilePath, *, unit: str | float | None = None, fps: float | None = None) -> Motion:
    """Read a motion from a BVH file, on the file's own tree of joints.

    Each joint has its own channels, in any order. Blank lines among the frames, and lines that begin with # or //,
    are skipped. If the header's frame count is wrong, all frames in the file are read, with a warning.

    Constant position channels of a joint other than the root replace its OFFSET. If they vary and the joint carries
    most of the body, it becomes the root, with its ancestors folded in: Bandai-Namco's `joint_Root` stays at the origin
    while `Hips` moves. Any other joint stays at its mean place, and a warning gives its largest distance from there. If
    position channels are near 0 while the offsets are not, the two are added, with a warning, as old exporters of
    Blender meant.

    Args:
        path: the file; its stem becomes the name of the skeleton and of the motion.
        unit: a name in `UNITS`, or metres in one unit of the file; None takes the unit that `guess_unit` infers from
            the skeleton, and logs it (logger "motionmind.formats.bvh", level INFO).
        fps: frames per second in place of the header's, which some converters copy from another file.

    Returns:
        The motion, in metres and seconds, starting at time 0.

    Raises:
        FormatError: the file does not exist, or is not a complete BVH; the message names file and line.
        MotionMindError: `unit` or `fps` is invalid.

    Warns:
        MotionMindWarning: something was repaired, as described above; or the frame time or all angles are implausible.
    """
    if fps is not None and not 0.0 < fps <= MAX_FPS:
        raise MotionMindError(f"fps must be a positive number of frames a second, {MAX_FPS:g} at most, not {fps}")
    body, stated = _read_body(path)
    frame_time = stated if fps is None else 1.0 / fps
    if unit is None:
        name, scale = guess_unit(body.skeleton)
        _log.info("%s: one unit taken as %.5g m (%s), by the height of the body", path, scale, name)
    else:
        scale = metres_per_unit(unit)
    for message in (*body.repairs(scale), *_implausible(body, stated if fps is None else 0.0)):
        warnings.warn(f"{path}: {message}", MotionMindWarning, stacklevel=2)
    raw = body.skeleton
    return Motion(
        Skeleton(raw.name, raw.names, raw.parents, raw.offsets * scale, raw.tips * scale),
        body.rotations,
        body.root * scale,
        np.arange(len(body.root), dtype=np.float64) * frame_time,
        name=raw.name,
    )


def _implausible(body: NormalisedRig, frame_time: float) -> Iterator[str]:
    """Describe faults of the units: frames more than 2 seconds apart, and angles in radians."""
    if len(body.root) >= _MIN_MOVING_COUNT and frame_time > 2.0:
        yield (
            f"Frame Time is {frame_time:g} seconds; is it in milliseconds, or frames a second? (--source-fps "
            "overrides it)"
        )
    if min(body.rotations.shape[:2]) < _MIN_MOVING_COUNT:
        return
    for step in (-(-len(body.root) // _MIN_MOVING_COUNT), 1):  # in most files some frames prove degrees
        largest = float(np.degrees(rot.angle(body.rotations[::step], rot.IDENTITY).max()))
        if not largest < 5.5:  # pi about each of three axes, read as degrees
            return
    if largest > 1.0:
        yield f"no joint turns by more than {largest:.2g} degrees: are its angles in radians? BVH has degrees"


def bvh_unit(path: FilePath) -> tuple[str, float]:
    """Return the unit that `read_bvh` assumes for a file if none is given: its name, and its length in metres."""
    return guess_unit(_read_body(path)[0].skeleton)


def _read_body(path: FilePath) -> tuple[NormalisedRig, float]:
    """Read the file in its own unit, and its seconds per frame."""
    lines = read_lines(path)
    start = next((i for i, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    joints = read_hierarchy(lines[:start], path)
    if start is None:
        raise FormatError("no line MOTION: the file ends before its frames", path=path, line=len(lines))
    channels = sum(len(joint.channels) for joint in joints)
    if channels == 0:
        raise FormatError("no joint has CHANNELS: nothing can move", path=path, line=start + 1)
    declared, frame_time, first = _read_motion_header(lines, start + 1, path)
    values = _read_frames(lines, first, channels, declared, path)
    check_size(len(values), max(len(joints) - channels, 1), str(path))  # the file holds the rest
    body = normalise(_assemble(joints, values, name_of(path)))
    if declared != len(values):
        body.notes.append(
            f"the header says {declared} frames, the file holds {len(values)}; all {len(values)} are read"
        )
    return body, frame_time


# --- the frames ----------------------------------------------------------------------------------------------------


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


def _read_frames(lines: list[str], first: int, channels: int, declared: int, path: FilePath) -> Floats:
    """Read channel values [T, C], one frame per line; frames may wrap over lines if their total count is right."""
    rows = [(n, line) for n, line in enumerate(lines[first:], start=first + 1) if line.strip() and not is_comment(line)]
    if not rows:
        raise FormatError("no frames after the header", path=path, line=len(lines))
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


def _assemble(joints: list[BvhJoint], values: Floats, name: str) -> Placed:
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


# --- writing -------------------------------------------------------------------------------------------------------


_INSERTED_LINE_END = " "  # of a frame that the engine inserted


def write_bvh(path: FilePath, motion: Motion, unit: str | float = "cm") -> None:
    """Write `motion` as BVH: the root with positions, all joints with Zrotation Xrotation Yrotation.

    Read back with the same unit, rotations agree to 1e-6 rad and positions to 1e-6 m. Joints come in depth-first
    order, as the format requires. Each leaf has an End Site at its tip (0 0 0 for none). The first time becomes 0.
    Angles are unwrapped: a reader that blends neighbouring frames sees no jump of 360 degrees. The line of a frame that
    the engine inserted ends in a blank, which readers skip and `has_inserted_frames` recognises.

    Args:
        path: the file to write.
        motion: the movement, evenly spaced in time.
        unit: a name in `UNITS`, or metres in one unit of the file.

    Raises:
        MotionMindError: the times are not even (`motion.resample` makes them so), BVH cannot hold a joint's name, or
            the file cannot be written.
    """
    scale = 1.0 / metres_per_unit(unit)
    skeleton = motion.skeleton
    _check_names(skeleton)
    step = even_step(motion, "BVH")
    order = _depth_first(skeleton)
    # Lengths to 1e-8 m: rounding errors add up along a chain of bones.
    digits = max(0, int(np.ceil(8.0 - np.log10(scale))))
    lines = ["HIERARCHY", *_hierarchy_lines(skeleton, order, scale, digits), "MOTION"]
    lines += [f"Frames: {len(motion)}", f"Frame Time: {step:.12g}"]
    # ZXY is the commonest order (MotionBuilder's, Bandai-Namco's). Euler angles lock where the middle rotation is 90
    # degrees; about x that is rarer in arms, which a T-pose stretches along x.
    degrees = np.degrees(np.unwrap(rot.to_euler("ZXY", motion.rotations[:, order]), axis=0))
    # Adding 0 turns -0, printed with its sign, into 0.
    root = np.round(motion.root * scale, digits) + 0.0
    values = np.concatenate([root, np.round(degrees, 6).reshape(len(motion), -1) + 0.0], axis=1)
    row = " ".join([f"%.{digits}f"] * 3 + ["%.6f"] * (3 * len(skeleton)))
    ends = [_INSERTED_LINE_END if inserted else "" for inserted in motion.inserted()]
    lines += [row % tuple(frame.tolist()) + end for frame, end in zip(values, ends, strict=True)]
    write_atomically(path, ("\n".join(lines) + "\n").encode())


def has_inserted_frames(path: FilePath) -> bool:
    """Return whether the ends of a file's lines mark frames that the engine inserted.

    The engine never inserts the first frame; if its line ends in a blank too, an exporter ends all lines this way.
    """
    lines = read_lines(path)
    start = next((n for n, line in enumerate(lines, 1) if line.startswith("Frame Time:")), len(lines))
    frames = [line.endswith(_INSERTED_LINE_END) for line in lines[start:] if line.strip()]
    return any(frames) and not frames[0]


def _check_names(skeleton: Skeleton) -> None:
    for name in skeleton.names:
        if name != " ".join(name.split()) or not name or set("{}") & set(name) or is_comment(name):
            raise MotionMindError(f"{skeleton.name}: {quoted(name)} is not a joint name that BVH can hold")


def _depth_first(skeleton: Skeleton) -> list[int]:
    """Return the joints in depth-first order."""
    children: list[list[int]] = [[] for _ in skeleton.names]
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        children[parent].append(joint)
    order: list[int] = []
    waiting = [0]
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children[order[-1]])
    return order


def _hierarchy_lines(skeleton: Skeleton, order: list[int], scale: float, digits: int) -> Iterator[str]:
    """Yield the lines below HIERARCHY, with `digits` decimals and `scale` units per metre."""

    def offset(vector: Floats) -> str:
        return "OFFSET " + " ".join(f"{value:.{digits}f}" for value in np.round(vector * scale, digits) + 0.0)

    leaves = set(order) - set(skeleton.parents)
    turns = "Zrotation Xrotation Yrotation"
    open_blocks: list[int] = []
    for joint in order:
        while open_blocks and open_blocks[-1] != skeleton.parents[joint]:
            yield "\t" * (len(open_blocks) - 1) + "}"
            open_blocks.pop()
        tab = "\t" * len(open_blocks)
        yield f"{tab}{'JOINT' if joint else 'ROOT'} {skeleton.names[joint]}"
        yield f"{tab}{{"
        yield f"{tab}\t{offset(skeleton.offsets[joint] if joint else np.zeros(3))}"
        yield f"{tab}\tCHANNELS " + (f"3 {turns}" if joint else f"6 Xposition Yposition Zposition {turns}")
        if joint in leaves:
            yield f"{tab}\tEnd Site"
            yield f"{tab}\t{{"
            yield f"{tab}\t\t{offset(skeleton.tips[joint])}"
            yield f"{tab}\t}}"
        open_blocks.append(joint)
    for depth in range(len(open_blocks) - 1, -1, -1):
        yield "\t" * depth + "}"
