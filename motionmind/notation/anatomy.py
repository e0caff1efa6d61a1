"""Anatomy: the angles by which people describe a body's joints, how far each goes, and what its parts weigh.

A joint's rotation is a *swing* and a *twist*. The twist is the turn about the bone's own length (`long`); the swing
tips the bone, by a rotation vector at right angles to it whose two coefficients are flexion and abduction, or what the
joint calls them. Unlike three turns one after another this has no order to remember and no gimbal lock within 180
degrees; for movement in one plane it is what a goniometer reads. A limb is twisted, then swung; pelvis, spine and head
turn with the twist outermost, so that they lean in the frame that they have turned to. Source: Baerlocher and Boulic,
"Parametrization and range of motion of the ball-and-socket joint", Deformable Avatars (2001).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.errors import FormatError
from motionmind.formats.files import FilePath, read_bytes
from motionmind.formats.text import meant
from motionmind.skeleton import BODIES, Skeleton

Array = NDArray[np.float64]

FORMAT, VERSION = "motionmind-body", 1
SIDES = ("left", "right")
# What a score can say besides its layers.
HEADINGS = ("title", "body", "include", "tempo", "facings", "phrase", "clip", "posture")
_BODIES = Path(__file__).parent / "bodies"


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
    """Which joints make a leg that can be placed on the floor: two bones and a foot that bends at its ball."""

    hip: str
    knee: str
    ankle: str
    toes: str


class _Segment(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    parent: str = ""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0)


class _File(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    format: str
    version: int
    name: str
    layers: dict[str, list[str]]
    joints: dict[str, Joint]
    groups: dict[str, dict[str, float | dict[str, float]]] = {}
    leg: Leg | None = None
    skeleton: list[_Segment] = []


@dataclass(frozen=True, eq=False)
class Body:
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

    def rotations(self, degrees: Mapping[str, Array]) -> Array:
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

    def degrees(self, rotations: Array) -> Array:
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

    def centre_of_mass(self, rotations: Array, root: Array) -> Array:
        """Centre of mass [..., 3], metres, of postures with local rotations [..., J, 4] and root [..., 3]."""
        turned = self.skeleton.global_rotations(rotations)
        places = self.skeleton.positions(rotations, root)
        masses, centres = self._segments
        return np.asarray(np.einsum("j,...jk->...k", masses, places + rot.mul_vec(turned, centres)))

    @property
    def _segments(self) -> tuple[Array, Array]:
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

    def _between(self, rotations: Array, frame: int, joint: int) -> Array:
        """The parent of `joint` seen from `frame`, one of its ancestors: [..., 4]."""
        out = np.broadcast_to(rot.IDENTITY, rotations[..., 0, :].shape)
        above = self.skeleton.parents[joint]
        while above != frame:
            out = rot.mul(rotations[..., above, :], out)
            above = self.skeleton.parents[above]
        return out


def to_rotation(joint: Joint, degrees: Array) -> Array:
    """The left joint's rotation [..., 4] in its frame of reference, from angles [..., 3] about x, y and z."""
    vector, axis = np.radians(degrees), "xyz".index(joint.long)
    swing = vector.copy()
    swing[..., axis] = 0.0
    twist = rot.from_axis_angle(np.eye(3)[axis], vector[..., axis])
    turned = rot.mul(twist, rot.exp(swing)) if joint.outer else rot.mul(rot.exp(swing), twist)
    return rot.mul(turned, rot.from_axis_angle([0.0, 0.0, 1.0], np.radians(joint.rest))) if joint.rest else turned


def to_degrees(joint: Joint, turned: Array) -> Array:
    """Angles [..., 3] about x, y and z of the left joint's rotation [..., 4]: the inverse of `to_rotation`."""
    axis = "xyz".index(joint.long)
    if joint.rest:
        turned = rot.mul(turned, rot.from_axis_angle([0.0, 0.0, 1.0], -np.radians(joint.rest)))
    angle = np.angle(np.exp(2j * np.arctan2(turned[..., axis], turned[..., 3])))
    twist = rot.from_axis_angle(np.eye(3)[axis], angle)
    vector = rot.log(rot.inv_mul(twist, turned) if joint.outer else rot.mul_inv(turned, twist))
    vector[..., axis] = angle
    return np.degrees(vector)


@cache
def body(name: str) -> Body:
    """A body that comes with MotionMind, such as "human23"; FormatError names those there are."""
    return read_body(_bundled(name))


def _bundled(name: object, path: FilePath | None = None) -> Path:
    known = sorted(file.stem for file in _BODIES.glob("*.toml"))
    if name not in known:
        hint = f"{meant(str(name), known)}; there are {', '.join(known)}, or a .toml file"
        raise FormatError(f"no body {name!r}{hint}", path=path)
    return _BODIES / f"{name}.toml"


