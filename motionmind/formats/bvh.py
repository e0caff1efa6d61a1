"""Reads and writes BVH (Biovision hierarchy) files: movement of any tree of joints.

The format has no standard. Rotation channels apply in the listed order, each about axes turned by the previous ones.
Position channels, anywhere in the list, move the joint in its parent's frame and replace its OFFSET.
Source: M. Meredith and S. Maddock, "Motion capture file formats explained", University of Sheffield, CS-01-11 (2001).
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_FPS
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError, MotionMindWarning, quoted
from motionmind.files import FilePath, name_of, write_atomically
from motionmind.formats._bvh_file import BvhFile, assemble, read_body, read_file
from motionmind.formats._bvh_hierarchy import is_comment
from motionmind.formats._bvh_rig import NormalisedRig, normalise
from motionmind.formats._clock import even_step
from motionmind.formats.text import read_lines
from motionmind.formats.units import guess_unit, is_hand, metres_per_unit
from motionmind.geometry import rotations as rot

_MIN_MOVING_COUNT = 12  # this many frames, and joints, should show some movement

_log = logging.getLogger(__name__)


def read_bvh(
    path: FilePath, *, clip: str | None = None, unit: str | float | None = None, fps: float | None = None
) -> Motion:
    """Read a motion from a BVH file, on the file's own tree of joints.

    Each joint has its own channels, in any order. Blank lines among the frames, and lines that begin with # or //,
    are skipped. If the header's frame count is wrong, all frames in the file are read, with a warning.

    Constant position channels of a joint other than the root replace its OFFSET. If they vary and the joint carries
    most of the body, it becomes the root, with its ancestors folded in: Bandai-Namco's `joint_Root` stays at the origin
    while `Hips` moves. Any other joint stays at its mean place, and a warning gives its largest distance from there. If
    position channels are near 0 while the offsets are not, the two are added, with a warning, as old exporters of
    Blender meant.

    Args:
        path: the file; its stem becomes the name of the skeleton and of the motion, and "stem#clip" with a clip.
        clip: of a file with several ROOTs, the body to read: its ROOT's name, or its number from 1. Bodies whose ROOTs
            have one name are "Hips", "Hips (2)" and so on. None for the only one.
        unit: a name in `UNITS`, or metres in one unit of the file; None takes the unit that `guess_unit` infers from
            the skeleton, and logs it (logger "motionmind.formats.bvh", level INFO).
        fps: frames per second in place of the header's, which some converters copy from another file.

    Returns:
        The motion, in metres and seconds, starting at time 0.

    Raises:
        FormatError: the file does not exist, or is not a complete BVH; the message names file and line. Or it has
            several bodies, and none is chosen.
        MotionMindError: `unit` or `fps` is invalid.

    Warns:
        MotionMindWarning: something was repaired, as described above; or the frame time or all angles are implausible.
    """
    _check_fps(fps)
    return _to_motion(read_body(path, clip), path, "" if clip is None else f"#{clip}", unit, fps)


def read_bvh_clips(path: FilePath, *, unit: str | float | None = None, fps: float | None = None) -> Iterator[Motion]:
    """Read all bodies of a BVH file, as `read_bvh` reads one.

    If there are several, each has a name of the form "stem#clip".
    """
    _check_fps(fps)
    file = read_file(path)
    names = file.bodies
    for number, name in enumerate(names):
        yield _to_motion(file.body(number), path, f"#{name}" if len(names) > 1 else "", unit, fps)


def _check_fps(fps: float | None) -> None:
    if fps is not None and not 0.0 < fps <= MAX_FPS:
        raise MotionMindError(f"fps must be a positive number of frames a second, {MAX_FPS:g} at most, not {fps}")


def _to_motion(file: BvhFile, path: FilePath, clip: str, unit: str | float | None, fps: float | None) -> Motion:
    """Return the movement of the only body in `file`; `clip` is the ending of its name."""
    body, stated = _normalised(file, f"{name_of(path)}{clip}"), file.frame_time
    frame_time = stated if fps is None else 1.0 / fps
    if unit is None:
        name, scale = guess_unit(body.skeleton)
        text = "%s: one unit taken as %.5g m (%s), by the %s"
        what = "size of the hand" if is_hand(body.skeleton) else "height of the body"
        _log.info(text, displayed_path(f"{path}{clip}"), scale, name, what, extra={"file": path})
    else:
        scale = metres_per_unit(unit)
    for message in (*body.repairs(scale), *_implausible(body, stated if fps is None else 0.0)):
        warnings.warn(f"{path}{clip}: {message}", MotionMindWarning, stacklevel=3)
    raw = body.skeleton
    return Motion(
        Skeleton(raw.name, raw.names, raw.parents, raw.offsets * scale, raw.tips * scale),
        body.rotations,
        body.root * scale,
        np.arange(len(body.root), dtype=np.float64) * frame_time,
        name=raw.name,
        rate=1.0 / frame_time,
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
    return guess_unit(_normalised(read_body(path, None), name_of(path)).skeleton)


def _normalised(file: BvhFile, name: str) -> NormalisedRig:
    """Return the body in the file's own unit."""
    body = normalise(assemble(file.joints, file.values, name))
    frames = len(file.values)
    if file.declared != frames:
        body.notes.append(f"the header says {file.declared} frames, the file holds {frames}; all {frames} are read")
    return body


