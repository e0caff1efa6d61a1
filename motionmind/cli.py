"""The command line: parse, call, print."""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motionmind.errors import MotionMindError, MotionMindWarning, NoPathError

if TYPE_CHECKING:
    from motionmind.engine import Engine
    from motionmind.motion import Motion
    from motionmind.tween import Tween

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Movement between two postures in the style of a corpus, with a proof of how close to the best it is.",
)
corpora = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None, help="Build corpora from movement, and look at them."
)
app.add_typer(corpora, name="corpus")

PATH_MISSING = 3  # exit code where nothing joins A and B
BAD_INPUT = 2  # exit code for everything that the user can put right


class Weights(StrEnum):
    """How transitions are weighed."""

    conditional = "conditional"
    printed = "printed"


class Facing(StrEnum):
    """Whether the turn about the vertical belongs to the pelvis' states."""

    free = "free"
    stage = "stage"


class Flips(StrEnum):
    """What becomes of a clip in which a joint jumps."""

    split = "split"
    keep = "keep"
    drop = "drop"


class Body(StrEnum):
    """Which joints the converted movement is on."""

    own = "own"
    human23 = "human23"


Home = Annotated[
    Path | None, typer.Option(help="Folder of your own corpora [default: $MOTIONMIND_HOME, or the data directory].")
]
Joints = Annotated[Path | None, typer.Option(help="TOML or JSON file: your joint = human23's joint.")]
Unit = Annotated[
    str | None, typer.Option(help="BVH's unit of length: m, cm, mm, dm, in, ft, cmu [default: by height].")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@app.command(
    epilog="Example: motionmind tween corpora/ballet/postures/arabesque.json corpora/ballet/postures/fifth.json "
    "--corpus ballet -o tween.bvh"
)
def tween(
    a: Annotated[Path, typer.Argument(help="Posture to start from, exactly.")],
    b: Annotated[Path, typer.Argument(help="Posture to end in, exactly.")],
    corpus: Annotated[str, typer.Option(help="Corpus whose style it takes, by name or folder.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Where the motion goes: .json or .bvh.")] = None,
    report: Annotated[Path | None, typer.Option(help="Where the report goes, as JSON; - prints it, alone.")] = None,
    moves: Annotated[int | None, typer.Option(help="Number of moves [default: the search finds it].")] = None,
    max_moves: Annotated[int, typer.Option(help="Greatest number of moves that it may find.")] = 60,
    strict: Annotated[bool, typer.Option("--strict", help="No bridges: every move attested, or exit code 3.")] = False,
    node_budget: Annotated[int, typer.Option(help="Nodes that the search may hold at once.")] = 200_000,
    problem: Annotated[Path | None, typer.Option(help="Write the problem that was solved, in toulbar2's cfn.")] = None,
    weights: Annotated[Weights, typer.Option(help="How transitions are weighed.")] = Weights.conditional,
    lambda_: Annotated[float, typer.Option("--lambda", help="Factor of how joints coordinate.")] = 1.0,
    beta: Annotated[float, typer.Option(help="Nats for each move that a joint waits at its goal.")] = 1.0,
    tau: Annotated[float, typer.Option(help="Nats for each move.")] = 1.0,
    bridge_price: Annotated[float, typer.Option(help="Nats for each degree of an unattested move.")] = 1.0,
    fps: Annotated[float, typer.Option(help="Frames a second of the motion.")] = 30.0,
    home: Home = None,
) -> None:
    """Find the best movement from posture A to posture B, and prove how good it is."""
    from motionmind.engine import Engine
    from motionmind.formats import read_posture, write_atomically, write_motion

    alone = report is not None and str(report) == "-"
    files = {
        path: suffixes for path, suffixes in ((output, (".json", ".bvh")), (report, ()), (problem, (".cfn",))) if path
    }
    for path, suffixes in files.items():
        _check_output(path, suffixes)
    with _busy(_first_time()):
        engine = Engine.load(corpus, home)
        result = engine.tween(
            read_posture(a),
            read_posture(b),
            moves=moves,
            max_moves=max_moves,
            strict=strict,
            node_budget=node_budget,
            weights=weights.value,
            lambda_=lambda_,
            beta=beta,
            tau=tau,
            bridge_price=bridge_price,
            fps=fps,
        )
    if output:
        write_motion(output, result.motion)
    if problem:
        write_atomically(problem, result.problem().encode())
    if report:
        text = json.dumps(result.report()) + "\n"
        if alone:
            sys.stdout.write(text)
        else:
            write_atomically(report, text.encode())
    if not alone:
        _print_tween(result, [path for path in files if str(path) != "-"])


@app.command(epilog="Example: motionmind posture clip.bvh --frame 240 -o A.json")
def posture(
    clip: Annotated[Path, typer.Argument(help="Movement to take it from.")],
    frame: Annotated[int, typer.Option(help="Number of the frame, from 0; negative from the end.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Where it goes: .json.")],
    joints: Joints = None,
    unit: Unit = None,
) -> None:
    """Take one posture out of a clip, on human23 where its joints map to it."""
    from motionmind.engine import own_skeleton
    from motionmind.formats import write_posture

    _check_output(output, (".json",))
    motion = own_skeleton(_read(clip, unit=unit), _mapping(joints))
    write_posture(output, motion.posture(frame))
    typer.echo(f"{output}: frame {frame} of {len(motion)}, on {motion.skeleton.name} ({len(motion.skeleton)} joints)")


@app.command(epilog="Example: motionmind convert 135_06.amc 135_06.bvh --skeleton human23")
def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help="Movement: .bvh, .amc, .json, .txt.")],
    output: Annotated[Path, typer.Argument(metavar="OUT", help="Where it goes: .bvh, .json, .txt.")],
    skeleton: Annotated[Body, typer.Option(help="The file's own joints, or human23.")] = Body.own,
    fps: Annotated[float | None, typer.Option(help="Frames a second [default: as they are].")] = None,
    asf: Annotated[Path | None, typer.Option(help="AMC's skeleton [default: the one beside it].")] = None,
    joints: Joints = None,
    unit: Unit = None,
) -> None:
    """Convert movement from one format to another."""
    from motionmind.formats import write_motion
    from motionmind.retarget import to_human23

    _check_output(output, (".bvh", ".json", ".txt"))
    motion = _read(source, unit=unit, asf=asf)
    if skeleton is Body.human23 or joints:
        motion = to_human23(motion, _mapping(joints))
    if fps is not None:
        motion = motion.resample(fps)
    write_motion(output, motion)
    typer.echo(f"{output}: {len(motion)} frames, {len(motion.skeleton)} joints ({motion.skeleton.name})")


