"""Brings movement onto the bones of a file: the inverse of `motionmind.retarget.retarget`.

A file may have more bones than human23 has joints: twists, fingers, props, four vertebrae where human23 has two. Bones
with a counterpart take its orientation, through the alignments of `to_human23`. Other bones turn with the bone above,
and blend from their pose at the start of the movement to their pose at its end. Where the file's own postures at the
ends are known, each bone also turns by what retargeting lost there. This correction blends smoothly from one end to the
other, so both ends are exact in every bone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import is_human44, joint_mapping
from motionmind.retarget.retarget import fit_upright, rests_along_z, to_human23, to_y_up_world
from motionmind.retarget.vertical import Z_UP_TO_Y_UP


@dataclass(frozen=True, eq=False)
class Pose:
    """Local transforms of N bones, in T frames.

    Attributes:
        rotations: quaternions [T, N, 4].
        translations: in the frame of the bone above, before its scale [T, N, 3], metres.
    """

    rotations: Floats
    translations: Floats

    def __getitem__(self, frames: slice) -> Pose:
        return Pose(self.rotations[frames], self.translations[frames])


@dataclass(frozen=True, eq=False)
class Armature:
    """The bones of a file: joints of BVH, nodes of glTF.

    Attributes:
        motion: the file's movement on its own skeleton, which shows how its bones are turned.
        parents: index of the bone above each bone [N], which comes before it; -1 for none.
        scales: of the bones [N, 3].
        movable: whether the file can move a bone against the one above [N].
        joints: index of the bone of each joint of the motion's skeleton [J].
        rest: orientation of these bones where the skeleton's rotations are 0 [J, 4].
        ends: the pose before and the pose after movement to come, two frames.
        is_known: whether the poses in `ends` are the first and the last posture of that movement.
        mapping: {file's joint: human23's joint} as for `joint_mapping`; None recognises the rig by its names.
        up: "y" or "z", the vertical in the file; None finds it, as `to_human23` does.
    """

    motion: Motion
    parents: tuple[int, ...]
    scales: Floats
    movable: Bools
    joints: Indices
    rest: Floats
    ends: Pose
    is_known: tuple[bool, bool] = (False, False)
    mapping: Mapping[str, str] | None = None
    up: str | None = None

    def global_frames(self, pose: Pose) -> tuple[Floats, Floats, Floats]:
        """Return the bones' orientations [T, N, 4], places [T, N, 3], metres, and scales [N, 3], in the world."""
        turned, places = np.empty_like(pose.rotations), np.empty_like(pose.translations)
        scales = np.array(self.scales)
        for bone, above in enumerate(self.parents):
            turned[:, bone], places[:, bone] = pose.rotations[:, bone], pose.translations[:, bone]
            if above >= 0:
                turned[:, bone] = rot.mul(turned[:, above], pose.rotations[:, bone])
                arm = rot.mul_vec(turned[:, above], scales[above] * pose.translations[:, bone])
                places[:, bone] = places[:, above] + arm
                scales[bone] = scales[above] * scales[bone]
        return turned, places, scales

    def with_ends_of(self, start: Armature | None, end: Armature | None) -> Armature:
        """Return the armature with the first pose of `start` and the last of `end`, if their bones are the same."""
        first, last = (one if one is not None and one.parents == self.parents else None for one in (start, end))
        ends = (first or last or self).ends[:1], (last or first or self).ends[1:]
        both = (np.concatenate([getattr(one, name) for one in ends]) for name in ("rotations", "translations"))
        return replace(self, ends=Pose(*both), is_known=(first is not None, last is not None))

    def motion_of(self, pose: Pose, like: Motion) -> Motion:
        """Return a pose as a motion on the file's skeleton, with the times, name and marks of another."""
        turned, places, _ = self.global_frames(pose)
        rotations = self.motion.skeleton.local_rotations(rot.mul_inv(turned[:, self.joints], self.rest))
        root = places[:, self.joints[0]]
        skeleton = self.motion.skeleton
        names = _rig_names(skeleton, like.skeleton, self.mapping)
        marks = tuple(one.renamed(names) for one in like.insertions)
        return replace(like, skeleton=skeleton, rotations=rot.normalise(rotations), root=root, insertions=marks)


@dataclass(frozen=True, eq=False)
class _Binding:
    """The joints of a file that those of a body turn.

    Attributes:
        sources: for each of the body's joints, the file's joint that it turns [J].
        alignment: orientation of the body's axes in the frames of these joints [J, 4].
        upright: rotation [4] from the file's world to one with y up.
        pelvis: the file's joint at the place of the body's root.
        body: the moving body with the file's proportions.
        rows: {the file's joint: the one below in its row, with which it turns}.
    """

    sources: Indices
    alignment: Floats
    upright: Floats
    pelvis: int
    body: Skeleton
    rows: Mapping[int, int]


