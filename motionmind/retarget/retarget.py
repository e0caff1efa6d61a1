"""Movement from one skeleton to another: onto human23 where the joints map to it.

A joint of human23 takes the rotation in space of the file's joint that stands for it, times a constant: its
*alignment*, where human23's axes lie in the frame of the file's joint. So the same movement has the same rotations,
whatever body and whatever axes it was recorded on. Proportions stay the performer's.

Alignments are read from the zero pose (all rotations 0), where the axes of a file's joints are the world's. In most
files it is a body that stands upright, with arms and legs held in some way:

- the trunk (with clavicles) stands upright and faces one way: human23's axes are up, left and ahead. The slopes of
  single bones there are anatomy, not posture, and are not copied;
- limbs (hip, knee, shoulder, elbow, wrist) are turned the smallest way from human23's bone to the file's, seen from
  the joint above, as arms that hang or legs that are spread are turned;
- feet stand flat, so an ankle is turned about the shank only, toes as the ankle.

Rigs whose zero pose does not stand have their alignments in a table (`rigs.Rig.frames`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import (
    filled_joints,
    in_a_row,
    is_human44,
    joint_mapping,
    known_rig,
    read_joint_mapping,
)
from motionmind.retarget.rigs import Rig

__all__ = ["filled_joints", "joint_mapping", "read_joint_mapping", "to_human23"]

Movement = TypeVar("Movement", Motion, Posture)

_LIMBS = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "elbow": "wrist", "wrist": "fingers"}

# Metres below which two joints are in one place; radians up to which a trunk that leans counts as upright; the share
# of a foot's length that must be across the shank for the foot to stand on its sole.
_NOWHERE = 1e-6
_LEANS = np.radians(25.0)
_POINTED = 0.4

_UP = np.array([0.0, 1.0, 0.0])

# Y up from Z up: z becomes y, and what faced -y faces +z.
_Z_UP = rot.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 2)


def to_human23(movement: Movement, joints: Mapping[str, str] | None = None, *, up: str | None = None) -> Movement:
    """The movement on human23's joints, with the performer's proportions.

    Forward kinematics gives the file's joint positions again, exactly except where several joints of the file became
    one: there a bent chain has become a straight bone. (CMU, where three joints of the spine become two: neck and
    arms are 21 mm off on average in 20 clips of a dancer, 65 mm at most; 8 mm and 32 mm in 9 clips of karate; the
    legs are exact.) Joints that the file lacks, such as toes or fingers, go along with the joint they hang from, at
    human23's place scaled by the length of the legs. Movement that is on human23 already is returned as it is; what
    came from there to human44, with the joints that are new there at rest, comes back as it was.

    Args:
        movement: on the file's own skeleton.
        joints: {file's joint: human23's joint} as for `joint_mapping`; None to know the rig by its names.
        up: "y" or "z", the vertical in the file. None takes z where the zero pose stands along z, unless the
            movement itself stands along y; y otherwise.

    Raises:
        SkeletonError: the skeleton does not map to human23, or stands in its zero pose in no way that can be read.
        MotionMindError: `up` is neither "y" nor "z".
    """
    if up not in (None, "y", "z"):
        raise MotionMindError(f'up must be "y" or "z", not {up!r}')
    if joints is None and up != "z" and human23().difference(movement.skeleton) is None:
        return movement
    fit = _fit(movement.skeleton, joints)
    named: dict[str, Any] = {}
    if isinstance(movement, Motion) and movement.insertions:
        mapping = joint_mapping(movement.skeleton, joints) or {}
        named["insertions"] = tuple(one.renamed(mapping) for one in movement.insertions)
    upright = _Z_UP if (up or _vertical(fit, movement)) == "z" else rot.IDENTITY
    turned = movement.skeleton.global_rotations(movement.rotations)[..., fit.turns, :]
    turned = rot.mul(rot.mul(upright, turned), fit.alignment)
    rotations = rot.normalise(fit.skeleton.local_rotations(turned))
    root = movement.skeleton.positions(movement.rotations, movement.root)[..., fit.pelvis, :]
    return replace(movement, skeleton=fit.skeleton, rotations=rotations, root=rot.mul_vec(upright, root), **named)


@dataclass(frozen=True, eq=False)
class _Fit:
    """human23 in the frames of a file's skeleton.

    Attributes:
        turns: for each joint of human23 the index of the file's joint whose rotation it takes [23].
        pelvis: index of the file's joint where the pelvis stands.
        alignment: where human23's axes lie in the frames of those joints, quaternions [23, 4].
        skeleton: human23 with the file's proportions.
        up: direction of the trunk in the pelvis' source's frame [3] where that frame's zero pose stands; 0 where
            it does not.
    """

    turns: Indices
    pelvis: int
    alignment: Floats
    skeleton: Skeleton
    up: Floats


@dataclass(frozen=True, eq=False)
class _Sources:
    """For each joint of human23 the file's joint where it stands and the one it turns with [23]; -1 for none."""

    skeleton: Skeleton
    stands: list[int]
    turns: list[int]
    zero: Floats  # the file's joints in the zero pose [J, 3], metres

    def place(self, joint: str) -> Floats | None:
        """Where a joint of human23 stands in the zero pose [3]."""
        index = self.stands[human23().index(joint)]
        return None if index < 0 else self.zero[index]

    def far_end(self, joint: str) -> Floats:
        """From a joint of human23 to the furthest point that hangs from it in the zero pose [3]; 0 for none."""
        top = self.turns[human23().index(joint)]
        reach = np.zeros(3)
        for i in range(len(self.zero)):
            if top >= 0 and i >= top and in_a_row(self.skeleton, i, top):
                for point in (self.zero[i], self.zero[i] + self.skeleton.tips[i]):
                    reach = max(reach, point - self.zero[top], key=lambda v: float(np.linalg.norm(v)))
        return reach


