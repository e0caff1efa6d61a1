"""The commands that build corpora and look at them."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import click

from motionmind.cli import completion
from motionmind.cli.changes import DETAILS, FLIPS, PERFORMER, add, note_kept, remove, take_files
from motionmind.cli.files import clip_names, read_mapping
from motionmind.cli.options import (
    HOME,
    JSON,
    Section,
    command,
    group,
    option,
    reading,
    show_help_without_command,
)
from motionmind.cli.printing import count, format_repairs, note, print_check, print_origins
from motionmind.cli.registry import INDEX, fetch, print_index, publish
from motionmind.cli.types import COUNT, FILE, NATURAL, RATE, Number
from motionmind.cli.warming import prepare
from motionmind.cli.words import parse_mixture, parse_tolerances
from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError

_MAX_TEXT_CHARS = 300  # characters of a title, an author, a source: sentences rather than names


@group("motionmind corpus check ballet", "corpus")
@click.pass_context
def corpora(context: click.Context) -> None:
    """Build corpora from movement, and look at them."""
    show_help_without_command(context)


@command("motionmind corpus build mine *.bvh --tolerance 15 --facing free --skip 1")
@click.argument("name")
@click.argument("files", type=FILE, nargs=-1)
@option(
    "--rate",
    section=Section.LEARN,
    type=RATE,
    help="Take N postures per second  [default: 5 of recordings, every frame of scores and keyframes]",
)
@option(
    "--skip",
    section=Section.LEARN,
    type=NATURAL,
    metavar="N",
    default=0,
    help="Drop N frames at each clip's start, such as a T-pose.",
)
@option(
    "--mirror", section=Section.LEARN, is_flag=True, help="Learn from all clips with left and right exchanged, too."
)
@option(
    "--reverse",
    section=Section.LEARN,
    type=Number(0, 100),
    metavar="PRICE",
    help="Learn from all clips backwards, too; a move then costs PRICE more nats.",
)
@option(
    "--mix",
    section=Section.LEARN,
    multiple=True,
    metavar="CORPUS[:WEIGHT]",
    shell_complete=completion.corpora,
    help="Learn from another corpus, too, and count each of its moves WEIGHT times  [default: 1]. Repeatable.",
)
@FLIPS
@option(
    "--flip-angle",
    section=Section.LEARN,
    advanced=True,
    type=Number(0, 180),
    default=45.0,
    help="Call N degrees in one frame a jump.",
)
@option(
    "--tolerance",
    section=Section.STATES,
    multiple=True,
    metavar="DEGREES",
    default=("15",),
    help="Let orientations of one state lie this far apart, or JOINT=DEGREES for one joint. Repeatable.",
)
@option(
    "--discretize",
    section=Section.STATES,
    metavar="KIND",
    default="codebook",
    help="Find states by codebook, quaternion, euler, or a library by name or file.",
)
@option(
    "--facing",
    section=Section.STATES,
    type=click.Choice(["free", "stage"]),
    default="free",
    help="Treat postures that differ only in where they face as one (free), or as two (stage).",
)
@reading
@option(
    "--strict-files",
    section=Section.INPUT,
    advanced=True,
    is_flag=True,
    help="End with the first file that would be left out.",
)
@option(
    "--workers",
    section=Section.WORKERS,
    type=COUNT,
    metavar="N",
    default=1,
    help="Read with N processes, and learn with N threads.",
)
@option(
    "--scheduler",
    section=Section.WORKERS,
    advanced=True,
    metavar="ADDRESS",
    help="Read with the workers of a Dask cluster, by its scheduler: tcp://HOST:8786. They share this disk.",
)
@option("--replace", section=Section.OUTPUT, is_flag=True, help="Replace your corpus NAME; corpus restore undoes this.")
@DETAILS
@option("--title", section=Section.ABOUT, default="", show_default=False, help="Describe the corpus in a line.")
@option("--author", section=Section.ABOUT, default="", show_default=False, help="Name who made the movement.")
@option("--source", section=Section.ABOUT, default="", show_default=False, help="State where the movement comes from.")
@PERFORMER
@option("--licence", section=Section.ABOUT, default="", show_default=False, help="State the licence of the movement.")
@option("--citation", section=Section.ABOUT, default="", show_default=False, help="State how to cite the corpus.")
@HOME
def build(
    name: str,
    files: tuple[Path, ...],
    home: Path | None,
    rate: float | None,
    tolerance: tuple[str, ...],
    discretize: str,
    flip_angle: float,
    mix: tuple[str, ...],
    joints: Path | None,
    unit: str | None,
    asf: Path | None,
    source_fps: float | None,
    up: str | None,
    replace: bool,
    details: bool,
    workers: int,
    scheduler: str | None,
    strict_files: bool,
    **options: Any,
) -> None:
    """Learn a corpus from movement.

    Learn it from files, from other corpora (--mix), or from both. The files may have any formats, scores included; a
    glTF file gives all its clips, or one as 'hero.glb#Dance'. The build leaves out unreadable files, and files whose
    joints differ from those of most.
    """
    if not (files or mix):
        raise click.UsageError("Missing argument 'FILES...', or --mix.", click.get_current_context())
    from motionmind.corpus.recordings import Taking
    from motionmind.corpus.shards import Reading, shards_of
    from motionmind.corpus.store import MANIFEST, locate, place_for
    from motionmind.discretize import make_discretization
    from motionmind.executors.cluster import cluster
    from motionmind.executors.opening import open_team
    from motionmind.executors.workshop import Workshop
    from motionmind.tween.engine import Engine

    place = place_for(name, home)
    if (place / MANIFEST).exists() and not replace:
        raise MotionMindError(f"you have a corpus {name!r} already ({_describe(place)}); --replace replaces it")
    others = parse_mixture(mix)
    discretization = make_discretization(discretize, *parse_tolerances(tolerance, 15.0))
    takes = Taking("auto" if rate is None else rate, options["skip"], options["flips"], flip_angle, options["mirror"])
    reading = Reading(takes, read_mapping(joints), unit, str(asf) if asf else None, source_fps, up)
    if scheduler:  # whose workers are in other folders
        files = tuple(file.absolute() for file in files)
    if others:  # a bundled one is learned as it is loaded
        for other in others:
            locate(other, home)
        prepare()
    opened = cluster(scheduler) if scheduler else open_team(workers)
    with opened as team, shards_of(name, home) as folder:
        engine = Engine.fit(
            take_files(clip_names(files), reading, folder, team, strict=strict_files),
            name=name,
            home=home,
            rate=takes.rate,
            discretization=discretization,
            workshop=Workshop.of(workers, folder),
            flip_degrees=flip_angle,
            mix=others,
            **options,
        )
        engine.save(place)
    print_check(engine.check(), with_states=details, with_details=details)
    click.echo(f"built {displayed_path(place)}")
    note_kept(place)


def _describe(place: Path) -> str:
    """Describe the built corpus in a folder in a few words: its number of clips, and when it was built or changed."""
    from motionmind.corpus.manifest import count_clips
    from motionmind.corpus.store import MANIFEST, read_manifest

    changed = time.strftime("%Y-%m-%d %H:%M", time.localtime((place / MANIFEST).stat().st_mtime))
    try:
        return f"{count(count_clips(read_manifest(place)), 'clip')}, {changed}"
    except MotionMindError:
        return f"unreadable, {changed}"


@command("motionmind corpus restore mine")
@click.argument("name", shell_complete=completion.own_corpora)
@HOME
def restore(name: str, home: Path | None) -> None:
    """Bring back the corpus that the last build, addition or removal replaced.

    Repeat it to return to the newer one.
    """
    from motionmind.corpus import store

    place = store.restore(name, home)
    click.echo(f"restored {displayed_path(place)} ({_describe(place).partition(',')[0]})")


@command("motionmind corpus list --remote", "list")
@JSON
@option("--remote", section=Section.CORPORA, is_flag=True, help="List the corpora that can be fetched, and recipes.")
@INDEX
@HOME
def list_corpora(as_json: bool, remote: bool, index: str | None, home: Path | None) -> None:
    """List all corpora, bundled and your own; or, with --remote, published corpora."""
    from motionmind.corpus.store import list_corpora, read_manifest

    if remote:
        print_index(index, as_json=as_json)
        return
    found = []
    for name, folder in list_corpora(home).items():
        try:
            title = str(read_manifest(folder).get("title") or "")
        except MotionMindError as error:
            title = "cannot be read"
            note(str(error))
        found.append({"name": name, "title": title, "folder": str(folder)})
    if as_json:
        click.echo(json.dumps(found))
        return
    width = max((len(displayed(entry["name"])) for entry in found), default=0)
    for entry in found:
        click.echo(
            f"{displayed(entry['name']):{width}}  {displayed(entry['title'], _MAX_TEXT_CHARS) or '-'}  "
            f"({displayed_path(entry['folder'])})"
        )


@command("motionmind corpus info ballet --json")
@click.argument("name", shell_complete=completion.corpora)
@JSON
@HOME
def info(name: str, as_json: bool, home: Path | None) -> None:
    """Describe a corpus: where it comes from and how large it is."""
    from motionmind.tween.engine import Engine

    found = Engine.load(name, home).info()
    if as_json:
        click.echo(json.dumps(found))
        return
    for key in ("name", "title", "author", "source", "licence", "citation", "skeleton", "facing", "rate"):
        click.echo(f"{key:10} {displayed(str(found[key]), _MAX_TEXT_CHARS) if found[key] not in (None, '') else '-'}")
    click.echo(
        f"{'clips':10} {len(found['clips'])}, {count(found['postures'], 'posture')}, {count(found['moves'], 'move')}"
    )
    if performers := {
        clip["performer"]: None for clip in found["clips"] if clip["performer"] not in ("", found["author"])
    }:
        click.echo(f"{'performers':10} {displayed(', '.join(performers), _MAX_TEXT_CHARS)}")
    if found["repairs"]:
        click.echo(f"{'repaired':10} {format_repairs(found)}")
    print_origins(found)
    width = max([16, *(len(displayed(clip["name"])) for clip in found["clips"])])
    for clip in found["clips"]:
        about = displayed(clip["about"], _MAX_TEXT_CHARS)
        click.echo(f"  {displayed(clip['name']):{width}} {clip['postures']:5}  {about}".rstrip())


@command("motionmind corpus check ballet --pairs 500 --seed 1")
@click.argument("name", shell_complete=completion.corpora)
@JSON
@option("--details", section=Section.OUTPUT, is_flag=True, help="Print each recording with faults.")
@option(
    "--pairs",
    section=Section.CHECK,
    type=COUNT,
    metavar="N",
    default=2000,
    help="Try to join N random pairs of postures.",
)
@option("--seed", section=Section.CHECK, type=NATURAL, metavar="N", default=0, help="Seed the random pairs.")
@HOME
def check(name: str, as_json: bool, details: bool, pairs: int, seed: int, home: Path | None) -> None:
    """Check how well a corpus hangs together.

    Count states and transitions, try to join random pairs of postures, and find faults of the recordings.
    """
    from motionmind.tween.engine import Engine

    found = Engine.load(name, home).check(pairs, seed)
    if as_json:
        click.echo(json.dumps(found))
    else:
        print_check(found, with_details=details)


@command("motionmind corpus rename mine dancer")
@click.argument("name", shell_complete=completion.own_corpora)
@click.argument("new")
@HOME
def rename(name: str, new: str, home: Path | None) -> None:
    """Rename a corpus that you built.

    Corpora that were mixed from it keep its old name in their reports.
    """
    from motionmind.corpus import store

    place = store.rename(name, new, home)
    click.echo(f"renamed {displayed(name)} to {displayed_path(place)}")


@command("motionmind corpus delete dancer --yes")
@click.argument("name", shell_complete=completion.own_corpora)
@option("--yes", "is_sure", section=Section.EDITS, is_flag=True, help="Delete it; there is no way back.")
@HOME
def delete(name: str, is_sure: bool, home: Path | None) -> None:
    """Delete a corpus that you built, or what is left of a build that was broken off."""
    from motionmind.corpus import store

    place = store.removable(name, home)
    if not is_sure:
        raise MotionMindError(f"{place}: would be deleted for good; say --yes")
    store.delete(name, home)
    if place.exists():
        raise MotionMindError(f"{place}: another build is at work there, and it stays")
    click.echo(f"deleted {displayed_path(place)}")


for _command in (build, add, remove, restore, list_corpora, info, check, rename, delete, publish, fetch):
    corpora.add_command(_command)
