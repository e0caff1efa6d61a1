"""Read scores: parse lines into positions and phrases; docs/notation.md explains the notation."""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from unicodedata import normalize

from motionmind.arguments import check_path
from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.body.anatomy_file import HEADINGS, anatomy_named, read_body
from motionmind.errors import FormatError, did_you_mean, enumerated, quoted
from motionmind.files import FilePath
from motionmind.formats.text import read_lines
from motionmind.notation.score import (
    NOTHING,
    NUMBER,
    SUPPORTS,
    Clip,
    Line,
    Phrase,
    Position,
    Score,
    Setting,
    Where,
    mirrored,
    number,
    tempo,
)
from motionmind.notation.sources import place_of

MAX_INCLUDES = 100  # scores included by one
MAX_OPEN_WORDS = 20  # of a phrase
RESERVED_NAMES = (*SIDES, "neutral")
LINE_WORDS = ("start", "tempo", "sound")  # with which other lines begin, so that no phrase may have these names

NAME = re.compile(r"[^\W_][\w-]*")

# Words of a standing leg, with the range of the number after them; `lean` has a direction before its number.
STANDING = {
    "out": (-200.0, 200.0),
    "ahead": (-200.0, 200.0),
    "turn": (-180.0, 180.0),
    "bend": (0.0, 170.0),
    "heel": (0.0, 90.0),
    "weight": (0.0, 100.0),
    "knee": (-180.0, 180.0),
    "pivot": (-50.0, 50.0),
}
PLANTED = ("weight", "pivot")  # those of a leg that is given by its angles
LEAN = {
    "ahead": ("lean ahead", 1.0),
    "back": ("lean ahead", -1.0),
    "left": ("lean left", 1.0),
    "right": ("lean left", -1.0),
}


def read_score(path: FilePath) -> Score:
    """Read a score, with the scores that it includes.

    Raises:
        FormatError: the score is invalid; names file, line and word.

    >>> from pathlib import Path
    >>> text = '''title  Two bends of the knees
    ... body   human23
    ... legs
    ...   stand = stand out 10 turn 8
    ...   bend = stand out 10 turn 8, bend 30
    ... clip bends: Down and up
    ...   start | stand
    ...   1     | bend
    ...   1     | stand
    ... '''
    >>> _ = Path("bends.score").write_text(text)
    >>> from motionmind import read_score
    >>> [clip.name for clip in read_score("bends.score").clips]
    ['bends']
    """
    check_path("path", path)
    return _read(Path(path), (), {}, MAX_INCLUDES)


def read_scores(paths: Iterable[Path]) -> tuple[list[Score], list[Path]]:
    """Read several scores, and each of their includes once; return the scores, and all files read.

    Raises:
        FormatError: a score is invalid; names file, line and word.
    """
    known: dict[Path, Score] = {}
    scores = [_read(path, (), known, len(known) + MAX_INCLUDES) for path in paths]
    files = [Path(file) for score in (*scores, *known.values()) for file in (score.path, score.body.path)]
    return scores, sorted(set(files))


def _read(path: Path, above: tuple[Path, ...], known: dict[Path, Score], most: int) -> Score:
    """Read a score, and each file once.

    Args:
        path: the score.
        above: the scores that include it, outermost first.
        known: the scores read so far, by resolved path; extended in place.
        most: the maximum number of `known`.
    """
    lines = [Line(Where(str(path), number), text) for number, text in enumerate(read_lines(path), start=1)]
    blocks = list(_blocks(lines))
    heads = [head for head, _ in blocks if _word(head) == "include"]
    if len(heads) > MAX_INCLUDES:
        raise heads[MAX_INCLUDES].where.error(f"more than {MAX_INCLUDES} scores are included")
    includes = [_read_include(path, head, (*above, path.resolve()), known, most) for head in heads]
    score = Score(str(path), _find_body(path, [head for head, _ in blocks], [other for _, _, other in includes]))
    for where, name, other in includes:
        _include(score, where, name, other)
    for head, inner in blocks:
        _read_block(score, head, inner)
    return score


def _word(head: Line) -> str:
    """Return a heading's first word."""
    return head.text.split(maxsplit=1)[0]


