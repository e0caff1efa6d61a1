"""The rig of a file: its bones, and what another file of its kind needs to hold other movement on them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from motionmind.body.motion import Motion
from motionmind.files import FilePath
from motionmind.geometry import rotations as rot
from motionmind.retarget.armature import Armature, Pose

# Lengths of bones differ by less in takes of one person, where joints move a little against their parents.
_SAME_BONE_M = 5e-3
_SAME_AXES_RAD = 1e-3


@dataclass(frozen=True, eq=False)
class RigFile(ABC):
    """The bones of a file, and what a new file of its kind repeats.

    Attributes:
        path: the file.
        names: the bones' names [N].
        armature: the bones.
        unit: metres in one unit of the file.
    """

    path: FilePath
    names: tuple[str, ...]
    armature: Armature
    unit: float
    suffix: ClassVar[str]  # of the files that it writes

    @abstractmethod
    def write(self, path: FilePath, pose: Pose, motion: Motion) -> None:
        """Write a file with these bones in another pose.

        Args:
            path: the file.
            pose: of the bones in each frame.
            motion: the motion that the pose came from, for its times, name and insertions, evenly spaced in time.
        """

    def is_like(self, other: RigFile) -> bool:
        """Return whether another file has the same bones, of the same lengths and axes."""
        if (self.suffix, self.names, self.armature.parents) != (other.suffix, other.names, other.armature.parents):
            return False
        ours, theirs = self.armature, other.armature
        ours_body, theirs_body = ours.motion.skeleton, theirs.motion.skeleton
        return (
            ours_body.names == theirs_body.names
            and bool(np.all(np.abs(ours_body.offsets - theirs_body.offsets) < _SAME_BONE_M))
            and bool(np.all(rot.angle(ours.rest, theirs.rest) < _SAME_AXES_RAD))
            and np.allclose(ours.scales, theirs.scales, rtol=1e-3)
        )

    def with_ends_of(self, start: RigFile | None, end: RigFile | None) -> Self:
        """Return this rig with the first pose of one file and the last of another, as far as they have its bones."""
        first, last = (one.armature if one is not None and self.is_like(one) else None for one in (start, end))
        return replace(self, armature=self.armature.with_ends_of(first, last))
