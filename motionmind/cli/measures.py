"""The measure command: compare movement with a corpus, and tabulate its effort."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import check_outputs
from motionmind.cli.options import HOME, JSON, Section, command, given_option, option, reading
from motionmind.cli.printing import count, note
from motionmind.cli.sources import parse_movement, read_movements, read_part, select_part, spelled
from motionmind.cli.types import FILE, POSITIVE, known_corpora
from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError, enumerated

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.metrics.figures import Figure
    from motionmind.names.spelling import PostureName


@command("motionmind measure tween.json --corpus ballet")
@click.argument("sources", nargs=-1, required=True, metavar="SOURCE...", shell_complete=completion.movement)
@option(
    "--corpus",
    section=Section.CORPORA,
    metavar="NAME",
    shell_complete=completion.corpora,
    help="Corpus to compare with, by name or folder; --csv needs none.",
)
@option(
    "--report",
    section=Section.INPUT,
    type=FILE,
    help="Report of SOURCE from tween --report: measure the states of its path instead of the motion's.",
)
@option("--all", "everything", section=Section.OUTPUT, is_flag=True, help="Print all figures, not the main ten.")
@option(
    "--effort",
    section=Section.OUTPUT,
    is_flag=True,
    help="Print Laban's weight, time, space and flow, extension, and the phase of arms and legs.",
)
@option(
    "--csv",
    "table",
    section=Section.OUTPUT,
    type=FILE,
    help="Write the figures of --effort as a table: a row a clip, of any number of SOURCEs.",
)
@option(
    "--window",
    section=Section.OUTPUT,
    type=POSITIVE,
    metavar="SECONDS",
    help="Length of consecutive windows: a row of --csv for each  [default: the clip]",
)
@JSON
@reading
@HOME
def measure(
    sources: tuple[str, ...],
    corpus: str | None,
    report: Path | None,
    everything: bool,
    effort: bool,
    table: Path | None,
    window: float | None,
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
    context = click.get_current_context()
    if table is not None:
        if flag := given_option(context, ["corpus", "report", "everything", "as_json"]):
            raise click.UsageError(f"{flag} excludes --csv, which holds the figures of --effort alone", context)
        _write_efforts(table, sources, window, home, options)
        return
    if corpus is None:
        raise click.UsageError(f"Missing option '--corpus'. Corpora: {known_corpora(home)}", context)
    if window is not None or len(sources) > 1:
        given = "--window is" if window is not None else f"{len(sources)} SOURCEs are"
        raise click.UsageError(f"{given} only for --csv FILE", context)
    if effort and everything:
        raise click.UsageError("--effort and --all exclude each other: --all has the figures of --effort, too", context)
    if effort and as_json:
        raise click.UsageError("--effort and --json exclude each other: --json has all figures", context)
    _compare(sources[0], corpus, report, everything, effort, as_json, home, options)


def _compare(
    source: str,
    corpus: str,
    report: Path | None,
    everything: bool,
    effort: bool,
    as_json: bool,
    home: Path | None,
    options: Mapping[str, Any],
) -> None:
    """Print the figures of one movement beside the usual range in a corpus."""
    import msgspec
    import numpy as np

    from motionmind.metrics.effort import EFFORT
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
    shown = EFFORT if effort else MAIN_FIGURES
    names = [name for name in found if everything or name in shown]
    rows = [("", "value", "", "usual in corpus", "")] + [_cells(name, found[name]) for name in names]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        click.echo("  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def _write_efforts(
    table: Path, sources: Sequence[str], window: float | None, home: Path | None, options: Mapping[str, Any]
) -> None:
    """Write the effort of all clips of all sources as a CSV table, and say so; a cell is empty where undefined."""
    from motionmind.body.contact import CONTACT_FPS
    from motionmind.files import write_atomically
    from motionmind.metrics.effort import EFFORT, least_duration, measure_effort

    named = [parse_movement(source, home) for source in sources]
    check_outputs([(table, (".csv",))], [path for one in named for path in one.source.paths])
    text, n_rows = io.StringIO(), 0
    writer = csv.DictWriter(text, ["clip", "start", "end", *EFFORT], lineterminator="\n")
    writer.writeheader()
    least, short = least_duration(window), list[str]()
    for name, motion in _clips(named, home, options):
        if motion.times[-1] - motion.times[0] < least - 0.5 / CONTACT_FPS:
            short.append(displayed(name))
            continue
        for row in measure_effort(replace(motion, name=name), window=window):
            cells = {key: "" if math.isnan(value) else f"{value:.6g}" for key, value in row.items()}
            writer.writerow({"clip": name, **cells})
            n_rows += 1
    if not n_rows:
        raise MotionMindError(f"no clip lasts {least:.2f} s: {enumerated(short)}")
    write_atomically(table, text.getvalue().encode())
    if short:
        note(f"left out, shorter than {least:.2f} s: {enumerated(short)}")
    click.echo(f"wrote {displayed_path(table)}: {count(n_rows, 'row')}, {count(len(EFFORT), 'figure')} each")


def _clips(
    sources: Sequence[PostureName], home: Path | None, options: Mapping[str, Any]
) -> Iterator[tuple[str, Motion]]:
    """Yield all clips of all sources, each with a name that commands understand."""
    for named in sources:
        holds_clips = named.source.kind != "file" and not named.source.name
        for motion in read_movements(named.source, (), home, whole=True, **options):
            frames = select_part(named, motion, 0, -1)
            name = f"{named.source.word}/{motion.name}" if holds_clips else spelled(named.source, motion)
            yield name, motion.slice(frames.start, frames.stop)


def _cells(name: str, figure: Figure) -> tuple[str, ...]:
    """Return the cells of a figure's row: name, value, comparison with the usual range, the range, and meaning."""
    is_known = not math.isnan(figure.value)
    value, low, high = (float(f"{number:.3g}") for number in (figure.value, figure.low, figure.high))
    place = "below" if value < low else "above" if value > high else ""
    shown = f"{value:g} {figure.unit}".rstrip() if is_known else "-"
    usual = "-" if math.isnan(low) or math.isnan(high) else f"{low:g}" if low == high else f"{low:g} to {high:g}"
    return name.replace("_", " "), shown, place, usual, figure.about
