"""Corpora on disk: folders of arrays with a manifest, and where to find them."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import platformdirs
from numpy.typing import NDArray

from motionmind.corpus.bundled import bundled
from motionmind.errors import CorpusError, FormatError
from motionmind.files import read_bytes

FORMAT, VERSION = "motionmind-corpus", 1
BUILT = "motionmind-built-corpus"
MANIFEST = "manifest.json"
# The sources of the package by which a corpus is read and learned, and no others: see `fingerprint`.
LEARNED_BY = (
    *("_typing.py", "errors.py", "files.py", "jit.py"),
    *("geometry", "body", "retarget", "formats", "notation", "corpus", "discretize", "grammar", "learned"),
)


def home(folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder of a user's data: `folder`, else $MOTIONMIND_HOME, else the platform's data directory."""
    chosen = folder or os.environ.get("MOTIONMIND_HOME")
    return Path(chosen) if chosen else Path(platformdirs.user_data_dir("motionmind", appauthor=False))


def list_corpora(folder: str | os.PathLike[str] | None = None) -> dict[str, Path]:
    """Return the folders of all corpora by name, sorted: the bundled ones, and those under `home(folder)`.

    >>> from motionmind import list_corpora
    >>> "ballet" in list_corpora()
    True
    """
    found = {}
    for place in (bundled("corpora"), home(folder) / "corpora"):
        if place.is_dir():
            found.update({entry.name: entry for entry in sorted(place.iterdir()) if (entry / MANIFEST).is_file()})
    return dict(sorted(found.items()))


def locate(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder of the corpus with this name, or at this path; CorpusError names the known ones."""
    corpora = list_corpora(folder)
    if name in corpora:
        return corpora[name]
    with suppress(OSError, ValueError):  # not a possible path: too long, or with a zero byte
        if name and (Path(name) / MANIFEST).is_file():
            return Path(name)
    raise CorpusError(f"no corpus {name!r}; there are {', '.join(corpora) or 'none'}")


def place_for(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder for a new corpus of a user; CorpusError if the name is invalid or a bundled corpus's."""
    if not re.fullmatch(r"\w[\w.-]{0,63}", name):
        raise CorpusError(f"{name!r:.80} cannot be a corpus's name: use letters, digits, -, _ and . (64 at most)")
    if (bundled("corpora") / name / MANIFEST).is_file():
        raise CorpusError(f"{name!r} is the name of a bundled corpus; choose another")
    return home(folder) / "corpora" / name


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a corpus's folder; FormatError if it is invalid or of an unknown version."""
    path = folder / MANIFEST
    try:
        manifest = msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
    except (OSError, ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
        raise FormatError(f"cannot be read as a corpus's manifest: {error}", path=path) from error
    if manifest.get("format") not in (FORMAT, BUILT) or manifest.get("version") != VERSION:
        raise FormatError(
            f"is {manifest.get('format')!r} version {manifest.get('version')!r}; "
            f"{FORMAT!r} and {BUILT!r} version {VERSION} can be read",
            path=path,
        )
    return manifest


def save(folder: Path, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a corpus's folder: its manifest, and one .npy file per array.

    An existing corpus is replaced once the new one is complete.

    Args:
        folder: the corpus's folder.
        manifest: plain values for JSON; format, version and the arrays' shapes are added.
        arrays: by name.

    Raises:
        CorpusError: the folder cannot be written, or holds files that are not a corpus's.
    """
    aside = folder.with_name(f".{folder.name}-{secrets.token_hex(6)}")
    try:
        for entry in folder.iterdir() if folder.exists() else ():
            if entry.suffix != ".npy" and entry.name != MANIFEST:
                raise CorpusError(
                    f"{folder}: holds {entry.name}, which is no part of a built corpus; it is not replaced"
                )
        aside.mkdir(parents=True)
        for name, array in arrays.items():
            np.save(aside / f"{name}.npy", np.ascontiguousarray(array), allow_pickle=False)
        shapes = {name: [array.dtype.str, *array.shape] for name, array in arrays.items()}
        head = {"format": BUILT, "version": VERSION, **manifest, "arrays": shapes}
        (aside / MANIFEST).write_bytes(msgspec.json.format(msgspec.json.encode(head), indent=1) + b"\n")
        _swap(aside, folder)
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _swap(new: Path, folder: Path) -> None:
    """Replace a folder by a new one; restore the old one if that fails."""
    if not folder.exists():
        new.rename(folder)
        return
    old = new.with_name(f"{new.name}-old")
    folder.rename(old)
    try:
        new.rename(folder)
    except BaseException:
        old.rename(folder)
        raise
    shutil.rmtree(old, ignore_errors=True)


def load(folder: Path, manifest: dict[str, Any] | None = None) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Load a corpus's folder.

    Args:
        folder: the corpus's folder.
        manifest: its manifest if it has been read; None reads it.

    Returns:
        The manifest, and the arrays by name, memory-mapped.

    Raises:
        FormatError: the manifest or an array is missing, damaged, or not the one that was saved.
    """
    manifest = read_manifest(folder) if manifest is None else manifest
    shapes = manifest.get("arrays")
    if not isinstance(shapes, dict):
        raise FormatError("does not say which arrays there are; build the corpus again", path=folder / MANIFEST)
    arrays = {}
    for name, shape in shapes.items():
        path = folder / f"{name}.npy"
        try:
            # A plain view: still mapped, but without the subclass, which slows every slice.
            arrays[name] = np.asarray(np.lib.format.open_memmap(path, mode="r"))
        except Exception as error:  # the header is Python; parsing a damaged one can raise anything
            raise FormatError(f"cannot be read as an array: {error}; build the corpus again", path=path) from error
        if [arrays[name].dtype.str, *arrays[name].shape] != shape:
            raise FormatError("is not the array that was saved; build the corpus again", path=path)
    return manifest, arrays


def fingerprint(files: Iterable[Path], package: Path = Path(__file__).parents[1]) -> str:
    """Return a name [16 hexadecimal digits] for what is learned from these files, that changes whenever that may.

    It is a hash of the files, and of the code and the bodies' descriptions that learning uses (`LEARNED_BY`): a change
    to the search or to pictures leaves a corpus that was learned before valid.

    Args:
        files: all files that a corpus is learned from.
        package: folder of the package's sources.

    Raises:
        FormatError: a file cannot be read.
    """
    digest = hashlib.sha256()
    rooms = [package / name for name in LEARNED_BY]
    code = [path for room in rooms for path in ([room] if room.suffix else sorted(room.rglob("*.py")))]
    for path in [*code, *sorted(package.glob("body/bodies/*.toml")), *files]:
        data = read_bytes(path)
        digest.update(f"{path.name}\0{len(data)}\0".encode() + data)
    return digest.hexdigest()[:16]


def cache() -> Path:
    """Return the folder that caches corpora built from bundled sources."""
    return Path(platformdirs.user_cache_dir("motionmind", appauthor=False)) / "corpora"
