"""What the JSON of postures and of motions share: the header, skeletons, quaternions, and errors in plain words."""

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
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindWarning, SkeletonError, did_you_mean, enumerated, quoted
from motionmind.files import FilePath
from motionmind.formats.text import LARGEST, MOST_JOINTS
from motionmind.geometry import rotations as rot

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

POSTURE = "motionmind-posture"
MOTION = "motionmind-motion"
VERSION = 1

# Decimals of what is written: read back, nothing is off by more than 5e-11, and no length 1 by more than 1e-9.
DECIMALS = 10
_AS_WRITTEN = 1e-9
_UNIT = 1e-6


class Header(msgspec.Struct):
    """The two fields that every file of ours begins with."""

    format: str = ""
    version: int = 0


class JointSchema(msgspec.Struct, forbid_unknown_fields=True):
    """One joint; `parent` is the parent's name, null for the root; metres."""

    name: str
    parent: str | None
    offset: Vector
    tip: Vector | None = None


class SkeletonSchema(msgspec.Struct, forbid_unknown_fields=True):
    """A skeleton of its own, joints after their parents."""

    name: str
    joints: list[JointSchema]


T = TypeVar("T")


def kind_of(data: bytes, path: FilePath) -> str:
    """POSTURE or MOTION; FormatError if `data` is neither, or of a version that this code does not know."""
    header = decode(data, Header, path)
    if header.format not in (POSTURE, MOTION):
        found = f"format {quoted(header.format)} is unknown" if header.format else "there is no field format"
        raise FormatError(f"{found}; it must be {POSTURE!r} or {MOTION!r}", path=path)
    if header.version != VERSION:
        found = f"version {header.version}" if header.version else "no version"
        raise FormatError(f"{found} of {header.format}: this MotionMind reads version {VERSION}", path=path)
    return header.format


def decode(data: bytes, schema: type[T], path: FilePath) -> T:
    """`data` as `schema`; FormatError says what is wrong and where."""
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        return msgspec.json.decode(data, type=schema)
    except msgspec.ValidationError as error:
        raise FormatError(_in_words(str(error), schema), path=path) from error
    except RecursionError as error:
        raise FormatError("lists in lists without end: no file of MotionMind's", path=path) from error
    except ValueError as error:  # msgspec.DecodeError, and UnicodeDecodeError
        raise _malformed(str(error), data, path) from error


def _malformed(message: str, data: bytes, path: FilePath) -> FormatError:
    """What is wrong with text that is no JSON, with its line."""
    found = re.search(r"\(byte (\d+)\)", message)
    end = len(data.rstrip())
    # A number that is cut is not "truncated" to msgspec, but wrong at its last byte.
    if "truncated" in message or (found and int(found[1]) >= end):
        line = data.count(b"\n", 0, end) + 1
        return FormatError("the JSON is cut short: the file ends before it does", path=path, line=line)
    if found is None:
        return FormatError(f"this is no JSON: {message}", path=path)
    at = int(found[1])
    line = data.count(b"\n", 0, at) + 1
    column = at - data.rfind(b"\n", 0, at)
    special = re.match(rb"[+-]?(nan|inf(inity)?)", data[max(at - 1, 0) :].lstrip(b" ,[:"), re.IGNORECASE)
    if special:
        return FormatError(
            f"{special[0].decode()} is no number that JSON can hold (column {column})", path=path, line=line
        )
    reason = message.split(": ", 1)[-1].removesuffix(found[0]).strip()
    return FormatError(f"this is no JSON: {reason} at column {column}", path=path, line=line)


