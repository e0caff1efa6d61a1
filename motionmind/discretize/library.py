"""Expert libraries: files in which a person names the states of a body's joints.

A library is a TOML file:

    format = "motionmind-library"
    version = 1
    title = "..."          # title, author and licence may be left out
    author = "..."
    licence = "..."
    skeleton = "human23"

    [hip]                                    # both hips; written for the left one
    "rest" = ""                              # the identity: as in the skeleton's rest
    "devant 90 turned out" = "x -90, y 45"   # turns in degrees, each about the axes as the last one has left them
    "as recorded" = [0.0, 0.0, 0.383, 0.924] # or a quaternion x, y, z, w

A table is named after a joint, or after a pair of joints without side. A pair is written for the left joint; the right
one has the mirrored states (x and -x exchanged).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_path, check_type
from motionmind.body.human import BODIES
from motionmind.bundled import bundled
from motionmind.discretize.protocol import joints_meant, nameable
from motionmind.discretize.turns import format_turns, parse_turns
from motionmind.errors import FormatError, did_you_mean, suggestion
from motionmind.files import FilePath, format_toml_string, parse_toml, read_bytes, write_atomically
from motionmind.geometry import rotations as rot

LIBRARY_FORMAT = "motionmind-library"
LIBRARY_VERSION = 1
SAME_STATE_DEG = 0.01  # closer states of a joint are one state with two names
_TEXT_KEYS = ("title", "author", "licence", "skeleton")


@dataclass(frozen=True)
class Library:
    """Named states, by joint or pair of joints.

    Attributes:
        tables: for each joint, or pair of joints ("hip"), the orientation of each state by name, as written: turns, or
            a quaternion x, y, z, w. Their order numbers the states.
        title: its title.
        author: its author.
        licence: its licence.
        skeleton: the skeleton whose rest posture the orientations start from.
        path: its file, for messages.

    >>> from motionmind.discretize import Library, read_library
    >>> isinstance(read_library("human23"), Library)
    True
    """

    tables: Mapping[str, Mapping[str, str | tuple[float, ...]]]
    title: str = ""
    author: str = ""
    licence: str = ""
    skeleton: str = "human23"
    path: str = field(default="library", compare=False)
    _rotations: dict[str, Floats] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check all tables; a FormatError names the table and the entry at fault."""
        if not self.tables:
            raise FormatError("a library needs at least one table of states", path=self.path)
        for text in (*(getattr(self, key) for key in _TEXT_KEYS), *self.tables):
            self._check_text(text)
        rotations = {table: self._read_table(table) for table in self.tables}
        object.__setattr__(self, "_rotations", rotations)
        if self.skeleton in BODIES:
            self.tables_of(BODIES[self.skeleton]().names)

    def rotations(self, table: str) -> Floats:
        """Return the orientations [S, 4] of the states in `table`, as written: of a pair, the left joint's."""
        return self._rotations[table]

    def tables_of(self, names: Sequence[str]) -> dict[int, str]:
        """Return the table of each joint in `names` that has one, by the joint's index.

        Raises:
            FormatError: a table matches no joint, or two tables match the same joint.
        """
        owner: dict[int, str] = {}
        for table in self.tables:
            joints = joints_meant(table, names)
            if not joints:
                hint = did_you_mean(table, nameable(names)) or f"; there are {', '.join(names)}"
                raise FormatError(f"[{table}]: no such joint{hint}", path=self.path)
            for j in joints:
                if j in owner:
                    raise FormatError(f"{names[j]} is in [{owner[j]}] and in [{table}]; keep one", path=self.path)
                owner[j] = table
        return owner

    def of_joint(self, table: str, joint: str) -> Floats:
        """Return the orientations [S, 4] that `table` gives to `joint`, mirrored for the right one of a pair."""
        q = self.rotations(table)
        return rot.mirror(q) if table != joint and joint.startswith("right_") else q

    def _check_text(self, text: str) -> None:
        """Reject lone surrogates, which JSON allows and UTF-8 does not."""
        try:
            text.encode()
        except UnicodeEncodeError:
            raise FormatError(f"{text!r:.60} is not text", path=self.path) from None

    def _read_table(self, table: str) -> Floats:
        entries = self.tables[table]
        if not isinstance(entries, Mapping) or not entries:
            raise FormatError(f"[{table}] must be a table of at least one state", path=self.path)
        states = np.stack([self._read_entry(table, name, value) for name, value in entries.items()])
        names = list(entries)
        for n in range(1, len(states)):
            apart = np.degrees(rot.angle(states[:n], states[n]))
            if apart.min() < SAME_STATE_DEG:
                twin = names[int(np.argmin(apart))]
                raise FormatError(
                    f'[{table}] "{names[n]}": the same orientation as "{twin}"; states must differ by at least '
                    f"{SAME_STATE_DEG} degrees",
                    path=self.path,
                )
        return states

    def _read_entry(self, table: str, name: str, value: object) -> Floats:
        self._check_text(name)
        where = f'[{table}] "{name}": '
        if not name.strip():
            raise FormatError(f"{where}a state needs a name", path=self.path)
        if isinstance(value, str):
            try:
                return parse_turns(value)
            except ValueError as error:
                raise FormatError(f"{where}{error}", path=self.path) from None
        numbers = isinstance(value, (list, tuple)) and all(type(v) in (int, float) for v in value)
        if not numbers or len(value) != 4:  # type: ignore[arg-type]
            raise FormatError(
                f"{where}must be turns such as 'x -90, y 45' or a quaternion [x, y, z, w], not {value!r:.60}",
                path=self.path,
            )
        try:
            q = np.array(value, dtype=np.float64)
        except OverflowError:
            q = np.full(4, np.inf)
        if not np.isfinite(q).all() or np.abs(q).max() > 1e100:
            raise FormatError(f"{where}a quaternion needs finite numbers", path=self.path)
        if not np.linalg.norm(q) > 1e-3:
            raise FormatError(f"{where}a quaternion of length zero is not a rotation", path=self.path)
        return rot.normalise(q)


