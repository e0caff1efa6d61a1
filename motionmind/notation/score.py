"""What a score holds: positions, phrases, postures, and how their words are looked up.

Everything is written for the left side. A *setting* is what one limb, or the trunk, does: values by what they are of,
either an angle, `(joint, axis)` in degrees about that axis, or a word of a leg that stands, such as `"bend"`. A
*position* is a vocabulary's entry: the setting of the leading limb and of the other.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.errors import FormatError, did_you_mean

Setting = Mapping[object, float]

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)")
KINDS = ("stand", "touch", "planted")  # a limb that is none of these is in the air


@dataclass(frozen=True)
class Where:
    """A line of a file."""

    path: str
    line: int

    def error(self, message: str) -> FormatError:
        """What is wrong there."""
        return FormatError(message, path=self.path, line=self.line)


@dataclass(frozen=True)
class Position:
    """An entry of a vocabulary: what the leading limb and the other one do; a trunk has but one setting, twice.

    Attributes:
        lead, other: their settings.
        sided: whether it looks different in the mirror, so that a side must lead.
        path: the score that says so.
    """

    lead: Setting
    other: Setting
    sided: bool
    path: str = ""

    def over(self, below: Position) -> Position:
        """This position on top of another: what it does not say is as below."""
        return Position(_over(self.lead, below.lead), _over(self.other, below.other), self.sided or below.sided)


NOTHING = Position({}, {}, False)


@dataclass(frozen=True)
class Line:
    """A line of a phrase as it was written."""

    where: Where
    text: str


@dataclass(frozen=True, eq=False)
class Phrase:
    """Lines with a name; `score` is where their words are looked up.

    Attributes:
        open: words that a call fills in.
        about: what it is, of a clip.
    """

    name: str
    score: Score
    lines: tuple[Line, ...]
    where: Where
    open: tuple[str, ...] = ()
    about: str = ""


class Clip(Phrase):
    """A phrase that is movement of its own."""


@dataclass(eq=False)
class Score:
    """A score that was read.

    Attributes:
        path: its file.
        body: whose movement it is.
        title: what it is called.
        tempo: counts a minute.
        positions: the vocabulary of each layer.
        facings: degrees to the left of the audience, by name.
        phrases: phrases and clips by name, in order.
        postures: single postures by name.
        included: other scores by the name that their words have here.
    """

    path: str
    body: Anatomy
    title: str = ""
    tempo: float = 60.0
    positions: dict[str, dict[str, Position]] = field(default_factory=dict)
    facings: dict[str, float] = field(default_factory=dict)
    phrases: dict[str, Phrase] = field(default_factory=dict)
    postures: dict[str, Line] = field(default_factory=dict)
    included: dict[str, Score] = field(default_factory=dict)

    @property
    def clips(self) -> list[Clip]:
        """The clips that this score itself holds, in order."""
        return [found for found in self.phrases.values() if isinstance(found, Clip) and found.score is self]

    def paired(self, layer: str) -> bool:
        """Whether a layer is a pair of limbs."""
        return self.body.paired(self.body.layers[layer][0])

    def cell(self, layer: str, text: str, where: Where) -> tuple[Setting, Setting]:
        """What a cell says that the left and the right limb do; of a trunk, the same setting twice."""
        parts = text.split("/")
        if len(parts) == 1:
            return self._led(layer, text, where)
        if len(parts) > 2 or not self.paired(layer):
            raise where.error(
                f"{text!r}: left / right is for two limbs" if len(parts) == 2 else f"{text!r}: one / too many"
            )
        settings = []
        for part in parts:
            position = self._words(layer, part, where)
            if position.lead != position.other:
                raise where.error(f"{part.strip()!r} is for both sides; beside a / goes what one limb does")
            settings.append(position.lead)
        return settings[0], settings[1]

    def _led(self, layer: str, text: str, where: Where) -> tuple[Setting, Setting]:
        words = text.split()
        sides = [word for word in words if word in SIDES]
        if len(sides) > 1:
            raise where.error(f"{text!r} names two sides")
        position = self._words(layer, " ".join(word for word in words if word not in SIDES), where)
        if position.sided and not sides:
            raise where.error(f"{text!r}: say which side: {text} left or {text} right")
        settings = position.lead, position.other
        return self.mirrored(layer, settings) if sides == ["right"] else settings

    def cell_words(self, layer: str, text: str) -> tuple[str, str]:
        """What a cell calls that which the left and the right limb do; of a trunk, which way it goes."""
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
        """What the left and the right limb are called to do in the mirror."""
        if self.paired(layer):
            return words[::-1]
        opposite = {"left": "right", "right": "left"}
        name = " ".join(opposite.get(word, word) for word in words[0].split())
        return name, name

    def mirrored(self, layer: str, limbs: tuple[Setting, Setting]) -> tuple[Setting, Setting]:
        """What the left and the right limb do in the mirror; of a trunk, what it does."""
        left, right = limbs
        return (_leaning(right), _leaning(left)) if self.paired(layer) else (mirrored(left), mirrored(right))

    def _words(self, layer: str, text: str, where: Where) -> Position:
        position, words = NOTHING, text.split()
        if not words:
            raise where.error(f"no position of the {layer}")
        for word in words:
            position = self.position(layer, word, where).over(position)
        return position

    def position(self, layer: str, word: str, where: Where) -> Position:
        """The position of a layer that is called `word`."""
        prefix, dot, name = word.rpartition(".")
        home = self._included(prefix, where) if dot else self
        known = home.positions.get(layer, {})
        if word == "neutral":
            return NOTHING
        if name not in known:
            elsewhere = [other for other, names in home.positions.items() if name in names]
            hint = did_you_mean(name, known) or (f"; it is a position of the {elsewhere[0]}" if elsewhere else "")
            raise where.error(f"{word!r} is no position of the {layer}{hint}")
        return known[name]

    def phrase(self, word: str, where: Where) -> Phrase:
        """The phrase or clip that is called `word`."""
        prefix, dot, name = word.rpartition(".")
        home = self._included(prefix, where) if dot else self
        if name not in home.phrases:
            raise where.error(f"{word!r} is no phrase{did_you_mean(name, home.phrases)}")
        return home.phrases[name]

    def _included(self, prefix: str, where: Where) -> Score:
        if prefix not in self.included:
            raise where.error(f"{prefix!r} is no score that is included{did_you_mean(prefix, self.included)}")
        return self.included[prefix]

    def facing(self, word: str, where: Where) -> float:
        """Degrees to the left of the audience of a facing, by name or number."""
        if NUMBER.fullmatch(word):
            return number(word, "face", where)
        if word not in self.facings:
            raise where.error(
                f"{word!r} is no facing{did_you_mean(word, self.facings)}; give one of the facings, or degrees"
            )
        return self.facings[word]


def mirrored(setting: Setting) -> Setting:
    """A trunk's setting in the mirror: turns about y and z the other way."""
    return {key: -value if isinstance(key, tuple) and key[1] > 0 else value for key, value in setting.items()}


def _leaning(setting: Setting) -> Setting:
    """What a limb does that was the other one's, in the mirror."""
    return {key: -value if key == "lean left" else value for key, value in setting.items()}


def _over(upper: Setting, lower: Setting) -> Setting:
    """The upper setting on top of the lower one. A leg is in the air, touches or stands: the last word counts."""
    kinds = [kind for kind in KINDS if kind in upper]
    return {key: value for key, value in lower.items() if not (kinds and key in KINDS)} | dict(upper)


def tempo(text: str, where: Where) -> float:
    """Counts a minute."""
    if not NUMBER.fullmatch(text) or not 1.0 <= float(text) <= 6000.0:
        raise where.error(f"tempo {text}: give counts a minute, from 1 to 6000")
    return float(text)


def number(text: str, what: str, where: Where) -> float:
    """A number, written after `what`."""
    if not NUMBER.fullmatch(text) or abs(float(text)) > 1e4:
        raise where.error(f"{what} {text}".rstrip() + ": a number was expected")
    return float(text)
