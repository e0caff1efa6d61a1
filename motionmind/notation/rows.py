"""Play phrases into rows: each posture in full, and the move that leads to it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from math import cos, radians, sin

from motionmind.display import displayed
from motionmind.errors import quoted
from motionmind.notation.posture_line import Row, is_hold, read_row
from motionmind.notation.score import Clip, Line, Phrase, Score, Where, tempo
from motionmind.notation.work import N_CHARS_PER_WORK, N_WORK_PER_CALL, Work

MAX_DEPTH = 100  # nested phrases and modifiers; deeper ones call themselves
MAX_CLIP_POSTURES = 100_000

# Plays a phrase after the row before it, if any; the rows include the phrase's own start posture if it has one.
_Player = Callable[[Row | None], list[Row]]


def play_phrase(phrase: Phrase, work: Work | None = None) -> list[Row]:
    """Play a phrase or clip from its beginning.

    Args:
        phrase: the phrase.
        work: the work so far, if several phrases share one limit.

    Returns:
        Its postures, at least one.

    Raises:
        FormatError: a line is invalid, or there are too many postures, or too much work; names file and line.
    """
    return _player(phrase, {}, phrase.score.tempo, 0, work or Work())(None)


def check_words(phrase: Phrase, work: Work) -> None:
    """Look up every word of a phrase, even if nothing calls it; skip lines with open words.

    The results are cached in `work`, and do not count as work.

    Raises:
        FormatError: a word is unknown; names file and line.
    """
    for line in phrase.lines:
        if phrase.open and re.search(_whole_words(phrase.open), line.text):
            continue
        if _is_tempo(line.text):
            tempo(line.text.partition(" ")[2].strip(), line.where)
        elif "|" in line.text or is_hold(line.text):
            read_row(phrase.score, line, None, 1.0, work)
        else:
            _call(phrase, line, phrase.score.tempo, 0, work)


def _player(phrase: Phrase, words: dict[str, str], counts: float, depth: int, work: Work) -> _Player:
    """Return the player of a phrase with its open words filled from `words`, at `counts` per minute."""

    def run(before: Row | None) -> list[Row]:
        if depth > MAX_DEPTH:
            raise phrase.where.error(f"{phrase.name} calls itself")
        work.add(N_WORK_PER_CALL, phrase.where)
        pace, rows = counts, list[Row]()
        for written in phrase.lines:
            line = _fill(written, words, work)
            work.add(1 + len(line.text) // N_CHARS_PER_WORK, line.where)
            standing, known = rows[-1] if rows else before, len(rows)
            if _is_tempo(line.text):
                pace = tempo(line.text.partition(" ")[2].strip(), line.where)
            elif "|" in line.text or is_hold(line.text):
                rows += _continue([read_row(phrase.score, line, standing, 60.0 / pace, work)], rows, line.where)
            else:
                rows += _continue(_call(phrase, line, pace, depth, work)(standing), rows, line.where)
            if depth == 0:
                rows[known:] = [row._replace(line=line.where.line) for row in rows[known:]]
            _check_count(rows, line.where)
        if not rows:
            raise phrase.where.error(f"{phrase.name} has no postures")
        return rows

    return run


def _check_count(rows: list[Row], where: Where) -> list[Row]:
    """Return the rows; FormatError if there are too many."""
    if len(rows) > MAX_CLIP_POSTURES:
        raise where.error(f"more than {MAX_CLIP_POSTURES} postures")
    return rows


def _fill(line: Line, words: dict[str, str], work: Work) -> Line:
    """Fill in a line's open words."""
    if not words:
        return line
    pattern = _whole_words(words)
    work.add(sum(len(words[found]) for found in re.findall(pattern, line.text)) // N_CHARS_PER_WORK, line.where)
    text = re.sub(pattern, lambda found: words[found[0]], line.text)
    if not text.strip():
        raise line.where.error("nothing is left of this line")
    return replace(line, text=text)


def _whole_words(words: Iterable[str]) -> str:
    """Return a pattern that matches any of these words as a whole."""
    return rf"(?<![\w-])(?:{'|'.join(map(re.escape, words))})(?![\w-])"


def _continue(rows: list[Row], before: list[Row], where: Where) -> list[Row]:
    """Return the rows that continue the rows before; a start posture must equal the last one, and is dropped."""
    if not before or rows[0].seconds is not None:
        return rows
    if not rows[0].same_posture(before[-1]):
        raise where.error(f"starts in another posture than the line before it ends: {_difference(before[-1], rows[0])}")
    return rows[1:]


def _difference(before: Row, after: Row) -> str:
    """Describe how two postures differ."""
    parts = [
        f"{displayed(' / '.join(dict.fromkeys(old)))}, then {displayed(' / '.join(dict.fromkeys(new)))}"
        for a, b, old, new in zip(before.limbs, after.limbs, before.words, after.words, strict=True)
        if a != b
    ]
    if (before.face - after.face) % 360.0:
        parts.append(f"facing {before.face:g}, then {after.face:g}")
    if before.up != after.up:
        parts.append("at another height")
    return f"{'; '.join(parts)} (line {before.where.line} and line {after.where.line})"


def _is_tempo(text: str) -> bool:
    return text.startswith("tempo") and text.split(maxsplit=1)[0] == "tempo"


# --- a line that calls another phrase ---------------------------------------------------------------------------------


def _call(phrase: Phrase, line: Line, counts: float, depth: int, work: Work) -> _Player:
    """Return the player of a line `NAME (WORDS), HOW, HOW`."""
    call, *modifiers = _split_outside_brackets(line.text)
    match = re.fullmatch(r"([\w.-]++)\s*+(\(([^)]*+)\))?", call)
    if not match:
        raise line.where.error(
            f"{quoted(line.text, 80)}: neither a posture, whose cells are separated by |, nor the name of a phrase"
        )
    if depth + len(modifiers) > MAX_DEPTH:
        raise line.where.error(f"{len(modifiers)} modifiers are too many")
    called = phrase.score.phrase(match[1], line.where)
    given = [part.strip() for part in match[3].split(",")] if match[2] else []
    if not all(given):
        raise line.where.error(f"{quoted(line.text, 80)}: an open word is empty")
    if len(given) != len(called.open):
        raise line.where.error(f"{called.name} has {len(called.open)} open words, but {len(given)} are given")
    own = called.score is not phrase.score
    pace = called.score.tempo if own and isinstance(called, Clip) else counts
    run = _player(called, dict(zip(called.open, given, strict=True)), pace, depth + 1 + len(modifiers), work)
    for how in modifiers:
        run = _modify(_counted(run, line.where, work), how, phrase, line, counts, depth, work)
    return run


@lru_cache(maxsize=256)  # a phrase that is played again and again is split once
def _split_outside_brackets(text: str) -> tuple[str, ...]:
    """Split a line at its commas, except those within brackets."""
    parts: list[list[str]] = []
    opened = 0
    for piece in text.split(","):
        if opened > 0:
            parts[-1].append(piece)
        else:
            parts.append([piece])
        opened += piece.count("(") - piece.count(")")
    return tuple(",".join(part).strip() for part in parts)


def _counted(run: _Player, where: Where, work: Work) -> _Player:
    """Return a player whose rows count as work again, since a modifier changes each of them."""

    def counted(before: Row | None) -> list[Row]:
        rows = run(before)
        work.add(len(rows), where)
        return rows

    return counted


def _modify(run: _Player, how: str, phrase: Phrase, line: Line, counts: float, depth: int, work: Work) -> _Player:
    """Return a player that applies the modifier `how` to a phrase."""
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
                raise line.where.error(f"{quoted(layer)} is not a layer; layers are {', '.join(layers)}")
        other = _call(phrase, replace(line, text=" ".join(words[words.index("of") + 1 :])), counts, depth, work)
        chosen = [layers.index(layer) for layer in taken]
        return lambda before: _with_layers(run(before), other(before), chosen)
    raise line.where.error(
        f"{quoted(how)} is not a modifier; modifiers are other side, backwards, there and back, 3 times, "
        "with LAYERS of PHRASE"
    )


def _mirror(row: Row, score: Score, work: Work) -> Row:
    """Exchange left and right."""
    layers = score.body.layers
    return row._replace(
        limbs=tuple(work.image(layer, limbs, score.mirrored) for layer, limbs in zip(layers, row.limbs, strict=True)),
        words=tuple(
            work.image(layer, words, score.mirrored_words) for layer, words in zip(layers, row.words, strict=True)
        ),
        face=-row.face,
        go=(-row.go[0], row.go[1]),
    )


def _play_to_face(run: _Player, before: Row | None) -> list[Row]:
    """Play a phrase so that it ends in the facing of `before`: turn its beginning back by the turn that it makes.

    A phrase with an absolute facing cannot be turned.
    """
    if before is None:
        return run(None)
    rows = run(before._replace(faced=False))
    turned = 0.0 if rows[-1].faced else rows[-1].face - before.face  # an absolute facing holds to the end
    return [row._replace(face=row.face - turned, faced=row.faced or before.faced) for row in rows]


def _backwards(rows: list[Row]) -> list[Row]:
    """Reverse the rows, beginning with the last posture."""
    back = [
        row._replace(seconds=after.seconds, counts=after.counts, go=_go_back(after, row))
        for row, after in zip(rows[-2::-1], rows[:0:-1], strict=True)
    ]
    return [rows[-1]._replace(seconds=None, counts=0.0, go=(0.0, 0.0)), *back]


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
    """Play a phrase several times in a row."""
    rows: list[Row] = []
    for _ in range(times):
        rows += _continue(run(rows[-1] if rows else before), rows, where)
        _check_count(rows, where)
    return rows


def _with_layers(rows: list[Row], others: list[Row], layers: Sequence[int]) -> list[Row]:
    """Replace `layers` of the rows with those of others, move by move; hold the last of fewer others."""
    start = [row for row in others if row.seconds is None][:1]
    moves = [row for row in others if row.seconds is not None]
    out, move = [], 0
    for row in rows:
        if row.seconds is None:
            source = start[0] if start else row
        else:
            source = moves[min(move, len(moves) - 1)] if moves else start[0]  # one posture, held
            move += 1
        limbs, words = list(row.limbs), list(row.words)
        for layer in layers:
            limbs[layer], words[layer] = source.limbs[layer], source.words[layer]
        out.append(row._replace(limbs=tuple(limbs), words=tuple(words)))
    return out
