"""The directions of a body's bones, by which a score is compared with the recording."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.anatomy import Anatomy
from motionmind.geometry import rotations as rot

CM_PER_DEG = 0.5  # of tolerance: 6 degrees and 3 cm, the end of a bone of 29 cm


@dataclass(frozen=True, eq=False)
class Bones:
    """The bones of a body: from each joint to the joints below it, or to its tip.

    Attributes:
        body: the body.
        joints: the joint that turns each bone [B].
        ends: the point at its end [B]: a joint, or, from J on, a joint's tip.
    """

    body: Anatomy
    joints: Ints
    ends: Ints

    @classmethod
    def of(cls, body: Anatomy) -> Bones:
        """Return the bones of a body; those without a length have no direction, and are left out."""
        skeleton = body.skeleton
        pairs = [(int(parent), joint) for joint, parent in enumerate(skeleton.parents) if joint]
        pairs += [(j, len(skeleton) + j) for j in range(len(skeleton)) if not skeleton.children(j)]
        pairs = [pair for pair in pairs if np.linalg.norm(_offset(body, pair[1])) > 1e-6]
        joints, ends = np.array(pairs).T
        return cls(body, joints, ends)

    @cached_property
    def lengths(self) -> Floats:
        """The bones' lengths [B], metres."""
        return np.array([np.linalg.norm(_offset(self.body, int(end))) for end in self.ends])

    @cached_property
    def layers(self) -> dict[str, Ints]:
        """The bones of each layer of the body."""
        names = [self.body.anatomy(self.body.skeleton.names[joint])[0] for joint in self.joints]
        return {layer: np.flatnonzero([name in joints for name in names]) for layer, joints in self.body.layers.items()}

    def allowed(self, degrees: float) -> Floats:
        """Return the deviation of each bone that a tolerance allows [B], degrees.

        A short bone, as in hand and foot, may deviate until its end is off by as much as that of a longer one.
        """
        metres = 0.01 * CM_PER_DEG * degrees
        return np.maximum(degrees, np.degrees(np.arctan(metres / self.lengths)))

    def directions(self, rotations: Floats) -> Floats:
        """Return unit vectors along the bones [..., B, 3], for local rotations [..., J, 4]."""
        turned = self.body.skeleton.global_rotations(rotations)[..., self.joints, :]
        return rot.mul_vec(turned, self._along)

    @cached_property
    def _along(self) -> Floats:
        return np.array([_offset(self.body, int(end)) for end in self.ends]) / self.lengths[:, None]


def deviations(directions: Floats, others: Floats) -> Floats:
    """Return the angles between unit vectors [..., 3], degrees."""
    # By the chord: the arc cosine of a dot product near 1 would lose half of the digits.
    return np.asarray(2.0 * np.degrees(np.arcsin(np.clip(0.5 * rot.norm(directions - others), 0.0, 1.0))))


def _offset(body: Anatomy, point: int) -> Floats:
    """Return the place of a joint or tip in the frame of the joint that carries it [3], metres."""
    skeleton, count = body.skeleton, len(body.skeleton)
    return np.asarray(skeleton.offsets[point] if point < count else skeleton.tips[point - count])
