"""What a format cannot hold, in words: so that nothing is left out of a file in silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from motionmind.body.human import BODIES
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import enumerated
from motionmind.files import FilePath

_TINY = 1e-6  # seconds and metres


def lossy_fields(motion: Motion, path: FilePath, source: FilePath | None = None) -> list[str]:
    """What of `motion` a file at `path` has no place for, as phrases: "times", "the body's proportions".

    Where it was read from the file `source`, also what that held beside the movement.

    Only what this motion has is named. JSON holds all movement. Names are no loss: in formats without them the file's
    name is the motion's. What no file of the format could be made of (uneven times in BVH and .npz, a body that is
    none of SMPL's in .npz) is refused by those who write it.
    """
    suffix = Path(path).suffix.lower()
    found = []
    if source is not None and Path(source).suffix.lower() == ".json":
        from motionmind.formats.motion_json import holds_variation

        found += ["the variation's original, alternatives and decisions"] * holds_variation(source)
    if suffix == ".json":
        return found
    if suffix == ".txt":
        if len(motion) > 1:
            found.append("times")
        found.append("where the body is")
    elif abs(motion.times[0]) > _TINY:
        found.append(f"the time when it begins, {motion.times[0]:.6g} s")
    found += _body(motion, suffix)
    made = int(motion.inserted().sum())
    if made:
        found.append(f"the marks of frames that the engine made ({made})")
    bridged = [motion.skeleton.names[joint] for joint in np.flatnonzero(motion.bridged().any(axis=0))]
    if bridged:
        found.append(f"the marks of joints that it bridged ({enumerated(bridged)})")
    return found


def _body(motion: Motion, suffix: str) -> list[str]:
    """What is lost of the body that moves."""
    skeleton = motion.skeleton
    found = []
    if suffix in (".txt", ".npz"):
        known = [body() for body in BODIES.values()]
        if suffix == ".npz":
            from motionmind.formats.npz import joints_without_place, smpl_bodies

            known += smpl_bodies().values()
            missing = joints_without_place(motion)
            found = [f"the turns of joints that SMPL does not have ({enumerated(missing)})"] if missing else []
        if not any(_same_places(body, skeleton) for body in known):
            found.insert(0, "the body's proportions")
    elif suffix == ".bvh":
        inner = [joint for joint in set(skeleton.parents[1:]) if skeleton.tips[joint].any()]
        ends = [skeleton.names[joint] for joint in sorted(inner)]
        found = [f"the far ends of joints on which others hang ({enumerated(ends)})"] if ends else []
    return found


def _same_places(one: Skeleton, other: Skeleton) -> bool:
    return (
        one.difference(other) is None
        and np.allclose(one.offsets, other.offsets, atol=_TINY)
        and np.allclose(one.tips, other.tips, atol=_TINY)
    )
