"""Retargets movement onto human23.

Each joint of human23 takes the global rotation of the file's joint that maps to it, times a constant *alignment*: the
orientation of human23's axes in the frame of the file's joint. The same movement so has the same rotations, whatever
body and axes it was recorded on. Proportions stay the performer's.

Alignments are read from the zero pose (all rotations 0), where the axes of a file's joints are the world's. In most
files it is a body that stands upright, with arms and legs in some position:

- the trunk (with clavicles) stands upright and faces one way: human23's axes are up, left and ahead. The slopes of
  single bones there are anatomy, not posture, and are not copied;
- limbs (hip, knee, shoulder, elbow, wrist) take the smallest rotation from human23's bone to the file's, relative to
  the parent joint: arms hang, or legs are spread, by such rotations;
- feet stand flat, so an ankle is rotated about the shank only, and toes as the ankle.

Rigs whose zero pose does not stand have their alignments in a table (`rigs.Rig.frames`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.arguments import check_mapping, check_text, check_type
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
from motionmind.retarget.rigs import Rig, plain_names

__all__ = ["filled_joints", "joint_mapping", "read_joint_mapping", "to_human23"]

Movement = TypeVar("Movement", Motion, Posture)

_LIMBS = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "elbow": "wrist", "wrist": "fingers"}

_SAME_PLACE = 1e-6  # metres below which two joints coincide
_LEANS = np.radians(25.0)  # the largest lean of a trunk that counts as upright
_STANDS = 0.7  # cosine between the trunk and the vertical of a body that stands
_AT_FLOOR = 0.15  # share of a body's height by which the lowest point of one that stands may be off the floor
_POINTED = 0.4  # the share of a foot's length that lies across the shank if the foot stands on its sole

_UP = np.array([0.0, 1.0, 0.0])

# From z up to y up: z becomes y, and a body that faced -y faces +z.
_Z_UP = rot.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 2)


def to_human23(movement: Movement, joints: Mapping[str, str] | None = None, *, up: str | None = None) -> Movement:
    """Retarget movement to human23's joints, with the performer's proportions.

    Forward kinematics reproduces the file's joint positions exactly, except where several joints of the file became
    one: there a bent chain has become a straight bone. (CMU, where three joints of the spine become two: neck and
    arms are 21 mm off on average in 20 clips of a dancer, 65 mm at most; 8 mm and 32 mm in 9 clips of karate; the
    legs are exact.) Joints that the file lacks, such as toes or fingers, move with their parents, at human23's place
    scaled by the length of the legs. Movement on human23 is returned unchanged; movement taken from there to human44,
    whose new joints stay at rest, comes back unchanged.

    Args:
        movement: a motion or posture on the file's own skeleton.
        joints: {file's joint: human23's joint} as for `joint_mapping`; None recognises the rig by its names.
        up: "y" or "z", the vertical in the file. None takes z if the zero pose stands along z, unless the movement
            itself stands along y; and if the movement stands along z on a floor at 0. Otherwise it takes y.

    Returns:
        The movement on human23, y up, in metres.

    Raises:
        SkeletonError: the skeleton does not map to human23, or its zero pose does not show how the body stands.
        MotionMindError: `up` is neither "y" nor "z".

    >>> import numpy as np
    >>> from motionmind import Posture, human44, to_human23
    >>> posture = Posture(human44(), np.tile([0.0, 0.0, 0.0, 1.0], (44, 1)), np.zeros(3))
    >>> len(to_human23(posture).skeleton)
    23
    """
    check_type("movement", movement, Motion, Posture)
    check_mapping("joints", joints, or_none=True)
    check_text("up", up, or_none=True)
    if up not in (None, "y", "z"):
        raise MotionMindError(f'up must be "y" or "z", not {up!r}')
    if (
        joints is None
        and up != "z"
        and human23().difference(movement.skeleton) is None
        and not _lies(movement.skeleton)
    ):
        return movement
    fit = _fit_human23(movement.skeleton, joints)
    renamed: dict[str, Any] = {}
    if isinstance(movement, Motion) and movement.insertions:
        mapping = joint_mapping(movement.skeleton, joints) or {}
        renamed["insertions"] = tuple(one.renamed(mapping) for one in movement.insertions)
    upright = _Z_UP if (up or _vertical(fit, movement)) == "z" else rot.IDENTITY
    turned = movement.skeleton.global_rotations(movement.rotations)[..., fit.turns, :]
    turned = rot.mul(rot.mul(upright, turned), fit.alignment)
    rotations = rot.normalise(fit.skeleton.local_rotations(turned))
    root = movement.skeleton.positions(movement.rotations, movement.root)[..., fit.pelvis, :]
    return replace(movement, skeleton=fit.skeleton, rotations=rotations, root=rot.mul_vec(upright, root), **renamed)


def from_human23(motion: Motion, like: Posture, joints: Mapping[str, str] | None = None) -> Motion:
    """Bring a motion of human23 onto the joints of a posture: the inverse of `to_human23`, with y up.

    Args:
        motion: the motion, on human23.
        like: a posture on the rig to move. Joints of its that have no counterpart stay as they are in it.
        joints: {rig's joint: human23's joint} as for `joint_mapping`; None recognises the rig by its names.

    Returns:
        The motion on the rig's skeleton, its joints turned, and its pelvis placed, as human23's.

    Raises:
        SkeletonError: the rig does not map to human23, or its zero pose does not show how the body stands.
    """
    rig = like.skeleton
    fit = _fit_human23(rig, joints)
    source = dict(zip(reversed(fit.turns.tolist()), reversed(range(len(fit.turns))), strict=True))  # parents win
    turned = rot.mul_inv(motion.skeleton.global_rotations(motion.rotations), fit.alignment)
    placed = np.empty((len(motion), len(rig), 4))
    for joint, parent in enumerate(rig.parents):
        if joint in source:
            placed[:, joint] = turned[:, source[joint]]
        else:
            own = like.rotations[joint]
            placed[:, joint] = own if parent < 0 else rot.mul(placed[:, parent], own)
    rotations = rot.normalise(rig.local_rotations(placed))
    root = motion.root - rig.positions(rotations, np.zeros(3))[:, fit.pelvis]
    return replace(motion, skeleton=rig, rotations=rotations, root=root, insertions=())


def own_skeleton(movement: Movement, joints: Mapping[str, str] | None = None) -> Movement:
    """Retarget movement to human23 if its joints map there; return it unchanged otherwise.

    Args:
        movement: a motion or posture.
        joints: {file's joint: human23's joint} as for `joint_mapping`; None recognises the rig by its names.

    Returns:
        The movement on human23 or on its own skeleton. On human44, which has joints that human23 lacks, it stays
        unless `joints` is given; with z up, it is turned.

    Raises:
        SkeletonError: as `to_human23`.

    >>> import numpy as np
    >>> from motionmind import Posture, human23, own_skeleton
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> own_skeleton(posture).skeleton.name
    'human23'
    """
    check_type("movement", movement, Motion, Posture)
    check_mapping("joints", joints, or_none=True)
    if joints is None and is_human44(movement.skeleton):
        return _turned_up(movement) if _lies(movement.skeleton) else movement
    known = joint_mapping(movement.skeleton) is not None
    return to_human23(movement, joints) if known or joints is not None else movement


@dataclass(frozen=True, eq=False)
class _Fit:
    """human23 fitted to a file's skeleton.

    Attributes:
        turns: for each joint of human23, index of the file's joint whose rotation it takes [23].
        pelvis: index of the file's joint at the pelvis's place.
        alignment: orientation of human23's axes in the frames of those joints, quaternions [23, 4].
        skeleton: human23 with the file's proportions.
        up: direction of the trunk in the frame of the pelvis's source [3].
    """

    turns: Indices
    pelvis: int
    alignment: Floats
    skeleton: Skeleton
    up: Floats


@dataclass(frozen=True, eq=False)
class _Sources:
    """The joints of a file that human23's map to.

    Attributes:
        skeleton: the file's.
        stands: for each joint of human23, index of the file's joint that gives its place [23]; -1 for none.
        turns: the same of the joint that gives its rotation [23].
        zero: the file's joints in the zero pose [J, 3], metres.
    """

    skeleton: Skeleton
    stands: list[int]
    turns: list[int]
    zero: Floats

    def place(self, joint: str) -> Floats | None:
        """Return the place of a joint of human23 in the zero pose [3]; None if it has no source."""
        index = self.stands[human23().index(joint)]
        return None if index < 0 else self.zero[index]

    def far_end(self, joint: str) -> Floats:
        """Return the vector from a joint of human23 to its furthest descendant in the zero pose [3]; 0 for none."""
        top = self.turns[human23().index(joint)]
        reach = np.zeros(3)
        for i in range(len(self.zero)):
            if top >= 0 and i >= top and in_a_row(self.skeleton, i, top):
                for point in (self.zero[i], self.zero[i] + self.skeleton.tips[i]):
                    reach = max(reach, point - self.zero[top], key=lambda v: float(np.linalg.norm(v)))
        return reach


def _fit_human23(skeleton: Skeleton, joints: Mapping[str, str] | None) -> _Fit:
    """Fit human23 to a file's skeleton; SkeletonError if its joints do not map there."""
    rig: Rig | None = None
    if joints is not None:
        mapping = joint_mapping(skeleton, joints) or {}
    else:
        known = known_rig(skeleton)
        if known is None:
            raise SkeletonError(f"the joints of {skeleton.name} do not map to human23: give a mapping")
        rig, mapping = known
    sources = _find_sources(skeleton, mapping)
    if rig is not None and rig.frames and _zero_pose_matches(sources, rig.frames):
        alignment = _inherit_alignments({name: rig.frames[name] for name in rig.frames if name in mapping.values()})
    else:
        alignment = _align_standing(sources, _body_axes(sources), rig)
    turns = list(sources.turns)
    for i, parent in enumerate(human23().parents):
        turns[i] = turns[parent] if turns[i] < 0 else turns[i]
    body, up = _proportions(sources, alignment), rot.mul_vec(alignment[0], _UP)
    return _Fit(np.array(turns), sources.stands[0], alignment, body, up)


