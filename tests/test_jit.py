"""Compiled code is kept for the sources that it was compiled from, and for no others."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from motionmind import jit as door


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


def test_compiled_code_is_known_to_be_there_once_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    door._folder.cache_clear()
    try:
        assert not door.is_compiled("render")
        run = "import numpy as np; from motionmind.render.figure import halved; halved(np.zeros((2, 2, 3), np.uint8))"
        subprocess.run([sys.executable, "-c", run], check=True)
        assert door.is_compiled("render")
        assert not door.is_compiled("search")
    finally:
        door._folder.cache_clear()


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