def _fit(skeleton: Skeleton, joints: Mapping[str, str] | None) -> _Fit:
    rig: Rig | None = None
    if joints is not None:
        mapping = joint_mapping(skeleton, joints) or {}
    else:
        known = known_rig(skeleton)
        if known is None:
            raise SkeletonError(f"the joints of {skeleton.name} are none that map to human23: give a mapping")
        rig, mapping = known
    sources = _sources(skeleton, mapping)
    if rig is not None and rig.frames and _agree(sources, rig.frames):
        alignment = _inherit({name: rig.frames[name] for name in rig.frames if name in mapping.values()})
        up = np.zeros(3)
    else:
        stance = _stance(sources)
        alignment = _standing(sources, stance, rig)
        up = rot.mul_vec(stance, _UP)
    turns = list(sources.turns)
    for i, parent in enumerate(human23().parents):
        turns[i] = turns[parent] if turns[i] < 0 else turns[i]
    return _Fit(np.array(turns), sources.stands[0], alignment, _proportions(sources, alignment), up)


def _sources(skeleton: Skeleton, mapping: Mapping[str, str]) -> _Sources:
    body = human23()
    stands, turns = [-1] * len(body), [-1] * len(body)
    for i, name in enumerate(skeleton.names):  # in topological order: the first of a row, then the last
        if name in mapping:
            joint = body.index(mapping[name])
            stands[joint] = i if stands[joint] < 0 else stands[joint]
            turns[joint] = i
    for joint, above in enumerate(body.parents):
        parent = above
        while parent > 0 and turns[parent] < 0:
            parent = body.parents[parent]
        if (
            joint
            and turns[joint] >= 0
            and turns[joint] <= turns[parent]
            and in_a_row(skeleton, turns[joint], turns[parent])
        ):
            low, high = skeleton.names[turns[parent]], skeleton.names[turns[joint]]
            raise SkeletonError(
                f"{low!r} stands for {body.names[parent]} and {high!r} for {body.names[joint]}, but {low!r} hangs "
                f"from {high!r}"
            )
    zero = skeleton.positions(np.tile(rot.IDENTITY, (len(skeleton), 1)), np.zeros(3))
    return _Sources(skeleton, stands, turns, zero)


