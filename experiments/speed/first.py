"""How long the first command takes, with nothing compiled, beside the second.

    python experiments/speed/first.py [--python PATH] [--runs N]

Each run is README's first command in an empty cache, with its process in the background, which is then stopped; and
once more when all is compiled, in the same cache. --python names the Python of an environment with MotionMind, such as
one with a wheel; else it is this one. Both pictures must be the same, to the byte.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

import click

TWEEN = ("tween", "ballet/arabesque", "ballet/fifth", "-o")


@click.command(help=__doc__)
@click.option("--python", default=sys.executable, help="The Python to run.")
@click.option("--runs", type=click.IntRange(min=1), default=1, show_default=True)
def main(python: str, runs: int) -> None:
    """Run the commands, and print the table."""
    rows = [measure(python) for _ in range(runs)]
    print("| | wall clock | processor |\n|---|---|---|")
    names = "first command, empty cache", "the same again, all compiled"
    for name, seconds in zip(names, zip(*rows, strict=True), strict=True):
        wall, processor = (median(column) for column in zip(*seconds, strict=True))
        print(f"| {name} | {wall:.1f} s | {processor:.1f} s |")


def measure(python: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the seconds by the clock and of the processor that both commands take."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
        environment["XDG_CACHE_HOME"] = str(place / "cache")

        def run(*words: str) -> tuple[float, float]:
            before, began = processor_seconds(), perf_counter()
            command = [python, "-m", "motionmind", *words]
            subprocess.run(command, cwd=place, env=environment, capture_output=True, check=True)
            return perf_counter() - began, processor_seconds() - before

        first = run(*TWEEN, "first.gif")
        run("warm", "--stop")
        run("warm")
        second = run(*TWEEN, "second.gif")
        if (place / "first.gif").read_bytes() != (place / "second.gif").read_bytes():
            raise click.ClickException("the first command's picture is not the second's")
        return first, second


def processor_seconds() -> float:
    """Return the processor time of all processes that this one has waited for; those in the background are not."""
    times = os.times()
    return times.children_user + times.children_system


if __name__ == "__main__":
    main()