def _find_sources(skeleton: Skeleton, mapping: Mapping[str, str]) -> _Sources:
    """Find the file's joints for each of human23's; SkeletonError if the mapping reverses a chain."""
    body = human23()
    stands, turns = [-1] * len(body), [-1] * len(body)
    for i, name in enumerate(skeleton.names):  # in topological order: the first of a row stands, the last turns
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
                f"{low!r} maps to {body.names[parent]} and {high!r} to {body.names[joint]}, but {low!r} hangs "
                f"from {high!r}"
            )
    zero = skeleton.rest[: len(skeleton)]
    return _Sources(skeleton, stands, turns, zero)


def _inherit_alignments(alignment: Mapping[str, Floats]) -> Floats:
    """Return alignments of all joints [23, 4]; those without one take their parent's."""
    body = human23()
    out = np.zeros((len(body), 4))
    for i, (name, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        out[i] = alignment.get(name, out[parent])
    return out


def _zero_pose_matches(sources: _Sources, frames: Mapping[str, Floats]) -> bool:
    """Return whether the limbs' directions in the zero pose match a rig's table of frames, within 30 degrees.

    Other rigs use the same names with a zero pose that stands.
    """
    for joint, bone, rest in _limb_bones(sources):
        cosine = bone @ rot.mul_vec(frames[joint], rest) / np.linalg.norm(bone) / np.linalg.norm(rest)
        if cosine < np.cos(np.radians(30.0)):
            return False
    return True


def _limb_bones(sources: _Sources) -> Iterator[tuple[str, Floats, Floats]]:
    """Yield each limb joint, its bone in the zero pose [3] and in human23's rest pose [3]; parents first."""
    for side in ("left", "right"):
        for joint, child in _LIMBS.items():
            start, end = sources.place(f"{side}_{joint}"), sources.place(f"{side}_{child}")
            if start is not None and end is not None and np.linalg.norm(end - start) > _SAME_PLACE:
                yield f"{side}_{joint}", end - start, human23().offsets[human23().index(f"{side}_{child}")]


def _body_axes(sources: _Sources) -> Floats:
    """Return the rotation [4] from human23's axes to the body's axes left, up and ahead in the file's zero pose."""

    def place(joint: str) -> Floats:
        found = sources.place(joint)
        assert found is not None  # mappings have all essential joints
        return found

    hips, shoulders = ([place(f"{side}_{joint}") for side in ("left", "right")] for joint in ("hip", "shoulder"))
    up = shoulders[0] + shoulders[1] - hips[0] - hips[1]
    left = _unit(hips[0] - hips[1]) + _unit(shoulders[0] - shoulders[1])
    ahead = np.cross(left, up)
    if np.linalg.norm(ahead) < _SAME_PLACE:
        raise SkeletonError(
            f"{sources.skeleton.name}: with all rotations 0, hips and shoulders do not show where up and left are"
        )
    up, ahead = _unit(up), _unit(ahead)
    axes = np.stack([np.cross(up, ahead), up, ahead], axis=-1)
    # A lean of a few degrees in the zero pose is the rig's: the axes are then the nearest of the world's.
    square = np.where(np.abs(axes) == np.max(np.abs(axes), axis=0), np.sign(axes), 0.0)
    if np.linalg.det(square) > 0.5 and np.trace(square.T @ axes) > 1.0 + 2.0 * np.cos(_LEANS):
        axes = square
    return rot.from_matrix(axes)


def _align_standing(sources: _Sources, body_axes: Floats, rig: Rig | None) -> Floats:
    """Return alignments [23, 4] for a zero pose that stands, by the rules in this module's docstring."""
    body = human23()
    alignment: dict[str, Floats] = {"pelvis": body_axes}
    bones = {joint: (bone, rest) for joint, bone, rest in _limb_bones(sources)}
    for name, parent in zip(body.names[1:], body.parents[1:], strict=True):
        above = alignment[body.names[parent]]
        alignment[name] = above
        if name in bones:
            bone, rest = bones[name]
            alignment[name] = rot.mul(rot.between(rot.mul_vec(above, rest), bone), above)
        elif name.endswith("_ankle"):
            alignment[name] = _align_ankle(sources, name, above)
        elif name == "cervical" and rig is not None and rig.neck_leans:
            alignment[name] = rot.mul(rot.between(rot.mul_vec(body_axes, _UP), _neck_bone(sources)), above)
    for name, twist in rig.twists.items() if rig is not None else ():
        alignment[name] = rot.mul(alignment[name], rot.from_axis_angle([1.0, 0.0, 0.0], twist))
    return np.array([alignment[name] for name in body.names])


def _neck_bone(sources: _Sources) -> Floats:
    """Return the vector from the neck's joint to the head in the zero pose [3]; up if they coincide."""
    head = sources.place("atlantal")
    bone = _UP if head is None else head - sources.zero[sources.turns[human23().index("cervical")]]
    return bone if np.linalg.norm(bone) > _SAME_PLACE else _UP


def _align_ankle(sources: _Sources, ankle: str, shank: Floats) -> Floats:
    """Return the alignment [4] of an ankle below a shank with the alignment `shank` [4]."""
    toes = ankle.replace("ankle", "toes")
    start, end = sources.place(ankle), sources.place(toes)
    bone = sources.far_end(ankle) if start is None or end is None else end - start
    length = np.linalg.norm(bone)
    if length < _SAME_PLACE:
        return shank
    down, ahead = rot.mul_vec(shank, np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]))
    level = bone - (bone @ down) * down
    if np.linalg.norm(level) < _POINTED * length:  # a foot that points down does not stand: align it like other bones
        rest = human23().offsets[human23().index(toes)]
        return rot.mul(rot.between(rot.mul_vec(shank, rest), bone), shank)
    if level @ ahead < -_POINTED * length:
        raise SkeletonError(
            f"{sources.skeleton.name}: {ankle} points backwards with all rotations 0; are left and right swapped?"
        )
    return rot.mul(rot.between(ahead, level), shank)


