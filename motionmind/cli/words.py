"""Parsers of the words that are given to options which may be repeated: tolerances, mixtures, pins, ..."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from motionmind.errors import MotionMindError


def parse_tolerances(words: Sequence[str], default: float) -> tuple[float, dict[str, float]]:
    """Parse tolerances such as "15", for all joints, and "left_hip=10", for one.

    Args:
        words: as given to --tolerance.
        default: degrees for all joints if no word gives any.

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
        words: as given to --mix.

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
        words: as given to --pin.

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
        words: as given to --avoid.

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
        avoided.append((joint, int(state) if state.isdecimal() else state))
    return avoided


def parse_vias(words: Sequence[str]) -> list[tuple[Path, int | None]]:
    """Parse postures to pass through, such as "C.json", at any move, and "C.json@3", at move 3.

    Args:
        words: as given to --via.

    Returns:
        The file of each posture and its move.
    """
    vias: list[tuple[Path, int | None]] = []
    for word in words:
        name, _, move = word.rpartition("@")
        vias.append((Path(name), int(move)) if name and move.isdecimal() else (Path(word), None))
    return vias
