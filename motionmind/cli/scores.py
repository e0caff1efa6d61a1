"""The command that turns scores into movement."""

from __future__ import annotations

from pathlib import Path

import click

from motionmind.cli.commands import app
from motionmind.cli.files import MOVEMENT, check_outputs, write
from motionmind.cli.options import FILE, OUTPUTS, RATE, example, tolerances
from motionmind.cli.printing import count
from motionmind.render import PICTURES

_TOLERANCE = 12.0  # degrees for joints of which --tolerance does not speak


@app.command(epilog=example("motionmind compose corpora/ballet/barre.score --clip tendus -o tendus.bvh"))
@click.argument("score", type=FILE)
@click.option("-o", "--output", type=FILE, required=True, help=f"Where it goes: {OUTPUTS}.")
@click.option("--clip", metavar="NAME", help="Which of its clips  [default: its only one]")
@click.option("--posture", metavar="NAME", help="A posture that it names, instead of a clip.")
@click.option("--fps", type=RATE, help="Frames a second  [default: a frame a posture]")
def compose(score: Path, output: Path, clip: str | None, posture: str | None, fps: float | None) -> None:
    """Turn a score, movement written as text, into a motion.

    docs/notation.md explains how scores are written.
    """
    from motionmind.notation import compose as notation
    from motionmind.notation.read import read_score

    if clip and posture:
        raise click.UsageError("--clip or --posture, not both")
    if fps and posture:
        raise click.UsageError("--fps is for clips; a posture has no frames a second")
    check_outputs([(output, MOVEMENT + PICTURES)], [score])
    if posture:
        found = notation.posture(read_score(score), posture)
        write(output, found)
        click.echo(f"{output}: {posture}, {len(found.skeleton)} joints ({found.skeleton.name})")
        return
    motion = notation.compose(score, clip)
    seconds = motion.times[-1]
    motion = motion if fps is None else motion.resample(fps)
    write(output, motion)
    click.echo(f"{output}: {motion.name}, {count(len(motion), 'frame')} in {seconds:.1f} s, {motion.skeleton.name}")


@app.command(epilog=example("motionmind library corpora/karate/*.score -o mine.toml --tolerance 12 --tolerance hip=8"))
@click.argument("scores", type=FILE, nargs=-1, required=True)
@click.option("-o", "--output", type=FILE, required=True, help="Where the library goes: .toml.")
@click.option(
    "--tolerance",
    multiple=True,
    metavar="DEGREES",
    help="How far apart orientations of one state may lie; also JOINT=DEGREES, as often as you like.  [default: 12]",
)
@click.option("--stage", is_flag=True, help="The pelvis' states tell where the body faces, as on a stage.")
def library(scores: tuple[Path, ...], output: Path, tolerance: tuple[str, ...], stage: bool) -> None:
    """Name joint states after what scores call them: a library to edit, for corpus build --discretize."""
    from motionmind.discretize.library import write_library
    from motionmind.discretize.naming import name_states
    from motionmind.notation.read import read_score

    check_outputs([(output, (".toml",))], scores)
    degrees, per_joint = tolerances(tolerance, _TOLERANCE)
    found = name_states([read_score(score) for score in scores], degrees, per_joint, stage=stage)
    write_library(output, found)
    click.echo(f"{output}: {sum(map(len, found.tables.values()))} states of {count(len(found.tables), 'joint')}")
