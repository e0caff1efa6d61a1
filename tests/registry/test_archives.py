"""Archives hold plain files that an index lists, of these bytes; whatever else they hold, nothing of it is written."""

from __future__ import annotations

import gzip
import hashlib
import io
import os
import tarfile
from collections.abc import Callable
from pathlib import Path

import pytest

from motionmind.errors import CorpusError
from motionmind.registry.archive import pack, unpack
from motionmind.registry.index import File

CONTENT = {"1/root.npy": b"root" * 500, "1/times.npy": b"", "manifest.json": b"{}"}
LISTED = tuple(
    File(name=name, size=len(data), sha256=hashlib.sha256(data).hexdigest()) for name, data in CONTENT.items()
)


def packed(folder: Path) -> Path:
    paths = {}
    for name, data in CONTENT.items():
        paths[name] = folder / name
        paths[name].parent.mkdir(parents=True, exist_ok=True)
        paths[name].write_bytes(data)
    pack(paths, folder / "archive.tar")
    return folder / "archive.tar"


def below(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_what_is_packed_is_unpacked(tmp_path: Path) -> None:
    unpack(packed(tmp_path / "a"), LISTED, tmp_path / "new" / "folder")
    assert below(tmp_path / "new" / "folder") == CONTENT


def test_the_same_files_give_the_same_bytes_whoever_owns_them_and_whenever(tmp_path: Path) -> None:
    archives = [packed(tmp_path / name) for name in ("a", "b")]
    before = archives[0].read_bytes()
    for path in (tmp_path / "b").rglob("*.npy"):
        path.chmod(0o600)
        os.utime(path, (1, 1))
    pack({name: tmp_path / "b" / name for name in CONTENT}, archives[1])
    assert archives[1].read_bytes() == before


def plain(name: str, data: bytes = b"evil") -> tuple[tarfile.TarInfo, bytes]:
    member = tarfile.TarInfo(name)
    member.size = len(data)
    return member, data


def special(name: str, kind: bytes, target: str = "") -> tuple[tarfile.TarInfo, bytes]:
    member = tarfile.TarInfo(name)
    member.type, member.linkname = kind, target
    return member, b""


def written(path: Path, *members: tuple[tarfile.TarInfo, bytes], form: int = tarfile.GNU_FORMAT) -> Path:
    with tarfile.open(path, "w", format=form) as tar:
        for member, data in members:
            tar.addfile(member, io.BytesIO(data))
    return path


def sparse(path: Path) -> Path:
    """An archive of one file whose terabyte of zeros takes no place."""
    member, _ = plain("1/root.npy", b"")
    member.pax_headers = {"GNU.sparse.major": "0", "GNU.sparse.map": "0,0", "GNU.sparse.size": str(2**40)}
    return written(path, (member, b""), form=tarfile.PAX_FORMAT)


GOOD = [plain(name, data) for name, data in CONTENT.items()]
HOSTILE: dict[str, Callable[[Path], Path]] = {
    "climbs out": lambda path: written(path, *GOOD, plain("../evil")),
    "climbs out from below": lambda path: written(path, *GOOD, plain("1/../../evil")),
    "from the root": lambda path: written(path, *GOOD, plain(str(path.parent / "evil"))),
    "a link out": lambda path: written(path, special("1", tarfile.SYMTYPE, ".."), *GOOD),
    "a link instead": lambda path: written(path, *GOOD[1:], special("1/root.npy", tarfile.SYMTYPE, "../../secret")),
    "a hard link": lambda path: written(path, *GOOD[1:], special("1/root.npy", tarfile.LNKTYPE, "manifest.json")),
    "a pipe": lambda path: written(path, *GOOD[1:], special("1/root.npy", tarfile.FIFOTYPE)),
    "a device": lambda path: written(path, *GOOD[1:], special("1/root.npy", tarfile.CHRTYPE)),
    "a folder": lambda path: written(path, *GOOD[1:], special("1/root.npy", tarfile.DIRTYPE)),
    "a sparse file": sparse,
    "one twice": lambda path: written(path, *GOOD, GOOD[0]),
    "one lacks": lambda path: written(path, *GOOD[:2]),
    "one is longer": lambda path: written(path, plain("1/root.npy", b"root" * 501), *GOOD[1:]),
    "one is another": lambda path: written(path, plain("1/root.npy", b"toor" * 500), *GOOD[1:]),
    "a stranger": lambda path: written(path, *GOOD, plain("1/checked")),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_archives_with_anything_else_are_refused(kind: str, tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "secret").write_bytes(b"secret")
    archive = HOSTILE[kind](tmp_path / "archive.tar")
    before = below(tmp_path)
    with pytest.raises(CorpusError, match=r"archive\.tar: "):
        unpack(archive, LISTED, tmp_path / "deep" / "new")
    fresh = below(tmp_path).keys() - before.keys()
    assert all(name.startswith(str(Path("deep", "new"))) for name in fresh)
    assert not any(path.is_symlink() for path in tmp_path.rglob("*"))


@pytest.mark.parametrize("data", [b"", b"no tar", gzip.compress(bytes(10**6)), b"PK\5\6" + bytes(18)])
def test_what_is_no_plain_archive_is_refused(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "archive.tar").write_bytes(data)
    with pytest.raises(CorpusError, match=r"cannot be read as an uncompressed tar file|holds no 1/root.npy"):
        unpack(tmp_path / "archive.tar", LISTED, tmp_path / "new")


def test_archives_that_are_cut_or_changed_anywhere_are_refused_or_whole(tmp_path: Path) -> None:
    data = packed(tmp_path / "good").read_bytes()
    for at in range(0, len(data), 97):
        for bad in (data[:at], data[:at] + bytes([data[at] ^ 1 << at % 8]) + data[at + 1 :]):
            archive, folder = tmp_path / "archive.tar", tmp_path / f"{at}-{len(bad)}"
            archive.write_bytes(bad)
            try:
                unpack(archive, LISTED, folder)
            except CorpusError:
                continue
            assert below(folder) == CONTENT  # it was padding that changed


def test_an_archive_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(CorpusError, match="cannot be unpacked: No such file"):
        unpack(tmp_path / "none.tar", LISTED, tmp_path / "new")