def _in_words(message: str, schema: type) -> str:
    """msgspec's "Expected `float`, got `str` - at `$.times[3]`" as "times[3]: expected float, got str"."""
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
    """The skeleton that a file names or describes."""
    if isinstance(schema, str):
        if schema not in BODIES:
            ours = " and ".join(BODIES)
            raise FormatError(
                f"skeleton {quoted(schema)} has no description here; only {ours} go by their names alone", path=path
            )
        return BODIES[schema]()
    if len(schema.joints) > MOST_JOINTS:
        raise FormatError(f"more than {MOST_JOINTS} joints are no body", path=path)
    index: dict[str, int] = {}
    parents = []
    for joint in schema.joints:
        if joint.parent is not None and joint.parent not in index:
            raise FormatError(
                f"skeleton {quoted(schema.name)}: the parent {quoted(joint.parent)} of {quoted(joint.name)} "
                f"does not stand before it{did_you_mean(joint.parent, index)}",
                path=path,
            )
        parents.append(-1 if joint.parent is None else index[joint.parent])
        index[joint.name] = len(index)
    offsets = np.array([joint.offset for joint in schema.joints], dtype=np.float64).reshape(-1, 3)
    tips = np.array([joint.tip or (0.0, 0.0, 0.0) for joint in schema.joints], dtype=np.float64).reshape(-1, 3)
    if not (np.all(np.abs(offsets) <= LARGEST) and np.all(np.abs(tips) <= LARGEST)):
        raise FormatError(f"skeleton {quoted(schema.name)} has an offset beyond {LARGEST:g} m", path=path)
    try:
        return Skeleton(schema.name, tuple(joint.name for joint in schema.joints), tuple(parents), offsets, tips)
    except SkeletonError as error:
        raise FormatError(str(error), path=path) from error


def skeleton_text(skeleton: Skeleton, indent: str) -> str:
    """JSON of a skeleton: its name if it is one of ours in its own proportions, else one joint a line."""
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
    """A string as JSON."""
    return json.dumps(value, ensure_ascii=False)


def rounded(array: Floats) -> Floats:
    """`array` to the decimals that are written; 0 for -0."""
    return np.asarray(np.round(array, DECIMALS) + 0.0, dtype=np.float64)


def check_lengths(array: Floats, what: str, path: FilePath) -> None:
    """FormatError if a length or a time in `array` [..., n] is beyond what any body reaches."""
    wrong = ~(np.abs(array) <= LARGEST)
    if wrong.any():
        where = tuple(np.argwhere(wrong)[0])
        place = f" in frame {where[0]}" if array.ndim > 1 else ""
        raise FormatError(f"{what}{place} is {array[where]:g}, beyond {LARGEST:g}", path=path)


def unit_rotations(array: Floats, names: Sequence[str], path: FilePath) -> Floats:
    """Make quaternions [J, 4] or [T, J, 4] unit, in place; zero is a FormatError, a length off by > 1e-6 a warning."""
    if not np.all(np.abs(array) <= LARGEST):
        joint = names[np.argwhere(~(np.abs(array) <= LARGEST))[0][-2]]
        raise FormatError(f"the rotation of {joint} has a number beyond {LARGEST:g}", path=path)
    length = np.linalg.norm(array, axis=-1)
    if np.any(length < 1e-6):
        where = np.argwhere(length < 1e-6)[0]
        raise FormatError(f"{_place(where, names)} is zero, which is no rotation (no rotation is 0 0 0 1)", path=path)
    off = np.abs(length - 1.0)
    if np.any(off > _UNIT):
        wrong = np.argwhere(off > _UNIT)
        first = tuple(wrong[0])
        more = f", and {len(wrong) - 1} more like it" if len(wrong) > 1 else ""
        warnings.warn(
            f"{path}: {_place(wrong[0], names)} has length {length[first]:.6g}, not 1{more}; made 1",
            MotionMindWarning,
            stacklevel=4,
        )
    # What this code wrote stays as it is, bit by bit.
    mend = off > _AS_WRITTEN
    if mend.any():
        array[mend] = rot.normalise(array[mend])
    return array


def _place(where: Indices, names: Sequence[str]) -> str:
    frame = f" in frame {where[0]}" if len(where) > 1 else ""
    return f"the rotation of {names[where[-1]]}{frame}"


def check_joints(found: Sequence[str], skeleton: Skeleton, path: FilePath) -> None:
    """FormatError names the joints that `found` lacks, and those that `skeleton` does not have."""
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
