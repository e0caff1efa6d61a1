"""The commands that vary a piece and review what comes of it: parse, call, print."""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from motionmind.cli.commands import INTERRUPTED, app
from motionmind.cli.files import MOVEMENT, all_or_none, asked, check_outputs, write
from motionmind.cli.options import (
    ANY,
    COUNT,
    FILE,
    HOME,
    JSON,
    OUTPUTS,
    RATE,
    Number,
    Numbers,
    Point,
    Span,
    example,
    passing,
    reading,
    searching,
    settings,
)
from motionmind.cli.printing import Interruption, note, print_review, progress, stillness
from motionmind.cli.sources import frames_of, holds_clips, in_corpus, movements
from motionmind.errors import MotionMindError
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.corpus.corpus import Facing
    from motionmind.tween.engine import Engine
    from motionmind.variation.variation import Variation

_STILL = 0.25  # of the steps: where more of them stay, the variation stands still to the eye
_EVEN = (".bvh", ".npz")  # formats whose frames are even in time


@app.command(epilog=example("motionmind vary macarena --attractor rossler -o variation.json"))
@click.argument("source", metavar="PIECE", type=ANY)
@click.option("-o", "--output", type=FILE, required=True, help=f"Where it goes: {OUTPUTS}; review takes .json.")
@click.option("--report", type=FILE, help="Where the report goes, as JSON; - prints it, alone.")
@click.option("--json", "as_json", is_flag=True, help="Print the report, as --report - does.")
@click.option("--clip", metavar="NAME", help="Which clip of a score or a corpus  [default: its only one]")
@click.option("--from", "begin", type=int, metavar="N", default=0, help="First frame; negative from the end.")
@click.option("--to", "end", type=int, metavar="N", default=-1, help="Last frame; negative from the end.")
@click.option(
    "--attractor",
    metavar="NAME",
    default="lorenz",
    help="The flow: lorenz, rossler, chua, duffing, halvorsen or thomas.",
)
@click.option("--parameter", multiple=True, metavar="NAME=VALUE", help="Of the flow, as rho=28; as often as you like.")
@click.option(
    "--nudge",
    type=Point(),
    metavar="X[,Y,Z]",
    default="0.1",
    help="How far from the piece's trajectory the variation's begins. 0 gives the piece back.",
)
@click.option(
    "--start", type=Point(), metavar="X,Y,Z", help="Where the piece's begins  [default: the flow's own start]"
)
@click.option(
    "--skip",
    type=click.IntRange(min=0),
    metavar="M",
    default=10,
    help="Points of the trajectories to leave out between two postures.",
)
@click.option("--step", type=Number(min=0, min_open=True), help="Of the integration  [default: the flow's own]")
@click.option(
    "--transient", type=click.IntRange(min=0), metavar="N", help="Steps to drop at first  [default: the flow's own]"
)
@click.option(
    "--length", type=COUNT, metavar="N", help="Postures of the variation  [default: as many as the piece has]"
)
@click.option("--rate", type=RATE, help="Postures a second of a recording  [default: the corpus's, else every frame]")
@click.option(
    "--corpus",
    "--smooth",
    "corpus",
    metavar="NAME",
    help="Corpus that says what is abrupt, and smooths it  [default: the piece's own, where it comes from one]",
)
@click.option("--alternatives", type=COUNT, metavar="K", default=3, help="Movements to find for each insertion.")
@searching
@reading
@HOME
@click.pass_context
def vary(
    context: click.Context,
    /,
    source: Path,
    output: Path,
    report: Path | None,
    as_json: bool,
    clip: str | None,
    begin: int,
    end: int,
    attractor: str,
    parameter: tuple[str, ...],
    nudge: tuple[float, ...],
    start: tuple[float, ...] | None,
    skip: int,
    step: float | None,
    transient: int | None,
    length: int | None,
    rate: float | None,
    corpus: str | None,
    alternatives: int,
    home: Path | None,
    joints: Path | None,
    unit: str | None,
    asf: Path | None,
    source_fps: float | None,
    **options: Any,
) -> None:
    """Vary a piece: its postures in the order of a chaotic trajectory, and what is abrupt smoothed.

    PIECE is a file of movement, a score, a corpus of one clip, or CORPUS/CLIP. Its postures are dealt out along a
    trajectory; another one, begun nearby, is read by which of them is nearest. Where that leaves the piece's order for
    a transition that the corpus does not know, movement is inserted, as by tween from the one posture to the other.

    Ctrl-C ends the smoothing: what it has found by then is written, and the exit code is 130.
    """
    from motionmind.chaos.flows import flow_of
    from motionmind.formats import write_atomically
    from motionmind.variation.piece import Piece
    from motionmind.variation.variation import vary as varied

    if report == Path("-"):
        report, as_json = None, True
    vias = [path for path, _ in passing(options["via"])]
    wanted = [(output, MOVEMENT + PICTURES), *([(report, ())] if report else [])]
    check_outputs(wanted, [source, *vias])
    flow = flow_of(attractor, **settings(parameter))
    wishes = asked(options)
    motion, own = _piece(source, clip, home, joints=joints, unit=unit, asf=asf, source_fps=source_fps)
    judge = corpus or own
    wish = _given(context, ["alternatives", *options.keys() - {"fps"}])
    if wish and not judge:
        raise click.UsageError(f"{wish} is for --corpus, which is not given", context)
    engine = _engine(judge, home) if judge else None
    if rate is None and engine and not holds_clips(source, home):
        rate = engine.corpus.rate
    frames = frames_of(source, len(motion), begin, end)
    facing = _facing(own, home) if own else engine.corpus.facing if engine else "free"
    piece = Piece.of(motion.slice(frames.start, frames.stop), rate, facing)
    with Interruption() as interruption:
        result = varied(
            piece,
            engine,
            flow=flow,
            nudge=nudge if len(nudge) > 1 else nudge[0],
            start=start,
            skip=skip,
            step=step,
            transient=transient,
            length=length,
            alternatives=alternatives,
            on_progress=interruption.told,
            watch=interruption.watch,
            **wishes,
        )
    files = [path for path, _ in wanted]
    with all_or_none(files):
        _write(output, result, options["fps"])
        if report:
            write_atomically(report, f"{json.dumps(result.report())}\n".encode())
    _tell(result, as_json)
    if not result.seams:
        note("it does not leave the piece's order: a larger --nudge or --length lets it")
    elif engine is None:
        note("no corpus says which transitions are abrupt, and none is smoothed: --corpus names one")
    counts = result.report()["counts"]
    if counts["stays"] > _STILL * (counts["postures"] - 1):
        note(f"{stillness(counts)}: another --start, a larger --skip or --step moves it")
    if not as_json:
        click.echo(f"written   {', '.join(map(click.format_filename, files))}")
    if interruption.asked:
        context.exit(INTERRUPTED)