def _read_include(
    path: Path, head: Line, above: tuple[Path, ...], known: dict[Path, Score], most: int
) -> tuple[Where, str, Score]:
    """Read the score of an `include` heading; return its line, its new name, and the score."""
    file, _, name = (part.strip() for part in head.text.removeprefix("include").partition(" as "))
    try:
        included = place_of(path, file)
        if not included.is_file():
            raise head.where.error(f"there is no file {included}")
        # Errors quote invalid lines, so files other than scores stay unread, even behind a link named like a score.
        if {included.suffix.lower(), included.resolve().suffix.lower()} != {".score"}:
            raise head.where.error(f"{file} is not a score, whose name ends in .score")
        if included.resolve() in above:
            raise head.where.error(f"{file} includes itself")
        place = included.resolve()
    except (OSError, ValueError):
        raise head.where.error(f"{file:.60} cannot be a file") from None
    if place not in known:
        if len(known) == most or len(above) > MAX_INCLUDES // 2:
            raise head.where.error(f"more than {MAX_INCLUDES} scores are included, or too many within one another")
        known[place] = _read(included, above, known, most)
    return head.where, name, known[place]


def _blocks(lines: list[Line]) -> Iterator[tuple[Line, list[Line]]]:
    """Yield each heading with the indented lines below it, without comments and empty lines."""
    head: Line | None = None
    inner: list[list[Line]] = []  # the lines that make one
    for line in lines:
        text = normalize("NFC", line.text).replace("\t", " ").partition("#")[0].rstrip()
        if not text.strip():
            continue
        if text[0].isspace():
            if head is None:
                raise line.where.error("an indented line before any heading")
            if not inner or not inner[-1][-1].text.endswith(","):
                inner.append([])
            inner[-1].append(Line(line.where, text.strip()))
            continue
        if head:
            yield head, [_join(parts) for parts in inner]
        head, inner = Line(line.where, text), []
    if head:
        yield head, [_join(parts) for parts in inner]


def _join(parts: list[Line]) -> Line:
    """Join a line with its continuations."""
    return parts[0] if len(parts) == 1 else Line(parts[0].where, " ".join(part.text for part in parts))


def _find_body(path: Path, heads: list[Line], included: list[Score]) -> Anatomy:
    """Return the body named by a score, bundled or in a file beside it; else the body of its first include."""
    for head in heads:
        rest = head.text.removeprefix("body").strip()
        if _word(head) == "body":
            try:
                return read_body(path.parent / rest) if rest.endswith(".toml") else anatomy_named(rest)
            except FormatError as error:
                raise head.where.error(str(error)) from None
    return included[0].body if included else anatomy_named("human23")


def _read_block(score: Score, head: Line, inner: list[Line]) -> None:
    """Add a heading and its lines to the score."""
    word, _, rest = head.text.partition(" ")
    rest, where = rest.strip(), head.where
    if word in score.body.layers or word == "facings":
        if rest:
            raise where.error(
                f"{quoted(rest, 80)} after the heading {word}: positions go on lines of their own, indented"
            )
        for line in inner:
            _add_entry(score, word, line)
        return
    if word not in HEADINGS:
        layers = tuple(score.body.layers)
        known = HEADINGS + layers
        raise where.error(
            f"{quoted(word)} is not a heading{did_you_mean(word, known) or f'; headings are {enumerated(known, 20)}'}"
        )
    if inner and word not in ("phrase", "clip"):
        raise inner[0].where.error(f"indented, but {word} has no lines below it")
    if word == "title":
        score.title = rest
    elif word == "tempo":
        score.tempo = tempo(rest, where)
    elif word == "posture":
        name, equals, text = (part.strip() for part in rest.partition("="))
        if not equals:
            raise where.error(f"{quoted(rest, 80)}: write posture NAME = {' | '.join(score.body.layers)}")
        own = [known for known, found in score.postures.items() if found.score is score]
        _check_name(name, own, where)
        score.postures[name] = Phrase(name, score, (Line(where, text),), where)
    elif word in ("phrase", "clip"):
        _add_phrase(score, word, rest, inner, where)


