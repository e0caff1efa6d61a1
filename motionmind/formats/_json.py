"""JSON of postures and motions: the header, skeletons, quaternions, and errors in plain words."""

from __future__ import annotations

import codecs
import json
import re
import warnings
from collections.abc import Sequence
from typing import TypeVar

import msgspec
import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.human import BODIES
from motionmind.body.motion import Insertion
from motionmind.body.skeleton import Skeleton
from motionmind.credits.credit import Credit
from motionmind.errors import FormatError, MotionMindWarning, SkeletonError, did_you_mean, enumerated, quoted
from motionmind.files import FilePath
from motionmind.formats.text import LENGTH_TOLERANCE, MAX_JOINTS, MAX_NUMBER, WRITTEN_LENGTH_TOLERANCE
from motionmind.geometry import rotations as rot

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

POSTURE = "motionmind-posture"
MOTION = "motionmind-motion"
VERSION = 1


class Header(msgspec.Struct):
    """The two fields at the beginning of every MotionMind file."""

    format: str = ""
    version: int = 0


class JointSchema(msgspec.Struct, forbid_unknown_fields=True):
    """One joint, in metres; `parent` is the parent's name, null for the root."""

    name: str
    parent: str | None
    offset: Vector
    tip: Vector | None = None


class SkeletonSchema(msgspec.Struct, forbid_unknown_fields=True):
    """A skeleton described in the file, joints after their parents."""

    name: str
    joints: list[JointSchema]


