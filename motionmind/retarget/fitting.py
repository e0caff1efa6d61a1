"""Fits human23 to a file's skeleton: joints that it takes rotations from, how its axes lie there, how long bones are.

Alignments are read from the zero pose (all rotations 0), where the axes of a file's joints are the world's. In most
files it is a body that stands upright, with arms and legs in some position:

- the trunk (with clavicles) stands upright and faces one way: human23's axes are up, left and ahead. The slopes of
  single bones there are anatomy, not posture, and are not copied;
- limbs (hip, knee, shoulder, elbow, wrist) take the smallest rotation from human23's bone to the file's, relative to
  the parent joint: arms hang, or legs are spread, by such rotations;
- feet stand flat, so an ankle is rotated about the shank only, and toes as the ankle.

Rigs whose zero pose does not stand have their alignments in a table (`rigs.Rig.frames`), or show them in the movement
(`motionmind.retarget.standing`).
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import (
    describe_limbs,
    describe_unknown_rig,
    in_a_row,
    joint_mapping,
    known_rig,
)
from motionmind.retarget.rig import Rig
from motionmind.retarget.standing import align_by_movement, standing_pose, stands

_log = logging.getLogger(__name__)
_LIMBS = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "elbow": "wrist", "wrist": "fingers"}
_SHAPES = 64  # bodies whose fit is known again: a collection's files are of a few
_SAME_PLACE = 1e-6  # metres below which two joints coincide
_LEANS = np.radians(25.0)  # the largest lean of a trunk that counts as upright
_FACES = np.radians(3.0)  # the largest turn about the vertical that counts as straight ahead
_POINTED = 0.4  # the share of a foot's length that lies across the shank if the foot stands on its sole
_UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class Fit:
    """human23 fitted to a file's skeleton.

    Attributes:
        turns: for each joint of human23, index of the file's joint whose rotation it takes [23].
        pelvis: index of the file's joint at the pelvis's place.
        alignment: orientation of human23's axes in the frames of those joints, quaternions [23, 4].
        skeleton: human23 with the file's proportions.
        up: direction of the trunk in the frame of the pelvis's source [3].
        stands: whether the zero pose stands, or its alignment is known from the rig.
        chest: joints of human23 that show where the thorax ends, each with the index of the file's joint at its place;
            empty unless several joints of the file's spine became one. Rigs with a table of frames have none: their
            joints keep their orientations, in the spine too.
        unclear: joints whose turn about their bones neither the zero pose nor the movement shows.
    """

    turns: Indices
    pelvis: int
    alignment: Floats
    skeleton: Skeleton
    up: Floats
    stands: bool = True
    chest: tuple[tuple[int, int], ...] = ()
    unclear: tuple[str, ...] = ()


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


@dataclass(frozen=True)
class _Shape:
    """A skeleton that equals any other of its shape, whatever the file is called."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: bytes
    tips: bytes
    skeleton: Skeleton = field(compare=False)


def fit_human23(movement: Motion | Posture, joints: Mapping[str, str] | None) -> Fit:
    """Fit human23 to a file's skeleton; SkeletonError if its joints do not map there.

    The movement counts where the skeleton's zero pose does not stand.
    """
    skeleton = movement.skeleton
    shape = _Shape(skeleton.names, skeleton.parents, skeleton.offsets.tobytes(), skeleton.tips.tobytes(), skeleton)
    sources, alignment, has_frames = _align_shape(shape, None if joints is None else tuple(joints.items()))
    if alignment is None:
        return _fit_movement(sources, movement)
    return _fit(sources, alignment, sources, () if has_frames else _find_chest(sources))


def zero_pose_rests(skeleton: Skeleton) -> bool | None:
    """Return whether a person's skeleton stands at rest with all rotations 0; None if its joints are no known rig's."""
    known = known_rig(skeleton)
    if known is None:
        return None
    try:
        sources = _find_sources(skeleton, known[1])
    except SkeletonError:  # whoever takes it onto human23 is told
        return None
    return stands([sources.place(name) for name in human23().names])


