"""Fits rotations of SMPL's joints to their places, by inverse kinematics in closed form.

Places leave the twist of bones open. The fit takes it from the pose:

- pelvis and chest turn as the places of their three children do (Kabsch, "A solution for the best rotation to relate
  two sets of vectors", Acta Cryst. A32 (1976)); the spine between them turns evenly;
- thighs and upper arms twist so that knees and elbows are hinges. A straight limb does not show its twist, so the
  twist is a weighted mean over time (Whittaker, "On a new method of graduation", Proc. Edinburgh Math. Soc. 41 (1923));
- any other bone turns from its parent by the smallest rotation. Hands, head and toes stay at rest against it.

Each bone points from where the fit has its joint to where the file has the next, so errors do not add up.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.formats._smpl import smpl_bodies
from motionmind.geometry import rotations as rot

# Directions of bones at rest, by the joint at their end (right ones with -x), in SMPL's T-pose: roughly those of its
# mean bodies, from which individuals differ by some degrees. A file has the lengths.
_DIRECTIONS = {
    "hip": (0.59, -0.80, -0.11),
    "spine1": (0.0, 0.96, -0.27),
    "knee": (0.10, -0.99, 0.01),
    "spine2": (0.0, 0.99, 0.10),
    "ankle": (-0.03, -0.99, -0.10),
    "spine3": (0.0, 0.97, 0.25),
    "foot": (0.24, -0.42, 0.87),
    "neck": (0.0, 0.98, -0.18),
    "collar": (0.53, 0.83, -0.19),
    "head": (0.0, 0.83, 0.56),
    "shoulder": (0.94, 0.33, -0.12),
    "elbow": (0.99, -0.06, -0.10),
    "wrist": (1.0, 0.04, -0.02),
    "hand": (0.98, -0.12, -0.18),
}
_BRANCHES = ("pelvis", "spine3")
_HINGES = {"hip": "knee", "shoulder": "elbow"}
_HINGE_AXES = {"knee": (1.0, 0.0, 0.0), "elbow": (0.0, -1.0, 0.0)}  # about which they bend; right elbows about +y
_N_SHAPE_STEPS = 5
# Weights of a change of twist within 0.05 s, and of a twist, against that of a limb bent at a right angle, which shows
# its twist. In a run and a walk, thighs and upper arms are off by 2 degrees in the median.
_STEADY_SHARE = 0.25
_REST_SHARE = 4e-4


def fit_joints(places: Floats, rate: float) -> tuple[Skeleton, Floats, Floats]:
    """Fit SMPL's body to places of its joints.

    Args:
        places: of the 22 or 24 joints [T, J, 3], in any unit, y up.
        rate: frames per second.

    Returns:
        The skeleton with the lengths of `places`, the local rotations [T, J, 4], and the places [T, J, 3] that they
        give.

    Raises:
        ValueError: neighbouring joints coincide; the message names them.
    """
    body = next(one for one in smpl_bodies().values() if len(one) == places.shape[1])
    offsets = _rest(body, places)
    turned = np.empty((*places.shape[:2], 4))
    reached = places.copy()
    for joint in range(len(body)):
        children = body.children(joint)
        if joint:
            above = body.parents[joint]
            reached[:, joint] = reached[:, above] + rot.mul_vec(turned[:, above], offsets[joint])
        parent = turned[:, body.parents[joint]] if joint else np.tile(rot.IDENTITY, (len(places), 1))
        bones = places[:, children] - reached[:, joint, None]
        if body.names[joint] in _BRANCHES:
            turned[:, joint] = _best_turn(offsets[children], bones)
            continue
        turned[:, joint] = parent
        if not children:
            continue
        if body.names[joint] in ("spine1", "spine2"):  # halfway to the chest, from below
            chest = body.index("spine3")
            target = _best_turn(offsets[body.children(chest)], places[:, body.children(chest)] - places[:, chest, None])
            turned[:, joint] = rot.slerp(parent, target, 1.0 / (3 - int(body.names[joint][-1])))
        side, _, kind = body.names[joint].partition("_")
        if kind in _HINGE_AXES:
            turned[:, joint] = _bend(parent, _hinge_axis(side, kind), offsets[children[0]], bones[:, 0])
        turned[:, joint] = _aim(turned[:, joint], offsets[children[0]], bones[:, 0])
        if kind in _HINGES:
            below = body.children(children[0])[0]
            axis = _hinge_axis(side, _HINGES[kind])
            lower = places[:, below] - places[:, children[0]]
            twist = _twist(turned[:, joint], offsets[children[0]], axis, offsets[below], lower, rate)
            direction = offsets[children[0]] / np.linalg.norm(offsets[children[0]])
            turned[:, joint] = rot.mul(turned[:, joint], rot.from_axis_angle(direction, twist))
    skeleton = Skeleton(body.name, body.names, body.parents, offsets, body.tips)
    return skeleton, skeleton.local_rotations(turned), reached


def _rest(body: Skeleton, places: Floats) -> Floats:
    """Return the joints' offsets at rest [J, 3]: lengths of `places`, and at branches the mean shape."""
    above = np.maximum(body.parents, 0)
    bones = places - places[:, above]
    lengths = rot.norm(bones).mean(axis=0)
    short = np.flatnonzero(lengths[1:] <= 1e-4 * lengths.sum()) + 1
    if len(short):
        joint = int(short[0])
        raise ValueError(f"{body.names[joint]} and {body.names[above[joint]]} coincide")
    offsets = np.zeros((len(body), 3))
    for joint, name in enumerate(body.names[1:], start=1):
        side, _, kind = name.rpartition("_")
        direction = np.array(_DIRECTIONS[kind]) * ((-1.0, 1.0, 1.0) if side == "right" else (1.0, 1.0, 1.0))
        offsets[joint] = lengths[joint] * direction / np.linalg.norm(direction)
    for branch in _BRANCHES:
        children = body.children(body.index(branch))
        usual = shape = offsets[children]
        for _ in range(_N_SHAPE_STEPS):
            turns = _best_turn(shape, bones[:, children])
            shape = rot.mul_vec(rot.inv(turns)[:, None], bones[:, children]).mean(axis=0)
        offsets[children] = rot.mul_vec(_best_turn(shape, usual[None])[0], shape)
    return offsets


