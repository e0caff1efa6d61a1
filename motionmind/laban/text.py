"""Signs as text: a block for each column, a line for each sign.

laban   1
title   A tendu
body    human23
tempo   150
bar     4
counts  2

left arm
  start | place low
  0 1   | left middle
"""

from __future__ import annotations

from collections.abc import Iterator

from motionmind.display import printable
from motionmind.errors import FormatError, did_you_mean, enumerated, quoted
from motionmind.files import FilePath
from motionmind.formats.text import read_lines, to_number
from motionmind.laban import MAX_BAR_COUNTS
from motionmind.laban.signs import (
    AROUND,
    BENDS,
    COLUMNS,
    LEVELS,
    N_DECIMALS,
    PATH,
    PLACE,
    SIGN_SECTOR_DEG,
    Direction,
    Hold,
    Sign,
    Staff,
    Turn,
    Value,
    allowed,
)
from motionmind.notation.posture_line import MOVE_RANGE_COUNTS
from motionmind.notation.score import Where
from motionmind.notation.score import tempo as parse_tempo

LABAN_VERSION = 1
MAX_STAFF_COUNTS = 100_000.0
MAX_SIGNS = 20_000
_FIELDS = ("laban", "title", "body", "tempo", "bar", "counts")


def staff_text(staff: Staff) -> str:
    """Return a staff as text."""
    tempo, counts = number_text(staff.tempo), number_text(staff.counts)
    values = (LABAN_VERSION, printable(staff.title), staff.body, tempo, staff.bar, counts)
    lines = [f"{name.ljust(7)} {value}" for name, value in zip(_FIELDS, values, strict=True)]
    for column in COLUMNS:
        rows = [("start", str(staff.start[column]))] if column in staff.start else []
        rows += [(f"{number_text(s.begin)} {number_text(s.counts)}", str(s.value)) for s in staff.column(column)]
        if rows:
            width = max(len(when) for when, _ in rows)
            lines += ["", column, *(f"  {when.ljust(width)} | {what}" for when, what in rows)]
    return "\n".join(lines) + "\n"


def number_text(value: float) -> str:
    """Write a number of counts in as few digits as it has."""
    return f"{value:.{N_DECIMALS}f}".rstrip("0").rstrip(".")


def read_staff(path: FilePath) -> Staff:
    """Read a staff from its text.

    Raises:
        FormatError: the text is invalid; names file, line and word.
    """
    fields: dict[str, str] = {}
    start: dict[str, Value] = {}
    signs: list[Sign] = []
    column, known = "", set[str]()
    where = Where(str(path), 1)
    for where, line in _lines(path):
        if not line[0].isspace():
            column = _heading(line.strip(), fields, where)
            if column in known:
                raise where.error(f"{column} is already defined")
            known.update(filter(None, [column]))
            continue
        if not column:
            raise where.error("a sign before any column")
        sign = _sign(column, line.strip(), where)
        if isinstance(sign, Sign):
            last = next((one for one in signs[-1:] if one.column == column), None)
            if last and sign.begin < last.end:
                raise where.error(f"begins at count {sign.begin:g}, before the sign below it ends, at {last.end:g}")
            signs.append(sign)
        elif column in start or any(one.column == column for one in signs[-1:]):
            raise where.error("start must be a column's first line")
        else:
            start[column] = sign
        if len(signs) > MAX_SIGNS:
            raise where.error(f"more than {MAX_SIGNS} signs")
    return _staff(fields, start, signs, where)


def _lines(path: FilePath) -> Iterator[tuple[Where, str]]:
    """Yield the lines of a file with their places, without comments and empty lines."""
    for number, text in enumerate(read_lines(path), start=1):
        line = text.replace("\t", " ").partition("#")[0].rstrip()
        if number == 1 and line.split() != ["laban", str(LABAN_VERSION)]:
            raise FormatError(f"the first line must be: laban {LABAN_VERSION}", path=path, line=1)
        if line:
            yield Where(str(path), number), line


def _heading(text: str, fields: dict[str, str], where: Where) -> str:
    """Return the column that a heading names; "" if it is a field, which is added to `fields`."""
    name, _, rest = text.partition(" ")
    if text in COLUMNS:
        return text
    if name not in _FIELDS:
        hint = did_you_mean(text, COLUMNS) or f"; columns are {enumerated(COLUMNS, 20)}"
        raise where.error(f"{quoted(text, 80)} is not a column{hint}")
    if name in fields:
        raise where.error(f"{name} is already defined")
    fields[name] = rest.strip()
    return ""


