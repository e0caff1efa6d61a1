"""Anatomy: the anatomical angles of a body's joints, their ranges, and the masses of its segments.

A joint's rotation is a *swing* and a *twist*. The twist turns the bone about its own length (`long`). The swing tips
the bone, by a rotation vector at right angles to it. Its two coefficients are flexion and abduction, or the joint's own
names for them. Unlike three turns in sequence, this has no order to remember and no gimbal lock within 180 degrees. For
movement in one plane it is the angle that a goniometer reads. A limb is twisted, then swung. Pelvis, spine and head
have the twist outermost: they lean in the frame that they have turned to.

Source: Baerlocher and Boulic, "Parametrization and range of motion of the ball-and-socket joint", Deformable Avatars
(2001).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import msgspec
import numpy as np

from motionmind._typing import Bools, Floats, Indices, Ints
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot

SIDES = ("left", "right")
_Z = np.array([0.0, 0.0, 1.0])


class Angle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One angle of a joint.

    Attributes:
        about: the axis about which it is positive on the left side: "x", "-z".
        range: least and greatest angle, degrees.
        opposite: name of the negative angle, such as extension for flexion.
    """

    about: str
    range: tuple[float, float]
    opposite: str = ""

    @property
    def axis(self) -> int:
        """The axis as 0, 1 or 2 for x, y or z."""
        return "xyz".index(self.about[-1])

    @property
    def sign(self) -> float:
        """1 or -1: the sign of a positive angle about the axis."""
        return -1.0 if self.about.startswith("-") else 1.0


