"""One door to numba: functions are compiled once and kept on disk, for the very sources they were compiled from."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs
from numba.extending import register_jitable

_F = TypeVar("_F", bound=Callable[..., object])
config: Any = numba.config


def jit(function: _F) -> _F:
    """Compile `function` to machine code on its first call; arithmetic as written, so the same bytes every time.

    It may call other compiled functions of its own folder and of `geometry`, and runs beside other threads.
    """
    theirs = config.CACHE_DIR  # read when a function is decorated; nobody else's functions are to move
    config.CACHE_DIR = _folder(Path(function.__code__.co_filename).parent)
    try:
        return cast(_F, numba.njit(cache=True, error_model="numpy", nogil=True)(function))
    finally:
        config.CACHE_DIR = theirs


def either(function: _F) -> _F:
    """A function for compiled code to call, and for Python, where nothing is compiled."""
    registered: _F = register_jitable(function)
    return registered


def pointer(function: Callable[..., object], signature: Any, *, keep: bool) -> Any:
    """`function` compiled for numba's `signature` alone, and told by its address: one compiled loop serves all such.

    A loop that is given a function of `jit` would be compiled for it anew in every process. An exception inside is
    lost. `keep` stores it on disk: for functions of this package, which may be closures over others and over values.

    Raises:
        numba.core.errors.NumbaError: it cannot be compiled.
    """
    theirs = config.CACHE_DIR
    config.CACHE_DIR = _folder(Path(function.__code__.co_filename).parent) if keep else theirs
    try:
        return numba.cfunc(signature, cache=keep, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = theirs


def is_compiled(package: str) -> bool:
    """Whether compiled code of a package of this one, as "search", is on disk; that takes the search half a minute."""
    source = Path(__file__).parent / package
    return next(Path(_folder(source)).glob(f"{source.name}_*/*.nbi"), None) is not None


@cache
def _folder(source: Path) -> str:
    """Where compiled code is kept: a folder named after the state of all sources in `source` and in `geometry`.

    numba's own cache looks only at the file that a function is in: of a function that calls into another file it would
    go on using the old code after that file changed. It is in the user's cache directory, or where that cannot be
    written in the system's for temporary files, as a folder that nobody else may write to.
    """
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return given
    here = Path(__file__)
    files = [here, *sorted(here.parent.glob("geometry/*.py")), *sorted(source.glob("*.py"))]
    state = hashlib.sha256(repr([(str(file), file.stat().st_mtime_ns) for file in files]).encode()).hexdigest()[:16]
    own = Path(platformdirs.user_cache_dir("motionmind", appauthor=False))
    nearest = next(folder for folder in (own, *own.parents) if folder.exists())
    return str((own if os.access(nearest, os.W_OK) else _temporary()) / "compiled" / state)


@cache
def _temporary() -> Path:
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"motionmind-{user}"
    folder.mkdir(mode=0o700, exist_ok=True)
    owned = folder.stat().st_uid in (user, 0) and not folder.is_symlink()
    return folder if owned else Path(tempfile.mkdtemp(prefix="motionmind-"))
