"""Types of option values."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any, ClassVar

import click

from motionmind.clip_names import split_clip


class Number(click.FloatRange):
    """A finite number in a range."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; fail with a usage error if it is invalid."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            is_named = str(value).strip("+- ").isalpha()  # as "inf"
            self.fail(f"{value} is {'not a finite number' if is_named else 'too large'}.", param, ctx)
        return number


class Whole(click.IntRange):
    """A whole number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number; fail with a usage error if it is invalid."""
        if _has_too_many_digits(str(value).strip("+- ")):
            self.fail(f"{value} is too large.", param, ctx)
        return int(super().convert(value, param, ctx))


class FrameNumber(click.ParamType[int]):
    """The number of a frame; counted from the end if negative."""

    name = "frame"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number; fail with a usage error if it is invalid."""
        if _has_too_many_digits(str(value).strip("+- ")):
            self.fail(f"{value} is too large.", param, ctx)
        return int(click.INT.convert(value, param, ctx))


def _has_too_many_digits(word: str) -> bool:
    """Return whether a word is a number too large for any count; int() raises ValueError from 4301 digits on."""
    return len(word) > 18 and word.isdecimal()


class CorpusName(click.ParamType[str]):
    """The name or folder of a corpus; if it is missing, the error lists all corpora, the user's own first."""

    name = "name"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name."""
        return str(value)

    def get_missing_message(self, param: click.Parameter, ctx: click.Context | None) -> str:
        """Return the names of all corpora, the user's own first."""
        return f"Corpora: {known_corpora(ctx.params.get('home') if ctx else None)}"


def known_corpora(home: Path | None) -> str:
    """Enumerate all corpora for a message, the user's own first."""
    from motionmind.bundled import bundled
    from motionmind.corpus.store import list_corpora
    from motionmind.errors import enumerated

    corpora = list_corpora(home)
    return enumerated(sorted(corpora, key=lambda name: corpora[name].parent == bundled("corpora")), 20) or "none"


class Moves(click.ParamType["int | tuple[int, int]"]):
    """A number of moves, "8", or a range of numbers, "6..10"."""

    name = "moves"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | tuple[int, int]:
        """Return the number, or the minimum and the maximum."""
        words = str(value).split("..")
        if any(map(_has_too_many_digits, words)):
            self.fail(f"{value} is too large.", param, ctx)
        if len(words) > 2 or not all(word.isdecimal() and int(word) > 0 for word in words):
            self.fail(f"{value!r} is neither a number of moves such as 8 nor a range such as 6..10.", param, ctx)
        least, most = int(words[0]), int(words[-1])
        if least > most:
            self.fail(f"{value!r} ends before it begins.", param, ctx)
        return least if len(words) == 1 else (least, most)


class Point(click.ParamType["tuple[float, ...]"]):
    """Coordinates, "0.01" or "1,1,20"."""

    name = "point"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """Return the coordinates."""
        try:
            point = tuple(float(word) for word in str(value).split(","))
        except ValueError:
            point = ()
        if not (point and all(map(math.isfinite, point))):
            self.fail(f"{value!r} is neither a number such as 0.01 nor a point such as 1,1,20.", param, ctx)
        return point


class Counts(click.ParamType["tuple[float, ...]"]):
    """Counts, "3" or "1,5.5"."""

    name = "counts"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """Return the counts."""
        if isinstance(value, tuple):  # the default
            return value
        try:
            counts = tuple(float(word) for word in str(value).split(","))
        except ValueError:
            counts = ()
        if not counts or not all(map(math.isfinite, counts)):
            self.fail(f"{value!r} is neither a count such as 3 nor a list such as 1,5.", param, ctx)
        return counts


class Place(click.ParamType["tuple[float, ...]"]):
    """A place on the floor, "2,1.5", or a place and a facing, "2,1.5,90"."""

    name = "place"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """Return x and z, and the facing if there is one."""
        try:
            place = tuple(float(word) for word in str(value).split(","))
        except ValueError:
            place = ()
        if len(place) not in (2, 3) or not all(map(math.isfinite, place)):
            self.fail(
                f"{value!r} is neither a place in metres such as 2,1.5 nor one with a facing: 2,1.5,90.", param, ctx
            )
        return place


class Area(click.ParamType["tuple[float, float]"]):
    """A width and a depth in metres, "8x6"."""

    name = "area"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        """Return the width and the depth."""
        parts = re.fullmatch(r"(\d{1,4}(?:\.\d{1,6})?)x(\d{1,4}(?:\.\d{1,6})?)", str(value), re.ASCII)
        if not parts:
            self.fail(f"{value!r} is not a width and a depth in metres such as 8x6.", param, ctx)
        return float(parts[1]), float(parts[2])


class Span(click.ParamType["tuple[int, int]"]):
    """The number of a posture, "10", or a range of postures, "10..14"."""

    name = "span"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Return the first and the last."""
        words = str(value).split("..")
        if any(map(_has_too_many_digits, words)):
            self.fail(f"{value} is too large.", param, ctx)
        if len(words) > 2 or not all(word.isdecimal() for word in words):
            self.fail(f"{value!r} is neither a posture's number such as 10 nor a range such as 10..14.", param, ctx)
        return int(words[0]), int(words[-1])


class Numbers(click.ParamType["tuple[int, ...] | str"]):
    """Numbers, "2" or "1,3", or "all"."""

    name = "numbers"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...] | str:
        """Return the numbers, or "all"."""
        words = str(value).split(",")
        if words == ["all"]:
            return "all"
        if any(map(_has_too_many_digits, words)):
            self.fail(f"{value} is too large.", param, ctx)
        if not all(word.isdecimal() for word in words):
            self.fail(f"{value!r} is neither a number such as 2, nor a list such as 1,3, nor all.", param, ctx)
        return tuple(map(int, words))


class Size(click.ParamType[int]):
    """A number of bytes, such as 200MB; units are powers of 1000."""

    name = "size"
    units: ClassVar[dict[str, int]] = {"": 1, "KB": 1000, "MB": 1000**2, "GB": 1000**3}

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number of bytes."""
        parts = re.fullmatch(r"(\d+(?:\.\d+)?) ?([KMG]B)?", str(value).strip(), re.IGNORECASE | re.ASCII)
        if not parts:
            self.fail(f"{value!r} is not a size such as 200MB.", param, ctx)
        size = float(parts[1]) * self.units[(parts[2] or "").upper()]
        if math.isinf(size):
            self.fail(f"{value} is too large.", param, ctx)
        return round(size)


class ClipFile(click.Path):
    """An existing file, or a clip of one, as in hero.glb#Walk."""

    def convert(self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path, with the name of the clip; fail with a usage error if there is no such file."""
        super().convert(split_clip(value)[0], param, ctx)
        return Path(value)


FILE = click.Path(dir_okay=False, readable=False, path_type=Path)
FILE_OR_FOLDER = click.Path(readable=False, path_type=Path)
EXISTING_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
EXISTING_CLIP = ClipFile(exists=True, dir_okay=False)
FOLDER = click.Path(file_okay=False, path_type=Path)
FRAME = FrameNumber()
COUNT = Whole(min=1)
NATURAL = Whole(min=0)
NATS = Number(min=0, max=1e6)  # as `motionmind.tween.request.MOST_NATS`
PORT = Whole(0, 65535)
POSITIVE = Number(min=0, min_open=True)
RATE = Number(min=0, min_open=True, max=10_000)  # as `motionmind.body.rates.MAX_FPS`
