"""Test whether movement between two written postures follows a recording within the tolerance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.arguments import check_real
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.transcription import LONGEST_MOVE_S, TOLERANCE_RANGE_DEG
from motionmind.transcription.bones import CM_PER_DEG
from motionmind.transcription.keys import fewest_keys
from motionmind.transcription.recorded import Recorded

SLIDE_SHARE = 0.5  # of the tolerance, beyond which a standing foot's slip is written
N_CHUNK = 8192  # moves that are tested together


def check_fineness(tolerance: float, shortest: float) -> None:
    """Check the tolerance, degrees, and the least seconds from posture to posture; MotionMindError if out of range."""
    check_real("tolerance", tolerance)
    check_real("shortest", shortest)
    least, most = TOLERANCE_RANGE_DEG
    if not least <= tolerance <= most:
        raise MotionMindError(f"a tolerance must be from {least:g} to {most:g} degrees, not {tolerance:g}")
    if not 0.0 <= shortest <= LONGEST_MOVE_S:
        raise MotionMindError(f"the shortest move must take from 0 to {LONGEST_MOVE_S:g} s, not {shortest:g}")


class Poses(NamedTuple):
    """Written postures.

    Attributes:
        turned: local rotations in the world [N, J, 4].
        root: places of the pelvis [N, 3], metres.
        frames: their frames in the recording [N].
    """

    turned: Floats
    root: Floats
    frames: Ints


class Following:
    """The test of movement between postures, each bone turning evenly.

    Attributes:
        recorded: the recording, with T frames.
        directions: of its bones, as the notation could write them at best [T, B, 3].
        poses: its frames as they are written.
        allowed: length of the chord between two directions of a bone that the tolerance allows [B].
        metres: allowed distance of the pelvis.
        shortest: the fewest frames between two postures.
        longest: the most.
    """

    def __init__(self, recorded: Recorded, tolerance: float, shortest: float = 0.0) -> None:
        self.recorded = recorded
        self.directions = recorded.bones.directions(recorded.writable)
        count = len(self.directions)
        self.poses = Poses(recorded.written.turned(), recorded.root, np.arange(count))
        # In radians along the chord, for the inner loop.
        self.allowed = 2.0 * np.sin(0.5 * np.radians(recorded.bones.allowed(tolerance)))
        self.metres = 0.01 * (1.0 - SLIDE_SHARE) * CM_PER_DEG * tolerance
        fps = recorded.motion.fps if count > 1 else 1.0
        self.shortest, self.longest = (max(1, round(seconds * fps)) for seconds in (shortest, LONGEST_MOVE_S))

    def fewest_keys(self, start: int, stop: int) -> Ints:
        """Return the fewest frames from `start` up to `stop`, both ends among them, between which all are followed.

        Of equally few, those where the body moves least.
        """
        part = self.directions[start:stop]
        speed = rot.norm(np.gradient(part, axis=0)).mean(axis=1) if len(part) > 1 else np.zeros(len(part))

        def follows(first: Ints, last: Ints, at: Ints) -> Bools:
            return self.follows(self.poses, first + start, last + start, at + start)

        return start + fewest_keys(len(part), self.longest, follows, speed, self.shortest)

    def follows(self, poses: Poses, first: Ints, last: Ints, at: Ints) -> Bools:
        """Return whether movement from posture `first` to posture `last` of `poses` follows frame `at`, all [N]."""
        share = ((at - poses.frames[first]) / (poses.frames[last] - poses.frames[first]))[:, None]
        place = poses.root[first] + share * (poses.root[last] - poses.root[first])
        out = rot.norm(place - self.recorded.root[at]) <= self.metres
        near = np.flatnonzero(out)
        for begin in range(0, len(near), N_CHUNK):
            part = near[begin : begin + N_CHUNK]
            between = rot.slerp(poses.turned[first[part]], poses.turned[last[part]], share[part])
            off = rot.norm(self.recorded.bones.directions(between) - self.directions[at[part]])
            out[part] = (off <= self.allowed).all(axis=1)
        return np.asarray(out)
