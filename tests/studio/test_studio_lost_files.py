"""A project's file that is deleted, moved, changed or damaged: no edit is lost, and no other file overwritten."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from bundled_clips import ballet_clip
from faults import failing_at
from pages import beside
from studio_server import running

from motionmind.errors import MotionMindError
from motionmind.studio.edits import Insert
from motionmind.studio.opening import open_project
from motionmind.studio.project import Project

if TYPE_CHECKING:
    from studio_server import Served

Change = Callable[[Path], object]


def edit(project: Project, name: str) -> None:
    """Insert a stretch."""
    project.edit("w1", Insert(name, "ballet/adagio", 0, 9))


def blocks(project: Project) -> list[str]:
    """The stretches, in their order."""
    return [one.id for one in project.state.blocks]


def contents(folder: Path) -> dict[str, bytes]:
    """The files in a folder and below."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def project(tmp_path: Path) -> Iterator[Project]:
    """An open project in a folder of its own, with two stretches and a stored movement."""
    (tmp_path / "pieces").mkdir()
    found = Project.create(tmp_path / "pieces" / "piece.motionmind", "ballet")
    edit(found, "b0")
    found.movements.keep(ballet_clip("plies").slice(0, 9))
    edit(found, "b1")
    yield found
    found.close()


def replace_by(path: Path, data: bytes) -> None:
    """Put a file in the place of another, as most editors and programs that synchronise folders do."""
    (path.parent / "new").write_bytes(data)
    (path.parent / "new").replace(path)


def overwrite(path: Path, data: bytes) -> None:
    """Write into a file, as some editors do."""
    path.write_bytes(data)
    os.utime(path, (0.0, 0.0))


def older(path: Path) -> bytes:
    """Return an earlier version of a project."""
    return b"".join(path.read_bytes().splitlines(keepends=True)[:2])


def altered(path: Path) -> bytes:
    """Return another project of the same size."""
    return path.read_bytes().replace(b'"piece"', b'"peace"')


def made_a_folder(path: Path) -> None:
    """Put a folder in the place of a file."""
    path.unlink()
    path.mkdir()


GONE: dict[str, Change] = {
    "deleted": Path.unlink,
    "moved": lambda path: path.rename(path.with_name("moved.motionmind")),
    "folder deleted": lambda path: shutil.rmtree(path.parent),
    "folder moved": lambda path: path.parent.rename(path.parent.with_name("others")),
}
CHANGED: dict[str, Change] = {
    "older version": lambda path: replace_by(path, older(path)),
    "older version, written into it": lambda path: overwrite(path, older(path)),
    "other project": lambda path: replace_by(path, altered(path)),
    "other project, written into it": lambda path: overwrite(path, altered(path)),
    "other file": lambda path: replace_by(path, b"\0\xff no project"),
    "empty": lambda path: overwrite(path, b""),
    "longer": lambda path: overwrite(path, path.read_bytes() + b'{"more": 1}\n'),
    "folder": made_a_folder,
}
ALIKE: dict[str, Change] = {
    "touched": lambda path: os.utime(path, (0.0, 0.0)),
    "saved unchanged": lambda path: replace_by(path, path.read_bytes()),
}


def check_whole(project: Project, names: list[str], undone: int) -> None:
    """Check that a project is all in its file, which it alone has open."""
    with pytest.raises(MotionMindError, match="already open in a studio"):
        Project.open(project.path)
    (key,) = project.movements._kept
    assert len(project.movements.get(key)) == 9
    state = project.state
    project.close()
    again = Project.open(project.path)
    assert again.state == state
    assert len(again.movements.get(key)) == 9
    for _ in range(undone):
        again.undo("w1")
    assert blocks(again) == names[: len(names) - undone]
    again.close()


@pytest.mark.parametrize("change", GONE.values(), ids=GONE.keys())
def test_a_file_that_is_gone_is_written_anew_at_the_next_edit(project: Project, tmp_path: Path, change: Change) -> None:
    path = project.path
    change(path)
    there = contents(tmp_path)
    edit(project, "b2")
    assert project.path == path
    assert project.words == [f"{path} was deleted or moved away: written anew, with all edits"]
    edit(project, "b3")
    assert len(project.words) == 1
    assert {name: data for name, data in contents(tmp_path).items() if name in there} == there
    check_whole(project, ["b0", "b1", "b2", "b3"], 3)
    assert contents(tmp_path).keys() == there.keys() | {"pieces/piece.motionmind"}


@pytest.mark.parametrize("change", CHANGED.values(), ids=CHANGED.keys())
@pytest.mark.parametrize("taken", [0, 2])
def test_a_file_that_another_program_changed_stays_and_the_piece_goes_on_beside_it(
    project: Project, tmp_path: Path, change: Change, taken: int
) -> None:
    path = project.path
    for number in range(2, 2 + taken):
        path.with_name(f"piece-{number}.motionmind").write_text("taken")
    change(path)
    there = contents(tmp_path)
    edit(project, "b2")
    own = path.with_name(f"piece-{2 + taken}.motionmind")
    assert project.path == own
    (words,) = project.words
    assert words.startswith(f"{path} was changed by another program, and is left as it is")
    assert words.endswith(str(own))
    edit(project, "b3")
    check_whole(project, ["b0", "b1", "b2", "b3"], 3)
    after = contents(tmp_path)
    assert after.pop(str(own.relative_to(tmp_path)))
    assert after == there