def _best_turn(shape: Floats, bones: Floats) -> Floats:
    """Return the rotations [T, 4] that bring the vectors `shape` [K, 3] nearest to `bones` [T, K, 3]."""
    left, _, right = np.linalg.svd(np.einsum("tki,kj->tij", bones, shape))
    left[..., -1] *= np.sign(np.linalg.det(left @ right))[:, None]
    return rot.from_matrix(left @ right)


def _aim(turned: Floats, offset: Floats, bones: Floats) -> Floats:
    """Return orientations [T, 4] turned by the least so that `offset` [3] points along `bones` [T, 3]."""
    now = rot.mul_vec(turned, offset)
    bones = np.where(rot.norm(bones)[:, None] > 1e-9 * np.linalg.norm(offset), bones, now)
    return rot.mul(rot.between(now, bones), turned)


def _hinge_axis(side: str, kind: str) -> Floats:
    """Return the axis [3] about which a knee or an elbow bends, at rest."""
    return np.array(_HINGE_AXES[kind]) * (-1.0 if (side, kind) == ("right", "elbow") else 1.0)


def _bend(turned: Floats, axis: Floats, offset: Floats, bones: Floats) -> Floats:
    """Return orientations [T, 4] turned about `axis` so that `offset` [3] is nearest to `bones` [T, 3]."""
    seen, across = rot.mul_vec(rot.inv(turned), bones), np.cross(axis, offset)
    level = offset - (axis @ offset) * axis
    return rot.mul(turned, rot.from_axis_angle(axis, np.arctan2(seen @ across, seen @ level)))


def _twist(turned: Floats, upper: Floats, axis: Floats, lower: Floats, bones: Floats, rate: float) -> Floats:
    """Return the angles [T] to twist an upper bone by, so that the lower one hangs from a hinge.

    Args:
        turned: orientations of the upper bone's joint [T, 4].
        upper: the upper bone at rest [3].
        axis: the hinge's axis at rest [3].
        lower: the lower bone at rest [3].
        bones: the lower bone in the world [T, 3].
        rate: frames per second.
    """
    # Turning about the hinge moves the bone from `along` towards `across`.
    along = upper / np.linalg.norm(upper)
    hinge = axis - (axis @ along) * along
    hinge /= np.linalg.norm(hinge)
    across = np.cross(hinge, along)
    seen = rot.mul_vec(rot.inv(turned), bones / np.maximum(rot.norm(bones), 1e-12)[:, None])
    sideways, bent = seen @ hinge, seen @ across
    sine = np.hypot(sideways, bent)
    # A hinge keeps the bone's component along its axis.
    kept = np.clip(lower @ hinge / np.linalg.norm(lower), -sine, sine)
    angles = np.arctan2(sideways, bent) - np.arctan2(kept, np.sqrt(np.maximum(sine**2 - kept**2, 0.0)))
    weights = sine**2
    near = 0.0  # the turn next to the angles before
    for frame, (angle, weight) in enumerate(zip(angles, weights, strict=True)):
        angles[frame] -= 2.0 * np.pi * np.round((angle - near) / (2.0 * np.pi))
        near += weight * (angles[frame] - near)
    if len(angles) == 1:
        return np.asarray(angles * weights / (weights + _REST_SHARE))
    # The minimum of weights (twist - angles)^2 + steady (change of twist)^2 + pull twist^2.
    steady = _STEADY_SHARE * (0.05 * rate) ** 2
    bands = np.zeros((2, len(angles)))
    bands[1] = weights + _REST_SHARE + 2.0 * steady
    bands[1, [0, -1]] -= steady
    bands[0, 1:] = -steady
    return np.asarray(solveh_banded(bands, weights * angles))
