"""Archives hold the files that an index lists, byte for byte as packed; whatever else they hold is never written."""

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
    member.size, member.mode = len(data), 0o644
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


def extended(path: Path, headers: dict[str, str], form: int = tarfile.PAX_FORMAT, **every: str) -> Path:
    """An archive of the right files, the first with a PAX header, or with one for all."""
    with tarfile.open(path, "w", format=form, pax_headers=every) as tar:
        for number, (member, data) in enumerate(GOOD):
            member.pax_headers = {} if number else headers
            tar.addfile(member, io.BytesIO(data))
            member.pax_headers = {}
    return path


def preceded(path: Path, kind: bytes, data: bytes) -> Path:
    """An archive of the right files after an entry of a kind that changes what is read of the next."""
    member, _ = special("././@LongLink", kind)
    member.size = len(data)
    return written(path, (member, data), *GOOD)


def changed(path: Path, at: int, data: bytes) -> Path:
    """An archive of the right files with other bytes at a place, counted from its end if negative."""
    written(path, *GOOD)
    with path.open("r+b") as file:
        file.seek(at, os.SEEK_END if at <= 0 else os.SEEK_SET)
        file.write(data)
    return path


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
    "a sparse file": lambda path: extended(path, {"GNU.sparse.map": "0,0", "GNU.sparse.size": str(2**40)}),
    "a sparse entry": lambda path: written(path, *GOOD[1:], special("1/root.npy", tarfile.GNUTYPE_SPARSE)),
    "a number of 100,000 digits": lambda path: extended(path, {"mtime": "9" * 100_000}),
    "a header for all": lambda path: extended(path, {}, comment="for all"),
    "a long name": lambda path: preceded(path, tarfile.GNUTYPE_LONGNAME, b"1/root.npy\0"),
    "a long link": lambda path: preceded(path, tarfile.GNUTYPE_LONGLINK, b"../evil\0"),
    "an unknown entry": lambda path: preceded(path, b"Z", b""),
    "another order": lambda path: written(path, *GOOD[::-1]),
    "another format": lambda path: written(path, *GOOD, form=tarfile.USTAR_FORMAT),
    "bytes between": lambda path: changed(path, 512 + 2000, b"?"),
    "bytes at the end": lambda path: changed(path, -1, b"?"),
    "bytes after the end": lambda path: changed(path, 0, b"?"),
    "zeros after the end": lambda path: changed(path, 0, bytes(10240)),
    "another archive after the end": lambda path: changed(path, 0, written(path, plain("evil")).read_bytes()),
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
    with pytest.raises(CorpusError, match=r"the header at byte 0 is not that of 1/root\.npy of 2,000 bytes"):
        unpack(tmp_path / "archive.tar", LISTED, tmp_path / "new")


def test_archives_that_are_cut_or_changed_anywhere_are_refused(tmp_path: Path) -> None:
    data = packed(tmp_path / "good").read_bytes()
    for at in range(0, len(data), 97):
        for bad in (data[:at], data[:at] + bytes([data[at] ^ 1 << at % 8]) + data[at + 1 :]):
            (tmp_path / "archive.tar").write_bytes(bad)
            with pytest.raises(CorpusError, match=r"archive\.tar: "):
                unpack(tmp_path / "archive.tar", LISTED, tmp_path / f"{at}-{len(bad)}")


def test_archives_are_those_of_gnu_tar_in_any_version_of_python(tmp_path: Path) -> None:
    archive = packed(tmp_path / "a")
    assert archive.read_bytes() == written(tmp_path / "same.tar", *GOOD).read_bytes()
    digest = hashlib.sha256(archive.read_bytes()).hexdigest()
    assert digest == "01e788f84ac1e936da2464e4c91de5caa9faf24b0d0a67282dd4ccfece9fa446"


def test_long_names_are_kept(tmp_path: Path) -> None:
    name = f"1/é{'.'.join(['e' * 60] * 4)}.npy"  # tar's headers have 100 bytes for it, file systems 255
    (tmp_path / "file").write_bytes(b"data")
    pack({name: tmp_path / "file"}, tmp_path / "archive.tar")
    with tarfile.open(tmp_path / "archive.tar") as tar:
        assert tar.getnames() == [name]
    file = File(name=name, size=4, sha256=hashlib.sha256(b"data").hexdigest())
    unpack(tmp_path / "archive.tar", [file], tmp_path / "new")
    assert below(tmp_path / "new") == {name: b"data"}


def test_an_archive_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(CorpusError, match="cannot be unpacked: No such file"):
        unpack(tmp_path / "none.tar", LISTED, tmp_path / "new")