def _proportions(sources: _Sources, alignment: Floats) -> Skeleton:
    """Return human23 with the offsets and tips of the file's zero pose, in metres."""
    body = human23()
    legs = [
        np.linalg.norm(bone) / np.linalg.norm(rest) for joint, bone, rest in _limb_bones(sources) if "knee" in joint
    ]
    scale = float(np.mean(legs)) if legs else 1.0
    places, offsets, tips = np.zeros((23, 3)), np.zeros((23, 3)), np.zeros((23, 3))
    for i, (name, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        into_parent = rot.inv(alignment[parent])
        found = sources.place(name)
        if parent < 0:
            places[i] = sources.zero[sources.stands[0]]
            continue
        if found is None:
            places[i] = places[parent] + rot.mul_vec(alignment[parent], scale * body.offsets[i])
        else:
            places[i] = found
        offsets[i] = rot.mul_vec(into_parent, places[i] - places[parent])
        if np.any(body.tips[i]):
            tip = rot.mul_vec(rot.inv(alignment[i]), sources.far_end(name))
            tips[i] = tip if np.linalg.norm(tip) > _SAME_PLACE else scale * body.tips[i]
    if np.allclose(offsets, body.offsets, atol=_SAME_PLACE) and np.allclose(tips, body.tips, atol=_SAME_PLACE):
        return body
    return Skeleton(body.name, body.names, body.parents, offsets, tips)


def _vertical(fit: _Fit, movement: Motion | Posture) -> str:
    """Return "z" if the zero pose or the movement stands along z, as `to_human23` says, else "y"."""
    skeleton = movement.skeleton
    turned = skeleton.global_rotations(movement.rotations)[..., fit.turns[0], :]
    mean = rot.mul_vec(turned, fit.up).reshape(-1, 3).mean(axis=0)
    if fit.up[2] >= _STANDS:
        return "y" if mean[1] > 0.5 and mean[1] > mean[2] else "z"
    if mean[2] < _STANDS:
        return "y"
    # A body that lies on its back has its lowest point along z wherever the room begins.
    lowest = np.median(skeleton.positions_and_tips(movement.rotations, movement.root)[..., 2].min(axis=-1))
    return "z" if abs(lowest) < _AT_FLOOR * fit.skeleton.height else "y"


def _lies(skeleton: Skeleton) -> bool:
    """Return whether the zero pose of human23's or human44's joints stands along z, as Blender writes it."""
    zero = skeleton.rest[: len(skeleton)]
    names = plain_names(skeleton.names)
    up = _unit(zero[names.index("atlantal")] - zero[names.index("pelvis")])
    return bool(up[2] >= _STANDS)


def _turned_up(movement: Movement) -> Movement:
    """Return movement with z up, zero pose and all, with y up."""
    body = movement.skeleton
    skeleton = replace(body, offsets=rot.mul_vec(_Z_UP, body.offsets), tips=rot.mul_vec(_Z_UP, body.tips))
    rotations = rot.mul_inv(rot.mul(_Z_UP, movement.rotations), _Z_UP)
    return replace(movement, skeleton=skeleton, rotations=rotations, root=rot.mul_vec(_Z_UP, movement.root))


def _unit(v: Floats) -> Floats:
    length = np.linalg.norm(v)
    return v / length if length > _SAME_PLACE else np.zeros(3)
