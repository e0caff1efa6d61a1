"""Names of clips in files, as in hero.glb#Dance: how they are spelled, and those of glTF without its movement.

Names in files may be empty, equal or unprintable. Here each animation has a name of its own, which can be typed.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from motionmind.display import displayed
from motionmind.files import FilePath

GLTF_SUFFIXES = (".glb", ".gltf", ".vrm", ".vrma")
_MAX_CLIP_CHARS = 100
CLIP_SUFFIXES = (*GLTF_SUFFIXES, ".bvh", ".npy")  # of files that may hold several: BVH a body each, MDM samples
_END_OF_FILE = re.compile(r"\.(?:glb|gltf|vrma?|bvh|npy)(?=#)", re.IGNORECASE)


def split_clip(path: FilePath) -> tuple[FilePath, str | None]:
    """Split a path such as "hero.glb#Dance" into the file and the clip's name; None if it names no clip.

    A file with the whole name has priority, and so has a file with a longer name.

    >>> from motionmind.clip_names import split_clip
    >>> split_clip("hero.glb#Hip Hop"), split_clip("hero.json#1")
    (('hero.glb', 'Hip Hop'), ('hero.json#1', None))
    """
    word = os.fspath(path)
    ends = [found.end() for found in _END_OF_FILE.finditer(word)] if "#" in word else []
    if not ends or os.path.lexists(word):
        return path, None
    end = next((end for end in reversed(ends) if os.path.isfile(word[:end])), ends[0])  # noqa: PTH113 - may be too long
    return word[:end], word[end + 1 :]


def distinct_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return a name for each animation of a file: its own, if no earlier one has it and it is not empty.

    Repeated names are numbered; an animation without a name has its number in the file, from 1. Unprintable characters
    become escapes, and the middle of a long name is left out.

    >>> from motionmind.clip_names import distinct_names
    >>> distinct_names(["Walk", "Dance", "Walk", ""])
    ('Walk', 'Dance', 'Walk (2)', '4')
    """
    shown = [displayed(name, _MAX_CLIP_CHARS) if name.strip() else "" for name in names]
    taken, numbers = set(shown), dict[str, int]()
    seen: set[str] = set()
    found = []
    for number, name in enumerate(shown, start=1):
        base = unique = name or str(number)
        while unique in (seen if unique == name else taken):
            numbers[base] = numbers.get(base, 1) + 1
            unique = f"{base} ({numbers[base]})"
        seen.add(unique)
        taken.add(unique)
        found.append(unique)
    return tuple(found)


def find_name(names: Sequence[str], wanted: str) -> int | None:
    """Return the index of a name among `distinct_names`, or of a number from 1 that is no name; None without it."""
    shown = displayed(wanted, _MAX_CLIP_CHARS)
    if shown in names:
        return names.index(shown)
    if re.fullmatch(r"[1-9]\d{0,8}", wanted, re.ASCII) and int(wanted) <= len(names):
        return int(wanted) - 1
    return None


def read_names(path: FilePath) -> tuple[str, ...]:
    """Return `distinct_names` of the animations in a file; none if it cannot be read."""
    import msgspec  # here, since few names need it

    try:
        if not Path(path).is_file():  # a pipe can be read once
            return ()
        with Path(path).open("rb") as file:
            text = b"".join(_text(file))
        document = msgspec.json.decode(text, type=dict[str, msgspec.Raw])
        rows = msgspec.json.decode(document.get("animations", b"[]"), type=list[dict[str, msgspec.Raw]])
        return distinct_names([msgspec.json.decode(row.get("name", b'""'), type=str) for row in rows])
    except (OSError, ValueError, RecursionError, struct.error, msgspec.MsgspecError):
        return ()


def _text(file: BinaryIO) -> Iterator[bytes]:
    """Yield the JSON of a glTF file: of a binary one its first chunk, which holds it (4.4.3)."""
    start = file.read(20)
    if not start.startswith(b"glTF"):
        yield start
        yield file.read()
        return
    yield file.read(struct.unpack_from("<I", start, 12)[0])