@lru_cache(_SHAPES)
def _align_shape(shape: _Shape, given: tuple[tuple[str, str], ...] | None) -> tuple[_Sources, Floats | None, bool]:
    """Return the sources of human23's joints, their alignments [23, 4], and whether these are of the rig's table.

    There are no alignments if the zero pose shows none.
    """
    skeleton, joints = shape.skeleton, None if given is None else dict(given)
    rig: Rig | None = None
    if joints is not None:
        mapping = joint_mapping(skeleton, joints) or {}
    else:
        known = known_rig(skeleton)
        if known is None:
            raise SkeletonError(f"{describe_unknown_rig(skeleton)}; give a mapping (--joints)")
        rig, mapping = known
        if limbs := describe_limbs(skeleton):
            _log.info("%s: %s (--joints maps them otherwise)", skeleton.name, limbs)
    sources = _find_sources(skeleton, mapping)
    if rig is not None and rig.frames and _zero_pose_matches(sources, rig.frames):
        frames = {name: rig.frames[name] for name in rig.frames if name in mapping.values()}
        return sources, _inherit_alignments(frames), True
    if not stands([sources.place(name) for name in human23().names]):
        return sources, None, False
    return sources, _align_standing(sources, _body_axes(sources), rig), False


def _fit_movement(sources: _Sources, movement: Motion | Posture) -> Fit:
    """Fit human23 to a rig whose zero pose does not stand, by how it moves."""
    skeleton, rotations = sources.skeleton, movement.rotations
    alignment, unclear = align_by_movement(skeleton, rotations, movement.root, sources.stands, sources.turns)
    pose = standing_pose(skeleton, rotations, sources.turns, alignment)
    above = [max(parent, 0) for parent in skeleton.parents]
    offsets, tips = rot.mul_vec(pose[above], skeleton.offsets), rot.mul_vec(pose, skeleton.tips)
    upright = replace(skeleton, offsets=offsets, tips=tips)
    standing = replace(sources, skeleton=upright, zero=upright.rest[: len(upright)])
    fit = _fit(sources, alignment, standing, _find_chest(sources))
    return replace(fit, stands=False, unclear=tuple(unclear))


def _fit(sources: _Sources, alignment: Floats, standing: _Sources, chest: tuple[tuple[int, int], ...]) -> Fit:
    """Return the fit with these alignments [23, 4] and this chest; its proportions are those of `standing`."""
    turns = list(sources.turns)
    for i, parent in enumerate(human23().parents):
        turns[i] = turns[parent] if turns[i] < 0 else turns[i]
    axes = alignment if standing is sources else np.tile(rot.IDENTITY, (len(alignment), 1))
    up = rot.mul_vec(alignment[0], _UP)
    body = _proportions(standing, axes)
    return Fit(np.array(turns), sources.stands[0], alignment, body, up, chest=chest)


def _find_chest(sources: _Sources) -> tuple[tuple[int, int], ...]:
    """Return the joints that show where the thorax ends, as `Fit.chest` has them."""
    body = human23()
    spine = [body.index(name) for name in ("lumbar", "thorax")]
    if min(sources.stands[i] for i in spine) < 0 or all(sources.stands[i] == sources.turns[i] for i in spine):
        return ()
    arms = [body.index(f"{side}_clavicle") for side in ("left", "right")]
    ends = next(i for i in (arms, [body.index("cervical")], spine[1:]) if min(sources.stands[j] for j in i) >= 0)
    return tuple((i, sources.stands[i]) for i in ends)


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
    left = unit(hips[0] - hips[1]) + unit(shoulders[0] - shoulders[1])
    ahead = np.cross(left, up)
    if np.linalg.norm(ahead) < _SAME_PLACE:
        raise SkeletonError(
            f"{sources.skeleton.name}: with all rotations 0, hips and shoulders do not show where up and left are"
        )
    # A lean of a few degrees in the zero pose is the rig's: up is then the nearest of the world's axes. Which way the
    # body faces is its own, but for what hips and shoulders are off by themselves.
    up, axis = unit(up), _nearest_axis(up)
    if up @ axis > np.cos(_LEANS):
        up, ahead = axis, np.cross(left, axis)
        axis = _nearest_axis(ahead)
        ahead = axis if unit(ahead) @ axis > np.cos(_FACES) else ahead
    ahead = unit(ahead)
    return rot.from_matrix(np.stack([np.cross(up, ahead), up, ahead], axis=-1))


def _nearest_axis(direction: Floats) -> Floats:
    """Return the axis of the world [3] nearest to a direction [3]."""
    axis, longest = np.zeros(3), int(np.argmax(np.abs(direction)))
    axis[longest] = np.sign(direction[longest])
    return axis


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
    for name, angle_rad in rig.twists_rad.items() if rig is not None else ():
        alignment[name] = rot.mul(alignment[name], rot.from_axis_angle([1.0, 0.0, 0.0], angle_rad))
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


def unit(v: Floats) -> Floats:
    """Return the direction of a vector [3]; zeros where joints coincide."""
    length = np.linalg.norm(v)
    return v / length if length > _SAME_PLACE else np.zeros(3)
