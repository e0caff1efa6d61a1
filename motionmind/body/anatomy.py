"""Anatomy: the angles by which people describe a body's joints, how far each goes, and what its parts weigh.

A joint's rotation is a *swing* and a *twist*. The twist is the turn about the bone's own length (`long`); the swing
tips the bone, by a rotation vector at right angles to it whose two coefficients are flexion and abduction, or what the
joint calls them. Unlike three turns one after another this has no order to remember and no gimbal lock within 180
degrees; for movement in one plane it is what a goniometer reads. A limb is twisted, then swung; pelvis, spine and head
turn with the twist outermost, so that they lean in the frame that they have turned to. Source: Baerlocher and Boulic,
"Parametrization and range of motion of the ball-and-socket joint", Deformable Avatars (2001).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import msgspec
import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot

SIDES = ("left", "right")


class Angle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One angle of a joint.

    Attributes:
        about: the axis about which it is positive on the left side: "x", "-z".
        range: least and greatest, degrees.
        opposite: what its negative is called.
    """

    about: str
    range: tuple[float, float]
    opposite: str = ""

    @property
    def axis(self) -> int:
        """0, 1 or 2 for x, y or z."""
        return "xyz".index(self.about[-1])

    @property
    def sign(self) -> float:
        """1 or -1."""
        return -1.0 if self.about.startswith("-") else 1.0


class Joint(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A joint, or both of a pair, written for the left one.

    Attributes:
        angles: by name.
        long: the axis of the twist.
        outer: whether the twist comes last, rather than the swing.
        rest: degrees about z from the skeleton's rest to where all angles are 0.
        against: the joint in whose frame the angles are measured, where it is not the parent.
        mass: of the segment, as a share of the body's.
        centre: its centre of mass in the joint's frame, metres.
    """

    angles: dict[str, Angle]
    long: str
    outer: bool = False
    rest: float = 0.0
    against: str = ""
    mass: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Leg(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which joints make a leg that can be placed on the floor: two bones and a foot that bends at its ball.

    `heel` is the heel's place in the left ankle's frame, metres: no joint, but on the floor all the same.
    """

    hip: str
    knee: str
    ankle: str
    toes: str
    heel: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Anatomy:
    """A skeleton with its anatomy.

    Attributes:
        skeleton: its joints.
        layers: which joints each layer of a score moves, without their sides: the columns of a phrase.
        joints: by name; of a pair, without its side.
        groups: joints that share angles, as `head` is cervical and atlantal: group -> joint -> angle -> how much of it
            that joint takes.
        leg: the joints of a leg that can stand, in the layer where they are.
        path: the file that says so.
    """

    skeleton: Skeleton
    layers: Mapping[str, tuple[str, ...]]
    joints: Mapping[str, Joint]
    groups: Mapping[str, Mapping[str, Mapping[str, float]]]
    leg: Leg | None
    path: str

    def paired(self, joint: str) -> bool:
        """Whether there is a left and a right one."""
        return joint not in self.skeleton.names

    def named(self, joint: str, side: str) -> int:
        """Index in the skeleton of a joint, of that side where it is a pair."""
        return self.skeleton.index(f"{side}_{joint}" if self.paired(joint) else joint)

    def anatomy(self, name: str) -> tuple[str, Joint]:
        """The joint that is called `name` in the skeleton: its name without the side, and what is said of it."""
        side, _, joint = name.partition("_")
        joint = joint if side in SIDES else name
        return joint, self.joints[joint]

    def leg_joints(self, leg: Leg, side: str) -> list[int]:
        """Indices of a leg's joints, from the hip down to where the foot ends."""
        return [self.named(joint, side) for joint in (leg.hip, leg.knee, leg.ankle)] + self.foot(leg.toes, side)

    def foot(self, toes: str, side: str) -> list[int]:
        """Indices of a foot's joints from `toes` on, down to where it ends: the rows of its knuckles."""
        foot = [self.named(toes, side)]
        while len(below := self.skeleton.children(foot[-1])) == 1:
            foot += below
        return foot

    def lowest(self, rotations: Floats, root: Floats) -> tuple[Floats, Indices]:
        """Height [T] of a body's lowest point, metres, and the joint [T] that it belongs to."""
        count = len(self.skeleton)
        heights = self.skeleton.positions_and_tips(rotations, root)[..., 1]
        owners = np.tile(np.arange(count), 2)
        if self.leg is not None:
            ankles = np.array([self.named(self.leg.ankle, side) for side in SIDES])
            turned = self.skeleton.global_rotations(rotations)[..., ankles, :]
            heels = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]) * self.leg.heel
            heights = np.concatenate([heights, heights[..., ankles] + rot.mul_vec(turned, heels)[..., 1]], axis=-1)
            owners = np.concatenate([owners, ankles])
        at = heights.argmin(axis=-1)
        return np.take_along_axis(heights, at[..., None], axis=-1)[..., 0], owners[at]

    def rotations(self, degrees: Mapping[str, Floats]) -> Floats:
        """Local rotations [T, J, 4] from angles, by the skeleton's names of joints.

        `degrees[name]` is [T, 3] about x, y and z as `Joint` says, as for the left side; a joint that is not given is
        at 0. Angles that are measured against another frame are taken to the parent's.
        """
        count = len(next(iter(degrees.values())))
        out = np.tile(rot.IDENTITY, (count, len(self.skeleton), 1))
        for index, name in enumerate(self.skeleton.names):
            joint, anatomy = self.anatomy(name)
            vector = degrees.get(name)
            turned = to_rotation(anatomy, np.zeros((count, 3)) if vector is None else vector)
            out[:, index] = rot.mirror(turned) if name.startswith("right_") and self.paired(joint) else turned
        for index, frame in self._measured_elsewhere():
            out[:, index] = rot.inv_mul(self._between(out, frame, index), out[:, index])
        return out

    def degrees(self, rotations: Floats) -> Floats:
        """Angles [..., J, 3] about x, y and z of local rotations [..., J, 4]: the inverse of `rotations`.

        The right side's are those of its mirror image.
        """
        turned = rotations.copy()
        for index, frame in self._measured_elsewhere():
            turned[..., index, :] = rot.mul(self._between(rotations, frame, index), rotations[..., index, :])
        out = np.zeros((*rotations.shape[:-1], 3))
        for index, name in enumerate(self.skeleton.names):
            joint, anatomy = self.anatomy(name)
            q = turned[..., index, :]
            out[..., index, :] = to_degrees(
                anatomy, rot.mirror(q) if name.startswith("right_") and self.paired(joint) else q
            )
        return out

    def centre_of_mass(self, rotations: Floats, root: Floats) -> Floats:
        """Centre of mass [..., 3], metres, of postures with local rotations [..., J, 4] and root [..., 3]."""
        turned = self.skeleton.global_rotations(rotations)
        places = self.skeleton.positions(rotations, root)
        masses, centres = self._segments
        return np.asarray(np.einsum("j,...jk->...k", masses, places + rot.mul_vec(turned, centres)))

    @cached_property
    def _segments(self) -> tuple[Floats, Floats]:
        """Shares of the body's mass [J] and centres in the joints' frames [J, 3]."""
        masses, centres = np.zeros(len(self.skeleton)), np.zeros((len(self.skeleton), 3))
        for index, name in enumerate(self.skeleton.names):
            _, anatomy = self.anatomy(name)
            masses[index] = anatomy.mass
            centres[index] = anatomy.centre
            if name.startswith("right_"):
                centres[index, 0] *= -1.0
        return masses / max(masses.sum(), 1e-12), centres

    def _measured_elsewhere(self) -> list[tuple[int, int]]:
        """Joints whose angles are measured against another frame than their parent's: (joint, that frame)."""
        names = self.skeleton.names
        against = [(index, self.anatomy(name)[1].against) for index, name in enumerate(names)]
        return [(index, names.index(frame)) for index, frame in against if frame]

    def _between(self, rotations: Floats, frame: int, joint: int) -> Floats:
        """The parent of `joint` seen from `frame`, one of its ancestors: [..., 4]."""
        out = np.broadcast_to(rot.IDENTITY, rotations[..., 0, :].shape)
        above = self.skeleton.parents[joint]
        while above != frame:
            out = rot.mul(rotations[..., above, :], out)
            above = self.skeleton.parents[above]
        return out


