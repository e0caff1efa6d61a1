"""The contents of a score: positions, phrases and postures, and the lookup of their words.

All definitions are for the left side. A *setting* describes one limb, or the trunk: its keys are angles, `(joint,
axis)` in degrees about that axis, or words of a standing leg such as `"bend"`. A *position* is an entry of the
vocabulary: the settings of the leading and the other limb.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.display import displayed
from motionmind.errors import FormatError, did_you_mean, quoted

Setting = Mapping[object, float]

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)")
SUPPORTS = ("stand", "touch", "planted")  # a limb with none of these is in the air


@dataclass(frozen=True)
class Where:
    """A line of a file, counted from 1."""

    path: str
    line: int

    def error(self, message: str) -> FormatError:
        """Return a FormatError at this line."""
        return FormatError(message, path=self.path, line=self.line)


@dataclass(frozen=True)
class Position:
    """An entry of a vocabulary: the settings of the leading and the other limb; a trunk repeats its setting.

    Attributes:
        lead, other: their settings.
        sided: whether its mirror image differs, so that a side must lead.
        path: the score that defines it.
    """

    lead: Setting
    other: Setting
    sided: bool
    path: str = ""

    def over(self, below: Position) -> Position:
        """Overlay this position on another, which supplies the unset values."""
        lead, other = _overlay(self.lead, below.lead), _overlay(self.other, below.other)
        return Position(lead, other, self.sided or below.sided)


NOTHING = Position({}, {}, False)


@dataclass(frozen=True)
class Line:
    """A line of a phrase as written."""

    where: Where
    text: str


@dataclass(frozen=True, eq=False)
class Phrase:
    """Named lines of a score.

    Attributes:
        name: its name.
        score: the score that defines its words.
        lines: the lines below its heading.
        where: its heading.
        open: words that a call fills in.
        about: a clip's description.
    """

    name: str
    score: Score
    lines: tuple[Line, ...]
    where: Where
    open: tuple[str, ...] = ()
    about: str = ""


@dataclass(frozen=True, eq=False)
class Clip(Phrase):
    """A phrase that is a movement in its own right.

    Attributes:
        sound: its sound file, from the score's folder; "" for none.
    """

    sound: str = ""


@dataclass(eq=False)
class Score:
    """A score.

    Attributes:
        path: its file.
        body: the body that moves.
        title: its title.
        tempo: counts per minute.
        positions: the vocabulary of each layer, by name.
        facings: degrees to the left of the audience, by name.
        phrases: phrases and clips by name, in order.
        postures: single postures by name, each a phrase of one line; those of scores that it includes, too.
        included: other scores by the prefix of their words here.

    >>> from pathlib import Path
    >>> lines = ["title Rest", "body human23", "legs", "  stand = stand", "clip rest: Still", "  start | stand"]
    >>> _ = Path("rest.score").write_text("\\n".join(lines))
    >>> from motionmind import Score, read_score
    >>> isinstance(read_score("rest.score"), Score)
    True
    """

    path: str
    body: Anatomy
    title: str = ""
    tempo: float = 60.0
    positions: dict[str, dict[str, Position]] = field(default_factory=dict)
    facings: dict[str, float] = field(default_factory=dict)
    phrases: dict[str, Phrase] = field(default_factory=dict)
    postures: dict[str, Phrase] = field(default_factory=dict)
    included: dict[str, Score] = field(default_factory=dict)

    @property
    def clips(self) -> list[Clip]:
        """The score's own clips, in order."""
        return [found for found in self.phrases.values() if isinstance(found, Clip) and found.score is self]

    def paired(self, layer: str) -> bool:
        """Return whether a layer is a pair of limbs."""
        return self.body.paired(self.body.layers[layer][0])

    def cell(self, layer: str, text: str, where: Where) -> tuple[Setting, Setting]:
        """Return the settings of the left and the right limb in a cell; a trunk repeats its setting.

        Raises:
            FormatError: a word is unknown, or a side is missing or too many.
        """
        parts = text.split("/")
        if len(parts) == 1:
            return self._led_by_side(layer, text, where)
        if len(parts) > 2 or not self.paired(layer):
            raise where.error(
                f"{quoted(text)}: left / right needs two limbs"
                if len(parts) == 2
                else f"{quoted(text)}: one / too many"
            )
        settings = []
        for part in parts:
            position = self._combine(layer, part, where)
            if position.lead != position.other:
                raise where.error(f"{quoted(part.strip())} is for both sides; each side of / is one limb")
            settings.append(position.lead)
        return settings[0], settings[1]

    def _led_by_side(self, layer: str, text: str, where: Where) -> tuple[Setting, Setting]:
        """Return the settings of the left and the right limb in a cell without a slash."""
        words = text.split()
        sides = [word for word in words if word in SIDES]
        if len(sides) > 1:
            raise where.error(f"{quoted(text)} names two sides")
        position = self._combine(layer, " ".join(word for word in words if word not in SIDES), where)
        if position.sided and not sides:
            short = displayed(text, 40)
            raise where.error(f"{short!r}: add a side: {short} left or {short} right")
        settings = position.lead, position.other
        return self.mirrored(layer, settings) if sides == ["right"] else settings

    def cell_words(self, layer: str, text: str) -> tuple[str, str]:
        """Return the names of the left and the right limb's position in a cell; a trunk repeats its name and side."""
        if "/" in text:
            left, right = (" ".join(part.split()) for part in text.split("/"))
            return left, right
        words = text.split()
        name = " ".join(word for word in words if word not in SIDES)
        side = next((word for word in words if word in SIDES), "")
        if not side or not self.paired(layer):
            return (f"{name} {side}".rstrip(),) * 2
        names = f"{name}, leading", f"{name}, other"
        return names if side == "left" else names[::-1]

    def mirrored_words(self, layer: str, words: tuple[str, str]) -> tuple[str, str]:
        """Return the names of the left and the right limb's position in the mirror image."""
        if self.paired(layer):
            return words[::-1]
        opposite = {"left": "right", "right": "left"}
        name = " ".join(opposite.get(word, word) for word in words[0].split())
        return name, name

    def mirrored(self, layer: str, limbs: tuple[Setting, Setting]) -> tuple[Setting, Setting]:
        """Return the settings of the left and the right limb in the mirror image; a trunk repeats its setting."""
        left, right = limbs
        if not self.paired(layer):
            return mirrored(left), mirrored(right)
        return _swap_lean(right), _swap_lean(left)

    def _combine(self, layer: str, text: str, where: Where) -> Position:
        """Overlay the positions in a cell, the last on top."""
        position, words = NOTHING, text.split()
        if not words:
            raise where.error(f"no position of the {layer}")
        for word in words:
            position = self.position(layer, word, where).over(position)
        return position

    def position(self, layer: str, word: str, where: Where) -> Position:
        """Look up a layer's position by name, with the prefix of an included score if any; FormatError if unknown."""
        prefix, dot, name = word.rpartition(".")
        home = self._included(prefix, where) if dot else self
        known = home.positions.get(layer, {})
        if word == "neutral":
            return NOTHING
        if name not in known:
            elsewhere = [other for other, names in home.positions.items() if name in names]
            hint = did_you_mean(name, known) or (f"; it is a position of the {elsewhere[0]}" if elsewhere else "")
            raise where.error(f"{quoted(word)} is not a position of the {layer}{hint}")
        return known[name]

    def phrase(self, word: str, where: Where) -> Phrase:
        """Look up a phrase or clip by name, with the prefix of an included score if any; FormatError if unknown."""
        prefix, dot, name = word.rpartition(".")
        home = self._included(prefix, where) if dot else self
        if name not in home.phrases:
            raise where.error(f"{quoted(word)} is not a phrase{did_you_mean(name, home.phrases)}")
        return home.phrases[name]

    def _included(self, prefix: str, where: Where) -> Score:
        if prefix not in self.included:
            raise where.error(f"{quoted(prefix)} is not an included score{did_you_mean(prefix, self.included)}")
        return self.included[prefix]

    def facing(self, word: str, where: Where) -> float:
        """Return a facing, by name or number, in degrees to the left of the audience; FormatError if unknown."""
        if NUMBER.fullmatch(word):
            return number(word, "face", where)
        if word not in self.facings:
            raise where.error(
                f"{quoted(word)} is not a facing{did_you_mean(word, self.facings)}; give a facing or degrees"
            )
        return self.facings[word]


