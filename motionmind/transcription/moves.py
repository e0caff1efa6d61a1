"""The moves of a transcription: the first cells of a score's lines, which say how to reach a posture."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple


class Move(NamedTuple):
    """The move to a posture, as a score writes it.

    Attributes:
        counts: its duration, counts; "start" for the first posture.
        turn: turn from the facing before, degrees to the left, less than 180 to either side.
        face: facing after it, degrees to the left of the audience; None where `turn` says it.
        up: height of the posture's lowest point in the air, centimetres; 0 on the floor.
        left, ahead: its travel in the frame of the body, centimetres.
    """

    counts: str
    turn: int = 0
    face: int | None = None
    up: int = 0
    left: int = 0
    ahead: int = 0

    def mirrored(self) -> Move:
        """Return the mirror image."""
        face = None if self.face is None else -self.face
        return self._replace(turn=-self.turn, face=face, left=-self.left)

    def __str__(self) -> str:
        """Return the cell."""
        words = [self.counts]
        if self.face is not None:
            words.append(f"face {self.face}")
        if self.turn:
            words.append(f"turn {abs(self.turn)} {'left' if self.turn > 0 else 'right'}")
        if self.up:
            words.append(f"up {self.up}")
        if self.ahead or self.left:
            words.append("go")
        if self.ahead:
            words.append(f"{'ahead' if self.ahead > 0 else 'back'} {abs(self.ahead)}")
        if self.left:
            words.append(f"{'left' if self.left > 0 else 'right'} {abs(self.left)}")
        return " ".join(words)


def counts_of(frames: int, per_frame: float) -> str:
    """Write a duration in counts, as a fraction if that is exact.

    >>> counts_of(20, 1 / 30), counts_of(10, 1.7166 / 30)
    ('2/3', '0.57220')
    """
    exact = Fraction(frames * per_frame).limit_denominator(240)
    return str(exact) if abs(float(exact) - frames * per_frame) < 1e-9 else f"{frames * per_frame:.5f}"
