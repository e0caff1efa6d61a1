"""A name for what is learned from files, by which it is found again."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from motionmind.files import read_bytes

# The sources of the package by which a corpus is read and learned, and no others: see `fingerprint`.
LEARNED_BY = (
    *("_cells.py", "_typing.py", "arguments.py", "bundled.py", "display.py", "errors.py", "files.py", "jit.py"),
    *(
        "codecache.py",
        "clip_names.py",
        "private_folders.py",
        "plugins.py",
        "executors",
        "geometry",
        "credits",
        "body",
        "retarget",
        "formats",
        "notation",
        "corpus",
    ),
    *("discretize", "grammar", "learned", "walks"),
)


_PACKAGE = Path(__file__).parents[1]


def fingerprint(files: Iterable[Path], package: Path = _PACKAGE) -> str:
    """Return a name [16 hexadecimal digits] for what is learned from these files, that changes whenever that may.

    It is a hash of the files, and of the code and the bodies' descriptions that learning uses (`LEARNED_BY`): a change
    to the search or to pictures leaves a corpus that was learned before valid.

    Args:
        files: all files that a corpus is learned from.
        package: folder of the package's sources.

    Raises:
        FormatError: a file cannot be read.
    """
    digest = _own_code().copy() if package == _PACKAGE else _hash_code(package)
    for path in files:
        _add(digest, path)
    return digest.hexdigest()[:16]


@cache
def _own_code() -> hashlib._Hash:
    """Return the hash of this package's sources at the first call: the code that this process runs."""
    return _hash_code(_PACKAGE)


def _hash_code(package: Path) -> hashlib._Hash:
    digest = hashlib.sha256()
    rooms = [package / name for name in LEARNED_BY]
    code = [path for room in rooms for path in ([room] if room.suffix else sorted(room.rglob("*.py")))]
    for path in [*code, *sorted(package.glob("body/bodies/*.toml"))]:
        _add(digest, path)
    return digest


def _add(digest: hashlib._Hash, path: Path) -> None:
    data = read_bytes(path)
    digest.update(f"{path.name}\0{len(data)}\0".encode() + data)


@cache
def code_name() -> str:
    """Return the name of this process's code by which a corpus is read and learned (`fingerprint`)."""
    return fingerprint([])
