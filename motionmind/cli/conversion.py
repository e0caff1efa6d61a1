"""The commands that extract postures from clips and convert movement between formats."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.delivery import Delivery, check_delivery, for_program, on_rig, rig_files
from motionmind.cli.ensembles import (
    describe_ensemble,
    is_ensemble,
    keep_ensemble,
    open_ensemble,
    write_ensemble,
    write_steps,
)
from motionmind.cli.files import (
    MOTION_SUFFIXES,
    check_outputs,
    note_licences,
    note_lossy_fields,
    numbered,
    question_recording,
    read_mapping,
    write_all,
)
from motionmind.cli.loops import find_loop, print_loop
from motionmind.cli.options import HOME, OUTPUT_KINDS, Section, command, option, outputs, reading
from motionmind.cli.printing import count
from motionmind.cli.sources import parse_movement, read_movement, read_part
from motionmind.cli.stages import move_onto_stage
from motionmind.cli.types import FILE, FRAME, RATE, Area, Number
from motionmind.cli.warming import preparing
from motionmind.display import displayed, displayed_path
from motionmind.ensemble import KEEP_RANGE_M
from motionmind.errors import MotionMindError
from motionmind.files import all_or_none
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.ensemble.dancers import Ensemble
    from motionmind.formats.papers import Form

ENSEMBLES = (".glb", ".bvh", ".toml")  # what an ensemble becomes


@command("motionmind posture ballet/adagio --frame 23 -o A.json")
@click.argument("source", shell_complete=completion.movement)
@outputs(f"File to write: {OUTPUT_KINDS}; or .txt.")
@option(
    "--clip",
    "name",
    section=Section.PART,
    metavar="NAME",
    help="Clip of a score, a corpus or a glTF file  [default: the only one; of glTF the first]",
)
@option(
    "--frame",
    section=Section.PART,
    type=FRAME,
    metavar="N",
    help="Frame, counted from 0, or from the end if negative  [default: the only one, or N of SOURCE@N]",
)
@reading
@HOME
def posture(
    source: str, frame: int | None, name: str | None, outputs: tuple[Path, ...], home: Path | None, **options: Any
) -> None:
    """Extract one posture from a clip.

    SOURCE is a motion file, a score, a corpus, CORPUS/CLIP, a clip of a glTF file such as 'hero.glb#Dance', or a
    posture such as ballet/arabesque or clip.bvh@240.

    The posture is on human23 if the clip's joints map to it, by known names or by --joints; otherwise on the clip's own
    skeleton, such as human44.
    """
    from motionmind.names.finding import frame_of, select_frame
    from motionmind.names.spelling import Moment

    named = parse_movement(source, home)
    check_outputs([(path, (*MOTION_SUFFIXES, ".txt", *PICTURES)) for path in outputs], named.source.paths)
    if frame is not None and named.moment is not None:
        raise MotionMindError(f"{source}: already names a frame; leave out --frame")
    motion = read_movement(named.source, name, home, **options)
    at = frame_of(named, motion) if frame is None else select_frame(named.source.word, motion, Moment(frame))
    write_all(outputs, motion.posture(at))
    click.echo(
        f"{', '.join(map(displayed_path, outputs))}: frame {at} of {len(motion)}, on "
        f"{displayed(motion.skeleton.name)} ({count(len(motion.skeleton), 'joint')})"
    )


@command("motionmind convert clip.bvh clip.json --skeleton human23 --fps 30")
@click.argument("source", metavar="IN", shell_complete=completion.movement)
@click.argument("output", type=FILE, metavar="OUT")
@option(
    "--skeleton",
    section=Section.OUTPUT,
    type=click.Choice(["own", "human23"]),
    default="own",
    help="Skeleton of OUT: IN's own, or human23.",
)
@option("--fps", section=Section.OUTPUT, type=RATE, help="Frames per second of OUT  [default: IN's]")
@option(
    "--out-unit",
    section=Section.OUTPUT,
    metavar="UNIT",
    help="Unit of length of a .bvh OUT, as in --unit  [default: cm]",
)
@option(
    "--loop",
    "is_loop",
    section=Section.MOTION,
    is_flag=True,
    help="Write only the stretch that repeats best, closed as by the loop command.",
)
@option(
    "--stage",
    section=Section.MOTION,
    type=Area(),
    metavar="WIDTHxDEPTH",
    help="Stage to stay on, metres, around the origin: turns and moves the movement as a whole.",
)
@for_program("Program to open OUT in: OUT gets the unit, frames per second and root that it expects.")
@on_rig("File with the rig for OUT: the skeleton of a .bvh OUT, or the character of a .glb OUT.")
@option(
    "--keep",
    section=Section.MOTION,
    type=Number(*KEEP_RANGE_M),
    metavar="METRES",
    help="Shift entries and places of an ensemble by the least that keeps all dancers so far apart; OUT is a .toml.",
)
@option(
    "--steps",
    section=Section.MOTION,
    shell_complete=completion.corpora,
    metavar="CORPUS",
    help="Corpus whose steps take the dancers of an ensemble between formations; OUT is a .toml, with numbered .json.",
)
@option(
    "--form",
    section=Section.OUTPUT,
    type=click.Choice(["braces", "lines"]),
    default="braces",
    help="Notation of the papers for .txt.",
)
@reading
@HOME
def convert(
    source: str,
    output: Path,
    skeleton: str,
    fps: float | None,
    out_unit: str | None,
    program: str | None,
    rig: Path | None,
    form: Form,
    is_loop: bool,
    keep: float | None,
    steps: str | None,
    stage: tuple[float, float] | None,
    joints: Path | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Convert movement from one format to another.

    IN is a clip or posture of a score or a corpus, such as ballet/adagio, or a file: .bvh, .amc with its .asf, .glb,
    .gltf, .vrm, .vrma, .json or .txt (the papers' notation). On SMPL's joints it is .npz (AMASS; also Kimodo), .pkl
    (AIST++), .npy (FineDance, HumanML3D, MDM) or .pt (GVHMR).
    'hero.glb#Dance' names one clip of several in glTF. An ensemble (.toml, or a BVH file of several bodies)
    becomes one .glb, a .bvh for each dancer, or a .toml.

    OUT is .bvh, .json, .glb (a skinned body, for Blender and others), .vrma (a VRM animation), .npz (SMPL's joints) or
    .txt, which holds orientations only, on human23 (human44 if IN is). A note lists the data that OUT cannot hold.
    """
    from motionmind.formats import lossy_fields
    from motionmind.formats.papers import write_papers
    from motionmind.formats.rig_files import read_rig
    from motionmind.retarget.joint_mapping import is_human44
    from motionmind.retarget.retarget import own_skeleton, to_human23

    if is_ensemble(source, [output], ENSEMBLES):
        _convert_ensemble(source, output, home, fps, keep, steps, options | {"joints": joints})
        return
    if keep is not None or steps is not None:
        flag = "--steps" if keep is None else "--keep"
        raise MotionMindError(f"{flag} is for an ensemble (.toml), and {displayed(source)} is not one")
    named = parse_movement(source, home)
    read_from = [*named.source.paths, *rig_files(rig)]
    check_outputs([(output, (".bvh", ".json", ".txt", ".glb", ".npz", ".vrma"))], read_from)
    suffix = output.suffix.lower()
    if out_unit and suffix != ".bvh":
        raise MotionMindError(f"--out-unit {out_unit}: only BVH needs a unit, and {output} is not BVH")
    if out_unit and suffix in {file.suffix.lower() for file in rig_files(rig)}:
        raise MotionMindError(f"--out-unit {out_unit}: {output} gets the unit of {rig}")
    taker = check_delivery([output], program, rig)
    on = read_rig(rig) if rig else None
    motion = read_part(named, home, raw=True, **options)
    upright = "y" if options["up"] else None  # the reader has turned it
    if named.source.kind == "file":
        question_recording(named.source.file, motion, upright)
    if is_loop:
        cycle = find_loop(source, motion, up=upright)
        motion = cycle.motion
    if skeleton == "human23" or joints or (suffix == ".txt" and not is_human44(motion.skeleton)):
        motion = to_human23(motion, read_mapping(joints), up=upright)
    if on and motion.skeleton.difference(on.armature.motion.skeleton) is not None:
        motion = own_skeleton(motion, up=upright)
    if fps is not None:
        motion = motion.resample(fps)
    motion = move_onto_stage(source, motion, stage)
    source_file = next(iter(named.source.paths), None)
    delivery = Delivery(taker, on, taker.fps if taker and fps is None else None, out_unit)
    if suffix == ".txt":
        write_papers(output, motion, form=form)
        note_licences(output, motion)
        note_lossy_fields(output, lossy_fields(motion, output, source_file))
    else:
        motion = delivery.write(output, motion, source_file)
    size, body = _written_body(suffix, motion)
    click.echo(f"{displayed_path(output)}: {count(len(motion), 'frame')}, {count(size, 'joint')} ({displayed(body)})")
    delivery.print([output])
    if is_loop:
        print_loop(cycle)


