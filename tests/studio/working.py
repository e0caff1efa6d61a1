"""Work for workers: module-level functions, as jobs are."""

from __future__ import annotations

import os
import time
from typing import Any

from motionmind.errors import MotionMindError
from motionmind.studio.worker_loop import engine_of


def add(report: Any, one: int, other: int) -> int:
    """Add two numbers, telling of each."""
    report(1, 2, "the first", one)
    report(2, 2, "the second", other)
    return one + other


def sleep(report: Any, seconds: float) -> int:
    """Sleep, and return the process's number."""
    report(0, 1, f"in {os.getpid()}")
    time.sleep(seconds)
    return os.getpid()


def refuse(_: Any) -> None:
    """Refuse."""
    raise MotionMindError("this cannot be")


def crash(_: Any) -> None:
    """Fail in a way that nobody foresaw."""
    raise ZeroDivisionError


def die(_: Any) -> None:
    """End the process."""
    os._exit(1)


def know(_: Any, corpus: str) -> tuple[int, int, int]:
    """Return how much a corpus has, which process knows, and which of its engines."""
    return len(engine_of(corpus).corpus), os.getpid(), id(engine_of(corpus))


def answer_with_a_function(_: Any) -> Any:
    """Return what cannot be sent to another process."""
    return lambda: 0
