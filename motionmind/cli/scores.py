"""The commands that convert scores to movement and to libraries of joint states."""

from __future__ import annotations

from pathlib import Path

import click

from motionmind.cli import completion
from motionmind.cli.files import MOTION_SUFFIXES, check_outputs, write_all
from motionmind.cli.options import HOME, OUTPUT_KINDS, Section, command, option, output, outputs
from motionmind.cli.printing import count
from motionmind.cli.restyles import pass_through
from motionmind.cli.types import FILE, RATE
from motionmind.cli.words import parse_tolerances
from motionmind.display import displayed, displayed_path
from motionmind.render import PICTURES


@command("motionmind compose ballet/barre.score --clip tendus -o tendus.bvh")
@click.argument("score", type=FILE)
@outputs(f"File to write: {OUTPUT_KINDS}.")
@option(
    "--fps",
    section=Section.OUTPUT,
    type=RATE,
    help="Frames per second  [default: a frame per posture; with --corpus 30]",
)
@option(
    "--corpus",
    section=Section.CORPORA,
    metavar="NAME",
    shell_complete=completion.corpora,
    help="Corpus in whose style to dance from posture to posture.",
)
@option("--clip", section=Section.PART, metavar="NAME", help="Clip of the score  [default: its only one]")
@option("--posture", section=Section.PART, metavar="NAME", help="Named posture of the score, instead of a clip.")
@HOME
def compose(
    score: Path,
    outputs: tuple[Path, ...],
    corpus: str | None,
    clip: str | None,
    posture: str | None,
    fps: float | None,
    home: Path | None,
) -> None:
    """Convert a score, which is movement written as text, to a motion.

    With --corpus, the movement from each posture to the next is a tween in the style of a corpus, on time. Ctrl-C ends
    the search: the command writes the best movement found, and exits with code 130.

    docs/notation.md explains the language of scores.
    """
    from motionmind.names.finding import locate_score
    from motionmind.notation import compose as notation
    from motionmind.notation.read import read_score

    score = locate_score(str(score))
    if clip and posture:
        raise click.UsageError("give --clip or --posture, not both")
    if corpus and posture:
        raise click.UsageError("--corpus is for clips, not for a posture")
    if fps and posture:
        raise click.UsageError("--fps is for clips, not for a posture")
    check_outputs([(path, MOTION_SUFFIXES + PICTURES) for path in outputs], [score])
    names = ", ".join(map(displayed_path, outputs))
    if posture:
        found = notation.posture(read_score(score), posture)
        write_all(outputs, found)
        click.echo(
            f"{names}: {displayed(posture)}, {count(len(found.skeleton), 'joint')} ({displayed(found.skeleton.name)})"
        )
        return
    motion = notation.compose(score, clip)
    seconds = motion.times[-1]
    if corpus:
        danced, interruption = pass_through(motion, corpus, home, fps)
        motion = danced.motion
    elif fps:
        motion = motion.resample(fps)
    write_all(outputs, motion)
    click.echo(
        f"{names}: {displayed(motion.name)}, {count(len(motion), 'frame')} in {seconds:.1f} s, "
        f"{displayed(motion.skeleton.name)}"
    )
    if corpus:
        interruption.finish()


@command("motionmind library karate/kata.score -o mine.toml --tolerance 12 --tolerance hip=8")
@click.argument("scores", type=FILE, nargs=-1, required=True)
@output("Library to write (.toml).")
@option(
    "--tolerance",
    section=Section.STATES,
    multiple=True,
    metavar="DEGREES",
    help="Size of a state in degrees, or JOINT=DEGREES for one joint  [default: 12]. Repeatable.",
)
@option(
    "--stage",
    section=Section.STATES,
    is_flag=True,
    help="Distinguish states of the pelvis by where the body faces, as on a stage.",
)
def library(scores: tuple[Path, ...], output: Path, tolerance: tuple[str, ...], stage: bool) -> None:
    """Write a library of joint states from scores.

    States have their names in the scores. Edit the library, and use it with corpus build --discretize.
    """
    from motionmind.discretize.library import write_library
    from motionmind.discretize.naming import name_states
    from motionmind.names.finding import locate_score
    from motionmind.notation.read import read_score

    places = [locate_score(str(score)) for score in scores]
    check_outputs([(output, (".toml",))], places)
    degrees, per_joint = parse_tolerances(tolerance, 12.0)
    found = name_states([read_score(place) for place in places], degrees, per_joint, stage=stage)
    write_library(output, found)
    click.echo(
        f"{displayed_path(output)}: {count(sum(map(len, found.tables.values())), 'state')} "
        f"of {count(len(found.tables), 'joint')}"
    )
