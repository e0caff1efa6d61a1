"""Writes movement on the rig of a file: BVH on the skeleton of another, glTF with the character of another."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from motionmind.body.motion import Motion
from motionmind.clip_names import split_clip
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.files import FilePath
from motionmind.formats import read_motion, write_motion
from motionmind.formats._rig_file import RigFile
from motionmind.formats.programs import note_settings
from motionmind.retarget.armature import animate
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import describe_doubts, fit_upright

RIG_SUFFIXES = (".bvh", ".glb", ".gltf", ".vrm")


def read_rig(
    path: FilePath,
    frames: tuple[int, int] | None = None,
    *,
    motion: Motion | None = None,
    unit: str | float | None = None,
    joints: Mapping[str, str] | None = None,
    up: str | None = None,
) -> RigFile:
    """Read the rig of a file.

    Args:
        path: a file in `RIG_SUFFIXES`; hero.glb#Walk names the clip with the frames.
        frames: its frames before and after movement to come, counted from 0, which that movement then meets in every
            bone; None if that movement begins and ends elsewhere: bones that it does not know then stay as in frame 0.
        motion: the file's movement, as `read_motion` returns it, if known.
        unit: as for `read_motion`.
        joints: {file's joint: human23's joint}; None recognises the rig by its names.
        up: "y" or "z", the vertical in the file; None finds it.

    Raises:
        FormatError: the file has another suffix, or cannot be read.

    Warns:
        MotionMindWarning: as `to_human23`, if `frames` is None: retargeting the frames has warned.
    """
    named, (path, clip) = path, split_clip(path)
    suffix = Path(path).suffix.lower()
    if suffix not in RIG_SUFFIXES:
        raise FormatError(f"no rig to write on: it must end in one of {', '.join(RIG_SUFFIXES)}", path=path)
    motion = motion or read_motion(named, unit=unit)
    for frame in frames or ():
        motion.posture(frame)  # raises if there is none
    if frames is None and joint_mapping(motion.skeleton, joints):
        for doubt in describe_doubts(motion, *fit_upright(motion, joints, up)):
            warnings.warn(doubt, MotionMindWarning, stacklevel=2)
    rig: RigFile
    if suffix == ".bvh":
        from motionmind.formats.bvh_rig_file import read_bvh_rig

        rig = read_bvh_rig(path, motion, frames, unit, clip)
    else:
        from motionmind.formats.glb_rig_file import read_glb_rig

        rig = read_glb_rig(path, motion, frames, unit, clip)
    return replace(rig, armature=replace(rig.armature, mapping=joints, up=up))


def retarget_to_rig(motion: Motion, rig: RigFile) -> Motion:
    """Return a motion on the joints of a rig.

    Args:
        motion: the motion, on the rig's own joints, or on a body that maps to human23.
        rig: the rig.

    Raises:
        SkeletonError: the rig's or the motion's joints do not map to human23.
    """
    return rig.armature.motion_of(animate(rig.armature, motion), motion)


def write_on_rig(path: FilePath, motion: Motion, rig: RigFile) -> Motion:
    """Write a motion on the rig of a file; return it on the rig's joints.

    A file of the rig's kind keeps all of the rig's: names, hierarchy, offsets, orders of rotation, channels and unit of
    BVH; nodes, skins, meshes and materials of glTF. Files of other kinds get its joints.

    Args:
        path: the file to write, .bvh or .glb.
        motion: the motion, on the rig's own joints, or on a body that maps to human23.
        rig: the rig.

    Raises:
        SkeletonError: the rig's or the motion's joints do not map to human23.
        MotionMindError: the file is neither BVH nor GLB, cannot hold the motion, or cannot be written.
    """
    if Path(path).suffix.lower() not in (".bvh", ".glb"):
        raise MotionMindError(f"{path}: only .bvh and .glb are written on a rig")
    if Path(path).suffix.lower() != rig.suffix:
        on_rig = retarget_to_rig(motion, rig)
        write_motion(path, on_rig)
        return on_rig
    pose = animate(rig.armature, motion)
    rig.write(path, pose, motion)
    if rig.suffix == ".bvh":
        note_settings(path, motion, rig.unit)
    return rig.armature.motion_of(pose, motion)