@corpora.command(epilog="Example: motionmind corpus build mine *.bvh --rate 5 --tolerance 15 --facing free --skip 1")
def build(
    name: Annotated[str, typer.Argument(help="What the corpus is to be called.")],
    files: Annotated[list[Path], typer.Argument(help="Movement, in any mix of formats that can be read.")],
    rate: Annotated[float | None, typer.Option(help="Postures a second [default: every frame].")] = None,
    tolerance: Annotated[
        list[str] | None, typer.Option(help="Degrees within which orientations are one state; or JOINT=DEGREES.")
    ] = None,
    discretize: Annotated[
        str, typer.Option(help="codebook, quaternion, euler, or a library by name or file.")
    ] = "codebook",
    facing: Annotated[Facing, typer.Option(help="free: pool over facings; stage: they are states.")] = Facing.free,
    skip: Annotated[int, typer.Option(help="Frames to drop at each clip's start, such as a T-pose.")] = 0,
    flips: Annotated[Flips, typer.Option(help="Where a joint jumps: split the clip, keep it, drop it.")] = Flips.split,
    flip_angle: Annotated[float, typer.Option(help="Degrees in one frame that are a jump.")] = 45.0,
    joints: Joints = None,
    unit: Unit = None,
    title: Annotated[str, typer.Option(help="A line on what it is.")] = "",
    author: Annotated[str, typer.Option(help="Who made the movement.")] = "",
    source: Annotated[str, typer.Option(help="Where it comes from.")] = "",
    licence: Annotated[str, typer.Option(help="Under which it may be used.")] = "",
    home: Home = None,
) -> None:
    """Learn a corpus from movement files; one of the same name is replaced."""
    from motionmind.corpus.store import place_for
    from motionmind.discretize import make
    from motionmind.engine import Engine, own_skeleton

    place = place_for(name, home)
    default, per_joint = _tolerances(tolerance or [])
    discretization = make(discretize, default, per_joint)
    mapping = _mapping(joints)
    with _progress("reading", len(files)) as step:

        def clips() -> Iterator[Motion]:
            for file in files:
                yield own_skeleton(_read(file, unit=unit), mapping)
                step(f"reading {file.name}")
            step("learning")

        engine = Engine.fit(
            clips(),
            name=name,
            rate=rate,
            skip=skip,
            facing=facing.value,
            discretization=discretization,
            flips=flips.value,
            flip_degrees=flip_angle,
            title=title,
            author=author,
            source=source,
            licence=licence,
        )
        engine.save(place)
    _print_check(engine.check())
    typer.echo(f"built {place}")


