"""Movement for other programs: the unit, rate and root that each expects with its default settings.

By the sources of Blender 5.0 (io_anim_bvh), its import takes one unit as a metre, y as up and -z as forward, and each
frame as one of the scene's, 24 a second in a new one; Scale multiplies lengths, Update Scene FPS sets the scene's rate
to the file's. glTF has metres, y up and seconds everywhere; readers turn it.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from motionmind.body.motion import Motion
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError
from motionmind.files import FilePath
from motionmind.formats.units import metres_per_unit

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Program:
    """A program that reads written movement.

    Attributes:
        title: its name.
        fps: frames a second of its new scenes.
        advice: {suffix that it reads: how to open the file}.
        other: {suffix that it does not read: remedy}.
        unit: the unit of BVH's lengths that needs no scaling.
        has_root: whether bodies have an extra bone on the floor at the origin, above the moving root.
    """

    title: str
    fps: float
    advice: Mapping[str, str]
    other: Mapping[str, str] = field(default_factory=dict)
    unit: str = "m"
    has_root: bool = False


PROGRAMS = {
    "blender": Program(
        "Blender",
        24.0,
        {
            ".bvh": "File, Import, Motion Capture (.bvh)",
            ".glb": "File, Import, glTF 2.0",
        },
    ),
    "unreal": Program(
        "Unreal Engine",
        30.0,
        {".glb": "Import to the Content Browser, as a skeletal mesh with its animation"},
        {".bvh": "it reads no BVH: write .glb"},
        has_root=True,
    ),
    "maya": Program(
        "Maya",
        24.0,
        {".bvh": "open it in MotionBuilder (File, Motion File Import), or by a script: Maya alone reads no BVH"},
        {".glb": "it reads no glTF: write .bvh for MotionBuilder, or open the .glb in Blender and export FBX"},
        unit="cm",
    ),
}


def program_for(name: str, path: FilePath) -> Program:
    """Return the program `name` of `PROGRAMS`, if it reads the format of `path`.

    Raises:
        MotionMindError: it does not; the message names the right format.
    """
    program, suffix = PROGRAMS[name], Path(path).suffix.lower()
    if suffix not in program.advice:
        what = program.other.get(suffix, f"it reads {' and '.join(program.advice)}")
        raise MotionMindError(f"{path}: not for {program.title}: {what}")
    return program


def write_for(path: FilePath, motion: Motion, program: Program, *, unit: str | None = None) -> None:
    """Write `motion` for a program, with its unit (or `unit`) and root, at the motion's own rate.

    Raises:
        MotionMindError: as `write_motion`.
    """
    if Path(path).suffix.lower() == ".bvh":
        from motionmind.formats.bvh import write_bvh

        write_bvh(path, motion, unit or program.unit)
        if program is PROGRAMS["blender"]:
            note_settings(path, motion, unit or program.unit)
    else:
        from motionmind.formats.glb import write_glb

        write_glb(path, motion, has_root=program.has_root)


def note_settings(path: FilePath, motion: Motion, unit: str | float, remedy: str = "") -> None:
    """Log the settings that Blender's import of BVH needs, if any.

    The logger is "motionmind.formats.programs", the level INFO.

    Args:
        path: the written file.
        motion: the movement in it.
        unit: the unit of its lengths.
        remedy: text to append, such as another way.
    """
    scale = metres_per_unit(unit)
    settings = [f"set Scale to {scale:.5g}"] if abs(scale - 1.0) > 1e-6 else []
    if len(motion) > 1 and abs(motion.fps / PROGRAMS["blender"].fps - 1.0) > 1e-6:
        settings.append("tick Update Scene FPS")
    if settings:
        _log.info("%s: in Blender's import, %s%s", displayed_path(path), " and ".join(settings), remedy)
