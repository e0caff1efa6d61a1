"""The postures command: list the named postures and the clips of a corpus."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import check_outputs
from motionmind.cli.options import HOME, JSON, command, output
from motionmind.cli.printing import count, print_written
from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError
from motionmind.names.spelling import parse_source

if TYPE_CHECKING:
    from motionmind.names.finding import Collection

_MAX_CHARS = 300  # a sentence rather than a name


@command("motionmind postures ballet -o postures.png")
@click.argument("source", shell_complete=completion.corpora)
@output("Picture of the named postures (.png).", required=False)
@JSON
@HOME
def postures(source: str, output: Path | None, as_json: bool, home: Path | None) -> None:
    """List the postures and clips of a corpus or a score, by the names that other commands take.

    SOURCE is a corpus, by name or folder, or a score. Clips are listed with their number of postures; ballet/adagio@23
    is posture 23 of a clip.
    """
    from motionmind.names.finding import check_exists, open_collection

    named = parse_source(source, home)
    check_exists(named, home)
    if named.kind == "file":
        raise MotionMindError(f"{source}: not a corpus or a score; `motionmind sheet` draws the frames of a file")
    if named.name:
        raise MotionMindError(f"{source}: give {named.place} alone; `motionmind sheet` draws the postures of a clip")
    if output:
        check_outputs([(output, (".png",))], named.paths)
    found = open_collection(named, home)
    if output:
        _draw(found, output)
    listed = _list(found)
    if as_json:
        click.echo(json.dumps(listed))
        return
    _print(displayed_path(found.word), **listed)
    if output:
        print_written([output])


def _list(found: Collection) -> dict[str, list[Any]]:
    """List the contents of a collection as plain values for JSON."""
    motions = found.choose() if found.clips else []
    return {
        "postures": [f"{found.word}/{name}" for name in found.postures],
        "clips": [
            {
                "name": f"{found.word}/{name}",
                "postures": len(motion),
                "seconds": float(motion.times[-1] - motion.times[0]),
                "about": about,
            }
            for (name, about), motion in zip(found.clips.items(), motions, strict=True)
        ],
    }


def _print(word: str, postures: list[str], clips: list[dict[str, Any]]) -> None:
    """Print the named postures of a collection, then its clips."""
    click.echo(f"{word}: {count(len(postures), 'named posture')}, {count(len(clips), 'clip')}")
    for name in postures:
        click.echo(f"  {_display_name(name)}")
    if clips:
        last = f"{_display_name(clips[0]['name'])}@{clips[0]['postures'] - 1}"
        click.echo(f"clips (postures count from 0, so the first clip ends with {last})")
    width = max((len(_display_name(clip["name"])) for clip in clips), default=0)
    for clip in clips:
        length = f"{clip['postures']:5} postures  {clip['seconds']:6.1f} s"
        click.echo(
            f"  {_display_name(clip['name']):{width}}  {length}  {displayed(clip['about'], _MAX_CHARS)}".rstrip()
        )


def _display_name(name: str) -> str:
    return displayed(name, _MAX_CHARS)


def _draw(found: Collection, output: Path) -> None:
    """Draw the named postures of a collection."""
    import numpy as np

    from motionmind.body.motion import Motion
    from motionmind.files import write_atomically
    from motionmind.render.sheet import draw_sheet, png

    if not found.postures:
        raise MotionMindError(f"{found.word}: has no named postures; `motionmind sheet` draws its clips")
    drawn = [found.posture(name) for name in found.postures]
    motion = Motion(
        drawn[0].skeleton,
        np.stack([posture.rotations for posture in drawn]),
        np.stack([posture.root for posture in drawn]),
        np.arange(float(len(drawn))),
        found.word,
    )
    write_atomically(output, png(draw_sheet(motion, captions=found.postures)))
