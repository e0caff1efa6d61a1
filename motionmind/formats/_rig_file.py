"""The rig of a file, as a file of the same kind with other movement needs it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from motionmind.body.motion import Motion
from motionmind.files import FilePath
from motionmind.retarget.armature import Armature, Pose

# Lengths of bones differ by less in takes of one person, where joints move a little against their parents.
_SAME_BONE_M = 5e-3


@dataclass(frozen=True, eq=False)
class RigFile(ABC):
    """The bones of a file, and all else that a file of its kind with other movement keeps.

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
        """Return whether another file has the same bones, of the same lengths."""
        if (self.suffix, self.names, self.armature.parents) != (other.suffix, other.names, other.armature.parents):
            return False
        ours, theirs = (one.armature.motion.skeleton for one in (self, other))
        return ours.names == theirs.names and bool(np.all(np.abs(ours.offsets - theirs.offsets) < _SAME_BONE_M))

    def with_ends_of(self, start: RigFile | None, end: RigFile | None) -> Self:
        """Return this rig with the first pose of one file and the last of another, as far as they have its bones."""
        first, last = (one.armature if one is not None and self.is_like(one) else None for one in (start, end))
        return replace(self, armature=self.armature.with_ends_of(first, last))
