"""The commands that extract postures from clips and convert movement between formats."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.delivery import Delivery, check_delivery, for_program, on_rig
from motionmind.cli.files import (
    MOTION_SUFFIXES,
    check_outputs,
    note_licences,
    note_lossy_fields,
    question_recording,
    read_mapping,
    write_all,
)
from motionmind.cli.options import HOME, OUTPUT_KINDS, Section, command, option, outputs, reading
from motionmind.cli.printing import count
from motionmind.cli.sources import parse_movement, read_movement, read_part
from motionmind.cli.types import FILE, FRAME, RATE
from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.formats.papers import Form


@command("motionmind posture ballet/adagio --frame 23 -o A.json")
@click.argument("source", shell_complete=completion.movement)
@outputs(f"File to write: {OUTPUT_KINDS}; or .txt.")
@option(
    "--clip",
    "name",
    section=Section.PART,
    metavar="NAME",
    help="Clip of a score or a corpus  [default: its only one]",
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

    SOURCE is a motion file, a score, a corpus, CORPUS/CLIP, or a posture such as ballet/arabesque or clip.bvh@240.

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
@for_program("Program to open OUT in: OUT gets the unit, frames per second and root that it expects.")
@on_rig("File with the rig for OUT: the skeleton of a .bvh OUT, or the character of a .glb OUT.")
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
    joints: Path | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Convert movement from one format to another.

    IN is a clip or posture of a score or a corpus, such as ballet/adagio, or a file: .bvh, .amc with its .asf, .glb,
    .gltf, .vrm, .vrma, .json, .npz (AMASS), .pkl (AIST++), .npy (FineDance) or .txt (the papers' notation).

    OUT is .bvh, .json, .glb (a skinned body, for Blender and others), .vrma (a VRM animation), .npz (SMPL's joints) or
    .txt, which holds orientations only, on human23 (human44 if IN is). A note lists the data that OUT cannot hold.
    """
    from motionmind.formats import lossy_fields
    from motionmind.formats.papers import write_papers
    from motionmind.formats.rig_files import read_rig
    from motionmind.retarget.joint_mapping import is_human44
    from motionmind.retarget.retarget import own_skeleton, to_human23

    named = parse_movement(source, home)
    read_from = [*named.source.paths, *([rig] if rig else [])]
    check_outputs([(output, (".bvh", ".json", ".txt", ".glb", ".npz", ".vrma"))], read_from)
    suffix = output.suffix.lower()
    if out_unit and suffix != ".bvh":
        raise MotionMindError(f"--out-unit {out_unit}: only BVH needs a unit, and {output} is not BVH")
    if out_unit and rig and rig.suffix.lower() == suffix:
        raise MotionMindError(f"--out-unit {out_unit}: {output} gets the unit of {rig}")
    taker = check_delivery([output], program, rig)
    on = read_rig(rig) if rig else None
    motion = read_part(named, None, home, raw=True, **options)
    upright = "y" if options["up"] else None  # the reader has turned it
    if named.source.kind == "file":
        question_recording(named.source.paths[0], motion, upright)
    if skeleton == "human23" or joints or (suffix == ".txt" and not is_human44(motion.skeleton)):
        motion = to_human23(motion, read_mapping(joints), up=upright)
    if on and motion.skeleton.difference(on.armature.motion.skeleton) is not None:
        motion = own_skeleton(motion, up=upright)
    if fps is not None:
        motion = motion.resample(fps)
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
