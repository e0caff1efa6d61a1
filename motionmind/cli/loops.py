"""The loop command: cut the cycle of a movement, and close it."""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.delivery import Delivery, check_delivery, for_program, on_rig, rig_files
from motionmind.cli.files import MOTION_SUFFIXES, check_outputs, question_recording, read_mapping
from motionmind.cli.options import HOME, OUTPUT_KINDS, Section, command, option, outputs, reading
from motionmind.cli.printing import print_written
from motionmind.cli.sources import parse_movement, read_part
from motionmind.cli.types import Number
from motionmind.display import displayed
from motionmind.errors import MotionMindError, MotionMindWarning, SkeletonError
from motionmind.files import all_or_none

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.footing.cycle import Cycle

SHORTEST_CYCLE_S, LONGEST_CYCLE_S = 0.5, 8.0
_SECONDS = Number(min=0, min_open=True, max=60)
_KEYFRAME_FPS = 30.0  # rate of uneven frames, such as keyframes, once they are resampled
_SAME_POSTURE_DEG = 20.0  # mean turn of the joints in a frame in which only the root leaps
_FAR_DEG = 10.0  # ends whose joints are farther apart on average are hardly a cycle


@command("motionmind loop ballet/adagio -o cycle.bvh")
@click.argument("source", shell_complete=completion.movement)
@outputs(f"File to write: {OUTPUT_KINDS}.")
@for_program("Program to open .bvh and .glb files in: they get the unit, frames per second and root that it expects.")
@on_rig("File with the rig for .bvh files (its skeleton) or .glb files (its character)  [default: SOURCE]")
@option(
    "--shortest",
    section=Section.PART,
    type=_SECONDS,
    default=SHORTEST_CYCLE_S,
    metavar="S",
    help="Least seconds a round.",
)
@option(
    "--longest", section=Section.PART, type=_SECONDS, default=LONGEST_CYCLE_S, metavar="S", help="Most seconds a round."
)
@option("--in-place", section=Section.MOTION, is_flag=True, help="Take out travel and turns along the floor.")
@reading
@HOME
def loop(
    source: str,
    outputs: tuple[Path, ...],
    program: str | None,
    rig: Path | None,
    shortest: float,
    longest: float,
    in_place: bool,
    joints: Path | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Cut the stretch that repeats best out of a movement, and close it.

    SOURCE is a motion file, a clip of a corpus or a score. The ends of the stretch have the nearest postures and
    velocities. What is left between them is spread over the round, and over each foot's steps, so that feet stand
    still. The last frame is the first one, one round later: players that repeat all frames need it left out.
    """
    from motionmind.formats.rig_files import RIG_SUFFIXES, read_rig

    named = parse_movement(source, home)
    check_outputs([(path, MOTION_SUFFIXES) for path in outputs], [*named.source.paths, *rig_files(rig)])
    taker = check_delivery(outputs, program, rig)
    if shortest > longest:
        raise MotionMindError(f"--shortest {shortest:g}: more than --longest {longest:g}")
    motion = read_part(named, home, raw=True, **options)
    upright = "y" if options["up"] else None  # the reader has turned it
    if named.source.kind == "file":
        question_recording(named.source.file, motion, upright)
        own = named.source.paths[0]
        if (
            rig is None
            and own.suffix.lower() in RIG_SUFFIXES
            and own.suffix.lower() in {p.suffix.lower() for p in outputs}
        ):
            rig = Path(named.source.file)  # with the clip, if one is named
    on = read_rig(rig, unit=options["unit"], joints=read_mapping(joints), up=options["up"]) if rig else None
    cycle = find_loop(source, motion, shortest, longest, in_place=in_place, up=upright)
    delivery = Delivery(taker, on, taker.fps if taker else None)
    with all_or_none():
        for path in outputs:
            delivery.write(path, cycle.motion)
    print_loop(cycle)
    print_written(outputs)
    delivery.print(outputs)


def find_loop(
    source: str,
    motion: Motion,
    shortest: float = SHORTEST_CYCLE_S,
    longest: float = LONGEST_CYCLE_S,
    *,
    in_place: bool = False,
    up: str | None = None,
) -> Cycle:
    """Return the closed cycle of the movement in `source`, of any skeleton, whose world may have z up.

    Warns:
        MotionMindWarning: its ends are far apart.
    """
    import numpy as np

    from motionmind.footing.cycle import close_cycle
    from motionmind.retarget.vertical import Z_UP_TO_Y_UP, to_y_up

    if motion.keyframed or not motion.is_even:
        motion = motion.resample(_KEYFRAME_FPS)
    has_z_up = _has_z_up(motion, up)
    motion = _carried_on(motion)
    begin, end = _longest_part(motion)
    part = replace(motion.slice(begin, end), name=source)  # as errors call it
    cycle = close_cycle(to_y_up(part) if has_z_up else part, shortest, longest)
    cycle = replace(cycle, frames=(begin + cycle.frames[0], begin + cycle.frames[1]))
    played = cycle.in_place() if in_place else cycle.motion
    if has_z_up:
        from motionmind.geometry import rotations as rot

        back, rotations = rot.inv(Z_UP_TO_Y_UP), played.rotations.copy()
        rotations[:, 0] = rot.mul(back, rotations[:, 0])
        played = replace(played, rotations=rotations, root=rot.mul_vec(back, played.root))
    if (far := float(np.degrees(cycle.gap.mean()))) > _FAR_DEG:
        warnings.warn(
            f"{source}: the ends are {far:.0f} degrees a joint apart: it hardly repeats",
            MotionMindWarning,
            stacklevel=2,
        )
    return replace(cycle, motion=replace(played, name=motion.name))


def print_loop(cycle: Cycle) -> None:
    """Print where the cycle was, its ends before they were closed, and how far joints were moved for that."""
    import numpy as np

    motion, (first, last) = cycle.motion, cycle.frames
    body = motion.skeleton
    click.echo(
        f"cycle     frames {first}-{last}, {motion.times[-1]:.2f} s; the last frame is the first of the next round"
    )
    turn = np.degrees(cycle.ground.turn)
    travel = float(np.linalg.norm(cycle.ground.travel))
    click.echo(f"a round   {travel:.2f} m" + f", turning {abs(turn):.0f} degrees" * bool(turn))
    gap, speed = np.degrees(cycle.gap), np.degrees(cycle.speed_gap)
    click.echo(
        f"gap       {gap.mean():.1f} degrees a joint, {displayed(body.names[int(gap.argmax())])} {gap.max():.0f}; "
        f"root {1000.0 * cycle.root_gap:.0f} mm; speeds {speed.mean():.0f} degrees/s a joint; closed"
    )
    moved = np.degrees(cycle.moved)
    most = [f"{displayed(body.names[joint])} {moved[joint]:.0f}" for joint in np.argsort(-moved)[:3]]
    click.echo(f"moved     {moved.mean():.1f} degrees a joint at most, {', '.join(most)}")


def _carried_on(motion: Motion) -> Motion:
    """Return a movement whose root goes on at its speed where it is put back to where a loop began."""
    import numpy as np

    from motionmind.corpus.dropped import find_gaps
    from motionmind.geometry import rotations as rot

    root = motion.root.copy()
    for gap in find_gaps(motion):
        at = gap.start
        turned = np.degrees(rot.angle(motion.rotations[at - 1], motion.rotations[at]).mean())
        if gap.kind != "leap" or at < 2 or turned > _SAME_POSTURE_DEG:
            continue
        root[at:] += 2.0 * root[at - 1] - root[at - 2] - root[at]
    return replace(motion, root=root)


def _longest_part(motion: Motion) -> tuple[int, int]:
    """Return the bounds of the longest part of a movement without leaps or dropped frames."""
    from motionmind.corpus.dropped import find_gaps

    ends = sorted({0, len(motion), *(frame for gap in find_gaps(motion) for frame in (gap.start, gap.stop))})
    return max(pairwise(ends), key=lambda part: part[1] - part[0])


def _has_z_up(motion: Motion, up: str | None) -> bool:
    """Return whether the world of a movement has z up, as its retargeting to human23 would find."""
    from motionmind.body.human import human23
    from motionmind.retarget.joint_mapping import joint_mapping
    from motionmind.retarget.retarget import fit_upright

    if human23().difference(motion.skeleton) is None or joint_mapping(motion.skeleton) is None:
        return False
    try:
        return fit_upright(motion, None, up)[1].axis == "z"
    except SkeletonError:
        return False
