"""The commands that look into what was found and what was learned."""

from __future__ import annotations

import json
from pathlib import Path

import click

from motionmind.cli.commands import app
from motionmind.cli.options import FILE, JSON, example


@app.command(epilog=example("motionmind explain report.json"))
@click.argument("report", type=FILE)
@JSON
def explain(report: Path, as_json: bool) -> None:
    """Tell a tween move by move: which joints move, how likely that is, where it was seen.

    REPORT is what tween --report wrote.
    """
    from motionmind.explain import explain, lines, plain, read_report

    found = explain(read_report(report))
    if as_json:
        click.echo(json.dumps(plain(found)))
        return
    for line in lines(found):
        click.echo(line)