def _add_phrase(score: Score, word: str, rest: str, inner: list[Line], where: Where) -> None:
    """Add a phrase or clip, whose heading is `word` and `rest`, to the score."""
    about = ""
    if word == "clip":
        rest, _, about = (part.strip() for part in rest.partition(":"))
    name, bracket, arguments = rest.partition("(")
    if bracket and (word == "clip" or not arguments.endswith(")")):
        raise where.error(f"{quoted(rest, 80)}: write phrase NAME, or phrase NAME (WORD, WORD)")
    words = tuple(part.strip() for part in arguments.removesuffix(")").split(",")) if bracket else ()
    if len(words) > MAX_OPEN_WORDS:
        raise where.error(f"{len(words)} open words; a phrase has at most {MAX_OPEN_WORDS}")
    for i, open_word in enumerate(words):
        _check_name(open_word, words[:i], where)
    name = name.strip()
    known = score.phrases.get(name)
    _check_name(name, (name,) if known and known.score is score else (), where)
    if name in LINE_WORDS or name[0].isdigit():
        raise where.error(f"{quoted(name)} cannot be a phrase's name: such lines have another meaning")
    lines, sound = _split_sound(inner) if word == "clip" else (inner, "")
    if not lines:
        raise where.error(f"{word} {name} has no lines")
    if word == "clip":
        score.phrases[name] = Clip(name, score, tuple(lines), where, words, about, sound)
    else:
        score.phrases[name] = Phrase(name, score, tuple(lines), where, words, about)


def _split_sound(inner: list[Line]) -> tuple[list[Line], str]:
    """Return the lines of a clip without `sound FILE`, and the file; "" for none."""
    named = [line for line in inner if _word(line) == "sound"]
    if not named:
        return inner, ""
    if len(named) > 1:
        raise named[1].where.error("a second sound; a clip has one")
    file = named[0].text.removeprefix("sound").strip()
    place = PurePosixPath(file)
    if not file or place.is_absolute() or ".." in place.parts or "\\" in file or "\0" in file:
        raise named[0].where.error(f"{quoted(file, 60)} is not a file beside the score; write sound FILE, as song.wav")
    return [line for line in inner if line is not named[0]], file


def _include(score: Score, where: Where, name: str, other: Score) -> None:
    """Add another score's vocabulary and phrases, or the whole score under a name."""
    if other.body.path != score.body.path:
        raise where.error(f"{other.path} is for {other.body.skeleton.name}, this score for {score.body.skeleton.name}")
    if name:
        score.included[_check_name(name, score.included, where)] = other
        return
    for layer, positions in other.positions.items():
        score.positions.setdefault(layer, {}).update(positions)
    score.facings.update(other.facings)
    score.phrases.update(other.phrases)
    score.postures.update(other.postures)
    score.included.update(other.included)


def _check_name(name: str, taken: Container[str], where: Where) -> str:
    """Return a new name; FormatError if it is malformed, reserved or taken."""
    if not NAME.fullmatch(name):
        raise where.error(f"{quoted(name)} cannot be a name: use letters, digits and hyphens")
    if name in RESERVED_NAMES:
        raise where.error(f"{quoted(name)} cannot be a name: it is reserved")
    if name in taken:
        raise where.error(f"{quoted(name)} is already defined")
    return name


def _add_entry(score: Score, layer: str, line: Line) -> None:
    """Add a line of a vocabulary, or a facing, to the score."""
    name, equals, text = (part.strip() for part in line.text.partition("="))
    if not equals:
        raise line.where.error(f"{quoted(line.text, 80)}: write NAME = DEFINITION")
    if layer == "facings":
        if not NUMBER.fullmatch(text):
            raise line.where.error(f"{quoted(text)}: a facing is degrees to the left of the audience")
        score.facings[_check_name(name, {}, line.where)] = number(text, name, line.where)
        return
    positions = score.positions.setdefault(layer, {})
    position = replace(_parse_position(score, layer, text, line.where), path=score.path)
    known = positions.get(name)
    _check_name(name, (name,) if known and known.path == score.path else (), line.where)
    positions[name] = position


def _parse_position(score: Score, layer: str, text: str, where: Where) -> Position:
    """Parse a position's definition: one part, or LEADING / OTHER limb."""
    parts = text.split("/")
    if len(parts) > 1 and not score.paired(layer):
        raise where.error(f"{quoted(text)}: a / separates two limbs, but the {layer} is one part")
    if len(parts) > 2:
        raise where.error(f"{quoted(text)}: one / too many")
    positions = [_parse_terms(score, layer, part, where) for part in parts]
    if len(positions) == 1:
        return positions[0]
    for part, position in zip(parts, positions, strict=True):
        if position.lead != position.other:
            raise where.error(f"{quoted(part.strip())} is for both sides; each side of / is one limb")
    return Position(positions[0].lead, positions[1].lead, True)


