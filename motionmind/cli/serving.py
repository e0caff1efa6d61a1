"""The serve command: serve movement to other programs."""

from __future__ import annotations

from pathlib import Path

import click

from motionmind.cli.listening import address_of, listen
from motionmind.cli.options import CORPUS, HOME, Section, command, option
from motionmind.cli.printing import note
from motionmind.cli.types import PORT
from motionmind.cli.warming import prepare
from motionmind.display import displayed
from motionmind.errors import MotionMindError

_KEEP_ALIVE_S = 5


@command("motionmind serve --mmcp --corpus ballet")
@option(
    "--mmcp",
    section=Section.OUTPUT,
    is_flag=True,
    required=True,
    help="Use MMCP, the protocol of animation programs such as Blender with Proscenium.",
)
@CORPUS
@option(
    "--host",
    section=Section.OUTPUT,
    default="127.0.0.1",
    metavar="ADDRESS",
    help="Address to listen on; other computers can connect unless it is this computer's own.",
)
@option("--port", section=Section.OUTPUT, type=PORT, metavar="N", default=8000, help="Port to listen on.")
@HOME
def serve(mmcp: bool, corpus: str, host: str, port: int, home: Path | None) -> None:
    """Serve movement in the style of a corpus to animation programs, until Ctrl-C.

    A program sends a skeleton, poses at frames, waypoints and pins, and receives the movement between them, with a
    certificate for each stretch. Requires an extra: pip install "motionmind[mmcp]".
    """
    if not mmcp:
        raise click.UsageError("Missing option '--mmcp': there is no other protocol.", click.get_current_context())
    try:
        import uvicorn

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
        config = uvicorn.Config(
            Guard(app(engine), host),
            log_level="error",
            access_log=False,
            ws="none",
            server_header=False,
            limit_concurrency=16,
            timeout_keep_alive=_KEEP_ALIVE_S,
            timeout_graceful_shutdown=_KEEP_ALIVE_S,
        )
        uvicorn.Server(config).run(sockets=[listening])
