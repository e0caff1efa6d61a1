"""The signs of Labanotation, and the staff that they stand on.

A direction sign gives where a limb or a step goes, in sectors of 45 degrees, and its level; a narrow sign, how much a
limb is bent. Directions belong to the body's front, with the vertical kept upright: the standard cross of axes.

Source: A. Hutchinson Guest, "Labanotation: the system of analyzing and recording movement", 4th ed., Routledge (2005).
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import floor

import numpy as np

from motionmind._typing import Floats

PLACE = "place"
AROUND = ("forward", "left-forward", "left", "left-back", "back", "right-back", "right", "right-forward")  # from ahead
LEVELS = ("low", "middle", "high")
SIGN_SECTOR_DEG = 45.0  # of a direction, a level and a turn
BEND_STEP_DEG = 60.0  # between straight, narrow and very narrow
BENDS = ("", "bent", "very bent")

SUPPORTS = ("left support", "right support")
LEGS = ("left leg", "right leg")
ARMS = ("left arm", "right arm")
TWISTS = ("torso turn", "head turn")  # of parts against the body's front
TURN, PATH = "turn", "path"
COLUMNS = (*SUPPORTS, *LEGS, "torso", TWISTS[0], *ARMS, "head", TWISTS[1], TURN, PATH)
GESTURES = (*LEGS, *ARMS, "torso", "head")


@dataclass(frozen=True)
class Direction:
    """A direction sign.

    Attributes:
        around: "place", or one of `AROUND`.
        level: one of `LEVELS`; "" for a path over the floor.
        bend: 0 for a straight limb, 1 for a narrow sign, 2 for a very narrow one.
        touch: whether the foot of a gesture rests on the floor without weight.
    """

    around: str
    level: str = ""
    bend: int = 0
    touch: bool = False

    def __str__(self) -> str:
        return " ".join(filter(None, (self.around, self.level, BENDS[self.bend], "touch" if self.touch else "")))


@dataclass(frozen=True)
class Turn:
    """A turn sign.

    Attributes:
        left: degrees to the left, a multiple of 45: of the body, how far it turns; of torso or head, where it faces.
    """

    left: int

    def __str__(self) -> str:
        return f"turn {abs(self.left)}" + (" left" if self.left > 0 else " right" if self.left else "")


@dataclass(frozen=True)
class Hold:
    """A hold sign: the foot keeps its weight."""

    def __str__(self) -> str:
        return "hold"


Value = Direction | Turn | Hold


@dataclass(frozen=True)
class Sign:
    """A sign on a staff.

    Attributes:
        column: one of `COLUMNS`.
        begin: the count where its movement begins, from 0.
        counts: how long the movement takes.
        value: what it says.
    """

    column: str
    begin: float
    counts: float
    value: Value

    @property
    def end(self) -> float:
        """The count where its movement ends."""
        return round(self.begin + self.counts, N_DECIMALS)


N_DECIMALS = 4  # of counts


@dataclass(frozen=True)
class Staff:
    """A movement as signs.

    Attributes:
        title: its title.
        body: name of the body that moves.
        tempo: counts per minute.
        bar: counts in a bar.
        counts: its length.
        start: the starting position, by column.
        signs: the signs, in the order of columns, then of time.
    """

    title: str
    body: str
    tempo: float
    bar: int
    counts: float
    start: Mapping[str, Value]
    signs: tuple[Sign, ...]

    def column(self, name: str) -> Sequence[Sign]:
        """Return the signs of a column in order of time."""
        return self._columns.get(name, ())

    @cached_property
    def _columns(self) -> dict[str, list[Sign]]:
        columns: dict[str, list[Sign]] = {}
        for sign in self.signs:
            columns.setdefault(sign.column, []).append(sign)
        return columns


def overlapping(signs: Sequence[Sign], begin: float, end: float) -> range:
    """Return the places of those signs of a column that share some time with an interval."""
    first = bisect_right(signs, begin, key=lambda sign: sign.end)
    return range(first, bisect_left(signs, end, key=lambda sign: sign.begin))


def ending(signs: Sequence[Sign], count: float) -> Sign | None:
    """Return the sign of a column that ends at a count."""
    place = bisect_left(signs, count, key=lambda sign: sign.end)
    return signs[place] if place < len(signs) and signs[place].end == count else None


def allowed(column: str, value: Value) -> bool:
    """Return whether a column can hold a sign."""
    if isinstance(value, Hold):
        return column in SUPPORTS
    if isinstance(value, Turn):
        return (column == TURN and value.left != 0) or column in TWISTS
    if column == PATH:
        return value == Direction(value.around) and value.around != PLACE
    if value.around == PLACE and value.level == "middle" and column in GESTURES:
        return False  # neither up nor down
    if (value.bend and column not in (*LEGS, *ARMS)) or (value.touch and column not in LEGS):
        return False
    return column in (*SUPPORTS, *GESTURES) and bool(value.level)


def vector_of(around: str, level: str) -> Floats:
    """Return the unit vector of a direction sign [3]: x to the left, y up, z ahead.

    >>> vector_of("left", "middle").round(3).tolist()
    [1.0, 0.0, 0.0]
    """
    rise = np.radians(SIGN_SECTOR_DEG * (LEVELS.index(level) - 1) * (2.0 if around == PLACE else 1.0))
    turn = 0.0 if around == PLACE else np.radians(SIGN_SECTOR_DEG * AROUND.index(around))
    return np.array([np.cos(rise) * np.sin(turn), np.sin(rise), np.cos(rise) * np.cos(turn)])


def nearest_sign(direction: Floats) -> tuple[str, str]:
    """Return the direction and level whose sector a unit vector is in [3]: x to the left, y up, z ahead.

    >>> nearest_sign(np.array([0.0, -1.0, 0.0]))
    ('place', 'low')
    """
    rise = _sector(float(np.degrees(np.arcsin(np.clip(direction[1], -1.0, 1.0)))))
    if abs(rise) == 2:
        return PLACE, LEVELS[1 + rise // 2]
    return nearest_around(direction), LEVELS[1 + rise]


def nearest_around(direction: Floats) -> str:
    """Return the direction over the floor that a vector is nearest to [3]: x to the left, z ahead."""
    return AROUND[_sector(float(np.degrees(np.arctan2(direction[0], direction[2])))) % len(AROUND)]


def nearest_turn(degrees: float) -> int:
    """Return the multiple of 45 degrees nearest to an angle."""
    return int(SIGN_SECTOR_DEG) * _sector(degrees)


def _sector(degrees: float) -> int:
    # Rounded, so that an angle between two sectors falls into the same one on every machine.
    return floor(round(degrees / SIGN_SECTOR_DEG, 6) + 0.5)


def nearest_bend(degrees: float) -> int:
    """Return the bend, 0 to 2, whose narrow sign is nearest to a joint's flexion."""
    return min(floor(round(degrees / BEND_STEP_DEG, 6) + 0.5), 2)
