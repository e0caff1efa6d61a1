"""Reads the HIERARCHY of a BVH file: its joints, their parents, offsets and channels."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from motionmind.errors import FormatError, quoted
from motionmind.files import FilePath
from motionmind.formats.text import MAX_JOINTS, to_number

_CHANNEL = re.compile(r"([XYZ])(POSITION|ROTATION)")


@dataclass
class BvhJoint:
    """One ROOT or JOINT of the hierarchy, in the file's unit.

    Attributes:
        name: the joint's name.
        parent: index of its parent, -1 for a root.
        line: the line where it begins.
        offset: its OFFSET [3]; None until it is read.
        channels: "XPOSITION", ..., in the file's order.
        tip: OFFSET of its first End Site [3]; None without one.
    """

    name: str
    parent: int
    line: int
    offset: list[float] | None = None
    channels: list[str] = field(default_factory=list)
    tip: list[float] | None = None


def _tokens(lines: list[str]) -> Iterator[tuple[str, int]]:
    """Yield the hierarchy's words with their line numbers; split braces from words."""
    for number, line in enumerate(lines, start=1):
        if not is_comment(line):
            for token in line.replace("{", " { ").replace("}", " } ").split():
                yield token, number


def is_comment(line: str) -> bool:
    """Return whether the line begins with # or //; the format has no comments, but some programs write them."""
    return line.lstrip().startswith(("#", "//"))


class _Words:
    """A cursor over the hierarchy's words, with line numbers."""

    def __init__(self, lines: list[str], path: FilePath) -> None:
        self.words = list(_tokens(lines))
        self.path = path
        self.at = 0
        self.end = len(lines)

    def __bool__(self) -> bool:
        return self.at < len(self.words)

    @property
    def line(self) -> int:
        """Line of the last word taken."""
        return self.words[self.at - 1][1] if self.at else 1

    def error(self, message: str) -> FormatError:
        """Return a FormatError at the current line."""
        return FormatError(message, path=self.path, line=self.line)

    def take(self, wanted: str) -> str:
        """Take the next word; FormatError names what was `wanted` if there is none."""
        if not self:
            raise FormatError(f"the hierarchy ends where {wanted} was expected", path=self.path, line=self.end)
        self.at += 1
        return self.words[self.at - 1][0]

    def take_name(self, kind: str) -> str:
        """Take the rest of the line as a name, up to the brace that must follow."""
        line = self.line
        name: list[str] = []
        while (word := self.take(f"the '{{' of a {kind}")) != "{":
            if word == "}" or self.line != line:
                raise self.error(f"{quoted(word)} where the '{{' of {kind} {' '.join(name)} was expected")
            name.append(word)
        return " ".join(name)

    def take_vector(self) -> list[float]:
        """Take three numbers."""
        return [to_number(self.take("a number"), self.path, self.line) for _ in range(3)]


def read_hierarchy(lines: list[str], path: FilePath) -> list[BvhJoint]:
    """Read the joints from the lines between HIERARCHY and MOTION.

    Joints may nest to any depth. Each ROOT begins another body.

    Returns:
        The joints, parents before their children, body after body.

    Raises:
        FormatError: the hierarchy is invalid or incomplete; names file and line.
    """
    words = _Words(lines, path)
    if not words or words.take("HIERARCHY").upper() != "HIERARCHY":
        raise FormatError("not a BVH file: it must begin with HIERARCHY", path=path, line=words.line)
    joints: list[BvhJoint] = []
    open_blocks: list[int] = []  # indices into joints; -1 for an End Site
    while words:
        word = words.take("a joint")
        kind = word.upper()
        here = open_blocks[-1] if open_blocks else None
        if kind in ("ROOT", "JOINT"):
            _open_joint(kind, words, joints, open_blocks)
        elif kind == "}" and here is not None:
            open_blocks.pop()
            if here >= 0 and joints[here].offset is None:
                raise words.error(f"joint {quoted(joints[here].name)} has no OFFSET")
        elif kind == "END" and here is not None and here >= 0:
            words.take_name("End Site")
            open_blocks.append(-1)
        elif kind == "OFFSET" and here is not None:
            vector = words.take_vector()
            if here >= 0:
                joints[here].offset = vector
            else:
                joint = joints[open_blocks[-2]]
                joint.tip = joint.tip or vector  # the first of several ends
        elif kind == "CHANNELS" and here is not None and here >= 0:
            joints[here].channels += _take_channels(words, joints[here])
        else:
            raise words.error(f"{quoted(word)} where ROOT, JOINT, End Site, OFFSET, CHANNELS or a brace was expected")
    if open_blocks or not joints:
        missing = f"{len(open_blocks)} '}}' missing" if open_blocks else "no ROOT"
        raise FormatError(f"the hierarchy is incomplete: {missing}", path=path, line=len(lines))
    _check_unique_names(joints, path)
    return joints


def _check_unique_names(joints: list[BvhJoint], path: FilePath) -> None:
    names: set[str] = set()
    for joint in joints:
        if joint.parent < 0:  # bodies may have the same names
            names.clear()
        if joint.name in names:
            raise FormatError(f"a second joint named {quoted(joint.name)}", path=path, line=joint.line)
        names.add(joint.name)


def _open_joint(kind: str, words: _Words, joints: list[BvhJoint], open_blocks: list[int]) -> None:
    """Read the name and brace of a ROOT or JOINT and open its block."""
    parent = open_blocks[-1] if open_blocks else -1
    if (kind == "JOINT") != (parent >= 0):
        raise words.error(f"a {kind} may not appear here")
    line = words.line
    name = words.take_name(kind)
    if not name:
        raise FormatError(f"a {kind} without a name", path=words.path, line=line)
    joints.append(BvhJoint(name, parent, line))
    if len(joints) > MAX_JOINTS:
        raise words.error(f"more than {MAX_JOINTS} joints: not a body")
    open_blocks.append(len(joints) - 1)


def _take_channels(words: _Words, joint: BvhJoint) -> list[str]:
    """Take the count and names of channels that follow CHANNELS."""
    count = words.take("the number of channels")
    if not re.fullmatch(r"[0-9]{1,3}", count):
        raise words.error(f"{quoted(count)} where the number of channels of {quoted(joint.name)} was expected")
    channels = list(joint.channels)
    for _ in range(int(count)):
        channel = words.take("a channel").upper()
        if not _CHANNEL.fullmatch(channel):
            raise words.error(f"{quoted(channel)} is not a channel; names are Xposition, Zrotation and the like")
        if channel.endswith("POSITION") and channel in channels:
            raise words.error(f"joint {quoted(joint.name)} has the channel {channel} twice")
        channels.append(channel)
    return channels[len(joint.channels) :]
