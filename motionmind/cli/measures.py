"""The measure command: compare movement with a corpus."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.options import CORPUS, HOME, JSON, Section, command, option, reading
from motionmind.cli.printing import count
from motionmind.cli.sources import parse_movement, read_part
from motionmind.cli.types import FILE
from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.metrics.figures import Figure


@command("motionmind measure tween.json --corpus ballet")
@click.argument("source", shell_complete=completion.movement)
@CORPUS
@option(
    "--report",
    section=Section.INPUT,
    type=FILE,
    help="Report of SOURCE from tween --report: measure the states of its path instead of the motion's.",
)
@option("--all", "everything", section=Section.OUTPUT, is_flag=True, help="Print all figures, not the main ten.")
@JSON
@reading
@HOME
def measure(
    source: str,
    corpus: str,
    report: Path | None,
    everything: bool,
    as_json: bool,
    home: Path | None,
    **options: Any,
) -> None:
    """Measure movement, and compare it with a corpus.

    SOURCE is any movement: a tween, a recording, CORPUS/CLIP or SCORE/CLIP. The command prints the ten figures that a
    viewer notices most; --all and --json print all. Dynamics are measured at 30 frames per second, vocabulary in the
    corpus's states. The usual range runs from the 5th to the 95th percentile of the corpus's clips, cut to the length
    of SOURCE, or to a tenth of the corpus.
    """
    import msgspec
    import numpy as np

    from motionmind.metrics.figures import MAIN_FIGURES, MeasureReport, measure
    from motionmind.tween.engine import Engine
    from motionmind.tween.report import read_report

    motion = read_part(parse_movement(source, home), home, **options)
    engine = Engine.load(corpus, home)
    path = None
    if report is not None:
        tween = read_report(report)
        if tuple(tween.joints) != engine.corpus.chains:
            raise MotionMindError(f"{report}: not a tween of {corpus}, which has other joints")
        path = np.array(tween.path, dtype=np.int32)
        if np.any(path < 0) or np.any(path >= engine.space.sizes):
            raise MotionMindError(f"{report}: not a tween of {corpus}, which lacks its states")
    found = measure(motion, engine, path)
    if as_json:
        click.echo(json.dumps(msgspec.to_builtins(MeasureReport.of(engine.corpus.name, len(motion), found))))
        return
    seconds = motion.times[-1] - motion.times[0]
    click.echo(
        f"{displayed_path(source)}: {count(len(motion), 'frame')} in {seconds:.2f} s, "
        f"compared with {displayed(engine.corpus.name)}"
    )
    names = [name for name in found if everything or name in MAIN_FIGURES]
    rows = [("", "value", "", "usual in corpus", "")] + [_cells(name, found[name]) for name in names]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        click.echo("  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def _cells(name: str, figure: Figure) -> tuple[str, ...]:
    """Return the cells of a figure's row: name, value, comparison with the usual range, the range, and meaning."""
    is_known = not math.isnan(figure.value)
    value, low, high = (float(f"{number:.3g}") for number in (figure.value, figure.low, figure.high))
    place = "below" if value < low else "above" if value > high else ""
    shown = f"{value:g} {figure.unit}".rstrip() if is_known else "-"
    usual = "-" if math.isnan(low) or math.isnan(high) else f"{low:g}" if low == high else f"{low:g} to {high:g}"
    return name.replace("_", " "), shown, place, usual, figure.about
