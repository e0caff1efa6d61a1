"""Parsers of the words that are given to options which may be repeated: tolerances, mixtures, pins, ..."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from motionmind.errors import MotionMindError

_FRAME = r"-?\d{1,9}"  # a number with more digits is a slip of the keyboard


class NamedPosture(NamedTuple):
    """A posture as a command names it.

    Attributes:
        word: its name, for messages.
        file: the file that holds it.
        frame: its frame, counted from 0, or from the end if negative; None if the file has only one.
        is_moving: whether the movement around it counts, too.
    """

    word: str
    file: Path
    frame: int | None
    is_moving: bool


class NamedFrames(NamedTuple):
    """Frames as a command names them: a file, the first and the last of its frames, negative if from the end."""

    file: Path
    first: int
    last: int


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
        avoided.append((joint, int(state) if re.fullmatch(r"\d{1,9}", state, re.ASCII) else state))
    return avoided


def parse_posture(word: str) -> NamedPosture:
    """Parse a posture such as "A.json", "clip.bvh@240", or "clip.bvh@240~", with the movement around it.

    A file that has the whole name goes first, since a file's name may hold @, too.
    """
    found = re.fullmatch(rf"(.+?)(?:@({_FRAME}))?(~?)", word, re.ASCII | re.DOTALL)
    if found is None or _exists(word):
        return NamedPosture(word, Path(word), None, is_moving=False)
    file, frame, tilde = found.groups()
    return NamedPosture(word, Path(file), None if frame is None else int(frame), bool(tilde))


def parse_frames(word: str) -> NamedFrames:
    """Parse frames such as "clip.bvh@230..240", both included, or "clip.bvh", all of them.

    Raises:
        MotionMindError: the word names neither a file nor frames of one.
    """
    found = re.fullmatch(rf"(.+)@({_FRAME})\.\.({_FRAME})", word, re.ASCII | re.DOTALL)
    if found and not _exists(word):
        return NamedFrames(Path(found[1]), int(found[2]), int(found[3]))
    if "@" in Path(word).name and not _exists(word):
        raise MotionMindError(f"{word}: give a file, or frames of one such as clip.bvh@230..240")
    return NamedFrames(Path(word), 0, -1)


def parse_vias(words: Sequence[str]) -> list[tuple[NamedPosture, int | None]]:
    """Parse postures to pass through: "C.json", at any move, "C.json@3", at move 3; "clip.bvh@150@3" and
    "clip.bvh@150@" are frame 150 at move 3 and at any.

    Args:
        words: as given to --via.

    Returns:
        Each posture and its move.

    Raises:
        MotionMindError: a frame is given without an @ for the move, or a posture is to move.
    """
    vias: list[tuple[NamedPosture, int | None]] = []
    for word in words:
        name, _, move = word.rpartition("@")
        has_place = bool(name and re.fullmatch(r"\d{0,9}", move, re.ASCII)) and not _exists(word)
        posture = parse_posture(name if has_place else word)
        if posture.is_moving or (posture.frame is not None and not has_place):
            raise MotionMindError(
                f"--via {word}: give a posture and its move, as C.json@3 or clip.bvh@150@3, or clip.bvh@150@ for any "
                "move; it is passed without a velocity of its own"
            )
        vias.append((posture, int(move) if has_place and move else None))
    return vias


def _exists(word: str) -> bool:
    return os.path.exists(word)  # noqa: PTH110 - Path.exists fails for names that are too long for any file
