"""What the command line's options are made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

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


FILE = click.Path(dir_okay=False, readable=False, path_type=Path)
EXISTING = click.Path(exists=True, dir_okay=False, path_type=Path)
FOLDER = click.Path(file_okay=False, path_type=Path)
COUNT = click.IntRange(min=1)
NATS = Number(min=0)
OUTPUTS = "movement (.json, .bvh, .glb, .npz), a picture or film (.png, .gif, .mp4, .svg), or a page (.html)"
RATE = Number(min=0, min_open=True, max=10_000)  # as `motionmind.motion.FASTEST`

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
