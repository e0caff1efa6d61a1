"""Motions as JSON, one frame per line.

    {
    "format": "motionmind-motion",
    "version": 1,
    "name": "plie",
    "skeleton": "human23",
    "times": [0.0, 0.2],
    "root": [
    [0.0, 0.97, 0.0],
    [0.0, 0.91, 0.0]
    ],
    "rotations": [
    [[0.0, 0.0, 0.0, 1.0], ...],
    [[0.0, 0.0, 0.0, 1.0], ...]
    ]
    }

`times` are seconds, increasing; `root` the root's places in metres; `rotations` each joint's quaternion x, y, z, w
against its parent, in the skeleton's order. `skeleton` is "human23", "human44" or a description, as in a posture's
JSON. `insertions`, if the engine made any, gives the times of the postures that its moves connect, and the joints'
moves that no corpus attests (bridges):

    "insertions": [{"times": [0.0, 0.4, 0.8], "bridged": [["left_hip", 1]]}],

`"keyframed": true` marks frames that someone chose, as in a score. `recorded` holds the credits of frames that the
engine did not insert, if known.

A variation's file is its current movement with one more field, `variation`, which holds the rest
(`motionmind.variation.variation_json`).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain

import msgspec
import numpy as np

from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.credits.credit import Credit
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, read_bytes, write_atomically
from motionmind.formats import _json
from motionmind.formats._json import InsertionSchema


class FramesSchema(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """Frames of a motion, without its skeleton."""

    times: list[float]
    root: list[_json.Vector]
    rotations: list[list[_json.Quaternion]]
    name: str = ""
    insertions: list[InsertionSchema] = []
    keyframed: bool = False
    recorded: list[Credit] = []


class MotionSchema(FramesSchema, forbid_unknown_fields=True, kw_only=True):
    """The file, version 1."""

    format: str
    version: int
    skeleton: str | _json.SkeletonSchema
    moves: list[float] = []  # one insertion's times, as tweens were written before bridges existed
    variation: msgspec.Raw = msgspec.Raw()  # the rest of a variation's file


class _VariationField(msgspec.Struct):
    variation: msgspec.Raw = msgspec.Raw()


def holds_variation(path: FilePath) -> bool:
    """Return whether the JSON at `path` holds a variation besides its movement."""
    return bool(bytes(_json.decode(read_bytes(path), _VariationField, path).variation))


def motion_from_json(data: bytes, path: FilePath) -> Motion:
    """Decode a motion.

    Args:
        data: the content of the file.
        path: the file, for messages.

    Raises:
        FormatError: `data` is not a motion of version 1, its lists differ in length, times do not increase, or a
            quaternion is zero. The message names file, joint and frame.

    Warns:
        MotionMindWarning: quaternions whose length was off by more than 1 % have been normalised.
    """
    kind = _json.kind_of(data, path)
    if kind != _json.MOTION:
        raise FormatError(f"this holds a posture, where a motion ({_json.MOTION!r}) was expected", path=path)
    schema = _json.decode(data, MotionSchema, path)
    if schema.moves:
        schema.insertions.append(InsertionSchema(schema.moves))
    return motion_of(schema, _json.to_skeleton(schema.skeleton, path), path)


def motion_of(schema: FramesSchema, skeleton: Skeleton, path: FilePath, *, mend: bool = True) -> Motion:
    """Build a motion of `skeleton` from decoded frames.

    Args:
        schema: the frames.
        skeleton: the body that moves.
        path: the file, for messages.
        mend: whether to normalise quaternions; False keeps them to the last bit, for files written in full precision.

    Raises:
        FormatError: as `motion_from_json`.
    """
    frames, joints = len(schema.times), len(skeleton)
    if frames == 0:
        raise FormatError("times: a motion has at least one frame", path=path)
    _check_counts(schema, skeleton, path)
    # Flat iteration builds the array in half the time of nested lists.
    numbers = chain.from_iterable(chain.from_iterable(schema.rotations))
    rotations = np.fromiter(numbers, dtype=np.float64, count=frames * joints * 4).reshape(frames, joints, 4)
    root = np.array(schema.root, dtype=np.float64)
    times = np.array(schema.times, dtype=np.float64)
    for what, array in (
        ("root", root),
        ("times", times),
        *(("insertions", np.array(one.times, dtype=np.float64)) for one in schema.insertions),
    ):
        _json.check_lengths(array, what, path)
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        frame = late[0] + 1
        raise FormatError(f"times: {times[frame]:g} of frame {frame} is not after {times[frame - 1]:g}", path=path)
    if mend:
        rotations = _json.normalise_rotations(rotations, skeleton.names, path)
    try:
        insertions = tuple(_json.to_insertion(one) for one in schema.insertions)
        recorded = tuple(schema.recorded)
        return Motion(skeleton, rotations, root, times, schema.name, insertions, schema.keyframed, recorded)
    except FormatError:
        raise
    except MotionMindError as error:
        raise FormatError(str(error), path=path) from error


def _check_counts(schema: FramesSchema, skeleton: Skeleton, path: FilePath) -> None:
    """Raise FormatError unless there is a place for each time, and a quaternion for each time and joint."""
    frames, joints = len(schema.times), len(skeleton)
    for what, rows in (("root", schema.root), ("rotations", schema.rotations)):
        if len(rows) != frames:
            raise FormatError(f"{what} has {len(rows)} frames, times has {frames}", path=path)
    odd = next((frame for frame, row in enumerate(schema.rotations) if len(row) != joints), None)
    if odd is not None:
        raise FormatError(
            f"rotations: frame {odd} has {len(schema.rotations[odd])} quaternions, {skeleton.name} has {joints} joints",
            path=path,
        )


def write_motion_json(path: FilePath, motion: Motion, more: Mapping[str, bytes] | None = None) -> None:
    """Write `motion` as JSON; read back, no number is off by more than 1e-9.

    Args:
        path: the file to write.
        motion: the movement.
        more: further fields of the file, by name, as JSON.

    Raises:
        MotionMindError: the file cannot be written.
    """
    times = _json.rounded(motion.times)
    if np.any(np.diff(times) <= 0.0):  # steps finer than the rounding
        times = motion.times
    fields = [
        f'"format": "{_json.MOTION}"',
        f'"version": {_json.VERSION}',
        f'"name": {_json.text(motion.name)}',
        f'"skeleton": {_json.skeleton_text(motion.skeleton, "")}',
        f'"times": {_compact(times.tolist())}',
    ]
    if motion.keyframed:
        fields.append('"keyframed": true')
    if motion.insertions:
        insertions = [_json.insertion_schema(one) for one in motion.insertions]
        fields.append(f'"insertions": {msgspec.json.encode(insertions).decode()}')
    if motion.recorded:
        fields.append(f'"recorded": {msgspec.json.encode(motion.recorded).decode()}')
    for what, array in (("root", motion.root), ("rotations", motion.rotations)):
        rows = ",\n".join(_compact(row.tolist()) for row in _json.rounded(array))  # all at once would fill the memory
        fields.append(f'"{what}": [\n{rows}\n]')
    fields += [f'"{what}": {value.decode()}' for what, value in (more or {}).items()]
    write_atomically(path, ("{\n" + ",\n".join(fields) + "\n}\n").encode())


def _compact(row: list[float]) -> str:
    return msgspec.json.encode(row).decode()
