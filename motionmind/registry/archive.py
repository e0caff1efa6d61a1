"""Archives of corpora: reproducible, uncompressed tar files, unpacked as untrusted data.

Arrays of orientations hardly compress (docs/design/registry.md), and an uncompressed archive cannot be a decompression
bomb: its content is no larger than itself. Unpacking accepts only regular files that the index lists, each once, with
the listed size and hash; anything else aborts it. The index allows only names that stay inside the folder.
"""

from __future__ import annotations

import hashlib
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
        files: the files that it must contain, and no others.
        folder: the new folder.

    Raises:
        CorpusError: the archive has other content, or reading or writing fails.
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
    """Copy a file out of an archive; raise CorpusError if its hash is not the listed one."""
    place.parent.mkdir(exist_ok=True)
    digest = hashlib.sha256()
    with place.open("xb") as target:
        while chunk := source.read(1 << 20):
            digest.update(chunk)
            target.write(chunk)
    if digest.hexdigest() != file.sha256:
        raise CorpusError(f"{archive}: {file.name} is not the file that the index lists: its SHA-256 differs")
