"""What the command line's options are made of."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import click

from motionmind.errors import MotionMindError

_Command = TypeVar("_Command", bound=Callable[..., Any])


class InOrder(click.Group):
    """Commands in the order in which a user comes to need them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Their names."""
        return list(self.commands)


class Number(click.FloatRange):
    """A finite number in a range."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number; a usage error where it is none."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


class Moves(click.ParamType["int | tuple[int, int]"]):
    """A number of moves, "8", or a range of it, "6..10"."""

    name = "moves"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | tuple[int, int]:
        """The number, or the least and the greatest."""
        words = str(value).split("..")
        if len(words) > 2 or not all(word.isdecimal() and int(word) > 0 for word in words):
            self.fail(f"{value!r} is no number of moves such as 8, and no range such as 6..10.", param, ctx)
        least, most = int(words[0]), int(words[-1])
        if least > most:
            self.fail(f"{value!r} ends before it begins.", param, ctx)
        return least if len(words) == 1 else (least, most)


class Point(click.ParamType["tuple[float, ...]"]):
    """Coordinates, "0.01" or "1,1,20"."""

    name = "point"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """The numbers."""
        try:
            found = tuple(float(word) for word in str(value).split(","))
        except ValueError:
            found = ()
        if not (found and all(map(math.isfinite, found))):
            self.fail(f"{value!r} is no number such as 0.01, and no point such as 1,1,20.", param, ctx)
        return found


class Span(click.ParamType["tuple[int, int]"]):
    """A posture's number, "10", or the first and the last of several, "10..14"."""

    name = "span"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """The first and the last."""
        words = str(value).split("..")
        if len(words) > 2 or not all(word.isdecimal() for word in words):
            self.fail(f"{value!r} is no posture's number such as 10, and no range such as 10..14.", param, ctx)
        return int(words[0]), int(words[-1])


class Numbers(click.ParamType["tuple[int, ...] | str"]):
    """Numbers, "2" or "1,3", or "all"."""

    name = "numbers"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...] | str:
        """The numbers, or "all"."""
        words = str(value).split(",")
        if words == ["all"]:
            return "all"
        if not all(word.isdecimal() for word in words):
            self.fail(f"{value!r} is no number such as 2, no list such as 1,3, and not all.", param, ctx)
        return tuple(map(int, words))


class Size(click.ParamType[int]):
    """Bytes, as 200MB; units are powers of 1000."""

    name = "size"
    units: ClassVar[dict[str, int]] = {"": 1, "KB": 1000, "MB": 1000**2, "GB": 1000**3}

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """The number of bytes."""
        found = re.fullmatch(r"(\d+(?:\.\d+)?) ?([KMG]B)?", str(value).strip(), re.IGNORECASE | re.ASCII)
        if not found:
            self.fail(f"{value!r} is no size such as 200MB.", param, ctx)
        return round(float(found[1]) * self.units[(found[2] or "").upper()])


FILE = click.Path(dir_okay=False, readable=False, path_type=Path)
ANY = click.Path(readable=False, path_type=Path)  # a file or a folder
EXISTING = click.Path(exists=True, dir_okay=False, path_type=Path)
FOLDER = click.Path(file_okay=False, path_type=Path)
COUNT = click.IntRange(min=1)
NATS = Number(min=0)
OUTPUTS = "movement (.json, .bvh, .glb, .npz), a picture or film (.png, .gif, .mp4, .svg), or a page (.html)"
RATE = Number(min=0, min_open=True, max=10_000)  # as `motionmind.body.motion.FASTEST`

HOME = click.option(
    "--home",
    type=FOLDER,
    envvar="MOTIONMIND_HOME",
    show_envvar=True,
    help="Folder of the corpora that you built  [default: the platform's data directory]",
)
JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON.")


def reading(command: _Command) -> _Command:
    """Options of the commands that read movement."""
    for option in (
        click.option(
            "--source-fps", type=RATE, help="Frames a second of formats that do not say  [default: .amc 120, .txt 1]"
        ),
        click.option("--asf", type=EXISTING, help="AMC's skeleton  [default: the one beside it]"),
        click.option(
            "--unit",
            metavar="UNIT",
            help="BVH's unit of length: m, cm, mm, dm, in, ft, cmu, or metres in "
            "one  [default: told from the body's height]",
        ),
        click.option("--joints", type=FILE, help="Whose joints they are: a TOML or JSON file, your joint = human23's."),
    ):
        command = option(command)
    return command


