"""Fits human23 to a file's skeleton: the source of each joint's rotation, the alignment of its axes, bone lengths.

Alignments come from the zero pose (all rotations 0), where the axes of a file's joints are the world's. In most files
that pose is a body that stands upright, with arms and legs in some position:

- the trunk (with clavicles) stands upright and faces one way: human23's axes are up, left and ahead. The slopes of
  single bones there are anatomy, not posture, and are not copied;
- limbs (hip, knee, shoulder, elbow, wrist) take the smallest rotation from human23's bone to the file's, relative to
  the parent joint: such rotations make arms hang and legs spread;
- feet stand flat, so an ankle turns about the shank only, and toes follow the ankle.

If the zero pose does not stand, alignments come from a table (`rigs.Rig.frames`) or from the movement
(`motionmind.retarget.standing`).
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.anatomy import SIDES
from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed, one_line
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import (
    describe_limbs,
    describe_unknown_rig,
    joint_mapping,
    known_rig,
    on_one_chain,
)
from motionmind.retarget.rig import Rig
from motionmind.retarget.standing import COINCIDENT_M, COS_MAX_LEAN, UP, align_by_movement, rests_upright, standing_pose

_log = logging.getLogger(__name__)
_LIMBS = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "elbow": "wrist", "wrist": "fingers"}
_FLAT_FOOT_SHARE = 0.4  # least share of a foot's length that lies across the shank if the foot stands on its sole


@dataclass(frozen=True, eq=False)
class Fit:
    """human23 fitted to a file's skeleton.

    Attributes:
        rotation_sources: for each joint of human23, index of the file's joint whose rotation it takes [23].
        pelvis: index of the file's joint at the pelvis's place.
        alignment: orientation of human23's axes in the frames of those joints, quaternions [23, 4].
        skeleton: human23 with the file's proportions.
        up: direction of the trunk in the frame of the pelvis's source [3].
        stands: whether the zero pose stands, or the rig's table gives its alignment.
        chest: joints of human23 that show where the thorax ends, each with the index of the file's joint at its place;
            empty unless several joints of the file's spine became one. Empty too for rigs with a table of frames:
            their joints keep their orientations, in the spine too.
        unclear: joints whose twist neither the zero pose nor the movement shows.
    """

    rotation_sources: Indices
    pelvis: int
    alignment: Floats
    skeleton: Skeleton
    up: Floats
    stands: bool = True
    chest: tuple[tuple[int, int], ...] = ()
    unclear: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Sources:
    """The file's joints that map to human23's.

    Attributes:
        skeleton: the file's.
        place: for each joint of human23, index of the file's joint that gives its place [23]; -1 for none.
        rotation: the same for the joint that gives its rotation [23].
        zero_pose: the file's joints in the zero pose [J, 3], metres.
    """

    skeleton: Skeleton
    place: list[int]
    rotation: list[int]
    zero_pose: Floats

    def position(self, joint: str) -> Floats | None:
        """Return the position of a joint of human23 in the zero pose [3]; None if it has no source."""
        index = self.place[human23().index(joint)]
        return None if index < 0 else self.zero_pose[index]

    def far_end(self, joint: str) -> Floats:
        """Return the vector from a joint of human23 to its furthest descendant in the zero pose [3]; 0 for none."""
        top = self.rotation[human23().index(joint)]
        reach = np.zeros(3)
        for i in range(len(self.zero_pose)):
            if top >= 0 and i >= top and on_one_chain(self.skeleton.parents, i, top):
                for point in (self.zero_pose[i], self.zero_pose[i] + self.skeleton.tips[i]):
                    reach = max(reach, point - self.zero_pose[top], key=lambda v: float(np.linalg.norm(v)))
        return reach


@dataclass(frozen=True)
class _Shape:
    """A skeleton as a key of the cache: equal to any other with the same joints, whatever the file's name."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: bytes
    tips: bytes
    skeleton: Skeleton = field(compare=False)


def fit_human23(movement: Motion | Posture, joints: Mapping[str, str] | None) -> Fit:
    """Fit human23 to a file's skeleton; SkeletonError if its joints do not map there.

    The movement shows the alignments if the zero pose does not stand.
    """
    skeleton = movement.skeleton
    shape = _Shape(skeleton.names, skeleton.parents, skeleton.offsets.tobytes(), skeleton.tips.tobytes(), skeleton)
    sources, alignment, has_frames = _align_shape(shape, None if joints is None else tuple(joints.items()))
    if alignment is None:
        return _fit_movement(sources, movement)
    return _fit(sources, alignment, sources, () if has_frames else _find_chest(sources))


