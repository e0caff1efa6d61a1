"""Faults to inject."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any


def failing_at(number: int, call: Callable[..., Any], error: BaseException) -> Callable[..., Any]:
    """A call that raises an error the n-th time, and works before and after."""
    calls = count(1)

    def instead(*arguments: Any, **named: Any) -> Any:
        if next(calls) == number:
            raise error
        return call(*arguments, **named)

    return instead
