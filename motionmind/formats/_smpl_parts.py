"""Joins poses on SMPL's joints that a file holds in parts, which are the arguments of the models' published code.

Viewers and programs that find people in films keep `global_orient`, `body_pose` and `transl`, or VPoser's
`root_orient`, `pose_body` and `trans`, with hands apart; or all in one as XRMoCap's `fullpose`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motionmind._typing import Floats
from motionmind.errors import FormatError
from motionmind.files import FilePath
from motionmind.formats._smpl import smpl_bodies

_ROOT_NAMES, _BODY_NAMES, _PLACE_NAMES = (
    ("global_orient", "root_orient"),
    ("body_pose", "pose_body"),
    ("trans", "transl"),
)
_HAND_NAMES = (("left_hand_pose", "right_hand_pose"), ("pose_hand",))
ARRAY_NAMES = ("poses", "fullpose", *_PLACE_NAMES, *_ROOT_NAMES, *_BODY_NAMES, *sum(_HAND_NAMES, ()))
_N_BODY_JOINTS, _N_HAND_JOINTS = 21, 15


def gather_poses(arrays: Mapping[str, Floats], path: FilePath) -> tuple[Floats, Floats]:
    """Return the rotation vectors [T, 3 J] and the places [T, 3] from a file's arrays, by names in `ARRAY_NAMES`.

    Raises:
        FormatError: an array is missing, or has a shape of no body.
    """
    place = next((name for name in _PLACE_NAMES if name in arrays), "trans")
    whole = next((name for name in ("poses", "fullpose") if name in arrays), "poses")
    root, body = (next((name for name in names if name in arrays), "") for names in (_ROOT_NAMES, _BODY_NAMES))
    parts = {} if whole in arrays or not (root and body) else {root: arrays[root], body: arrays[body]}
    for name in (place,) if parts else (whole, place):
        if name not in arrays:
            raise FormatError(f"no array {name!r}: not movement in AMASS's form", path=path)
    poses = _join(parts, arrays, path) if parts else arrays[whole]
    if whole == "fullpose" and poses.ndim == 3:
        poses = poses.reshape(len(poses), -1)
    what = " and ".join(map(repr, parts)) or repr(whole)
    if not poses.size or all(poses.shape[1:] != (3 * len(one),) for one in smpl_bodies().values()):
        sizes = ", ".join(str(3 * len(one)) for one in smpl_bodies().values())
        raise FormatError(f"{what} has the shape {list(poses.shape)}, not frames by one of {sizes}", path=path)
    trans = arrays[place]
    if trans.shape != (len(poses), 3):
        fault = f"{place!r} has the shape {list(trans.shape)}, not [{len(poses)}, 3] as {what} has"
        raise FormatError(fault, path=path)
    return poses, trans


def _join(parts: Mapping[str, Floats], arrays: Mapping[str, Floats], path: FilePath) -> Floats:
    """Return the rotation vectors [T, 3 J] of the root, the body, and both hands if present."""
    (root, turn), (body, pose) = parts.items()
    frames = len(turn) if turn.ndim else 0
    if not frames or turn.size != 3 * frames:
        raise FormatError(f"{root!r} has the shape {list(turn.shape)}, not frames by 3 numbers", path=path)
    joints = pose.size / (3 * frames)
    n_with_palms = _N_BODY_JOINTS + 2
    if not pose.ndim or len(pose) != frames or joints not in (_N_BODY_JOINTS, n_with_palms):
        wanted = f"[{frames}, {3 * _N_BODY_JOINTS} or {3 * n_with_palms}] as {root!r} has"
        raise FormatError(f"{body!r} has the shape {list(pose.shape)}, not {wanted}", path=path)
    rows = [turn.reshape(frames, 3), pose.reshape(frames, -1)]
    for names in _HAND_NAMES:
        hands = [arrays[name] for name in names if name in arrays]
        sizes = [one.size for one in hands]
        if joints == _N_BODY_JOINTS and sizes == [6 * _N_HAND_JOINTS * frames // len(names)] * len(names):
            return np.concatenate([*rows, *(one.reshape(frames, -1) for one in hands)], axis=1)
    return np.concatenate(rows, axis=1)