def read_body(path: FilePath) -> Body:
    """A body from a TOML file; FormatError says what is wrong there."""
    try:
        read = msgspec.convert(_with_angles(_read_table(path)), _File)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"cannot be read as a body: {error}", path=path) from None
    if (read.format, read.version) != (FORMAT, VERSION):
        raise FormatError(
            f"is {read.format!r} version {read.version}; {FORMAT!r} version {VERSION} can be read", path=path
        )
    skeleton = _skeleton(read, path)
    out = Body(
        skeleton,
        {layer: tuple(joints) for layer, joints in read.layers.items()},
        read.joints,
        {group: _shares(read, group, path) for group in read.groups},
        read.leg,
        str(path),
    )
    _check(out, path)
    return out


def _read_table(path: FilePath) -> dict[str, Any]:
    """What a file says, on top of the body that it `extends`, if it does."""
    data = tomllib.loads(read_bytes(path).decode("utf-8-sig"))
    extended = data.pop("extends", None)
    return data if extended is None else _on_top(data, _read_table(_bundled(extended, path)))


def _on_top(upper: dict[str, Any], lower: dict[str, Any]) -> dict[str, Any]:
    """Tables entry by entry: what the upper one does not say is as below."""
    tables = [key for key in upper if isinstance(upper[key], dict) and isinstance(lower.get(key), dict)]
    return lower | upper | {key: _on_top(upper[key], lower[key]) for key in tables}


def _shares(read: _File, group: str, path: FilePath) -> dict[str, dict[str, float]]:
    """How much of each angle of a group its joints take: as much of all, or of each angle its own share."""
    out = {}
    for name, share in read.groups[group].items():
        if name not in read.joints:
            raise FormatError(f"[groups] {group}: no joint {name!r}{meant(name, read.joints)}", path=path)
        angles = read.joints[name].angles
        out[name] = share if isinstance(share, dict) else dict.fromkeys(angles, share)
        if set(out[name]) != set(angles):
            raise FormatError(f"[groups] {group}: {name} needs a share of {', '.join(angles)} each", path=path)
    return out


def _with_angles(data: dict[str, Any]) -> dict[str, Any]:
    """A joint's angles are written beside its other keys: every table in it is one."""
    joints = data.get("joints")
    if not isinstance(joints, dict):
        return data
    return data | {
        "joints": {
            name: {key: value for key, value in table.items() if not isinstance(value, dict)}
            | {"angles": {key: value for key, value in table.items() if isinstance(value, dict)}}
            if isinstance(table, dict)
            else table
            for name, table in joints.items()
        }
    }


def _skeleton(read: _File, path: FilePath) -> Skeleton:
    if not read.skeleton:
        if read.name not in BODIES:
            raise FormatError(
                f"{read.name!r} has no skeleton: give [[skeleton]] tables of name, parent, offset", path=path
            )
        return BODIES[read.name]()
    names = [segment.name for segment in read.skeleton]
    for segment in read.skeleton[1:]:
        if segment.parent not in names:
            raise FormatError(f"the parent of {segment.name}, {segment.parent!r}, is no joint", path=path)
    parents = tuple(names.index(segment.parent) if segment.parent else -1 for segment in read.skeleton)
    offsets = np.array([segment.offset for segment in read.skeleton])
    return Skeleton(read.name, tuple(names), parents, offsets, np.array([segment.tip for segment in read.skeleton]))


def _check(read: Body, path: FilePath) -> None:
    """Names that mean something, every joint described and in one layer."""
    stems = {name.partition("_")[2] if name.partition("_")[0] in SIDES else name for name in read.skeleton.names}
    for joint, anatomy in read.joints.items():
        if joint not in stems:
            raise FormatError(f"[joints.{joint}]: no such joint{meant(joint, stems)}", path=path)
        if anatomy.long not in ("x", "y", "z"):
            raise FormatError(f"[joints.{joint}]: long must be x, y or z, not {anatomy.long!r}", path=path)
        for name, angle in anatomy.angles.items():
            if angle.about.removeprefix("-") not in ("x", "y", "z"):
                raise FormatError(
                    f"[joints.{joint}] {name}: about must be an axis such as -x, not {angle.about!r}", path=path
                )
    for layer in read.layers:
        if layer in HEADINGS:
            raise FormatError(f"{layer!r} cannot be a layer: it is a heading of scores", path=path)
    for joint in stems:
        if joint not in read.joints:
            raise FormatError(f"there is no [joints.{joint}]", path=path)
        holders = [layer for layer, joints in read.layers.items() if joint in joints]
        if len(holders) != 1:
            raise FormatError(f"{joint} must be in one layer, not {' and '.join(holders) or 'none'}", path=path)