# --- writing -------------------------------------------------------------------------------------------------------


INSERTED_LINE_END = " "  # of a frame that the engine inserted


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
    order = _depth_first(skeleton)
    # ZXY is the commonest order (MotionBuilder's, Bandai-Namco's). Euler angles lock where the middle rotation is 90
    # degrees; about x that is rarer in arms, which a T-pose stretches along x.
    degrees = np.degrees(np.unwrap(rot.to_euler("ZXY", motion.rotations[:, order]), axis=0))
    values = np.concatenate([motion.root * scale, degrees.reshape(len(motion), -1)], axis=1)
    is_angle = np.arange(values.shape[1]) >= 3
    lines = ["HIERARCHY", *_hierarchy_lines(skeleton, order, scale), "MOTION"]
    lines += frame_lines(motion, values, is_angle, scale)
    write_atomically(path, ("\n".join(lines) + "\n").encode())


def frame_lines(motion: Motion, values: Floats, is_angle: Bools, scale: float) -> Iterator[str]:
    """Yield the lines below MOTION.

    Args:
        motion: the movement, evenly spaced in time.
        values: of all channels, in degrees and units [T, C].
        is_angle: whether each channel is an angle [C].
        scale: units per metre.
    """
    step = even_step(motion, "BVH")
    yield f"Frames: {len(motion)}"
    yield f"Frame Time: {step:.12g}"
    digits = length_digits(scale)
    # Adding 0 turns -0, printed with its sign, into 0.
    rounded = np.where(is_angle, np.round(values, 6), np.round(values, digits)) + 0.0
    row = " ".join("%.6f" if angle else f"%.{digits}f" for angle in is_angle)
    for frame, inserted in zip(rounded, motion.inserted(), strict=True):
        yield row % tuple(frame.tolist()) + (INSERTED_LINE_END if inserted else "")


def length_digits(scale: float) -> int:
    """Return the decimals of lengths: to 1e-8 m, because rounding errors add up along a chain of bones."""
    return max(0, int(np.ceil(8.0 - np.log10(scale))))


def has_inserted_frames(path: FilePath) -> bool:
    """Return whether the ends of a file's lines mark frames that the engine inserted.

    The engine never inserts the first frame; if its line ends in a blank too, an exporter ends all lines this way.
    """
    lines = read_lines(path)
    start = next((n for n, line in enumerate(lines, 1) if line.startswith("Frame Time:")), len(lines))
    frames = [line.endswith(INSERTED_LINE_END) for line in lines[start:] if line.strip()]
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


def _hierarchy_lines(skeleton: Skeleton, order: list[int], scale: float) -> Iterator[str]:
    """Yield the lines below HIERARCHY, with `scale` units per metre."""
    digits = length_digits(scale)

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
