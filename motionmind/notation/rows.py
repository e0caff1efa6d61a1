"""Plays phrases out into rows: each posture in full, and the move that leads to it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import cos, radians, sin

from motionmind.body.anatomy import SIDES
from motionmind.notation.score import NUMBER, Clip, Line, Phrase, Score, Setting, Where, number, tempo

MAX_DEPTH = 50  # of phrases within phrases; deeper ones call themselves
MAX_POSTURES = 100_000  # of a clip

_DIRECTIONS = {"left": (1.0, 0.0), "right": (-1.0, 0.0), "ahead": (0.0, 1.0), "back": (0.0, -1.0)}


@dataclass(frozen=True)
class Row:
    """One posture and the move that leads to it.

    Attributes:
        where: the line that describes it.
        limbs: by layer, the settings of the left and the right limb; for a trunk, the same twice.
        words: by layer, their names.
        face: where the body faces, degrees to the left of the audience.
        up: height of its lowest point in the air, centimetres; None on the floor.
        seconds: duration of the move; None for a beginning.
        go: distance that the weight travels in the move to the body's left and ahead, centimetres, if no foot stays on
            the floor.
    """

    where: Where
    limbs: tuple[tuple[Setting, Setting], ...]
    words: tuple[tuple[str, str], ...]
    face: float
    up: float | None
    seconds: float | None
    go: tuple[float, float] = (0.0, 0.0)

    def same_posture(self, other: Row) -> bool:
        """Return whether the postures are the same, whatever moves lead to them."""
        return self.limbs == other.limbs and (self.face - other.face) % 360.0 == 0.0 and self.up == other.up


# Plays a phrase out after the row before it, if any; the rows include the phrase's own beginning if it has one.
_Player = Callable[[Row | None], list[Row]]


def play_phrase(phrase: Phrase) -> list[Row]:
    """Play a phrase or clip out from its beginning.

    Returns:
        Its postures, at least one.

    Raises:
        FormatError: a line makes no sense, or there are too many postures; names file and line.
    """
    return _player(phrase, {}, phrase.score.tempo, 0)(None)


def check_words(phrase: Phrase) -> None:
    """Look up every word of a phrase, whether or not anything calls it; lines with open words are skipped.

    Raises:
        FormatError: a word is unknown; names file and line.
    """
    for line in phrase.lines:
        if phrase.open and re.search(_whole_words(phrase.open), line.text):
            continue
        if _is_tempo(line.text):
            tempo(line.text.partition(" ")[2].strip(), line.where)
        elif "|" in line.text or _is_hold(line.text):
            _row(phrase.score, line, None, 1.0)
        else:
            _call(phrase, line, phrase.score.tempo, 0)


def posture_row(score: Score, line: Line) -> Row:
    """Return the row of a single posture, written without its first cell; FormatError if it makes no sense."""
    return _row(score, replace(line, text=f"start | {line.text}"), None, 1.0)


def _player(phrase: Phrase, words: dict[str, str], counts: float, depth: int) -> _Player:
    """Return the player of a phrase with its open words filled by `words`, at `counts` a minute."""

    def run(before: Row | None) -> list[Row]:
        if depth > MAX_DEPTH:
            raise phrase.where.error(f"{phrase.name} calls itself")
        pace, rows = counts, list[Row]()
        for written in phrase.lines:
            line = _fill(written, words)
            standing = rows[-1] if rows else before
            if _is_tempo(line.text):
                pace = tempo(line.text.partition(" ")[2].strip(), line.where)
            elif "|" in line.text or _is_hold(line.text):
                rows += _continue([_row(phrase.score, line, standing, 60.0 / pace)], rows, line.where)
            else:
                rows += _continue(_call(phrase, line, pace, depth)(standing), rows, line.where)
            _check_count(rows, line.where)
        if not rows:
            raise phrase.where.error(f"{phrase.name} has no postures")
        return rows

    return run


def _check_count(rows: list[Row], where: Where) -> list[Row]:
    """Return the rows; FormatError if there are too many."""
    if len(rows) > MAX_POSTURES:
        raise where.error(f"more than {MAX_POSTURES} postures")
    return rows


def _fill(line: Line, words: dict[str, str]) -> Line:
    """Fill in a line's open words."""
    if not words:
        return line
    text = re.sub(_whole_words(words), lambda found: words[found[0]], line.text)
    if not text.strip():
        raise line.where.error("nothing is left of this line")
    return replace(line, text=text)