def parse_library(text: str, *, path: str = "library") -> Library:
    """Parse the TOML text of a library file.

    Args:
        text: the TOML.
        path: where it is from, for messages.

    Raises:
        FormatError: it is not a library; the message names the table and the entry at fault.
    """
    try:
        data = parse_toml(text)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"not TOML: {error}", path=path) from None
    return library_from_mapping(data, path=path)


def library_from_mapping(data: Mapping[str, object], *, path: str = "library") -> Library:
    """Make a library from the mapping in its TOML or JSON; raise a FormatError if `data` is not a library."""
    if data.get("format") != LIBRARY_FORMAT:
        raise FormatError(f'not a library of states: format must be "{LIBRARY_FORMAT}"', path=path)
    version = data.get("version")
    if type(version) is not int or version != LIBRARY_VERSION:
        raise FormatError(f"version must be {LIBRARY_VERSION}, not {version!r:.40}", path=path)
    texts = {}
    for key in _TEXT_KEYS:
        value = data.get(key, "human23" if key == "skeleton" else "")
        if not isinstance(value, str):
            raise FormatError(f"{key} must be text, not {value!r:.40}", path=path)
        texts[key] = value
    tables: dict[str, Mapping[str, str | tuple[float, ...]]] = {}
    for key, table in data.items():
        if key in (*_TEXT_KEYS, "format", "version"):
            continue
        if not isinstance(table, Mapping):
            known = ", ".join(("format", "version", *_TEXT_KEYS))
            raise FormatError(f"{key!r} is neither a joint's table nor one of {known}", path=path)
        tables[key] = {name: tuple(v) if isinstance(v, list) else v for name, v in table.items()}
    return Library(tables, **texts, path=path)


def library_to_mapping(library: Library) -> dict[str, object]:
    """Return the library as plain JSON values; the inverse of `library_from_mapping`."""
    head: dict[str, object] = {"format": LIBRARY_FORMAT, "version": LIBRARY_VERSION}
    head.update({key: getattr(library, key) for key in _TEXT_KEYS})
    for table, entries in library.tables.items():
        head[table] = {name: value if isinstance(value, str) else list(value) for name, value in entries.items()}
    return head


def library_path(name_or_path: FilePath) -> Path:
    """Return the path of a library file.

    Args:
        name_or_path: the name of a bundled library, or a path that ends in .toml, which is returned unchanged.

    Raises:
        FormatError: no bundled library has that name.
    """
    path = Path(name_or_path)
    # A bare word is a name, even if a folder has that name.
    if path.suffix == ".toml" or len(path.parts) != 1:
        return path
    folder = bundled("discretization")
    known = sorted(file.stem for file in folder.glob("*.toml"))
    if str(path) not in known:
        hint = suggestion(str(path), known, "a file of your own ends in .toml, bundled are")
        raise FormatError(f"no library {str(path)!r}{hint}")
    return folder / f"{path}.toml"


def read_library(name_or_path: FilePath) -> Library:
    """Read the library in a .toml file, or the bundled one of that name ("human23").

    Raises:
        FormatError: there is no such library, or the file is not one; the message names the table and entry at fault.

    >>> from motionmind.discretize import read_library
    >>> read_library("human23").path.endswith("human23.toml")
    True
    """
    check_path("name_or_path", name_or_path)
    path = library_path(name_or_path)
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise FormatError("not a text file in UTF-8", path=path) from None
    return parse_library(text, path=str(path))


def write_library(path: FilePath, library: Library) -> None:
    """Write a library: as turns where hundredths of a degree are exact, else as quaternions.

    `read_library` reads the same states; comments of the original file are lost.

    >>> from pathlib import Path
    >>> text = '''title  Two bends of the knees
    ... body   human23
    ... legs
    ...   stand = stand out 10 turn 8
    ...   bend = stand out 10 turn 8, bend 30
    ... clip bends: Down and up
    ...   start | stand
    ...   1     | bend
    ...   1     | stand
    ... '''
    >>> _ = Path("bends.score").write_text(text)
    >>> from motionmind import read_score
    >>> from motionmind.discretize import name_states, write_library
    >>> write_library("mine.toml", name_states([read_score("bends.score")], 12.0))
    """
    check_path("path", path)
    check_type("library", library, Library)
    write_atomically(path, format_library(library).encode())


def format_library(library: Library) -> str:
    """Return the text of a library file; the inverse of `parse_library`."""
    lines = [f'format = "{LIBRARY_FORMAT}"', f"version = {LIBRARY_VERSION}"]
    lines += [f"{key} = {format_toml_string(getattr(library, key))}" for key in _TEXT_KEYS]
    for table, entries in library.tables.items():
        lines += ["", f"[{table if _bare(table) else format_toml_string(table)}]"]
        for (name, value), q in zip(entries.items(), library.rotations(table), strict=True):
            turns = value if isinstance(value, str) else format_turns(q)
            # Write a quaternion as given: normalised at every reading and writing, it would drift.
            text = f"[{', '.join(repr(float(v)) for v in value)}]" if turns is None else format_toml_string(turns)
            lines.append(f"{format_toml_string(name)} = {text}")
    return "\n".join(lines) + "\n"


def _bare(key: str) -> bool:
    return key != "" and key.isascii() and key.replace("_", "").replace("-", "").isalnum()