class Joint(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A joint; for a pair of joints, the left one.

    Attributes:
        angles: by name.
        long: the axis of the twist.
        outer: whether the twist is applied after the swing, instead of before it.
        rest: degrees about z from the skeleton's rest pose to the pose in which all angles are 0.
        against: the joint in whose frame the angles are measured; "" for the parent.
        mass: mass of the segment, as a share of the body's.
        centre: centre of mass of the segment in the joint's frame, metres.
    """

    angles: dict[str, Angle]
    long: str
    outer: bool = False
    rest: float = 0.0
    against: str = ""
    mass: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Leg(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The joints of a leg that can be placed on the floor: two bones and a foot that bends at its ball.

    Joints are named without their side.

    Attributes:
        hip: the joint at the top of the thigh.
        knee: the joint between the two long bones.
        ankle: the joint between shank and foot.
        toes: the ball of the foot.
        heel: position of the heel in the left ankle's frame, metres; the heel is a contact point, not a joint.
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
        skeleton: the tree of joints.
        layers: the joints, without their sides, that each layer of a score moves: the columns of a phrase.
        joints: each joint's anatomy by name; a pair's without its side.
        groups: joints that share angles, such as `head` for cervical and atlantal: group -> joint -> angle -> the
            joint's share.
        leg: the joints of a leg that can stand; None on a body without such legs.
        path: the anatomy's file.
    """

    skeleton: Skeleton
    layers: Mapping[str, tuple[str, ...]]
    joints: Mapping[str, Joint]
    groups: Mapping[str, Mapping[str, Mapping[str, float]]]
    leg: Leg | None
    path: str

    def paired(self, joint: str) -> bool:
        """Return whether the joint exists on the left and on the right."""
        return joint not in self.skeleton.names

    def named(self, joint: str, side: str) -> int:
        """Return the index in the skeleton of a joint; of a pair, the one on `side`."""
        return self.skeleton.index(f"{side}_{joint}" if self.paired(joint) else joint)

    def anatomy(self, name: str) -> tuple[str, Joint]:
        """Return the name without a side, and the anatomy, of the joint that the skeleton calls `name`."""
        side, _, joint = name.partition("_")
        joint = joint if side in SIDES else name
        return joint, self.joints[joint]

    def leg_joints(self, leg: Leg, side: str) -> list[int]:
        """Return the indices of a leg's joints, from the hip down to the end of the foot."""
        return [self.named(joint, side) for joint in (leg.hip, leg.knee, leg.ankle)] + self.foot(leg.toes, side)

    def foot(self, toes: str, side: str) -> list[int]:
        """Return the indices of a foot's joints from `toes` to its end: the rows of its knuckles."""
        foot = [self.named(toes, side)]
        while len(below := self.skeleton.children(foot[-1])) == 1:
            foot += below
        return foot

    def rotations(self, degrees: Mapping[str, Floats]) -> Floats:
        """Return local rotations [T, J, 4] from angles.

        Angles measured in another frame than the parent's are converted.

        Args:
            degrees: angles [T, 3] about x, y and z (see `Joint`), by the joints' names in the skeleton; a right joint
                has the angles of its mirror image. Missing joints are at 0.
        """
        count = len(next(iter(degrees.values())))
        vectors = np.zeros((count, len(self.skeleton), 3))
        for name, given in degrees.items():
            vectors[:, self.skeleton.index(name)] = given
        out = to_rotations(self._conventions, vectors)
        for index, _ in self._measured_elsewhere:
            out[:, [index]] = self.rotations_of(np.array([index]), vectors[:, [index]], out)
        return out

    def degrees(self, rotations: Floats, joints: Sequence[int] | None = None) -> Floats:
        """Return angles [..., J, 3] in degrees about x, y and z of local rotations [..., J, 4].

        The inverse of `rotations`; a right joint has the angles of its mirror image.

        Args:
            rotations: local rotations [..., J, 4].
            joints: indices of the joints to compute; the others' angles are 0. None for all.
        """
        wanted = np.arange(len(self.skeleton)) if joints is None else np.array(joints, dtype=np.intp)
        out = np.zeros((*rotations.shape[:-1], 3))
        out[..., wanted, :] = self.degrees_of(wanted, rotations)
        return out

    def degrees_of(self, joints: Indices, rotations: Floats) -> Floats:
        """Return the angles of some joints only [..., n, 3], by their indices [n]; see `degrees`."""
        turned = rotations[..., joints, :]
        for index, frame in self._measured_elsewhere:
            for place in np.flatnonzero(joints == index):
                turned[..., place, :] = rot.mul(self._between(rotations, frame, index), turned[..., place, :])
        return to_degrees(self._conventions.of(joints), turned)

    def rotations_of(self, joints: Indices, degrees: Floats, rotations: Floats) -> Floats:
        """Return the local rotations of some joints only [..., n, 4]: the inverse of `degrees_of`.

        Args:
            joints: their indices [n].
            degrees: their angles [..., n, 3].
            rotations: local rotations [..., J, 4]; only those of the joints above matter.
        """
        out = to_rotations(self._conventions.of(joints), degrees)
        for index, frame in self._measured_elsewhere:
            for place in np.flatnonzero(joints == index):
                out[..., place, :] = rot.inv_mul(self._between(rotations, frame, index), out[..., place, :])
        return out

    @cached_property
    def limits(self) -> tuple[Floats, Floats]:
        """The least and greatest angles of all joints [J, 3] about x, y and z, degrees; infinite without a limit."""
        least = np.full((len(self.skeleton), 3), -np.inf)
        most = -least
        for index, name in enumerate(self.skeleton.names):
            for angle in self.anatomy(name)[1].angles.values():
                least[index, angle.axis], most[index, angle.axis] = sorted(angle.sign * end for end in angle.range)
        return least, most

    @property
    def has_masses(self) -> bool:
        """Whether the masses of its segments are known."""
        return bool(self._segments[0].any())

    def centre_of_mass(self, rotations: Floats, root: Floats) -> Floats:
        """Return the centre of mass [..., 3], metres, for local rotations [..., J, 4] and root positions [..., 3]."""
        turned = self.skeleton.global_rotations(rotations)
        return self.masses_of(self.skeleton).centre(self.skeleton.positions(rotations, root), turned)

    def masses_of(self, skeleton: Skeleton) -> Masses:
        """Return the masses of a body with this anatomy, in the anatomy's own proportions or others."""
        shares, centres = self._segments
        same = skeleton is self.skeleton  # it may be flat, without height
        return Masses(shares, centres if same else centres * (skeleton.height / self.skeleton.height))

    @cached_property
    def _segments(self) -> tuple[Floats, Floats]:
        """Each segment's share of the body's mass [J], and centre of mass in its joint's frame [J, 3], metres."""
        masses, centres = np.zeros(len(self.skeleton)), np.zeros((len(self.skeleton), 3))
        for index, name in enumerate(self.skeleton.names):
            _, anatomy = self.anatomy(name)
            masses[index] = anatomy.mass
            centres[index] = anatomy.centre
            if name.startswith("right_"):
                centres[index, 0] *= -1.0
        return masses / max(masses.sum(), 1e-12), centres

    @cached_property
    def _measured_elsewhere(self) -> list[tuple[int, int]]:
        """(joint, frame) for the joints whose angles are measured in another frame than their parent's."""
        names = self.skeleton.names
        against = [(index, self.anatomy(name)[1].against) for index, name in enumerate(names)]
        return [(index, names.index(frame)) for index, frame in against if frame]

    @cached_property
    def _conventions(self) -> Conventions:
        joints = [self.anatomy(name) for name in self.skeleton.names]
        right = [name.startswith("right_") for name in self.skeleton.names]
        return Conventions(
            np.array(["xyz".index(joint.long) for _, joint in joints]),
            np.array([joint.outer for _, joint in joints]),
            np.array([joint.rest for _, joint in joints]),
            np.array([side and self.paired(name) for side, (name, _) in zip(right, joints, strict=True)]),
        )

    def _between(self, rotations: Floats, frame: int, joint: int) -> Floats:
        """Return the orientation [..., 4] of the parent of `joint` in `frame`, one of its ancestors."""
        out = np.broadcast_to(rot.IDENTITY, rotations[..., 0, :].shape)
        above = self.skeleton.parents[joint]
        while above != frame:
            out = rot.mul(rotations[..., above, :], out)
            above = self.skeleton.parents[above]
        return out


class Masses(NamedTuple):
    """The masses of a body's segments.

    Attributes:
        shares: each segment's share of the body's mass [J].
        centres: each segment's centre of mass in its joint's frame [J, 3], metres.
    """

    shares: Floats
    centres: Floats

    def centre(self, places: Floats, turned: Floats) -> Floats:
        """Return the body's centre of mass [..., 3], metres.

        Args:
            places: positions of the joints, then of any other points [..., P, 3], metres.
            turned: orientations of the joints in the world [..., J, 4].
        """
        from motionmind.body.kinematics import weigh  # numba is slow to import

        out = np.empty((*places.shape[:-2], 3))
        rows = places.reshape(-1, *places.shape[-2:]), turned.reshape(-1, *turned.shape[-2:])
        weigh(*rows, self.shares, self.centres, out.reshape(-1, 3))
        return out


class Conventions(NamedTuple):
    """The conventions of the joints' angles (see `Joint`).

    Attributes:
        long: axis of each joint's twist, 0, 1 or 2 [J].
        outer: whether the twist is applied after the swing [J].
        rest: degrees about z from the rest pose to the pose of angles 0 [J].
        mirrored: whether the joint is on the right, and has the angles of its mirror image [J].
    """

    long: Ints
    outer: Bools
    rest: Floats
    mirrored: Bools

    def of(self, joints: Indices) -> Conventions:
        """Return the conventions of some joints."""
        return Conventions(self.long[joints], self.outer[joints], self.rest[joints], self.mirrored[joints])


def to_rotations(conventions: Conventions, degrees: Floats) -> Floats:
    """Return joints' rotations [..., J, 4] in their frames of reference, from degrees [..., J, 3] about x, y and z."""
    long, outer, rest, mirrored = conventions
    vector, every = np.radians(degrees), np.arange(len(long))
    twist = rot.from_axis_angle(np.eye(3)[long], vector[..., every, long])
    vector[..., every, long] = 0.0
    swing = rot.exp(vector)
    turned = np.where(outer[:, None], rot.mul(twist, swing), rot.mul(swing, twist))
    rests = rest != 0.0
    turned[..., rests, :] = rot.mul(turned[..., rests, :], rot.from_axis_angle(_Z, np.radians(rest[rests])))
    return np.where(mirrored[:, None], rot.mirror(turned), turned)


def to_degrees(conventions: Conventions, turned: Floats) -> Floats:
    """Return degrees [..., J, 3] about x, y and z of joints' rotations [..., J, 4]: the inverse of `to_rotations`."""
    from motionmind.body.angles import swings_and_twists  # numba is slow to import

    long, outer, rest, mirrored = conventions
    rows = np.ascontiguousarray(turned, dtype=np.float64).reshape(-1, len(long), 4)
    return np.degrees(swings_and_twists(rows, long, outer, np.radians(rest), mirrored)).reshape(*turned.shape[:-1], 3)
