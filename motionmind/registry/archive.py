"""Archives of corpora: reproducible, uncompressed tar files, unpacked as untrusted data.

Arrays of orientations hardly compress (docs/design/registry.md), and an uncompressed archive cannot be a decompression
bomb: its content is no larger than itself. The index determines every byte but the files' own, whose hashes it lists.
So unpacking interprets no headers: it compares headers and padding with what packing writes. The index allows only
names that stay inside the folder.
"""

from __future__ import annotations

import hashlib
import shutil
import tarfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

from motionmind.errors import CorpusError
from motionmind.registry.index import File


def pack(files: Mapping[str, Path], archive: Path) -> None:
    """Pack files, given by their names in the archive, in this order; raise OSError if reading or writing fails.

    The archive does not depend on the machine or the day: it has no times, owners or original permissions.
    """
    with archive.open("wb") as target:
        for name, path in files.items():
            size = path.stat().st_size
            target.write(_header(name, size))
            with path.open("rb") as source:
                shutil.copyfileobj(source, target)
            target.write(_padding(size))
        target.write(_end(target.tell()))


def unpack(archive: Path, files: Sequence[File], folder: Path) -> None:
    """Unpack an archive into a new folder.

    Args:
        archive: the archive.
        files: the files that it must contain, in this order, and nothing else.
        folder: the new folder.

    Raises:
        CorpusError: the archive has other content, or reading or writing fails.
    """
    try:
        folder.mkdir(parents=True)
        with archive.open("rb") as source:
            for file in files:
                header = _header(file.name, file.size)
                where = source.tell()
                if source.read(len(header)) != header:
                    wanted = f"{file.name} of {file.size:,} bytes, as `motionmind corpus publish` writes it"
                    raise CorpusError(f"{archive}: the header at byte {where:,} is not that of {wanted}")
                _copy(source, folder / file.name, file, archive)
            where = source.tell()
            end = _end(where)
            if source.read(len(end) + 1) != end:
                raise CorpusError(f"{archive}: does not end after the files that the index lists, at byte {where:,}")
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be unpacked: {error.strerror or error}") from error


def _header(name: str, size: int) -> bytes:
    """Return the header of a file; for a name of more than 100 bytes, with GNU tar's entry for long names before it."""
    member = tarfile.TarInfo(name)
    member.size, member.mode = size, 0o644
    return member.tobuf(tarfile.GNU_FORMAT, "utf-8", "strict")


def _padding(size: int) -> bytes:
    """Return the zeros after a file, up to a whole block."""
    return bytes(-size % tarfile.BLOCKSIZE)


def _end(size: int) -> bytes:
    """Return the zeros after the last file of an archive: two blocks, and up to a whole record."""
    marker = 2 * tarfile.BLOCKSIZE
    return bytes(marker + -(size + marker) % tarfile.RECORDSIZE)


def _copy(source: IO[bytes], place: Path, file: File, archive: Path) -> None:
    """Copy a file out of an archive; raise CorpusError if it is cut, or its hash is not the listed one."""
    place.parent.mkdir(exist_ok=True)
    digest, left = hashlib.sha256(), file.size
    with place.open("xb") as target:
        while chunk := source.read(min(left, 1 << 20)):
            digest.update(chunk)
            target.write(chunk)
            left -= len(chunk)
    if digest.hexdigest() != file.sha256 or source.read(len(padding := _padding(file.size))) != padding:
        raise CorpusError(f"{archive}: {file.name} is not the file that the index lists: its SHA-256 differs")
