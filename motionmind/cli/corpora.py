"""The commands on corpora: parse, call, print."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from motionmind.cli.commands import app, help_alone
from motionmind.cli.files import clip_names, read, read_mapping
from motionmind.cli.options import (
    COUNT,
    FILE,
    HOME,
    JSON,
    RATE,
    InOrder,
    Number,
    example,
    mixture,
    reading,
    tolerances,
)
from motionmind.cli.printing import note, print_check, print_origins, progress
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.corpus.corpus import Facing
    from motionmind.corpus.gather import Flips


@app.group("corpus", cls=InOrder, invoke_without_command=True, epilog=example("motionmind corpus check ballet"))
@click.pass_context
def corpora(context: click.Context) -> None:
    """Build corpora from movement, and look at them."""
    help_alone(context)


@corpora.command(epilog=example("motionmind corpus build mine *.bvh --rate 5 --tolerance 15 --facing free --skip 1"))
@click.argument("name")
@click.argument("files", type=FILE, nargs=-1)
@click.option("--rate", type=RATE, help="Postures a second  [default: every frame]")
@click.option(
    "--tolerance",
    multiple=True,
    metavar="DEGREES",
    default=("15",),
    help="How far apart orientations of one state may lie; also JOINT=DEGREES, as often as you like.",
)
@click.option(
    "--discretize",
    metavar="KIND",
    default="codebook",
    help="codebook, quaternion, euler, or a library by name or file.",
)
@click.option(
    "--facing",
    type=click.Choice(["free", "stage"]),
    default="free",
    help="Whether postures that differ in where they face are one (free), or two (stage).",
)
@click.option(
    "--skip",
    type=click.IntRange(min=0),
    metavar="N",
    default=0,
    help="Frames to drop at each clip's start, as a T-pose.",
)
@click.option(
    "--flips",
    type=click.Choice(["split", "keep", "drop"]),
    default="split",
    help="Where a joint jumps: split the clip there, keep it, or drop it.",
)
@click.option("--flip-angle", type=Number(0, 180), default=45.0, help="Degrees in one frame that are a jump.")
@click.option("--mirror", is_flag=True, help="Learn from all clips with left and right exchanged, too.")
@click.option(
    "--reverse",
    type=Number(0, 100),
    metavar="PRICE",
    help="Learn from all clips backwards, too: there a move costs PRICE more nats.",
)
@click.option(
    "--mix",
    multiple=True,
    metavar="CORPUS[:WEIGHT]",
    help="Learn from another corpus, too, each move of which counts WEIGHT where those of FILES count 1  [default: 1]; "
    "as often as you like.",
)
@reading
@click.option("--title", default="", show_default=False, help="A line on what it is.")
@click.option("--author", default="", show_default=False, help="Who made the movement.")
@click.option("--source", default="", show_default=False, help="Where it comes from.")
@click.option("--licence", default="", show_default=False, help="Under which it may be used.")
@HOME
def build(
    name: str,
    files: tuple[Path, ...],
    rate: float | None,
    tolerance: tuple[str, ...],
    discretize: str,
    facing: Facing,
    skip: int,
    flips: Flips,
    flip_angle: float,
    mirror: bool,
    reverse: float | None,
    mix: tuple[str, ...],
    joints: Path | None,
    unit: str | None,
    asf: Path | None,
    source_fps: float | None,
    home: Path | None,
    title: str,
    author: str,
    source: str,
    licence: str,
) -> None:
    """Learn a corpus from movement files, from other corpora (--mix), or from both.

    They may be of any mix of formats, scores too, all on the same joints. A corpus of yours with the same name is
    replaced.
    """
    if not (files or mix):
        raise click.UsageError("Missing argument 'FILES...', or --mix.", click.get_current_context())
    from motionmind.corpus.store import place_for
    from motionmind.discretize import make_discretization
    from motionmind.notation.compose import motions
    from motionmind.notation.read import read_score
    from motionmind.retarget.retarget import own_skeleton
    from motionmind.tween.engine import Engine

    place = place_for(name, home)
    others = mixture(mix)
    discretization = make_discretization(discretize, *tolerances(tolerance, 15.0))
    mapping = read_mapping(joints)
    names = clip_names(files)

    def clips() -> Iterator[Motion]:
        with click.progressbar(files, label="reading", file=sys.stderr, hidden=not sys.stderr.isatty()) as bar:
            for file in bar:
                if file.suffix.lower() == ".score":
                    yield from motions(read_score(file))
                else:
                    yield own_skeleton(replace(read(file, unit, asf, source_fps), name=names[file]), mapping)
        progress("learning")

    engine = Engine.fit(
        clips(),
        name=name,
        rate=rate,
        skip=skip,
        facing=facing,
        discretization=discretization,
        flips=flips,
        flip_degrees=flip_angle,
        mirror=mirror,
        reverse=reverse,
        mix=others,
        home=home,
        title=title,
        author=author,
        source=source,
        licence=licence,
    )
    engine.save(place)
    print_check(engine.check())
    click.echo(f"built {place}")


@corpora.command("list", epilog=example("motionmind corpus list"))
@JSON
@HOME
def list_corpora(as_json: bool, home: Path | None) -> None:
    """List the corpora that there are, bundled and your own."""
    from motionmind.corpus.store import known, read_manifest

    found = []
    for name, folder in known(home).items():
        try:
            title = str(read_manifest(folder).get("title") or "")
        except MotionMindError as error:
            title = "cannot be read"
            note(str(error))
        found.append({"name": name, "title": title, "folder": str(folder)})
    if as_json:
        click.echo(json.dumps(found))
        return
    width = max((len(entry["name"]) for entry in found), default=0)
    for entry in found:
        click.echo(f"{entry['name']:{width}}  {entry['title'] or '-'}  ({entry['folder']})")


@corpora.command(epilog=example("motionmind corpus info ballet --json"))
@click.argument("name")
@JSON
@HOME
def info(name: str, as_json: bool, home: Path | None) -> None:
    """Say what a corpus is and how large."""
    from motionmind.tween.engine import Engine

    found = Engine.load(name, home).info()
    if as_json:
        click.echo(json.dumps(found))
        return
    for key in ("name", "title", "author", "source", "licence", "skeleton", "facing", "rate"):
        click.echo(f"{key:10} {found[key] if found[key] not in (None, '') else '-'}")
    click.echo(f"{'clips':10} {len(found['clips'])}, {found['postures']} postures, {found['moves']} moves")
    print_origins(found)
    width = max([16, *(len(clip["name"]) for clip in found["clips"])])
    for clip in found["clips"]:
        click.echo(f"  {clip['name']:{width}} {clip['postures']:5}  {clip['about']}".rstrip())


@corpora.command(epilog=example("motionmind corpus check ballet --pairs 500 --seed 1"))
@click.argument("name")
@JSON
@click.option("--pairs", type=COUNT, metavar="N", default=2000, help="Random pairs of postures to try to join.")
@click.option("--seed", type=click.IntRange(min=0), metavar="N", default=0, help="Of the random pairs.")
@HOME
def check(name: str, as_json: bool, pairs: int, seed: int, home: Path | None) -> None:
    """Say how well a corpus hangs together, and its recordings' faults."""
    from motionmind.tween.engine import Engine

    found = Engine.load(name, home).check(pairs, seed)
    if as_json:
        click.echo(json.dumps(found))
    else:
        print_check(found)
