"""Read the lines of postures: the move, then a cell for each layer."""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import NamedTuple

from motionmind.body.anatomy import SIDES
from motionmind.errors import quoted
from motionmind.notation.score import NUMBER, Line, Phrase, Score, Setting, Where, number
from motionmind.notation.work import Work

_DIRECTIONS = {"left": (1.0, 0.0), "right": (-1.0, 0.0), "ahead": (0.0, 1.0), "back": (0.0, -1.0)}
_NO_SETTINGS: tuple[Setting, Setting] = ({}, {})
_NEUTRAL = "neutral", "neutral"
MOVE_RANGE_COUNTS = (0.01, 1000.0)


class Row(NamedTuple):
    """One posture and the move that leads to it.

    Attributes:
        where: the line of the posture.
        limbs: by layer, the settings of the left and the right limb; for a trunk, the same twice.
        words: by layer, their names.
        face: facing, degrees to the left of the audience.
        up: height of the lowest point in the air, centimetres; None on the floor.
        seconds: duration of the move; None for a start posture.
        go: displacement of the weight in the move to the body's left and ahead, centimetres, if no foot stays on the
            floor.
        faced: whether this line, or an earlier one of its phrase, sets an absolute facing; else the facing is relative
            to the one before the phrase.
        line: number of the line of the clip, or of the phrase that is played, which is the posture or calls it.
        counts: duration of the move; 0 for a start posture.
    """

    where: Where
    limbs: tuple[tuple[Setting, Setting], ...]
    words: tuple[tuple[str, str], ...]
    face: float
    up: float | None
    seconds: float | None
    go: tuple[float, float] = (0.0, 0.0)
    faced: bool = False
    line: int = 0
    counts: float = 0.0

    def same_posture(self, other: Row) -> bool:
        """Return whether the postures are the same, regardless of the moves that lead to them."""
        return self.limbs == other.limbs and (self.face - other.face) % 360.0 == 0.0 and self.up == other.up


@dataclass
class _Cell:
    """The first cell of a line: the move to its posture.

    Attributes:
        face: facing after the move, degrees to the left of the audience, or of the facing before.
        faced: whether `face` is relative to the audience.
        counts: duration; None for a start posture.
        up: height in the air, centimetres; None on the floor.
        go: displacement to the left and ahead, centimetres.
    """

    face: float = 0.0
    faced: bool = False
    counts: float | None = 1.0
    up: float | None = None
    go: tuple[float, float] = (0.0, 0.0)


# A parsed posture: the first cell, and for each other non-empty cell the layer, the settings and their names.
_Posture = tuple[_Cell, list[tuple[int, tuple[Setting, Setting], tuple[str, str]]]]


def is_hold(text: str) -> bool:
    """Return whether a line has only the first cell: the posture is held."""
    first = text.split(maxsplit=1)[0]
    return first == "start" or bool(re.fullmatch(r"[\d./]+", first))


def posture_row(posture: Phrase) -> Row:
    """Return the row of a single posture, whose line lacks the first cell; FormatError if it is invalid."""
    (line,) = posture.lines
    return read_row(posture.score, replace(line, text=f"start | {line.text}"), None, 1.0, Work())


def read_row(score: Score, line: Line, before: Row | None, beat: float, work: Work) -> Row:
    """Return the row of a line after the row `before`; a count lasts `beat` seconds.

    Raises:
        FormatError: the line is invalid; names file and line.
    """
    first, cells = work.once((score, line.text), lambda: _parse_posture(score, line, work))
    limbs = list(before.limbs) if before else [_NO_SETTINGS] * len(score.body.layers)
    words = list(before.words) if before else [_NEUTRAL] * len(score.body.layers)
    for index, setting, names in cells:
        limbs[index], words[index] = setting, names
    return Row(
        line.where,
        tuple(limbs),
        tuple(words),
        first.face if first.faced or before is None else before.face + first.face,
        first.up,
        None if first.counts is None else first.counts * beat,
        first.go,
        first.faced or (before is not None and before.faced),
        counts=first.counts or 0.0,
    )


