"""Parsers of the values of repeatable options: tolerances, mixtures, pins, ..."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

from motionmind.errors import MotionMindError
from motionmind.names.spelling import PostureName, is_file, parse_posture


def parse_tolerances(words: Sequence[str], default: float) -> tuple[float, dict[str, float]]:
    """Parse tolerances such as "15", for all joints, and "left_hip=10", for one.

    Args:
        words: values of --tolerance.
        default: degrees for all joints if no value sets them.

    Returns:
        Degrees for all joints, and those of single joints.

    Raises:
        MotionMindError: a word holds no degrees.
    """
    per_joint: dict[str, float] = {}
    for word in words:
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


def parse_mixture(words: Sequence[str]) -> dict[str, float]:
    """Parse corpora to mix, such as "ballet", of weight 1, and "ballet:0.3"; a path may hold colons, too.

    Args:
        words: values of --mix.

    Returns:
        Each corpus's weight.

    Raises:
        MotionMindError: a weight is not a number, or a corpus is given twice.
    """
    weights: dict[str, float] = {}
    for word in words:
        name, colon, weight = word.rpartition(":")
        try:
            corpus, value = (name, float(weight)) if colon else (word, 1.0)
        except ValueError:
            raise MotionMindError(f"--mix {word}: give a corpus and its weight, such as ballet:0.3") from None
        if corpus in weights:
            raise MotionMindError(f"--mix {word}: {corpus} is given twice")
        weights[corpus] = value
    return weights


def parse_parameters(words: Sequence[str]) -> dict[str, float]:
    """Parse parameters of a flow, such as "rho=28".

    Args:
        words: as given to --parameter.

    Returns:
        Each parameter's value.

    Raises:
        MotionMindError: a word is not NAME=VALUE.
    """
    values: dict[str, float] = {}
    for word in words:
        name, equals, value = word.partition("=")
        try:
            values[name] = float(value if equals else "")
        except ValueError:
            raise MotionMindError(f"--parameter {word}: give NAME=VALUE, such as rho=28") from None
    return values


def parse_pins(words: Sequence[str]) -> dict[str, str]:
    """Parse pinned joints, such as "left_wrist", to A, and "left_wrist=B".

    Args:
        words: values of --pin.

    Returns:
        The end, "A" or "B", that each joint is pinned to.

    Raises:
        MotionMindError: there is no such end, or a joint is pinned to both.
    """
    ends: dict[str, str] = {}
    for word in words:
        joint, equals, end = word.partition("=")
        if end not in ("A", "B") and equals:
            raise MotionMindError(f"--pin {word}: give JOINT or JOINT=A for A's state, JOINT=B for B's")
        if ends.setdefault(joint, end or "A") != (end or "A"):
            raise MotionMindError(f"--pin {word}: {joint} is pinned to A and to B")
    return ends


def parse_avoided(words: Sequence[str]) -> list[tuple[str, int | str]]:
    """Parse states to avoid, such as "left_hip=7" and "left_hip=passe".

    Args:
        words: values of --avoid.

    Returns:
        Joints, each with a state by its number or name.

    Raises:
        MotionMindError: a word is not JOINT=STATE.
    """
    avoided: list[tuple[str, int | str]] = []
    for word in words:
        joint, _, state = word.partition("=")
        if not state:
            raise MotionMindError(f"--avoid {word}: give JOINT=STATE, such as left_hip=7")
        avoided.append((joint, int(state) if re.fullmatch(r"\d{1,9}", state, re.ASCII) else state))
    return avoided


def parse_reaches(words: Sequence[str]) -> list[tuple[str, tuple[float, ...], float]]:
    """Parse places for joints, such as "right_wrist=0.3,1.4,0.5@1.2s".

    Args:
        words: values of --reach.

    Returns:
        Each joint, its place in metres and its time in seconds.

    Raises:
        MotionMindError: a word is not JOINT=X,Y,Z@SECONDS.
    """
    reaches: list[tuple[str, tuple[float, ...], float]] = []
    for word in words:
        joint, _, rest = word.partition("=")
        place, _, seconds = rest.partition("@")
        try:
            numbers = *map(float, place.split(",")), float(seconds.removesuffix("s"))
        except ValueError:
            numbers = ()
        if not joint or len(numbers) != 4 or not all(map(math.isfinite, numbers)):
            raise MotionMindError(
                f"--reach {word}: give a joint, its place in metres and the seconds from A, such as "
                "right_wrist=0.3,1.4,0.5@1.2s"
            )
        reaches.append((joint, numbers[:3], numbers[3]))
    return reaches


def parse_vias(words: Sequence[str], home: Path | None = None) -> list[tuple[PostureName, int | str | None]]:
    """Parse postures to pass through: "C.json", after any move, "C.json@3", after move 3, and "C.json@count4", on
    count 4; "clip.bvh@150@3" and "clip.bvh@150@" are frame 150 after move 3 and after any.

    Args:
        words: values of --via.
        home: the folder of the user's corpora; None for the default folder.

    Returns:
        Each posture and its move, or its count as "count 4".

    Raises:
        MotionMindError: a frame's number is given without an @ for the move, or a posture is to move.
    """
    vias: list[tuple[PostureName, int | str | None]] = []
    for word in words:
        name, _, move = word.rpartition("@")
        counted = re.fullmatch(r"count(\d{1,6}(?:\.\d{1,6})?)", move, re.ASCII)
        has_place = bool(name and (counted or re.fullmatch(r"\d{0,9}", move, re.ASCII))) and not is_file(word)
        posture = parse_posture(name if has_place else word, home)
        is_ambiguous = posture.moment is not None and posture.moment.seconds is None and not has_place
        if posture.is_moving or is_ambiguous:
            raise MotionMindError(
                f"--via {word}: give a posture and its move, as C.json@3 or clip.bvh@150@3, or clip.bvh@150@ for any "
                "move; it is passed without a velocity of its own"
            )
        if has_place and counted:
            vias.append((posture, f"count {counted[1]}"))
        else:
            vias.append((posture, int(move) if has_place and move else None))
    return vias
