"""The commands that explain a tween and draw the graph of a joint."""

from __future__ import annotations

import json
from pathlib import Path

import click

from motionmind.cli import completion
from motionmind.cli.files import check_outputs
from motionmind.cli.options import CORPUS, HOME, JSON, Section, command, option, output
from motionmind.cli.printing import count
from motionmind.cli.types import FILE
from motionmind.display import displayed, displayed_path, printable


@command("motionmind explain report.json")
@click.argument("report", type=FILE)
@option(
    "--all", "everything", section=Section.OUTPUT, is_flag=True, help="Print every joint, with its likelihood and cost."
)
@JSON
def explain(report: Path, everything: bool, as_json: bool) -> None:
    """Explain a tween, move by move.

    For each move: the body parts that turn farthest, their new states or directions, and the source in the corpus.
    REPORT is a file from tween --report; if the tween found no path, the command prints the reason.
    """
    import msgspec

    from motionmind.tween.narrative import explain
    from motionmind.tween.report import NoPathReport, read_any_report

    found = read_any_report(report)
    if isinstance(found, NoPathReport):
        click.echo(json.dumps(msgspec.to_builtins(found)) if as_json else printable(found.message))
        return
    explanation = explain(found)
    if as_json:
        click.echo(json.dumps(explanation.plain()))
    else:
        click.echo(explanation.details() if everything else str(explanation))


@command("motionmind graph --corpus ballet --joint left_shoulder -o graph.svg")
@CORPUS
@option(
    "--joint",
    section=Section.PART,
    required=True,
    metavar="NAME",
    shell_complete=completion.joints,
    help="Joint whose graph to draw, or facing, if it has states of its own.",
)
@output("Picture (.svg, .png) or data (.graphml, .gexf) of the graph.")
@HOME
def graph(corpus: str, joint: str, output: Path, home: Path | None) -> None:
    """Draw a joint's states in a corpus and the transitions between them.

    A larger circle marks a more frequent state, a darker arrow a likelier transition. In .svg, point at a state for
    more, such as the states of the joint's parent that occur with it. Pictures leave out isolated states.
    """
    from motionmind.plots.joint_graph import GRAPHS, draw_joint_graph
    from motionmind.tween.engine import Engine

    check_outputs([(output, GRAPHS)], [])
    drawn = draw_joint_graph(output, Engine.load(corpus, home), joint)
    alone = sum(not any(other != state for other in (*drawn.succ[state], *drawn.pred[state])) for state in drawn)
    click.echo(
        f"{displayed_path(output)}: {displayed(joint)}, {count(len(drawn), 'state')}, "
        f"{count(drawn.number_of_edges(), 'transition')}; {count(alone, 'isolated state')}"
    )
