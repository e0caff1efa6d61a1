"""Folders of arrays with a manifest: how a built corpus lies on disk, and where corpora are found."""

from __future__ import annotations

import hashlib
import os
import secrets
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import platformdirs
from numpy.typing import NDArray

from motionmind.corpus.bundled import bundled
from motionmind.errors import CorpusError, FormatError

FORMAT, VERSION = "motionmind-corpus", 1
BUILT = "motionmind-built-corpus"
MANIFEST = "manifest.json"


def home(folder: str | os.PathLike[str] | None = None) -> Path:
    """Where a user's corpora live: `folder`, else $MOTIONMIND_HOME, else the platform's data directory."""
    chosen = folder or os.environ.get("MOTIONMIND_HOME")
    return Path(chosen) if chosen else Path(platformdirs.user_data_dir("motionmind", appauthor=False))


def known(folder: str | os.PathLike[str] | None = None) -> dict[str, Path]:
    """All corpora by name: the bundled ones, and those under `home(folder)`; sorted."""
    found = {}
    for place in (bundled("corpora"), home(folder) / "corpora"):
        if place.is_dir():
            found.update({entry.name: entry for entry in sorted(place.iterdir()) if (entry / MANIFEST).is_file()})
    return dict(sorted(found.items()))


def locate(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """The folder of the corpus called `name`, or that is at the path `name`; CorpusError names the known ones."""
    corpora = known(folder)
    if name in corpora:
        return corpora[name]
    if (Path(name) / MANIFEST).is_file():
        return Path(name)
    raise CorpusError(f"no corpus {name!r}; there are {', '.join(corpora) or 'none'}")


def place_for(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Where a corpus that a user builds goes; CorpusError for a name that is none, or a bundled corpus's."""
    if not name or name != Path(name).name or name.startswith("."):
        raise CorpusError(f"{name!r} cannot be a corpus's name: use letters, digits, - and _")
    if (bundled("corpora") / name / MANIFEST).is_file():
        raise CorpusError(f"{name!r} is the name of a bundled corpus; choose another")
    return home(folder) / "corpora" / name


def read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest of a corpus folder; FormatError where it is none, or of a version that is not known."""
    path = folder / MANIFEST
    try:
        manifest = msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
    except (OSError, msgspec.MsgspecError) as error:
        raise FormatError(f"cannot be read as a corpus's manifest: {error}", path=path) from error
    if manifest.get("format") not in (FORMAT, BUILT) or manifest.get("version") != VERSION:
        raise FormatError(
            f"is {manifest.get('format')!r} version {manifest.get('version')!r}; "
            f"{FORMAT!r} and {BUILT!r} version {VERSION} can be read",
            path=path,
        )
    return manifest


def save(folder: Path, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a folder with its manifest and one .npy file an array; an older one is replaced when all is there."""
    aside = folder.with_name(f".{folder.name}-{secrets.token_hex(6)}")
    try:
        aside.mkdir(parents=True)
        for name, array in arrays.items():
            np.save(aside / f"{name}.npy", np.ascontiguousarray(array), allow_pickle=False)
        head = {"format": BUILT, "version": VERSION, **manifest}
        (aside / MANIFEST).write_bytes(msgspec.json.format(msgspec.json.encode(head), indent=1) + b"\n")
        if folder.exists():
            old = aside.with_name(f"{aside.name}-old")
            folder.rename(old)
            aside.rename(folder)
            shutil.rmtree(old)
        else:
            aside.rename(folder)
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def load(folder: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """The manifest and the arrays of a folder, memory-mapped."""
    manifest = read_manifest(folder)
    arrays = {}
    for name in manifest["arrays"]:
        path = folder / f"{name}.npy"
        try:
            arrays[name] = np.load(path, mmap_mode="r", allow_pickle=False)
        except (OSError, ValueError) as error:
            raise FormatError(f"cannot be read as an array: {error}; build the corpus again", path=path) from error
    return manifest, arrays


def fingerprint(folder: Path) -> str:
    """A name for what a source corpus holds: a hash of all its files that a build reads."""
    digest = hashlib.sha256()
    for path in sorted([folder / MANIFEST, *folder.glob("clips/*")]):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def cache() -> Path:
    """Where corpora built from bundled sources are kept."""
    return Path(platformdirs.user_cache_dir("motionmind", appauthor=False)) / "corpora"