def _sign(column: str, text: str, where: Where) -> Sign | Value:
    """Parse a line below a column: a sign, or the value of the starting position."""
    when, bar, what = (part.strip() for part in text.partition("|"))
    if not bar:
        raise where.error(f"{quoted(text, 80)}: write BEGIN COUNTS | SIGN, or start | SIGN")
    value = parse_value(what, where)
    if not allowed(column, value) or (when == "start" and isinstance(value, Hold)):
        raise where.error(f"{value} is not a sign of the column {column}")
    if when == "start":
        if column in ("turn", PATH):
            raise where.error(f"{value} cannot be in the starting position")
        return value
    words = when.split()
    if len(words) != 2:
        raise where.error(f"{quoted(when)}: write the count where the sign begins, and its counts")
    begin, counts = (round(to_number(word, where.path, where.line), N_DECIMALS) for word in words)
    least = MOVE_RANGE_COUNTS[0]
    if begin < 0.0 or counts < least or begin + counts > MAX_STAFF_COUNTS:
        raise where.error(
            f"{when}: a sign begins at count 0 or later, lasts {least:g} counts or more, and ends by "
            f"{MAX_STAFF_COUNTS:g}"
        )
    return Sign(column, begin, counts, value)


def parse_value(text: str, where: Where) -> Value:
    """Parse a sign; FormatError names what is wrong."""
    if text == "hold":
        return Hold()
    words = text.split()
    if words[:1] == ["turn"]:
        return _parse_turn(words, text, where)
    if not words or words[0] not in (PLACE, *AROUND):
        known = (PLACE, *AROUND, "turn", "hold")
        hint = did_you_mean(words[0] if words else "", known) or f"; signs begin with {', '.join(known)}"
        raise where.error(f"{quoted(text, 80)} is not a sign{hint}")
    rest = " ".join(words[1:])
    level = words[1] if len(words) > 1 and words[1] in LEVELS else ""
    rest = rest.removeprefix(level).strip()
    touch = rest == "touch" or rest.endswith(" touch")
    rest = rest.removesuffix("touch").strip() if touch else rest
    if rest not in BENDS:
        raise where.error(f"{quoted(rest)} after the direction: write low, middle or high, then bent, very bent, touch")
    return Direction(words[0], level, BENDS.index(rest), touch)


def _parse_turn(words: list[str], text: str, where: Where) -> Turn:
    """Parse `turn 90 left`, or `turn 0`."""
    sides = {"left": 1, "right": -1}
    if words[1:] == ["0"]:
        return Turn(0)
    if len(words) != 3 or words[2] not in sides:
        raise where.error(f"{quoted(text, 80)}: write turn DEGREES left, or right")
    degrees = to_number(words[1], where.path, where.line)
    if degrees % SIGN_SECTOR_DEG or not 0.0 < degrees <= 3600.0:
        raise where.error(f"turn {words[1]:.20}: must be a multiple of {SIGN_SECTOR_DEG:g} degrees, at most 3600")
    return Turn(sides[words[2]] * int(degrees))


def _staff(fields: dict[str, str], start: dict[str, Value], signs: list[Sign], where: Where) -> Staff:
    """Return the staff of a file's fields and signs."""
    for name in _FIELDS[2:]:
        if not fields.get(name):
            raise where.error(f"there is no line {name}")
    bar, counts = (to_number(fields[name], where.path, where.line) for name in ("bar", "counts"))
    if bar != int(bar) or not 1 <= bar <= MAX_BAR_COUNTS:
        raise where.error(f"bar {fields['bar']:.20}: must be a whole number of counts from 1 to {MAX_BAR_COUNTS}")
    ends = max((sign.end for sign in signs), default=0.0)
    if not ends <= counts <= MAX_STAFF_COUNTS:
        raise where.error(f"counts {fields['counts']:.20}: the last sign ends at {ends:g}")
    ordered = sorted(signs, key=lambda sign: (COLUMNS.index(sign.column), sign.begin))
    return Staff(
        fields.get("title", ""),
        fields["body"],
        parse_tempo(fields["tempo"], where),
        int(bar),
        counts,
        start,
        tuple(ordered),
    )
