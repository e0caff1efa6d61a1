"""The commands that look into what was found and what was learned."""

from __future__ import annotations

import json
from pathlib import Path

import click

from motionmind.cli.commands import app
from motionmind.cli.files import check_outputs
from motionmind.cli.options import FILE, HOME, JSON, example


@app.command(epilog=example("motionmind explain report.json"))
@click.argument("report", type=FILE)
@JSON
def explain(report: Path, as_json: bool) -> None:
    """Tell a tween move by move: which joints move, how likely that is, where it was seen.

    REPORT is what tween --report wrote.
    """
    from motionmind.tween.narrative import explain, lines, plain, read_report

    found = explain(read_report(report))
    if as_json:
        click.echo(json.dumps(plain(found)))
        return
    for line in lines(found):
        click.echo(line)


@app.command(epilog=example("motionmind graph --corpus ballet --joint left_shoulder -o graph.svg"))
@click.option("--corpus", required=True, metavar="NAME", help="Corpus, by name or folder.")
@click.option("--joint", required=True, metavar="NAME", help="Whose graph; or facing, where that moves on its own.")
@click.option(
    "-o", "--output", type=FILE, required=True, help="Where it goes: a picture (.svg, .png), or .graphml, .gexf."
)
@HOME
def graph(corpus: str, joint: str, output: Path, home: Path | None) -> None:
    """Draw what a corpus teaches of a joint: its states, and which follows which how likely.

    Circles are the larger the more often they are visited, arrows the darker the likelier. In .svg the pointer tells
    more, such as which states of the joint's parent go with a state. States that no move leads to or from are left out
    of pictures.
    """
    from motionmind.plots.joint_graph import GRAPHS, write_joint_graph
    from motionmind.tween.engine import Engine

    check_outputs([(output, GRAPHS)], [])
    drawn = write_joint_graph(output, Engine.load(corpus, home), joint)
    alone = sum(not any(other != state for other in (*drawn.succ[state], *drawn.pred[state])) for state in drawn)
    click.echo(
        f"{output}: {joint}, {len(drawn)} states, {drawn.number_of_edges()} transitions; "
        f"{alone} states that none joins to another"
    )
