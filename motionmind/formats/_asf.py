"""Reads Acclaim's skeleton file (ASF): bones, frames and channels. `asf_amc` explains their meaning."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, did_you_mean, enumerated, quoted
from motionmind.files import FilePath, name_of
from motionmind.formats.text import MAX_JOINTS, read_lines, to_number, to_numbers
from motionmind.formats.units import UNITS
from motionmind.geometry import rotations as rot

_CHANNEL = re.compile(r"[TR][XYZ]|L")


@dataclass
class Bone:
    """The root, or one bone of :bonedata.

    Attributes:
        name: the bone's name; "root" for the root.
        line: the line where it begins.
        direction: unit vector from its start to its end [3]; 0 for none.
        length: in the file's unit.
        axis: orientation of the frame of its angles, quaternion [4].
        channels: "TX", "RX", ..., in the AMC's order.
    """

    name: str
    line: int
    direction: Floats = field(default_factory=lambda: np.zeros(3))
    length: float = 0.0
    axis: Floats = field(default_factory=lambda: rot.IDENTITY)
    channels: list[str] = field(default_factory=list)


@dataclass
class Acclaim:
    """The contents of an ASF file.

    Attributes:
        path: the file.
        bones: by name, the root first and parents before their children.
        parents: each bone's parent, by name; the root has none.
        position: place [3], in the file's unit, added to the root's movement.
        scale: metres in one unit of the file.
        degrees: whether its angles are in degrees.
    """

    path: FilePath
    bones: dict[str, Bone]
    parents: dict[str, str]
    position: Floats
    scale: float
    degrees: bool

    def skeleton(self) -> Skeleton:
        """Build the skeleton in metres: a joint at each bone's start, its parent's end."""
        index = {name: joint for joint, name in enumerate(self.bones)}
        parents = [index[self.parents[name]] if name in self.parents else -1 for name in self.bones]
        ends = np.array([bone.length * bone.direction for bone in self.bones.values()]) * self.scale
        offsets = np.array([ends[parent] if parent >= 0 else np.zeros(3) for parent in parents])
        leaf = [joint not in parents for joint in range(len(parents))]
        return Skeleton(name_of(self.path), tuple(self.bones), tuple(parents), offsets, ends * np.array(leaf)[:, None])


def fixed_axes(order: str, angles: Floats) -> Floats:
    """Return rotations [..., 4] by `angles` [..., len(order)] radians about fixed axes, applied in the given order."""
    # Extrinsic rotations are intrinsic rotations in reverse order.
    return rot.from_euler(order[::-1], angles[..., ::-1])


def _tokenise(lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield number and words of each non-empty line; commas and parentheses are blanks, # begins a comment."""
    for number, line in enumerate(lines, start=1):
        words = re.sub(r"[(),]", " ", line.split("#")[0]).split()
        if words:
            yield number, words


def read_asf(path: FilePath) -> Acclaim:
    """Read an ASF file's skeleton; FormatError names the file and line of a fault."""
    lines = read_lines(path)
    sections: dict[str, list[tuple[int, list[str]]]] = {}
    section: list[tuple[int, list[str]]] = []
    for number, words in _tokenise(lines):
        if words[0].startswith(":"):
            name = words[0].lower()
            section = sections.setdefault(name, [])
        else:
            section.append((number, words))
    for wanted in (":root", ":bonedata", ":hierarchy"):
        if wanted not in sections:
            raise FormatError(f"incomplete ASF file: there is no section {wanted}", path=path, line=len(lines))
    units = {words[0].lower(): (number, words) for number, words in sections.get(":units", [])}
    degrees = units.get("angle", (0, ["", "deg"]))[1][-1].lower() != "rad"
    number, words = units.get("length", (0, ["", "1"]))
    length = to_number(words[-1], path, number)
    if not length > 1e-6:
        raise FormatError(f"the unit of length is {words[-1]}; it must be more than 0", path=path, line=number)
    root, position = _read_root(sections[":root"], degrees, path)
    bones = {bone.name: bone for bone in _read_bones(sections[":bonedata"], degrees, path)}
    bones["root"] = root
    order, parents = _read_hierarchy(sections[":hierarchy"], bones, path)
    return Acclaim(path, {name: bones[name] for name in order}, parents, position, UNITS["in"] / length, degrees)


