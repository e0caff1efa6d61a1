"""The plan command: draw a movement's path over the floor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.ensembles import describe_ensemble, is_ensemble, open_ensemble
from motionmind.cli.files import check_outputs
from motionmind.cli.music import read_counts, with_music
from motionmind.cli.options import HOME, Section, command, option, output, reading
from motionmind.cli.pictures import CLIP, FIRST, LAST
from motionmind.cli.sources import parse_movement, read_movement, select_part
from motionmind.cli.stages import note_overstep
from motionmind.cli.types import Area, Number
from motionmind.display import displayed_path
from motionmind.tween.counts import TEMPO_RANGE_BPM

if TYPE_CHECKING:
    from motionmind.body.motion import Motion

PLANS = (".svg", ".png")


@command("motionmind plan ballet/adagio -o adagio.svg")
@click.argument("source", shell_complete=completion.movement)
@output("Picture (.svg or .png).")
@CLIP
@FIRST
@LAST
@option(
    "--stage",
    section=Section.DRAW,
    type=Area(),
    metavar="WIDTHxDEPTH",
    help="Edge of the stage, metres, around the origin; a note says where the path leaves it.",
)
@option(
    "--tempo",
    section=Section.DRAW,
    type=Number(*TEMPO_RANGE_BPM),
    metavar="BPM",
    help="Counts per minute, to write counts instead of seconds; with sound as --music, about its tempo.",
)
@with_music(
    Section.DRAW,
    "Music whose beats are the counts: .txt, .mid, or sound, of about --tempo if given.",
    "Seconds of the music before count 1, the next beat  [default: to the first downbeat]",
)
@option(
    "--every",
    section=Section.DRAW,
    type=Number(min=0, min_open=True, max=1e6),
    metavar="N",
    help="Interval between facings, in counts with --tempo or --music, else in seconds  [default: at most 40 facings]",
)
@reading
@HOME
def plan(
    source: str,
    output: Path,
    name: str | None,
    start: int,
    end: int,
    stage: tuple[float, float] | None,
    tempo: float | None,
    every: float | None,
    music: Path | None,
    offset: float | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Draw a movement's path over the floor, from above.

    SOURCE is a motion file, a score, a corpus by name or folder, CORPUS/CLIP, a clip of a glTF file such as
    'hero.glb#Dance', or an ensemble (.toml). The plan shows the pelvis's path, where the feet stand, and where the body
    faces; the audience is below. Inserted movement is violet; the dancers of an ensemble have colours of their own.
    """
    from motionmind.plots.floor_plan import draw_floor_plan

    beats = read_counts(music, offset, tempo)
    tempo = tempo if beats is None else None
    if is_ensemble(source, [output], PLANS):
        ensemble = open_ensemble(source, [output], PLANS, home, ["name", "start", "end"], **options)
        tempo = ensemble.tempo if tempo is None and beats is None else tempo
        stage = ensemble.stage if stage is None else stage
        motions = ensemble.motions()
        draw_floor_plan(motions, stage=stage, tempo=tempo, beats=beats, every=every, name=ensemble.name).save(output)
        click.echo(f"{displayed_path(output)}: " + "\n".join(describe_ensemble(ensemble)))
        for one in motions:
            note_overstep(one.name, one, stage)
        return
    named = parse_movement(source, home)
    check_outputs([(output, PLANS)], named.source.paths)
    whole = read_movement(named.source, name, home, **options)
    frames = select_part(named, whole, start, end)
    motion = whole.slice(frames.start, frames.stop)
    picture = draw_floor_plan(motion, stage=stage, tempo=tempo, beats=beats, every=every)
    picture.save(output)
    click.echo(f"{displayed_path(output)}: {_about(motion)}")
    note_overstep(source, motion, stage)


def _about(motion: Motion) -> str:
    """Return the length of a movement's path, its duration, and the size of the floor it needs."""
    import numpy as np

    path = motion.root[:, [0, 2]]
    travel = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    width, depth = np.ptp(path, axis=0).tolist()
    seconds = float(motion.times[-1] - motion.times[0])
    return f"path of {travel:.1f} m in {seconds:.1f} s, on a floor of {width:.1f} x {depth:.1f} m"
