"""The credits command: list the sources of a movement."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from motionmind.cli import completion
from motionmind.cli.options import HOME, JSON, command
from motionmind.cli.printing import note
from motionmind.cli.sources import parse_movement, read_movement

if TYPE_CHECKING:
    from motionmind.credits.ledger import Ledger


@command("motionmind credits tween.json")
@click.argument("source", shell_complete=completion.movement)
@JSON
@HOME
def credits(source: str, as_json: bool, home: Path | None) -> None:  # noqa: A001 (the command's name)
    """List the shares of performers, licences, corpora and clips in a movement.

    SOURCE is movement from the engine or from a corpus, as .json or .glb, such as a tween or a variation; its report;
    or a clip of a corpus. Shares are of time, over all joints. Unattested movement is credited to the engine.
    """
    import msgspec

    from motionmind.credits.ledger import lines_of

    ledger = _ledger(source, home)
    if as_json:
        click.echo(json.dumps(msgspec.to_builtins(ledger)))
        return
    for line in lines_of(ledger):
        click.echo(line)


def _ledger(source: str, home: Path | None) -> Ledger:
    """Return the ledger of a report or a movement."""
    from motionmind.credits.ledger import ledger_of, read_ledger

    named = parse_movement(source, home)
    if named.source.kind == "file" and (ledger := read_ledger(Path(named.source.place))) is not None:
        return ledger
    reading = {"unit": None, "asf": None, "source_fps": None, "up": None}
    credited = read_movement(named.source, None, home, raw=True, **reading).credits
    suffix = Path(named.source.place).suffix.lower()
    if suffix not in (".json", ".glb") and all(credit.is_given for credit in credited):
        note(f"{source}: {suffix} files hold no credits; for movement from the engine, give its .json, .glb or report")
    return ledger_of(credited)
