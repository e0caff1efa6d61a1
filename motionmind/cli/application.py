"""The program: its commands, and how it reports errors."""

from __future__ import annotations

import atexit
import gc
import logging
import sys
import warnings
from collections.abc import Sequence

import click

from motionmind.cli.catalogue import postures
from motionmind.cli.cleaning import clean
from motionmind.cli.conversion import convert, posture
from motionmind.cli.corpora import corpora
from motionmind.cli.credits import credits as credit
from motionmind.cli.exits import ExitCode
from motionmind.cli.gaps import gaps
from motionmind.cli.laban import laban
from motionmind.cli.looks import explain, graph
from motionmind.cli.loops import loop
from motionmind.cli.measures import measure
from motionmind.cli.options import group, show_help_without_command
from motionmind.cli.pictures import render, sheet
from motionmind.cli.plans import plan
from motionmind.cli.printing import Notes, Warned
from motionmind.cli.restyles import restyle
from motionmind.cli.reviews import review
from motionmind.cli.scores import compose, library
from motionmind.cli.serving import serve
from motionmind.cli.shells import completion
from motionmind.cli.streams import forgiving
from motionmind.cli.studio import studio
from motionmind.cli.transcriptions import transcribe
from motionmind.cli.tweens import tween
from motionmind.cli.variations import attractor, vary
from motionmind.cli.warming import warm
from motionmind.display import printable
from motionmind.errors import MotionMindError, MotionMindWarning, NoPathError
from motionmind.files import pipes_kept

atexit.register(gc.freeze)  # spares the garbage collection at exit: 0.2 s


@group(
    "motionmind tween ballet/arabesque ballet/fifth -o tween.bvh",
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
)
@click.version_option(package_name="motionmind", message="%(prog)s %(version)s")
@click.pass_context
def app(context: click.Context) -> None:
    """Find movement between two postures in the style of a corpus, with proven bounds on its cost."""
    show_help_without_command(context)


for _command in (
    *(tween, postures, posture, convert, clean, loop, corpora, explain, credit, graph, measure, sheet, render, plan),
    *(compose, transcribe, restyle, laban, library, vary, review, attractor, studio, serve, warm, completion),
):
    app.add_command(_command)
corpora.add_command(gaps)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    Bad input prints one line, and a missing path its diagnosis; `ExitCode` lists the exit codes.

    Args:
        arguments: the arguments of the program; `sys.argv[1:]` by default.
    """
    log, notes = logging.getLogger("motionmind"), Notes(logging.INFO)
    level = log.level
    log.addHandler(notes)
    log.setLevel(logging.INFO)
    try:
        with forgiving(), pipes_kept(), warnings.catch_warnings():
            warnings.simplefilter("always", MotionMindWarning)
            warned = Warned()
            warnings.showwarning = warned.show
            sys.exit(_run(arguments, warned))
    finally:
        log.removeHandler(notes)
        notes.close()
        log.setLevel(level)
        gc.enable()


def _run(arguments: Sequence[str] | None, warned: Warned) -> int:
    """Run a command, print its error if any, and return the exit code."""
    code = ExitCode.BAD_INPUT
    try:
        try:
            return int(app.main(arguments, prog_name="motionmind", standalone_mode=False) or 0)
        finally:
            warned.finish()
    except click.Abort:  # Ctrl-C
        return ExitCode.INTERRUPTED
    except click.UsageError as error:
        help_hint = f" ({error.ctx.command_path} --help shows how)" if error.ctx else ""
        message = " ".join(error.format_message().split()) + help_hint
    except NoPathError as error:
        message, code = str(error), ExitCode.NO_PATH
    except MotionMindError as error:
        message = str(error)
    except OSError as error:  # of standard output: functions that write files catch theirs
        message = f"cannot write: {error.strerror or error}"
    except UnicodeError:
        message = "a name or a text is not UTF-8, and cannot be written to a file"
    except MemoryError:
        message = "not enough memory"
    click.echo(f"error: {printable(message)}", err=True)
    return code
