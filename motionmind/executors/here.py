"""Executors on this machine: this process, its threads, and pools of other processes."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

from motionmind.executors.team import N_JOBS_PER_WORKER, Team

_P = ParamSpec("_P")
_T = TypeVar("_T")

# Linear algebra starts a thread for each core in every process, unless these variables are set when it is loaded.
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Here(Executor):
    """An executor that runs each job in this process, on submission."""

    def submit(self, function: Callable[_P, _T], /, *arguments: _P.args, **named: _P.kwargs) -> Future[_T]:
        """Run a job, and return its finished future."""
        future: Future[_T] = Future()
        try:
            future.set_result(function(*arguments, **named))
        except Exception as error:
            future.set_exception(error)
        return future


def this_process() -> Team:
    """Return a team of this process alone, which runs one job at a time."""
    return Team(Here, lambda: 1)


def threads(number: int) -> Team:
    """Return a team of `number` threads of this process, for jobs that run mostly in compiled code."""
    if number == 1:
        return this_process()
    return Team(lambda: ThreadPoolExecutor(number), lambda: N_JOBS_PER_WORKER * number)


@contextmanager
def processes(number: int) -> Iterator[Team]:
    """Open a team of `number` processes; they end with the context, or with this process, even if it is killed."""
    import multiprocessing  # slow to import, and most tweens do not need it
    from concurrent.futures import ProcessPoolExecutor

    before = {name: os.environ.get(name) for name in _THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    pools: list[ProcessPoolExecutor] = []

    def make() -> Executor:
        pool = ProcessPoolExecutor(number, mp_context=multiprocessing.get_context("spawn"), initializer=_begin)
        pools.append(pool)
        return pool

    try:
        yield Team(make, lambda: N_JOBS_PER_WORKER * number)
    finally:
        for pool in pools:
            pool.shutdown(cancel_futures=True)
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin() -> None:
    """Prepare a worker: it ignores Ctrl-C, and ends with its parent, however that ends."""
    import multiprocessing

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    atexit.register(gc.freeze)  # skips the garbage collection at exit, which is slow
    threading.Thread(target=_end_with, args=(multiprocessing.parent_process(),), daemon=True).start()


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)
