"""The one place that uses numba: functions are compiled once, and kept on disk for the exact sources they came from."""

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
    theirs = config.CACHE_DIR  # numba reads it when a function is decorated; other packages' functions stay put
    config.CACHE_DIR = _folder(Path(function.__code__.co_filename).parent)
    try:
        return cast(_F, numba.njit(cache=True, error_model="numpy", nogil=True)(function))
    finally:
        config.CACHE_DIR = theirs


def either(function: _F) -> _F:
    """Return `function` for calls from compiled code, where it is compiled, and from Python, where it is not."""
    registered: _F = register_jitable(function)
    return registered


def pointer(function: Callable[..., object], signature: Any, *, keep: bool) -> Any:
    """Compile `function` for one signature, to be passed by address: one compiled loop serves all such functions.

    A loop that is passed a function of `jit` would be compiled for it anew in every process. Exceptions raised inside
    are lost.

    Args:
        function: a function, which may be a closure over others and over values.
        signature: numba's signature of it.
        keep: whether to store it on disk, as for functions of this package.

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
    """Return whether compiled code of a subpackage such as "search" is on disk; the search takes half a minute."""
    source = Path(__file__).parent / package
    return next(Path(_folder(source)).glob(f"{source.name}_*/*.nbi"), None) is not None


@cache
def _folder(source: Path) -> str:
    """Return the folder of compiled code, named after the state of all sources in `source` and in `geometry`.

    numba's own cache looks only at the file that a function is in: after a change to another file that the function
    calls into, it would go on using the old code. The folder is in the user's cache directory or, if that cannot be
    written, in the system's temporary one, where nobody else may write to it.
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
