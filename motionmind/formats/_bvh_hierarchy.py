"""The HIERARCHY of a BVH file: its joints, where they hang and stand, and their channels."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from motionmind.errors import FormatError, quoted
from motionmind.files import FilePath
from motionmind.formats.text import MOST_JOINTS, to_number

_CHANNEL = re.compile(r"([XYZ])(POSITION|ROTATION)")


@dataclass
class BvhJoint:
    """One ROOT or JOINT of the hierarchy as it stands in the file."""

    name: str
    parent: int
    line: int
    offset: list[float] | None = None
    channels: list[str] = field(default_factory=list)  # "XPOSITION", ..., in the file's order
    tip: list[float] | None = None


def _tokens(lines: list[str]) -> Iterator[tuple[str, int]]:
    """Words of the hierarchy with their line numbers; braces are words, whatever they touch."""
    for number, line in enumerate(lines, start=1):
        if not is_comment(line):
            for token in line.replace("{", " { ").replace("}", " } ").split():
                yield token, number


def is_comment(line: str) -> bool:
    """Whether the line begins with # or //, as some tools write although the format has no comments."""
    return line.lstrip().startswith(("#", "//"))


class _Words:
    """The words of the hierarchy, one after the other, with the line where the reader is."""

    def __init__(self, lines: list[str], path: FilePath) -> None:
        self.words = list(_tokens(lines))
        self.path = path
        self.at = 0
        self.end = len(lines)

    def __bool__(self) -> bool:
        return self.at < len(self.words)

    @property
    def line(self) -> int:
        """Line of the word that was taken last."""
        return self.words[self.at - 1][1] if self.at else 1

    def error(self, message: str) -> FormatError:
        """A FormatError where the reader is."""
        return FormatError(message, path=self.path, line=self.line)

    def take(self, wanted: str) -> str:
        """The next word; FormatError says what was `wanted` where there is none."""
        if not self:
            raise FormatError(f"the hierarchy ends where {wanted} was expected", path=self.path, line=self.end)
        self.at += 1
        return self.words[self.at - 1][0]

    def take_name(self, kind: str) -> str:
        """The words that are left of the line, up to the brace that must follow."""
        line = self.line
        name: list[str] = []
        while (word := self.take(f"the '{{' of a {kind}")) != "{":
            if word == "}" or self.line != line:
                raise self.error(f"{quoted(word)} where the '{{' of {kind} {' '.join(name)} was expected")
            name.append(word)
        return " ".join(name)

    def take_vector(self) -> list[float]:
        """The next three words as numbers."""
        return [to_number(self.take("a number"), self.path, self.line) for _ in range(3)]


def read_hierarchy(lines: list[str], path: FilePath) -> list[BvhJoint]:
    """The joints of the lines from HIERARCHY up to MOTION, parents before their children.

    FormatError names file and line of what is no hierarchy. How deep joints nest does not matter: there is no
    recursion.
    """
    words = _Words(lines, path)
    if not words or words.take("HIERARCHY").upper() != "HIERARCHY":
        raise FormatError("no BVH file: it must begin with HIERARCHY", path=path, line=words.line)
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
                joint.tip = joint.tip or vector  # of several ends the first
        elif kind == "CHANNELS" and here is not None and here >= 0:
            joints[here].channels += _take_channels(words, joints[here])
        else:
            raise words.error(f"{quoted(word)} where ROOT, JOINT, End Site, OFFSET, CHANNELS or a brace was expected")
    if open_blocks or not joints:
        missing = f"{len(open_blocks)} '}}' missing" if open_blocks else "no ROOT"
        raise FormatError(f"the hierarchy is not whole: {missing}", path=path, line=len(lines))
    names: set[str] = set()
    for joint in joints:
        if joint.name in names:
            raise FormatError(f"a second joint named {quoted(joint.name)}", path=path, line=joint.line)
        names.add(joint.name)
    return joints


def _open_joint(kind: str, words: _Words, joints: list[BvhJoint], open_blocks: list[int]) -> None:
    """Read the name and brace of a ROOT or JOINT and make it the block that is open."""
    if kind == "ROOT" and joints:
        raise words.error("a second ROOT: a file may hold one figure only")
    parent = open_blocks[-1] if open_blocks else -1
    if (kind == "JOINT") != (parent >= 0):
        raise words.error(f"a {kind} may not stand here")
    line = words.line
    name = words.take_name(kind)
    if not name:
        raise FormatError(f"a {kind} without a name", path=words.path, line=line)
    joints.append(BvhJoint(name, parent, line))
    if len(joints) > MOST_JOINTS:
        raise words.error(f"more than {MOST_JOINTS} joints are no body")
    open_blocks.append(len(joints) - 1)


def _take_channels(words: _Words, joint: BvhJoint) -> list[str]:
    count = words.take("the number of channels")
    if not re.fullmatch(r"[0-9]{1,3}", count):
        raise words.error(f"{quoted(count)} where the number of channels of {quoted(joint.name)} was expected")
    channels = list(joint.channels)
    for _ in range(int(count)):
        channel = words.take("a channel").upper()
        if not _CHANNEL.fullmatch(channel):
            raise words.error(f"{quoted(channel)} is no channel; they are called Xposition, Zrotation and so on")
        if channel.endswith("POSITION") and channel in channels:
            raise words.error(f"joint {quoted(joint.name)} has the channel {channel} twice")
        channels.append(channel)
    return channels[len(joint.channels) :]
