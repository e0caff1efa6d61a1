"""Staves for tests: drawn at random, and of single signs."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np

from motionmind.laban.columns import notate
from motionmind.laban.scoring import score_text
from motionmind.laban.signs import (
    AROUND,
    BENDS,
    COLUMNS,
    LEVELS,
    PATH,
    PLACE,
    Direction,
    Hold,
    Sign,
    Staff,
    Turn,
    Value,
    allowed,
)
from motionmind.notation.read import read_score

ALL_DIRECTIONS = [
    Direction(around, level, bend, touch)
    for around, level, bend, touch in product((PLACE, *AROUND), LEVELS, range(len(BENDS)), (False, True))
]
ALL_VALUES: list[Value] = [
    *ALL_DIRECTIONS,
    *(Direction(around) for around in AROUND),
    *(Turn(degrees) for degrees in range(-720, 721, 45)),
    Hold(),
]
BY_COLUMN = {column: [value for value in ALL_VALUES if allowed(column, value)] for column in COLUMNS}
STANDING: dict[str, Value] = {
    "left support": Direction(PLACE, "middle"),
    "right support": Direction(PLACE, "middle"),
}


def random_staff(seed: int, n_signs: int = 6) -> Staff:
    """A staff with any signs in any columns, at quarters of counts."""
    rng = np.random.default_rng(seed)
    start, signs = {}, []
    for column in COLUMNS:
        values = BY_COLUMN[column]
        first = values[rng.integers(len(values))]
        if column not in ("turn", PATH) and not isinstance(first, Hold) and rng.random() < 0.5:
            start[column] = first
        end = 0.0
        for _ in range(rng.integers(n_signs + 1)):
            begin = end + 0.25 * float(rng.integers(0, 4))
            counts = 0.25 * float(rng.integers(1, 12))
            signs.append(Sign(column, begin, counts, values[rng.integers(len(values))]))
            end = begin + counts
    last = max((sign.end for sign in signs), default=0.0)
    tempo, bar = float(rng.integers(30, 240)), int(rng.integers(1, 9))
    return Staff(f"Piece {seed}", "human23", tempo, bar, last + float(rng.integers(3)), start, tuple(signs))


def staff_of(signs: list[Sign], start: dict[str, Value] | None = None) -> Staff:
    """A staff of some signs, from a standing position."""
    ordered = sorted(signs, key=lambda sign: (COLUMNS.index(sign.column), sign.begin))
    last = max(sign.end for sign in signs)
    return Staff("A test", "human23", 60.0, 4, last, STANDING if start is None else start, tuple(ordered))


def danced(staff: Staff, folder: Path) -> Staff:
    """The signs of the movement that a staff's score composes to."""
    path = folder / "danced.score"
    path.write_text(score_text(staff), encoding="utf-8")
    score = read_score(path)
    return notate(score, score.clips[0], staff.bar).staff
