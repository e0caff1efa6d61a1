"""The command that repairs a recording."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import MOTION_SUFFIXES, check_outputs, note_licences, read, read_mapping, write
from motionmind.cli.options import HOME, Section, command, option, output, reading
from motionmind.cli.printing import count, print_written
from motionmind.cli.types import FILE, Span
from motionmind.display import displayed, displayed_path
from motionmind.files import all_or_none, write_atomically

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.clean.cleaning import Cleaning

_RIG_SUFFIXES = (".glb", ".gltf", ".vrm")


@command("motionmind clean clip.bvh -o clean.bvh")
@click.argument("source", type=FILE, metavar="SOURCE")
@output(f"File to write: {', '.join(MOTION_SUFFIXES)}.")
@option("--report", section=Section.OUTPUT, type=FILE, help="File of the report, as JSON; - prints it.")
@option("--picture", section=Section.OUTPUT, type=FILE, help="Picture of the changes over time (.svg, .png).")
@option(
    "--without",
    section=Section.EDITS,
    type=click.Choice(["gaps", "flips", "filter", "feet", "floor"]),
    multiple=True,
    help="Step to leave out. Repeatable.",
)
@option(
    "--fill",
    section=Section.EDITS,
    type=Span(),
    multiple=True,
    metavar="FROM..TO",
    help="Frames to replace, counted from 0, besides the gaps that are found. Repeatable.",
)
@option(
    "--corpus",
    section=Section.CORPORA,
    metavar="NAME",
    shell_complete=completion.corpora,
    help="Corpus that fills gaps of more than 0.25 s, by name or folder  [default: they are left]",
)
@reading
@HOME
def clean(
    source: Path,
    output: Path,
    report: Path | None,
    picture: Path | None,
    without: tuple[str, ...],
    fill: tuple[tuple[int, int], ...],
    corpus: str | None,
    joints: Path | None,
    up: str | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Repair a recording.

    The steps are, in order: fill gaps, where frames repeat or have the body elsewhere; repair flips and spikes of
    joints; filter jitter; lock standing feet to their places; set the floor to 0. --without leaves a step out. The
    filter has no delay, and its cut-off follows from the recording's own noise.

    A .bvh file keeps the hierarchy of SOURCE, its channels and its unit. No joint is farther from where it was recorded
    than the report says.
    """
    from motionmind.clean.cleaning import clean_motion
    from motionmind.plots.cleaning import draw_cleaning
    from motionmind.tween.engine import Engine

    prints = report is not None and str(report) == "-"
    files: list[tuple[Path, tuple[str, ...]]] = [(output, MOTION_SUFFIXES)]
    files += [(report, ())] if report is not None and not prints else []
    files += [(picture, (".svg", ".png"))] if picture else []
    check_outputs(files, [source])
    is_turned = source.suffix.lower() == ".npz"  # whose reader turns the vertical
    motion = read(source, up=up if is_turned else None, **options)
    engine = Engine.load(corpus, home) if corpus is not None else None
    upright = "y" if is_turned else up
    cleaning = clean_motion(motion, without=without, fill=fill, engine=engine, joints=read_mapping(joints), up=upright)
    with all_or_none():
        cleaning = replace(cleaning, motion=_write(output, source, cleaning, options["unit"]))
        text = json.dumps(cleaning.report(), indent=1)
        if report is not None and not prints:
            write_atomically(report, (text + "\n").encode())
        if picture:
            draw_cleaning(cleaning).save(picture)
    if prints:
        click.echo(text)
        return
    for line in _lines(source, cleaning):
        click.echo(line)
    print_written([path for path, _ in files])


def _write(output: Path, source: Path, cleaning: Cleaning, unit: str | None) -> Motion:
    """Write the repaired recording, on the rig of its source if both are BVH or glTF; return it as written."""
    from motionmind.formats.bvh_changed import write_changed_bvh
    from motionmind.formats.rig_files import read_rig, write_on_rig

    suffixes = source.suffix.lower(), output.suffix.lower()
    if suffixes == (".bvh", ".bvh"):
        note_licences(output, cleaning.motion)
        return write_changed_bvh(output, source, cleaning.original, cleaning.motion, unit)
    if suffixes[0] in _RIG_SUFFIXES and suffixes[1] == ".glb":
        note_licences(output, cleaning.motion)
        return write_on_rig(output, cleaning.motion, read_rig(source, motion=cleaning.original, unit=unit))
    write(output, cleaning.motion, source)
    return cleaning.motion


def _lines(source: Path, cleaning: Cleaning) -> Iterator[str]:
    """Format what a cleaning changed: a line a step, then the greatest change."""
    motion, found = cleaning.original, cleaning.summary()
    joints = count(len(motion.skeleton), "joint")
    yield f"{displayed_path(source)}: {count(len(motion), 'frame')}, {joints}, {motion.fps:.4g} per second"
    for step in found.steps:
        change = ""
        if step.frames:
            turned = f", {step.greatest_degrees:.3g} degrees" * (step.greatest_degrees > 0.0)
            change = f" - {count(step.frames, 'frame')}, up to {step.greatest_mm:.2f} mm{turned}"
        yield f"{step.step:9} {displayed(step.about, 200)}{change}"
    farthest = max(found.joints, key=lambda one: one.mm)
    if not any(one.mm or one.degrees for one in found.joints):
        yield "result    nothing to repair: no joint is changed"
        return
    yield f"result    no joint is off by more than {farthest.mm:.2f} mm ({displayed(farthest.joint)})"
