"""The postures command: list the named postures and the clips of a corpus, a score or a file."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import check_outputs
from motionmind.cli.options import HOME, JSON, command, output
from motionmind.cli.printing import count, print_written
from motionmind.cli.sources import spelled
from motionmind.clip_names import CLIP_SUFFIXES
from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError
from motionmind.names.spelling import Source, parse_source

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture
    from motionmind.names.finding import Collection

_MAX_CHARS = 300  # a sentence rather than a name


@command("motionmind postures ballet -o postures.png")
@click.argument("source", shell_complete=completion.corpora)
@output("Picture of the named postures (.png).", required=False)
@JSON
@HOME
def postures(source: str, output: Path | None, as_json: bool, home: Path | None) -> None:
    """List the postures and clips of a corpus, a score or a file, by the names that other commands take.

    SOURCE is a corpus, by name or folder, a score, or a file that may hold several clips: glTF, BVH or .npy. Clips are
    listed with their number of postures; ballet/adagio@23 is posture 23 of a clip, 'hero.glb#Dance@23' of a clip of a
    file, and 'duo.bvh#Hips@23' of a body in BVH.
    """
    from motionmind.names.finding import check_exists, open_collection

    named = parse_source(source, home)
    check_exists(named, home)
    is_file = named.kind == "file"
    if is_file and Path(named.place).suffix.lower() not in CLIP_SUFFIXES:
        raise MotionMindError(
            f"{source}: not a corpus or a score, nor glTF, BVH or .npy; `motionmind sheet` draws the frames of a file"
        )
    if named.name:
        raise MotionMindError(f"{source}: give {named.place} alone; `motionmind sheet` draws the postures of a clip")
    if output:
        check_outputs([(output, (".png",))], named.paths)
    if is_file:
        word, captions, drawn, listed = named.place, *_list_file(named)
    else:
        found = open_collection(named, home)
        word, captions, listed = found.word, list(found.postures), _list(found)
        drawn = [found.posture(name) for name in captions] if output else []
    if output:
        _draw(word, captions, drawn, output)
    if as_json:
        click.echo(json.dumps(listed))
        return
    _print(displayed_path(word), **listed)
    if output:
        print_written([output])


def _list(found: Collection) -> dict[str, list[Any]]:
    """List the contents of a collection as plain values for JSON."""
    motions = found.choose() if found.clips else []
    return {
        "postures": [f"{found.word}/{name}" for name in found.postures],
        "clips": [
            _row(f"{found.word}/{name}", motion, about)
            for (name, about), motion in zip(found.clips.items(), motions, strict=True)
        ],
    }


def _list_file(source: Source) -> tuple[list[str], list[Posture], dict[str, list[Any]]]:
    """List the clips of a file as `_list` does; return the names of its poses and these, too."""
    from motionmind.formats import read_clips
    from motionmind.retarget.retarget import own_skeleton

    motions = [own_skeleton(motion) for motion in read_clips(source.place)]
    poses = [motion for motion in motions if len(motion) == 1]
    return (
        [motion.name.partition("#")[2] or motion.name for motion in poses],
        [motion.posture(0) for motion in poses],
        {
            "postures": [spelled(source, motion) for motion in poses],
            "clips": [_row(spelled(source, motion), motion, "") for motion in motions if len(motion) > 1],
        },
    )


def _row(name: str, motion: Motion, about: str) -> dict[str, Any]:
    return {
        "name": name,
        "postures": len(motion),
        "seconds": float(motion.times[-1] - motion.times[0]),
        "about": about,
    }


def _print(word: str, postures: list[str], clips: list[dict[str, Any]]) -> None:
    """Print the named postures of a collection, then its clips."""
    click.echo(f"{word}: {count(len(postures), 'named posture')}, {count(len(clips), 'clip')}")
    for name in postures:
        click.echo(f"  {_display_name(name)}")
    if clips:
        last = _display_name(f"{clips[0]['name']}@{clips[0]['postures'] - 1}")
        click.echo(f"clips (postures count from 0, so the first clip ends with {last})")
    width = max((len(_display_name(clip["name"])) for clip in clips), default=0)
    for clip in clips:
        length = f"{clip['postures']:5} postures  {clip['seconds']:6.1f} s"
        click.echo(
            f"  {_display_name(clip['name']):{width}}  {length}  {displayed(clip['about'], _MAX_CHARS)}".rstrip()
        )


def _display_name(name: str) -> str:
    """Return a name to display; with #, in the quotes that some shells need."""
    shown = displayed(name, _MAX_CHARS)
    return shlex.quote(shown) if "#" in shown else shown


def _draw(word: str, names: Sequence[str], drawn: Sequence[Posture], output: Path) -> None:
    """Draw the named postures of a source."""
    import numpy as np

    from motionmind.body.motion import Motion
    from motionmind.files import write_atomically
    from motionmind.render.sheet import draw_sheet, png

    if not names:
        raise MotionMindError(f"{word}: has no named postures; `motionmind sheet` draws its clips")
    if any(posture.skeleton.difference(drawn[0].skeleton) is not None for posture in drawn):
        raise MotionMindError(f"{word}: its postures are of different bodies; `motionmind sheet` draws each")
    motion = Motion(
        drawn[0].skeleton,
        np.stack([posture.rotations for posture in drawn]),
        np.stack([posture.root for posture in drawn]),
        np.arange(float(len(drawn))),
        word,
    )
    write_atomically(output, png(draw_sheet(motion, captions=names)))
