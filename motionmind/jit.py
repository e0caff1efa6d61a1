"""Compile functions with Numba, once for each state of their sources. All of MotionMind uses Numba through it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import bytecode, ccallback, sigutils
from numba.extending import register_jitable

from motionmind.codecache import Kept

_F = TypeVar("_F", bound=Callable[..., object])
_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])
# Numba's core is untyped.
_normalise: Any = sigutils.normalize_signature
_CFunc: Any = ccallback.CFunc
_bytecode: Any = bytecode


class _Numbers:
    """The numbers by which Numba distinguishes functions of one name and signature, as in sort and argsort.

    Numba counts from 1 in each process. But a process also loads code that others compiled, and its linker takes the
    first function of a name for all of them: it calls the wrong one, or crashes. Random numbers differ between
    processes, even forked ones.
    """

    def __next__(self) -> int:
        return int.from_bytes(os.urandom(8), "big")


_bytecode.FunctionIdentity._unique_ids = _Numbers()


def jit(function: _F) -> _F:
    """Compile `function` to machine code on its first call, with arithmetic as written: the same bytes every time.

    It may call other compiled functions that its module imports, and releases the GIL.
    """
    compiled: Any = numba.njit(error_model="numpy", nogil=True)(function)
    compiled._cache = Kept(function)
    compile_for = compiled._compile_for_args

    def callable_for(*args: Any) -> Any:
        return function if _interprets.get() else compile_for(*args)

    compiled._compile_for_args = callable_for  # which Numba asks what to call for arguments of new types
    return cast(_F, compiled)


_interprets: ContextVar[bool] = ContextVar("interprets", default=False)


@contextmanager
def interpreted(is_wanted: bool = True) -> Iterator[None]:
    """Call functions as Python in the context, unless they are compiled by now: a few small calls need no compiler.

    The results are the same bytes.

    Args:
        is_wanted: False for work within such a context that is too long for Python.
    """
    token = _interprets.set(is_wanted)
    try:
        yield
    finally:
        _interprets.reset(token)


def either(function: _F) -> _F:
    """Make `function` callable from compiled code, where it is compiled, and from Python, where it is not."""
    registered: _F = register_jitable(function)
    return registered


def read_only(array: _Array) -> _Array:
    """Return a read-only view of an array, like the arrays of a loaded corpus.

    Numba would compile a function once more for writable arrays.
    """
    view = array.view()
    view.setflags(write=False)
    return view


def pointer(function: Callable[..., object], signature: Any, *, keep: bool) -> Any:
    """Compile `function` for one signature, to pass it by address: one compiled loop serves all such functions.

    Numba would compile a loop that takes a function of `jit` anew in every process. Exceptions inside are lost.

    Args:
        function: a function, which may be a closure over others and over values.
        signature: its signature in Numba.
        keep: whether to cache it on disk, as for functions of this package.

    Raises:
        numba.core.errors.NumbaError: the function cannot be compiled.
    """
    compiled = _CFunc(function, _normalise(signature), locals={}, options={"error_model": "numpy"})
    if keep:
        compiled._cache = Kept(function)
    compiled.compile()
    return compiled
