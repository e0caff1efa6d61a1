"""python -m experiments [NAME ...] [--quick] [--tuning] [--workers N] [--scheduler ADDRESS] [--data FOLDER]
                      [--out FOLDER]

Without names it lists the questions; with --quick alone it tries all of those that it runs, in a few minutes, and
writes nothing that stays. A whole run writes into the question's own folder. Recorded movement is looked for beside the
checkout, in ../shared/data; questions leave out what is not there.
"""

from __future__ import annotations

import ast
import tempfile
from concurrent.futures import Executor
from pathlib import Path

import click

from experiments import harness
from motionmind.errors import MotionMindError
from motionmind.executors.here import processes
from motionmind.executors.opening import open_team


@click.command(help=__doc__)
@click.argument("names", nargs=-1)
@click.option("--quick", is_flag=True, help="A trial of each, on bundled movement alone; all of them if none is named.")
@click.option("--tuning", is_flag=True, help="On the movement on which constants are chosen, alone; needs --out.")
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True, help="Processes.")
@click.option("--scheduler", help="A Dask cluster's, such as tcp://HOST:8786; its workers share this disk.")
@click.option("--data", type=click.Path(file_okay=False, path_type=Path), help="Folder of recorded movement.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Write into NAME in this folder.")
def main(
    names: tuple[str, ...],
    quick: bool,
    tuning: bool,
    workers: int,
    scheduler: str | None,
    data: Path | None,
    out: Path | None,
) -> None:
    known = harness.questions()
    if tuning and not (out or quick):
        raise click.UsageError("--tuning needs --out: what is reported is found on other movement")
    if not names and not quick:
        listed(known)
        return
    if strange := [name for name in names if name not in known]:
        raise click.UsageError(
            f"there is no question {strange[0]!r} that is run from here; there are {', '.join(known)}"
        )
    recorded = data or harness.HERE.parent.parent / "shared" / "data"
    setting = harness.Setting(quick, None if quick or not recorded.is_dir() else recorded, tuning)
    harness.single_threaded()
    try:
        with (
            tempfile.TemporaryDirectory() as trial,
            open_team(scheduler=scheduler) if scheduler else processes(workers) as team,
        ):
            run(names or tuple(known), setting, team.make(), out, Path(trial))
    except MotionMindError as error:
        raise click.ClickException(str(error)) from None


def run(names: tuple[str, ...], setting: harness.Setting, executor: Executor, out: Path | None, trial: Path) -> None:
    """Answer questions, and say where what was found is."""
    root = out or (trial if setting.quick else harness.HERE)
    for name in names:
        rows = harness.answer(name, setting, executor, root / name)
        if not rows:
            click.echo(f"{name}: skipped, its recorded movement is not there (--data)")
            continue
        click.echo(f"{name}: {len(rows)} rows" + (f", {root / name}" if root != trial else ""))


def listed(known: list[str]) -> None:
    """Print each folder's question, and its command."""
    for folder in sorted(path for path in harness.HERE.iterdir() if (path / "README.md").exists()):
        title = (folder / "README.md").read_text().splitlines()[0].lstrip("# ")
        click.echo(f"{folder.name:16}{title}")
        if folder.name in known:
            click.echo(f"{'':16}  python -m experiments {folder.name}")
        for script in sorted(folder.glob("*.py")):
            lines = (ast.get_docstring(ast.parse(script.read_text())) or "").splitlines()
            for line in map(str.strip, lines):
                if line.startswith("python "):
                    click.echo(f"{'':16}  {line}")


if __name__ == "__main__":
    main()
