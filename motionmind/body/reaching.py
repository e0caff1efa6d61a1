"""Brings a joint to a place by turning the joints that lead to it."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot

_CLOSE = 1e-6  # metres
_A_LIMB = 0.2  # share of the longest way out from the root that is at least as long as a limb
_STEPS = 60
_DAMPING = 1e-3  # metres: of steps where the limb is nearly stretched
_MOST = 0.5  # radians that a joint turns by in a step


def chain_to(skeleton: Skeleton, joint: int) -> list[int]:
    """Return the joints that turn to bring one to a place: those of its limb before it, or else all before it.

    A limb ends where another hangs from the same joint. Fingers and helpers are too short to be limbs.
    """
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    reaches = np.zeros(len(skeleton))  # from a joint to the far end of what hangs from it, along the bones
    for child in range(len(skeleton) - 1, 0, -1):
        parent = skeleton.parents[child]
        reaches[parent] = max(reaches[parent], lengths[child] + reaches[child])
    limb: list[int] = []
    below, at = joint, skeleton.parents[joint]
    while at >= 0:
        others = [lengths[child] + reaches[child] for child in skeleton.children(at) if child != below]
        if max(others, default=0.0) >= _A_LIMB * reaches[0]:
            break
        limb.insert(0, at)
        below, at = at, skeleton.parents[at]
    return limb or _before(skeleton, joint)


def _before(skeleton: Skeleton, joint: int) -> list[int]:
    """Return the joints from the root to the one before a joint."""
    out: list[int] = []
    while (joint := skeleton.parents[joint]) >= 0:
        out.insert(0, joint)
    return out


def reach(skeleton: Skeleton, rotations: Floats, root: Floats, joint: int, place: Floats) -> Floats:
    """Return the rotations [J, 4] with one joint as near to a place as it comes, the others hardly changed.

    Damped least squares: Buss, "Introduction to inverse kinematics with Jacobian transpose, pseudoinverse and damped
    least squares methods" (2004).

    Args:
        skeleton: the body.
        rotations: of its joints [J, 4].
        root: place of the root joint [3], metres; it stays.
        joint: the joint.
        place: where it should be [3], metres.
    """
    chain, out = chain_to(skeleton, joint), rotations.copy()
    for _ in range(_STEPS):
        places = skeleton.positions(out, root)
        off = place - places[joint]
        if not chain or np.linalg.norm(off) < _CLOSE:
            break
        levers = places[joint] - places[chain]
        # The place's derivative by the turns of each joint, about the world's axes [3, 3 C].
        turns = np.concatenate([np.cross(np.eye(3), lever).T for lever in levers], axis=1)
        step = turns.T @ np.linalg.solve(turns @ turns.T + _DAMPING**2 * np.eye(3), off)
        step *= min(1.0, _MOST / max(float(np.abs(step).max()), 1e-12))
        placed = skeleton.global_rotations(out)
        for turn, one in zip(step.reshape(-1, 3), chain, strict=True):
            parent = skeleton.parents[one]
            above = rot.IDENTITY if parent < 0 else placed[parent]
            out[one] = rot.normalise(rot.mul(rot.inv_mul(above, rot.mul(rot.exp(turn), above)), out[one]))
    return out
