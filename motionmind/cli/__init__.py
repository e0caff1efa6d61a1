"""The command line."""

from __future__ import annotations

import gc
import logging
import sys
import warnings
from collections.abc import Sequence

import click

import motionmind.cli.corpora
import motionmind.cli.looks
import motionmind.cli.measures
import motionmind.cli.pictures
import motionmind.cli.scores
import motionmind.cli.variations  # noqa: F401 (each adds its commands)
from motionmind.cli.commands import INTERRUPTED, app
from motionmind.cli.printing import Notes, say
from motionmind.errors import MotionMindError, MotionMindWarning, NoPathError

__all__ = ["app", "main"]

BAD_INPUT = 2  # exit code for everything that the user can put right
NO_PATH = 3  # where nothing joins A and B


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 2 for bad input, in one line; 3 where there is no path, with the diagnosis."""
    log, notes = logging.getLogger("motionmind"), Notes(logging.INFO)
    log.addHandler(notes)
    log.setLevel(logging.INFO)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", MotionMindWarning)
            warnings.showwarning = say
            sys.exit(_run(arguments))
    finally:
        log.removeHandler(notes)
        gc.enable()


def _run(arguments: Sequence[str] | None) -> int:
    """The exit code of the command line; what was wrong goes to standard error."""
    code = BAD_INPUT
    try:
        return int(app.main(arguments, prog_name="motionmind", standalone_mode=False) or 0)
    except click.Abort:  # Ctrl-C
        return INTERRUPTED
    except click.UsageError as error:
        message = error.format_message() + (f" ({error.ctx.command_path} --help shows how)" if error.ctx else "")
    except NoPathError as error:
        message, code = str(error), NO_PATH
    except MotionMindError as error:
        message = str(error)
    except OSError as error:  # of standard output: files are written by those who catch theirs
        message = f"cannot write: {error.strerror or error}"
    except MemoryError:
        message = "not enough memory for this"
    click.echo(f"error: {message}", err=True)
    return code
