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

from motionmind import jit as door

DAY = 86400.0  # seconds


def state(folder: Path) -> Path | None:
    """Where code of a folder is kept, as a new process would find it."""
    return door._folder.__wrapped__(folder)


def test_a_source_that_changes_has_all_of_its_folder_compiled_anew_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    one, other = tmp_path / "one", tmp_path / "other"
    for folder in (one, other):
        folder.mkdir()
        for name in ("loops.py", "helpers.py"):
            (folder / name).write_text("")
    before = state(one), state(other)
    assert before[0] != before[1]
    assert before == (state(one), state(other))
    os.utime(one / "helpers.py", ns=(1, 1))
    assert state(one) != before[0]
    assert state(other) == before[1]


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
    run = "import numpy as np; from motionmind.render.figure import halved; halved(np.zeros((2, 2, 3), np.uint8))"
    subprocess.run([sys.executable, "-c", run], check=True)
    assert door.compiled_names() == {"render/raster.halved"}
    assert not door.is_all_compiled()
    door.note_all_compiled()
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
    monkeypatch.setattr(door, "_folders", lambda: [*folders[:-1], folders[-1].with_name(f"{folders[-1].name[:-1]}x")])
    assert not door.is_all_compiled()


def test_what_was_not_used_for_a_month_is_removed_when_something_else_is_compiled(place: Path) -> None:
    def made(name: str, days: float) -> Path:
        found = place / name
        found.mkdir(parents=True)
        (found / "code.nbc").write_bytes(b"code")
        os.utime(found, (time.time() - days * DAY,) * 2)
        return found

    old, recent = made(f"search-{1:016x}", 31.0), made(f"search-{2:016x}", 29.0)
    others = made("search-of-somebody-else", 400.0)
    (place / f"all-{1:024x}").touch()
    os.utime(place / f"all-{1:024x}", (0.0, 0.0))
    mine = door._folder(Path(door.__file__).parent / "search")
    assert mine is not None
    assert (old.exists(), recent.exists(), others.exists()) == (False, True, True)
    assert not list(place.glob("all-*"))

    # What is used stays, however old it is.
    (mine / "code.nbc").write_bytes(b"code")
    os.utime(mine, (0.0, 0.0))
    door._folder.cache_clear()
    assert door._folder(Path(door.__file__).parent / "search") == mine
    assert door._folder(Path(door.__file__).parent / "render") is not None
    assert (mine / "code.nbc").exists()


@pytest.mark.usefixtures("place")
def test_what_was_kept_is_called_from_what_is_compiled_later() -> None:
    def doubled(x: float) -> float:
        return 2.0 * x

    assert door.jit(doubled)(4.0) == 8.0
    kept: Any = door.jit(doubled)
    assert kept(4.0) == 8.0
    assert sum(kept.stats.cache_hits.values()) == 1
    assert door.jit(lambda x: kept(x) + 1.0)(4.0) == 9.0


@door.jit
def applied(function: object, times: int) -> float:
    value = 1.0
    for _ in range(times):
        value = function(value)  # type: ignore[operator]
    return value


@door.either
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
        assert applied(door.pointer(function, number(number), keep=False), 5) == expected
    assert len(applied.signatures) == 1  # type: ignore[attr-defined]


def test_what_cannot_be_compiled_is_no_pointer() -> None:
    from numba import types
    from numba.core.errors import NumbaError

    with pytest.raises(NumbaError):
        door.pointer(lambda x: {"x": x}, types.float64(types.float64), keep=False)