def _whole_words(words: Iterable[str]) -> str:
    """Return a pattern that finds any of these words as a whole."""
    return rf"(?<![\w-])(?:{'|'.join(map(re.escape, words))})(?![\w-])"


def _continue(rows: list[Row], before: list[Row], where: Where) -> list[Row]:
    """Return the rows that continue those before; a beginning must be the posture reached, and is dropped."""
    if not before or rows[0].seconds is not None:
        return rows
    if not rows[0].same_posture(before[-1]):
        raise where.error(f"begins otherwise than what comes before it ends: {_difference(before[-1], rows[0])}")
    return rows[1:]


def _difference(before: Row, after: Row) -> str:
    """Describe how two postures differ."""
    parts = [
        f"{' / '.join(dict.fromkeys(was))}, then {' / '.join(dict.fromkeys(is_))}"
        for a, b, was, is_ in zip(before.limbs, after.limbs, before.words, after.words, strict=True)
        if a != b
    ]
    if (before.face - after.face) % 360.0:
        parts.append(f"facing {before.face:g}, then {after.face:g}")
    if before.up != after.up:
        parts.append("higher up, or lower")
    return f"{'; '.join(parts)} (line {before.where.line} and line {after.where.line})"


# --- a line that calls another phrase ---------------------------------------------------------------------------------


def _call(phrase: Phrase, line: Line, counts: float, depth: int) -> _Player:
    """Return the player of a line `NAME (WORDS), HOW, HOW`."""
    match = re.fullmatch(r"([\w.-]+)\s*(\((.*?)\))?\s*(,.*)?", line.text)
    if not match:
        raise line.where.error(f"{line.text!r}: a posture has cells with | between, a phrase is called by its name")
    called = phrase.score.phrase(match[1], line.where)
    given = [part.strip() for part in match[3].split(",")] if match[2] else []
    if not all(given):
        raise line.where.error(f"{line.text!r}: an open word is filled with nothing")
    if len(given) != len(called.open):
        raise line.where.error(f"{called.name} leaves {len(called.open)} words open, and {len(given)} are given")
    own = called.score is not phrase.score
    pace = called.score.tempo if own and isinstance(called, Clip) else counts
    run = _player(called, dict(zip(called.open, given, strict=True)), pace, depth + 1)
    for how in (part.strip() for part in re.split(r",(?![^(]*\))", match[4] or "")[1:]):  # not within brackets
        run = _modify(run, how, phrase, line, counts, depth)
    return run


def _modify(run: _Player, how: str, phrase: Phrase, line: Line, counts: float, depth: int) -> _Player:
    """Return a player that plays a phrase out the way `how` says."""
    words = how.split()
    layers = list(phrase.score.body.layers)
    if how == "other side":
        return lambda before: [_mirror(row, phrase.score) for row in run(before and _mirror(before, phrase.score))]
    if how == "backwards":
        return lambda before: _backwards(_play_to_face(run, before))
    if how == "there and back":
        return lambda before: _check_count(_there_and_back(run(before), before), line.where)
    if len(words) == 2 and words[1] in ("times", "time") and re.fullmatch(r"[1-9][0-9]{0,2}|1000", words[0]):
        return lambda before: _repeat(run, int(words[0]), before, line.where)
    if "of" in words and words[0] == "with" and 1 < words.index("of") < len(words) - 1:
        taken = words[1 : words.index("of")]
        for layer in taken:
            if layer not in layers:
                raise line.where.error(f"{layer!r} is no layer; there are {', '.join(layers)}")
        other = _call(phrase, replace(line, text=" ".join(words[words.index("of") + 1 :])), counts, depth)
        chosen = [layers.index(layer) for layer in taken]
        return lambda before: _with_layers(run(before), other(before), chosen)
    raise line.where.error(
        f"{how!r} is no way to do a phrase; there are other side, backwards, there and back, 3 times, "
        "with LAYERS of PHRASE"
    )


