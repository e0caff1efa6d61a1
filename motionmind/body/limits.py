"""Joint limits: find the joints that a corpus bends beyond them, and clip the angles of others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.skeleton import Skeleton

_N_POSTURES_AT_ONCE = 4096  # bounds the memory for the angles of a large corpus


def within_limits(
    skeleton: Skeleton, rotations: Floats, given: Floats, loose: Bools, joints: Sequence[int] | None = None
) -> Floats:
    """Clip a movement, local rotations [T, J, 4], to the limits of its joints.

    Limits are those of the anatomy of human23 or human44, widened to the angles of the given postures. Swing and twist
    angles are clipped one by one. Other bodies have no limits.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4].
        given: local rotations of postures that define the widened limits [G, J, 4].
        loose: joints without limits [J].
        joints: the joints to clip; None for all.
    """
    from motionmind.body.angles import find_beyond  # numba is slow to import

    anatomy = anatomy_of(skeleton)
    if anatomy is None:
        return rotations
    wanted = np.arange(len(skeleton)) if joints is None else np.array(joints, dtype=np.intp)
    degrees = anatomy.degrees_of(wanted, np.concatenate([rotations, given]))
    degrees, shown = degrees[: len(rotations)], degrees[len(rotations) :]
    least, most = (limits[wanted] for limits in anatomy.limits)
    least, most = np.minimum(least, shown.min(axis=0)), np.maximum(most, shown.max(axis=0))
    beyond = find_beyond(degrees, least, most) & ~loose[wanted]
    frames = np.flatnonzero(beyond.any(axis=1))
    if len(frames) == 0:
        return rotations
    clipped, clips = np.zeros((len(frames), len(skeleton), 3)), np.zeros((len(frames), len(skeleton)), dtype=np.bool_)
    clipped[:, wanted], clips[:, wanted] = np.clip(degrees[frames], least, most), beyond[frames]
    named = {name: clipped[:, joint] for joint, name in enumerate(anatomy.skeleton.names)}
    out = rotations.copy()
    out[frames] = np.where(clips[..., None], anatomy.rotations(named), rotations[frames])
    return out


def find_loose(skeleton: Skeleton, rotations: Floats) -> Bools:
    """Return which joints [J] break their limits by more than 5 degrees in over 1 % of postures [N, J, 4].

    Movement retargeted from another rig may exceed the anatomy's limits.
    """
    anatomy = anatomy_of(skeleton)
    if anatomy is None:
        return np.zeros(len(skeleton), dtype=np.bool_)
    least, most = anatomy.limits
    counts = np.zeros(len(skeleton), dtype=np.int64)
    for start in range(0, len(rotations), _N_POSTURES_AT_ONCE):
        degrees = anatomy.degrees(rotations[start : start + _N_POSTURES_AT_ONCE])
        counts += np.any((degrees < least - 5.0) | (degrees > most + 5.0), axis=-1).sum(axis=0)
    return np.asarray(counts / len(rotations) > 0.01)
