"""Jobs for workers, in a module that imports little: each worker imports it, and not the tests."""

from __future__ import annotations

import os
import time
from pathlib import Path


def square(number: int) -> int:
    if number < 0:
        raise ValueError(f"no root of {number}")
    return number * number


def die_once(marks: Path, number: int) -> int:
    """End the worker with every third job, the first time."""
    mark = marks / str(number)
    if number % 3 == 1 and not mark.exists():
        mark.touch()
        os._exit(1)
    return number


def die(number: int) -> int:
    if number == 2:
        os._exit(1)
    return number


def doze(number: int) -> int:
    time.sleep(0.2)
    return number
