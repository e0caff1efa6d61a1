"""How a question is put: jobs in parallel, resumed where they were left, and what is written of the answers.

A question is a module `experiments.NAME.run` with a docstring that says it and four functions:

    jobs(setting)   the jobs, each a dict of plain values
    work(**job)     one job's rows, each a dict of plain values, the same keys in all
    chart(rows)     an SVG of all rows
    tell(rows)      README's tables, as Markdown
"""

from __future__ import annotations

import csv
import io
import json
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import click

Row = dict[str, Any]
HERE = Path(__file__).parent
BEGIN, END = "<!-- what was found: written by the run -->", "<!-- end of what was found -->"


@dataclass(frozen=True)
class Setting:
    """What jobs are made for: a trial run or a whole one, and where recorded movement lies, if it does.

    With `tuning`, a question uses only the movement on which constants are chosen.
    """

    quick: bool
    data: Path | None
    tuning: bool = False


def questions() -> list[str]:
    """Names of the folders whose questions are run from here."""
    return sorted(path.parent.name for path in HERE.glob("*/run.py"))


def question(name: str) -> ModuleType:
    return import_module(f"experiments.{name}.run")


def answer(name: str, setting: Setting, executor: Executor, folder: Path) -> list[Row]:
    """Do what is left of a question's jobs, and write the table, the plot and README's section into a folder.

    What each job found is kept in `unfinished.jsonl` there as soon as it is done; a run that was broken off goes on
    from that, if it asks for the same. A question without jobs finds nothing, and writes nothing.
    """
    module = question(name)
    wanted = {json.dumps(job, sort_keys=True): job for job in module.jobs(setting)}
    if not wanted:
        return []
    folder.mkdir(parents=True, exist_ok=True)
    unfinished = folder / "unfinished.jsonl"
    done = {key: rows for key, rows in _kept(unfinished) if key in wanted}
    left = [key for key in wanted if key not in done]
    with (
        unfinished.open("a") as keep,
        click.progressbar(length=len(wanted), label=f"{name:14}", file=sys.stderr) as bar,
    ):
        bar.update(len(done))
        keep.write("\n")  # what was being written when a run was broken off has no end
        running = {executor.submit(_work, name, wanted[key]): key for key in left}
        for future in as_completed(running):
            bar.update(1)
            if future.exception():
                continue  # the others are worth keeping
            key = running[future]
            done[key] = future.result()
            keep.write(json.dumps([key, done[key]]) + "\n")
            keep.flush()
    for future in running:
        future.result()
    rows: list[Row] = [row for key in wanted for row in done[key]]
    (folder / "found.csv").write_text(table(rows))
    (folder / "found.svg").write_text(module.chart(rows))
    _tell(folder / "README.md", module, rows)
    unfinished.unlink()
    return rows


def _work(name: str, job: dict[str, Any]) -> list[Row]:
    rows = question(name).work(**job)
    return [{key: _plain(value) for key, value in row.items()} for row in rows]


def _plain(value: Any) -> Any:
    """Numbers as JSON and CSV keep them, to seven digits: what is measured is not known better."""
    if hasattr(value, "item"):
        value = value.item()
    return float(f"{value:.7g}") if isinstance(value, float) else value


def _kept(path: Path) -> Iterator[tuple[str, list[Row]]]:
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            key, rows = json.loads(line)
        except ValueError:
            continue
        yield key, rows


def table(rows: list[Row]) -> str:
    """The rows as CSV."""
    out = io.StringIO()
    writer = csv.DictWriter(out, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


def _tell(readme: Path, module: ModuleType, rows: list[Row]) -> None:
    """Put what was found between the marks of the README, which is begun with the question where there is none."""
    text = readme.read_text() if readme.exists() else f"# {(module.__doc__ or '').splitlines()[0]}\n\n{BEGIN}\n{END}\n"
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    readme.write_text(f"{before}{BEGIN}\n\n{module.tell(rows).strip()}\n\n![what was found](found.svg)\n\n{END}{after}")


def markdown(columns: dict[str, Callable[[Row], object]], rows: list[Row]) -> str:
    """A Markdown table: each column's heading, and what stands there of a row."""
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(str(cell(row)) for cell in columns.values()) + " |" for row in rows]
    return "\n".join(lines)


def single_threaded() -> None:
    """Keep linear algebra from starting a thread a core in each process; to be called before NumPy is imported."""
    os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
