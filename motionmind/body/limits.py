"""What no body does: joints beyond their limits are brought back to them."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.anatomy import Anatomy
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.human import BODIES
from motionmind.body.skeleton import Skeleton

BEYOND = 5.0  # degrees
RARE = 0.01


def within_limits(skeleton: Skeleton, rotations: Floats, given: Floats, loose: Bools) -> Floats:
    """The same movement, local rotations [T, J, 4], without angles beyond the limits of its joints.

    Limits are those of the anatomy of human23 or human44, widened to what the postures have that were given
    [G, J, 4]; `loose` joints [J] have none. Angles are clipped one by one, as swing and twist; a body of another kind
    is left as it is.
    """
    anatomy = anatomy_of(skeleton)
    if anatomy is None:
        return rotations
    degrees, shown = np.split(anatomy.degrees(np.concatenate([rotations, given])), [len(rotations)])
    least, most = _limits(anatomy)
    clipped = np.clip(degrees, np.minimum(least, shown.min(axis=0)), np.maximum(most, shown.max(axis=0)))
    beyond = np.any(clipped != degrees, axis=-1) & ~loose
    frames = np.flatnonzero(beyond.any(axis=1))
    if len(frames) == 0:
        return rotations
    named = {name: clipped[frames, joint] for joint, name in enumerate(anatomy.skeleton.names)}
    out = rotations.copy()
    out[frames] = np.where(beyond[frames, :, None], anatomy.rotations(named), rotations[frames])
    return out


def find_loose(skeleton: Skeleton, rotations: Floats) -> Bools:
    """Joints [J] that a corpus's own postures [N, J, 4] have beyond their limits by more than BEYOND, in more than RARE
    of them: what is brought onto a body from another rig need not bend as its anatomy does."""
    anatomy = anatomy_of(skeleton)
    if anatomy is None:
        return np.zeros(len(skeleton), dtype=np.bool_)
    degrees = anatomy.degrees(rotations)
    least, most = _limits(anatomy)
    beyond = np.any((degrees < least - BEYOND) | (degrees > most + BEYOND), axis=-1)
    return np.asarray(beyond.mean(axis=0) > RARE)


def anatomy_of(skeleton: Skeleton) -> Anatomy | None:
    """What is known of a body that has the joints of human23 or human44, whatever its proportions."""
    return next((anatomy_named(name) for name, make in BODIES.items() if make().names == skeleton.names), None)


def _limits(anatomy: Anatomy) -> tuple[Floats, Floats]:
    """Least and greatest angles of all joints [J, 3] about x, y and z, degrees; infinite where none is said."""
    least = np.full((len(anatomy.skeleton), 3), -np.inf)
    most = -least
    for index, name in enumerate(anatomy.skeleton.names):
        for angle in anatomy.anatomy(name)[1].angles.values():
            ends = sorted(angle.sign * end for end in angle.range)
            least[index, angle.axis], most[index, angle.axis] = ends
    return least, most
