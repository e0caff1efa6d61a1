"""Tweens, postures and files in and out: parse, call, print."""

from __future__ import annotations

import gc
import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli.files import MOVEMENT, all_or_none, asked, check_outputs, read, read_mapping, write
from motionmind.cli.options import (
    COUNT,
    FILE,
    HOME,
    OUTPUTS,
    RATE,
    InOrder,
    example,
    numbered,
    passing,
    reading,
    searching,
)
from motionmind.cli.printing import Interruption, count, note, print_alternatives, print_tween, progress
from motionmind.errors import MotionMindError, NoPathError
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.formats.papers import Form
    from motionmind.tween.result import Tween

INTERRUPTED = 130  # by Ctrl-C, as shells have it


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
    help_alone(context)


@app.command(
    epilog=example(
        "motionmind tween corpora/ballet/postures/arabesque.json corpora/ballet/postures/fifth.json "
        "--corpus ballet -o tween.bvh"
    )
)
@click.argument("a", type=FILE)
@click.argument("b", type=FILE)
@click.option("--corpus", required=True, metavar="NAME", help="Corpus whose style it takes, by name or folder.")
@click.option("-o", "--output", type=FILE, help=f"Where it goes: {OUTPUTS}.")
@click.option("--report", type=FILE, help="Where the report goes, as JSON; - prints it, alone.")
@click.option("--problem", type=FILE, help="Where the problem that was solved goes: .cfn, for toulbar2.")
@click.option("--alternatives", type=COUNT, metavar="K", help="So many tweens that differ: out-1.json, out-2.json, ...")
@searching
@HOME
def tween(
    a: Path,
    b: Path,
    corpus: str,
    output: Path | None,
    report: Path | None,
    problem: Path | None,
    home: Path | None,
    alternatives: int | None,
    **options: Any,
) -> None:
    """Find the best movement from A to B, and prove how good it is.

    Ctrl-C ends the search: what it has found by then is written, with what is proven of it, and the exit code is 130.
    Exit code 3 says that nothing joins A and B under the rules that were asked for; --report then holds the diagnosis.
    """
    if problem and options["posturewise"]:
        raise click.UsageError("--problem is that of joints that move on their own; leave out --posturewise")
    gc.disable()  # start-up makes a million objects and no garbage; to look for it takes a tenth of a second
    _load_numba()
    from motionmind.formats import read_posture, write_atomically
    from motionmind.jit import is_compiled
    from motionmind.tween.engine import Engine

    alone = report == Path("-")
    wanted = ((output, MOVEMENT + PICTURES), (None if alone else report, ()), (problem, (".cfn",)))
    numbers = range(1, (alternatives or 1) + 1)
    places = [
        [(numbered(path, number, alternatives), suffixes) for path, suffixes in wanted if path] for number in numbers
    ]
    check_outputs(
        [place for group in places for place in group], [a, b, *(path for path, _ in passing(options["via"]))]
    )
    options = asked(options)
    if alternatives and options["follow"] is None:
        options["follow"] = True  # as the mean of the ways all would be alike
    engine = Engine.load(corpus, home)
    ends = read_posture(a), read_posture(b)
    if not is_compiled("search"):
        progress("compiling the search, which takes half a minute, once")
    found: list[Tween] = []
    with (
        _no_path_told(report if alone else report and numbered(report, 1, alternatives)),
        Interruption() as interruption,
    ):
        for _ in numbers:
            found.append(engine.tween(*ends, **options, unlike=found, watch=interruption.watch))
            if interruption.asked:
                break
    files = [numbered(path, number, alternatives) for number in numbers[: len(found)] for path, _ in wanted if path]
    with all_or_none(files):
        for number, result in zip(numbers, found, strict=False):
            if output:
                write(numbered(output, number, alternatives), result.motion)
            if problem:
                write_atomically(numbered(problem, number, alternatives), result.problem().encode())
            if report and not alone:
                text = json.dumps(result.report())
                write_atomically(numbered(report, number, alternatives), f"{text}\n".encode())
    if alone:
        reports = [result.report() for result in found]
        click.echo(json.dumps(reports[0] if alternatives is None else reports))
    elif alternatives is None:
        print_tween(found[0], files)
    else:
        print_alternatives(found, files)
    if interruption.asked:
        click.get_current_context().exit(INTERRUPTED)


