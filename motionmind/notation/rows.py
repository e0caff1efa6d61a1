"""Plays phrases out into rows: each posture in full, and the move that leads to it."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import cos, radians, sin
from typing import Any, NamedTuple, TypeVar

from motionmind.body.anatomy import SIDES
from motionmind.notation.score import NUMBER, Clip, Line, Phrase, Score, Setting, Where, number, tempo

MAX_DEPTH = 100  # of phrases, and ways of doing them, within one another; deeper ones call themselves
MAX_POSTURES = 100_000  # of a clip
MAX_WORK = 1_000_000  # lines read and postures made while the clips of a score are played: some seconds
_LONG = 64  # characters of a line that count as one piece of work

_T = TypeVar("_T")

_DIRECTIONS = {"left": (1.0, 0.0), "right": (-1.0, 0.0), "ahead": (0.0, 1.0), "back": (0.0, -1.0)}


class Row(NamedTuple):
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
        faced: whether it, or a line of its phrase before it, says where the body faces; else that follows from where
            it faced before the phrase.
    """

    where: Where
    limbs: tuple[tuple[Setting, Setting], ...]
    words: tuple[tuple[str, str], ...]
    face: float
    up: float | None
    seconds: float | None
    go: tuple[float, float] = (0.0, 0.0)
    faced: bool = False

    def same_posture(self, other: Row) -> bool:
        """Return whether the postures are the same, whatever moves lead to them."""
        return self.limbs == other.limbs and (self.face - other.face) % 360.0 == 0.0 and self.up == other.up


class Work:
    """The work that goes into playing phrases, which has a limit, and what of it is remembered.

    Attributes:
        done: lines read and postures made.
        cells: by score, layer and text, the settings and the names of a cell.
        postures: by score and text, lines that are postures.
        images: by layer and identity, the mirror images of settings and of their names, each with its original.
    """

    def __init__(self) -> None:
        self.done = 0
        self.cells: dict[tuple[Score, str, str], tuple[tuple[Setting, Setting], tuple[str, str]]] = {}
        self.postures: dict[tuple[Score, str], _Posture] = {}
        self.images: dict[tuple[str, int], tuple[Any, Any]] = {}

    def add(self, amount: int, where: Where) -> None:
        """Count work that is about to be done at a line; FormatError if it is too much."""
        self.done += amount
        if self.done > MAX_WORK:
            raise where.error(f"more than {MAX_WORK} lines and postures are played; repeat less")


# Plays a phrase out after the row before it, if any; the rows include the phrase's own beginning if it has one.
_Player = Callable[[Row | None], list[Row]]


def play_phrase(phrase: Phrase, work: Work | None = None) -> list[Row]:
    """Play a phrase or clip out from its beginning.

    Args:
        phrase: the phrase.
        work: the work so far, if several are played within one limit.

    Returns:
        Its postures, at least one.

    Raises:
        FormatError: a line makes no sense, or there are too many postures, or too much work; names file and line.
    """
    return _player(phrase, {}, phrase.score.tempo, 0, work or Work())(None)


def check_words(phrase: Phrase, work: Work) -> None:
    """Look up every word of a phrase, whether or not anything calls it; lines with open words are skipped.

    What is looked up is remembered in `work`, and does not count as work.

    Raises:
        FormatError: a word is unknown; names file and line.
    """
    for line in phrase.lines:
        if phrase.open and re.search(_whole_words(phrase.open), line.text):
            continue
        if _is_tempo(line.text):
            tempo(line.text.partition(" ")[2].strip(), line.where)
        elif "|" in line.text or _is_hold(line.text):
            _row(phrase.score, line, None, 1.0, work)
        else:
            _call(phrase, line, phrase.score.tempo, 0, work)


def posture_row(posture: Phrase) -> Row:
    """Return the row of a single posture, whose line lacks the first cell; FormatError if it makes no sense."""
    (line,) = posture.lines
    return _row(posture.score, replace(line, text=f"start | {line.text}"), None, 1.0, Work())


