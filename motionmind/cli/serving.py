"""The serve command: serve movement to other programs."""

from __future__ import annotations

from pathlib import Path

import click

from motionmind.cli import completion
from motionmind.cli.listening import address_of, listen
from motionmind.cli.options import HOME, Section, command, option
from motionmind.cli.printing import note
from motionmind.cli.types import PORT
from motionmind.cli.warming import prepare
from motionmind.display import displayed
from motionmind.errors import MotionMindError


@command("motionmind serve --corpus ballet")
@option(
    "--corpus",
    section=Section.CORPORA,
    metavar="NAME",
    default="ballet",
    shell_complete=completion.corpora,
    help="Corpus to use, by name or folder.",
)
@option(
    "--host",
    section=Section.OUTPUT,
    default="127.0.0.1",
    metavar="ADDRESS",
    help="Address to listen on; other computers can connect unless it is this computer's own.",
)
@option("--port", section=Section.OUTPUT, type=PORT, metavar="N", default=8000, help="Port to listen on.")
@HOME
def serve(corpus: str, host: str, port: int, home: Path | None) -> None:
    """Serve movement in the style of a corpus to animation programs, until Ctrl-C.

    A program sends a skeleton, poses at frames, waypoints and pins, and receives the movement between them, with a
    certificate for each stretch. The protocol is MMCP, which Blender speaks with the add-on Proscenium. Requires an
    extra: pip install "motionmind[mmcp]".
    """
    try:
        import uvicorn

        from motionmind.connections import config
        from motionmind.serve.guard import Guard
        from motionmind.serve.mmcp import app
    except ImportError as error:
        raise MotionMindError(f'MMCP needs an extra: pip install "motionmind[mmcp]" ({error})') from None
    from motionmind.tween.engine import Engine

    engine = Engine.load(corpus, home)
    prepare()
    with listen(host, port) as listening:
        url, is_open = address_of(listening)
        if is_open:
            note(f"no password: anyone who can reach {url.removeprefix('http://')} can request movement")
        click.echo(f"serving {displayed(engine.corpus.name)} at {url} (Ctrl-C ends)")
        uvicorn.Server(config(Guard(app(engine), host))).run(sockets=[listening])
