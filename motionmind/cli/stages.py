"""Stages: where a movement leaves one, and putting it there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from motionmind.cli.printing import note
from motionmind.display import displayed

if TYPE_CHECKING:
    from motionmind.body.motion import Motion


def note_overstep(name: str, motion: Motion, stage: tuple[float, float] | None, *, may_turn: bool = True) -> None:
    """Note where a movement leaves the stage, if there is one, and what keeps it there, if it may turn."""
    from motionmind.body.stage import find_overstep, find_spot

    beyond = find_overstep(motion, stage) if stage else None
    if stage and beyond:
        where = f"{beyond.metres:.2f} m beyond the {beyond.side} edge at {beyond.seconds:.1f} s"
        spot = find_spot(motion.root[:, [0, 2]], stage, may_turn=may_turn)
        remedy = f"{spot} it stays on it" if spot else "it is larger than the stage"
        note(f"{displayed(name)} leaves the stage, {where}; {remedy}")


def move_onto_stage(name: str, motion: Motion, stage: tuple[float, float] | None) -> Motion:
    """Return a movement, turned and moved to stay on a stage; note what moved it, or how far it leaves the stage."""
    from motionmind.body.stage import check_stage, find_overstep, find_spot

    if stage is None or find_overstep(motion, check_stage(stage)) is None:
        return motion
    spot = find_spot(motion.root[:, [0, 2]], stage)
    if spot is None:
        note_overstep(name, motion, stage)
        return motion
    note(f"{displayed(name)}: {spot} to stay on the stage")
    return spot.place(motion)
