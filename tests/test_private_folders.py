"""A folder is private if nobody but its user, and the system, can change what is in it."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from motionmind import private_folders
from motionmind.private_folders import is_fixed, is_private, read_own, temporary_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="users have folders of their own")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "above").mkdir(mode=0o755)
    (tmp_path / "above" / "folder").mkdir(mode=0o755)
    return tmp_path / "above" / "folder"


def other_user(monkeypatch: pytest.MonkeyPatch) -> None:
    """Be another user from here on, who owns nothing."""
    monkeypatch.setattr(os, "getuid", lambda: 12345)


def test_modes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(private_folders, "_is_own", lambda _: False)  # the group
    for mode in (0o700 | sticky | others for sticky in (0, 0o1000) for others in range(0o100)):
        folder.chmod(mode)
        assert is_private(folder) == (not mode & 0o022), oct(mode)
        folder.chmod(0o700)
        folder.parent.chmod(mode)
        is_safe = not mode & 0o022 or mode >= 0o1000
        assert is_private(folder) == is_fixed(folder) == is_fixed(folder / "new") == is_safe, oct(mode)
        folder.parent.chmod(0o700)


def test_folders_of_others_are_not_private_nor_those_below(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert is_private(folder)
    assert is_private(folder.parent)
    other_user(monkeypatch)
    assert not is_private(folder)
    if folder.stat().st_uid == 0:
        assert is_fixed(folder)  # by the system, which may change what it likes
        os.chown(folder.parent, 54321, 54321)
        assert not is_fixed(folder)


def test_what_is_no_folder_is_not_private(folder: Path) -> None:
    (folder / "file").write_text("")
    (folder / "link").symlink_to(folder)
    (folder / "loop").symlink_to(folder / "loop")
    for name in ("file", "link", "loop", "none"):
        assert not is_private(folder / name)


@pytest.mark.parametrize(
    ("group", "members", "is_own"),
    [("ann", [], True), ("ann", ["ann"], True), ("ann", ["ann", "eve"], False), ("staff", [], False)],
)
def test_a_group_of_the_user_alone_may_write(
    folder: Path, monkeypatch: pytest.MonkeyPatch, group: str, members: list[str], is_own: bool
) -> None:
    user = SimpleNamespace(pw_name="ann", pw_gid=folder.stat().st_gid)
    monkeypatch.setattr(private_folders.pwd, "getpwuid", lambda _: user)
    monkeypatch.setattr(private_folders.grp, "getgrgid", lambda _: SimpleNamespace(gr_name=group, gr_mem=members))
    folder.chmod(0o775)
    assert is_private(folder) == is_own
    folder.chmod(0o700)
    folder.parent.chmod(0o775)
    assert is_private(folder) == is_own
    user.pw_gid += 1
    assert not is_private(folder)


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The system's folder for temporary files."""
    (tmp_path / "tmp").mkdir()
    (tmp_path / "tmp").chmod(0o1777)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    temporary_folder.cache_clear()
    yield tmp_path / "tmp"
    temporary_folder.cache_clear()


def test_the_temporary_folder_is_the_same_unless_others_were_there_before(temporary: Path) -> None:
    first = temporary_folder()
    assert first == temporary / f"motionmind-{os.getuid()}"
    assert first.stat().st_mode & 0o777 == 0o700
    temporary_folder.cache_clear()
    assert temporary_folder() == first
    first.chmod(0o777)
    temporary_folder.cache_clear()
    assert temporary_folder() != first
    assert is_private(temporary_folder())


def test_where_others_can_replace_temporary_folders_there_is_none(temporary: Path) -> None:
    temporary.chmod(0o777)
    with pytest.raises(PermissionError, match="others could replace folders in it"):
        temporary_folder()


def test_files_are_read_if_only_the_user_could_write_them(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = folder / "file"
    file.write_bytes(b"data")
    os.mkfifo(folder / "pipe")
    (folder / "link").symlink_to(file)
    for name in ("pipe", "link", ".", "none"):
        with pytest.raises(OSError, match=r"others could have written it|symbolic links|No such file"):
            read_own(folder / name)
    for mode in (0o600, 0o644, 0o755, 0o664, 0o646):
        file.chmod(mode)
        if mode & 0o022:
            with pytest.raises(PermissionError):
                read_own(file)
        else:
            assert read_own(file) == b"data"
    file.chmod(0o644)
    other_user(monkeypatch)
    with pytest.raises(PermissionError):
        read_own(file)
