"""Schemas of manifests, of corpora that people write and of corpora built from movement."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from motionmind.corpus.arrays import ArrayEntry, parse_entries
from motionmind.corpus.clip import FLIP_DEG
from motionmind.corpus.corpus import Facing
from motionmind.credits.credit import Origin
from motionmind.errors import FormatError

_Schema = TypeVar("_Schema", bound=msgspec.Struct)
_Vector = tuple[float, float, float]


class ClipFile(msgspec.Struct, frozen=True):
    """A clip of a corpus that people write; `performer` is as in Clip.

    `file` is relative to the manifest's folder, and may name a clip of a glTF file: "hero.glb#Dance".
    """

    name: str
    file: str
    about: str
    performer: str = ""


class Provenance(msgspec.Struct, frozen=True, kw_only=True):
    """Fields of every manifest: a corpus's content and origin; attributes as in Corpus."""

    name: str
    title: str
    author: str
    source: str
    licence: str
    facing: Facing
    rate: float | None
    skip: int = 0
    citation: str = ""


class SourceManifest(Provenance, frozen=True, kw_only=True):
    """A corpus that people write: scores, or files of clips, and a discretization as `from_spec` reads it."""

    discretization: dict[str, Any]
    clips: list[ClipFile] = []
    scores: list[str] = []

    def __post_init__(self) -> None:
        """Check that there are clips or scores, and that a stranger's scores name no other files."""
        if not (self.clips or self.scores):
            raise ValueError("there is no key `clips` with a clip in it, nor `scores` with a score")
        if (other := next((name for name in self.scores if not name.endswith(".score")), None)) is not None:
            raise ValueError(f"{other!r} is not a score, whose name ends in .score")


class BodyEntry(msgspec.Struct, frozen=True):
    """A skeleton; attributes as in Skeleton."""

    name: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: list[_Vector]
    tips: list[_Vector]


class SpaceEntry(msgspec.Struct, frozen=True):
    """A state space without its centres; attributes as in StateSpace."""

    kind: str
    starts: list[int]
    tolerances: list[float]
    labels: tuple[tuple[str, ...], ...]


class BuiltManifest(Provenance, frozen=True, kw_only=True):
    """A built corpus; `folder` is the number of the folder with its arrays, other attributes as in Corpus."""

    folder: int
    arrays: dict[str, ArrayEntry]
    skeleton: BodyEntry
    space: SpaceEntry
    origins: tuple[Origin, ...] = ()
    flip_degrees: float = FLIP_DEG


def parse_manifest(manifest: dict[str, Any], schema: type[_Schema], path: Path) -> _Schema:
    """Convert a manifest, read from `path`, to `schema`; FormatError names the key that is missing or wrong."""
    try:
        return msgspec.convert(manifest, schema)
    except msgspec.ValidationError as error:
        raise FormatError(str(error).replace("Object missing required field", "there is no key"), path=path) from error


def count_clips(manifest: Mapping[str, Any]) -> int:
    """Return the number of clips of a built corpus, from its manifest; 0 if it states none."""
    with suppress(LookupError, ValueError):  # msgspec's errors are ValueErrors
        return parse_entries(manifest["arrays"])["clips.order"].shape[0]
    return 0