def _parse_posture(score: Score, line: Line, work: Work) -> _Posture:
    """Parse the line of a posture."""
    first, *cells = (cell.strip() for cell in line.text.split("|"))
    names = list(score.body.layers)
    if len(cells) > len(names):
        raise line.where.error(
            f"{1 + len(cells)} cells, where a posture has {1 + len(names)}: how | {' | '.join(names)}"
        )
    found = _first_cell(score, first, line.where)
    out = []
    for index, (layer, cell) in enumerate(zip(names, cells, strict=False)):
        if cell:
            out.append((index, *work.once((score, layer, cell), partial(_parse_cell, score, layer, cell, line.where))))
    return found, out


def _parse_cell(score: Score, layer: str, cell: str, where: Where) -> tuple[tuple[Setting, Setting], tuple[str, str]]:
    """Return the settings of a layer's cell, and their names."""
    return score.cell(layer, cell, where), score.cell_words(layer, cell)


def _first_cell(score: Score, text: str, where: Where) -> _Cell:
    """Parse the first cell of a line."""
    words = deque(text.split())
    cell = _Cell()
    if words and words[0] == "start":
        cell.counts = None
        words.popleft()
    elif words and re.fullmatch(r"[\d./]+", words[0]):
        cell.counts = _counts(words.popleft(), where)
    readers = {"up": _read_up, "face": _read_face, "turn": _read_turn, "go": _read_go}
    while words:
        word = words.popleft()
        if word not in readers:
            raise where.error(f"{quoted(word)} does not describe a move; give a number of counts, up, face, turn or go")
        readers[word](score, cell, words, where)
    return cell


def _next(words: deque[str]) -> str:
    """Take the next word; "" if there is none."""
    return words.popleft() if words else ""


def _read_up(_: Score, cell: _Cell, words: deque[str], where: Where) -> None:
    """Read the words after `up`."""
    cell.up = number(_next(words), "up", where)
    if cell.up < 0.0:
        raise where.error(f"up {cell.up:g}: below the floor")


def _read_face(score: Score, cell: _Cell, words: deque[str], where: Where) -> None:
    """Read the words after `face`."""
    facing = score.facing(_next(words), where)
    right = bool(words) and words[0] in SIDES and words.popleft() == "right"
    cell.face, cell.faced = -facing if right else facing, True


def _read_turn(_: Score, cell: _Cell, words: deque[str], where: Where) -> None:
    """Read the words after `turn`."""
    if len(words) < 2 or words[1] not in SIDES:
        raise where.error("give turn DEGREES left, or right")
    degrees = number(words.popleft(), "turn", where)
    if not 0.0 <= degrees < 180.0:
        raise where.error(f"turn {degrees:g}: a move turns by less than 180 degrees; use several moves")
    cell.face += -degrees if words.popleft() == "right" else degrees


def _read_go(_: Score, cell: _Cell, words: deque[str], where: Where) -> None:
    """Read the words after `go`."""
    if not words or words[0] not in _DIRECTIONS:
        raise where.error("give go, a direction (ahead, back, left, right) and centimetres")
    while words and words[0] in _DIRECTIONS:
        direction = words.popleft()
        far = number(_next(words), f"go {direction}", where)
        left, ahead = _DIRECTIONS[direction]
        cell.go = (cell.go[0] + far * left, cell.go[1] + far * ahead)


def _counts(word: str, where: Where) -> float:
    """Parse a number of counts, a decimal or a fraction."""
    try:
        counts = float(Fraction(word)) if NUMBER.fullmatch(word) or "/" in word else 0.0
    except (ValueError, ZeroDivisionError, OverflowError):
        counts = 0.0
    least, most = MOVE_RANGE_COUNTS
    if not least <= counts <= most:
        raise where.error(f"{quoted(word)} is not a number of counts from {least:g} to {most:g}")
    return counts