def to_rotation(joint: Joint, degrees: Floats) -> Floats:
    """The left joint's rotation [..., 4] in its frame of reference, from angles [..., 3] about x, y and z."""
    vector, axis = np.radians(degrees), "xyz".index(joint.long)
    swing = vector.copy()
    swing[..., axis] = 0.0
    twist = rot.from_axis_angle(np.eye(3)[axis], vector[..., axis])
    turned = rot.mul(twist, rot.exp(swing)) if joint.outer else rot.mul(rot.exp(swing), twist)
    return rot.mul(turned, rot.from_axis_angle([0.0, 0.0, 1.0], np.radians(joint.rest))) if joint.rest else turned


def to_degrees(joint: Joint, turned: Floats) -> Floats:
    """Angles [..., 3] about x, y and z of the left joint's rotation [..., 4]: the inverse of `to_rotation`."""
    axis = "xyz".index(joint.long)
    if joint.rest:
        turned = rot.mul(turned, rot.from_axis_angle([0.0, 0.0, 1.0], -np.radians(joint.rest)))
    angle = np.angle(np.exp(2j * np.arctan2(turned[..., axis], turned[..., 3])))
    twist = rot.from_axis_angle(np.eye(3)[axis], angle)
    vector = rot.log(rot.inv_mul(twist, turned) if joint.outer else rot.mul_inv(turned, twist))
    vector[..., axis] = angle
    return np.degrees(vector)