@corpora.command("list", epilog="Example: motionmind corpus list")
def list_corpora(home: Home = None) -> None:
    """List the corpora that there are, bundled and your own."""
    from motionmind.corpus.store import known, read_manifest

    for name, folder in known(home).items():
        typer.echo(f"{name:16} {read_manifest(folder).get('title') or ''}  ({folder})")


@corpora.command(epilog="Example: motionmind corpus info ballet --json")
def info(name: Annotated[str, typer.Argument(help="Corpus.")], as_json: Json = False, home: Home = None) -> None:
    """Say what a corpus is and how large."""
    found = _load(name, home).info()
    if as_json:
        typer.echo(json.dumps(found))
        return
    for key in ("name", "title", "author", "source", "licence", "skeleton", "facing", "rate"):
        typer.echo(f"{key:10} {found[key] if found[key] not in (None, '') else '-'}")
    typer.echo(f"{'clips':10} {len(found['clips'])}, {found['postures']} postures, {found['moves']} moves")
    for clip in found["clips"]:
        typer.echo(f"  {clip['name']:16} {clip['postures']:5}  {clip['about']}")


@corpora.command(epilog="Example: motionmind corpus check ballet --pairs 500 --seed 1")
def check(
    name: Annotated[str, typer.Argument(help="Corpus.")],
    as_json: Json = False,
    pairs: Annotated[int, typer.Option(help="Random pairs of postures to try to join.")] = 2000,
    seed: Annotated[int, typer.Option(help="Of the random pairs.")] = 0,
    home: Home = None,
) -> None:
    """Say how well a corpus hangs together, and what faults its recordings have."""
    found = _load(name, home).check(pairs, seed)
    if as_json:
        typer.echo(json.dumps(found))
    else:
        _print_check(found)


# --- what the commands share -------------------------------------------------------------------------------------------


def _load(name: str, home: Path | None) -> Engine:
    from motionmind.engine import Engine

    return Engine.load(name, home)


def _read(path: Path, unit: str | None = None, asf: Path | None = None) -> Motion:
    from motionmind.formats import read_motion

    try:
        length: str | float | None = float(unit) if unit else None
    except ValueError:
        length = unit
    return read_motion(path, unit=length, asf=asf)


def _mapping(path: Path | None) -> dict[str, str] | None:
    from motionmind.retarget import read_joint_mapping

    return read_joint_mapping(path) if path else None


def _tolerances(given: list[str]) -> tuple[float, dict[str, float]]:
    """The tolerance for all joints, and those of single ones, from words such as "15" and "left_hip=10"."""
    default, per_joint = 15.0, {}
    for word in given:
        joint, _, degrees = word.rpartition("=")
        try:
            value = float(degrees)
        except ValueError:
            raise MotionMindError(f"--tolerance {word}: give degrees, or JOINT=DEGREES such as left_hip=10") from None
        if joint:
            per_joint[joint] = value
        else:
            default = value
    return default, per_joint


