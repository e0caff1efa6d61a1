"""The one place that uses numba: functions are compiled once, and kept on disk for the exact sources they came from."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import bytecode, ccallback, sigutils
from numba.extending import register_jitable

from motionmind.codecache import Kept

_F = TypeVar("_F", bound=Callable[..., object])
_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])
# Of numba's core, which is not typed.
_normalise: Any = sigutils.normalize_signature
_CFunc: Any = ccallback.CFunc
_bytecode: Any = bytecode


class _Numbers:
    """The numbers by which numba tells functions of one name and signature apart, as the loops of sort and of argsort.

    numba counts from 1 in each process. But code that several have compiled comes together in one, where the linker
    takes the first function of a name for all of them: another one is called, or the process crashes. So numbers are
    drawn at random, and are not those of any other process, nor of one that was forked.
    """

    def __next__(self) -> int:
        return int.from_bytes(os.urandom(8), "big")


_bytecode.FunctionIdentity._unique_ids = _Numbers()


def jit(function: _F) -> _F:
    """Compile `function` to machine code on its first call; arithmetic as written, so the same bytes every time.

    It may call other compiled functions that its module imports, and runs beside other threads.
    """
    compiled: Any = numba.njit(error_model="numpy", nogil=True)(function)
    compiled._cache = Kept(function)
    return cast(_F, compiled)


def either(function: _F) -> _F:
    """Return `function` for calls from compiled code, where it is compiled, and from Python, where it is not."""
    registered: _F = register_jitable(function)
    return registered


def read_only(array: _Array) -> _Array:
    """Return a view of an array that cannot be written to, as the arrays of a corpus that was loaded.

    For arrays that can be written to, a loop would be compiled once more.
    """
    view = array.view()
    view.setflags(write=False)
    return view


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
    compiled = _CFunc(function, _normalise(signature), locals={}, options={"error_model": "numpy"})
    if keep:
        compiled._cache = Kept(function)
    compiled.compile()
    return compiled