def _convert_ensemble(
    source: str,
    output: Path,
    home: Path | None,
    fps: float | None,
    keep: float | None,
    steps: str | None,
    options: dict[str, Any],
) -> None:
    """Write an ensemble as one .glb with a body for each dancer, as numbered .bvh files, or as .toml."""
    from motionmind.formats.bvh import write_bvh
    from motionmind.formats.glb import write_group_glb

    without = ["skeleton", "out_unit", "program", "rig", "form", "is_loop", "stage"]
    is_file = output.suffix.lower() == ".toml" or keep is not None or steps is not None
    suffixes = ENSEMBLES if keep is None and steps is None else (".toml",)
    without += ["fps"] if is_file else []
    own = ".json" if steps is not None else output.suffix if output.suffix.lower() == ".bvh" else ""  # of each dancer

    def written(dancers: int) -> list[Path]:
        return ([] if own == output.suffix else [output]) + (_own_files(output, own, dancers) if own else [])

    ensemble = open_ensemble(source, [output], suffixes, home, without, written, **options)
    if is_file:
        _write_changed(source, output, ensemble, home, keep, steps)
        return
    motions = ensemble.motions(ensemble.times(fps))
    files = [output]
    with all_or_none():
        if output.suffix.lower() == ".glb":
            write_group_glb(output, motions)
        else:
            files = _own_files(output, output.suffix, len(motions))
            for file, motion in zip(files, motions, strict=True):
                write_bvh(file, motion)
    names = ", ".join(map(displayed_path, files))
    click.echo(f"{names}: " + "\n".join(describe_ensemble(ensemble)))


