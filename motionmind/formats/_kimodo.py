"""Reads movement that Kimodo generates, from the arrays of its `.npz`.

Kimodo (NVIDIA, 2026, github.com/nv-tlabs/kimodo, `kimodo/skeleton/definitions.py` and the page on output formats)
writes the places and orientations of joints in the world, y up, 30 frames a second:

    posed_joints     [T, J, 3]     metres
    global_rot_mats  [T, J, 3, 3]  matrices; with all of them the identity the body is in a T-pose, facing +z

J is 77 (SOMA), 30 (SOMA without most of the fingers) or 22 (SMPL's body). The joints' offsets follow from both arrays;
the crown, which only SOMA's 77 joints have, is human23's.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES
from motionmind.body.human import human23
from motionmind.body.noticeable import NOTICEABLE_SPAN_SHARE
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindWarning
from motionmind.files import FilePath
from motionmind.formats._smpl import smpl_bodies
from motionmind.geometry import rotations as rot

KIMODO_FPS = 30.0
KIMODO_ARRAYS = ("posed_joints", "global_rot_mats")
_MAX_MATRIX_ERROR = 1e-2  # of a product of rows, for rotations in half precision

_Rows = tuple[tuple[str, str], ...]  # joint and parent


def _soma(*, is_whole: bool) -> _Rows:
    """Return SOMA's tree of 77 joints if it is whole, else of 30."""
    lengths = {"Thumb": 3, "Index": 4, "Middle": 4, "Ring": 4, "Pinky": 4} if is_whole else {"Thumb": 0, "Middle": 0}

    def chain(parent: str, *names: str) -> _Rows:
        return tuple(zip(names, (parent, *names), strict=False))

    rows = [*chain("", "Hips", "Spine1", "Spine2", "Chest", "Neck1", "Neck2", "Head")]
    rows += [(name, "Head") for name in (*["HeadEnd"] * is_whole, "Jaw", "LeftEye", "RightEye")]
    for side in map(str.capitalize, SIDES):
        rows += chain("Chest", *(f"{side}{name}" for name in ("Shoulder", "Arm", "ForeArm", "Hand")))
        for finger, length in lengths.items():
            knuckles = (*range(1, length + 1), "End")
            rows += chain(f"{side}Hand", *(f"{side}Hand{finger}{knuckle}" for knuckle in knuckles))
    for side in map(str.capitalize, SIDES):
        leg = ("Leg", "Shin", "Foot", "ToeBase", *["ToeEnd"] * is_whole)
        rows += chain("Hips", *(f"{side}{name}" for name in leg))
    return tuple(rows)


def _trees() -> dict[int, tuple[str, tuple[str, ...], tuple[int, ...]]]:
    """Return {number of joints: name, joints and parents} of the bodies."""
    smpl = smpl_bodies()["SMPL body"]
    found = {len(smpl): (smpl.name, smpl.names, smpl.parents)}
    for rows in (_soma(is_whole=False), _soma(is_whole=True)):
        names = tuple(name for name, _ in rows)
        found[len(names)] = "SOMA", names, tuple(names.index(parent) if parent else -1 for _, parent in rows)
    return found


def from_kimodo(arrays: Mapping[str, Floats], path: FilePath) -> tuple[Skeleton, Floats, Floats]:
    """Return the skeleton, the local rotations [T, J, 4] and the root's places [T, 3], metres, y up.

    Args:
        arrays: those in `KIMODO_ARRAYS`.
        path: the file, for messages.

    Raises:
        FormatError: an array is missing, has the shape of no body, or holds no rotations.

    Warns:
        MotionMindWarning: joints move against their parents.
    """
    if missing := [name for name in KIMODO_ARRAYS if name not in arrays]:
        raise FormatError(f"no array {missing[0]!r}: not movement in Kimodo's form", path=path)
    places, matrices = (arrays[name] for name in KIMODO_ARRAYS)
    if places.ndim == 4 and len(places) == 1:  # a batch of one
        places, matrices = places[0], matrices[0] if len(matrices) == 1 else matrices
    trees = _trees()
    if places.ndim != 3 or not len(places) or places.shape[1] not in trees or places.shape[2] != 3:
        wanted = " or ".join(map(str, trees))
        fault = f"'posed_joints' has the shape {list(places.shape)}, not frames by {wanted} joints by 3"
        raise FormatError(f"{fault}{_robot(places)}", path=path)
    if matrices.shape != (*places.shape, 3):
        fault = (
            f"'global_rot_mats' has the shape {list(matrices.shape)}, not {[*places.shape, 3]} as 'posed_joints' has"
        )
        raise FormatError(fault, path=path)
    _check_matrices(matrices, path)
    name, names, parents = trees[places.shape[1]]
    turned, above = rot.from_matrix(matrices), np.maximum(parents, 0)
    local = rot.mul_vec(rot.inv(turned[:, above]), places - places[:, above])
    offsets = local.mean(axis=0)
    strays = rot.norm(local - offsets).max(axis=0)
    joint = int(strays.argmax())
    if strays[joint] > NOTICEABLE_SPAN_SHARE * float(np.abs(np.ptp(places[0], axis=0)).max()):
        far = f"{names[joint]} by up to {1000.0 * strays[joint]:.3g} mm"
        message = f"{path}: joints that move against their parents stay at their mean place: {far}"
        warnings.warn(message, MotionMindWarning, stacklevel=4)
    tips = np.array(smpl_bodies()["SMPL body"].tips) if name != "SOMA" else np.zeros_like(offsets)
    if name == "SOMA" and "HeadEnd" not in names:
        tips[names.index("Head")] = human23().tips[human23().index("atlantal")]
    skeleton = Skeleton(name, names, parents, offsets, tips)
    return skeleton, skeleton.local_rotations(turned), places[:, 0]


def _robot(places: Floats) -> str:
    return "; 34 joints are those of the robot G1" if places.ndim == 3 and places.shape[1] == 34 else ""


def _check_matrices(matrices: Floats, path: FilePath) -> None:
    """Raise FormatError unless all matrices [T, J, 3, 3] are rotations."""
    off = np.abs(matrices @ np.swapaxes(matrices, -1, -2) - np.eye(3)).max(axis=(-1, -2))
    bad = np.argwhere(~(off <= _MAX_MATRIX_ERROR) | ~(np.linalg.det(matrices) > 0.0))
    if len(bad):
        raise FormatError(f"'global_rot_mats'{bad[0].tolist()} is no matrix of a rotation", path=path)
