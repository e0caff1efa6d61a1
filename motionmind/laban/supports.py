"""The supports of a score as signs: steps, positions of the feet, and travel in the air."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.geometry import rotations as rot
from motionmind.laban.measured import Measured
from motionmind.laban.signs import AROUND, LEVELS, PLACE, Direction, nearest_around

IN_PLACE_M = 0.15  # a foot that comes nearer to the point of support than this is in place: half a foot's length

_Event = tuple[Direction | None, float]


@dataclass(frozen=True)
class Supported:
    """Changes of the supports in the move to each row.

    Attributes:
        bears: whether the left and the right foot bear weight [T, 2].
        events: for each row the signs of left and right support and of the path, each with how many degrees it is off;
            the first row's are the starting position.
    """

    bears: Bools
    events: list[tuple[_Event, _Event, _Event]]


def support_signs(measured: Measured) -> Supported:
    """Return the signs of a score's supports.

    A step onto one foot goes from the point of support before; feet that stand together are where they are from the
    point midway between them. A foot that keeps its weight while the other leaves is in place. Where both feet land, or
    slide, a path says where they travel.
    """
    back = rot.about_vertical(-np.radians(measured.facing))
    events: list[tuple[_Event, _Event, _Event]] = []
    point: Floats | None = None  # of support before, or before the jump
    states: list[_Event] = []
    for row, bears in enumerate(measured.bears):
        before = measured.bears[row - 1] if row else np.zeros(2, dtype=np.bool_)
        feet = [int(side) for side in np.flatnonzero(bears)]
        signs: list[_Event] = [(None, 0.0), (None, 0.0), (None, 0.0)]
        if not feet:
            events.append((signs[0], signs[1], signs[2]))
            states = []
            continue
        centre = measured.feet[row, feet].mean(axis=0)
        travel = np.zeros(3) if point is None else rot.mul_vec(back[row], centre - point)
        now: list[_Event] = [(None, 0.0), (None, 0.0)]
        for side in feet:
            apart = rot.mul_vec(back[row], measured.feet[row, side] - centre)
            now[side] = _sign(apart, int(measured.levels[row, side]))
        if (bears == before).all():
            for side in feet:
                signs[side] = now[side] if now[side][0] != states[side][0] else (None, 0.0)
        else:
            signs[:2] = now
            if len(feet) == 1 and not before[feet[0]]:
                signs[feet[0]] = _sign(travel, int(measured.levels[row, feet[0]]))
        stepped = len(feet) == 1 and not before[feet[0]]
        shifted = (bears != before).any() and (bears & before).any()  # the point of support moves, not the feet
        if not stepped and not shifted and np.hypot(travel[0], travel[2]) > IN_PLACE_M:
            path, degrees = _sign(travel, 1)
            signs[2] = (Direction(path.around) if path else None, degrees)
        events.append((signs[0], signs[1], signs[2]))
        point, states = centre, now
    return Supported(measured.bears, events)


def _sign(apart: Floats, level: int) -> _Event:
    """Return the direction sign of a vector over the floor [3], metres, and how many degrees it is off."""
    if np.hypot(apart[0], apart[2]) <= IN_PLACE_M:
        return Direction(PLACE, LEVELS[level]), 0.0
    around = nearest_around(apart)
    turn = float(np.degrees(np.arctan2(apart[0], apart[2]))) - 45.0 * AROUND.index(around)
    return Direction(around, LEVELS[level]), abs((turn + 180.0) % 360.0 - 180.0)
