"""The commands that vary a piece and draw variations."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.canons import MAX_VARIED_DANCERS, check_canon, vary_canon, write_canon
from motionmind.cli.exits import ExitCode
from motionmind.cli.files import EVEN_SUFFIXES, MOTION_SUFFIXES, check_outputs, note_licences, write
from motionmind.cli.music import in_seconds, with_music
from motionmind.cli.options import HOME, OUTPUT_KINDS, Section, command, given_option, option, output, outputs, reading
from motionmind.cli.printing import Interruption, note, print_written
from motionmind.cli.review_tables import print_advice, print_review
from motionmind.cli.search_options import SEARCH_OPTIONS, request_options, searching, via_sources
from motionmind.cli.sounding import SOUNDS, Sounding, find_sounding
from motionmind.cli.sources import parse_movement, read_movement, select_part
from motionmind.cli.stages import note_overstep
from motionmind.cli.types import COUNT, FILE, FRAME, NATURAL, POSITIVE, RATE, Area, Number, Point, Whole
from motionmind.cli.warming import prepare
from motionmind.cli.words import parse_parameters
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError, enumerated
from motionmind.files import all_or_none, sha256_of
from motionmind.render import PICTURES
from motionmind.variation.orders import DEFAULT_INSERTED_SHARE, MAX_EVERY, ORDERS, RANDOM, REFUSED, By

if TYPE_CHECKING:
    from motionmind.corpus.corpus import Facing
    from motionmind.names.spelling import PostureName
    from motionmind.tween.engine import Engine
    from motionmind.variation.piece import Piece
    from motionmind.variation.variation import Variation


@command("motionmind vary macarena --attractor rossler -o variation.json")
@click.argument("source", metavar="PIECE", shell_complete=completion.movement)
@outputs(f"File to write: {OUTPUT_KINDS}; review reads .json.")
@option("--report", section=Section.OUTPUT, type=FILE, help="File of the report, as JSON; - prints it.")
@option(
    "--json",
    "as_json",
    section=Section.OUTPUT,
    advanced=True,
    is_flag=True,
    help="Print the report as JSON, like --report -.",
)
@option(
    "--corpus",
    "--smooth",
    "corpus",
    section=Section.CORPORA,
    metavar="NAME",
    shell_complete=completion.corpora,
    help="Corpus by which to judge and smooth transitions  [default: the piece's own, if any]",
)
@HOME
@option(
    "--clip",
    section=Section.PART,
    metavar="NAME",
    help="Clip of a score, a corpus or a glTF file  [default: the only one; of glTF the first]",
)
@option(
    "--from",
    "begin",
    section=Section.PART,
    type=FRAME,
    metavar="N",
    default=0,
    help="First frame; negative numbers count from the end. A recording skips as many frames as the corpus's.",
)
@option(
    "--to",
    "end",
    section=Section.PART,
    type=FRAME,
    metavar="N",
    default=-1,
    help="Last frame; negative numbers count from the end.",
)
@option(
    "--rate",
    section=Section.PART,
    type=RATE,
    help="Postures per second of a recording  [default: the corpus's rate, else every frame]",
)
@option(
    "--by",
    section=Section.TRAJECTORY,
    advanced=True,
    type=click.Choice(ORDERS),
    default="attractor",
    help="Order of the postures: attractor or, to compare, a control: random (shuffle), the attractor's chunks in "
    "random order (chunks), a random order for each body part (quadrants), or Dabby's mapping along the trajectory "
    "(dabby). Random orders have a --seed.",
)
@option(
    "--attractor",
    section=Section.TRAJECTORY,
    metavar="NAME",
    default="lorenz",
    shell_complete=completion.flows,
    help=f"Flow to follow: {', '.join(completion.FLOWS[:-1])} or {completion.FLOWS[-1]}.",
)
@option(
    "--parameter",
    section=Section.TRAJECTORY,
    advanced=True,
    multiple=True,
    metavar="NAME=VALUE",
    help="Parameter of the flow, such as rho=28. Repeatable.",
)
@option(
    "--nudge",
    section=Section.TRAJECTORY,
    type=Point(),
    metavar="X[,Y,Z]",
    help="Offset of the variation's initial point from the piece's; 0 reproduces the piece  [default: by --depart]",
)
@option(
    "--depart",
    section=Section.TRAJECTORY,
    type=Number(0, 1),
    metavar="SHARE",
    help="Share of steps that leave the piece's order; chooses the smallest nudge within 0.05 of it  "
    "[default: 0.25, with --stretch 4 0.125, unless --nudge is given]",
)
@option(
    "--inserted",
    section=Section.TRAJECTORY,
    type=Number(0, 1),
    metavar="SHARE",
    help="Maximum share of inserted time; drops seams with long insertions, or moves them to more similar postures; "
    f"1 is no limit  [default: {DEFAULT_INSERTED_SHARE:g}, unless --nudge or --depart is given]",
)
@option(
    "--stretch",
    section=Section.TRAJECTORY,
    type=COUNT,
    metavar="N",
    help="Minimum postures per stretch of the piece  [default: 4 with a limit of --inserted, fewer in short pieces; "
    "else 1]",
)
@option(
    "--dancers",
    section=Section.TRAJECTORY,
    type=Whole(2, MAX_VARIED_DANCERS),
    metavar="N",
    help="Number of dancers, at nearby starting points, who begin together and part; -o is an ensemble (.toml), beside "
    "which each dancer's variation is written.",
)
@option(
    "--stage",
    section=Section.MOTION,
    type=Area(),
    metavar="WIDTHxDEPTH",
    help="Stage to stay on, metres, around the origin: turns and moves all of it or, with a corpus, lets insertions "
    "travel.",
)
@option(
    "--skip",
    section=Section.TRAJECTORY,
    advanced=True,
    type=NATURAL,
    metavar="M",
    default=10,
    help="Points of the trajectories to skip between two postures.",
)
@option(
    "--length",
    section=Section.TRAJECTORY,
    type=COUNT,
    metavar="N",
    help="Number of postures  [default: the piece's]",
)
@option(
    "--start",
    section=Section.TRAJECTORY,
    advanced=True,
    type=Point(),
    metavar="X,Y,Z",
    help="Initial point of the piece's trajectory  [default: the flow's own]",
)
@option(
    "--step",
    section=Section.TRAJECTORY,
    advanced=True,
    type=POSITIVE,
    help="Integration step  [default: the flow's own]",
)
@option(
    "--transient",
    section=Section.TRAJECTORY,
    advanced=True,
    type=NATURAL,
    metavar="N",
    help="Initial steps to drop  [default: the flow's own number]",
)
@option(
    "--alternatives",
    section=Section.SEARCH,
    advanced=True,
    type=COUNT,
    metavar="K",
    default=3,
    help="Number of movements to find for each insertion.",
)
@option(
    "--on-beat",
    section=Section.TRAJECTORY,
    type=Whole(1, MAX_EVERY),
    metavar="N",
    help="Start stretches and insertions on every Nth beat of --tempo or --music, faster or slower.",
)
@option(
    "--sound",
    section=Section.TRAJECTORY,
    advanced=True,
    type=click.Choice(SOUNDS),
    help="Sound of PIECE, as clip.wav beside clip.bvh: each stretch's own, or straight on; written as .wav beside "
    "movement, and in .mp4 and .html.",
)
@with_music(
    Section.SEARCH,
    "Music whose beats are the counts: .txt, .mid, or sound, of about --tempo if given; sound of an .mp4 or .html.",
    "Seconds of the music before count 1, the next beat  [default: to the first downbeat]",
    advanced=True,
)
@searching(few=True)
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
    dancers: int | None,
    **options: Any,
) -> None:
    """Vary a piece along a chaotic trajectory.

    PIECE is a motion file, a score, a corpus of one clip, or CORPUS/CLIP. The command places its postures along a
    trajectory. A second trajectory, which begins nearby, gives their new order: at each point, the nearest posture.
    Transitions that the corpus does not attest get an insertion, found like a tween. --by orders by a control instead.

    Ctrl-C ends the smoothing: the command writes the insertions found so far, and exits with code 130.
    """
    from motionmind.chaos.flows import find_flow
    from motionmind.variation.departure import share_sought
    from motionmind.variation.variation import vary as make_variation

    if report == Path("-"):
        report, as_json = None, True
    files: list[tuple[Path, tuple[str, ...]]] = [(path, MOTION_SUFFIXES + PICTURES) for path in outputs]
    files += [(report, ())] if report else []
    named = parse_movement(source, home)
    choices = {name: options.pop(name) for name in ("sound", "music", "offset", "on_beat")}
    heard = find_sounding(named.source, options["clip"], home, tempo=options["tempo"], **choices)
    files += [(path, (".wav",)) for path in heard.tracks(outputs)]
    sources = (named.source, *via_sources(options, home))
    given = [path for source in sources for path in source.paths] + heard.files
    if dancers and (by != "attractor" or report or as_json or heard.track or options["stage"]):
        raise click.UsageError(
            "--dancers follows the attractor, writes no report or sound, and keeps to no stage: leave out --by, "
            "--report, --json, --sound, --stage"
        )
    shared = check_canon(outputs, dancers, given) if dancers else []
    if not shared:
        check_outputs(files, given)
    _check_refused(context, by, refused := REFUSED[by])
    wished = request_options({row.field: options.pop(row.field) for row in SEARCH_OPTIONS}, home)
    request = in_seconds(wished, heard.beats if heard.music else None)
    names = ("depart", "start", "skip", "step", "transient", "length", "inserted", "stretch", "stage", "alternatives")
    arguments = {name: options.pop(name) for name in names}
    nudge = options.pop("nudge")
    if arguments["depart"] is not None and nudge is not None:
        raise click.UsageError("--depart chooses a nudge, and --nudge sets one; give one of them", context)
    arguments["nudge"] = nudge[0] if nudge is not None and len(nudge) == 1 else nudge
    arguments["flow"] = find_flow(attractor, **parse_parameters(parameter))
    piece, engine, begins = _read_piece(context, named, corpus, home, by, **options)
    with Interruption() as interruption:

        def make(**changes: Any) -> Variation:
            return make_variation(
                piece,
                engine,
                by=by,
                beats=heard.beats if choices["on_beat"] else None,
                on_beat=choices["on_beat"],
                on_progress=interruption.on_progress,
                watch=interruption.watch,
                **{name: value for name, value in (arguments | changes).items() if name not in refused},
                **request,
            )

        variation = make()
        others = vary_canon(variation, len(shared), make) if shared else []
    if shared:
        write_canon(outputs[0], shared, others)
        context.exit(ExitCode.INTERRUPTED if interruption.is_requested else 0)
    written = _write(outputs, report, variation, request["fps"], heard, begins)
    print_variation(variation, as_json, written, home, is_chosen=by == "attractor" and nudge is None)
    if engine and not as_json:
        print_seams_beyond(variation, engine)
    depart = arguments["depart"] if by == "attractor" else None  # a control does not depart as its trajectory does
    if by == "attractor" and not variation.kept:  # whose limits come first
        depart = share_sought(nudge, depart)
    print_advice(variation, engine, depart)
    if not as_json:
        print_written([path for path, _ in files])
    note_overstep(source, variation.motion(), arguments["stage"], may_turn=variation.piece.facing == "free")
    interruption.finish()


@command("motionmind attractor --of variation.json -o attractor.png")
@option("--of", "variation", section=Section.INPUT, type=FILE, required=True, help="Variation to draw (.json).")
@output("Picture (.png, .svg) or page (.html).")
def attractor(variation: Path, output: Path) -> None:
    """Draw a variation on its attractor.

    The picture shows both trajectories, the cell of each posture, some postures, and both itineraries: where the
    variation leaves the piece, and where it jumps. In .svg, point at a part for more. The page rotates in three
    dimensions, beside a body that plays the variation.
    """
    from motionmind.plots.attractor import ATTRACTORS, draw_attractor
    from motionmind.variation.variation_json import read_variation

    check_outputs([(output, ATTRACTORS)], [variation])
    found = read_variation(variation)
    draw_attractor(output, found)
    flow = found.course.flow if found.course else found.by
    click.echo(f"{displayed_path(output)}: {flow}, {len(found.piece)} sites, {len(found.order)} points")


def load_engine(corpus: str, home: Path | None) -> Engine:
    """Load the engine of a corpus, after starting to compile the code that a search calls."""
    from motionmind.tween.engine import Engine

    prepare()  # before a bundled corpus is learned
    return Engine.load(corpus, home)


def print_variation(
    variation: Variation, as_json: bool, motion_sha256: str | None, home: Path | None, is_chosen: bool = False
) -> None:
    """Print a variation's report as a table, or as JSON with the hash of the written file, if any.

    The table says whether the nudge `is_chosen` for the piece.
    """
    report = variation.report()
    if as_json:
        click.echo(json.dumps(report | {"motion_sha256": motion_sha256}))
    else:
        print_review(report, names_in(variation, home), is_chosen)


def print_seams_beyond(variation: Variation, engine: Engine) -> None:
    """Print the insertions that exceed the corpus: for each measure, the worst seam and the numbers of the others."""
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
    """Return a name for each of the piece's postures, from the corpus that judged the variation if it exists."""
    from motionmind.names.finding import open_collection
    from motionmind.names.spelling import Source
    from motionmind.variation.posture_names import name_postures

    corpus = next((seam.transition.corpus for seam in variation.seams if seam.transition), None)
    if corpus:
        with suppress(MotionMindError):  # the corpus is elsewhere, or deleted
            return name_postures(variation.piece, open_collection(Source(corpus, "corpus", corpus), home))
    return name_postures(variation.piece)


