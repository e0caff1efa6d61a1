"""The command that says whose movement a movement is made of."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from motionmind.cli import completion
from motionmind.cli.options import HOME, JSON, command
from motionmind.cli.printing import note
from motionmind.cli.sources import parse_movement, read_movement

_FORMATS_WITH_CREDITS = (".json", ".glb")  # formats in which movement keeps its credits

if TYPE_CHECKING:
    from motionmind.credits.ledger import Ledger


@command("motionmind credits tween.json")
@click.argument("source", shell_complete=completion.movement)
@JSON
@HOME
def credits(source: str, as_json: bool, home: Path | None) -> None:  # noqa: A001 (the command's name)
    """Say whose movement a movement is made of: shares by performer, licence, corpus and clip.

    SOURCE is a tween, a variation or any other movement that the engine had a part in, or that was taken from a corpus,
    as .json or .glb, or the report of one; or a clip of a corpus. Shares are of time, over all joints. What no clip
    attests is the engine's.
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
    """Return the ledger of a report, or of a movement."""
    from motionmind.credits.ledger import ledger_of, read_ledger

    named = parse_movement(source, home)
    if named.source.kind == "file" and (ledger := read_ledger(Path(named.source.place))) is not None:
        return ledger
    reading = {"unit": None, "asf": None, "source_fps": None, "up": None}
    credited = read_movement(named.source, None, home, raw=True, **reading).credits
    suffix = Path(named.source.place).suffix.lower()
    if suffix not in _FORMATS_WITH_CREDITS and all(credit.is_given for credit in credited):
        note(f"{source}: {suffix} holds no credits; if the engine made it, name its .json, its .glb or its report")
    return ledger_of(credited)
