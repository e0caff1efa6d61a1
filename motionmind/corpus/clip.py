"""Clips of a corpus, what was mended of their recordings, and what is at fault there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Repair = Literal["put back", "reconstructed", "none"]

FLIP_DEG = 45.0  # default: a joint that turns farther in one frame is a fault of the recording
MIRRORED = " (mirrored)"  # after the name of a clip


@dataclass(frozen=True)
class JointRepair:
    """Frames of a recording in which a joint was mended.

    Attributes:
        joint: the joint.
        start: the first of the frames.
        stop: the frame after the last.
        seconds: times of the first and of the last of them, in the recording.
        exact: whether a half turn was undone; otherwise the joint was interpolated, and what it did is not known.
    """

    joint: str
    start: int
    stop: int
    seconds: tuple[float, float]
    exact: bool


@dataclass(frozen=True)
class Clip:
    """One unbroken stretch of movement: postures `start` to `stop - 1` of the corpus.

    Attributes:
        name: the recording's name, or that of a part of it.
        start: index of its first posture.
        stop: index after its last posture.
        about: a one-line description.
        corpus: the corpus that it was taken from; "" for this one.
        weight: count of each of its postures and moves; the heaviest clip has 1.
        mirrored: whether left and right are exchanged.
        reverse: the price, in nats per move, of learning it backwards too; None if it is not.
        repairs: what was mended of its recording.
        performer: who performs it; "" if that is not known, or is the corpus's author.
    """

    name: str
    start: int
    stop: int
    about: str = ""
    corpus: str = ""
    weight: float = 1.0
    mirrored: bool = False
    reverse: float | None = None
    repairs: tuple[JointRepair, ...] = ()
    performer: str = ""

    def __len__(self) -> int:
        return self.stop - self.start

    @property
    def label(self) -> str:
        """The name with its corpus and whether it is mirrored: "ballet: jump (mirrored)"."""
        return f"{self.corpus}: " * bool(self.corpus) + self.name + MIRRORED * self.mirrored

    @property
    def reverse_weight(self) -> float:
        """Count of each of its moves backwards; 0 if it is not learned backwards."""
        return 0.0 if self.reverse is None else self.weight * math.exp(-self.reverse)

    def is_reconstructed(self, joint: str, start: float, stop: float) -> bool:
        """Return whether a joint was interpolated somewhere from one time of the recording to another, seconds."""
        return any(
            repair.joint == joint and not repair.exact and repair.seconds[0] <= stop and start <= repair.seconds[1]
            for repair in self.repairs
        )


@dataclass(frozen=True)
class JointFlip:
    """A fault of a recording: a joint turns by `degrees` up to `frame` from the one before, faster than a body can.

    Attributes:
        clip: the recording's name.
        joint: the joint.
        frame: the first frame after the flip.
        degrees: its angle.
        repair: "put back" if a half turn was undone, "reconstructed" if the joint was interpolated, "none" if the flip
            was left as it is, or the recording cut there.
    """

    clip: str
    joint: str
    frame: int
    degrees: float
    repair: Repair = "none"