def _parse_terms(score: Score, layer: str, text: str, where: Where) -> Position:
    """Parse terms between commas and overlay them, the last on top."""
    position = NOTHING
    for term in text.split(","):
        words = term.split()
        if not words:
            raise where.error(f"{quoted(text.strip())}: nothing between commas" if text.strip() else "empty definition")
        setting = _parse_setting(score, layer, words, where)
        if setting is not None:
            sided = bool(setting.get("lean left")) if score.paired(layer) else setting != mirrored(setting)
            position = Position(setting, setting, sided).over(position)
            continue
        for word in words:
            position = score.position(layer, word, where).over(position)
    return position


def _parse_setting(score: Score, layer: str, words: list[str], where: Where) -> Setting | None:
    """Parse a term about angles or feet; None if its words name other positions."""
    first, numbered = words[0], len(words) > 1 and bool(NUMBER.fullmatch(words[1]))
    if words == ["neutral"]:
        return {}
    leg = score.body.leg
    stands = leg is not None and leg.hip in score.body.layers[layer]
    if first in (SUPPORTS if stands else SUPPORTS[2:] if leg is None else ()):
        if first == "planted":
            return {"planted": 1.0} | _parse_standing(words[1:], where, PLANTED if stands else ())
        if first == "stand":
            return {"stand": 1.0} | _parse_standing(words[1:], where)
        if len(words) != 3 or words[1] != "towards":
            raise where.error("write touch towards DEGREES: 0 to the front, 90 to the side, 180 to the back")
        return {"touch": 1.0, "towards": number(words[2], "touch towards", where)}
    if stands and (first == "lean" or (first in STANDING and numbered)):
        return _parse_standing(words, where)
    return _parse_angles(score, layer, words, where)


def _parse_angles(score: Score, layer: str, words: list[str], where: Where) -> Setting | None:
    """Parse a joint or group of joints with its angles; None if the first word is neither and no number is last."""
    first, joints = words[0], score.body.layers[layer]
    ends = [joint for joint in joints if joint.endswith(f"_{first}")]  # coxa, if fore_coxa is the only one
    parts = score.body.groups.get(first, {ends[0] if len(ends) == 1 else first: {}})
    if not set(parts) <= set(joints):
        if NUMBER.fullmatch(words[-1]):
            known = [*joints, *score.body.groups, *SUPPORTS, *STANDING]
            raise where.error(f"{quoted(first)} is not a joint of the {layer}{did_you_mean(first, known)}")
        return None
    setting: dict[object, float] = {}
    for name, value in _pairs(words[1:], where):
        for joint, shares in parts.items():
            angles = score.body.joints[joint].angles
            names = {key: (key, 1.0) for key in angles}
            names |= {angle.opposite: (key, -1.0) for key, angle in angles.items() if angle.opposite}
            if name not in names:
                hint = did_you_mean(name, names) or f"; it has {', '.join(names)}"
                raise where.error(f"{quoted(name)} is not an angle of the {first}{hint}")
            key, sign = names[name]
            setting[joint, angles[key].axis] = sign * angles[key].sign * shares.get(key, 1.0) * value
    if not setting:
        raise where.error(f"{first}: write an angle and degrees")
    return setting


def _parse_standing(words: list[str], where: Where, known: Sequence[str] = (*STANDING, "lean")) -> dict[object, float]:
    """Parse the `known` words of a standing leg: name and number, or `lean`, direction and number."""
    setting: dict[object, float] = {}
    rest = iter(words)
    for word in rest:
        direction = next(rest, "") if word == "lean" else ""
        if word == "lean" and direction not in LEAN:
            raise where.error(f"lean {direction}: write lean, a direction (ahead, back, left, right) and centimetres")
        if word not in known:
            hint = did_you_mean(word, known) or f"; words are {', '.join(known) or 'none'}"
            raise where.error(f"{quoted(word)} does not describe a leg on the floor{hint}")
        value = number(next(rest, ""), f"{word} {direction}".strip(), where)
        least, most = STANDING.get(word, (-200.0, 200.0))
        if not least <= value <= most:
            raise where.error(f"{word} {value:g}: must be from {least:g} to {most:g}")
        key, sign = LEAN[direction] if direction else (word, 1.0)
        setting[key] = sign * value
    return setting


def _pairs(words: list[str], where: Where) -> Iterator[tuple[str, float]]:
    """Yield each name with the number that follows it."""
    for name, value in zip(words[::2], [*words[1::2], ""], strict=False):
        yield name, number(value, name, where)
