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
    help="Report of SOURCE from tween --report, for its path of states.",
)
@JSON
@reading
@HOME
def measure(
    source: str,
    corpus: str,
    report: Path | None,
    as_json: bool,
    home: Path | None,
    **options: Any,
) -> None:
    """Measure movement, and compare it with a corpus.

    SOURCE is any movement: a tween, a recording, CORPUS/CLIP or SCORE/CLIP. Dynamics are measured at 30 frames per
    second, vocabulary in the corpus's states. The range runs from the 5th to the 95th percentile of the corpus's clips,
    cut to the length of SOURCE, or to a tenth of the corpus; < or > marks values outside it.
    """
    import msgspec
    import numpy as np

    from motionmind.metrics.figures import MeasureReport, measure
    from motionmind.tween.engine import Engine
    from motionmind.tween.report import read_report

    motion = read_part(parse_movement(source, home), None, home, **options)
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
    width = max(map(len, found))
    click.echo(f"{'':{width}}     value    corpus 5 to 95 %")
    for name, figure in found.items():
        click.echo(_line(name.replace("_", " "), figure, width))


def _line(name: str, figure: Figure, width: int) -> str:
    beyond = "<" if figure.value < figure.low else ">" if figure.value > figure.high else " "
    low, high = ("-" if math.isnan(number) else f"{number:.4g}" for number in (figure.low, figure.high))
    unit = f" ({figure.unit})" * bool(figure.unit)
    return f"{name:{width}}  {figure.value:8.4g} {beyond}  {low:>6} to {high:8}  {figure.about}{unit}"
