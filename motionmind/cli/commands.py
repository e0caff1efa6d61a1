"""The commands: parse, call, print."""

from __future__ import annotations

import gc
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli.files import all_or_none, check_outputs, clip_names, read, read_mapping
from motionmind.cli.options import (
    COUNT,
    FILE,
    HOME,
    JSON,
    NATS,
    RATE,
    InOrder,
    Number,
    example,
    mixture,
    reading,
    tolerances,
)
from motionmind.cli.printing import count, note, print_check, print_origins, print_tween, progress
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.corpus.corpus import Facing
    from motionmind.corpus.gather import Flips
    from motionmind.formats.papers import Form
    from motionmind.motion import Motion


@click.group(
    cls=InOrder,
    invoke_without_command=True,
    epilog=example("motionmind tween A.json B.json --corpus ballet -o tween.bvh"),
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
)
@click.version_option(package_name="motionmind", message="%(prog)s %(version)s")
@click.pass_context
def app(context: click.Context) -> None:
    """Movement between two postures in the style of a corpus, with a proof of how close to the best it is."""
    _help_alone(context)


@app.command(
    epilog=example(
        "motionmind tween corpora/ballet/postures/arabesque.json corpora/ballet/postures/fifth.json "
        "--corpus ballet -o tween.bvh"
    )
)
@click.argument("a", type=FILE)
@click.argument("b", type=FILE)
@click.option("--corpus", required=True, metavar="NAME", help="Corpus whose style it takes, by name or folder.")
@click.option("-o", "--output", type=FILE, help="Where the motion goes: .json, .bvh or .glb.")
@click.option("--report", type=FILE, help="Where the report goes, as JSON; - prints it, alone.")
@click.option("--moves", type=COUNT, metavar="N", help="Number of moves  [default: the search finds it]")
@click.option("--max-moves", type=COUNT, metavar="N", default=60, help="Greatest number of moves that it may find.")
@click.option("--strict", is_flag=True, help="No bridges: every move attested, or exit code 3.")
@click.option("--node-budget", type=COUNT, metavar="N", default=200_000, help="Nodes that the search may hold at once.")
@click.option("--problem", type=FILE, help="Where the problem that was solved goes: .cfn, for toulbar2.")
@click.option(
    "--weights", type=click.Choice(["conditional", "printed"]), default="conditional", help="How transitions weigh."
)
@click.option("--lambda", "lambda_", type=NATS, default=1.0, help="Factor of how joints coordinate.")
@click.option("--beta", type=NATS, default=1.0, help="Nats for each move that a joint waits at its goal.")
@click.option("--tau", type=NATS, default=1.0, help="Nats for each move.")
@click.option("--bridge-price", type=NATS, default=1.0, help="Nats for each degree of an unattested move.")
@click.option("--fps", type=RATE, default=30.0, help="Frames a second of the motion.")
@HOME
def tween(
    a: Path,
    b: Path,
    corpus: str,
    output: Path | None,
    report: Path | None,
    problem: Path | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Find the best movement from A to B, and prove how good it is.

    Exit code 3 says that nothing joins them under the rules that were asked for.
    """
    gc.disable()  # start-up makes a million objects and no garbage; to look for it takes a tenth of a second
    _load_numba()
    from motionmind.engine import Engine
    from motionmind.formats import read_posture, write_atomically, write_motion
    from motionmind.search.jit import is_compiled

    alone = report == Path("-")
    wanted = ((output, (".json", ".bvh", ".glb")), (None if alone else report, ()), (problem, (".cfn",)))
    written = check_outputs([(path, suffixes) for path, suffixes in wanted if path], [a, b])
    engine = Engine.load(corpus, home)
    ends = read_posture(a), read_posture(b)
    if not is_compiled():
        progress("compiling the search, which takes half a minute, once")
    result = engine.tween(*ends, **options)
    text = json.dumps(result.report())
    with all_or_none(written):
        if output:
            write_motion(output, result.motion)
        if problem:
            write_atomically(problem, result.problem().encode())
        if report and not alone:
            write_atomically(report, f"{text}\n".encode())
    if alone:
        click.echo(text)
    else:
        print_tween(result, written)


@app.command(epilog=example("motionmind posture clip.bvh --frame 240 -o A.json"))
@click.argument("clip", type=FILE)
@click.option(
    "--frame", type=int, metavar="N", required=True, help="Number of the frame, from 0; negative from the end."
)
@click.option("-o", "--output", type=FILE, required=True, help="Where it goes: .json, .bvh, .glb or .txt.")
@reading
def posture(clip: Path, frame: int, output: Path, joints: Path | None, **source: Any) -> None:
    """Take one posture out of a clip.

    It is on human23 where the clip's joints map to it, by known names or by --joints, else on the clip's own, as on
    human44.
    """
    from motionmind.formats import write_posture
    from motionmind.learned import own_skeleton

    check_outputs([(output, (".json", ".bvh", ".glb", ".txt"))], [clip])
    motion = own_skeleton(read(clip, **source), read_mapping(joints))
    write_posture(output, motion.posture(frame))
    click.echo(f"{output}: frame {frame} of {len(motion)}, on {motion.skeleton.name} ({len(motion.skeleton)} joints)")


@app.command(epilog=example("motionmind convert clip.bvh clip.json --skeleton human23 --fps 30"))
@click.argument("file", type=FILE, metavar="IN")
@click.argument("output", type=FILE, metavar="OUT")
@click.option("--skeleton", type=click.Choice(["own", "human23"]), default="own", help="The file's joints, or human23.")
@click.option("--fps", type=RATE, help="Frames a second  [default: as they are]")
@click.option(
    "--form", type=click.Choice(["braces", "lines"]), default="braces", help="Which of the papers' two, for .txt."
)
@reading
def convert(
    file: Path, output: Path, skeleton: str, fps: float | None, form: Form, joints: Path | None, **source: Any
) -> None:
    """Convert movement from one format to another.

    IN can be .bvh, .amc with its .asf, .json, or .txt in the notation of the papers; OUT can be .bvh, .json,
    .glb (a skinned body, for Blender and the like), or .txt, which is on human23 (or human44, if IN is) and holds
    orientations alone.
    """
    from motionmind.formats import write_motion
    from motionmind.formats.papers import write_papers
    from motionmind.mapping import is_human44
    from motionmind.retarget import to_human23

    check_outputs([(output, (".bvh", ".json", ".txt", ".glb"))], [file])
    motion = read(file, **source)
    papers = output.suffix.lower() == ".txt"
    if skeleton == "human23" or joints or (papers and not is_human44(motion.skeleton)):
        motion = to_human23(motion, read_mapping(joints))
    if fps is not None:
        motion = motion.resample(fps)
    if papers:
        write_papers(output, motion, form=form)
        note(f"{output}: the notation has no place for times and for where the body is")
    else:
        write_motion(output, motion)
    click.echo(f"{output}: {count(len(motion), 'frame')}, {len(motion.skeleton)} joints ({motion.skeleton.name})")


@app.group("corpus", cls=InOrder, invoke_without_command=True, epilog=example("motionmind corpus check ballet"))
@click.pass_context
def corpora(context: click.Context) -> None:
    """Build corpora from movement, and look at them."""
    _help_alone(context)


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
    from motionmind.discretize import make
    from motionmind.engine import Engine
    from motionmind.learned import own_skeleton
    from motionmind.notation.compose import motions
    from motionmind.notation.read import read_score

    place = place_for(name, home)
    others = mixture(mix)
    discretization = make(discretize, *tolerances(tolerance, 15.0))
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
    from motionmind.engine import Engine

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
    from motionmind.engine import Engine

    found = Engine.load(name, home).check(pairs, seed)
    if as_json:
        click.echo(json.dumps(found))
    else:
        print_check(found)


# --- what the commands share ----------------------------------------------------------------------------------------


def _load_numba() -> None:
    """Import numba without what it looks for, for a quarter of a second, and nothing here needs.

    That is SciPy's linear algebra, and YAML where no file configures numba. Only while numba looks: who needs them
    later finds them.
    """
    spared = {"scipy.linalg"} | ({"yaml"} if not Path(".numba_config.yaml").exists() else set())
    spared -= sys.modules.keys()
    sys.modules.update(dict.fromkeys(spared))  # type: ignore[arg-type]
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        for name in spared:
            del sys.modules[name]


def _help_alone(context: click.Context) -> None:
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