def _player(phrase: Phrase, words: dict[str, str], counts: float, depth: int, work: Work) -> _Player:
    """Return the player of a phrase with its open words filled by `words`, at `counts` a minute."""

    def run(before: Row | None) -> list[Row]:
        if depth > MAX_DEPTH:
            raise phrase.where.error(f"{phrase.name} calls itself")
        pace, rows = counts, list[Row]()
        for written in phrase.lines:
            line = _fill(written, words, work)
            work.add(1 + len(line.text) // _LONG, line.where)
            standing = rows[-1] if rows else before
            if _is_tempo(line.text):
                pace = tempo(line.text.partition(" ")[2].strip(), line.where)
            elif "|" in line.text or _is_hold(line.text):
                rows += _continue([_row(phrase.score, line, standing, 60.0 / pace, work)], rows, line.where)
            else:
                rows += _continue(_call(phrase, line, pace, depth, work)(standing), rows, line.where)
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


def _fill(line: Line, words: dict[str, str], work: Work) -> Line:
    """Fill in a line's open words."""
    if not words:
        return line
    pattern = _whole_words(words)
    work.add(sum(len(words[found]) for found in re.findall(pattern, line.text)) // _LONG, line.where)
    text = re.sub(pattern, lambda found: words[found[0]], line.text)
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


def _call(phrase: Phrase, line: Line, counts: float, depth: int, work: Work) -> _Player:
    """Return the player of a line `NAME (WORDS), HOW, HOW`."""
    call, *ways = _split_outside_brackets(line.text)
    match = re.fullmatch(r"([\w.-]++)\s*+(\(([^)]*+)\))?", call)
    if not match:
        raise line.where.error(f"{line.text!r}: a posture has cells with | between, a phrase is called by its name")
    if depth + len(ways) > MAX_DEPTH:
        raise line.where.error(f"{len(ways)} ways to do a phrase are too many")
    called = phrase.score.phrase(match[1], line.where)
    given = [part.strip() for part in match[3].split(",")] if match[2] else []
    if not all(given):
        raise line.where.error(f"{line.text!r}: an open word is filled with nothing")
    if len(given) != len(called.open):
        raise line.where.error(f"{called.name} leaves {len(called.open)} words open, and {len(given)} are given")
    own = called.score is not phrase.score
    pace = called.score.tempo if own and isinstance(called, Clip) else counts
    run = _player(called, dict(zip(called.open, given, strict=True)), pace, depth + 1 + len(ways), work)
    for how in ways:
        run = _modify(_counted(run, line.where, work), how, phrase, line, counts, depth, work)
    return run


def _split_outside_brackets(text: str) -> list[str]:
    """Split a line at its commas, except those within brackets."""
    parts: list[list[str]] = []
    opened = 0
    for piece in text.split(","):
        if opened > 0:
            parts[-1].append(piece)
        else:
            parts.append([piece])
        opened += piece.count("(") - piece.count(")")
    return [",".join(part).strip() for part in parts]


def _counted(run: _Player, where: Where, work: Work) -> _Player:
    """Return a player whose rows count as work again, for something is done to each of them."""

    def counted(before: Row | None) -> list[Row]:
        rows = run(before)
        work.add(len(rows), where)
        return rows

    return counted


def _modify(run: _Player, how: str, phrase: Phrase, line: Line, counts: float, depth: int, work: Work) -> _Player:
    """Return a player that plays a phrase out the way `how` says."""
    words = how.split()
    layers = list(phrase.score.body.layers)
    if how == "other side":
        score = phrase.score
        return lambda before: [
            _mirror(row, score, work) for row in run(None if before is None else _mirror(before, score, work))
        ]
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
        other = _call(phrase, replace(line, text=" ".join(words[words.index("of") + 1 :])), counts, depth, work)
        chosen = [layers.index(layer) for layer in taken]
        return lambda before: _with_layers(run(before), other(before), chosen)
    raise line.where.error(
        f"{how!r} is no way to do a phrase; there are other side, backwards, there and back, 3 times, "
        "with LAYERS of PHRASE"
    )


def _mirror(row: Row, score: Score, work: Work) -> Row:
    """Exchange left and right."""
    layers = score.body.layers
    return row._replace(
        limbs=tuple(_image(layer, limbs, score.mirrored, work) for layer, limbs in zip(layers, row.limbs, strict=True)),
        words=tuple(
            _image(layer, words, score.mirrored_words, work) for layer, words in zip(layers, row.words, strict=True)
        ),
        face=-row.face,
        go=(-row.go[0], row.go[1]),
    )


def _image(layer: str, what: _T, mirrored: Callable[[str, _T], _T], work: Work) -> _T:
    """Return the mirror image of a layer's settings, or of their names; the same object each time."""
    key = layer, id(what)
    if key not in work.images:
        image = mirrored(layer, what)
        work.images[key] = what, image  # what is kept keeps its identity
        work.images[layer, id(image)] = image, what
    found: _T = work.images[key][1]
    return found


def _play_to_face(run: _Player, before: Row | None) -> list[Row]:
    """Play a phrase out to end facing where `before` faces: it begins turned back by the turn that it makes.

    A phrase that says where it faces cannot be turned.
    """
    if before is None:
        return run(None)
    rows = run(before._replace(faced=False))
    turned = 0.0 if rows[-1].faced else rows[-1].face - before.face  # once said, it holds to the end
    return [row._replace(face=row.face - turned, faced=row.faced or before.faced) for row in rows]


def _backwards(rows: list[Row]) -> list[Row]:
    """Reverse the rows, beginning with the last posture."""
    back = [
        row._replace(seconds=after.seconds, go=_go_back(after, row))
        for row, after in zip(rows[-2::-1], rows[:0:-1], strict=True)
    ]
    return [rows[-1]._replace(seconds=None, go=(0.0, 0.0)), *back]


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
        out.append(row._replace(limbs=limbs, words=words))
    return out


# --- a line that is a posture -----------------------------------------------------------------------------------------


def _is_tempo(text: str) -> bool:
    return text.split(maxsplit=1)[0] == "tempo"


def _is_hold(text: str) -> bool:
    """Return whether a line has only the first cell: the posture is held."""
    first = text.split(maxsplit=1)[0]
    return first == "start" or bool(re.fullmatch(r"[\d./]+", first))


def _row(score: Score, line: Line, before: Row | None, beat: float, work: Work) -> Row:
    """Return the row that a line describes after the row `before`; a count lasts `beat` seconds."""
    if (score, line.text) not in work.postures:
        work.postures[score, line.text] = _parse_posture(score, line, work)
    first, cells = work.postures[score, line.text]
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
    )


def _parse_posture(score: Score, line: Line, work: Work) -> _Posture:
    """Parse a line that is a posture."""
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
            key = score, layer, cell
            if key not in work.cells:
                work.cells[key] = score.cell(layer, cell, line.where), score.cell_words(layer, cell)
            out.append((index, *work.cells[key]))
    return found, out


_NO_SETTINGS: tuple[Setting, Setting] = ({}, {})
_NEUTRAL = "neutral", "neutral"


@dataclass
class _Cell:
    """The first cell of a line: how the body gets to its posture.

    Attributes:
        face: where the body faces then, degrees to the left of the audience, or of where it faced before.
        faced: whether it is of the audience.
        counts: None for a beginning.
        up: height in the air, centimetres; None on the floor.
        go: how far it goes to its left and ahead, centimetres.
    """

    face: float = 0.0
    faced: bool = False
    counts: float | None = 1.0
    up: float | None = None
    go: tuple[float, float] = (0.0, 0.0)


# A line that is a posture: its first cell, and of each other that is not empty the layer, the settings and their names.
_Posture = tuple[_Cell, list[tuple[int, tuple[Setting, Setting], tuple[str, str]]]]


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
            raise where.error(f"{word!r} is no way to move; there are a number of counts, up, face, turn, go")
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
        raise where.error("turn DEGREES left, or right")
    degrees = number(words.popleft(), "turn", where)
    if not 0.0 <= degrees < 180.0:
        raise where.error(f"turn {degrees:g}: a move turns less than half round; write more of them")
    cell.face += -degrees if words.popleft() == "right" else degrees


def _read_go(_: Score, cell: _Cell, words: deque[str], where: Where) -> None:
    """Read the words after `go`."""
    if not words or words[0] not in _DIRECTIONS:
        raise where.error("go ahead, back, left or right, and how many centimetres")
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
    if not 0.01 <= counts <= 1000.0:
        raise where.error(f"{word!r} is no number of counts")
    return counts