def animate(armature: Armature, motion: Motion) -> Pose:
    """Bring a motion onto a file's bones.

    Args:
        armature: the bones.
        motion: the motion, y up: on the skeleton of the armature's own motion, or on one that maps to human23.

    Returns:
        The pose of the bones in each frame of the motion.

    Raises:
        SkeletonError: the rig or the motion does not map to human23, or a zero pose does not show how the body stands.
    """
    if not _is_own(armature, motion.skeleton):
        motion = to_human23(motion, up="y")
    binding = _bind(armature, motion.skeleton)
    share = ease(motion.times)
    ends_turned, _, sizes = armature.global_frames(armature.ends)
    turned = _turn_bones(armature, binding, motion, ends_turned, share)
    above = [max(parent, 0) for parent in armature.parents]
    rotations = rot.inv_mul(turned[:, above], turned)
    roots = np.array(armature.parents) < 0
    rotations[:, roots] = turned[:, roots]
    first, last = armature.ends.translations
    pose = Pose(rot.normalise(rotations), first + share[:, None, None] * (last - first))
    pelvis = rot.mul_vec(rot.inv(binding.upright), _scale_root(motion, binding.body))
    _move_pelvis(armature, pose, turned, sizes, int(armature.joints[binding.pelvis]), pelvis, share)
    return pose


def ease(times: Floats) -> Floats:
    """Return the share [T] of the movement's end in each frame: 0 to 1, level at both ends."""
    if len(times) == 1:
        return np.zeros(1)
    share = (times - times[0]) / (times[-1] - times[0])
    return np.asarray(share * share * (3.0 - 2.0 * share))


def from_human23(motion: Motion, like: Posture, joints: Mapping[str, str] | None = None) -> Motion:
    """Bring a motion of human23 onto the joints of a posture: the inverse of `to_human23`, with y up.

    Args:
        motion: the motion, on human23.
        like: a posture on the rig to move. Joints without a counterpart keep its rotations; several joints in a row
            that map to one joint turn as one.
        joints: {rig's joint: human23's joint} as for `joint_mapping`; None recognises the rig by its names.

    Returns:
        The motion on the rig's skeleton, with human23's rotations and pelvis.

    Raises:
        SkeletonError: the rig does not map to human23, or its zero pose does not show how the body stands.
    """
    skeleton = like.skeleton
    offsets = np.array(skeleton.offsets)
    offsets[0] = like.root
    armature = Armature(
        like.as_motion(),
        skeleton.parents,
        np.ones((len(skeleton), 3)),
        np.arange(len(skeleton)) == 0,
        np.arange(len(skeleton)),
        np.tile(rot.IDENTITY, (len(skeleton), 1)),
        Pose(np.stack([like.rotations] * 2), np.stack([offsets] * 2)),
        mapping=joints,
        up="y",
    )
    return replace(armature.motion_of(animate(armature, motion), motion), insertions=())


def _rig_names(rig: Skeleton, body: Skeleton, joints: Mapping[str, str] | None) -> Mapping[str, str]:
    """Return {joint of a body: the joint of a file's skeleton at its place}."""
    if joints is None and body.difference(rig) is None:
        return {name: name for name in body.names}
    mapping = joint_mapping(rig, joints) or {}
    return {mapping[name]: name for name in reversed(rig.names) if name in mapping}


def _is_own(armature: Armature, body: Skeleton) -> bool:
    """Return whether a body has the joints of an armature's own motion, by which it is then moved."""
    return armature.mapping is None and body.difference(armature.motion.skeleton) is None


def _bind(armature: Armature, body: Skeleton) -> _Binding:
    """Bind the joints of a body to those of a file's skeleton."""
    skeleton, joints, up = armature.motion.skeleton, armature.mapping, armature.up
    is_same = _is_own(armature, body)
    lies = is_same and (human23().difference(skeleton) is None or is_human44(skeleton)) and rests_along_z(skeleton)
    if is_same and not (lies and not is_human44(skeleton)):
        turn = Z_UP_TO_Y_UP if up == "z" or (lies and up is None) else rot.IDENTITY
        axes = rot.inv(Z_UP_TO_Y_UP) if lies else rot.IDENTITY
        alignment = np.tile(axes, (len(body), 1))
        return _Binding(np.arange(len(body)), alignment, turn, 0, skeleton, {})
    fit, vertical = fit_upright(armature.motion, joints, up)
    mapping = joint_mapping(skeleton, joints) or {}
    last_of_row = {
        skeleton.index(name): int(fit.rotation_sources[human23().index(joint)]) for name, joint in mapping.items()
    }
    rows = {joint: last for joint, last in last_of_row.items() if joint != last}
    return _Binding(fit.rotation_sources, fit.alignment, to_y_up_world(vertical), fit.pelvis, fit.skeleton, rows)


