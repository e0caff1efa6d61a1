"""A worker process: how it starts, and its loop, which runs one job after another and caches engines."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections import OrderedDict
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.tween.engine import Engine

MAX_ENGINES = 2  # that a process keeps loaded

_home: Path | None = None
_engines: OrderedDict[tuple[str, int, int], Engine] = OrderedDict()


def engine_of(name: str) -> Engine:
    """Return the engine of a corpus in this worker, loaded on first use and after a rebuild.

    Raises:
        MotionMindError: there is no such corpus.
    """
    from motionmind.corpus import store
    from motionmind.tween.engine import Engine

    status = (store.locate(name, _home) / store.MANIFEST).stat()
    known = name, status.st_ino, status.st_mtime_ns
    if known not in _engines:
        _engines[known] = Engine.load(name, _home)
        while len(_engines) > MAX_ENGINES:
            _engines.popitem(last=False)
    _engines.move_to_end(known)
    return _engines[known]


def work(connection: Connection, home: Path | None, warm: str) -> None:
    """Run jobs until the server ends."""
    global _home  # noqa: PLW0603 - a worker has one
    _home = home
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server handles Ctrl-C
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    _send(connection, ("begun",))
    with suppress(Exception):  # the job that needs it reports the error
        if warm:
            engine_of(warm)

    def report(done: int, of: int, words: str = "", partial: Any = None) -> None:
        _send(connection, ("report", done, of, words, partial))

    while True:
        try:
            function, arguments = connection.recv()
        except (EOFError, OSError):
            return
        try:
            answer = "done", function(report, *arguments)
        except Exception as error:
            answer = "failed", words_of(error)
        try:
            _send(connection, answer)
        except Exception as error:  # an answer that does not fit into memory
            _send(connection, ("failed", words_of(error)))


def _send(connection: Connection, message: tuple[Any, ...]) -> None:
    """Send a message to the server; end this process if the server has ended."""
    try:
        connection.send(message)
    except OSError:
        os._exit(0)


def _end_with(parent: Any) -> None:
    """End this process when its parent ends."""
    parent.join()
    os._exit(0)


def words_of(error: Exception) -> str:
    """Return an error as a line; print an unexpected one on the terminal."""
    if isinstance(error, MotionMindError):
        return str(error)
    if isinstance(error, MemoryError):
        return "not enough memory"
    traceback.print_exception(error, file=sys.stderr)
    return "internal error: see the terminal"


def process_context() -> Any:
    """Return how processes start: forked from a preloaded process on Linux, or else spawned."""
    if sys.platform != "linux":  # on other systems, system libraries may not survive a fork
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["motionmind.studio.preloaded"])
    return context


def room_for_workers() -> int:
    """Return the number of workers: two need two processors and 1 GiB of free memory, and take a fifth of it."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_AVPHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        memory = 0
    return 2 if processors >= 2 and memory >= 2**30 else 1