class InsertionSchema(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """An insertion by the engine: the times of its postures, (joint, move) for each bridge, and its credits."""

    times: list[float]
    bridged: list[tuple[str, int]] = []  # msgspec copies it for each object
    credits: list[Credit] = []


MARKS_KEY = "motionmind"  # of MarksSchema in a glTF node's extras


class MarksSchema(msgspec.Struct, omit_defaults=True):
    """Text in other programs' formats: marks (see `Motion`), and tips by joint, metres."""

    insertions: list[InsertionSchema] = []
    keyframed: bool = False
    recorded: list[Credit] = []
    tips: dict[str, Vector] = {}


T = TypeVar("T")


def kind_of(data: bytes, path: FilePath) -> str:
    """Return POSTURE or MOTION; FormatError if `data` is neither, or its version is unknown."""
    header = decode(data, Header, path)
    if header.format not in (POSTURE, MOTION):
        problem = f"format {quoted(header.format)} is unknown" if header.format else "there is no field format"
        raise FormatError(f"{problem}; it must be {POSTURE!r} or {MOTION!r}", path=path)
    if header.version != VERSION:
        problem = f"version {header.version}" if header.version else "no version"
        raise FormatError(f"{problem} of {header.format}: this MotionMind reads version {VERSION}", path=path)
    return header.format


def to_insertion(schema: InsertionSchema) -> Insertion:
    """Build an insertion; MotionMindError if its times do not increase, or it bridges a move that does not exist."""
    return Insertion(np.array(schema.times), tuple(schema.bridged), tuple(schema.credits))


def insertion_schema(insertion: Insertion, start: float = 0.0) -> InsertionSchema:
    """Return an insertion's schema, with times counted from `start`, seconds."""
    return InsertionSchema(rounded(insertion.times - start).tolist(), list(insertion.bridged), list(insertion.credits))


def decode(data: bytes, schema: type[T], path: FilePath) -> T:
    """Decode `data` as `schema`; FormatError names the fault and its place."""
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        return msgspec.json.decode(data, type=schema)
    except msgspec.ValidationError as error:
        raise FormatError(_in_words(str(error), schema), path=path) from error
    except RecursionError as error:
        raise FormatError("lists nested too deeply to be a MotionMind file", path=path) from error
    except ValueError as error:  # msgspec.DecodeError, and UnicodeDecodeError
        raise _malformed(str(error), data, path) from error


def _malformed(message: str, data: bytes, path: FilePath) -> FormatError:
    """Build the FormatError for text that is not valid JSON, with its line."""
    place = re.search(r"\(byte (\d+)\)", message)
    end = len(data.rstrip())
    # msgspec reports a truncated number as malformed at its last byte.
    if "truncated" in message or (place and int(place[1]) >= end):
        line = data.count(b"\n", 0, end) + 1
        return FormatError("the JSON is cut short: the file ends before it does", path=path, line=line)
    if place is None:
        return FormatError(f"not valid JSON: {message}", path=path)
    at = int(place[1])
    line = data.count(b"\n", 0, at) + 1
    column = at - data.rfind(b"\n", 0, at)
    special = re.match(rb"[+-]?(nan|inf(inity)?)", data[max(at - 1, 0) :].lstrip(b" ,[:"), re.IGNORECASE)
    if special:
        return FormatError(
            f"{special[0].decode()} is not a number JSON can hold (column {column})", path=path, line=line
        )
    reason = message.split(": ", 1)[-1].removesuffix(place[0]).strip()
    return FormatError(f"not valid JSON: {reason} at column {column}", path=path, line=line)


def _in_words(message: str, schema: type) -> str:
    """Reword msgspec's "Expected `float`, got `str` - at `$.times[3]`" as "times[3]: expected float, got str"."""
    problem, _, place = message.replace("`", "").partition(" - at $")
    where = place.removeprefix(".")
    unknown = re.fullmatch(r"Object contains unknown field (.*)", problem)
    if unknown:
        known = msgspec.structs.fields(schema) if not where else ()
        problem = f"unknown field {quoted(unknown[1])}{did_you_mean(unknown[1], [field.name for field in known])}"
    problem = re.sub(r"^Object missing required field (.*)", r"there is no field \1", problem)
    problem = re.sub(r"\barray\b", "list", problem[0].lower() + problem[1:])
    return f"{where}: {problem}" if where else problem


# --- skeletons -----------------------------------------------------------------------------------------------------


def to_skeleton(schema: str | SkeletonSchema, path: FilePath) -> Skeleton:
    """Build the skeleton that a file names or describes; FormatError if it is unknown or malformed."""
    if isinstance(schema, str):
        if schema not in BODIES:
            built_in = " and ".join(BODIES)
            raise FormatError(
                f"skeleton {quoted(schema)} has no description here; only {built_in} are known by name alone", path=path
            )
        return BODIES[schema]()
    if len(schema.joints) > MAX_JOINTS:
        raise FormatError(f"more than {MAX_JOINTS} joints: not a body", path=path)
    index: dict[str, int] = {}
    parents = []
    for joint in schema.joints:
        if joint.parent is not None and joint.parent not in index:
            raise FormatError(
                f"skeleton {quoted(schema.name)}: the parent {quoted(joint.parent)} of {quoted(joint.name)} "
                f"is not listed before it{did_you_mean(joint.parent, index)}",
                path=path,
            )
        parents.append(-1 if joint.parent is None else index[joint.parent])
        index[joint.name] = len(index)
    offsets = np.array([joint.offset for joint in schema.joints], dtype=np.float64).reshape(-1, 3)
    tips = np.array([joint.tip or (0.0, 0.0, 0.0) for joint in schema.joints], dtype=np.float64).reshape(-1, 3)
    if not (np.all(np.abs(offsets) <= MAX_NUMBER) and np.all(np.abs(tips) <= MAX_NUMBER)):
        raise FormatError(f"skeleton {quoted(schema.name)} has an offset beyond {MAX_NUMBER:g} m", path=path)
    try:
        return Skeleton(schema.name, tuple(joint.name for joint in schema.joints), tuple(parents), offsets, tips)
    except SkeletonError as error:
        raise FormatError(str(error), path=path) from error


def skeleton_text(skeleton: Skeleton, indent: str) -> str:
    """Return a skeleton as JSON: its name if it is a built-in body unchanged, else one joint per line."""
    if skeleton.name in BODIES and skeleton == BODIES[skeleton.name]():
        return text(skeleton.name)
    rows = []
    for joint, name in enumerate(skeleton.names):
        parent = skeleton.parents[joint]
        row = {
            "name": name,
            "parent": skeleton.names[parent] if parent >= 0 else None,
            "offset": skeleton.offsets[joint].tolist(),
        }
        if np.any(skeleton.tips[joint] != 0.0):
            row["tip"] = skeleton.tips[joint].tolist()
        rows.append(f"{indent}    {json.dumps(row, ensure_ascii=False)}")
    joints = ",\n".join(rows)
    return f'{{\n{indent}  "name": {text(skeleton.name)},\n{indent}  "joints": [\n{joints}\n{indent}  ]\n{indent}}}'


# --- numbers -------------------------------------------------------------------------------------------------------


def text(value: str) -> str:
    """Return a string as JSON."""
    return json.dumps(value, ensure_ascii=False)


def rounded(array: Floats) -> Floats:
    """Round `array` to the ten decimals of a file, with -0 as 0."""
    return np.asarray(np.round(array, 10) + 0.0, dtype=np.float64)


def check_lengths(array: Floats, what: str, path: FilePath) -> None:
    """Raise FormatError if a length or time in `array` [..., n] is out of range."""
    wrong = ~(np.abs(array) <= MAX_NUMBER)
    if wrong.any():
        where = tuple(np.argwhere(wrong)[0])
        place = f" in frame {where[0]}" if array.ndim > 1 else ""
        raise FormatError(f"{what}{place} is {array[where]:g}, beyond {MAX_NUMBER:g}", path=path)


def normalise_rotations(array: Floats, names: Sequence[str], path: FilePath) -> Floats:
    """Normalise quaternions [J, 4] or [T, J, 4] in place; FormatError for zero, a warning beyond `LENGTH_TOLERANCE`."""
    if not np.all(np.abs(array) <= MAX_NUMBER):
        joint = names[np.argwhere(~(np.abs(array) <= MAX_NUMBER))[0][-2]]
        raise FormatError(f"the rotation of {joint} has a number beyond {MAX_NUMBER:g}", path=path)
    length = np.linalg.norm(array, axis=-1)
    if np.any(length < 1e-6):
        where = np.argwhere(length < 1e-6)[0]
        raise FormatError(f"{_place(where, names)} is zero, which is not a rotation (identity is 0 0 0 1)", path=path)
    off = np.abs(length - 1.0)
    if np.any(off > LENGTH_TOLERANCE):
        wrong = np.argwhere(off > LENGTH_TOLERANCE)
        first = tuple(wrong[0])
        more = f", and {len(wrong) - 1} more like it" if len(wrong) > 1 else ""
        warnings.warn(
            f"{path}: {_place(wrong[0], names)} has length {length[first]:.3g}, not 1{more}; made 1",
            MotionMindWarning,
            stacklevel=4,
        )
    changed = off > WRITTEN_LENGTH_TOLERANCE
    if changed.any():
        array[changed] = rot.normalise(array[changed])
    return array


def _place(where: Indices, names: Sequence[str]) -> str:
    """Describe the rotation at index `where`, [joint] or [frame, joint]."""
    frame = f" in frame {where[0]}" if len(where) > 1 else ""
    return f"the rotation of {names[where[-1]]}{frame}"


def check_joints(found: Sequence[str], skeleton: Skeleton, path: FilePath) -> None:
    """Raise FormatError if `found` names a joint that `skeleton` does not have, or lacks one of its joints."""
    unknown = [name for name in found if name not in skeleton.names]
    if unknown:
        raise FormatError(
            f"rotations: {skeleton.name} has no joint {quoted(unknown[0])}{did_you_mean(unknown[0], skeleton.names)}",
            path=path,
        )
    missing = [name for name in skeleton.names if name not in set(found)]
    if missing:
        raise FormatError(
            f"rotations: no {enumerated(missing)}; every joint of {skeleton.name} needs one (at rest it is 0, 0, 0, 1)",
            path=path,
        )