def _check_refused(context: click.Context, by: By, refused: Mapping[str, str]) -> None:
    """Check that no given option is invalid for an order; `refused` maps arguments of `vary` to the reasons."""
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
) -> tuple[Piece, Engine | None, float]:
    """Read the piece to vary, load the engine of the corpus that judges it, if any, and return when its clip begins."""
    from motionmind.corpus.recordings import posture_rate
    from motionmind.variation.piece import Piece

    source = named.source
    motion = read_movement(source, clip, home, **reading_options)
    own = source.place if source.kind == "corpus" else None
    judge = own if corpus is None else corpus
    useful = ("fps", *["seed"] * (by in RANDOM), *["tempo"] * bool(given_option(context, ["on_beat"])))
    unused = given_option(
        context, ["alternatives", "inserted", *(row.field for row in SEARCH_OPTIONS if row.field not in useful)]
    )
    if unused and judge is None:
        raise click.UsageError(f"{unused} needs --corpus", context)
    engine = None if judge is None else load_engine(judge, home)
    if engine and source.kind == "file" and not motion.keyframed:
        rate = engine.corpus.rate if rate is None else rate
        if engine.corpus.skip and not given_option(context, ["begin"]) and named.moment is None:
            begin = engine.corpus.skip
            note(
                f"{source.word}: begins at frame {begin}, like the recordings of {engine.corpus.name} "
                "(--from 0 keeps all frames)"
            )
    if rate is None and source.kind == "file" and (usual := posture_rate(motion)) is not None:
        note(
            f"{source.word}: every frame is a posture, {motion.fps:.3g} per second; --rate {usual:g} is the rate of "
            "corpus build"
        )
    frames = select_part(named, motion, begin, end)
    facing = _read_facing(own, home) if own else engine.corpus.facing if engine else "free"
    return Piece.of(motion.slice(frames.start, frames.stop), rate, facing), engine, float(motion.times[0])