@pytest.mark.parametrize("change", ALIKE.values(), ids=ALIKE.keys())
def test_a_file_that_is_the_same_is_gone_on_with(project: Project, tmp_path: Path, change: Change) -> None:
    path = project.path
    change(path)
    edit(project, "b2")
    assert (project.path, project.words) == (path, [])
    check_whole(project, ["b0", "b1", "b2"], 3)
    assert contents(tmp_path).keys() == {"pieces/piece.motionmind"}


def test_a_copy_that_another_studio_has_open_is_that_studios(project: Project) -> None:
    path = project.path
    shutil.copy(path, path.with_name("copy"))
    other = Project.open(path.with_name("copy"))
    path.with_name("copy").replace(path)
    edit(project, "b2")
    assert project.path == path.with_name("piece-2.motionmind")
    assert (other.path.exists(), path.exists()) == (False, True)
    edit(other, "c2")  # it finds its own place empty
    other.close()
    check_whole(project, ["b0", "b1", "b2"], 3)
    for place, names in ((path, ["b0", "b1"]), (other.path, ["b0", "b1", "c2"])):
        again = Project.open(place)
        assert blocks(again) == names
        again.close()


@pytest.mark.parametrize("change", CHANGED.values(), ids=CHANGED.keys())
def test_a_project_that_is_closed_after_its_file_changed_is_kept_beside_it(project: Project, change: Change) -> None:
    path = project.path
    change(path)
    project.close()
    again = Project.open(path.with_name("piece-2.motionmind"))
    assert blocks(again) == ["b0", "b1"]
    again.close()


@pytest.mark.parametrize("change", [GONE["deleted"], CHANGED["older version, written into it"]])
@pytest.mark.parametrize("call", ["open", "write", "fsync", "link"])
@pytest.mark.parametrize("code", [errno.EROFS, errno.ENOSPC, errno.EIO])
def test_an_edit_that_cannot_be_written_anew_is_refused_and_the_next_one_writes_all(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Change, call: str, code: int
) -> None:
    change(project.path)
    there = contents(tmp_path)
    for number in count(1):
        state = project.state
        with monkeypatch.context() as patch:
            fails = OSError(code, os.strerror(code))
            for name in [call, "replace"] if call == "link" else [call]:  # a move instead of a link
                owner = Path if name == "replace" else os
                patch.setattr(owner, name, failing_at(number, getattr(owner, name), fails))
            try:
                edit(project, "b2")
                break
            except MotionMindError as error:
                refusal = str(error)
        assert refusal.startswith("not done: piece")
        assert refusal.endswith(os.strerror(code))
        assert project.state == state
        assert contents(tmp_path).items() >= there.items()
    assert number > 1
    check_whole(project, ["b0", "b1", "b2"], 3)
    assert not list(tmp_path.rglob("*.tmp"))


@pytest.mark.long
def test_the_terminal_says_where_a_piece_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "piece.motionmind"
    with running(path, home=tmp_path) as (process, client):
        client.insert("b0", "ballet/adagio", 0, 9)
        path.unlink()
        client.insert("b1", "ballet/adagio", 0, 9)
        path.write_text("mine")
        client.insert("b2", "ballet/adagio", 0, 9)
        words = client.project()["words"]
        process.terminate()
        _, err = process.communicate(timeout=60)
    assert [line for line in err.splitlines() if "first run" not in line] == [f"note: {line}" for line in words]
    assert (path.read_text(), len(words)) == ("mine", 2)
    again = Project.open(tmp_path / "piece-2.motionmind")
    assert blocks(again) == ["b0", "b1", "b2"]
    again.close()


@pytest.mark.long
def test_every_window_says_where_a_piece_goes_on(studio_server: Served, studio_page: Any) -> None:
    other = beside(studio_page)
    other.goto(studio_server.url)
    studio_page.get_by_test_id("posture-bow").wait_for()
    other.get_by_test_id("posture-bow").wait_for()
    studio_server.studio.project.path.unlink()
    studio_server.insert("b1", "ballet/adagio", 0, 9)
    for page in (studio_page, other):
        page.get_by_text("was deleted or moved away: written anew, with all edits").wait_for()
    late = beside(studio_page)
    late.goto(studio_server.url)
    late.get_by_text("was deleted or moved away").wait_for()


# --- damage -----------------------------------------------------------------------------------------------------------

DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "other text": lambda line: b"no JSON\n",
    "not UTF-8": lambda line: line.replace(b'"', b'"\xff\xfe', 1),
    "zeros": lambda line: line[: len(line) // 2] + bytes(len(line) - len(line) // 2 - 1) + b"\n",
    "all zeros": lambda line: bytes(len(line)),
    "cut": lambda line: line[: len(line) // 2] + b"\n",
    "unknown": lambda line: b'{"step": 1}\n',
    "empty": lambda line: b"\n",
}


@pytest.fixture
def lines(project: Project) -> list[bytes]:
    """The lines of a project with four edits, a movement, and an undo."""
    edit(project, "b2")
    edit(project, "b3")
    project.undo("w1")
    project.close()
    return project.path.read_bytes().splitlines(keepends=True)


def edits_in(lines: list[bytes]) -> int:
    return sum(line.startswith(b'{"edit"') for line in lines)


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_a_damaged_line_opens_a_copy_of_the_lines_before(
    project: Project, lines: list[bytes], tmp_path: Path, damage: Callable[[bytes], bytes]
) -> None:
    path, copy = project.path, project.path.with_name("piece-2.motionmind")
    for number in range(1, len(lines)):
        data = b"".join([*lines[:number], damage(lines[number]), *lines[number + 1 :]])
        path.write_bytes(data)
        found = open_project(path, "karate")
        edits = edits_in(lines[:number])
        if damage(lines[number]).endswith(b"\n") or number < len(lines) - 1:
            assert found.path == copy
            assert (len(found.changes), found.state.corpus) == (edits, "ballet")
            says = f"line {number + 1} and stays as it is: a copy with the {edits} edit"
            assert says in found.words[0]
            assert found.words[0].endswith(str(copy))
            assert path.read_bytes() == data
            edit(found, "b9")
            found.close()
            again = Project.open(copy)
            assert (again.words, len(again.changes)) == ([], edits + 1)
            again.close()
            copy.unlink()
        else:  # a torn line
            assert (found.path, found.words) == (path, ["the last edit was lost: the studio ended while writing it"])
            found.close()
        assert contents(tmp_path).keys() == {"pieces/piece.motionmind"}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_a_damaged_first_line_is_made_anew_and_all_edits_open(
    project: Project, lines: list[bytes], damage: Callable[[bytes], bytes]
) -> None:
    path, copy = project.path, project.path.with_name("piece-2.motionmind")
    head = damage(lines[0]).rstrip(b"\n") + b"\n"  # with its end: where that is damaged, so is the next line
    path.write_bytes(head + b"".join(lines[1:]))
    found = open_project(path, "ballet")
    assert (found.path, blocks(found), found.state.title) == (copy, ["b0", "b1", "b2"], "piece")
    assert "is damaged in line 1 and stays as it is: a copy with all 4 edits is open" in found.words[0]
    found.close()
    copy.unlink()
    path.write_bytes(head + b"".join(lines[1:4]) + b"no JSON\n" + b"".join(lines[5:]))
    found = open_project(path, "ballet")
    assert blocks(found) == ["b0", "b1"]
    assert "is damaged in lines 1, 5 and stays as it is: a copy with the 2 edits before line 5" in found.words[0]
    found.close()


def test_damage_of_a_stored_movement_is_found_when_it_is_used(project: Project, lines: list[bytes]) -> None:
    (at,) = [number for number, line in enumerate(lines) if line.startswith(b'{"movement"')]
    place = lines[at].index(b'"data":"', len(lines[at]) // 2) + 20
    letter = b"A" if lines[at][place : place + 1] != b"A" else b"B"
    lines[at] = lines[at][:place] + letter + lines[at][place + 1 :]
    project.path.write_bytes(b"".join(lines))
    again = open_project(project.path, "ballet")
    assert (again.path, blocks(again)) == (project.path, ["b0", "b1", "b2"])
    (key,) = again.movements._kept
    with pytest.raises(MotionMindError, match=f"movement {key} is damaged: its content has changed"):
        again.movements.get(key)
    again.close()


def test_a_copy_that_cannot_be_written_is_an_error_in_a_line(
    project: Project, lines: list[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    data = b"".join([*lines[:2], b"no JSON\n", *lines[3:]])
    project.path.write_bytes(data)
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", failing_at(1, os.fsync, full))
        with pytest.raises(MotionMindError, match="a copy of its sound lines cannot be written: No space left"):
            open_project(project.path, "ballet")
    assert [path.name for path in project.path.parent.iterdir()] == ["piece.motionmind"]
    assert project.path.read_bytes() == data


@pytest.mark.long
def test_the_command_says_what_it_opened(project: Project, lines: list[bytes], tmp_path: Path) -> None:
    project.path.write_bytes(b"".join([*lines[:2], b"no JSON\n", *lines[3:]]))
    with running(project.path, home=tmp_path) as (process, client):
        view = client.project()
        assert view["file"] == "piece-2.motionmind"
        process.terminate()
        _, err = process.communicate(timeout=60)
    assert f"note: {view['words'][0]}\n" in err
    assert "is damaged in line 3 and stays as it is: a copy with the 1 edit before line 3 is open" in err
