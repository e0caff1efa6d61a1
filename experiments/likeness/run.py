"""Likeness: whether a classifier tells in-betweens from the dancer's own held-out movement.

    python -m experiments likeness
    python -m experiments.likeness.run DANCER ... --out FOLDER [--label NAME] [--options JSON] [--windows N]

The second command tries options of `Engine.tween`, or a changed engine. It keeps what each label made in a folder,
makes only what is not there yet, and prints all labels side by side.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import click

import motionmind
from experiments.harness import Row, Setting, single_threaded
from experiments.inbetween.run import GAPS, TUNED_ON
from experiments.likeness.filled import RIVALS, Method, copies, engine, rival
from experiments.likeness.labels import Labels, code_of
from experiments.likeness.making import Maker
from experiments.likeness.measure import Truth, rows_of
from experiments.likeness.tables import board, board_of_takes, chart, tell
from experiments.likeness.windows import cases_of, key_of, window_of
from experiments.material import families, recorded

__all__ = ["chart", "jobs", "tell", "work"]

DANCERS = ("cmu-05", "indian", "cmu-16", "cmu-135", "bandai", "cmu-29")
WINDOWS = 24  # of a family and a length, at most
# Options of `Engine.tween`, by what the result is called.
ENGINES: dict[str, dict[str, Any]] = {"motionmind": {}, "liveliness 0": {"liveliness": 0.0}}


def jobs(setting: Setting) -> list[dict[str, Any]]:
    """Return a job for each dancer: classifiers need all of their families at once."""
    data = str(setting.data) if setting.data else None
    names = recorded(data, *(TUNED_ON if setting.tuning else DANCERS)) or ["karate"]
    size = (
        {"gaps": [0.6, 1.2], "count": 3, "most": 3}
        if setting.quick
        else {"gaps": list(GAPS), "count": WINDOWS, "most": None}
    )
    return [{"data": data, "name": name} | size for name in names]


def work(data: str | None, name: str, gaps: list[float], count: int, most: int | None) -> list[Row]:
    """Fill the windows of a dancer with what was learned without their family, and measure each method's results."""
    maker = maker_of(data, name, gaps, count, most)
    methods = methods_of(ENGINES)
    filled = maker.fill(methods)
    practised = maker.practise({kind: method for kind, method in methods.items() if copies(kind)})
    rows = [row for kind, one in filled.items() for row in rows_of(name, kind, maker.truth, one, practised.get(kind))]
    return [{key: value for key, value in row.items() if key != "spent"} for row in rows]  # the same again


def maker_of(
    data: str | None, name: str, gaps: Sequence[float], count: int, most: int | None, report: bool = False
) -> Maker:
    """Choose the windows of a dancer."""
    together = families(data, name)[:most]
    cases = cases_of(data, name, together, gaps, count)
    truth = Truth.of(cases, [window_of(data, name, case) for case in cases])
    return Maker(data, name, together, truth, report)


def methods_of(engines: dict[str, dict[str, Any]]) -> dict[str, Method]:
    """Return the truth, the rivals and engines with some options, by name."""
    return {kind: rival(kind) for kind in RIVALS} | {label: engine(options) for label, options in engines.items()}


# --- labels -----------------------------------------------------------------------------------------------------------


@click.command(help=__doc__)
@click.argument("names", nargs=-1, required=True)
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), required=True, help="Folder of all labels.")
@click.option("--label", help="Name of the engine's results; without it, show the results that are in the folder.")
@click.option("--options", default="{}", help="Options of Engine.tween, as JSON.")
@click.option("--windows", type=click.IntRange(min=1), default=WINDOWS, help="Of a family and a length, at most.")
@click.option("--families", "most", type=click.IntRange(min=1), help="Only so many families of each dancer.")
@click.option("--data", type=click.Path(exists=True, file_okay=False), default="../shared/data", show_default=True)
@click.option(
    "--baseline",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    multiple=True,
    help="Another folder whose labels are shown, too, such as one of another checkout.",
)
@click.option("--show", multiple=True, help="Show only this label, and others named like this, beside the rivals.")
@click.option("--lenient", is_flag=True, help="Learn to tell from the same movement: quicker, kind to copies.")
@click.option("--again", is_flag=True, help="Make the label's movement anew.")
def main(
    names: tuple[str, ...],
    out: Path,
    label: str | None,
    options: str,
    windows: int,
    most: int | None,
    data: str,
    baseline: tuple[Path, ...],
    show: tuple[str, ...],
    lenient: bool,
    again: bool,
) -> None:
    warnings.simplefilter("ignore", motionmind.MotionMindWarning)  # lengths are the recording's: some are fast
    about = {"options": json.loads(options), "engine": code_of(Path(motionmind.__file__).parent)}
    for name in names:
        began = perf_counter()
        maker = maker_of(data, name, GAPS, windows, most, report=True)
        truth = maker.truth
        inside = Path(name) / f"{windows}-{key_of(truth.cases)}"
        labels = Labels(out / inside)
        methods = methods_of({label: about["options"]} if label else {})
        missing = labels.missing(label, about, again)
        for kind, filled in maker.fill({kind: methods[kind] for kind in missing}).items():
            labels.keep(kind, filled, about)
        unpractised = [] if lenient else [kind for kind in labels.unpractised(label) if copies(kind)]
        for kind, folds in maker.practise({kind: methods[kind] for kind in unpractised}).items():
            labels.keep_practice(kind, folds)
        made = perf_counter()
        rows = labels.rows(name, truth)
        for other in baseline:
            found = Labels(other / inside).rows(name, truth)
            rows += [row | {"kind": f"{other.name}/{row['kind']}"} for row in found if row["kind"] not in RIVALS]
        if show:
            rows = [row for row in rows if row["kind"] in (*RIVALS, *show)]
        title = f"{name}: {len(maker.together)} families, {len(truth.cases)} windows"
        click.echo(f"\n## {title}\n\n{board(rows)}\n\n{board_of_takes(rows)}")
        click.echo(f"\n{name}: made in {made - began:.0f} s, measured in {perf_counter() - made:.0f} s", err=True)


if __name__ == "__main__":
    single_threaded()  # boosted trees start their threads later
    main()