def _read_facing(corpus: str, home: Path | None) -> Facing:
    """Read whether a corpus ignores where postures face ("free") or not ("stage")."""
    from motionmind.corpus.store import locate, read_manifest

    facing: Facing = read_manifest(locate(corpus, home)).get("facing", "free")
    return facing


def _write(
    outputs: Sequence[Path],
    report: Path | None,
    variation: Variation,
    fps: float,
    heard: Sounding,
    begins: float,
) -> str | None:
    """Write a variation, its sound tracks, and its report if requested, or nothing if a file fails.

    JSON holds the whole variation; other files hold its movement, resampled for formats with evenly spaced frames.

    Returns:
        The hash of the first file of the variation; None without a file, or for a pipe.
    """
    from motionmind.files import write_atomically
    from motionmind.variation.variation_json import write_variation

    sound = heard.sound_of(variation, begins, outputs)
    with all_or_none() as written:
        for path in outputs:
            suffix = path.suffix.lower()
            if suffix == ".json":
                note_licences(path, variation.motion())
                write_variation(path, variation)
            else:
                motion = variation.motion()
                write(path, motion.resample(fps) if suffix in EVEN_SUFFIXES else motion, sound=sound)
        for path in heard.tracks(outputs):
            assert sound is not None
            write_atomically(path, sound.encode("WAV"))
        motion_sha256 = sha256_of(written, next(iter(outputs), None))
        if report:
            content = variation.report() | {"motion_sha256": motion_sha256}
            write_atomically(report, f"{json.dumps(content)}\n".encode())
    return motion_sha256
