"""Names the parts of a motion that a format cannot hold, so that no loss is silent."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from motionmind.arguments import check_path, check_type
from motionmind.body.human import BODIES
from motionmind.body.motion import Motion
from motionmind.body.rates import FILM_FPS
from motionmind.body.skeleton import Skeleton
from motionmind.errors import enumerated
from motionmind.files import FilePath
from motionmind.formats.added import added_suffixes, lossy_added

WRITABLE = (".json", ".bvh", ".txt", ".glb", ".npz", ".vrma")  # suffixes


def lossy_fields(motion: Motion, path: FilePath, source: FilePath | None = None) -> list[str]:
    """Name the parts of `motion` that a file at `path` cannot hold: "times", "the body's proportions".

    JSON holds all movement. Names are not a loss: formats without them use the file's name. A format's writer refuses
    motions that it cannot hold at all (uneven times in BVH and .npz, a body that does not map to SMPL's in .npz, or to
    a person's in .vrma).

    Args:
        motion: the movement to write.
        path: the file to write; its suffix determines the format.
        source: the file that the motion comes from, if any; other content of it is lost too.

    Returns:
        The phrases; empty if nothing is lost.

    >>> import numpy as np
    >>> from motionmind import Posture, human23
    >>> from motionmind.formats import lossy_fields
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> lossy_fields(posture.as_motion(), "rest.txt")
    ['where the body is']
    """
    check_type("motion", motion, Motion)
    check_path("path", path)
    check_path("source", source, or_none=True)
    suffix = Path(path).suffix.lower()
    if suffix not in WRITABLE and suffix in added_suffixes():
        return lossy_added(path, motion)
    lossy = []
    if source is not None and Path(source).suffix.lower() == ".json":
        from motionmind.formats.motion_json import holds_variation

        lossy += ["the variation's original, alternatives and decisions"] * holds_variation(source)
    if suffix == ".json":
        return lossy
    if suffix == ".txt" and not motion.is_even:
        lossy.append("times")
    elif abs(motion.times[0]) > 1e-6:
        lossy.append(f"the time when it begins, {motion.times[0]:.6g} s")
    if suffix == ".txt":
        lossy.append("where the body is")
    if suffix != ".glb":
        lossy += _lossy_marks(motion)
    return lossy + _lossy_body(motion, suffix)


def _lossy_marks(motion: Motion) -> list[str]:
    """Name the marks of frames that are lost."""
    lossy = []
    if motion.keyframed and motion.fps >= FILM_FPS:
        lossy.append("that its frames are postures of a score, not of a recording")
    inserted = int(motion.inserted().sum())
    if inserted:
        lossy.append(f"the marks of frames that the engine made ({inserted})")
    bridged = [motion.skeleton.names[joint] for joint in np.flatnonzero(motion.bridged().any(axis=0))]
    if bridged:
        lossy.append(f"the marks of joints that it bridged ({enumerated(bridged)})")
    return lossy


def _lossy_body(motion: Motion, suffix: str) -> list[str]:
    """Name the properties of the body that are lost."""
    skeleton = motion.skeleton
    lossy = []
    if suffix in (".txt", ".npz"):
        known = [body() for body in BODIES.values()]
        if suffix == ".npz":
            from motionmind.formats._smpl import smpl_bodies, unmapped_joints

            known += smpl_bodies().values()
            missing = unmapped_joints(motion)
            lossy = [f"the turns of joints that SMPL does not have ({enumerated(missing)})"] if missing else []
        if not any(_same_proportions(body, skeleton) for body in known):
            lossy.insert(0, "the body's proportions")
    elif suffix == ".vrma":
        from motionmind.formats._smpl import turning_joints
        from motionmind.retarget.joint_mapping import joint_mapping

        kept = joint_mapping(skeleton) or skeleton.names
        missing = [name for name in turning_joints(motion) if name not in kept]
        lossy = [f"the turns of joints that VRM does not have ({enumerated(missing)})"] if missing else []
    elif suffix == ".bvh":
        inner = [joint for joint in set(skeleton.parents[1:]) if skeleton.tips[joint].any()]
        ends = [skeleton.names[joint] for joint in sorted(inner)]
        lossy = [f"the tips of joints with children ({enumerated(ends)})"] if ends else []
    return lossy


def _same_proportions(one: Skeleton, other: Skeleton) -> bool:
    return (
        one.difference(other) is None
        and np.allclose(one.offsets, other.offsets, atol=1e-6)  # metres
        and np.allclose(one.tips, other.tips, atol=1e-6)
    )
