"""The stage: where a movement leaves it, and the least turn and shift that keep it there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import as_floats, check_type
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

STAGE_RANGE_M = (1.0, 200.0)  # width and depth of a stage
TURN_STEP_DEG = 5.0  # between the turns that are tried
ON_STAGE_M = 1e-9  # beyond an edge, up to which rounding errors lead


class Overstep(NamedTuple):
    """The farthest step beyond the edge of a stage.

    Attributes:
        metres: how far it is beyond the edge.
        side: the edge as the performer sees it: "left", "right", "upstage" or "downstage".
        seconds: when.
        shift: displacement in x and z [2] that keeps the whole path on the stage, metres; None if no shift does.
    """

    metres: float
    side: str
    seconds: float
    shift: tuple[float, float] | None


class Spot(NamedTuple):
    """A turn to the left about the vertical axis through the origin, radians, then a shift in x and z [2], metres."""

    turn: float
    shift: Floats

    def at(self, places: Floats) -> Floats:
        """Return where places in x and z [N, 2] come to, metres."""
        return np.asarray(turned_path(places, self.turn) + self.shift)

    def place(self, motion: Motion) -> Motion:
        """Return a movement at this spot."""
        rotations, turned = motion.rotations.copy(), rot.about_vertical(np.asarray(self.turn))
        rotations[:, 0] = rot.mul(turned, rotations[:, 0])
        x, z = self.shift
        return replace(
            motion,
            rotations=rot.normalise(rotations) if self.turn else motion.rotations,
            root=(rot.mul_vec(turned, motion.root) if self.turn else motion.root) + np.array([x, 0.0, z]),
        )

    def __str__(self) -> str:
        """Return the turn and the shift in words."""
        degrees = np.degrees(self.turn)
        turned = (
            f"turned by {abs(degrees):.0f} degrees to the {'left' if degrees > 0.0 else 'right'}, " if self.turn else ""
        )
        return f"{turned}moved by {', '.join(f'{value + 0.0:+.2f}' for value in self.shift)} m in x, z"


def check_stage(stage: tuple[float, float]) -> tuple[float, float]:
    """Return the width and depth of a stage; MotionMindError if they are out of range."""
    low, high = STAGE_RANGE_M
    sides = as_floats("stage", stage)
    if sides.shape != (2,) or not ((low <= sides) & (sides <= high)).all():
        raise MotionMindError(f"stage must be its width and depth, from {low:g} to {high:g} m each, not {stage}")
    return float(sides[0]), float(sides[1])


def find_overstep(motion: Motion, stage: tuple[float, float]) -> Overstep | None:
    """Return the farthest step of a movement's path beyond a stage around the origin; None if it stays on the stage.

    Args:
        motion: the movement.
        stage: width and depth of the stage, metres.

    >>> from motionmind import Engine
    >>> from motionmind.plots import find_overstep
    >>> engine = Engine.load("ballet")
    >>> find_overstep(engine.corpus.motion(engine.corpus.clips[0]), (8.0, 6.0)) is None
    True
    """
    check_type("motion", motion, Motion)
    path, half = motion.root[:, [0, 2]], 0.5 * np.array(check_stage(stage))
    beyond = np.stack([path - half, -half - path], axis=-1)  # [T, axis, side]
    frame, axis, side = np.unravel_index(int(beyond.argmax()), beyond.shape)
    if beyond[frame, axis, side] <= ON_STAGE_M:
        return None
    shift = shift_onto(path, half)
    sides = (("left", "right"), ("downstage", "upstage"))
    return Overstep(
        float(beyond[frame, axis, side]),
        sides[axis][side],
        float(motion.times[frame] - motion.times[0]),
        None if shift is None else (float(shift[0]), float(shift[1])),
    )


def shift_onto(path: Floats, half: Floats) -> Floats | None:
    """Return the least shift [2] that keeps a path [T, 2] within `half` [2] of the origin; None if there is none."""
    low, high = path.min(axis=0), path.max(axis=0)
    if (high - low > 2.0 * half).any():
        return None
    return np.asarray(np.maximum(-half - low, 0.0) + np.minimum(half - high, 0.0))


def spots_on(
    path: Floats, stage: tuple[float, float], pivot: Floats, near: Spot, *, may_turn: bool = True
) -> Iterator[Spot]:
    """Yield spots that keep a path on a stage, with the least shift for each turn; first the least turns.

    Args:
        path: places of the root in x and z [T, 2], metres.
        stage: width and depth of the stage, metres.
        pivot: a place [2], whose displacement is the shift.
        near: the spot from which turns and shifts are counted.
        may_turn: whether it may turn.
    """
    half = 0.5 * np.array(stage)
    steps = np.arange(1, round(180.0 / TURN_STEP_DEG) + 1) if may_turn else np.zeros(0)
    for angle in np.radians(TURN_STEP_DEG) * np.concatenate([[0.0], np.stack([steps, -steps], axis=1).ravel()]):
        turn = float(near.turn + angle)
        stays = near.at(pivot[None])[0] - turned_path(pivot[None], turn)[0]
        shift = shift_onto(turned_path(path, turn) + stays, half)
        if shift is not None:
            yield Spot(turn, stays + shift)


def find_spot(path: Floats, stage: tuple[float, float], *, may_turn: bool = True) -> Spot | None:
    """Return the least turn, and with it the least shift, that keep a path on a stage; None if none does.

    Args:
        path: places of the root in x and z [T, 2], metres.
        stage: width and depth of the stage, metres.
        may_turn: whether it may turn.
    """
    return next(spots_on(path, stage, np.zeros(2), Spot(0.0, np.zeros(2)), may_turn=may_turn), None)


def turned_path(path: Floats, turn: float) -> Floats:
    """Return a path [T, 2] turned to the left about the origin by an angle, radians."""
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.asarray(path @ np.array([[cosine, -sine], [sine, cosine]]))