@app.command(epilog=example("motionmind review variation.json --approve 6,7 --discard 8 --list"))
@click.argument("file", type=FILE)
@click.option("-o", "--output", type=FILE, help="Where the variation goes: .json  [default: FILE itself]")
@click.option("--undo", count=True, help="Take back the last edit, as often as it is given.")
@click.option(
    "--cut", type=Span(), metavar="A..B", help="Postures to take out, as --list numbers them, and to --paste."
)
@click.option("--paste", type=click.IntRange(min=0), metavar="N", help="The posture before which they go.")
@click.option(
    "--smooth", metavar="CORPUS", help="Judge and smooth, by this corpus, the seams that are not yet or are discarded."
)
@click.option("--replace", type=COUNT, metavar="SEAM", help="Seam at which --alternative is to stand.")
@click.option("--alternative", type=COUNT, metavar="K", help="Which of the movements found for it.")
@click.option("--approve", type=Numbers(), metavar="SEAMS", help="Seams that are good, as 1,3; or all.")
@click.option("--discard", type=Numbers(), metavar="SEAMS", help="Seams whose insertion is left out, as 2; or all.")
@click.option("--list", "listing", is_flag=True, help="Show the seams, after the edits.")
@JSON
@click.option("--alternatives", type=COUNT, metavar="K", default=3, help="Movements that --smooth finds for a seam.")
@searching
@HOME
@click.pass_context
def review(
    context: click.Context,
    /,
    file: Path,
    output: Path | None,
    undo: int,
    cut: tuple[int, int] | None,
    paste: int | None,
    smooth: str | None,
    replace: int | None,
    alternative: int | None,
    approve: tuple[int, ...] | str | None,
    discard: tuple[int, ...] | str | None,
    listing: bool,
    as_json: bool,
    alternatives: int,
    home: Path | None,
    **options: Any,
) -> None:
    """Look through a variation that vary wrote, and edit it.

    Edits are made in the order in which they stand below. None of them loses anything: FILE keeps the piece, the
    variation, all that was found and all that was decided, and --undo takes back one edit after the other. Its movement
    is that with all insertions but those discarded, which render, sheet and convert take.

    Seams keep their numbers; postures are numbered from 0. The options from --alternatives on are for --smooth.
    """
    if (cut is None) != (paste is None):
        raise click.UsageError("--cut says what, and --paste where to: give both", context)
    if (replace is None) != (alternative is None):
        raise click.UsageError("--replace says where, and --alternative what by: give both", context)
    wish = _given(context, ["alternatives", *options])
    if wish and not smooth:
        raise click.UsageError(f"{wish} is for --smooth, which is not given", context)
    from motionmind.variation.variation_json import read_variation, write_variation

    edits = undo or cut or smooth or replace or approve or discard
    if output and not edits:
        raise click.UsageError("-o is for what was edited, and nothing is", context)
    check_outputs([(output, (".json",))] if output else [], [])
    found = before = read_variation(file)
    for _ in range(undo):
        found = found.undo()
    if cut and paste is not None:
        found = found.cut(*cut, paste)
    interruption = Interruption()
    if smooth:
        wishes, engine = asked(options), _engine(smooth, home)
        with interruption:
            smoothed = found.smooth(
                engine, alternatives=alternatives, on_progress=interruption.told, watch=interruption.watch, **wishes
            )
        if smoothed is found and not interruption.asked:
            is_left = any(seam.is_abrupt for seam in found.seams)
            note(
                "nothing new was found for what is left to smooth"
                if is_left
                else "nothing is left to smooth: --discard what is to be made anew"
            )
        found = smoothed
    if replace and alternative:
        found = found.replace(replace, alternative)
    if approve:
        found = found.approve(*_meant(found, approve))
    if discard:
        found = found.discard(*_meant(found, discard))
    is_written = found.edits != before.edits or output is not None
    if is_written:
        write_variation(output or file, found)
    if listing or as_json or not edits:
        _tell(found, as_json)
    if edits and found.edits == before.edits:
        note("nothing changed")
    if is_written and not as_json:
        click.echo(f"written   {click.format_filename(output or file)}")
    if interruption.asked:
        context.exit(INTERRUPTED)