def _own_files(output: Path, suffix: str, dancers: int) -> list[Path]:
    """Return the file of each dancer, as "duo-1.bvh" of "duo.bvh"."""
    return [numbered(output.with_suffix(suffix), number, dancers) for number in range(1, dancers + 1)]


def _write_changed(
    source: str, output: Path, ensemble: Ensemble, home: Path | None, keep: float | None, steps: str | None
) -> None:
    """Write an ensemble as .toml, kept apart and with steps on its ways if asked for."""
    lines = list[str]()
    if keep is not None:
        ensemble, lines = keep_ensemble(ensemble, keep)
    with all_or_none():
        if steps is not None:
            from motionmind.corpus.store import locate
            from motionmind.ensemble.stepping import dance_ways
            from motionmind.tween.engine import Engine

            if not any(dancer.ways for dancer in ensemble.dancers):
                raise MotionMindError(f"--steps {steps}: {displayed(source)} changes no formation")
            locate(steps, home)
            files = _own_files(output, ".json", len(ensemble.dancers))
            with preparing():
                ensemble = write_steps(output, files, dance_ways(ensemble, Engine.load(steps, home)))
        write_ensemble(source if steps is None else str(output), output, ensemble)
    lines += describe_ensemble(ensemble) if keep is None or steps else []
    click.echo(f"{displayed_path(output)}: " + "\n".join(lines))


def _written_body(suffix: str, motion: Motion) -> tuple[int, str]:
    """Return the number of joints and the name of the body in a written file."""
    if suffix == ".npz":
        from motionmind.formats._smpl import smpl_body_for

        body = smpl_body_for(motion.skeleton)
        return len(body), body.name
    if suffix == ".vrma":
        from motionmind.formats.vrma import N_BONES

        return N_BONES, "VRM"
    return len(motion.skeleton), motion.skeleton.name