def zero_pose_rests(skeleton: Skeleton) -> bool | None:
    """Return whether a person's skeleton stands with all rotations 0; None if its joints belong to no known rig."""
    known = known_rig(skeleton)
    if known is None:
        return None
    try:
        sources = _find_sources(skeleton, known[1])
    except SkeletonError:  # retargeting reports it
        return None
    return rests_upright([sources.position(name) for name in human23().names])


@lru_cache(64)  # the files of a collection share a few shapes
def _align_shape(shape: _Shape, given: tuple[tuple[str, str], ...] | None) -> tuple[_Sources, Floats | None, bool]:
    """Return the sources of human23's joints, their alignments [23, 4], and whether the rig's table gives these.

    The alignments are None if the zero pose does not show them.
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
            _log.info("%s: %s (--joints maps them otherwise)", displayed(skeleton.name), one_line(limbs))
    sources = _find_sources(skeleton, mapping)
    if rig is not None and rig.frames and _zero_pose_matches(sources, rig.frames):
        frames = {name: rig.frames[name] for name in rig.frames if name in mapping.values()}
        return sources, _inherit_alignments(frames), True
    if not rests_upright([sources.position(name) for name in human23().names]):
        return sources, None, False
    return sources, _align_standing(sources, _body_axes(sources), rig), False


def _fit_movement(sources: _Sources, movement: Motion | Posture) -> Fit:
    """Fit human23 by its movement to a rig whose zero pose does not stand."""
    skeleton, rotations = sources.skeleton, movement.rotations
    alignment, unclear = align_by_movement(skeleton, rotations, movement.root, sources.place, sources.rotation)
    pose = standing_pose(skeleton, rotations, sources.rotation, alignment)
    above = [max(parent, 0) for parent in skeleton.parents]
    offsets, tips = rot.mul_vec(pose[above], skeleton.offsets), rot.mul_vec(pose, skeleton.tips)
    upright = replace(skeleton, offsets=offsets, tips=tips)
    standing = replace(sources, skeleton=upright, zero_pose=upright.rest[: len(upright)])
    fit = _fit(sources, alignment, standing, _find_chest(sources))
    return replace(fit, stands=False, unclear=tuple(unclear))


def _fit(sources: _Sources, alignment: Floats, standing: _Sources, chest: tuple[tuple[int, int], ...]) -> Fit:
    """Return the fit with these alignments [23, 4] and this chest, with the proportions of `standing`."""
    rotation = list(sources.rotation)
    for i, parent in enumerate(human23().parents):
        rotation[i] = rotation[parent] if rotation[i] < 0 else rotation[i]
    axes = alignment if standing is sources else np.tile(rot.IDENTITY, (len(alignment), 1))
    up = rot.mul_vec(alignment[0], UP)
    body = _proportions(standing, axes)
    return Fit(np.array(rotation), sources.place[0], alignment, body, up, chest=chest)


def _find_chest(sources: _Sources) -> tuple[tuple[int, int], ...]:
    """Return the joints that show where the thorax ends, as in `Fit.chest`."""
    body, place = human23(), sources.place
    spine = [body.index(name) for name in ("lumbar", "thorax")]
    if min(place[i] for i in spine) < 0 or all(place[i] == sources.rotation[i] for i in spine):
        return ()
    arms = [body.index(f"{side}_clavicle") for side in SIDES]
    ends = next(i for i in (arms, [body.index("cervical")], spine[1:]) if min(place[j] for j in i) >= 0)
    return tuple((i, place[i]) for i in ends)


def _find_sources(skeleton: Skeleton, mapping: Mapping[str, str]) -> _Sources:
    """Find the file's joints for each of human23's; SkeletonError if the mapping reverses a chain."""
    body = human23()
    place, rotation = [-1] * len(body), [-1] * len(body)
    for i, name in enumerate(
        skeleton.names
    ):  # parents first: the first of a row gives the place, the last the rotation
        if name in mapping:
            joint = body.index(mapping[name])
            place[joint] = i if place[joint] < 0 else place[joint]
            rotation[joint] = i
    for joint, above in enumerate(body.parents):
        parent = above
        while parent > 0 and rotation[parent] < 0:
            parent = body.parents[parent]
        source, source_above = rotation[joint], rotation[parent]
        if joint and 0 <= source <= source_above and on_one_chain(skeleton.parents, source, source_above):
            low, high = repr(skeleton.names[source_above]), repr(skeleton.names[source])
            raise SkeletonError(
                f"{low} maps to {body.names[parent]} and {high} to {body.names[joint]}, but {low} is below {high}"
            )
    return _Sources(skeleton, place, rotation, skeleton.rest[: len(skeleton)])


def _inherit_alignments(alignment: Mapping[str, Floats]) -> Floats:
    """Return alignments of all joints [23, 4]; a joint without one takes its parent's."""
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
    for side in SIDES:
        for joint, child in _LIMBS.items():
            start, end = sources.position(f"{side}_{joint}"), sources.position(f"{side}_{child}")
            if start is not None and end is not None and np.linalg.norm(end - start) > COINCIDENT_M:
                yield f"{side}_{joint}", end - start, human23().offsets[human23().index(f"{side}_{child}")]