@app.command(epilog=example("motionmind attractor --of variation.json -o attractor.png"))
@click.option("--of", "variation", type=FILE, required=True, help="A variation that vary wrote.")
@click.option(
    "-o", "--output", type=FILE, required=True, help="Where it goes: a picture (.png, .svg), or a page (.html)."
)
def attractor(variation: Path, output: Path) -> None:
    """Draw a variation on its attractor: where the piece's postures live, and the way through them.

    Both trajectories, the cell of each posture, some of the postures, and both itineraries: where the variation parts
    from the piece, and where it jumps. In .svg the pointer tells more. The page turns in three dimensions, and a body
    dances the variation beside it.
    """
    from motionmind.plots.attractor import ATTRACTORS, write_attractor
    from motionmind.variation.variation_json import read_variation

    check_outputs([(output, ATTRACTORS)], [variation])
    found = read_variation(variation)
    write_attractor(output, found)
    click.echo(f"{output}: {found.course.flow}, {len(found.piece)} sites, {len(found.order)} points")


def _given(context: click.Context, names: Collection[str]) -> str | None:
    """The first of some options that stands on the command line, as it is written there; None where none does."""
    for option in context.command.params:
        if option.name in names and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE:
            return option.opts[0]
    return None


def _piece(source: Path, clip: str | None, home: Path | None, **given: Any) -> tuple[Motion, str | None]:
    """The movement to vary, and the corpus that it is a clip of, if any."""
    found = movements(source, (clip,) if clip else (), home, **given)
    if len(found) != 1:
        raise MotionMindError(f"{source}: holds {len(found)} clips; choose one by --clip")
    return found[0], in_corpus(source, home)[0] if holds_clips(
        source, home
    ) and source.suffix.lower() != ".score" else None


def _facing(corpus: str, home: Path | None) -> Facing:
    """Whether what a corpus holds may face anywhere."""
    from motionmind.corpus.store import locate, read_manifest

    facing: Facing = read_manifest(locate(corpus, home)).get("facing", "free")
    return facing


def _engine(corpus: str, home: Path | None) -> Engine:
    """What was learned from a corpus; on a terminal it says what the first search of all takes."""
    from motionmind.jit import is_compiled
    from motionmind.tween.engine import Engine

    if not is_compiled("search"):
        progress("compiling the search, which takes half a minute, once")
    return Engine.load(corpus, home)


def _meant(variation: Variation, seams: tuple[int, ...] | str) -> tuple[int, ...]:
    """The seams of these numbers; of "all" those where an insertion stands."""
    return tuple(one.number for one in variation.seams if one.insertion) if isinstance(seams, str) else seams


def _write(path: Path, variation: Variation, fps: float) -> None:
    """A variation, whole as JSON; as any other file its movement, even in time where that has to be."""
    from motionmind.variation.variation_json import write_variation

    suffix = path.suffix.lower()
    if suffix == ".json":
        write_variation(path, variation)
    else:
        motion = variation.motion()
        write(path, motion.resample(fps) if suffix in _EVEN else motion)


def _tell(variation: Variation, as_json: bool) -> None:
    found = variation.report()
    if as_json:
        click.echo(json.dumps(found))
    else:
        print_review(found)
