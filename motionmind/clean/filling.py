"""Gaps: long ones are filled by the engine, from the posture before to the posture after, in the time between."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from motionmind._typing import Bools, Ints
from motionmind.body.motion import Insertion, Motion, Posture
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.retarget.armature import Armature, Pose, animate
from motionmind.retarget.retarget import own_skeleton
from motionmind.tween.engine import Engine

N_AROUND_FRAMES = 16  # on each side of a gap, which show the velocity there


def fill_by_engine(
    motion: Motion, gap: tuple[int, int], known: Bools, engine: Engine, joints: Mapping[str, str] | None = None
) -> Motion:
    """Fill a gap of a recording, y up.

    Args:
        motion: the recording, on any rig that maps to the corpus's skeleton.
        gap: the first frame of the gap and the frame after it; neither the recording's first nor its last frame.
        known: whether each frame is outside of all gaps [T].
        engine: the engine of a corpus.
        joints: {recording's joint: human23's joint}; None recognises the rig by its names.

    Returns:
        The recording with the gap filled; every joint passes the frames around it unchanged.

    Raises:
        SkeletonError: the rig does not map to the corpus's skeleton.
        NoPathError: the corpus knows no movement between the two postures.
    """
    start, stop = gap
    good = np.flatnonzero(known)
    recorded = _frames(motion, good)
    person = own_skeleton(recorded, joints, up="y")
    if (difference := engine.corpus.skeleton.difference(person.skeleton)) is not None:
        raise SkeletonError(f"{motion.name or 'the recording'} is on another skeleton than the corpus: {difference}")
    first, last = (int(np.searchsorted(good, frame)) for frame in (start - 1, stop))
    around = N_AROUND_FRAMES
    before, after = person.slice(max(first + 1 - around, 0), first + 1), person.slice(last, last + around)
    seconds = float(motion.times[stop] - motion.times[start - 1])
    ends = person.posture(first), person.posture(last)
    tween = engine.tween(*ends, before=before, after=after, duration=seconds, fps=motion.fps)
    inner = slice(start, stop)
    begin = float(motion.times[start - 1])
    made = tween.motion.at(motion.times[inner] - begin + tween.motion.times[0])
    own = _on_rig(recorded.posture(first), recorded.posture(last), recorded, tween.motion, made, joints)
    rotations, root = motion.rotations.copy(), motion.root.copy()
    rotations[inner], root[inner] = own.rotations, own.root
    later = [
        replace(one, times=one.times - tween.motion.times[0] + begin)
        for one in own.insertions or (Insertion(tween.motion.times),)
    ]
    marks = sorted([*motion.insertions, *later], key=lambda one: float(one.times[0]))
    return replace(motion, rotations=rotations, root=root, insertions=tuple(marks))


def _frames(motion: Motion, frames: Ints) -> Motion:
    """Return some frames of a motion."""
    return replace(
        motion,
        rotations=motion.rotations[frames],
        root=motion.root[frames],
        times=motion.times[frames],
        insertions=(),
    )


def _on_rig(
    a: Posture, b: Posture, recorded: Motion, whole: Motion, made: Motion, joints: Mapping[str, str] | None
) -> Motion:
    """Return the frames `made` of a whole tween on the rig of a recording, whose postures A and B it joins."""
    skeleton = recorded.skeleton
    offsets = np.stack([skeleton.offsets] * 2)
    offsets[:, 0] = a.root, b.root
    armature = Armature(
        recorded,
        skeleton.parents,
        np.ones((len(skeleton), 3)),
        np.arange(len(skeleton)) == 0,
        np.arange(len(skeleton)),
        np.tile(rot.IDENTITY, (len(skeleton), 1)),
        Pose(np.stack([a.rotations, b.rotations]), offsets),
        (True, True),
        joints,
        "y",
    )
    times = np.concatenate([whole.times[:1], made.times, whole.times[-1:]])
    return armature.motion_of(animate(armature, whole.at(times)), whole.at(times)).slice(1, len(times) - 1)