def _inherit(alignment: Mapping[str, Floats]) -> Floats:
    """Alignments of all joints [23, 4]: those without one take that of the joint they hang from."""
    body = human23()
    out = np.zeros((len(body), 4))
    for i, (name, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        out[i] = alignment.get(name, out[parent])
    return out


def _agree(sources: _Sources, frames: Mapping[str, Floats]) -> bool:
    """Whether arms and legs lie in the zero pose where a rig's table of frames says, within 30 degrees.

    Other rigs use the same names with a zero pose that stands.
    """
    for joint, bone, rest in _limb_bones(sources):
        cosine = bone @ rot.mul_vec(frames[joint], rest) / np.linalg.norm(bone) / np.linalg.norm(rest)
        if cosine < np.cos(np.radians(30.0)):
            return False
    return True


def _limb_bones(sources: _Sources) -> Iterator[tuple[str, Floats, Floats]]:
    """Joint of human23, its bone in the file's zero pose [3], and in human23's rest pose [3]; downwards."""
    for side in ("left", "right"):
        for joint, child in _LIMBS.items():
            start, end = sources.place(f"{side}_{joint}"), sources.place(f"{side}_{child}")
            if start is not None and end is not None and np.linalg.norm(end - start) > _NOWHERE:
                yield f"{side}_{joint}", end - start, human23().offsets[human23().index(f"{side}_{child}")]


def _stance(sources: _Sources) -> Floats:
    """Rotation [4] from human23's axes to the axes up, left and ahead of the body in the file's zero pose."""

    def place(joint: str) -> Floats:
        found = sources.place(joint)
        assert found is not None  # what is essential is there
        return found

    hips, shoulders = ([place(f"{side}_{joint}") for side in ("left", "right")] for joint in ("hip", "shoulder"))
    up = shoulders[0] + shoulders[1] - hips[0] - hips[1]
    left = _unit(hips[0] - hips[1]) + _unit(shoulders[0] - shoulders[1])
    ahead = np.cross(left, up)
    if np.linalg.norm(ahead) < _NOWHERE:
        raise SkeletonError(
            f"{sources.skeleton.name}: with all rotations 0, hips and shoulders do not show where up and left are"
        )
    up, ahead = _unit(up), _unit(ahead)
    seen = np.stack([np.cross(up, ahead), up, ahead], axis=-1)
    # A body that leans by a few degrees in its zero pose is built so: its axes are the nearest of the world's.
    square = np.where(np.abs(seen) == np.max(np.abs(seen), axis=0), np.sign(seen), 0.0)
    if np.linalg.det(square) > 0.5 and np.trace(square.T @ seen) > 1.0 + 2.0 * np.cos(_LEANS):
        seen = square
    return rot.from_matrix(seen)


def _standing(sources: _Sources, stance: Floats, rig: Rig | None) -> Floats:
    """Alignments [23, 4] for a zero pose that stands: the rules at the head of this module."""
    body = human23()
    found: dict[str, Floats] = {"pelvis": stance}
    bones = {joint: (bone, rest) for joint, bone, rest in _limb_bones(sources)}
    for name, parent in zip(body.names[1:], body.parents[1:], strict=True):
        above = found[body.names[parent]]
        found[name] = above
        if name in bones:
            bone, rest = bones[name]
            found[name] = rot.mul(rot.between(rot.mul_vec(above, rest), bone), above)
        elif name.endswith("_ankle"):
            found[name] = _foot(sources, name, above)
        elif name == "cervical" and rig is not None and rig.neck_leans:
            found[name] = rot.mul(rot.between(rot.mul_vec(stance, _UP), _neck(sources)), above)
    for name, twist in rig.twists.items() if rig is not None else ():
        found[name] = rot.mul(found[name], rot.from_axis_angle([1.0, 0.0, 0.0], twist))
    return np.array([found[name] for name in body.names])


def _neck(sources: _Sources) -> Floats:
    """From the joint that the neck turns in to the head [3]; up where they are in one place."""
    head = sources.place("atlantal")
    bone = _UP if head is None else head - sources.zero[sources.turns[human23().index("cervical")]]
    return bone if np.linalg.norm(bone) > _NOWHERE else _UP


def _foot(sources: _Sources, ankle: str, shank: Floats) -> Floats:
    """Alignment [4] of an ankle below a shank with the alignment `shank` [4]."""
    toes = ankle.replace("ankle", "toes")
    start, end = sources.place(ankle), sources.place(toes)
    bone = sources.far_end(ankle) if start is None or end is None else end - start
    length = np.linalg.norm(bone)
    if length < _NOWHERE:
        return shank
    down, ahead = rot.mul_vec(shank, np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]))
    level = bone - (bone @ down) * down
    if np.linalg.norm(level) < _POINTED * length:  # a foot that hangs down has no sole to stand on: a bone like others
        rest = human23().offsets[human23().index(toes)]
        return rot.mul(rot.between(rot.mul_vec(shank, rest), bone), shank)
    if level @ ahead < -_POINTED * length:
        raise SkeletonError(
            f"{sources.skeleton.name}: {ankle} points backwards with all rotations 0; are left and right exchanged?"
        )
    return rot.mul(rot.between(ahead, level), shank)


