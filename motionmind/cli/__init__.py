"""The command line: commands that parse, call and print."""

from __future__ import annotations

from motionmind.cli.application import app, main

__all__ = ["app", "main"]
