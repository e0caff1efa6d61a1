"""Phrases played out: every posture with all that it says, and the move that leads to it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import cos, radians, sin

from motionmind.body.anatomy import SIDES
from motionmind.notation.score import NUMBER, Clip, Line, Phrase, Score, Setting, Where, number, tempo

DEEPEST = 50  # phrases within phrases: deeper, and they go round in a circle
MOST = 100_000  # postures of a clip

_DIRECTIONS = {"left": (1.0, 0.0), "right": (-1.0, 0.0), "ahead": (0.0, 1.0), "back": (0.0, -1.0)}


@dataclass(frozen=True)
class Row:
    """One posture.

    Attributes:
        where: the line that says so.
        limbs: by layer, what the left and the right limb do; of a trunk, the same twice.
        words: by layer, what that was called.
        face: where the body faces, degrees to the left of the audience.
        up: height in the air of the lowest point, centimetres; None on the floor.
        seconds: of the move that leads here; None for a beginning.
        go: how far the weight goes in that move where no foot stays on the floor, centimetres to the body's left and
            ahead.
    """

    where: Where
    limbs: tuple[tuple[Setting, Setting], ...]
    words: tuple[tuple[str, str], ...]
    face: float
    up: float | None
    seconds: float | None
    go: tuple[float, float] = (0.0, 0.0)

    def same_posture(self, other: Row) -> bool:
        """Whether the bodies are alike, however they got there."""
        return self.limbs == other.limbs and (self.face - other.face) % 360.0 == 0.0 and self.up == other.up


# What plays out a phrase where a posture stands before it: whole, its beginning too if it has one.
_Play = Callable[[Row | None], list[Row]]


def play(phrase: Phrase) -> list[Row]:
    """The postures of a phrase or clip from its beginning; FormatError names the line that makes no sense."""
    return _play(phrase, {}, phrase.score.tempo, 0)(None)


def check(phrase: Phrase) -> None:
    """Look up every word of a phrase that nobody may call; FormatError names the one that is unknown.

    Of a phrase with open words, only those lines that have none of them.
    """
    for line in phrase.lines:
        if phrase.open and re.search(_open(phrase.open), line.text):
            continue
        if _is_tempo(line.text):
            tempo(line.text.partition(" ")[2].strip(), line.where)
        elif "|" in line.text or _is_hold(line.text):
            _row(phrase.score, line, None, 1.0)
        else:
            _call(phrase, line, phrase.score.tempo, 0)


def posture(score: Score, line: Line) -> Row:
    """The row of a single posture, written without its first cell."""
    return _row(score, replace(line, text=f"start | {line.text}"), None, 1.0)


def _play(phrase: Phrase, words: dict[str, str], counts: float, depth: int) -> _Play:
    """What plays out a phrase whose open words are `words`, at so many counts a minute."""

    def run(before: Row | None) -> list[Row]:
        if depth > DEEPEST:
            raise phrase.where.error(f"{phrase.name} calls itself")
        pace, rows = counts, list[Row]()
        for written in phrase.lines:
            line = _filled(written, words)
            standing = rows[-1] if rows else before
            if _is_tempo(line.text):
                pace = tempo(line.text.partition(" ")[2].strip(), line.where)
            elif "|" in line.text or _is_hold(line.text):
                rows += _following([_row(phrase.score, line, standing, 60.0 / pace)], rows, line.where)
            else:
                rows += _following(_call(phrase, line, pace, depth)(standing), rows, line.where)
            _few(rows, line.where)
        if not rows:
            raise phrase.where.error(f"{phrase.name} has no postures")
        return rows

    return run


def _few(rows: list[Row], where: Where) -> list[Row]:
    """The rows, if they are not too many."""
    if len(rows) > MOST:
        raise where.error(f"more than {MOST} postures")
    return rows


def _filled(line: Line, words: dict[str, str]) -> Line:
    """The line with its open words filled in."""
    if not words:
        return line
    text = re.sub(_open(words), lambda found: words[found[0]], line.text)
    if not text.strip():
        raise line.where.error("nothing is left of this line")
    return replace(line, text=text)


def _open(words: Iterable[str]) -> str:
    """A pattern that finds whole words."""
    return rf"(?<![\w-])(?:{'|'.join(map(re.escape, words))})(?![\w-])"


def _following(rows: list[Row], before: list[Row], where: Where) -> list[Row]:
    """Rows to go on with after those before: a beginning must be the posture that stands there, and is left out."""
    if not before or rows[0].seconds is not None:
        return rows
    if not rows[0].same_posture(before[-1]):
        raise where.error(f"begins otherwise than what comes before it ends: {_difference(before[-1], rows[0])}")
    return rows[1:]


def _difference(before: Row, after: Row) -> str:
    """Where two postures differ, in words."""
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


def _call(phrase: Phrase, line: Line, counts: float, depth: int) -> _Play:
    """What plays out `NAME (WORDS), HOW, HOW`."""
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
    run = _play(called, dict(zip(called.open, given, strict=True)), pace, depth + 1)
    for how in (part.strip() for part in re.split(r",(?![^(]*\))", match[4] or "")[1:]):  # not within brackets
        run = _modified(run, how, phrase, line, counts, depth)
    return run


def _modified(run: _Play, how: str, phrase: Phrase, line: Line, counts: float, depth: int) -> _Play:
    words = how.split()
    layers = list(phrase.score.body.layers)
    if how == "other side":
        return lambda before: [_mirror(row, phrase.score) for row in run(before and _mirror(before, phrase.score))]
    if how == "backwards":
        return lambda before: _backwards(_ending(run, before))
    if how == "there and back":
        return lambda before: _few(_there_and_back(run(before), before), line.where)
    if len(words) == 2 and words[1] in ("times", "time") and words[0].isdecimal() and 0 < int(words[0]) <= 1000:
        return lambda before: _times(run, int(words[0]), before, line.where)
    if "of" in words and words[0] == "with" and 1 < words.index("of") < len(words) - 1:
        taken = words[1 : words.index("of")]
        for layer in taken:
            if layer not in layers:
                raise line.where.error(f"{layer!r} is no layer; there are {', '.join(layers)}")
        other = _call(phrase, replace(line, text=" ".join(words[words.index("of") + 1 :])), counts, depth)
        chosen = [layers.index(layer) for layer in taken]
        return lambda before: _layered(run(before), other(before), chosen)
    raise line.where.error(
        f"{how!r} is no way to do a phrase; there are other side, backwards, there and back, 3 times, "
        "with LAYERS of PHRASE"
    )


def _mirror(row: Row, score: Score) -> Row:
    """The same with left and right exchanged."""
    limbs = tuple(score.mirrored(layer, limb) for layer, limb in zip(score.body.layers, row.limbs, strict=True))
    words = tuple(score.mirrored_words(layer, words) for layer, words in zip(score.body.layers, row.words, strict=True))
    return replace(row, limbs=limbs, words=words, face=-row.face, go=(-row.go[0], row.go[1]))


def _ending(run: _Play, before: Row | None) -> list[Row]:
    """The rows that end where `before` faces: begun so much earlier in the turn that they make."""
    rows = run(before)
    turned = rows[-1].face - before.face if before is not None else 0.0
    return run(replace(before, face=before.face - turned)) if before is not None and turned else rows


def _backwards(rows: list[Row]) -> list[Row]:
    """The way back through the postures; it begins with the last one."""
    back = [
        replace(row, seconds=after.seconds, go=_back(after, row))
        for row, after in zip(rows[-2::-1], rows[:0:-1], strict=True)
    ]
    return [replace(rows[-1], seconds=None, go=(0.0, 0.0)), *back]


def _back(there: Row, row: Row) -> tuple[float, float]:
    """The way back of the move that led `there` from `row`, as the body sees it when it is at `row` again."""
    turned = radians(there.face - row.face)
    left, ahead = there.go
    return -(left * cos(turned) + ahead * sin(turned)), -(ahead * cos(turned) - left * sin(turned))


def _there_and_back(rows: list[Row], before: Row | None) -> list[Row]:
    whole = [before, *rows] if before is not None and rows[0].seconds is not None else rows
    return rows + _backwards(whole)[1:]


def _times(run: _Play, times: int, before: Row | None, where: Where) -> list[Row]:
    rows: list[Row] = []
    for _ in range(times):
        rows += _following(run(rows[-1] if rows else before), rows, where)
        _few(rows, where)
    return rows


def _layered(rows: list[Row], others: list[Row], layers: Sequence[int]) -> list[Row]:
    """Rows whose `layers` are those of others, move by move: fewer others hold their end, more are left out."""
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
    """Whether a line is nothing but the first cell: counts, and how."""
    first = text.split(maxsplit=1)[0]
    return first == "start" or bool(re.fullmatch(r"[\d./]+", first))


def _row(score: Score, line: Line, before: Row | None, beat: float) -> Row:
    """The posture that a line describes after the one `before`; a count lasts `beat` seconds."""
    cells = [cell.strip() for cell in line.text.split("|")]
    names = list(score.body.layers)
    if len(cells) > 1 + len(names):
        raise line.where.error(f"{len(cells)} cells, where a posture has {1 + len(names)}: how | {' | '.join(names)}")
    cells += [""] * (1 + len(names) - len(cells))
    counts, up, face, go = _how(score, cells[0], before.face if before else 0.0, line.where)
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
    seconds = None if counts is None else counts * beat
    return Row(line.where, tuple(limbs), tuple(words), face, up, seconds, go)


def _how(
    score: Score, cell: str, face: float, where: Where
) -> tuple[float | None, float | None, float, tuple[float, float]]:
    """Counts (None for a beginning), height in the air, where the body faces then, and how far it goes."""
    words = cell.split()
    counts: float | None = 1.0
    if words and words[0] == "start":
        counts = None
        words = words[1:]
    elif words and re.fullmatch(r"[\d./]+", words[0]):
        counts = _counts(words[0], where)
        words = words[1:]
    up: float | None = None
    go = (0.0, 0.0)
    at = 0
    while at < len(words):
        word, rest = words[at], words[at + 1 :]
        at += 2
        if word == "up":
            up = number(rest[0] if rest else "", word, where)
            if up < 0.0:
                raise where.error(f"up {up:g}: below the floor")
        elif word == "face":
            side = rest[1] if len(rest) > 1 and rest[1] in SIDES else ""
            face = (-1.0 if side == "right" else 1.0) * score.facing(rest[0] if rest else "", where)
            at += bool(side)
        elif word == "turn":
            if len(rest) < 2 or rest[1] not in SIDES:
                raise where.error("turn DEGREES left, or right")
            degrees = number(rest[0], word, where)
            if not 0.0 <= degrees < 180.0:
                raise where.error(f"turn {degrees:g}: a move turns less than half round; write more of them")
            face += -degrees if rest[1] == "right" else degrees
            at += 1
        elif word == "go":
            at -= 1
            if at >= len(words) or words[at] not in _DIRECTIONS:
                raise where.error("go ahead, back, left or right, and how many centimetres")
            while at < len(words) and words[at] in _DIRECTIONS:
                far = number(words[at + 1] if at + 1 < len(words) else "", f"go {words[at]}", where)
                left, ahead = _DIRECTIONS[words[at]]
                go = (go[0] + far * left, go[1] + far * ahead)
                at += 2
        else:
            raise where.error(f"{word!r} is no way to move; there are a number of counts, up, face, turn, go")
    return counts, up, face, go


def _counts(word: str, where: Where) -> float:
    try:
        counts = float(Fraction(word)) if NUMBER.fullmatch(word) or "/" in word else 0.0
    except (ValueError, ZeroDivisionError, OverflowError):
        counts = 0.0
    if not 0.01 <= counts <= 1000.0:
        raise where.error(f"{word!r} is no number of counts")
    return counts
