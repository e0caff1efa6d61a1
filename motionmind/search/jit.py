"""One door to numba: functions compiled once and kept in a cache beside the code, or where one can be written."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

import platformdirs

_F = TypeVar("_F", bound=Callable[..., object])


def _cache_somewhere() -> None:
    """Point numba at a folder that can be written, where neither the code's own nor the user's cache can be."""
    beside, own = Path(__file__).parent, Path(platformdirs.user_cache_dir("numba"))
    nearest = next(folder for folder in (own, *own.parents) if folder.exists())
    if "NUMBA_CACHE_DIR" not in os.environ and not (os.access(beside, os.W_OK) or os.access(nearest, os.W_OK)):
        os.environ["NUMBA_CACHE_DIR"] = str(Path(tempfile.gettempdir()) / f"motionmind-numba-{os.getuid()}")


_cache_somewhere()

import numba  # noqa: E402  (it reads the variable set above when it is imported)


def jit(function: _F) -> _F:
    """Compile `function` to machine code on its first call; arithmetic as written, so the same bytes every time."""
    return cast(_F, numba.njit(cache=True, error_model="numpy")(function))