def searching(command: _Command) -> _Command:
    """Options of the commands that ask the engine for movement, which `Engine.tween` explains."""
    for option in reversed(
        (
            click.option(
                "--moves",
                type=Moves(),
                metavar="N",
                help="Number of moves, or a range, 6..10  [default: the search finds it]",
            ),
            click.option(
                "--max-moves", type=COUNT, metavar="N", default=60, help="Greatest number of moves that it may find."
            ),
            click.option(
                "--duration",
                type=Number(min=0, min_open=True),
                metavar="SECONDS",
                help="How long it lasts; and so how many moves.",
            ),
            click.option(
                "--pin",
                multiple=True,
                metavar="JOINT[=B]",
                help="In A's state until the last move; =B: in B's from the first on.",
            ),
            click.option(
                "--hold",
                multiple=True,
                metavar="JOINTS",
                help="In their state all the way, where A and B agree; with commas between.",
            ),
            click.option(
                "--avoid", multiple=True, metavar="JOINT=STATE", help="Not in this state on the way, by number or name."
            ),
            click.option(
                "--via",
                multiple=True,
                metavar="FILE[@N]",
                help="A posture to pass through, at move N or any; several in order.",
            ),
            click.option(
                "--diversity",
                type=NATS,
                default=2.0,
                help="Nats for each joint's move that an alternative shares with one before.",
            ),
            click.option(
                "--sample", is_flag=True, help="Draw a path at random, the likelier the cheaper, instead of the best."
            ),
            click.option("--seed", type=click.IntRange(min=0), metavar="N", default=0, help="What it is drawn by."),
            click.option("--strict", is_flag=True, help="No bridges: only moves that the corpus attests."),
            click.option(
                "--posturewise", is_flag=True, help="Only whole postures in the order of the corpus, as in 1998."
            ),
            click.option(
                "--node-budget",
                type=COUNT,
                metavar="N",
                help="Nodes that the search may hold at once  [default: 200000]",
            ),
            click.option(
                "--memory", type=Size(), metavar="SIZE", help="What these may take, as 200MB, instead of their number."
            ),
            click.option(
                "--weights",
                type=click.Choice(["conditional", "printed"]),
                default="conditional",
                help="How transitions weigh.",
            ),
            click.option(
                "--novelty",
                type=Number(min=0, max=1),
                default=0.0,
                help="0: the frequent is cheap; 1: all that is attested alike.",
            ),
            click.option(
                "--coordination",
                type=click.Choice(["posture", "progression", "none"]),
                default="posture",
                help="How joints coordinate.",
            ),
            click.option("--lambda", "lambda_", type=NATS, default=1.0, help="Factor of what that costs."),
            click.option("--beta", type=NATS, default=1.0, help="Nats for each move that a joint waits at its goal."),
            click.option("--tau", type=NATS, default=1.0, help="Nats for each move."),
            click.option("--bridge-price", type=NATS, default=1.0, help="Nats for each degree of an unattested move."),
            click.option("--fps", type=RATE, default=30.0, help="Frames a second of the motion."),
            click.option(
                "--follow/--mean",
                default=None,
                help="The motion keeps to the path's states, or is the mean of the corpus's ways  [default: --mean, "
                "unless more than a length is asked of the path]",
            ),
        )
    ):
        command = option(command)
    return command


def example(line: str) -> str:
    """An epilog that is not wrapped, so that it can be copied."""
    return f"\b\nExample:\n  {line}"


def tolerances(given: Sequence[str], default: float) -> tuple[float, dict[str, float]]:
    """The tolerance for all joints, `default` if none is given, and those of single ones: "15", "left_hip=10"."""
    per_joint: dict[str, float] = {}
    for word in given:
        joint, equals, degrees = word.rpartition("=")
        try:
            value = float(degrees if joint or not equals else "")
        except ValueError:
            raise MotionMindError(f"--tolerance {word}: give degrees, or JOINT=DEGREES such as left_hip=10") from None
        if joint:
            per_joint[joint] = value
        else:
            default = value
    return default, per_joint


def mixture(given: Sequence[str]) -> dict[str, float]:
    """What the corpora to mix weigh, from words such as "ballet" and "ballet:0.3"; a path may have colons too."""
    found: dict[str, float] = {}
    for word in given:
        name, colon, weight = word.rpartition(":")
        try:
            corpus, value = (name, float(weight)) if colon else (word, 1.0)
        except ValueError:
            raise MotionMindError(f"--mix {word}: give a corpus and its weight, such as ballet:0.3") from None
        if corpus in found:
            raise MotionMindError(f"--mix {word}: {corpus} is given twice")
        found[corpus] = value
    return found


def settings(given: Sequence[str]) -> dict[str, float]:
    """What a flow's parameters are, from words such as "rho=28"."""
    found: dict[str, float] = {}
    for word in given:
        name, equals, value = word.partition("=")
        try:
            found[name] = float(value if equals else "")
        except ValueError:
            raise MotionMindError(f"--parameter {word}: give NAME=VALUE, such as rho=28") from None
    return found


def pins(given: Sequence[str]) -> dict[str, str]:
    """Which joint is pinned to which end, from words such as "left_wrist", to A, and "left_wrist=B"."""
    found: dict[str, str] = {}
    for word in given:
        joint, equals, end = word.partition("=")
        if end not in ("A", "B") and equals:
            raise MotionMindError(f"--pin {word}: give JOINT or JOINT=A for A's state, JOINT=B for B's")
        if found.setdefault(joint, end or "A") != (end or "A"):
            raise MotionMindError(f"--pin {word}: {joint} is pinned to A and to B")
    return found


def avoided(given: Sequence[str]) -> list[tuple[str, int | str]]:
    """Joints and the states that they avoid, from words such as "left_hip=7" and "left_hip=passe"."""
    found: list[tuple[str, int | str]] = []
    for word in given:
        joint, _, state = word.partition("=")
        if not state:
            raise MotionMindError(f"--avoid {word}: give JOINT=STATE, such as left_hip=7")
        found.append((joint, int(state) if state.isdecimal() else state))
    return found


def passing(given: Sequence[str]) -> list[tuple[Path, int | None]]:
    """Files of postures to pass through and the moves at which, from words such as "C.json" and "C.json@3"."""
    found: list[tuple[Path, int | None]] = []
    for word in given:
        name, _, move = word.rpartition("@")
        found.append((Path(name), int(move)) if name and move.isdecimal() else (Path(word), None))
    return found


def numbered(path: Path, number: int, of: int | None) -> Path:
    """The file of one of several tweens: "out.json" becomes "out-1.json"; as it is for a single one."""
    return path if of is None else path.with_stem(f"{path.stem}-{number}")
