"""What manifests say: of corpora that people write, and of those that were built from movement."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import msgspec

from motionmind.corpus.corpus import Clip, Facing, JointFlip
from motionmind.errors import FormatError

_Schema = TypeVar("_Schema", bound=msgspec.Struct)
_Vector = tuple[float, float, float]


class ClipFile(msgspec.Struct, frozen=True):
    """A clip of a corpus that people write; `file` is beside the manifest."""

    name: str
    file: str
    about: str


class Provenance(msgspec.Struct, frozen=True, kw_only=True):
    """What all manifests say: of whom and what a corpus is; attributes as of Corpus."""

    name: str
    title: str
    author: str
    source: str
    licence: str
    facing: Facing
    rate: float | None


class SourceManifest(Provenance, frozen=True, kw_only=True):
    """A corpus as people write it: its scores and clips' files, and a discretization as `from_spec` reads it."""

    discretization: dict[str, Any]
    clips: list[ClipFile] = []
    scores: list[str] = []

    def __post_init__(self) -> None:
        """A corpus has one or the other."""
        if not (self.clips or self.scores):
            raise ValueError("there is no key `clips` with a clip in it, nor `scores` with a score")


class BodyEntry(msgspec.Struct, frozen=True):
    """A skeleton; attributes as of Skeleton."""

    name: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: list[_Vector]
    tips: list[_Vector]


class SpaceEntry(msgspec.Struct, frozen=True):
    """A state space without its centres; attributes as of StateSpace."""

    kind: str
    starts: list[int]
    tolerances: list[float]
    labels: tuple[tuple[str, ...], ...]


class BuiltManifest(Provenance, frozen=True, kw_only=True):
    """What was learned from a corpus, but for its arrays."""

    skeleton: BodyEntry
    clips: tuple[Clip, ...]
    faults: tuple[JointFlip, ...]
    space: SpaceEntry


def parse_manifest(manifest: dict[str, Any], schema: type[_Schema], path: Path) -> _Schema:
    """A manifest, read from `path`, as `schema`; FormatError names the key that is missing or wrong."""
    try:
        return msgspec.convert(manifest, schema)
    except msgspec.ValidationError as error:
        raise FormatError(str(error).replace("Object missing required field", "there is no key"), path=path) from error
