"""A corpus that is replaced is the old one or the new one, whatever happens on the way and whoever looks."""

from __future__ import annotations

import errno
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import saved_corpora
from faults import failing_at
from saved_corpora import MANIFEST, arrays, names, seed_of

from motionmind import files
from motionmind.corpus import store, versions
from motionmind.errors import CorpusError, FormatError

PROGRAM = Path(saved_corpora.__file__)
WHOLE = ["manifest.json", "part.targets.npy", "rotations.npy", "states.npy"]
WITH_KEPT = sorted([*WHOLE, *WHOLE[1:]])  # and those of the corpus that it replaced
# Calls that change what is on disk. Others fail or are repeated without a trace.
CALLS = ("rename", "unlink", "unlinkat", "rmdir", "mkdir", "write", "fsync", "flock")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """Where a corpus is to be, among a user's corpora."""
    return tmp_path / "home" / "corpora" / "arms"


def nothing(folder: Path) -> None:
    """No corpus is there yet."""


def saved(folder: Path) -> None:
    """A corpus was replaced before."""
    store.save(folder, MANIFEST, arrays(0))
    store.save(folder, MANIFEST, arrays(1))


def check(folder: Path, before: Callable[[Path], None]) -> None:
    """Check that all is old or all new, that nothing else is listed, and that the next build mends the rest.

    What it replaced is whole, too, and what the next build replaces.
    """
    home = folder.parents[1]
    listed = {name for name, place in store.list_corpora(home).items() if place.parent == folder.parent}
    assert listed <= {"arms"}
    if listed or before is not nothing:
        assert (seed := seed_of(folder)) in (1, 2)
        if before is saved:
            assert [seed_of(store.restore("arms", home)) for _ in range(2)] == [seed - 1, seed]
    for temporary in folder.glob(".motionmind-*"):
        os.utime(temporary, (time.time() - 120.0,) * 2)  # no younger one is taken for a leftover
    store.save(folder, MANIFEST, arrays(3))
    assert seed_of(folder) == 3
    assert sorted(Path(name).name for name in names(folder.parent)) == (WITH_KEPT if listed else WHOLE)
    if listed:
        assert seed_of(store.restore("arms", home)) == seed


@pytest.mark.parametrize("before", [nothing, saved])
def test_a_kill_before_any_change_of_the_disk_leaves_old_or_new(mine: Path, before: Callable[[Path], None]) -> None:
    for change in count(1):
        shutil.rmtree(mine.parent, ignore_errors=True)
        before(mine)
        code = saved_corpora.changed(folder=mine, seed=2, change=change)
        assert code in (0, -9)
        ended = code == 0
        check(mine, before)
        if ended:
            break
    assert change > 8


@pytest.mark.skipif(not shutil.which("strace"), reason="there is no strace")
@pytest.mark.parametrize("call", CALLS)
def test_a_kill_at_any_call_of_the_system_leaves_old_or_new(mine: Path, call: str) -> None:
    for number in count(1):
        shutil.rmtree(mine.parent, ignore_errors=True)
        saved(mine)
        kill = ("-e", f"trace={call}", "-e", f"inject={call}:signal=KILL:when={number}")
        code = saved_corpora.traced(kill, folder=mine, seed=2)
        assert code in (0, -9)
        ended = code == 0
        check(mine, saved)
        if ended:
            break
    assert number > 1 or call in ("unlink", "rmdir", "unlinkat")


