"""Puts together poses on SMPL's joints that a file holds in parts, as the models' programs take them.

Programs that find people in films, and viewers, keep the arguments of the models' published code: `global_orient`,
`body_pose` and `transl`, or `root_orient`, `pose_body` and `trans` as VPoser's code calls them, with hands beside them;
or all at once as `fullpose`, as in XRMoCap's.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motionmind._typing import Floats
from motionmind.errors import FormatError
from motionmind.files import FilePath
from motionmind.formats._smpl import smpl_bodies

_ROOTS, _BODIES, _PLACES = ("global_orient", "root_orient"), ("body_pose", "pose_body"), ("trans", "transl")
_HANDS = (("left_hand_pose", "right_hand_pose"), ("pose_hand",))
NAMES = ("poses", "fullpose", *_PLACES, *_ROOTS, *_BODIES, *(name for names in _HANDS for name in names))
_BODY, _WITH_PALMS, _HAND = 21, 23, 15  # joints


def gather_poses(arrays: Mapping[str, Floats], path: FilePath) -> tuple[Floats, Floats]:
    """Return the rotation vectors [T, 3 J] and the places [T, 3] of arrays of a file, called as in `NAMES`.

    Raises:
        FormatError: there are none, or their shapes are no body's.
    """
    place = next((name for name in _PLACES if name in arrays), "trans")
    whole = next((name for name in ("poses", "fullpose") if name in arrays), "poses")
    root, body = (next((name for name in names if name in arrays), "") for names in (_ROOTS, _BODIES))
    parts = {} if whole in arrays or not (root and body) else {root: arrays[root], body: arrays[body]}
    for name in (place,) if parts else (whole, place):
        if name not in arrays:
            raise FormatError(f"no array {name!r}: not movement as AMASS writes it", path=path)
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
    """Return the rotation vectors [T, 3 J] of the root, of the body, and of both hands if there are such."""
    (root, turn), (body, pose) = parts.items()
    frames = len(turn) if turn.ndim else 0
    if not frames or turn.size != 3 * frames:
        raise FormatError(f"{root!r} has the shape {list(turn.shape)}, not frames by 3 numbers", path=path)
    joints = pose.size / (3 * frames)
    if not pose.ndim or len(pose) != frames or joints not in (_BODY, _WITH_PALMS):
        wanted = f"[{frames}, {3 * _BODY} or {3 * _WITH_PALMS}] as {root!r} has"
        raise FormatError(f"{body!r} has the shape {list(pose.shape)}, not {wanted}", path=path)
    rows = [turn.reshape(frames, 3), pose.reshape(frames, -1)]
    for names in _HANDS:
        hands = [arrays[name] for name in names if name in arrays]
        sizes = [one.size for one in hands]
        if joints == _BODY and sizes == [6 * _HAND * frames // len(names)] * len(names):
            return np.concatenate([*rows, *(one.reshape(frames, -1) for one in hands)], axis=1)
    return np.concatenate(rows, axis=1)
