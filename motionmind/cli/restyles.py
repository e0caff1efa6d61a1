"""The restyle command: movement in the style of a corpus through the postures of a recording; compose does the same."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.delivery import Delivery, check_delivery, for_program, on_rig, rig_files
from motionmind.cli.files import MOTION_SUFFIXES, check_outputs, read_mapping
from motionmind.cli.options import HOME, OUTPUT_KINDS, Section, command, option, outputs, reading
from motionmind.cli.pictures import CLIP, FIRST, LAST
from motionmind.cli.printing import Interruption, count, print_written
from motionmind.cli.search_options import searching
from motionmind.cli.sources import parse_movement, read_movement, select_part
from motionmind.cli.types import FILE, Number
from motionmind.cli.warming import preparing
from motionmind.display import displayed
from motionmind.files import all_or_none, write_atomically
from motionmind.render import PICTURES
from motionmind.transcription import LONGEST_MOVE_S, TOLERANCE_RANGE_DEG

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.formats._rig_file import RigFile
    from motionmind.names.spelling import PostureName
    from motionmind.transcription import Restyled

_SEARCH_FIELDS = ("novelty", "liveliness", "strict", "bridge_price", "guide")


@command("motionmind restyle ballet/plies --corpus karate --to 8 -o plies-in-karate.bvh")
@click.argument("source", shell_complete=completion.movement)
@option(
    "--corpus",
    section=Section.CORPORA,
    metavar="NAME",
    required=True,
    shell_complete=completion.corpora,
    help="Corpus whose style to dance in, by name or folder.",
)
@outputs(f"File to write: {OUTPUT_KINDS}.")
@for_program("Program to open .bvh and .glb files in: they get the unit, frames per second and root that it expects.")
@on_rig("File with the rig for .bvh files (its skeleton) or .glb files (its character)  [default: SOURCE]")
@option(
    "--report", section=Section.OUTPUT, type=FILE, help="File of the costs and of the distances over time, as JSON."
)
@CLIP
@FIRST
@LAST
@option(
    "--shortest",
    section=Section.MOTION,
    type=Number(0.0, LONGEST_MOVE_S),
    default=0.5,
    metavar="S",
    help="Least seconds from a kept posture to the next; a longer time leaves more to the corpus.",
)
@option(
    "--tolerance",
    section=Section.MOTION,
    type=Number(*TOLERANCE_RANGE_DEG),
    default=12.0,
    metavar="DEGREES",
    help="Deviation of a bone's direction between kept postures joined evenly; a greater one keeps fewer of them.",
)
@searching(only=_SEARCH_FIELDS)
@reading
@HOME
def restyle(
    source: str,
    corpus: str,
    outputs: tuple[Path, ...],
    program: str | None,
    rig: Path | None,
    report: Path | None,
    name: str | None,
    start: int,
    end: int,
    shortest: float,
    tolerance: float,
    home: Path | None,
    **options: Any,
) -> None:
    """Dance a recording in the style of a corpus, between its own key postures.

    SOURCE is a motion file, a score, a corpus by name or folder, CORPUS/CLIP, or a clip of a glTF file such as
    'hero.glb#Dance'. Key postures, chosen as by transcribe, are kept where and when they were; the movement from each
    to the next is a tween. Output says what is kept, and what comes from the corpus.

    Ctrl-C ends the search: the command writes the best movement found, and exits with code 130.
    """
    from motionmind.transcription import restyle as to_style
    from motionmind.tween.engine import Engine

    searched = {field: options.pop(field) for field in _SEARCH_FIELDS}
    named = parse_movement(source, home)
    files = [(path, MOTION_SUFFIXES + PICTURES) for path in outputs]
    check_outputs(files + ([(report, ())] if report else []), [*named.source.paths, *rig_files(rig)])
    taker = check_delivery(outputs, program, rig)
    whole = read_movement(named.source, name, home, **options)
    frames = select_part(named, whole, start, end)
    on = _find_rig(rig, named, frames, outputs, options)
    with preparing():
        engine = Engine.load(corpus, home)
        with Interruption() as interruption:
            found = to_style(
                whole.slice(frames.start, frames.stop),
                engine,
                tolerance,
                shortest=shortest,
                watch=interruption.watch,
                on_progress=interruption.on_progress,
                **searched,
            )
    delivery = Delivery(taker, on, taker.fps if taker else None)
    with all_or_none():
        for path in outputs:
            delivery.write(path, found.motion)
        if report:
            write_atomically(report, found.report())
    print_restyled(found, displayed(engine.corpus.name))
    print_written([*outputs, *([report] if report else [])])
    delivery.print(outputs)
    interruption.finish()


def pass_through(postures: Motion, corpus: str, home: Path | None, fps: float | None) -> tuple[Restyled, Interruption]:
    """Find movement through postures at their times, in the style of a corpus, and print what is kept.

    Returns:
        The movement, and the context in which Ctrl-C ended the search.
    """
    from motionmind.transcription import pass_through as found_through
    from motionmind.tween.engine import Engine
    from motionmind.tween.request import TweenRequest

    request = TweenRequest() if fps is None else TweenRequest(fps=fps)
    with preparing():
        engine = Engine.load(corpus, home)
        with Interruption() as interruption:
            found = found_through(
                postures, engine, request, watch=interruption.watch, on_progress=interruption.on_progress
            )
    print_restyled(found, displayed(engine.corpus.name))
    return found, interruption


def print_restyled(found: Restyled, corpus: str) -> None:
    """Print what a restyled movement keeps, and what comes from the corpus."""
    for line in _lines(found, corpus):
        click.echo(line)


def _lines(found: Restyled, corpus: str) -> Iterator[str]:
    import numpy as np

    off, most = np.percentile(found.centimetres, [95.0, 100.0])
    yield (
        f"kept      {count(len(found.keys), 'posture')} in {found.motion.times[-1]:.1f} s, at their times; pelvis "
        f"within {off:.0f} cm of its path in 95 % of frames, {most:.0f} cm at most"
    )
    half, off = np.percentile(found.degrees, [50.0, 95.0])
    yield f"between   joints within {half:.1f} degrees on average in half of the frames, {off:.1f} in 95 %"
    words = {
        "attested": ("{:.0%}", f"of the joints' transitions in {corpus}"),
        "slide": ("{:.2f}", "cm a frame of feet near the floor"),
    }
    for name, (form, unit) in words.items():
        if np.isfinite(found.figures.get(name, np.nan)).all():
            before, after = map(form.format, found.figures[name])
            yield f"{name:9} {after} {unit}; {before} before"
    optimal = sum(link.status == "optimal" for link in found.links)
    yield f"cost      {found.cost:.0f} nats, {optimal} of {count(len(found.links), 'tween')} optimal"
    parts = Counter(part for link in found.links for part in link.faster[:1])
    if parts:
        part, _ = parts.most_common(1)[0]
        number = f"{parts.total()} of {count(len(found.links), 'tween')}"
        yield f"faster    than anything in {corpus} in {number}, mostly the {displayed(part.replace('_', ' '))}"


def _find_rig(
    rig: Path | None, named: PostureName, frames: range, outputs: tuple[Path, ...], options: dict[str, Any]
) -> RigFile | None:
    """Return the rig of --rig, or else that of the source, if an output is a file of the same kind; or None."""
    from motionmind.formats.rig_files import RIG_SUFFIXES, read_rig

    given = {"unit": options["unit"], "joints": read_mapping(options["joints"]), "up": options["up"]}
    if rig:
        return read_rig(rig, **given)
    own = next(iter(named.source.paths), Path()).suffix.lower()
    if named.source.kind != "file" or own not in {path.suffix.lower() for path in outputs} & set(RIG_SUFFIXES):
        return None
    return read_rig(named.source.file, (frames.start, frames.stop - 1), **given)
