"""Test whether movement between two written postures follows a recording within the tolerance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.geometry import rotations as rot
from motionmind.transcription.bones import CM_PER_DEG
from motionmind.transcription.keys import fewest_keys
from motionmind.transcription.recorded import Recorded

LONGEST_MOVE_S = 3.0  # between two postures; a longer hold takes several lines
SLIDE_SHARE = 0.5  # of the tolerance, beyond which a standing foot's slip is written
N_CHUNK = 8192  # moves that are tested together


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
        longest: the most frames between two postures.
    """

    def __init__(self, recorded: Recorded, tolerance: float) -> None:
        self.recorded = recorded
        self.directions = recorded.bones.directions(recorded.writable)
        count = len(self.directions)
        self.poses = Poses(recorded.written.turned(), recorded.root, np.arange(count))
        # In radians along the chord, for the inner loop.
        self.allowed = 2.0 * np.sin(0.5 * np.radians(recorded.bones.allowed(tolerance)))
        self.metres = 0.01 * (1.0 - SLIDE_SHARE) * CM_PER_DEG * tolerance
        self.longest = max(1, round(LONGEST_MOVE_S * recorded.motion.fps)) if count > 1 else 1

    def fewest_keys(self, start: int, stop: int) -> Ints:
        """Return the fewest frames from `start` up to `stop`, both ends among them, between which all are followed.

        Of equally few, those where the body moves least.
        """
        part = self.directions[start:stop]
        speed = rot.norm(np.gradient(part, axis=0)).mean(axis=1) if len(part) > 1 else np.zeros(len(part))

        def follows(first: Ints, last: Ints, at: Ints) -> Bools:
            return self.follows(self.poses, first + start, last + start, at + start)

        return start + fewest_keys(len(part), self.longest, follows, speed)

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