def test_an_error_or_ctrl_c_on_the_way_leaves_the_old_one_and_nothing_else(
    mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved(mine)
    there = names(mine.parent)
    calls = {os: ["fsync", "replace", "mkdir"], Path: ["mkdir", "replace"], np.lib.format: ["write_array_header_1_0"]}
    for owner, name in [(owner, name) for owner, all_of_it in calls.items() for name in all_of_it]:
        for error in (OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()):
            for number in count(1):
                with monkeypatch.context() as patch:
                    patch.setattr(owner, name, failing_at(number, getattr(owner, name), error))
                    try:
                        store.save(mine, MANIFEST, arrays(2))
                        break
                    except (CorpusError, KeyboardInterrupt):
                        pass
                if seed_of(mine) == 1:
                    assert names(mine.parent) == there
                else:  # the folder could not be flushed after the move
                    assert (name, seed_of(mine)) == ("fsync", 2)
                    assert sorted(Path(file).name for file in names(mine.parent)) == WITH_KEPT
                    break
            shutil.rmtree(mine)
            saved(mine)


def test_a_disk_without_room_says_so_in_its_own_words(mine: Path) -> None:
    resource = pytest.importorskip("resource", reason="this system has no limit on the size of files")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(CorpusError, match=r"arms: cannot be written: File too large$"):
            store.save(mine, MANIFEST, {"rotations": np.zeros(100_000)})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert names(mine.parent) == []


# --- leftovers --------------------------------------------------------------------------------------------------------


def test_what_a_killed_deletion_left_is_removed_and_other_folders_are_kept(mine: Path) -> None:
    saved(mine)
    shutil.copytree(mine, mine.with_name(".arms-0123456789ab"))
    diary = mine.with_name(".arms-0123456789ac")
    diary.mkdir()
    (diary / "diary.txt").write_text("dear diary")
    assert {".arms-0123456789ab", ".arms-0123456789ac"}.isdisjoint(store.list_corpora(mine.parents[1]))
    with pytest.raises(ValueError, match="Object arrays"):
        store.save(mine, MANIFEST, {"one": np.array([None])})
    assert seed_of(mine) == 1
    store.save(mine, MANIFEST, arrays(2))
    assert seed_of(mine) == 2
    assert sorted(path.name for path in mine.parent.iterdir()) == [".arms-0123456789ac", "arms"]


def test_a_version_in_use_is_removed_once_nobody_uses_it(mine: Path) -> None:
    store.save(mine, MANIFEST, arrays(1))
    with versions.hold(mine / "1") as there:
        assert there
        store.save(mine, MANIFEST, arrays(2))
        assert names(mine / "1") == WHOLE[1:]
    store.save(mine, MANIFEST, arrays(3))
    assert sorted(path.name for path in mine.iterdir() if path.is_dir()) == ["2", "3"]
    with versions.hold(mine / "1") as there:
        assert not there


def test_a_version_that_is_being_written_is_not_removed(mine: Path) -> None:
    store.save(mine, MANIFEST, arrays(1))
    with versions.new_version(mine) as unfinished:
        store.save(mine, MANIFEST, arrays(2))
        assert unfinished.is_dir()
    store.save(mine, MANIFEST, arrays(3))
    assert not unfinished.exists()


def test_a_folder_of_another_content_in_a_version_is_never_removed(mine: Path) -> None:
    store.save(mine, MANIFEST, arrays(1))
    (mine / "1" / "diary.txt").write_text("dear diary")
    (mine / "2026").mkdir()
    (mine / "2026" / "photograph.png").write_bytes(b"")
    for stranger in ("1/diary.txt", "2026/photograph.png"):
        with pytest.raises(CorpusError, match="which is no part of a built corpus; it is not replaced"):
            store.save(mine, MANIFEST, arrays(2))
        (mine / stranger).unlink(missing_ok=True)
    store.save(mine, MANIFEST, arrays(2))


def test_temporary_files_of_dead_processes_are_removed_and_of_living_ones_kept(tmp_path: Path) -> None:
    program = "import os; print(os.getpid())"
    dead = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    token, hour, week = "0" * 16, 3600.0, 7 * 86400.0
    ages = {
        f".motionmind-{os.getpid()}-{token}.tmp": (hour, True),
        f".motionmind-{os.getpid()}-{'1' * 16}.tmp": (week, False),
        f".motionmind-{dead.stdout.strip()}-{token}.tmp": (hour, False),
        f".motionmind-{dead.stdout.strip()}-{'1' * 16}.tmp": (0.0, True),
        f".motionmind-{token}.tmp": (week, False),  # as 0.1 called them
        f".motionmind-{'9' * 30}-{token}.tmp": (hour, False),
        ".motionmind-mine.tmp": (week, True),
    }
    for name, (age, _) in ages.items():
        (tmp_path / name).write_bytes(b"")
        os.utime(tmp_path / name, (time.time() - age,) * 2)
    files.write_atomically(tmp_path / "new", b"")
    assert names(tmp_path) == sorted(["new", *(name for name, (_, stays) in ages.items() if stays)])


def test_a_file_that_another_program_holds_open_is_replaced_when_it_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    denied = PermissionError(errno.EACCES, "in use")
    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", failing_at(1, Path.replace, denied))
        files.write_atomically(tmp_path / "file", b"new")
    assert (tmp_path / "file").read_bytes() == b"new"


# --- readers and writers at once --------------------------------------------------------------------------------------


@pytest.fixture
def writers(mine: Path) -> Iterator[None]:
    """Two processes that replace a corpus without end, by what holds a seed of its own."""
    store.save(mine, MANIFEST, arrays(0))
    program = (
        "import sys; from pathlib import Path; from saved_corpora import *\n"
        "for seed in range(int(sys.argv[2]), 10**9, 2): store.save(Path(sys.argv[1]), MANIFEST, arrays(seed))"
    )
    paths = os.pathsep.join([str(PROGRAM.parent), str(Path(files.__file__).parents[1])])
    running = [
        subprocess.Popen([sys.executable, "-c", program, str(mine), str(first)], env=os.environ | {"PYTHONPATH": paths})
        for first in (1, 2)
    ]
    yield
    failed = [process.poll() for process in running]
    for process in running:
        process.kill()
        process.wait()
    assert failed == [None, None]


def test_2000_loads_beside_two_writers_are_each_of_one_version(mine: Path, writers: None) -> None:
    until = time.monotonic() + 60.0
    while seed_of(mine) == 0 and time.monotonic() < until:
        time.sleep(0.01)
    seeds: list[int] = []
    failures: list[BaseException] = []

    def read() -> None:
        try:
            seeds.extend(seed_of(mine) for _ in range(1000))
        except BaseException as error:  # told below, in the test's own thread
            failures.append(error)

    readers = [threading.Thread(target=read) for _ in range(2)]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()
    assert not failures, [str(one) for one in failures]
    assert len(seeds) == 2000
    assert len(set(seeds)) > 20  # it was replaced meanwhile


def test_a_version_that_another_writer_removed_and_made_anew_is_that_writers(
    mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine.mkdir(parents=True)
    others = ExitStack()

    def interrupted(version: Path) -> None:
        monkeypatch.undo()
        version.mkdir()
        versions.remove_others(mine, lambda: ())  # nobody holds it yet
        assert others.enter_context(versions.new_version(mine)) == version

    monkeypatch.setattr(Path, "mkdir", interrupted)
    with others, versions.new_version(mine) as version:
        assert (version, sorted(mine.iterdir())) == (mine / "2", [mine / "1", mine / "2"])


def test_a_version_made_anew_under_the_number_of_one_that_was_to_go_stays(
    mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fcntl = pytest.importorskip("fcntl")
    (mine / "1").mkdir(parents=True)
    others, flock = ExitStack(), fcntl.flock

    def interrupted(descriptor: int, operation: int) -> None:
        monkeypatch.undo()
        versions.remove_others(mine, lambda: ())  # another writer removes folder 1 and makes it anew
        assert others.enter_context(versions.new_version(mine)) == mine / "1"
        flock(descriptor, operation)

    monkeypatch.setattr(fcntl, "flock", interrupted)
    with others:
        versions.remove_others(mine, lambda: ())
        assert (mine / "1").is_dir()


def test_a_corpus_whose_version_is_gone_is_one_error(mine: Path) -> None:
    store.save(mine, MANIFEST, arrays(1))
    shutil.rmtree(mine / "1")
    with pytest.raises(FormatError, match=re.escape("there is no folder 1 beside it; rebuild it")):
        store.load(mine)


def test_a_version_that_is_missing_for_a_moment_is_waited_for(mine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Writers make and remove versions of a number that is free again, whose manifests are the same."""
    store.save(mine, MANIFEST, arrays(1))
    (mine / "1").rename(mine / "aside")
    waits = iter([None, lambda: (mine / "aside").rename(mine / "1")])

    def wait(_: float) -> None:
        if then := next(waits):
            then()

    monkeypatch.setattr(time, "sleep", wait)
    assert seed_of(mine) == 1


def test_a_version_that_is_replaced_while_it_is_read_is_read_anew(mine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a disk has no locks a version may be removed under its readers."""
    store.save(mine, MANIFEST, arrays(1))
    read = store.open_arrays

    def interrupted(place: Path, entries: Any, *, verify: bool) -> dict[str, Any]:
        monkeypatch.undo()
        store.save(mine, MANIFEST, arrays(2))
        shutil.rmtree(place)
        return read(place, entries, verify=verify)

    monkeypatch.setattr(store, "open_arrays", interrupted)
    assert seed_of(mine) == 2


def test_arrays_that_were_loaded_outlive_their_version(mine: Path) -> None:
    store.save(mine, MANIFEST, arrays(1))
    _, found, *_ = store.load(mine)
    store.save(mine, MANIFEST, arrays(2))
    store.save(mine, MANIFEST, arrays(3))
    assert not (mine / "1").exists()
    assert all((array == 1).all() for array in found.values())


# --- what was replaced ------------------------------------------------------------------------------------------------


def test_the_last_change_is_undone_and_done_again(mine: Path) -> None:
    saved(mine)
    store.save(mine, MANIFEST, arrays(2))
    home = mine.parents[1]
    assert [seed_of(store.restore("arms", home)) for _ in range(4)] == [1, 2, 1, 2]
    assert sorted(Path(name).name for name in names(mine)) == WITH_KEPT


def test_building_the_same_again_leaves_what_was_there_before(mine: Path) -> None:
    saved(mine)
    store.save(mine, MANIFEST, arrays(1))
    assert seed_of(store.restore("arms", mine.parents[1])) == 0


def test_a_renamed_corpus_keeps_what_it_replaced_under_its_new_name(mine: Path) -> None:
    saved(mine)
    home = mine.parents[1]
    store.rename("arms", "legs", home)
    place = store.restore("legs", home)
    assert (seed_of(place), store.read_manifest(place)["name"]) == (0, "legs")


def test_a_first_corpus_and_one_whose_arrays_are_gone_cannot_be_restored(mine: Path) -> None:
    store.save(mine, MANIFEST, arrays(1))
    with pytest.raises(CorpusError, match="'arms' replaced no corpus that is kept"):
        store.restore("arms", mine.parents[1])
    store.save(mine, MANIFEST, arrays(2))
    shutil.rmtree(mine / "1")
    with pytest.raises(CorpusError, match="'arms' replaced no corpus that is kept"):
        store.restore("arms", mine.parents[1])
    assert seed_of(mine) == 2


def test_what_is_made_again_anyway_keeps_nothing(mine: Path) -> None:
    store.save(mine, MANIFEST, arrays(1))
    store.save(mine, MANIFEST, arrays(2), keep=False)
    assert sorted(Path(name).name for name in names(mine)) == WHOLE
