"""The result of a command line that a test runs."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NamedTuple


class Ran(NamedTuple):
    """The exit code of a command, and what it printed to standard output and standard error."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The values in the JSON that was printed."""
        return json.loads(self.out)


Run = Callable[..., Ran]