def _scale_root(motion: Motion, body: Skeleton) -> Floats:
    """Return the root's places [T, 3], metres, for a body of other proportions.

    Lengths scale with the legs; the median height of the lowest point scales, too.
    """
    lengths = [_leg_length(one) for one in (body, motion.skeleton)]
    size = lengths[0] / lengths[1] if lengths[1] > 0.0 else 1.0
    root = size * motion.root
    lows = [
        one.positions_and_tips(motion.rotations, place)[..., 1].min(axis=1)
        for one, place in ((body, root), (motion.skeleton, motion.root))
    ]
    return np.asarray(root + np.array([0.0, float(np.median(size * lows[1] - lows[0])), 0.0]))


def _leg_length(body: Skeleton) -> float:
    """Return the length of a person's legs, of all bones of another body, metres."""
    legs = [joint for joint, name in enumerate(body.names) if name.endswith(("_knee", "_ankle"))]
    return float(rot.norm(body.offsets[legs or slice(None)]).sum())


def _turn_bones(armature: Armature, binding: _Binding, motion: Motion, ends_turned: Floats, share: Floats) -> Floats:
    """Return the bones' orientations in the file's world [T, N, 4].

    Args:
        armature: the bones.
        binding: of the motion's joints to them.
        motion: the motion.
        ends_turned: their orientations at the ends [2, N, 4].
        share: of the movement's end in each frame [T].
    """
    body = motion.skeleton.global_rotations(motion.rotations)
    wanted = rot.mul_inv(rot.inv_mul(binding.upright, body), binding.alignment)
    bones, rest = armature.joints, armature.rest
    aimed: dict[int, Floats] = {}
    for joint in reversed(range(len(binding.sources))):  # parents win
        source = binding.sources[joint]
        aimed[int(bones[source])] = rot.mul(wanted[:, joint], rest[source])
    rows = {int(bones[joint]): int(bones[last]) for joint, last in binding.rows.items()}
    for bone, turned in aimed.items():
        lost = [
            rot.inv_mul(turned[end], ends_turned[end, bone]) if known else rot.IDENTITY
            for end, known in zip((0, -1), armature.is_known, strict=True)
        ]
        aimed[bone] = rot.mul(turned, rot.slerp(lost[0], lost[1], share))
    out = np.empty((len(motion), len(armature.parents), 4))
    for bone, above in enumerate(armature.parents):
        if bone in aimed:
            out[:, bone] = aimed[bone]
            continue
        below = rows.get(bone, -1)
        near = below if below in aimed else above
        first, last = (
            armature.ends.rotations[:, bone]
            if near == above
            else rot.inv_mul(ends_turned[:, near], ends_turned[:, bone])
        )
        own = rot.slerp(first, last, share)
        out[:, bone] = own if near < 0 else rot.mul(aimed[near] if near == below else out[:, near], own)
    return out


def _move_pelvis(
    armature: Armature, pose: Pose, turned: Floats, sizes: Floats, pelvis: int, places: Floats, share: Floats
) -> None:
    """Set the translation of the lowest movable bone from the root to the pelvis, to bring the pelvis to its places.

    Args:
        armature: the bones.
        pose: their pose, to be changed.
        turned: their orientations in the world [T, N, 4].
        sizes: their scales in the world [N, 3].
        pelvis: the bone at the pelvis.
        places: of the pelvis in the world [T, 3], metres.
        share: of the movement's end in each frame [T].
    """
    carrier, rise = pelvis, np.zeros_like(places)  # from the moving bone to the pelvis
    while carrier >= 0 and not armature.movable[carrier]:
        above = armature.parents[carrier]
        if above >= 0:
            rise += rot.mul_vec(turned[:, above], sizes[above] * pose.translations[:, carrier])
        carrier = above
    if carrier < 0:
        return
    found, above = places - rise, armature.parents[carrier]
    if above >= 0:
        _, base, _ = armature.global_frames(pose)
        found = rot.mul_vec(rot.inv(turned[:, above]), found - base[:, above]) / sizes[above]
    lost = [
        given[carrier] - found[end] if known else np.zeros(3)
        for end, given, known in zip((0, -1), armature.ends.translations, armature.is_known, strict=True)
    ]
    pose.translations[:, carrier] = found + lost[0] + share[:, None] * (lost[1] - lost[0])
