"""Writes BVH on the skeleton of another BVH file: its hierarchy word for word, its channels in their orders."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.errors import FormatError
from motionmind.files import FilePath, name_of, write_atomically
from motionmind.formats._bvh_file import assemble, read_body
from motionmind.formats._bvh_hierarchy import BvhJoint
from motionmind.formats._bvh_rig import normalise, resolve_places
from motionmind.formats._rig_file import RigFile
from motionmind.formats.bvh import frame_lines
from motionmind.formats.units import guess_unit, metres_per_unit
from motionmind.geometry import rotations as rot
from motionmind.retarget.armature import Armature, Pose

_MIN_COS_UNLOCKED = 1e-9  # of the middle angle, as in `to_euler`


@dataclass(frozen=True, eq=False)
class BvhRigFile(RigFile):
    """The rig of a BVH file.

    Attributes:
        hierarchy: the lines above MOTION.
        bvh_joints: the joints in them, with their channels.
        adds: whether the file adds position channels to OFFSETs.
        first: values of all channels in the frame before the movement to come [C].
    """

    hierarchy: tuple[str, ...]
    bvh_joints: tuple[BvhJoint, ...]
    adds: bool
    first: Floats
    suffix: ClassVar[str] = ".bvh"

    def with_ends_of(self, start: RigFile | None, end: RigFile | None) -> Self:
        """Return this rig with the first pose of one file and the last of another."""
        rig = super().with_ends_of(start, end)
        if not (isinstance(start, BvhRigFile) and rig.armature.is_known[0]):
            return rig
        channels, theirs = ([joint.channels for joint in one.bvh_joints] for one in (self, start))
        return replace(rig, first=start.first) if channels == theirs else rig

    def write(self, path: FilePath, pose: Pose, motion: Motion) -> None:
        """Write the rig in another pose: rotations agree to 1e-6 rad and positions to 1e-8 m.

        Angles continue from those in the file's frame, without jumps. Joints with fewer than three rotation channels
        come as near as these let them; the joints below keep their orientations.

        Raises:
            MotionMindError: the times are not even, or the file cannot be written.
        """
        scale = 1.0 / self.unit
        wanted, _, _ = self.armature.global_frames(pose)
        held = wanted.copy()
        columns: list[Floats] = []
        is_angle: list[bool] = []
        for joint, one in enumerate(self.bvh_joints):
            above = held[:, one.parent] if one.parent >= 0 else np.tile(rot.IDENTITY, (len(motion), 1))
            order = rotation_order(one)
            angles = self._angles(joint, len(columns), rot.inv_mul(above, wanted[:, joint]))
            if len(order) < 3:
                held[:, joint] = rot.mul(above, rot.from_euler(order, angles)) if order else above
            turns = iter(np.degrees(angles).T)
            place = pose.translations[:, joint] * scale
            if self.adds and joint:
                place = place - np.array(one.offset)
            for channel in one.channels:
                is_angle.append(channel.endswith("ROTATION"))
                columns.append(next(turns) if is_angle[-1] else place[:, "XYZ".index(channel[0])])
        lines = [*self.hierarchy, "MOTION", *frame_lines(motion, np.stack(columns, axis=1), np.array(is_angle), scale)]
        write_atomically(path, ("\n".join(lines) + "\n").encode())

    def _angles(self, joint: int, column: int, turns: Floats) -> Floats:
        """Return the values of a joint's rotation channels [T, channels], radians.

        Args:
            joint: the joint.
            column: index of its first channel among all joints' channels.
            turns: its local rotations [T, 4].
        """
        one = self.bvh_joints[joint]
        at = [column + i for i, channel in enumerate(one.channels) if channel.endswith("ROTATION")]
        order = rotation_order(one)
        first = np.zeros(3)
        first[: len(at)] = np.radians(self.first[at])
        whole = order + "".join(axis for axis in "XYZ" if axis not in order)
        return _continue_angles(rot.to_euler(whole, turns), first, whole)[:, : len(at)]


def rotation_order(joint: BvhJoint) -> str:
    """Return the axes of a joint's rotation channels, in their order."""
    return "".join(channel[0] for channel in joint.channels if channel.endswith("ROTATION"))


def _continue_angles(angles: Floats, first: Floats, order: str) -> Floats:
    """Return the same rotations by Euler angles [T, 3], each nearest to the one before, first to `first`."""
    out = np.empty_like(angles)
    for frame, own in enumerate(angles):
        first = out[frame] = nearest_angles(own, first, order)
    return out


def nearest_angles(angles: Floats, near: Floats, order: str) -> Floats:
    """Return the same rotations by the Euler angles [..., 3] that are nearest to others, `near` [..., 3].

    Two triples of angles within a turn give the same rotation: the second has the outer ones half a turn further, and
    the middle one mirrored at a right angle. At gimbal lock only the sum of the outer ones counts, or their difference.
    """
    first, middle, last = np.moveaxis(angles, -1, 0)
    side = np.sign(middle) * (1.0 if order in "XYZXY" else -1.0)
    off = 0.5 * _nearest_turn(first + side * (last - near[..., 2]) - near[..., 0])
    together = np.stack([near[..., 0] + off, middle, near[..., 2] + side * off], axis=-1)
    own = np.where((np.cos(middle) < _MIN_COS_UNLOCKED)[..., None], together, angles)
    other = np.stack([first + np.pi, np.pi - middle, last + np.pi], axis=-1)
    own, other = (near + _nearest_turn(one - near) for one in (own, other))
    is_other = np.abs(other - near).sum(axis=-1) < np.abs(own - near).sum(axis=-1)
    return np.where(is_other[..., None], other, own)


def _nearest_turn(angles: Floats) -> Floats:
    """Return angles plus whole turns, between half a turn back and half a turn on."""
    return np.asarray(angles - 2.0 * np.pi * np.round(angles / (2.0 * np.pi)))


def read_bvh_rig(
    path: FilePath,
    motion: Motion,
    frames: tuple[int, int] | None,
    unit: str | float | None = None,
    clip: str | None = None,
) -> BvhRigFile:
    """Read the rig of a BVH file.

    Args:
        path: the file.
        motion: its movement, as `read_bvh` returns it with the same unit.
        frames: those before and after the movement to come; None if they are not of this file.
        unit: as for `read_bvh`.
        clip: as for `read_bvh`.

    Raises:
        FormatError: a joint has two rotation channels about one axis.
    """
    file = read_body(path, clip)
    for joint in file.joints:
        if len(set(order := rotation_order(joint))) < len(order):
            fault = f"{joint.name} turns about one axis twice ({order}), which cannot be written: choose another --rig"
            raise FormatError(fault, path=path, line=joint.line)
    placed, adds = resolve_places(assemble(file.joints, file.values, name_of(path)))
    scale = metres_per_unit(unit) if unit is not None else guess_unit(normalise(placed).skeleton)[1]
    first, last = frames or (0, 0)
    skeleton = placed.skeleton
    names = skeleton.names
    places = np.stack([placed.place(joint) for joint in range(len(names))], axis=1)[[first, last]]
    armature = Armature(
        motion,
        skeleton.parents,
        np.ones((len(names), 3)),
        np.array([joint in placed.places for joint in range(len(names))]),
        np.array([names.index(name) for name in motion.skeleton.names]),
        np.tile(rot.IDENTITY, (len(motion.skeleton), 1)),
        Pose(placed.rotations[[first, last]], places * scale),
        (frames is not None, frames is not None),
    )
    return BvhRigFile(path, names, armature, scale, tuple(file.hierarchy), tuple(file.joints), adds, file.values[first])