def mirrored(setting: Setting) -> Setting:
    """Return a trunk's setting in the mirror image: angles about y and z are negated."""
    return {key: -value if isinstance(key, tuple) and key[1] > 0 else value for key, value in setting.items()}


def _swap_lean(setting: Setting) -> Setting:
    """Return a limb's setting for the other limb in the mirror image: negate only a lean to the left."""
    return {key: -value if key == "lean left" else value for key, value in setting.items()}


def _overlay(upper: Setting, lower: Setting) -> Setting:
    """Overlay one setting on another. A support in `upper` replaces any in `lower`."""
    replaces = any(support in upper for support in SUPPORTS)
    return {key: value for key, value in lower.items() if not (replaces and key in SUPPORTS)} | dict(upper)


def tempo(text: str, where: Where) -> float:
    """Parse counts per minute, from 1 to 6000; FormatError for anything else."""
    if not NUMBER.fullmatch(text) or not 1.0 <= float(text) <= 6000.0:
        raise where.error(f"tempo {displayed(text, 40)}: give counts per minute, from 1 to 6000")
    return float(text)


def number(text: str, what: str, where: Where) -> float:
    """Parse the number written after `what`, at most 1e4 in size; FormatError for anything else."""
    if not NUMBER.fullmatch(text) or abs(float(text)) > 1e4:
        raise where.error(f"{what} {text}".rstrip() + ": expected a number")
    return float(text)
