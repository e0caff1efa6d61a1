"""Compiled code is kept for the sources that it was compiled from, and for no others."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from motionmind import codecache as door
from motionmind.jit import either, interpreted, jit, pointer

DAY = 86400.0  # seconds


def state(source: Path) -> Path | None:
    """Where code of a module is kept, as a new process would find it."""
    for cached in (door._text, door._hash, door._imported):
        cached.cache_clear()
    return door._folder.__wrapped__(source)


def test_code_is_compiled_anew_for_the_contents_of_its_module_and_of_what_that_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    names = ("loops", "limits", "plain")
    here, there = tmp_path / "here/motionmind", tmp_path / "there/motionmind"
    for package in (here, there):
        (package / "search").mkdir(parents=True)
        monkeypatch.setattr(door, "_HERE", package)
        (package / "search/limits.py").write_text("MOST = 1\n")
        (package / "search/loops.py").write_text("from motionmind.search.limits import (\n    MOST,\n)\n")
        (package / "search/plain.py").write_text("from motionmind.search import loops\n")

    def states(package: Path) -> list[Path | None]:
        monkeypatch.setattr(door, "_HERE", package)
        return [state(package / f"search/{name}.py") for name in names]

    before = states(here)
    assert len(set(before)) == 3
    os.utime(here / "search/loops.py", ns=(1, 1))
    assert states(here) == states(there) == before  # neither age nor place matters
    (here / "search/plain.py").write_text("from motionmind.search import loops\nx = 1\n")
    assert [one == other for one, other in zip(states(here), before, strict=True)] == [True, True, False]
    (here / "search/limits.py").write_text("MOST = 2\n")
    assert [one == other for one, other in zip(states(here), before, strict=True)] == [False, False, False]


def test_compiled_code_that_others_could_have_written_is_removed_and_another_owners_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    source = Path(door.__file__).parent / "search/astar.py"
    folder = state(source)
    assert folder is not None
    assert folder.parent == tmp_path / "compiled"
    (folder / "f-1.nbc").write_bytes(b"code")
    assert state(source) == folder
    assert (folder / "f-1.nbc").exists()
    folder.parent.chmod(0o777)
    door._make_private.cache_clear()
    assert state(source) == folder
    assert not (folder / "f-1.nbc").exists()
    assert folder.parent.stat().st_mode & 0o777 == 0o700
    if os.getuid() == 0:
        os.chown(folder.parent, 12345, 12345)
        door._make_private.cache_clear()
        monkeypatch.setattr(door, "temporary_folder", lambda: tmp_path / "elsewhere")
        assert state(source) == tmp_path / "elsewhere/compiled" / folder.name


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for compiled code, for this test alone."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    door._folder.cache_clear()
    yield tmp_path / "compiled"
    door._folder.cache_clear()


def test_compiled_code_is_known_to_be_there_once_it_is(place: Path) -> None:
    assert door.compiled_names() == set()
    assert not door.is_all_compiled()
    run = "import numpy as np; from motionmind.geometry.distances import squared_turn; squared_turn(*np.ones((2, 4)))"
    subprocess.run([sys.executable, "-c", run], check=True)
    assert door.compiled_names() == {"geometry/distances.squared_turn"}
    assert not door.is_all_compiled()
    door.note_all_compiled()
    assert door.is_all_compiled()
    noted = set(place.glob("all-*"))
    assert len(noted) == 2  # by contents, and by ages
    door._text.cache_clear()
    assert door.is_all_compiled()
    (file,) = place.rglob("*.nbc")
    file.unlink()
    assert not door.is_all_compiled()


@pytest.mark.usefixtures("place")
def test_what_was_all_for_another_numba_or_other_sources_is_not_all(monkeypatch: pytest.MonkeyPatch) -> None:
    folders = door._folders()
    door.note_all_compiled()
    assert door.is_all_compiled()
    with monkeypatch.context() as patch:
        patch.setattr(door.numba, "__version__", "0.1")
        assert not door.is_all_compiled()
    monkeypatch.setattr(door, "_sources_key", lambda: "other")
    monkeypatch.setattr(door, "_folders", lambda: [*folders[:-1], folders[-1].with_name(f"{folders[-1].name[:-1]}x")])
    assert not door.is_all_compiled()


def test_what_was_not_used_for_a_month_is_removed_when_something_else_is_compiled(place: Path) -> None:
    def made(name: str, days: float) -> Path:
        found = place / name
        found.mkdir(parents=True)
        (found / "code.nbc").write_bytes(b"code")
        os.utime(found, (time.time() - days * DAY,) * 2)
        return found

    old, recent = made(f"search.astar-{1:016x}", 31.0), made(f"search.astar-{2:016x}", 29.0)
    others = made("search-of-somebody-else", 400.0)
    (place / f"all-{1:024x}").touch()
    os.utime(place / f"all-{1:024x}", (0.0, 0.0))
    mine = door._folder(Path(door.__file__).parent / "search/astar.py")
    assert mine is not None
    assert (old.exists(), recent.exists(), others.exists()) == (False, True, True)
    assert not list(place.glob("all-*"))

    # What is used stays, however old it is.
    (mine / "code.nbc").write_bytes(b"code")
    os.utime(mine, (0.0, 0.0))
    door._folder.cache_clear()
    assert door._folder(Path(door.__file__).parent / "search/astar.py") == mine
    assert door._folder(Path(door.__file__).parent / "render/raster.py") is not None
    assert (mine / "code.nbc").exists()


@pytest.mark.usefixtures("place")
def test_what_was_kept_is_called_from_what_is_compiled_later() -> None:
    def doubled(x: float) -> float:
        return 2.0 * x

    assert jit(doubled)(4.0) == 8.0
    kept: Any = jit(doubled)
    assert kept(4.0) == 8.0
    assert sum(kept.stats.cache_hits.values()) == 1
    assert jit(lambda x: kept(x) + 1.0)(4.0) == 9.0


@jit
def applied(function: object, times: int) -> float:
    value = 1.0
    for _ in range(times):
        value = function(value)  # type: ignore[operator]
    return value


@either
def halved(x: float) -> float:
    return 0.5 * x


def test_one_loop_serves_all_pointers_of_a_signature() -> None:
    from numba import types

    number = types.float64
    functions = [lambda x: x + 1.0, lambda x: 3.0 * x, lambda x: halved(x) - 1.0]
    for function in functions:
        expected = 1.0
        for _ in range(5):
            expected = function(expected)
        assert applied(pointer(function, number(number), keep=False), 5) == expected
    assert len(applied.signatures) == 1  # type: ignore[attr-defined]


def test_what_cannot_be_compiled_is_no_pointer() -> None:
    from numba import types
    from numba.core.errors import NumbaError

    with pytest.raises(NumbaError):
        pointer(lambda x: {"x": x}, types.float64(types.float64), keep=False)


@jit
def _tripled(x: float) -> float:
    return 3.0 * x


@jit
def _tripled_and_one(x: float) -> float:
    return _tripled(x) + 1.0


def test_within_the_context_nothing_is_compiled_but_what_is_compiled_is_used() -> None:
    signatures = [_tripled.signatures, _tripled_and_one.signatures]  # type: ignore[attr-defined]
    with interpreted():
        assert _tripled_and_one(2.0) == 7.0
        assert signatures == [[], []]
        with interpreted(False):
            assert _tripled(2.0) == 6.0
        assert len(_tripled.signatures) == 1  # type: ignore[attr-defined]
        assert _tripled_and_one(2.0) == 7.0
        assert _tripled_and_one.signatures == []  # type: ignore[attr-defined]
    assert _tripled_and_one(2.0) == 7.0
    assert len(_tripled_and_one.signatures) == 1  # type: ignore[attr-defined]