def _read_root(section: list[tuple[int, list[str]]], degrees: bool, path: FilePath) -> tuple[Bone, Floats]:
    """Read the root, and the place [3] added to its movement."""
    root = Bone("root", section[0][0] if section else 1)
    position, orientation, order = np.zeros(3), np.zeros(3), "XYZ"
    for number, (keyword, *words) in section:
        if keyword.lower() == "order":
            root.channels = _channels(words, path, number)
        elif keyword.lower() == "axis":
            order = _rotation_order(words, path, number)
        elif keyword.lower() == "position":
            position = _vector(words, path, number)
        elif keyword.lower() == "orientation":
            orientation = _vector(words, path, number)
    if not root.channels:
        raise FormatError("the root has no order (TX TY TZ RX RY RZ)", path=path, line=root.line)
    root.axis = fixed_axes(order, np.radians(orientation) if degrees else orientation)
    return root, position


def _read_bones(section: list[tuple[int, list[str]]], degrees: bool, path: FilePath) -> Iterator[Bone]:
    """Yield the bones of :bonedata, each from its begin to its end."""
    bone: Bone | None = None
    names = {"root"}
    for number, (keyword, *words) in section:
        match keyword.lower():
            case "begin" if bone is None:
                bone = Bone("", number)
            case "begin":
                break
            case "end":
                if bone is None or not bone.name or bone.name in names:
                    fault = "a bone without a name" if bone is None or not bone.name else f"a second bone {bone.name!r}"
                    raise FormatError(fault, path=path, line=number if bone is None else bone.line)
                names.add(bone.name)
                if len(names) > MAX_JOINTS:
                    raise FormatError(f"more than {MAX_JOINTS} bones: not a body", path=path, line=number)
                yield bone
                bone = None
            case _ if bone is not None:
                _read_bone_line(bone, keyword.lower(), words, degrees=degrees, path=path, line=number)
    if bone is not None:
        raise FormatError(f"bone {quoted(bone.name)} has no end", path=path, line=bone.line)


def _read_bone_line(bone: Bone, keyword: str, words: list[str], *, degrees: bool, path: FilePath, line: int) -> None:
    """Read one line between begin and end; ignore limits, masses and the like."""
    if keyword == "name":
        bone.name = " ".join(words)
    elif keyword == "direction":
        direction = _vector(words, path, line)
        size = float(np.linalg.norm(direction))
        bone.direction = direction / size if size > 1e-9 else np.zeros(3)
    elif keyword == "length":
        bone.length = to_number(" ".join(words), path, line)
    elif keyword == "axis":
        order = _rotation_order(words[3:], path, line)
        angles = _vector(words[:3], path, line)
        bone.axis = fixed_axes(order, np.radians(angles) if degrees else angles)
    elif keyword == "dof":
        bone.channels = _channels(words, path, line)


def _channels(words: list[str], path: FilePath, line: int) -> list[str]:
    """Return the channels in upper case; FormatError if one is unknown or repeated."""
    channels = [word.upper() for word in words]
    for channel in channels:
        if not _CHANNEL.fullmatch(channel):
            message = f"{quoted(channel)} is not a channel; channels are tx ty tz rx ry rz l"
            raise FormatError(message, path=path, line=line)
        if channels.count(channel) > 1:
            raise FormatError(f"the channel {channel} twice", path=path, line=line)
    return channels


def _rotation_order(words: list[str], path: FilePath, line: int) -> str:
    """Return an order of axes such as "XYZ", the default."""
    order = "".join(words).upper() or "XYZ"
    if sorted(order) != ["X", "Y", "Z"]:
        raise FormatError(f"{quoted(order)} where an order of axes such as XYZ was expected", path=path, line=line)
    return order


def _vector(words: list[str], path: FilePath, line: int) -> Floats:
    if len(words) != 3:
        raise FormatError(f"{len(words)} numbers where three were expected", path=path, line=line)
    return np.array(to_numbers(words, path, line))


def _read_hierarchy(
    section: list[tuple[int, list[str]]], bones: dict[str, Bone], path: FilePath
) -> tuple[list[str], dict[str, str]]:
    """Return the bones' names, parents before their children, and each bone's parent."""
    parents: dict[str, str] = {}
    children: dict[str, list[str]] = {name: [] for name in bones}
    for number, words in section:
        if words[0].lower() in ("begin", "end") and len(words) == 1:
            continue
        unknown = next((word for word in words if word not in bones), None)
        if unknown is not None:
            raise FormatError(
                f"there is no bone {quoted(unknown)}{did_you_mean(unknown, bones)}", path=path, line=number
            )
        for child in words[1:]:
            if child in parents or child == "root":
                raise FormatError(f"bone {quoted(child)} hangs from two others", path=path, line=number)
            parents[child] = words[0]
            children[words[0]].append(child)
    order: list[str] = []
    waiting = ["root"]
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children[order[-1]])
    loose = [name for name in bones if name not in order]
    if loose:
        raise FormatError(f"the hierarchy does not reach {enumerated(loose)}", path=path, line=bones[loose[0]].line)
    return order, parents