def _mirror(row: Row, score: Score) -> Row:
    """Exchange left and right."""
    limbs = tuple(score.mirrored(layer, limb) for layer, limb in zip(score.body.layers, row.limbs, strict=True))
    words = tuple(score.mirrored_words(layer, words) for layer, words in zip(score.body.layers, row.words, strict=True))
    return replace(row, limbs=limbs, words=words, face=-row.face, go=(-row.go[0], row.go[1]))


def _play_to_face(run: _Player, before: Row | None) -> list[Row]:
    """Play a phrase out to end facing where `before` faces: it begins turned back by the turn that it makes."""
    rows = run(before)
    turned = rows[-1].face - before.face if before is not None else 0.0
    return run(replace(before, face=before.face - turned)) if before is not None and turned else rows


def _backwards(rows: list[Row]) -> list[Row]:
    """Reverse the rows, beginning with the last posture."""
    back = [
        replace(row, seconds=after.seconds, go=_go_back(after, row))
        for row, after in zip(rows[-2::-1], rows[:0:-1], strict=True)
    ]
    return [replace(rows[-1], seconds=None, go=(0.0, 0.0)), *back]


def _go_back(there: Row, row: Row) -> tuple[float, float]:
    """Reverse the `go` of the move from `row` to `there`, in the frame of the body as it faces in `row`."""
    turned = radians(there.face - row.face)
    left, ahead = there.go
    return -(left * cos(turned) + ahead * sin(turned)), -(ahead * cos(turned) - left * sin(turned))


def _there_and_back(rows: list[Row], before: Row | None) -> list[Row]:
    """Append the way back to where the rows begin."""
    whole = [before, *rows] if before is not None and rows[0].seconds is not None else rows
    return rows + _backwards(whole)[1:]


def _repeat(run: _Player, times: int, before: Row | None, where: Where) -> list[Row]:
    """Play a phrase out several times in a row."""
    rows: list[Row] = []
    for _ in range(times):
        rows += _continue(run(rows[-1] if rows else before), rows, where)
        _check_count(rows, where)
    return rows


def _with_layers(rows: list[Row], others: list[Row], layers: Sequence[int]) -> list[Row]:
    """Take `layers` of the rows from others, move by move; if others are fewer, their last is held."""
    start = [row for row in others if row.seconds is None][:1]
    moves = [row for row in others if row.seconds is not None]
    out, move = [], 0
    for row in rows:
        if row.seconds is None:
            source = start[0] if start else row
        else:
            source = moves[min(move, len(moves) - 1)] if moves else start[0]  # one posture, held
            move += 1
        limbs = tuple(source.limbs[i] if i in layers else limb for i, limb in enumerate(row.limbs))
        words = tuple(source.words[i] if i in layers else word for i, word in enumerate(row.words))
        out.append(replace(row, limbs=limbs, words=words))
    return out


# --- a line that is a posture -----------------------------------------------------------------------------------------


def _is_tempo(text: str) -> bool:
    return text.split(maxsplit=1)[0] == "tempo"


def _is_hold(text: str) -> bool:
    """Return whether a line has only the first cell: the posture is held."""
    first = text.split(maxsplit=1)[0]
    return first == "start" or bool(re.fullmatch(r"[\d./]+", first))


