"""The commands that draw."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli.commands import app
from motionmind.cli.files import all_or_none, check_outputs
from motionmind.cli.options import ANY, COUNT, FILE, HOME, RATE, example, reading
from motionmind.cli.printing import count
from motionmind.cli.sources import frames_of, holds_clips, movements
from motionmind.errors import MotionMindError
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.body.motion import Motion


@app.command(epilog=example("motionmind sheet corpora/ballet/centre.score --clip adagio -o adagio.png"))
@click.argument("source", type=ANY)
@click.option(
    "-o",
    "--output",
    type=ANY,
    required=True,
    help="Where the picture goes: .png; or a folder for a picture of each clip.",
)
@click.option(
    "--clip",
    "names",
    multiple=True,
    metavar="NAME",
    help="Which clips of a score or a corpus, as often as you like  [default: all of them]",
)
@click.option("--every", type=COUNT, metavar="N", help="Draw every Nth frame  [default: all of them]")
@click.option(
    "--postures", type=COUNT, metavar="N", help="Draw N frames, evenly spread, the first and the last among them."
)
@click.option("--from", "start", type=int, metavar="N", default=0, help="First frame; negative from the end.")
@click.option("--to", "end", type=int, metavar="N", default=-1, help="Last frame; negative from the end.")
@click.option("--columns", type=COUNT, metavar="N", help="Postures in a row  [default: a screen's shape]")
@click.option(
    "--side",
    type=click.Choice(["right", "left"]),
    default="right",
    help="Side of the stage, as the performer has it, from which the side view is taken.",
)
@reading
@HOME
def sheet(
    source: Path,
    output: Path,
    names: tuple[str, ...],
    every: int | None,
    postures: int | None,
    start: int,
    end: int,
    columns: int | None,
    side: Any,
    home: Path | None,
    **as_given: Any,
) -> None:
    """Draw the postures of clips from the front, from the side, and their feet from above.

    Each has its frame's number, which posture --frame takes, and its time. SOURCE is a file of movement, a score, or a
    corpus by its name or folder; scores and corpora hold clips, of which --clip takes some. CORPUS/CLIP is one clip.
    """
    from motionmind.formats import write_atomically
    from motionmind.render.sheet import check_frames, contact_sheet, png

    many = holds_clips(source, home)
    folder = output if many and (output.is_dir() or not output.suffix) else None
    if not folder:
        check_outputs([(output, (".png",))], [source])
    motions = movements(source, names, home, **as_given)
    if not folder and len(motions) != 1:
        raise MotionMindError(f"{output}: {source} holds {len(motions)} clips; choose one by --clip, or give a folder")
    frames = [
        _spread(frames_of(motion.name if folder else source, len(motion), start, end), every, postures)
        for motion in motions
    ]
    for motion, drawn in zip(motions, frames, strict=True):
        check_frames(motion, drawn)
    paths = _files_in(folder, motions, source) if folder else [output]
    with all_or_none(paths):
        for path, motion, drawn in zip(paths, motions, frames, strict=True):
            picture = contact_sheet(motion, drawn, columns=columns, side=side)
            write_atomically(path, png(picture))
            words = count(len(drawn), "posture")
            click.echo(f"{path}: {words} of {len(motion)}, {picture.width} x {picture.height} pixels")


@app.command(epilog=example("motionmind render clip.bvh -o clip.html"))
@click.argument("source", type=ANY)
@click.option(
    "-o", "--output", type=FILE, required=True, help="Where it goes: .png, .gif, .mp4, .svg (a film too) or .html."
)
@click.option("--clip", "name", metavar="NAME", help="Which clip of a score or a corpus  [default: its only one]")
@click.option("--from", "start", type=int, metavar="N", default=0, help="First frame; negative from the end.")
@click.option("--to", "end", type=int, metavar="N", default=-1, help="Last frame; negative from the end.")
@click.option(
    "--fps", type=RATE, help="Frames a second of a film  [default: the movement's own, at most 25 in .gif; .svg 12]"
)
@click.option(
    "--view",
    type=click.Choice(["quarter", "front", "side", "left", "top"]),
    help="From where a film or a posture is seen  [default: quarter]",
)
@click.option("--size", type=click.IntRange(120, 2160), metavar="PIXELS", help="How high  [default: 480]")
@reading
@HOME
def render(
    source: Path, output: Path, name: str | None, start: int, end: int, home: Path | None, **options: Any
) -> None:
    """Draw movement: as a picture, a film, or a page to play it in.

    SOURCE is a file of movement, a score, a corpus by its name or folder, or CORPUS/CLIP. .png is one posture, or a
    sheet of up to 48 of them, evenly spread (the command sheet has more to choose); .html is a page that plays the
    movement in any browser, from disk, offline. What the engine inserted is drawn in violet, a joint that it bridged
    has a green ball.
    """
    from motionmind.render.pictures import write_picture

    seen = {key: options.pop(key) for key in ("fps", "view", "size")}
    check_outputs([(output, PICTURES)], [source])
    found = movements(source, (name,) if name else (), home, **options)
    if len(found) != 1:
        raise MotionMindError(f"{source}: holds {len(found)} clips; choose one by --clip")
    motion, frames = found[0], frames_of(source, len(found[0]), start, end)
    part = motion.slice(frames.start, frames.stop)
    write_picture(output, part, first=frames.start, **seen)
    seconds = part.times[-1] - part.times[0]
    kilobytes = output.stat().st_size / 1000
    click.echo(f"{output}: {count(len(part), 'frame')}, {seconds:.2f} s, {kilobytes:.0f} kB")


def _files_in(folder: Path, motions: Sequence[Motion], source: Path) -> list[Path]:
    """A file for each of the motions, named after it, in a folder that is made if there is none."""
    made = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MotionMindError(f"{folder}: cannot be made: {error.strerror or error}") from error
    names = (re.sub(r"[^\w.()-]+", "-", motion.name) for motion in motions)
    try:
        return check_outputs([(folder / f"{name}.png", (".png",)) for name in names], [source])
    except MotionMindError:
        with suppress(OSError):
            if made:
                folder.rmdir()
        raise


def _spread(frames: range, every: int | None, postures: int | None) -> Sequence[int]:
    """Those of the frames that are drawn: every so many, or so many, from the first to the last."""
    if every and postures:
        raise MotionMindError("--every and --postures both say which frames to draw; give one of them")
    from motionmind.render.sheet import evenly

    return evenly(frames, postures) if postures else frames[:: every or 1]
