"""The commands that vary a piece and draw variations."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import EVEN_SUFFIXES, MOTION_SUFFIXES, check_outputs, note_licences, write
from motionmind.cli.options import HOME, OUTPUT_KINDS, Section, command, given_option, option, output, outputs, reading
from motionmind.cli.printing import Interruption, note, print_written
from motionmind.cli.review_tables import print_advice, print_review
from motionmind.cli.search_options import SEARCH_OPTIONS, request_options, searching, via_sources
from motionmind.cli.sources import parse_movement, read_movement, select_part
from motionmind.cli.tweens import INTERRUPTED
from motionmind.cli.types import COUNT, FILE, FRAME, NATURAL, POSITIVE, RATE, Number, Point
from motionmind.cli.warming import prepare
from motionmind.cli.words import parse_parameters
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError, enumerated
from motionmind.files import all_or_none, sha256_of
from motionmind.render import PICTURES
from motionmind.variation.orders import ORDERS, RANDOM, REFUSED, By

if TYPE_CHECKING:
    from motionmind.corpus.corpus import Facing
    from motionmind.names.spelling import PostureName
    from motionmind.tween.engine import Engine
    from motionmind.variation.piece import Piece
    from motionmind.variation.variation import Variation


@command("motionmind vary macarena --attractor rossler --inserted 0.3 -o variation.json")
@click.argument("source", metavar="PIECE", shell_complete=completion.movement)
@outputs(f"Write {OUTPUT_KINDS}; review takes .json.")
@option("--report", section=Section.OUTPUT, type=FILE, help="Write the report as JSON; - prints it.")
@option("--json", "as_json", section=Section.OUTPUT, is_flag=True, help="Print the report as JSON, like --report -.")
@option(
    "--corpus",
    "--smooth",
    "corpus",
    section=Section.CORPORA,
    metavar="NAME",
    shell_complete=completion.corpora,
    help="Judge what is abrupt, and smooth it, by this corpus  [default: the corpus that the piece comes from, if any]",
)
@HOME
@option(
    "--clip",
    section=Section.PART,
    metavar="NAME",
    help="Take this clip of a score or a corpus  [default: its only one]",
)
@option(
    "--from",
    "begin",
    section=Section.PART,
    type=FRAME,
    metavar="N",
    default=0,
    help="Begin at frame N, counted from the end if negative; a recording begins where those of the corpus do.",
)
@option(
    "--to",
    "end",
    section=Section.PART,
    type=FRAME,
    metavar="N",
    default=-1,
    help="End at frame N, counted from the end if negative.",
)
@option(
    "--rate",
    section=Section.PART,
    type=RATE,
    help="Take N postures per second of a recording  [default: the corpus's rate, else every frame]",
)
@option(
    "--by",
    section=Section.TRAJECTORY,
    type=click.Choice(ORDERS),
    default="attractor",
    help="Order the postures by the attractor or, to compare, by a control: in random order (shuffle), in random order "
    "of the attractor's chunks (chunks), each body part in its own random order (quadrants), or along the trajectory "
    "by Dabby's mapping (dabby). Random orders have a --seed.",
)
@option(
    "--attractor",
    section=Section.TRAJECTORY,
    metavar="NAME",
    default="lorenz",
    shell_complete=completion.flows,
    help=f"Follow this flow: {', '.join(completion.FLOWS[:-1])} or {completion.FLOWS[-1]}.",
)
@option(
    "--parameter",
    section=Section.TRAJECTORY,
    multiple=True,
    metavar="NAME=VALUE",
    help="Set a parameter of the flow, such as rho=28. Repeatable.",
)
@option(
    "--nudge",
    section=Section.TRAJECTORY,
    type=Point(),
    metavar="X[,Y,Z]",
    help="Begin the variation's trajectory this far from the piece's; 0 gives the piece back  "
    "[default: as --depart wants it; 0.1 with --start]",
)
@option(
    "--depart",
    section=Section.TRAJECTORY,
    type=Number(0, 1),
    metavar="SHARE",
    help="Let this share of steps leave the piece's order: take the smallest nudge that comes within 0.05 of it  "
    "[default: 0.25, with --stretch 4 0.125, unless --nudge or --start is given]",
)
@option(
    "--inserted",
    section=Section.TRAJECTORY,
    type=Number(0, 1),
    metavar="SHARE",
    help="Let insertions take this share of the time at most: seams with long ones go, or move to where the piece is "
    "more like itself.",
)
@option(
    "--stretch",
    section=Section.TRAJECTORY,
    type=COUNT,
    metavar="N",
    help="Make each stretch of the piece N postures long at least  [default: 4 with --inserted, else 1]",
)
@option(
    "--skip",
    section=Section.TRAJECTORY,
    type=NATURAL,
    metavar="M",
    default=10,
    help="Leave out M points of the trajectories between two postures.",
)
@option(
    "--length",
    section=Section.TRAJECTORY,
    type=COUNT,
    metavar="N",
    help="Make N postures  [default: as many as the piece has]",
)
@option(
    "--start",
    section=Section.TRAJECTORY,
    type=Point(),
    metavar="X,Y,Z",
    help="Begin the piece's trajectory here  [default: the flow's own start]",
)
@option(
    "--step",
    section=Section.TRAJECTORY,
    advanced=True,
    type=POSITIVE,
    help="Integrate by this step  [default: the flow's own]",
)
@option(
    "--transient",
    section=Section.TRAJECTORY,
    advanced=True,
    type=NATURAL,
    metavar="N",
    help="Drop the first N steps  [default: the flow's own number]",
)
@option(
    "--alternatives",
    section=Section.SEARCH,
    type=COUNT,
    metavar="K",
    default=3,
    help="Find K movements for each insertion.",
)
@searching
@reading
@click.pass_context
def vary(
    context: click.Context,
    /,
    source: str,
    outputs: tuple[Path, ...],
    report: Path | None,
    as_json: bool,
    by: By,
    attractor: str,
    parameter: tuple[str, ...],
    corpus: str | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Vary a piece along a chaotic trajectory.

    PIECE is a file of movement, a score, a corpus of one clip, or CORPUS/CLIP. Its postures are laid out along a
    trajectory; a second trajectory, begun nearby, gives their new order: at each point, the posture that is nearest.
    Where the new order makes a transition that the corpus does not know, movement is inserted, as tween would find it.
    With --by a control gives the order.

    Ctrl-C ends the smoothing: what has been found by then is written, and the exit code is 130.
    """
    from motionmind.chaos.flows import find_flow
    from motionmind.variation.departure import share_sought
    from motionmind.variation.variation import vary as make_variation

    if report == Path("-"):
        report, as_json = None, True
    files: list[tuple[Path, tuple[str, ...]]] = [(path, MOTION_SUFFIXES + PICTURES) for path in outputs]
    files += [(report, ())] if report else []
    named = parse_movement(source, home)
    sources = (named.source, *via_sources(options, home))
    check_outputs(files, [path for source in sources for path in source.paths])
    refused = REFUSED[by]
    _check_taken(context, by, refused)
    request = request_options({row.field: options.pop(row.field) for row in SEARCH_OPTIONS}, home)
    names = ("depart", "start", "skip", "step", "transient", "length", "inserted", "stretch")
    asked = {name: options.pop(name) for name in names}
    nudge = options.pop("nudge")
    if asked["depart"] is not None and nudge is not None:
        raise click.UsageError("--depart seeks a nudge, and --nudge gives one; leave out one of them", context)
    asked["nudge"] = nudge[0] if nudge is not None and len(nudge) == 1 else nudge
    asked["flow"] = find_flow(attractor, **parse_parameters(parameter))
    alternatives = options.pop("alternatives")
    piece, engine = _read_piece(context, named, corpus, home, by, **options)
    with Interruption() as interruption:
        variation = make_variation(
            piece,
            engine,
            by=by,
            alternatives=alternatives,
            on_progress=interruption.on_progress,
            watch=interruption.watch,
            **{name: value for name, value in asked.items() if name not in refused},
            **request,
        )
    print_variation(variation, as_json, _write(outputs, report, variation, request["fps"]), home)
    if engine and not as_json:
        print_seams_beyond(variation, engine)
    depart = asked["depart"] if by == "attractor" else None  # a control does not depart as its trajectory does
    if by == "attractor" and not variation.kept:  # whose limits come first
        depart = share_sought(nudge, depart, asked["start"])
    print_advice(variation, engine, depart)
    if not as_json:
        print_written([path for path, _ in files])
    if interruption.is_requested:
        context.exit(INTERRUPTED)


