"""Write movement for another program, and on the rig of a file: --for and --rig."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from motionmind.cli.files import evened, note_licences, note_lossy_fields, read, read_mapping, write
from motionmind.cli.options import Section, option
from motionmind.cli.printing import count
from motionmind.cli.types import EXISTING_CLIP
from motionmind.clip_names import split_clip
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture
    from motionmind.formats._rig_file import RigFile
    from motionmind.formats.programs import Program
    from motionmind.music import Sound
    from motionmind.names.spelling import PostureName

_Function = TypeVar("_Function", bound=Callable[..., Any])
_DELIVERED_SUFFIXES = (".bvh", ".glb")  # of movement for other programs


def for_program(text: str) -> Callable[[_Function], _Function]:
    """Add --for as `program`: the name of a program, or None; `text` is its help."""
    return option(
        "--for", "program", section=Section.OUTPUT, type=click.Choice(["blender", "unreal", "maya"]), help=text
    )


def on_rig(text: str) -> Callable[[_Function], _Function]:
    """Add --rig, also called --into, as `rig`: an existing file or a clip of one, or None; `text` is its help."""
    return option("--rig", "--into", "rig", section=Section.OUTPUT, type=EXISTING_CLIP, help=text)


def rig_files(rig: Path | None) -> list[Path]:
    """Return the file of --rig, without the name of a clip; none without it."""
    return [Path(split_clip(rig)[0])] if rig else []


@dataclass(frozen=True)
class Delivery:
    """The target of .bvh and .glb files: a program, a rig, a rate and a unit.

    Attributes:
        program: the program that opens them; None for any.
        rig: the rig to write them on; None for the movement's own skeleton.
        fps: frames a second to stretch the movement to; None for its own.
        unit: the unit of BVH's lengths; None for that of the rig or the program, or else centimetres.
        sound: the sound of films and pages beside them; None for none.
    """

    program: Program | None = None
    rig: RigFile | None = None
    fps: float | None = None
    unit: str | None = None
    sound: Sound | None = None

    def write(self, path: Path, motion: Motion, source: Path | None = None) -> Motion:
        """Write a motion, note what the file cannot hold of it and of `source`, and return the motion as written."""
        from motionmind.formats import lossy_fields, write_motion
        from motionmind.formats.programs import write_for
        from motionmind.formats.rig_files import retarget_to_rig, write_on_rig

        if not takes_delivery(path):
            write(path, motion, source, self.sound)
            return motion
        motion = evened(path, motion.stretch_to(self.fps) if self.fps else motion)
        note_licences(path, motion)
        if self.rig and self.rig.suffix == path.suffix.lower():
            motion = write_on_rig(path, motion, self.rig)
        else:
            motion = retarget_to_rig(motion, self.rig) if self.rig else motion
            if self.program:
                write_for(path, motion, self.program, unit=self.unit)
            else:
                write_motion(path, motion, unit=self.unit or "cm")
        note_lossy_fields(path, lossy_fields(motion, path, source))
        return motion

    def print(self, outputs: Sequence[Path]) -> None:
        """Print the rig of the files, and how to open each in the program."""
        delivered = [path for path in outputs if takes_delivery(path)]
        if self.rig and delivered:
            joints = count(len(self.rig.armature.motion.skeleton), "joint")
            click.echo(f"rig       {displayed_path(Path(self.rig.path))}, {joints}")
        if self.program:
            for suffix in dict.fromkeys(path.suffix.lower() for path in delivered):
                click.echo(f"{self.program.title}: {self.program.advice[suffix]}")


def takes_delivery(path: Path) -> bool:
    """Return whether a file holds movement for other programs."""
    return path.suffix.lower() in _DELIVERED_SUFFIXES


def check_delivery(outputs: Sequence[Path], program: str | None, rig: Path | None) -> Program | None:
    """Return the program of --for, None without it; check that it and --rig apply to an output.

    Raises:
        MotionMindError: no output is a .bvh or .glb file, or the program does not read one of these.
    """
    from motionmind.formats.programs import program_for

    delivered = [path for path in outputs if takes_delivery(path)]
    if program and outputs:
        programs = [program_for(program, path) for path in delivered or outputs]
        return programs[0]
    if (program or rig) and not delivered:
        raise MotionMindError(f"--{'for' if program else 'rig'} applies to .bvh and .glb files: name one with -o")
    return None


def find_rig(
    rig: Path | None,
    ends: Sequence[PostureName],
    a: Posture,
    *,
    joints: Path | None,
    unit: str | None,
    source_fps: float | None,
    up: str | None,
) -> RigFile | None:
    """Return the rig of --rig, or else the rig that the files of both ends share; None if there is neither.

    Args:
        rig: the value of --rig; None without it.
        ends: the names of A and B.
        a: the posture A.
        joints: the value of --joints.
        unit: the value of --unit.
        source_fps: the value of --source-fps.
        up: the value of --up.

    Raises:
        MotionMindError: the rig cannot be read or written on, or the body of A does not map to it.
    """
    from motionmind.formats.rig_files import RIG_SUFFIXES, read_rig, retarget_to_rig
    from motionmind.names.finding import frame_of

    mapping = read_mapping(joints)

    @cache
    def read_once(path: Path | str) -> Motion:
        return read(path, unit, None, source_fps, None)

    def find_end(end: PostureName) -> RigFile | None:
        path = next(iter(end.source.paths), None)
        if end.source.kind != "file" or path is None or path.suffix.lower() not in RIG_SUFFIXES:
            return None
        motion = read_once(end.source.file)
        frame = frame_of(end, motion)
        return read_rig(end.source.file, (frame, frame), motion=motion, unit=unit, joints=mapping, up=up)

    first, last = map(find_end, ends)
    if rig is not None:
        found = read_rig(rig, motion=read_once(rig), unit=unit, joints=mapping, up=up)
    elif first and last and first.is_like(last):
        found = first
    else:
        return None
    retarget_to_rig(a.as_motion(), found)  # refuses other bodies before the search
    return found.with_ends_of(first, last)
