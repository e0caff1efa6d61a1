"""A corpus that is renamed or deleted is there, whole, or gone, whatever happens on the way."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable
from itertools import count
from pathlib import Path

import pytest
import saved_corpora
from faults import failing_at
from saved_corpora import MANIFEST, arrays, names, seed_of

from motionmind.corpus import store, versions
from motionmind.errors import CorpusError


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """Where a corpus is to be, among a user's corpora."""
    return tmp_path / "home" / "corpora" / "arms"


def saved(folder: Path) -> None:
    """A corpus was replaced before."""
    store.save(folder, MANIFEST, arrays(0))
    store.save(folder, MANIFEST, arrays(1))


def own(mine: Path) -> dict[str, Path]:
    """A user's corpora."""
    return {name: place for name, place in store.list_corpora(mine.parents[1]).items() if place.parent == mine.parent}


def run(folder: Path, do: str, change: int) -> bool:
    """Rename or delete, killed before the n-th change; whether it came to its end."""
    code = saved_corpora.changed(folder=folder, do=do, change=change)
    assert code in (0, -9)
    return code == 0


def test_a_renamed_corpus_is_the_same_under_its_new_name(mine: Path) -> None:
    saved(mine)
    target = store.rename("arms", "legs", mine.parents[1])
    assert own(mine) == {"legs": target}
    assert (seed_of(target), store.read_manifest(target)["name"]) == (1, "legs")
    assert [path.name for path in mine.parent.iterdir()] == ["legs"]


def test_a_kill_leaves_it_under_one_of_its_names_and_renaming_goes_on(mine: Path) -> None:
    for change in count(1):
        shutil.rmtree(mine.parent, ignore_errors=True)
        saved(mine)
        ended = run(mine, "rename", change)
        ((name, place),) = own(mine).items()
        assert name in ("arms", "legs")
        assert seed_of(place) == 1
        if name == "arms":
            place = store.rename("arms", "legs", mine.parents[1])
        assert (seed_of(place), store.read_manifest(place)["name"]) == (1, "legs")
        if ended:
            break
    assert change > 2


def test_a_kill_leaves_a_whole_corpus_or_none(mine: Path) -> None:
    for change in count(1):
        shutil.rmtree(mine.parent, ignore_errors=True)
        saved(mine)
        ended = run(mine, "delete", change)
        if own(mine):
            assert seed_of(mine) == 1
            assert not ended
        else:
            assert not mine.exists()
        store.save(mine, MANIFEST, arrays(2))  # which removes what was left
        assert [path.name for path in mine.parent.iterdir()] == ["arms"]
        if ended:
            break
    assert change > 1


def test_an_error_on_the_way_is_told_and_leaves_it_as_it_is(mine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    saved(mine)
    full = OSError(errno.ENOSPC, "No space left on device")
    for owner, name in ((os, "replace"), (Path, "rename")):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, failing_at(1, getattr(owner, name), full))
            with pytest.raises(CorpusError, match="arms: cannot be renamed: No space left on device"):
                store.rename("arms", "legs", mine.parents[1])
        assert seed_of(mine) == 1
    with monkeypatch.context() as patch:
        patch.setattr(Path, "rename", failing_at(1, Path.rename, full))
        with pytest.raises(CorpusError, match="arms: cannot be deleted: No space left on device"):
            store.delete("arms", mine.parents[1])
    assert seed_of(mine) == 1


def test_who_has_loaded_it_keeps_it(mine: Path) -> None:
    saved(mine)
    loaded = store.load(mine)
    with versions.hold(loaded.place) as there:
        assert there
        store.delete("arms", mine.parents[1])
    assert {int(value) for array in loaded.arrays.values() for value in array.ravel()} == {1}


def test_a_build_under_which_it_goes_away_fails_and_leaves_nothing(mine: Path) -> None:
    for change in (
        lambda: store.delete("arms", mine.parents[1]),
        lambda: store.rename("arms", "legs", mine.parents[1]),
    ):
        saved(mine)

        class Disturbing(dict[str, object]):
            """Arrays, amid whose writing the corpus goes away."""

            def items(self, change: Callable[[], object] = change) -> object:
                first, *others = arrays(2).items()
                yield first
                change()
                yield from others

        with pytest.raises(CorpusError, match="cannot be written: No such file or directory"):
            store.save(mine, MANIFEST, Disturbing(arrays(2)))  # type: ignore[arg-type]
        assert not mine.exists()
    assert seed_of(mine.with_name("legs")) == 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ballet", "'ballet' is a bundled corpus, which can be neither changed nor deleted"),
        ("amrs", "no corpus 'amrs' of your own; did you mean arms\\?"),
        ("zzz", "no corpus 'zzz' of your own; there are arms"),
        ("../arms", "cannot be a corpus's name"),
    ],
)
def test_only_a_corpus_of_ones_own_is_renamed_or_deleted(mine: Path, name: str, message: str) -> None:
    saved(mine)
    for change in (lambda: store.delete(name, mine.parents[1]), lambda: store.rename(name, "legs", mine.parents[1])):
        with pytest.raises(CorpusError, match=message):
            change()
    assert seed_of(mine) == 1


@pytest.mark.parametrize(
    ("new", "message"),
    [
        ("arms", "there is a corpus 'arms' already"),
        ("legs", "there is a corpus 'legs' already; corpus delete legs removes it"),
        ("ballet", "'ballet' is the name of a bundled corpus"),
        ("a/b", "cannot be a corpus's name"),
    ],
)
def test_a_new_name_is_free(mine: Path, new: str, message: str) -> None:
    saved(mine)
    saved(mine.with_name("legs"))
    with pytest.raises(CorpusError, match=message):
        store.rename("arms", new, mine.parents[1])
    assert sorted(own(mine)) == ["arms", "legs"]


def test_a_folder_with_files_of_the_users_is_left_alone(mine: Path) -> None:
    saved(mine)
    (mine / "diary.txt").write_text("dear diary")
    there = names(mine)
    for change in (
        lambda: store.delete("arms", mine.parents[1]),
        lambda: store.rename("arms", "legs", mine.parents[1]),
    ):
        with pytest.raises(CorpusError, match=r"arms: holds diary\.txt, which is no part of a built corpus"):
            change()
    assert names(mine) == there