def _proportions(sources: _Sources, alignment: Floats) -> Skeleton:
    """human23 with offsets and tips, in metres, as they are in the file's zero pose."""
    body = human23()
    legs = [
        np.linalg.norm(bone) / np.linalg.norm(rest) for joint, bone, rest in _limb_bones(sources) if "knee" in joint
    ]
    scale = float(np.mean(legs)) if legs else 1.0
    places, offsets, tips = np.zeros((23, 3)), np.zeros((23, 3)), np.zeros((23, 3))
    for i, (name, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        seen = rot.inv(alignment[parent])
        found = sources.place(name)
        if parent < 0:
            places[i] = sources.zero[sources.stands[0]]
            continue
        if found is None:
            places[i] = places[parent] + rot.mul_vec(alignment[parent], scale * body.offsets[i])
        else:
            places[i] = found
        offsets[i] = rot.mul_vec(seen, places[i] - places[parent])
        if np.any(body.tips[i]):
            tip = rot.mul_vec(rot.inv(alignment[i]), sources.far_end(name))
            tips[i] = tip if np.linalg.norm(tip) > _NOWHERE else scale * body.tips[i]
    if np.allclose(offsets, body.offsets, atol=_NOWHERE) and np.allclose(tips, body.tips, atol=_NOWHERE):
        return body
    return Skeleton(body.name, body.names, body.parents, offsets, tips)


def _vertical(fit: _Fit, movement: Motion | Posture) -> str:
    """ "z" where the zero pose stands along z, unless the movement stands along y; else "y"."""
    if fit.up[2] < 0.7:
        return "y"
    turned = movement.skeleton.global_rotations(movement.rotations)[..., fit.turns[0], :]
    mean = rot.mul_vec(turned, fit.up).reshape(-1, 3).mean(axis=0)
    return "y" if mean[1] > 0.5 and mean[1] > mean[2] else "z"


def _unit(v: Floats) -> Floats:
    length = np.linalg.norm(v)
    return v / length if length > _NOWHERE else np.zeros(3)


_Movement = TypeVar("_Movement", Motion, Posture)


def own_skeleton(movement: _Movement, joints: Mapping[str, str] | None = None) -> _Movement:
    """The movement on human23 where its joints map there, by `joints` or by known names; as it is where they do not.

    Movement on human44, which has joints that human23 lacks, stays there too, unless `joints` is given.
    """
    known = joint_mapping(movement.skeleton) is not None and not is_human44(movement.skeleton)
    return to_human23(movement, joints) if known or joints is not None else movement
