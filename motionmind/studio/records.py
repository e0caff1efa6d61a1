"""The kinds of lines in a project's file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

from motionmind.errors import enumerated
from motionmind.studio.edits import Edit
from motionmind.studio.findings import Finding


class Head(msgspec.Struct, frozen=True):
    """The first line."""

    format: str
    version: int
    corpora: dict[str, str]
    title: str = ""
    corpus: str = ""


class Corpora(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Versions of corpora that the project uses from here on, besides those of earlier lines."""

    corpora: dict[str, str]


class EditLine(msgspec.Struct, frozen=True):
    """An edit, the number of its line, and the window that made it."""

    edit: Edit
    number: int
    window: str


class UndoLine(msgspec.Struct, frozen=True):
    """The number of an edit that is undone."""

    undo: int
    number: int
    window: str


class RedoLine(msgspec.Struct, frozen=True):
    """The number of an edit that is redone."""

    redo: int
    number: int
    window: str


_LINE_TYPES: Mapping[str, Any] = {
    "format": Head,
    "corpora": Corpora,
    "finding": Finding,
    "edit": EditLine,
    "undo": UndoLine,
    "redo": RedoLine,
}


def decode_line(data: bytes) -> Any:
    """Decode a line; None for a movement, which is read on demand; raise ValueError if the line is damaged."""
    fields = msgspec.json.decode(data, type=dict[str, msgspec.Raw])
    if "movement" in fields:
        return None
    for name, kind in _LINE_TYPES.items():
        if name in fields:
            return msgspec.json.decode(data, type=kind)
    raise ValueError(f"a line of unknown kind, with {enumerated(sorted(fields))}")


@dataclass
class Change:
    """An edit of the project.

    Attributes:
        number: its number; numbers increase.
        edit: the edit.
        window: the window that made it.
        undone: whether it is undone.
    """

    number: int
    edit: Edit
    window: str
    undone: bool = False
