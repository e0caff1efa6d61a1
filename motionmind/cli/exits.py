"""Exit codes of the program."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes other than 0."""

    BAD_INPUT = 2  # every error that the user can correct
    NO_PATH = 3  # nothing joins A and B
    INTERRUPTED = 130  # Ctrl-C, as in shells
