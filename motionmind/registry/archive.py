"""Archives of corpora: uncompressed tar files, of the same bytes whoever packs them, unpacked with suspicion.

Arrays of orientations hardly compress (docs/design/registry.md), and what is not compressed cannot be a bomb: no more
comes out of an archive than it is long. Only plain files that the index lists are taken, each once, as long as it says
and with its hash; all else ends the unpacking. Names that may be listed lead nowhere but into the folder.
"""

from __future__ import annotations

import hashlib
import tarfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

from motionmind.errors import CorpusError
from motionmind.registry.index import File

_CHUNK = 2**20  # bytes


def pack(files: Mapping[str, Path], archive: Path) -> None:
    """Pack files, by their names in the archive, in that order; OSError if one cannot be read or written.

    Nothing of the machine or the day goes into the archive: no times, owners or permissions.
    """
    with tarfile.open(archive, "w", format=tarfile.GNU_FORMAT) as tar:
        for name, path in files.items():
            member = tarfile.TarInfo(name)
            member.size, member.mode = path.stat().st_size, 0o644
            with path.open("rb") as file:
                tar.addfile(member, file)


def unpack(archive: Path, files: Sequence[File], folder: Path) -> None:
    """Unpack an archive into a new folder.

    Args:
        archive: the archive.
        files: what it must hold, and nothing else.
        folder: where to; it is made.

    Raises:
        CorpusError: it holds something else, or cannot be read or written.
    """
    wanted = {file.name: file for file in files}
    try:
        folder.mkdir(parents=True)
        with tarfile.open(archive, "r:") as tar:
            for member in tar:
                file = wanted.pop(member.name, None)
                if file is None or member.type != tarfile.REGTYPE or member.issparse():
                    raise CorpusError(f"{archive}: holds {member.name!r:.200}, which the index does not list as a file")
                source = tar.extractfile(member)
                if source is None or member.size != file.size:
                    raise CorpusError(f"{archive}: {file.name} has {member.size:,} bytes, not {file.size:,}")
                _copy(source, folder / file.name, file, archive)
    except (tarfile.TarError, EOFError, ValueError) as error:
        raise CorpusError(f"{archive}: cannot be read as an uncompressed tar file: {error}") from error
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be unpacked: {error.strerror or error}") from error
    if wanted:
        raise CorpusError(f"{archive}: holds no {next(iter(wanted))}, which the index lists")


def _copy(source: IO[bytes], place: Path, file: File, archive: Path) -> None:
    """Copy a file out of an archive; CorpusError if it has not the listed hash."""
    place.parent.mkdir(exist_ok=True)
    digest = hashlib.sha256()
    with place.open("xb") as target:
        while chunk := source.read(_CHUNK):
            digest.update(chunk)
            target.write(chunk)
    if digest.hexdigest() != file.sha256:
        raise CorpusError(f"{archive}: {file.name} is not the file that the index lists: its SHA-256 differs")