@command("motionmind attractor --of variation.json -o attractor.png")
@option(
    "--of", "variation", section=Section.INPUT, type=FILE, required=True, help="Draw this variation, which vary wrote."
)
@output("Write a picture (.png, .svg) or a page (.html).")
def attractor(variation: Path, output: Path) -> None:
    """Draw a variation on its attractor.

    The picture shows both trajectories, the cell of each posture, some of the postures, and both itineraries: where the
    variation parts from the piece, and where it jumps. In .svg, point at a part to see more. The page turns in three
    dimensions, and a body dances the variation beside it.
    """
    from motionmind.plots.attractor import ATTRACTORS, draw_attractor
    from motionmind.variation.variation_json import read_variation

    check_outputs([(output, ATTRACTORS)], [variation])
    found = read_variation(variation)
    draw_attractor(output, found)
    flow = found.course.flow if found.course else found.by
    click.echo(f"{displayed_path(output)}: {flow}, {len(found.piece)} sites, {len(found.order)} points")


def load_engine(corpus: str, home: Path | None) -> Engine:
    """Load what was learned from a corpus, once all that a search calls is compiled or about to be."""
    from motionmind.tween.engine import Engine

    prepare()  # before a bundled corpus is learned
    return Engine.load(corpus, home)


def print_variation(variation: Variation, as_json: bool, motion_sha256: str | None, home: Path | None) -> None:
    """Print a variation's report, as a table or as JSON with the hash of the file that was written, if one was."""
    report = variation.report()
    if as_json:
        click.echo(json.dumps(report | {"motion_sha256": motion_sha256}))
    else:
        print_review(report, names_in(variation, home))


