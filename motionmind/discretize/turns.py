"""Orientations as text: turns about named axes, one after another."""

from __future__ import annotations

import math
import re

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

_TURN = re.compile(r"([xyzXYZ])\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+))", re.ASCII)


def parse_turns(text: str) -> Floats:
    """Parse turns such as "x -90, y 45" into a unit quaternion [4].

    Turns are in degrees and intrinsic: each turns about an axis of the frame that the turns before have rotated. The
    empty text is the identity.

    Raises:
        ValueError: the text is not a list of turns, or a turn is by more than 360 degrees.
    """
    letters, angles = "", []
    for part in text.split(",") if text.strip() else []:
        match = _TURN.fullmatch(part.strip())
        if match is None:
            raise ValueError(f"{part.strip()!r} is not a turn; write an axis and degrees, such as 'x -90'")
        angle = float(match[2])
        if not abs(angle) <= 360.0:
            raise ValueError(f"{part.strip()!r} turns by more than 360 degrees")
        letters += match[1]
        angles.append(math.radians(angle))
    return rot.normalise(rot.from_euler(letters, np.array(angles)))


def format_turns(q: Floats) -> str | None:
    """Write a unit quaternion `q` [4] as the shortest turns; None if no turns in hundredths of a degree equal it.

    It is the inverse of `parse_turns` up to sign and 1e-9 radians.
    """
    tries = [""]
    for order in ("xyz", "yxz", "zxy", "xzy", "yzx", "zyx"):
        angles = np.degrees(rot.to_euler(order, q))
        turns = [f"{axis} {_number(angle)}" for axis, angle in zip(order, angles, strict=True) if _number(angle) != "0"]
        tries.append(", ".join(turns))
    for text in sorted(tries, key=len):
        if rot.angle(parse_turns(text), q) < 1e-9:
            return text
    return None


def _number(angle: float) -> str:
    text = f"{angle:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
