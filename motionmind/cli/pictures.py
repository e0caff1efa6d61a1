"""The command that draws."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import click

from motionmind.cli.commands import app
from motionmind.cli.files import check_outputs, read, read_mapping
from motionmind.cli.options import COUNT, FILE, example, reading
from motionmind.cli.printing import count
from motionmind.errors import MotionMindError


@app.command(epilog=example("motionmind sheet clip.bvh --postures 24 -o clip.png"))
@click.argument("clip", type=FILE)
@click.option("-o", "--output", type=FILE, required=True, help="Where the picture goes: .png.")
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
def sheet(
    clip: Path,
    output: Path,
    every: int | None,
    postures: int | None,
    start: int,
    end: int,
    columns: int | None,
    side: Any,
    joints: Path | None,
    **source: Any,
) -> None:
    """Draw the postures of a clip from the front, from the side, and their feet from above.

    Each has its frame's number, which posture --frame takes, and its time.
    """
    from PIL.Image import Dither, Quantize

    from motionmind.formats import write_atomically
    from motionmind.learned import own_skeleton
    from motionmind.render.sheet import contact_sheet

    check_outputs([(output, (".png",))], [clip])
    motion = own_skeleton(read(clip, **source), read_mapping(joints))
    frames = _spread(_range(clip, len(motion), start, end), every, postures)
    picture = contact_sheet(motion, frames, columns=columns, side=side)
    data = BytesIO()
    # A third of the bytes, and to the eye the same: this method keeps colours that are rare.
    picture.quantize(256, Quantize.MAXCOVERAGE, dither=Dither.NONE).save(data, "PNG")
    write_atomically(output, data.getvalue())
    drawn = count(len(frames), "posture")
    click.echo(f"{output}: {drawn} of {len(motion)}, {picture.width} x {picture.height} pixels")


def _range(clip: Path, length: int, start: int, end: int) -> range:
    """The frames from `start` to `end`, both among them, of a clip of `length` frames; negative from the end."""
    first, last = (frame + length if frame < 0 else frame for frame in (start, end))
    for frame, given in ((first, start), (last, end)):
        if not 0 <= frame < length:
            raise MotionMindError(f"{clip}: frames are 0 to {length - 1}, there is no frame {given}")
    if last < first:
        raise MotionMindError(f"{clip}: --to {end} lies before --from {start}")
    return range(first, last + 1)


def _spread(frames: range, every: int | None, postures: int | None) -> Sequence[int]:
    """Those of the frames that are drawn: every so many, or so many, from the first to the last."""
    if every and postures:
        raise MotionMindError("--every and --postures both say which frames to draw; give one of them")
    if not postures or postures >= len(frames):
        return frames[:: every or 1]
    gaps = max(postures - 1, 1)
    return [frames[round(at * (len(frames) - 1) / gaps)] for at in range(postures)]
