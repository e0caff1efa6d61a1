"""Retargets movement onto human23.

Each joint of human23 takes the global rotation of the file's joint that maps to it, times a constant *alignment*: the
orientation of human23's axes in the frame of the file's joint. So the same movement has the same rotations, on whatever
body and axes it was recorded. The performer's proportions stay.

`motionmind.retarget.fitting` fits the two bodies.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_mapping, check_type
from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindWarning, enumerated
from motionmind.geometry import rotations as rot
from motionmind.retarget.fitting import Fit, fit_human23, unit
from motionmind.retarget.joint_mapping import (
    filled_joints,
    is_human44,
    joint_mapping,
    read_joint_mapping,
)
from motionmind.retarget.rig import plain_names
from motionmind.retarget.vertical import Z_UP_TO_Y_UP, Vertical, check_up, find_vertical

__all__ = ["filled_joints", "joint_mapping", "read_joint_mapping", "to_human23"]

Movement = TypeVar("Movement", Motion, Posture)

_MIN_COS_LEAN = 0.7  # between the trunk and the axis along which a body stands


def to_human23(movement: Movement, joints: Mapping[str, str] | None = None, *, up: str | None = None) -> Movement:
    """Retarget movement to human23's joints, with the performer's proportions.

    Forward kinematics reproduces the file's joint positions exactly, except where several joints of the file became
    one: a straight bone then replaces a bent chain. In a spine the lumbar joint's bone points to the arms. CMU's three
    spine joints become two, without the lower neck: in 20 clips of a dancer arms are 1 mm off on average and 10 mm at
    most, and the head 23 mm. In 9 clips of karate these are 0.4 mm, 4 mm and 15 mm. The legs are exact.

    Joints that the file lacks, such as toes or fingers, move with their parents, at human23's place scaled by the
    length of the legs. Movement on human23 is returned unchanged; movement taken from there to human44, whose new
    joints stay at rest, comes back unchanged.

    Args:
        movement: a motion or posture on the file's own skeleton.
        joints: {file's joint: human23's joint} as for `joint_mapping`; None recognises the rig by its names.
        up: "y" or "z", the vertical in the file. None takes the axis that the zero pose stands along, unless the
            movement and its floor show the other one (`motionmind.retarget.vertical`).

    Returns:
        The movement on human23, y up, in metres.

    Raises:
        SkeletonError: the skeleton does not map to human23, or its zero pose does not show how the body stands.
        MotionMindError: `up` is neither "y" nor "z".

    Warns:
        MotionMindWarning: the zero pose does not stand, and the movement does not show the twist of limbs; or it is
            unclear whether people stand or lie.

    >>> import numpy as np
    >>> from motionmind import Posture, human44
    >>> from motionmind.retarget import to_human23
    >>> posture = Posture(human44(), np.tile([0.0, 0.0, 0.0, 1.0], (44, 1)), np.zeros(3))
    >>> len(to_human23(posture).skeleton)
    23
    """
    check_type("movement", movement, Motion, Posture)
    check_mapping("joints", joints, or_none=True)
    check_up(up)
    if (
        joints is None
        and up != "z"
        and human23().difference(movement.skeleton) is None
        and not rests_along_z(movement.skeleton)
    ):
        return movement
    fit, vertical = fit_upright(movement, joints, up)
    for doubt in describe_doubts(movement, fit, vertical):
        warnings.warn(doubt, MotionMindWarning, stacklevel=2)
    upright = to_y_up_world(vertical)
    renamed: dict[str, Any] = {}
    if isinstance(movement, Motion) and movement.insertions:
        mapping = joint_mapping(movement.skeleton, joints) or {}
        renamed["insertions"] = tuple(one.renamed(mapping) for one in movement.insertions)
    turned = movement.skeleton.global_rotations(movement.rotations)[..., fit.rotation_sources, :]
    turned = rot.mul(rot.mul(upright, turned), fit.alignment)
    root = movement.root
    if fit.pelvis > 0 or fit.chest:
        places = rot.mul_vec(upright, movement.skeleton.positions(movement.rotations, movement.root))
        root = places[..., fit.pelvis, :]
        turned = _aim_lumbar(fit, turned, places) if fit.chest else turned
    else:
        root = rot.mul_vec(upright, root)
    rotations = rot.normalise(fit.skeleton.local_rotations(turned))
    return replace(movement, skeleton=fit.skeleton, rotations=rotations, root=root, **renamed)


def fit_upright(movement: Movement, joints: Mapping[str, str] | None, up: str | None) -> tuple[Fit, Vertical]:
    """Fit human23 to a file's skeleton, and find which axis is up; arguments and errors are as for `to_human23`."""
    fit = fit_human23(movement, joints)
    turned = movement.skeleton.global_rotations(movement.rotations)[..., fit.rotation_sources[0], :]
    return fit, Vertical(up) if up else _vertical(fit, movement, turned)


def to_y_up_world(vertical: Vertical) -> Floats:
    """Return the rotation [4] from the world of a file to one with y up."""
    return Z_UP_TO_Y_UP if vertical.axis == "z" else rot.IDENTITY