def _check_output(path: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse, before anything is done, a file that could not be written after it."""
    if str(path) == "-":
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise MotionMindError(
            f"{path}: cannot write {path.suffix or 'no suffix'}; {', '.join(suffixes)} can be written"
        )
    folder = path.resolve().parent
    if not folder.is_dir():
        raise MotionMindError(f"{path}: cannot be written: there is no folder {folder}")
    if path.is_dir() or not os.access(path if path.exists() else folder, os.W_OK):
        raise MotionMindError(f"{path}: cannot be written: {'it is a folder' if path.is_dir() else 'not permitted'}")


def _first_time() -> str:
    from motionmind.search.jit import is_compiled

    return "" if is_compiled() else "compiling the search, once (up to half a minute)"


@contextmanager
def _busy(message: str) -> Iterator[None]:
    """Show that something takes long, on a terminal's standard error."""
    if not message:
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(message):
        yield


@contextmanager
def _progress(what: str, total: int) -> Iterator[Any]:
    """A progress bar on a terminal's standard error; yields what moves it on by one."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total + 1)
        yield lambda description: bar.update(task, advance=1, description=description)


def _print_tween(result: Tween, files: list[Path]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    seconds = result.motion.times[-1]
    table.add_row("moves", f"{result.moves}, in {seconds:.2f} s ({len(result.motion)} frames)")
    table.add_row("cost", f"{result.cost:.3f} nats")
    bound = f"no path costs less than {result.lower_bound:.3f}"
    table.add_row("proven", f"{result.status}: {bound}" + (f", gap {result.gap:.2%}" if result.gap > 1e-9 else ""))
    table.add_row("attested", f"{result.attested:.1%} of the joints' moves were seen in the corpus")
    bridged = [f"{b.joint} in move {b.move + 1} ({b.degrees:.0f} degrees)" for b in result.bridges]
    table.add_row("bridged", ", ".join(bridged) or "none")
    waited: dict[str, int] = {}
    for wait in result.waits:
        waited[wait.joint] = waited.get(wait.joint, 0) + 1
    table.add_row("waited", ", ".join(f"{joint} {count}" for joint, count in waited.items()) or "none")
    for end, row in zip("AB", result.snap_degrees, strict=True):
        worst = int(row.argmax())
        table.add_row(
            f"{end} is off", f"{row.mean():.1f} degrees a joint, at most {row[worst]:.1f} ({result.joints[worst]})"
        )
    if files:
        table.add_row("written", ", ".join(map(str, files)))
    Console(soft_wrap=True).print(table)


def _print_check(found: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    rate = f"{found['rate']:g} a second" if found["rate"] else "keyframes"
    typer.echo(
        f"{found['name']}: {len(found['clips'])} clips, {found['postures']} postures ({rate}), {found['skeleton']}"
    )
    table = Table(box=None, pad_edge=False)
    for column in ("joint", "states", "edges", "out-degree"):
        table.add_column(column, justify="left" if column == "joint" else "right")
    for joint, states in found["states"].items():
        table.add_row(joint, str(states), str(found["edges"][joint]), f"{found['out_degree'][joint]:.2f}")
    Console(soft_wrap=True).print(table)
    typer.echo(f"{found['joinable']:.1%} of {found['pairs']} random pairs of postures can be joined without a bridge")
    faults = found["faults"]
    if faults:
        typer.echo(f"{len(faults)} faults of the recordings, joints that turn too far in one frame:")
    for fault in faults[:20]:
        typer.echo(f"  {fault['clip']}: {fault['joint']} by {fault['degrees']:.0f} degrees at frame {fault['frame']}")
    if len(faults) > 20:
        typer.echo(f"  and {len(faults) - 20} more (--json lists all)")


def _say(message: Warning | str, category: type[Warning], *_: Any) -> None:
    """Warnings of our own are notes to the user; others are for developers and stay away from the command line."""
    if issubclass(category, MotionMindWarning):
        typer.echo(f"note: {message}", err=True)


def main() -> None:
    """Run the command line: exit code 2 for bad input, in one line; 3 where there is no path, with the diagnosis."""
    warnings.showwarning = _say
    warnings.simplefilter("always", MotionMindWarning)
    try:
        app()
    except NoPathError as error:
        typer.echo(f"error: {error}", err=True)
        raise SystemExit(PATH_MISSING) from None
    except MotionMindError as error:
        typer.echo(f"error: {error}", err=True)
        raise SystemExit(BAD_INPUT) from None
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(1) from None