def print_seams_beyond(variation: Variation, engine: Engine) -> None:
    """Print where insertions go beyond all that the corpus shows: of each measure the worst seam, and the others."""
    from motionmind.tween.headline import shown_beyond

    found: dict[str, list[tuple[float, int, str]]] = {}
    for seam in variation.seams:
        if seam.insertion:
            for name, one in engine.plausibility.shown(seam.insertion.motion).items():
                if one.is_beyond and one.value is not None and one.most is not None:
                    found.setdefault(name, []).append((one.value / one.most, seam.number, shown_beyond(name, one)))
    for sightings in found.values():
        _, number, sentence = max(sightings, key=lambda sighting: sighting[0])
        others = sorted(other for _, other, _ in sightings if other != number)
        also = f" (seam{'s' * (len(others) > 1)} {enumerated(list(map(str, others)), 8)}, too)" if others else ""
        click.echo(f"warning   seam {number}: {sentence}{also}")


def names_in(variation: Variation, home: Path | None) -> Sequence[str]:
    """Return a name for each of the piece's postures, by the corpus that judged the variation if it is there."""
    from motionmind.names.finding import open_collection
    from motionmind.names.spelling import Source
    from motionmind.variation.posture_names import name_postures

    corpus = next((seam.transition.corpus for seam in variation.seams if seam.transition), None)
    if corpus:
        with suppress(MotionMindError):  # it was built elsewhere, or is gone
            return name_postures(variation.piece, open_collection(Source(corpus, "corpus", corpus), home))
    return name_postures(variation.piece)


