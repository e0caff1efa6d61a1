"""What was learned is cached: what is damaged, from other code or unfinished is not trusted but learned again."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from saved_corpora import kill_before

import motionmind
from motionmind.corpus import cache, store
from motionmind.corpus.corpus import Corpus
from motionmind.errors import MotionMindWarning
from motionmind.learned import persistence
from motionmind.learned.learning import Learned
from motionmind.learned.persistence import learned_arrays


@pytest.fixture(scope="module")
def hands() -> Learned:
    return persistence.load("hands")


@pytest.fixture
def built(hands: Learned, tmp_path: Path, empty_cache: Path) -> Path:
    """A built corpus, and the cache of what was learned from it."""
    persistence.save(hands, folder := tmp_path / "home" / "corpora" / "mine")
    return folder


def kept() -> Path:
    """The one folder in the cache."""
    (folder,) = cache.cache_folder("learned").iterdir()
    return folder


def is_same(one: Learned, other: Learned) -> bool:
    arrays, others = learned_arrays(one), learned_arrays(other)
    return arrays.keys() == others.keys() and all(
        np.array_equal(array, others[name], equal_nan=array.dtype.kind == "f") for name, array in arrays.items()
    )


def no_learning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(persistence, "learn_from_states", lambda *_: pytest.fail("it was learned again"))


@pytest.mark.parametrize("name", ["hands", "walk-hexapod"])
def test_the_movement_of_a_corpus_loads_without_learning(
    name: str, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def is_whole(movement: Corpus) -> bool:
        arrays = ("rotations", "root", "times", "detail")
        return all(np.array_equal(getattr(movement, one), getattr(corpus, one)) for one in arrays) and (
            list(movement.clips) == list(corpus.clips) and movement.own_origin == corpus.own_origin
        )

    with monkeypatch.context() as patch:
        for learn in ("learn", "learn_from_states"):
            patch.setattr(persistence, learn, lambda *_: pytest.fail("it was learned"))
        composed = persistence.load_corpus(name)
    corpus = persistence.load(name).corpus
    (built,) = cache.cache_folder("corpora").iterdir()
    with monkeypatch.context() as patch:
        patch.setattr(persistence, "_read_source", lambda *_: pytest.fail("it was composed again"))
        assert all(map(is_whole, [composed, persistence.load_corpus(name), persistence.load_corpus(str(built))]))
    (built / store.MANIFEST).write_bytes(b"")
    assert is_whole(persistence.load_corpus(name))  # composed, whatever the cache holds


def test_a_build_fills_the_cache_and_loading_learns_what_it_does_not_hold(
    hands: Learned, built: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        no_learning(patch)
        assert is_same(persistence.load(str(built)), hands)
    shutil.rmtree(kept())
    assert is_same(persistence.load(str(built)), hands)
    no_learning(monkeypatch)
    assert is_same(persistence.load(str(built)), hands)


def test_arrays_that_others_could_have_written_are_learned_again_elsewhere(
    hands: Learned, built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cache, "temporary_folder", lambda: tmp_path / "temporary")
    for shared in (cache.cache_folder("learned"), cache.cache_folder("learned").parent):
        cache._private.cache_clear()
        shared.chmod(0o777)
        (array := next(kept().glob("*.npy"))).write_bytes(b"not looked at")
        assert is_same(persistence.load(str(built)), hands)
        assert array.read_bytes() == b"not looked at"
        with monkeypatch.context() as patch:
            no_learning(patch)
            assert is_same(persistence.load(str(built)), hands)
        shared.chmod(0o700)
        shutil.rmtree(tmp_path / "temporary")
    cache._private.cache_clear()


def flip(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[-1] ^= 1
    file.write_bytes(data)


def test_a_damaged_array_is_told_once_and_learned_again(hands: Learned, built: Path, run: Run) -> None:
    damages: list[tuple[Callable[[Path], object], str]] = [
        (flip, "its checksum is not the manifest's"),
        (Path.unlink, "cannot be read as an array: "),
        (lambda file: os.truncate(file, file.stat().st_size - 8), "its checksum is not|cannot be read as an array"),
        (lambda file: np.save(file, np.zeros(3)), "its type or shape is not the manifest's"),
    ]
    for damage, words in damages:
        damage(kept() / "bridges.degrees.npy")
        with pytest.warns(MotionMindWarning, match=rf"bridges\.degrees\.npy: .*({words}).*; learning from") as warned:
            assert is_same(persistence.load(str(built)), hands)
        assert len(warned) == 1
        persistence.load(str(built))
    flip(file := kept() / "trust.table.npy")
    ran = run("corpus", "info", "mine")
    assert (ran.code, ran.err) == (
        0,
        f"note: {file}: its checksum is not the manifest's; learning from the corpus again\n",
    )
    assert run("corpus", "info", "mine").err == ""


@pytest.mark.parametrize("text", ["", "{", "[]", "[" * 100_000, '{"a": null}', '{"../a": {}}', "{}\0"])
def test_a_damaged_manifest_is_told_once_and_all_is_learned_again(hands: Learned, built: Path, text: str) -> None:
    (kept() / "manifest.json").write_text(text, "utf-8")
    with pytest.warns(MotionMindWarning, match=r"manifest\.json: .*; learning from the corpus again$") as warned:
        assert is_same(persistence.load(str(built)), hands)
    assert len(warned) == 1
    persistence.load(str(built))


def test_arrays_are_hashed_once(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    persistence.load(str(built))
    assert not (kept() / "checked").exists()  # files as new as this may change and keep their times
    time.sleep(2.1)
    persistence.load(str(built))
    with monkeypatch.context() as patch:
        patch.setattr("hashlib.file_digest", lambda *_: pytest.fail("it was hashed again"))
        persistence.load(str(built))
    file = kept() / "trust.table.npy"
    before = file.stat()
    flip(file)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    with pytest.warns(MotionMindWarning, match=r"trust\.table\.npy"):
        persistence.load(str(built))


def test_what_other_code_learned_is_not_used(hands: Learned, built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = kept()
    monkeypatch.setattr(cache, "code_name", lambda: "of-other-code")
    np.save(before / "trust.table.npy", np.zeros(5))
    assert is_same(persistence.load(str(built)), hands)
    assert {entry.name for entry in before.parent.iterdir()} == {
        before.name,
        before.name.replace(before.name.rpartition("-")[2], "of-other-code"),
    }


def test_another_corpus_has_another_cache_and_another_name_has_the_same(
    built: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, home = kept(), built.parents[1]
    store.rename("mine", "ours", home)
    with monkeypatch.context() as patch:
        no_learning(patch)
        assert persistence.load("ours", home).corpus.name == "ours"
    persistence.save(persistence.load("karate"), built.with_name("ours"))
    assert before.exists()  # while its corpus can be restored
    persistence.save(persistence.load("macarena"), built.with_name("ours"))
    assert not before.exists()
    assert len(list(before.parent.iterdir())) == 2
    store.delete("ours", home)
    assert list(before.parent.iterdir()) == []


def test_a_cache_that_cannot_be_written_stops_no_command(
    hands: Learned, built: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cache, "cache_folder", lambda room: Path("/proc/nowhere") / room)
    ran = run("corpus", "check", "mine", "--pairs", 5)
    assert (ran.code, ran.err.count("\n")) == (0, 1)
    assert "/proc/nowhere/learned: cannot be written: " in ran.err
    assert ran.err.endswith("; each command will learn the corpus again\n")


def test_learners_at_once_leave_one_whole_cache(hands: Learned, built: Path, tmp_path: Path) -> None:
    shutil.rmtree(kept())
    program = (
        "import sys; from pathlib import Path; from motionmind.corpus import cache\n"
        "from motionmind.learned import persistence\n"
        f"cache.cache_folder = lambda room: Path({str(tmp_path / 'cache')!r}) / room\n"
        f"for _ in range(2): persistence.load({str(built)!r})"
    )
    paths = os.environ | {"PYTHONPATH": str(Path(motionmind.__file__).parents[1])}
    running = [
        subprocess.Popen([sys.executable, "-W", "error", "-c", program], env=paths, stderr=subprocess.PIPE)
        for _ in range(2)
    ]
    assert [(process.communicate()[1], process.returncode) for process in running] == [(b"", 0)] * 2
    assert (kept() / "manifest.json").is_file()
    assert is_same(persistence.load(str(built)), hands)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
def test_a_killed_writer_leaves_nothing_that_is_trusted(hands: Learned, built: Path) -> None:
    folder, digest = kept(), store.load(built).digest
    arrays = dict(list(learned_arrays(hands).items())[:4])
    shutil.rmtree(folder)
    for change in count(1):
        if (child := os.fork()) == 0:
            kill_before(change)
            cache.remember(digest, arrays)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status):
            break
        found = cache.recall(digest)
        assert found is None or found.keys() == arrays.keys()
        shutil.rmtree(folder, ignore_errors=True)
    assert change > 6
    left = [entry for entry in folder.parent.iterdir() if entry != folder]
    assert left
    assert all(entry.name.startswith(".") for entry in left)
    for entry in left:
        os.utime(entry, (time.time() - 2 * 86400.0,) * 2)
    shutil.rmtree(folder)
    cache.remember(digest, arrays)
    assert kept() == folder


def test_what_nothing_used_for_two_months_is_removed(built: Path) -> None:
    folder, digest = kept(), store.load(built).digest
    other = folder.with_name("0123456789abcdef-0123456789abcdef")
    shutil.copytree(folder, other)
    for entry, days in ((folder, 50), (other, 70)):
        os.utime(entry, (time.time() - days * 86400.0,) * 2)
    cache.remember("fedcba9876543210", {})
    assert not other.exists()
    assert folder.exists()
    cache.recall(digest)
    assert time.time() - folder.stat().st_mtime < 60.0  # it is in use