@contextmanager
def _no_path_told(report: Path | None) -> Iterator[None]:
    """Where there is no path, the report is the diagnosis; - prints it."""
    from motionmind.formats import write_atomically

    try:
        yield
    except NoPathError as error:
        text = json.dumps({"status": "no path", "message": str(error), "diagnosis": error.diagnosis})
        if report == Path("-"):
            click.echo(text)
        elif report:
            write_atomically(report, f"{text}\n".encode())
        raise


@app.command(epilog=example("motionmind posture clip.bvh --frame 240 -o A.json"))
@click.argument("clip", type=FILE)
@click.option(
    "--frame", type=int, metavar="N", required=True, help="Number of the frame, from 0; negative from the end."
)
@click.option("-o", "--output", type=FILE, required=True, help=f"Where it goes: {OUTPUTS}; or .txt.")
@reading
def posture(clip: Path, frame: int, output: Path, joints: Path | None, **source: Any) -> None:
    """Take one posture out of a clip.

    It is on human23 where the clip's joints map to it, by known names or by --joints, else on the clip's own, as on
    human44.
    """
    from motionmind.retarget.retarget import own_skeleton

    check_outputs([(output, (*MOVEMENT, ".txt", *PICTURES))], [clip])
    motion = own_skeleton(read(clip, **source), read_mapping(joints))
    write(output, motion.posture(frame))
    click.echo(f"{output}: frame {frame} of {len(motion)}, on {motion.skeleton.name} ({len(motion.skeleton)} joints)")


@app.command(epilog=example("motionmind convert clip.bvh clip.json --skeleton human23 --fps 30"))
@click.argument("file", type=FILE, metavar="IN")
@click.argument("output", type=FILE, metavar="OUT")
@click.option("--skeleton", type=click.Choice(["own", "human23"]), default="own", help="The file's joints, or human23.")
@click.option("--fps", type=RATE, help="Frames a second  [default: as they are]")
@click.option("--out-unit", metavar="UNIT", help="OUT's unit of length, for .bvh, as for --unit  [default: cm]")
@click.option(
    "--form", type=click.Choice(["braces", "lines"]), default="braces", help="Which of the papers' two, for .txt."
)
@reading
def convert(
    file: Path,
    output: Path,
    skeleton: str,
    fps: float | None,
    out_unit: str | None,
    form: Form,
    joints: Path | None,
    **source: Any,
) -> None:
    """Convert movement from one format to another.

    IN can be .bvh, .amc with its .asf, .json, .npz as AMASS keeps movement, or .txt in the notation of the papers. OUT
    can be .bvh, .json, .glb (a skinned body, for Blender and the like), .npz (on SMPL's joints), or .txt, which is on
    human23 (or human44, if IN is) and holds orientations alone. What OUT has no place for is said.
    """
    from motionmind.formats import lossy_fields, write_motion
    from motionmind.formats.papers import write_papers
    from motionmind.retarget.joint_mapping import is_human44
    from motionmind.retarget.retarget import to_human23

    check_outputs([(output, (".bvh", ".json", ".txt", ".glb", ".npz"))], [file])
    suffix = output.suffix.lower()
    if out_unit and suffix != ".bvh":
        raise MotionMindError(f"--out-unit {out_unit}: only BVH has no unit of its own, and {output} is none")
    motion = read(file, **source)
    if skeleton == "human23" or joints or (suffix == ".txt" and not is_human44(motion.skeleton)):
        motion = to_human23(motion, read_mapping(joints))
    if fps is not None:
        motion = motion.resample(fps)
    if suffix == ".txt":
        write_papers(output, motion, form=form)
    else:
        write_motion(output, motion, unit=out_unit or "cm")
    if missing := lossy_fields(motion, output, source=file):
        note(f"{output}: no place for {'; '.join(missing)}")
    click.echo(f"{output}: {count(len(motion), 'frame')}, {len(motion.skeleton)} joints ({motion.skeleton.name})")


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


def help_alone(context: click.Context) -> None:
    """Show the help of a group that is called without a command."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
