"""Commands that change files, killed or on a full disk: all is as before or as after, and the next command works."""

from __future__ import annotations

import errno
import json
import os
import shutil
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import platformdirs
import pytest
import saved_corpora
from bundled_clips import ballet_clip
from command_line import Run
from faults import failing_at

from motionmind.corpus import store
from motionmind.tween.engine import Engine
from motionmind.variation.variation import vary
from motionmind.variation.variation_json import read_variation, write_variation


class Case(NamedTuple):
    """A command, and what is seen of its files.

    Attributes:
        words: the command.
        prepare: makes the files that it changes, in a folder.
        look: what is in them; fails if anything is incomplete.
    """

    words: list[str]
    prepare: Callable[[Path], None]
    look: Callable[[Path], Any]


def save_corpus(folder: Path) -> None:
    """Learn a corpus of two short clips."""
    clips = [ballet_clip(name).slice(0, 12) for name in ("plies", "tendus")]
    Engine.fit(clips, name="mine").save(store.place_for("mine", folder / "home"))


def look_at_corpora(folder: Path) -> Any:
    """Load all of the user's corpora; return their clips."""
    home = folder / "home"
    own = [name for name, place in store.list_corpora(home).items() if home in place.parents]
    return {name: [clip.name for clip in Engine.load(name, home).corpus.clips] for name in own}


def save_variation(folder: Path) -> None:
    """Write a variation."""
    write_variation(folder / "v.json", vary(ballet_clip("plies"), stretch=4))


def look_at_variation(folder: Path) -> Any:
    """Read the variation; return its order."""
    return np.asarray(read_variation(folder / "v.json").postures).tolist()


CASES = {
    "remove": Case(["corpus", "remove", "mine", "tendus"], save_corpus, look_at_corpora),
    "rename": Case(["corpus", "rename", "mine", "other"], save_corpus, look_at_corpora),
    "review": Case(["review", "v.json", "--cut", "0..1", "--paste", "3"], save_variation, look_at_variation),
}


def names(folder: Path) -> set[str]:
    """The user's files and folders, by path, without the marks of what was checked."""
    kept = [path.relative_to(folder) for path in folder.rglob("*") if path.parts[len(folder.parts)] != "cache"]
    return {str(path) for path in kept if path.name != "checked"}


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The files that a command changes, in a folder of their own, made once."""
    made: dict[Callable[[Path], None], Path] = {}

    def prepare(name: str) -> Path:
        make = CASES[name].prepare
        if make not in made:
            made[make] = tmp_path_factory.mktemp("prepared")
            make(made[make])
        return made[make]

    return prepare


@pytest.mark.long
@pytest.mark.parametrize("name", ["rename", "review"])  # test_replacing_corpora.py kills what `remove` does
def test_a_kill_before_any_change_leaves_all_as_before_or_as_after(
    prepared: Callable[[str], Path], tmp_path: Path, name: str
) -> None:
    words, _, look = CASES[name]
    work = tmp_path / "work"

    def run(change: int = 0) -> int:
        return saved_corpora.changed(folder=work, do="command", words=json.dumps(words), change=change)

    shutil.copytree(prepared(name), work)
    before, original = look(work), (work / "v.json").read_bytes() if (work / "v.json").exists() else b""
    assert run() == 0
    after, whole = look(work), names(work)
    assert before != after
    for change in count(1):
        shutil.rmtree(work)
        shutil.copytree(prepared(name), work)
        code = run(change)
        assert code in (0, -9)
        seen = look(work)
        assert seen in (before, after)
        if seen == before and original:
            assert (work / "v.json").read_bytes() == original
        if code == 0:
            break
        for temporary in work.rglob(".motionmind-*"):
            os.utime(temporary, (time.time() - 120.0,) * 2)
        if seen == before:
            assert run() == 0
            assert look(work) == after
            assert names(work) == whole
    assert change > 3


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(
    ("owner", "call"), [(os, "fsync"), (os, "open"), (os, "mkdir"), (Path, "replace"), (Path, "rename")]
)
@pytest.mark.long
def test_a_full_disk_leaves_all_as_before_or_as_after_and_is_an_error_in_a_line(
    prepared: Callable[[str], Path],
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    owner: Any,
    call: str,
) -> None:
    words, _, look = CASES[name]
    code = os.environ.get("NUMBA_CACHE_DIR", platformdirs.user_cache_dir("motionmind", appauthor=False))
    monkeypatch.setenv("NUMBA_CACHE_DIR", code)  # what is compiled already
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    shutil.copytree(prepared(name), tmp_path, dirs_exist_ok=True)
    before, there = look(tmp_path), names(tmp_path)
    full = OSError(errno.ENOSPC, "No space left on device")
    after = None
    step = 4 if (name, call) == ("remove", "fsync") else 1  # each array is flushed
    for number in count(1, step):
        with monkeypatch.context() as patch:
            patch.setattr(owner, call, failing_at(number, getattr(owner, call), full))
            ran = run(*words)
        after = look(tmp_path)
        if ran.code == 0:
            break
        assert (ran.code, ran.err.count("error: "), "o space left" in ran.err) == (2, 1, True), ran.err
        if after != before:  # the folder could not be flushed after the move
            break
        assert names(tmp_path) - {"home/shards", "home/shards/mine"} <= there  # which the next run removes
    assert after != before or ran.code == 0
    if after == before:
        ran = run(*words)
        assert ran.code == 0
        assert look(tmp_path) != before
    assert ran.code != 0 or "home/shards/mine" not in names(tmp_path)


@pytest.mark.long
def test_a_kill_before_any_change_of_a_project_loses_no_edit_before(tmp_path: Path) -> None:
    from motionmind.studio.project import Project

    length = 2
    path = tmp_path / "piece.motionmind"
    for change in count(1):
        path.unlink(missing_ok=True)
        code = saved_corpora.changed(folder=path, do="edit", count=length, change=change)
        assert code in (0, -9)
        for temporary in tmp_path.glob(".motionmind-*"):
            os.utime(temporary, (time.time() - 120.0,) * 2)
        assert saved_corpora.changed(folder=path, do="edit", count=length, change=0) == 0  # it goes on
        project = Project.open(path)
        assert [block.id for block in project.state.blocks] == [f"b{number}" for number in range(length)]
        assert project.words == []
        project.close()
        if code == 0:
            break
    assert change > length
    Project.create(tmp_path / "other.motionmind", "ballet").close()  # which removes what was left
    assert sorted(one.name for one in tmp_path.iterdir()) == ["other.motionmind", "piece.motionmind"]


@pytest.mark.long
@pytest.mark.skipif(not shutil.which("strace"), reason="there is no strace")
@pytest.mark.parametrize("call", ["write", "fsync", "ftruncate", "link"])
def test_a_kill_at_any_call_of_the_system_loses_no_edit_before(tmp_path: Path, call: str) -> None:
    from motionmind.studio.project import Project

    path = tmp_path / "piece.motionmind"
    for number in count(1):
        path.unlink(missing_ok=True)
        kill = ("-e", f"trace={call}", "-e", f"inject={call}:signal=KILL:when={number}")
        code = saved_corpora.traced(kill, folder=path, do="edit", count=2)
        assert code in (0, -9)
        assert saved_corpora.changed(folder=path, do="edit", count=2, change=0) == 0
        project = Project.open(path)
        assert [block.id for block in project.state.blocks] == ["b0", "b1"]
        project.close()
        if code == 0:
            break
    assert number > 1