def _check_taken(context: click.Context, by: By, refused: Mapping[str, str]) -> None:
    """Check that no option is given that an order does not take; `refused` are arguments of `vary` with the reasons."""
    reasons = dict(refused)
    if "flow" in reasons:
        reasons |= dict.fromkeys(("attractor", "parameter"), reasons["flow"])
    if flag := given_option(context, reasons):
        raise click.UsageError(f"{flag} is not for --by {by}, which {reasons[flag.lstrip('-')]}", context)


def _read_piece(
    context: click.Context,
    named: PostureName,
    corpus: str | None,
    home: Path | None,
    by: By,
    *,
    clip: str | None,
    begin: int,
    end: int,
    rate: float | None,
    **reading_options: Any,
) -> tuple[Piece, Engine | None]:
    """Read the piece to vary, and what was learned from the corpus that judges it, if there is one."""
    from motionmind.corpus.recordings import posture_rate
    from motionmind.variation.piece import Piece

    source = named.source
    motion = read_movement(source, clip, home, **reading_options)
    own = source.place if source.kind == "corpus" else None
    judge = corpus or own
    useful = ("fps", "seed") if by in RANDOM else ("fps",)
    unused = given_option(
        context, ["alternatives", "inserted", *(row.field for row in SEARCH_OPTIONS if row.field not in useful)]
    )
    if unused and not judge:
        raise click.UsageError(f"{unused} is for --corpus, which is not given", context)
    engine = load_engine(judge, home) if judge else None
    if engine and source.kind == "file" and not motion.keyframed:
        rate = engine.corpus.rate if rate is None else rate
        if engine.corpus.skip and not given_option(context, ["begin"]) and named.moment is None:
            begin = engine.corpus.skip
            note(
                f"{source.word}: begins at frame {begin}, as the recordings of {engine.corpus.name} do "
                "(--from 0 for all of it)"
            )
    if rate is None and source.kind == "file" and (usual := posture_rate(motion)) is not None:
        note(
            f"{source.word}: every frame is a posture, {motion.fps:.3g} a second: --rate {usual:g} takes as many as "
            "corpus build does"
        )
    frames = select_part(named, motion, begin, end)
    facing = _read_facing(own, home) if own else engine.corpus.facing if engine else "free"
    return Piece.of(motion.slice(frames.start, frames.stop), rate, facing), engine


def _read_facing(corpus: str, home: Path | None) -> Facing:
    """Read whether the postures of a corpus may face anywhere ("free") or not ("stage")."""
    from motionmind.corpus.store import locate, read_manifest

    facing: Facing = read_manifest(locate(corpus, home)).get("facing", "free")
    return facing


def _write(outputs: Sequence[Path], report: Path | None, variation: Variation, fps: float) -> str | None:
    """Write a variation, and its report if asked, or nothing if one of the files fails.

    JSON holds the whole variation, other files its movement, resampled if their frames must be even in time.

    Returns:
        The hash of the first of the variation's files; None if there is none, or it went to a pipe.
    """
    from motionmind.files import write_atomically
    from motionmind.variation.variation_json import write_variation

    with all_or_none() as written:
        for path in outputs:
            suffix = path.suffix.lower()
            if suffix == ".json":
                note_licences(path, variation.motion())
                write_variation(path, variation)
            else:
                motion = variation.motion()
                write(path, motion.resample(fps) if suffix in EVEN_SUFFIXES else motion)
        motion_sha256 = sha256_of(written, next(iter(outputs), None))
        if report:
            told = variation.report() | {"motion_sha256": motion_sha256}
            write_atomically(report, f"{json.dumps(told)}\n".encode())
    return motion_sha256