def _row(score: Score, line: Line, before: Row | None, beat: float) -> Row:
    """Return the row that a line describes after the row `before`; a count lasts `beat` seconds."""
    cells = [cell.strip() for cell in line.text.split("|")]
    names = list(score.body.layers)
    if len(cells) > 1 + len(names):
        raise line.where.error(f"{len(cells)} cells, where a posture has {1 + len(names)}: how | {' | '.join(names)}")
    cells += [""] * (1 + len(names) - len(cells))
    first = _first_cell(score, cells[0], before.face if before else 0.0, line.where)
    limbs: list[tuple[Setting, Setting]] = []
    words: list[tuple[str, str]] = []
    for index, (layer, cell) in enumerate(zip(names, cells[1:], strict=True)):
        if cell:
            limbs.append(score.cell(layer, cell, line.where))
            words.append(score.cell_words(layer, cell))
        elif before:
            limbs.append(before.limbs[index])
            words.append(before.words[index])
        else:
            limbs.append(({}, {}))
            words.append(("neutral", "neutral"))
    seconds = None if first.counts is None else first.counts * beat
    return Row(line.where, tuple(limbs), tuple(words), first.face, first.up, seconds, first.go)


@dataclass
class _Cell:
    """The first cell of a line: how the body gets to its posture.

    Attributes:
        face: where the body faces then, degrees to the left of the audience.
        counts: None for a beginning.
        up: height in the air, centimetres; None on the floor.
        go: how far it goes to its left and ahead, centimetres.
    """

    face: float
    counts: float | None = 1.0
    up: float | None = None
    go: tuple[float, float] = (0.0, 0.0)


def _first_cell(score: Score, text: str, face: float, where: Where) -> _Cell:
    """Parse the first cell of a line; `face` is where the body faced before."""
    words = text.split()
    cell = _Cell(face)
    if words and words[0] == "start":
        cell.counts = None
        words = words[1:]
    elif words and re.fullmatch(r"[\d./]+", words[0]):
        cell.counts = _counts(words[0], where)
        words = words[1:]
    readers = {"up": _read_up, "face": _read_face, "turn": _read_turn, "go": _read_go}
    while words:
        word, rest = words[0], words[1:]
        if word not in readers:
            raise where.error(f"{word!r} is no way to move; there are a number of counts, up, face, turn, go")
        words = readers[word](score, cell, rest, where)
    return cell


def _read_up(_: Score, cell: _Cell, words: list[str], where: Where) -> list[str]:
    """Read the words after `up`; return those that follow."""
    cell.up = number(words[0] if words else "", "up", where)
    if cell.up < 0.0:
        raise where.error(f"up {cell.up:g}: below the floor")
    return words[1:]


def _read_face(score: Score, cell: _Cell, words: list[str], where: Where) -> list[str]:
    """Read the words after `face`; return those that follow."""
    side = words[1] if len(words) > 1 and words[1] in SIDES else ""
    cell.face = (-1.0 if side == "right" else 1.0) * score.facing(words[0] if words else "", where)
    return words[2 if side else 1 :]


def _read_turn(_: Score, cell: _Cell, words: list[str], where: Where) -> list[str]:
    """Read the words after `turn`; return those that follow."""
    if len(words) < 2 or words[1] not in SIDES:
        raise where.error("turn DEGREES left, or right")
    degrees = number(words[0], "turn", where)
    if not 0.0 <= degrees < 180.0:
        raise where.error(f"turn {degrees:g}: a move turns less than half round; write more of them")
    cell.face += -degrees if words[1] == "right" else degrees
    return words[2:]


def _read_go(_: Score, cell: _Cell, words: list[str], where: Where) -> list[str]:
    """Read the words after `go`; return those that follow."""
    if not words or words[0] not in _DIRECTIONS:
        raise where.error("go ahead, back, left or right, and how many centimetres")
    while words and words[0] in _DIRECTIONS:
        far = number(words[1] if len(words) > 1 else "", f"go {words[0]}", where)
        left, ahead = _DIRECTIONS[words[0]]
        cell.go = (cell.go[0] + far * left, cell.go[1] + far * ahead)
        words = words[2:]
    return words


def _counts(word: str, where: Where) -> float:
    """Parse a number of counts, a decimal or a fraction."""
    try:
        counts = float(Fraction(word)) if NUMBER.fullmatch(word) or "/" in word else 0.0
    except (ValueError, ZeroDivisionError, OverflowError):
        counts = 0.0
    if not 0.01 <= counts <= 1000.0:
        raise where.error(f"{word!r} is no number of counts")
    return counts