def _body_axes(sources: _Sources) -> Floats:
    """Return the rotation [4] from human23's axes to the body's axes left, up and ahead in the file's zero pose."""

    def position(joint: str) -> Floats:
        found = sources.position(joint)
        assert found is not None  # mappings have all essential joints
        return found

    hips, shoulders = ([position(f"{side}_{joint}") for side in SIDES] for joint in ("hip", "shoulder"))
    up = shoulders[0] + shoulders[1] - hips[0] - hips[1]
    left = unit(hips[0] - hips[1]) + unit(shoulders[0] - shoulders[1])
    ahead = np.cross(left, up)
    if np.linalg.norm(ahead) < COINCIDENT_M:
        raise SkeletonError(
            f"{sources.skeleton.name}: with all rotations 0, hips and shoulders do not show where up and left are"
        )
    # A lean of a few degrees in the zero pose is an error of the rig: up is then the nearest axis of the world. The
    # body may face any way, but less than 3 degrees off an axis is an error of hips and shoulders.
    up, axis = unit(up), _nearest_axis(up)
    if up @ axis > COS_MAX_LEAN:
        up, ahead = axis, np.cross(left, axis)
        axis = _nearest_axis(ahead)
        ahead = axis if unit(ahead) @ axis > np.cos(np.radians(3.0)) else ahead
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
            alignment[name] = rot.mul(rot.between(rot.mul_vec(body_axes, UP), _neck_bone(sources)), above)
    for name, angle_rad in rig.twists_rad.items() if rig is not None else ():
        alignment[name] = rot.mul(alignment[name], rot.from_axis_angle([1.0, 0.0, 0.0], angle_rad))
    return np.array([alignment[name] for name in body.names])


def _neck_bone(sources: _Sources) -> Floats:
    """Return the vector from the neck's joint to the head in the zero pose [3]; up if they coincide."""
    head = sources.position("atlantal")
    bone = UP if head is None else head - sources.zero_pose[sources.rotation[human23().index("cervical")]]
    return bone if np.linalg.norm(bone) > COINCIDENT_M else UP


def _align_ankle(sources: _Sources, ankle: str, shank: Floats) -> Floats:
    """Return the alignment [4] of an ankle below a shank with the alignment `shank` [4]."""
    toes = ankle.replace("ankle", "toes")
    start, end = sources.position(ankle), sources.position(toes)
    bone = sources.far_end(ankle) if start is None or end is None else end - start
    length = np.linalg.norm(bone)
    if length < COINCIDENT_M:
        return shank
    down, ahead = rot.mul_vec(shank, np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]))
    level = bone - (bone @ down) * down
    if np.linalg.norm(level) < _FLAT_FOOT_SHARE * length:  # points down: align it like other bones
        rest = human23().offsets[human23().index(toes)]
        return rot.mul(rot.between(rot.mul_vec(shank, rest), bone), shank)
    if level @ ahead < -_FLAT_FOOT_SHARE * length:
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
    has_spine = sources.position("lumbar") is not None or sources.position("thorax") is not None
    for i, (name, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        into_parent = rot.inv(alignment[parent])
        found = sources.position(name)
        if parent < 0:
            places[i] = sources.zero_pose[sources.place[0]]
            continue
        if found is None:
            # The spine is inside a trunk that is one joint.
            length = 0.0 if not has_spine and name in ("lumbar", "thorax") else scale
            places[i] = places[parent] + rot.mul_vec(alignment[parent], length * body.offsets[i])
        else:
            places[i] = found
        offsets[i] = rot.mul_vec(into_parent, places[i] - places[parent])
        if np.any(body.tips[i]):
            tip = rot.mul_vec(rot.inv(alignment[i]), sources.far_end(name))
            tips[i] = tip if np.linalg.norm(tip) > COINCIDENT_M else scale * body.tips[i]
    if np.allclose(offsets, body.offsets, atol=COINCIDENT_M) and np.allclose(tips, body.tips, atol=COINCIDENT_M):
        return body
    return Skeleton(body.name, body.names, body.parents, offsets, tips)


def unit(v: Floats) -> Floats:
    """Return the direction of a vector [3]; zeros where joints coincide."""
    length = np.linalg.norm(v)
    return v / length if length > COINCIDENT_M else np.zeros(3)