def describe_doubts(movement: Movement, fit: Fit, vertical: Vertical) -> Iterator[str]:
    """Describe what a file leaves unclear about its bones and its vertical."""
    if fit.unclear:
        yield _describe_unclear(movement.skeleton.name, fit.unclear)
    if vertical.doubt:
        name = (movement.name if isinstance(movement, Motion) else "") or movement.skeleton.name
        yield f"{name}: taken with {vertical.axis} up, which is doubtful: {vertical.doubt}"


def own_skeleton(movement: Movement, joints: Mapping[str, str] | None = None, *, up: str | None = None) -> Movement:
    """Retarget movement to human23 if its joints map there; return it unchanged otherwise.

    Args:
        movement: a motion or posture.
        joints: {file's joint: human23's joint} as for `joint_mapping`; None recognises the rig by its names.
        up: as `to_human23`; ignored if the movement stays on a skeleton other than human44.

    Returns:
        The movement on human23 or on its own skeleton. Movement on human44, which has joints that human23 lacks, stays
        there unless `joints` is given, turned to y up if it rests along z.

    Raises:
        SkeletonError: as `to_human23`.

    >>> import numpy as np
    >>> from motionmind import Posture, human23, own_skeleton
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> own_skeleton(posture).skeleton.name
    'human23'
    """
    check_type("movement", movement, Motion, Posture)
    check_mapping("joints", joints, or_none=True)
    if joints is None and is_human44(movement.skeleton):
        return _rest_along_y(movement, up) if rests_along_z(movement.skeleton) else movement
    known = joint_mapping(movement.skeleton) is not None
    return to_human23(movement, joints, up=up) if known or joints is not None else movement


def _aim_lumbar(fit: Fit, turned: Floats, places: Floats) -> Floats:
    """Turn the lumbar joint so that arms, or the neck, reach their places in the file.

    Only the lumbar joint's bone, which represents several, changes its direction; the thorax keeps its orientation.

    Args:
        fit: of human23 to the file's skeleton, with a chest.
        turned: orientations of human23's joints [..., 23, 4].
        places: of the file's joints [..., J, 3], metres.

    Returns:
        The orientations [..., 23, 4].
    """
    body = fit.skeleton
    ours = body.positions(body.local_rotations(turned), places[..., fit.pelvis, :])
    joints, sources = np.array(fit.chest).T
    lumbar, thorax = body.index("lumbar"), body.index("thorax")
    bone = ours[..., thorax, :] - ours[..., lumbar, :]
    wanted = bone + (places[..., sources, :] - ours[..., joints, :]).mean(axis=-2)
    out = turned.copy()
    if min(np.min(rot.norm(bone)), np.min(rot.norm(wanted))) > 0.01:  # metres; shorter bones have no direction
        out[..., lumbar, :] = rot.mul(rot.between(bone, wanted), turned[..., lumbar, :])
    return out


def _describe_unclear(name: str, joints: Sequence[str]) -> str:
    """Say that movement does not show the twist of joints of human23."""
    return (
        f"{name}: with all rotations 0 it does not stand, and {enumerated(joints)} bend too little to show their "
        "twist, which may be wrong"
    )


def _vertical(fit: Fit, movement: Motion | Posture, turned: Floats) -> Vertical:
    """Find which axis is up in a file, by the world's orientations [..., 4] of the joint at the pelvis."""
    body = movement.skeleton
    rotations, root = movement.rotations.reshape(-1, len(body), 4), movement.root.reshape(-1, 3)
    joints = np.unique(fit.rotation_sources)

    def points(some: slice) -> Floats:
        return body.positions_and_tips(rotations[some], root[some])[:, np.concatenate([joints, joints + len(body)])]

    usual = "z" if fit.stands and fit.up[2] >= _MIN_COS_LEAN else "y"
    trunk = rot.mul_vec(turned, fit.up).reshape(-1, 3)
    return find_vertical(points, trunk, usual=usual, height=fit.skeleton.height)


def rests_along_z(skeleton: Skeleton) -> bool:
    """Return whether the zero pose of human23's or human44's joints stands along z, as in Blender's files."""
    zero = skeleton.rest[: len(skeleton)]
    names = plain_names(skeleton.names)
    up = unit(zero[names.index("atlantal")] - zero[names.index("pelvis")])
    return bool(up[2] >= _MIN_COS_LEAN)


def _rest_along_y(movement: Movement, up: str | None) -> Movement:
    """Turn a zero pose that stands along z to stand along y; `up` is the movement's vertical, None for z."""
    body = movement.skeleton
    skeleton = replace(body, offsets=rot.mul_vec(Z_UP_TO_Y_UP, body.offsets), tips=rot.mul_vec(Z_UP_TO_Y_UP, body.tips))
    rotations = rot.mul_inv(rot.mul(Z_UP_TO_Y_UP, movement.rotations), Z_UP_TO_Y_UP)
    root = rot.mul_vec(Z_UP_TO_Y_UP, movement.root)
    if up == "y":
        rotations[..., 0, :] = rot.inv_mul(Z_UP_TO_Y_UP, rotations[..., 0, :])
        root = movement.root
    return replace(movement, skeleton=skeleton, rotations=rotations, root=root)
