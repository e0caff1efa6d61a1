"""Reads movement on SMPL's joints from two data sets of dance: AIST++'s `.pkl`, and FineDance's `.npy`.

R. Li, S. Yang, D. Ross and A. Kanazawa, "AI Choreographer: Music Conditioned 3D Dance Generation with AIST++", ICCV
(2021): a pickle (`_unpickle`) of `smpl_poses` [T, 72], rotation vectors of SMPL's 24 joints, `smpl_trans` [T, 3] and
`smpl_scaling` [1], the length of a metre; 60 frames a second.

R. Li et al., "FineDance: A Fine-grained Choreography Dataset for 3D Full Body Dance Generation", ICCV (2023).
An array of frames, 30 a second: a place, then the rotations of SMPL+H's 52 joints, by the first two rows of their
matrices [T, 3 + 312]. Its code also writes four marks of contact in front [T, 319], the body's 22 joints [T, 135], and
rotation vectors of 52 joints [T, 159] or of SMPL-X's 55 [T, 168].

Both worlds are y up. As in `npz`, joints have human44's places: the files have no lengths of bones. The given place is
that of the body model's origin, about 0.24 m above the pelvis in SMPL and 0.35 m in SMPL-X.
"""

from __future__ import annotations

import io
import logging

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_FPS
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, name_of, read_bytes
from motionmind.formats._smpl import smpl_bodies
from motionmind.formats._unpickle import to_array, unpickle
from motionmind.formats.npz import check_array, checked_numbers, in_one_line
from motionmind.geometry import rotations as rot

# {columns: (columns before the place, numbers of a rotation, body)}.
_FINEDANCE_LAYOUTS = {
    315: (0, 6, "SMPL+H"),
    319: (4, 6, "SMPL+H"),
    135: (0, 6, "SMPL body"),
    159: (0, 3, "SMPL+H"),
    168: (0, 3, "SMPL-X"),
}

_log = logging.getLogger(__name__)


def read_aist(path: FilePath, *, fps: float | None = None) -> Motion:
    """Read a motion from AIST++'s `.pkl`, on SMPL's joints, without running any code in the file.

    Args:
        path: the file; its stem becomes the motion's name.
        fps: frames per second; None takes 60.

    Returns:
        The motion, in metres and seconds, y up.

    Raises:
        FormatError: the file does not exist, or its content is invalid; the message says how.
    """
    data = read_bytes(path)
    try:
        held = unpickle(data)
    except Exception as error:  # of the machine's, two dozen classes
        raise FormatError(f"not AIST++'s pickle of arrays: {in_one_line(error)}", path=path) from error
    if not isinstance(held, dict) or not {"smpl_poses", "smpl_trans"} <= held.keys():
        raise FormatError("no 'smpl_poses' and 'smpl_trans': not movement in AIST++'s form", path=path)
    poses, trans, scaling = (
        _array(held.get(name, 1.0), name, path) for name in ("smpl_poses", "smpl_trans", "smpl_scaling")
    )
    body = smpl_bodies()["SMPL"]
    if poses.size != len(poses) * 3 * len(body) or not len(poses) or poses.ndim < 2:
        raise FormatError(f"'smpl_poses' has the shape {list(poses.shape)}, not frames by {3 * len(body)}", path=path)
    if trans.shape != (len(poses), 3):
        raise FormatError(f"'smpl_trans' has the shape {list(trans.shape)}, not [{len(poses)}, 3]", path=path)
    if scaling.size != 1 or not 1e-6 < scaling.item() < 1e6:
        raise FormatError("'smpl_scaling' must be one number above 0", path=path)
    turns = rot.exp(poses.reshape(len(poses), -1, 3))
    return _motion(path, body, turns, trans / scaling.item(), 60.0 if fps is None else fps, pelvis_m=-0.24)


def read_finedance(path: FilePath, *, fps: float | None = None) -> Motion:
    """Read a motion from FineDance's `.npy`, on SMPL's joints.

    Args:
        path: the file; its stem becomes the motion's name.
        fps: frames per second; None takes 30.

    Returns:
        The motion, in metres and seconds, y up.

    Raises:
        FormatError: the file does not exist, or its content is invalid; the message says how.
    """
    data = read_bytes(path)
    try:
        with io.BytesIO(data) as stream:
            check_array(stream, len(data), "the array", path)
            stream.seek(0)
            frames = checked_numbers(np.load(stream, allow_pickle=False), "the array", path)
    except FormatError:
        raise
    except Exception as error:  # numpy's and its parser's
        raise FormatError(f"not a numpy array: {in_one_line(error)}", path=path) from error
    frames = frames[0] if frames.ndim == 3 and len(frames) == 1 else frames
    if frames.ndim != 2 or frames.shape[1] not in _FINEDANCE_LAYOUTS or not len(frames):
        sizes = ", ".join(str(size) for size in _FINEDANCE_LAYOUTS)
        raise FormatError(f"an array of the shape {list(frames.shape)}, not frames by one of {sizes}", path=path)
    before, width, name = _FINEDANCE_LAYOUTS[frames.shape[1]]
    body = smpl_bodies()[name]
    trans, values = frames[:, before : before + 3], frames[:, before + 3 :].reshape(len(frames), -1, width)
    try:
        turns = rot.exp(values) if width == 3 else _from_rows(values)
    except ValueError as error:
        raise FormatError(f"the rows of a rotation's matrix are zero or parallel: {error}", path=path) from error
    return _motion(path, body, turns, trans, 30.0 if fps is None else fps, pelvis_m=-0.35)


def _array(value: object, name: str, path: FilePath) -> Floats:
    """Return a pickle's array of numbers; FormatError if the value is not one."""
    try:
        return checked_numbers(to_array(value), f"'{name}'", path)
    except (ValueError, TypeError, OverflowError) as error:
        raise FormatError(f"{name!r}: {in_one_line(error)}", path=path) from error


def _from_rows(rows: Floats) -> Floats:
    """Return rotations [..., 4] from the first two rows of their matrices [..., 6], made orthonormal in order.

    Source: Zhou et al., "On the continuity of rotation representations in neural networks", CVPR (2019).
    """
    first, second = rows[..., :3], rows[..., 3:]
    with np.errstate(invalid="ignore", divide="ignore"):
        one = first / np.linalg.norm(first, axis=-1, keepdims=True)
        two = second - np.sum(one * second, axis=-1, keepdims=True) * one
        two /= np.linalg.norm(two, axis=-1, keepdims=True)
    if not np.isfinite(two).all():
        raise ValueError("not a rotation")
    return rot.from_matrix(np.stack([one, two, np.cross(one, two)], axis=-2))


def _motion(path: FilePath, body: Skeleton, turns: Floats, trans: Floats, rate: float, *, pelvis_m: float) -> Motion:
    """Build the motion from rotations [T, J, 4], places of the model's origin [T, 3] and the pelvis's height there."""
    if not 0.0 < rate <= MAX_FPS:
        raise MotionMindError(f"fps must be a positive number of frames a second, {MAX_FPS:g} at most, not {rate}")
    _log.info("%s: the file has no lengths of bones; joints have human44's places", path)
    times = np.arange(len(turns), dtype=np.float64) / rate
    return Motion(body, rot.normalise(turns), trans + np.array([0.0, pelvis_m, 0.0]), times, name=name_of(path))
